"""Twelve feet at a time, each well within its own tile, for any length of time, with known positions."""

from dataclasses import dataclass

import numpy as np

from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import default_floor
from underfoot.models import gait
from underfoot.network.live_contacts import LiveContacts

FEET, ROWS, COLUMNS = 12, 6, 8
FORCE_HZ, FRAME_HZ = 250, 60
STAND_S, LIFT_S = 1.5, 0.15
BEGIN_S = 0.6
"""Before this time nobody stands, so that each tile's zero is known."""


@dataclass(frozen=True)
class Frame:
    """A frame of 60 per second: the contacts sent, and the tiles that certainly, and possibly, carry a foot."""

    time_s: float
    contacts: tuple
    certain: frozenset
    possible: frozenset


class Crowd:
    """Twelve feet that come down repeatedly on twelve tiles separated by free ones, with noise on the sensors.

    `frames(seconds)` is the tracked input of a server.
    """

    def __init__(self, seed=5):
        self.floor = default_floor(ROWS, COLUMNS)
        self.tiles = [row * COLUMNS + column for row in range(0, ROWS, 2) for column in range(0, COLUMNS, 2)]
        self._centres_m = np.array([tile.centre_m for tile in self.floor.tiles])
        rng = np.random.default_rng(seed)
        self._rng = rng
        self._phase_s = rng.uniform(0.0, STAND_S + LIFT_S, FEET)

    def feet_n(self, time_s):
        """Return each foot's force, 0 while it is lifted, and its stance, 0 to 1: shape (feet, n)."""
        since_s = time_s - BEGIN_S - self._phase_s[:, None]
        share = np.where(since_s >= 0.0, since_s % (STAND_S + LIFT_S) / STAND_S, -1.0)
        return gait.vertical_force(share.ravel(), 700.0, 500.0, 680.0).reshape(share.shape), share

    def forces(self, feet_n, share):
        """Return the sensors' readings: noise, a tare, and the feet."""
        forces = self._rng.normal(0.0, 0.3, (feet_n.shape[1], len(self.floor.tiles), 4)) + 10.0
        along = 0.1 * (gait.roll(np.clip(share, 0.0, 1.0)) - 0.5)
        for foot, tile in enumerate(self.tiles):
            forces[:, tile] += gait.corner_forces(feet_n[foot], along[foot], 0.0, self.floor.tiles[tile].sensors_m)
        return forces

    def stances(self, seconds):
        """Return how many times a foot has come down, and has been lifted again, by then."""
        cycle = STAND_S + LIFT_S
        passed = (seconds - BEGIN_S - self._phase_s) / cycle
        return int(np.ceil(passed).sum()), int((np.floor(passed) + (passed % 1.0 > STAND_S / cycle)).sum())

    def frames(self, seconds):
        tracker, live = ContactTracker(self.floor, FORCE_HZ), LiveContacts(self.floor)
        edges = np.round(np.arange(1, FRAME_HZ + 1) / FRAME_HZ * FORCE_HZ).astype(int)
        for second in range(round(seconds)):
            time_s = second + np.arange(FORCE_HZ) / FORCE_HZ
            feet_n, share = self.feet_n(time_s)
            forces, begin = self.forces(feet_n, share), 0
            for end in edges:
                tracker.feed(time_s[begin:end], forces[begin:end])
                begin, now_s = end, float(time_s[end - 1])
                yield Frame(
                    now_s,
                    live.update(now_s, tracker.ongoing()),
                    frozenset(self.tiles[foot] for foot in np.flatnonzero(feet_n[:, end - 1] > 25.0)),
                    frozenset(self.tiles[foot] for foot in np.flatnonzero(feet_n[:, end - 1] > 5.0)),
                )

    def tile_at(self, x_m, y_m):
        """Return the tile at a position."""
        return int(np.argmin(np.hypot(*(self._centres_m - (x_m, y_m)).T)))
