"""Recorded forces, played back at their own rate."""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.force_source import MAX_SAMPLES, sample_buffers
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor
from underfoot.kernels import block_kernel


class Replay:
    """Samples of a force table, the first of them at session frame `start`; looped if `repeats`."""

    def __init__(
        self, forces: ForceSeries, floor: Floor, rate: float, start: int = 0, *, repeats: bool = False
    ) -> None:
        self.floor, self.rate_hz = floor, forces.rate_hz
        self.stamps, _, self.forces = sample_buffers(floor)
        self.arrivals = self.stamps  # the future is known
        # To 1e-6 frames: the seconds of a stretch differ in their last bits from those that count from 0.
        self._frames = np.round((forces.time_s - forces.time_s[0]) * rate, 6) + start
        self._force_n = np.ascontiguousarray(forces.force_n)
        self._length = self._frames[-1] - start + rate / forces.rate_hz
        self._repeats = repeats
        self._next = 0
        self._shift = 0.0
        self._play = _play.specialised(self.stamps, self.forces, self._frames, self._force_n, 0, 0, 0.0, 0.0)

    @property
    def is_finished(self) -> bool:
        """Whether the last sample has been handed over."""
        return self._next >= len(self._frames)

    def pull(self, end: int) -> int:
        """Write the samples before session frame `end` to the buffers."""
        count = 0
        while True:
            count, self._next = self._play(
                self.stamps, self.forces, self._frames, self._force_n, count, self._next, self._shift, end
            )
            if not (self.is_finished and self._repeats) or count == MAX_SAMPLES:
                return count
            self._next, self._shift = 0, self._shift + self._length


@block_kernel
def _play(
    stamps: NDArray[np.float64],
    forces: NDArray[np.float64],
    frames: NDArray[np.float64],
    force_n: NDArray[np.float64],
    count: int,
    first: int,
    shift: float,
    end: float,
) -> tuple[int, int]:
    """Hand over samples from number `first` on, after the `count` already there.

    `frames` (n,) and `force_n` (n, tiles, 4) are as recorded; playback is `shift` frames later. Returns the new count,
    and the number of the next sample.
    """
    i = first
    while count < len(stamps) and i < len(frames) and frames[i] + shift < end:
        stamps[count] = frames[i] + shift
        for k in range(forces.shape[1]):
            for sensor in range(4):
                forces[count, k, sensor] = force_n[i, k, sensor]
        count += 1
        i += 1
    return count, i
