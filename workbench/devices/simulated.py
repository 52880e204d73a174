"""The simulated floor: a walker, and a hand or mouse, on tiles that read at 1 kHz."""

import math

import numpy as np

from workbench.clock import RATE_HZ
from workbench.devices.device import MOST, room
from workbench.floor import simulator, tracking
from workbench.floor.layout import Floor
from workbench.kernels import kernel

SENSOR_HZ = 1000.0
"""Readings a second, as the thesis's tiles."""
LONGEST_S = 600.0
"""The walk is drawn for this long, then begins again."""


class SimulatedFloor:
    """Forces on `floor` as its sensors would read them, noise-free and tared; the same for the same seed.

    Everything a walker will do is known, so every sample arrives in time. `walk` and `press` act from the next one on.
    """

    def __init__(self, floor: Floor, rate: float = RATE_HZ, seed: int = 1, walking: bool = True) -> None:
        self.floor, self.rate_hz = floor, SENSOR_HZ
        self.stamps, self.arrivals, self.forces = room(floor)
        self._period = rate / SENSOR_HZ
        self._rate = float(rate)
        self._plates = tracking.plates(floor)
        self._steps = simulator.footfall_table(floor, LONGEST_S, seed)
        self._shapes = simulator.curves()
        self._walking = np.array([1.0 if walking else 0.0])
        self._hands = np.zeros((len(floor.tiles), 4))  # x, y, force asked for, force now
        self._sample = 0

    def skip(self, frame: int) -> None:
        """Begin at session frame `frame`."""
        self._sample = math.ceil(frame / self._period)

    def walk(self, on: bool) -> None:
        """Let the walker walk, or stand aside."""
        self._walking[0] = float(on)

    def press(self, row: int, x_m: float, y_m: float, force_n: float) -> None:
        """Press on a tile at a place in its frame; 0 lets go."""
        if force_n > 0.0:
            self._hands[row, :2] = x_m, y_m
        self._hands[row, 2] = force_n

    def pull(self, end: int) -> int:
        """The samples before session frame `end`."""
        count = min(max(math.ceil(end / self._period) - self._sample, 0), MOST)
        if count:
            _stand(self.forces, self.stamps, self.arrivals, self._sample, count, self._period)
            if self._walking[0] > 0.0:
                simulator.walk(self.forces, self.stamps, count, self._rate, self._plates, self._steps, self._shapes)
            simulator.press(self.forces, count, self._plates, self._hands)
            self._sample += count
        return count


@kernel
def _stand(forces, stamps, arrivals, first, count, period):
    for i in range(count):
        stamps[i] = arrivals[i] = (first + i) * period
        forces[i] = 0.0
