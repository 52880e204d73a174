"""Forces that were recorded, played back at their own pace."""

import numpy as np

from workbench.devices.device import MOST, room
from workbench.floor.forces import Forces
from workbench.floor.layout import Floor


class Replay:
    """Samples of a force table, the first of them at session frame `start`. Over and over if `repeats`."""

    def __init__(self, forces: Forces, floor: Floor, rate: float, start: int = 0, repeats: bool = False) -> None:
        self.floor, self.rate_hz = floor, forces.rate_hz
        self.stamps, self.arrivals, self.forces = room(floor)
        self._frames = (forces.time_s - forces.time_s[0]) * rate + start
        self._force_n = np.ascontiguousarray(forces.force_n)
        self._length = self._frames[-1] - start + rate / forces.rate_hz
        self._repeats = repeats
        self._next = 0
        self._shift = 0.0

    @property
    def over(self) -> bool:
        """Whether the last sample was handed over."""
        return self._next >= len(self._frames)

    def pull(self, end: int) -> int:
        """The samples before session frame `end`."""
        count = 0
        while count < MOST:
            if self.over:
                if not self._repeats:
                    break
                self._next, self._shift = 0, self._shift + self._length
            stamp = self._frames[self._next] + self._shift
            if stamp >= end:
                break
            self.stamps[count] = self.arrivals[count] = stamp
            self.forces[count] = self._force_n[self._next]
            self._next += 1
            count += 1
        return count
