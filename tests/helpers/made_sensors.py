"""Sensors and presses independent of the program: curves in closed form, hysteresis, a press robot."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

FULL_N = 200.0

CURVES = {
    "soft conductance": lambda f: 60000.0 * f * f / (f * f + 120.0 * (f + 15.0)),
    "logarithm": lambda f: 8000.0 * np.log1p(f / 8.0),
    "divider that falls": lambda f: 65535.0 / (1.0 + f / 60.0),
    "straight, with an offset": lambda f: 32768.0 + 60.0 * f,
    "power": lambda f: 4000.0 * f**0.4,
    "saturating": lambda f: 50000.0 * np.tanh(f / 120.0),
}


def loadings(rate_hz, seed, count=4, full_n=FULL_N):
    """Return time and force of loadings up and down, unloaded before, between and after."""
    draws = np.random.default_rng(seed)
    pieces = [np.zeros(int(rate_hz))]
    for k in range(count):
        n = int(rate_hz * draws.uniform(1.0, 2.0))
        top = full_n * (1.0 if k == 0 else draws.uniform(0.75, 1.0))
        pieces += [top * np.sin(np.pi * np.arange(n) / n), np.zeros(int(0.3 * rate_hz))]
    force = np.concatenate(pieces)
    return np.arange(force.size) / rate_hz, force


def lagging(force_n, width=0.08):
    """Return the reading of a sensor with a play: it reads `width`, relative to the force, more while force falls."""
    felt, held = np.empty_like(force_n), 0.0
    for i, force in enumerate(force_n):
        held = min(max(held, force), (1.0 + width) * force)
        felt[i] = held
    return felt


def creeping(force_n, rate_hz, creep):
    """Return what a sensor feels on which each increment of the load creeps by the logarithm of its age (Boltzmann)."""
    age_s = np.maximum(np.arange(force_n.size) / rate_hz, 0.01)
    return np.convolve(np.diff(force_n, prepend=0.0), 1.0 + creep * np.log10(age_s))[: force_n.size]


def read(curve, felt_n, seed, gain=1.0, noise=3.0):
    counts = CURVES[curve](gain * felt_n) + noise * np.random.default_rng(seed).standard_normal(felt_n.size)
    return np.clip(np.round(counts), 0.0, 65535.0)


def pairs_rows(curve, rate_hz=100.0, width=0.0, gains=(0.85, 1.0, 1.1, 1.2), count=4):
    """Return the columns of a table of pairs: time, sensor from 0, reading, force."""
    found = []
    for j, gain in enumerate(gains):
        time_s, force = loadings(rate_hz, j, count)
        reading = read(curve, lagging(force, width), 10 + j, gain)
        found.append(np.stack([time_s + 100.0 * j, np.full(force.size, j), reading, force], axis=1))
    return np.concatenate(found)


@dataclass(frozen=True)
class Robot:
    """A robot that presses a plate with a bilinear split at `rows` by `rows` places, with these loads, and its errors.

    Sensors are `moved_m` from their nominal positions, each reads `gains` times its force, the plate twists by a share
    `twist` of the load, and each force is off by `bias_n`.
    """

    sensors_m: np.ndarray
    gains: Sequence[float] = (1.0, 1.0, 1.0, 1.0)
    moved_m: float = 0.0
    twist: float = 0.0
    bias_n: float = 0.0
    noise_n: float = 0.0
    inset_m: float = 0.02
    side_m: float = 0.305
    rows: int = 7
    loads: Sequence[float] = (100.0, 200.0, 400.0)
    seed: int = 0

    def presses(self):
        """Return positions, loads and corner forces."""
        draws = np.random.default_rng(self.seed)
        true_m = self.sensors_m + draws.uniform(-self.moved_m, self.moved_m, self.sensors_m.shape)
        line = np.linspace(self.inset_m - self.side_m / 2.0, self.side_m / 2.0 - self.inset_m, self.rows)
        at = np.repeat([(x, y) for x in line for y in line], len(self.loads), axis=0)
        load = np.tile(self.loads, self.rows**2)
        # The only split without twist: sum and both moments are right, and forces are linear in the sensor's x, y, xy.
        equations = np.vstack([np.ones(4), true_m.T, np.sign(self.sensors_m.prod(axis=1))])
        warp = at.prod(axis=1) / 0.1335**2 + self.twist
        wanted = load * np.stack([np.ones(len(at)), *at.T, warp])
        forces = np.linalg.solve(equations, wanted).T * self.gains
        noise = self.noise_n * draws.standard_normal(forces.shape)
        return at, load, forces + self.bias_n * np.array([1.0, -1.0, 0.5, 0.0]) + noise
