"""The interface of force sources to the engine."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor

MAX_SAMPLES = 512
"""Most samples that a source hands over at once."""
SENSOR_HZ = 1000.0
"""Default sample rate of a tile, as in the thesis."""
WITHOUT_HARDWARE = ("simulator", "replay")
"""Kinds of targets that need no transport; none has one of these schemes."""


class SampleBuffers(NamedTuple):
    """Buffers into which a source writes samples."""

    stamps: NDArray[np.float64]
    """[MAX_SAMPLES]: session frame of a sample, on the engine's clock."""
    arrivals: NDArray[np.float64]
    """[MAX_SAMPLES]: session frame from which the sample is valid; at most its stamp if the future is known."""
    forces: NDArray[np.float64]
    """[MAX_SAMPLES, tiles, 4], in newtons, not tared. NaN for a tile without a sample of its own."""


class ForceSource(Protocol):
    """Corner forces of a floor, sample by sample, each with its session frame.

    `pull` writes the samples received since the last call into the arrays, which are allocated once, and returns their
    number. The arrays are those of `SampleBuffers`.
    """

    floor: Floor
    rate_hz: float
    stamps: NDArray[np.float64]
    arrivals: NDArray[np.float64]
    forces: NDArray[np.float64]

    def pull(self, end: int) -> int:
        """Write the samples before session frame `end`, at most `MAX_SAMPLES`; return their number. No allocation."""
        ...


def sample_buffers(floor: Floor) -> SampleBuffers:
    """Return zeroed buffers for the samples of a floor."""
    return SampleBuffers(np.zeros(MAX_SAMPLES), np.zeros(MAX_SAMPLES), np.zeros((MAX_SAMPLES, len(floor.tiles), 4)))
