"""What every source of force offers to the engine."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor

MAX_SAMPLES = 512
"""Samples that a source may hand over at once."""
SENSOR_HZ = 1000.0
"""Samples a second of a tile, as the thesis's, unless it is said otherwise."""


class SampleBuffers(NamedTuple):
    """Where a source puts the samples that it hands over."""

    stamps: NDArray[np.float64]
    """[MAX_SAMPLES]: the session frame of a sample, on the engine's clock."""
    arrivals: NDArray[np.float64]
    """[MAX_SAMPLES]: the session frame from which the sample counts; at most its stamp where the future is known."""
    forces: NDArray[np.float64]
    """[MAX_SAMPLES, tiles, 4], in newtons, not tared. NaN for a tile of which no sample came for this one."""


class ForceSource(Protocol):
    """Corner forces of a floor, sample by sample, each with the session frame it belongs to.

    `pull` puts the samples that came since into the arrays, which are allocated once, and says how many there are. The
    arrays are those of `SampleBuffers`.
    """

    floor: Floor
    rate_hz: float
    stamps: NDArray[np.float64]
    arrivals: NDArray[np.float64]
    forces: NDArray[np.float64]

    def pull(self, end: int) -> int:
        """Take what came before session frame `end`; at most `MAX_SAMPLES` samples. Allocates nothing."""
        ...


def sample_buffers(floor: Floor) -> SampleBuffers:
    """Buffers for the samples of a floor, zeros."""
    return SampleBuffers(np.zeros(MAX_SAMPLES), np.zeros(MAX_SAMPLES), np.zeros((MAX_SAMPLES, len(floor.tiles), 4)))
