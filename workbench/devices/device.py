"""What every source of force offers to the engine."""

from typing import Protocol

import numpy as np

from underfoot.floor.layout import Floor

MOST = 512
"""Samples that a source may hand over at once."""


class ForceSource(Protocol):
    """Corner forces of a floor, sample by sample, each with the session frame it belongs to.

    `pull` puts the samples that came since into the arrays, which are taken once, and says how many there are.
    """

    floor: Floor
    rate_hz: float
    stamps: np.ndarray
    """float64 [MOST]: the session frame of a sample, on the engine's clock."""
    arrivals: np.ndarray
    """float64 [MOST]: the session frame from which the sample counts; at most its stamp where the future is known."""
    forces: np.ndarray
    """float64 [MOST, tiles, 4], in newtons, not tared. NaN for a tile of which no sample came for this one."""

    def pull(self, end: int) -> int:
        """Take what came before session frame `end`; at most `MOST` samples. Allocates nothing."""
        ...


class Port(Protocol):
    """A line from which bytes come. `name` is what the person knows it by."""

    name: str

    def open(self) -> None:
        """Open it; `DeviceError` where it is not there."""
        ...

    def read(self) -> bytes | memoryview:
        """What came, at the latest after a tenth of a second; `DeviceError` where it has gone away."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


def room(floor: Floor) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays for stamps, arrivals and forces."""
    return np.zeros(MOST), np.zeros(MOST), np.zeros((MOST, len(floor.tiles), 4))
