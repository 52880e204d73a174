"""A scene rehearsed with hands that press and release tiles at given times."""

from collections import deque
from typing import NamedTuple

from underfoot.clock import RATE_HZ
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.scenes.rehearsal import rehearse


class TimedPress(NamedTuple):
    """Force of a hand on a tile from a time on, at a place in the tile's frame; 0 N releases the tile."""

    time_s: float
    tile: str
    x_m: float
    y_m: float
    force_n: float


def rehearse_presses(scene, hands, seconds):
    return rehearse(scene, _Hands(scene.floor, hands), seconds)


class _Hands(SimulatedFloor):
    """A simulated floor without walkers, with hands that press at given times."""

    def __init__(self, floor, hands):
        super().__init__(floor, walking=False)
        self._due = deque(sorted(hands, key=lambda hand: hand.time_s))

    def pull(self, end):
        while self._due and self._due[0].time_s * RATE_HZ < end:
            hand = self._due.popleft()
            self.press(self.floor.index(hand.tile), hand.x_m, hand.y_m, hand.force_n)
        return super().pull(end)
