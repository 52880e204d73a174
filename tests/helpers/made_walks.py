"""Walks with known truth: feet that press with heel and ball on adjacent tiles, read by noisy sensors with a tare."""

from dataclasses import dataclass

import numpy as np

from underfoot.floor.layout import Floor, Tile

PATCH_M = 0.04
"""Half the side of the square patches on which a foot presses."""


def touching_floor(rows, columns, side_m=0.3):
    """Return square tiles edge to edge from (0, 0), with sensors 2 cm within the corners."""
    reach = side_m / 2 - 0.02
    sensors = ((reach, reach), (-reach, reach), (-reach, -reach), (reach, -reach))
    places = [((column + 0.5) * side_m, (row + 0.5) * side_m) for row in range(rows) for column in range(columns)]
    return Floor(tuple(Tile(f"t{i + 1}", (side_m, side_m), place, 0.0, sensors) for i, place in enumerate(places)))


@dataclass(frozen=True)
class Foot:
    """One foot on the floor, which rolls from heel to ball with a double-peaked force."""

    start_s: float
    heel_m: tuple[float, float]
    ball_m: tuple[float, float]
    duration_s: float = 0.65
    peak1_n: float = 800.0
    valley_n: float = 550.0
    peak2_n: float = 780.0

    def force_n(self, time_s):
        """Return quarter sines up to the first peak and down from the second, and half cosines between extremes."""
        p = (np.asarray(time_s) - self.start_s) / self.duration_s
        rise = self.peak1_n * np.sin(np.pi / 2 * p / 0.25)
        down = self.valley_n + (self.peak1_n - self.valley_n) * (0.5 + 0.5 * np.cos(np.pi * (p - 0.25) / 0.25))
        up = self.valley_n + (self.peak2_n - self.valley_n) * (0.5 - 0.5 * np.cos(np.pi * (p - 0.5) / 0.25))
        fall = self.peak2_n * np.sin(np.pi / 2 * (1 - p) / 0.25)
        conditions = [(p <= 0) | (p >= 1), p < 0.25, p < 0.5, p < 0.75]
        return np.select(conditions, [0.0 * p, rise, down, up], fall)

    def ball_share(self, time_s):
        p = np.clip((np.asarray(time_s) - self.start_s) / self.duration_s, 0.0, 1.0)
        return 0.05 + 0.9 * (p - 0.6 * np.sin(2 * np.pi * p) / (2 * np.pi))

    def centre_m(self, time_s):
        share = self.ball_share(time_s)[:, None]
        return (1 - share) * np.array(self.heel_m) + share * np.array(self.ball_m)


def walk(steps, start_s=0.6, heel_m=(0.15, 0.75), step_m=0.6, width_m=0.12, length_m=0.15, step_s=0.54, **kind):
    """Return alternating feet along +x, the left one first; `heel_m` is on the line of the walk."""
    feet = []
    for i in range(steps):
        y = heel_m[1] + (width_m / 2 if i % 2 == 0 else -width_m / 2)
        x = heel_m[0] + i * step_m
        feet.append(Foot(start_s + i * step_s, (x, y), (x + length_m, y), **kind))
    return feet


def corner_forces(floor, feet, time_s):
    """Return the exact forces at the sensors: shape (n, tiles, 4)."""
    forces = np.zeros((len(time_s), len(floor.tiles), 4))
    for foot in feet:
        force, ball = foot.force_n(time_s), foot.ball_share(time_s)
        for place, share in ((foot.heel_m, 1 - ball), (foot.ball_m, ball)):
            here = (force * share)[:, None]
            for k, tile in enumerate(floor.tiles):
                if (split := _of_patch(tile, place)).any():
                    forces[:, k] += here * split
    return forces


def read(forces, rate_hz, noise_n=0.3, tare_n=0.0, drift_n_s=0.0, seed=0):
    """Return the forces as real sensors read them: a tare within 20 % of `tare_n`, drifting up or down, and noise."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(len(forces))[:, None, None] / rate_hz
    tare = tare_n * rng.uniform(0.8, 1.2, forces.shape[1:])
    drift = drift_n_s * rng.uniform(-1.0, 1.0, forces.shape[1:])
    return forces + tare + drift * time_s + rng.normal(0.0, noise_n, forces.shape)


def _of_patch(tile, place_m):
    """Return the share of a patch's load on each of a tile's sensors."""
    half = np.array(tile.size_m) / 2
    low = np.maximum(np.array(place_m) - PATCH_M - tile.centre_m, -half)
    high = np.minimum(np.array(place_m) + PATCH_M - tile.centre_m, half)
    if (low >= high).any():
        return np.zeros(4)
    middle, reach = (low + high) / 2, np.array(tile.sensors_m)
    return np.prod(high - low) / (2 * PATCH_M) ** 2 * 0.25 * np.prod(1 + middle / reach, axis=1)
