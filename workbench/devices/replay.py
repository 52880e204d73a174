"""Forces that were recorded, played back at their own pace."""

import numpy as np

from underfoot.devices.device import MOST, room
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor
from underfoot.kernels import kernel


class Replay:
    """Samples of a force table, the first of them at session frame `start`. Over and over if `repeats`."""

    def __init__(self, forces: ForceSeries, floor: Floor, rate: float, start: int = 0, repeats: bool = False) -> None:
        self.floor, self.rate_hz = floor, forces.rate_hz
        self.stamps, self.arrivals, self.forces = room(floor)
        self._frames = (forces.time_s - forces.time_s[0]) * rate + start
        self._force_n = np.ascontiguousarray(forces.force_n)
        self._length = self._frames[-1] - start + rate / forces.rate_hz
        self._repeats = repeats
        self._next = 0
        self._shift = 0.0
        self.pull(start)  # which has no sample yet, but loads the kernel before it is needed in time

    @property
    def over(self) -> bool:
        """Whether the last sample was handed over."""
        return self._next >= len(self._frames)

    def pull(self, end: int) -> int:
        """The samples before session frame `end`."""
        count = 0
        while True:
            count, self._next = _play(
                self.stamps, self.arrivals, self.forces, self._frames, self._force_n, count, self._next, self._shift,
                end,
            )  # fmt: skip
            if not (self.over and self._repeats) or count == MOST:
                return count
            self._next, self._shift = 0, self._shift + self._length


@kernel
def _play(stamps, arrivals, forces, frames, given, count, i, shift, end):
    """Hand over samples from number i on, behind the `count` that are there: how many there are now, and the next."""
    while count < len(stamps) and i < len(frames) and frames[i] + shift < end:
        stamps[count] = arrivals[count] = frames[i] + shift
        forces[count] = given[i]
        count += 1
        i += 1
    return count, i
