"""A hand without noise, with a load cell or weights, for procedures on presses."""

import numpy as np

from underfoot.calibration.procedure import step
from underfoot.calibration.rig import Readings
from underfoot.floor.layout import default_floor

TILE = default_floor(1, 1).tiles[0]
RATE_HZ = 100.0


class Hand:
    """Presses exactly what is asked, on sensors that read 20 counts a newton from 2000 on; tests spoil something.

    `reach` is how far towards a sensor it presses, as a share of the way from the tile's middle.
    """

    def __init__(self, counts=None, load=None, force=True, spoil=lambda readings: None, reach=1.0):
        self.spoil, self.reach = spoil, reach
        self.counts = counts or (lambda corners: 2000.0 + 20.0 * corners)
        self.load, self.has_cell = load or (lambda press, force: force), force
        self.time, self.force, self.asked, self.reads = 0.0, 0.0, None, 0
        self.at_m, self.empty = (0.0, 0.0), 0

    def press(self, press):
        self.asked = press

    def read(self):
        self.reads += 1
        assert self.reads < 20_000, f"stuck at {self.asked}"
        n = 10
        if self.at_m != self.asked.at_m and self.empty >= 3:
            self.at_m = self.asked.at_m
        wanted = self.asked.force_n if self.at_m == self.asked.at_m else 0.0
        self.empty = self.empty + 1 if self.force == 0.0 else 0
        force = self.force + np.clip(wanted - self.force, -40.0, 40.0) * np.arange(1, n + 1) / n
        self.force = float(force[-1])
        x, y = self.reach * np.array(self.at_m) / TILE.sensors_m[0]
        corners = np.outer(self.load(self.asked, force), 0.25 * (1 + np.array([x, -x, -x, x]) + np.array([y, y, -y, -y])
                           + np.array([x * y, -x * y, x * y, -x * y])))  # fmt: skip
        time_s = self.time + np.arange(1, n + 1) / RATE_HZ
        self.time = float(time_s[-1])
        readings = Readings(time_s, self.counts(corners), force if self.has_cell else None)
        self.spoil(readings)
        return readings

    def close(self):
        pass


def walked(procedure, rig, values=None, until="result"):
    """Step to the page whose key begins so."""
    while not procedure.page.key.startswith(until):
        step(procedure, rig, values)
    return procedure.page
