"""Cracks in a sheet of ice, as the thesis grows them (5.5.2): seeds under the foot, and fronts that run from them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.experiments.seeded_random import SeededRandom

FEWEST_FRONTS, MOST_FRONTS = 2, 6
"""Range of the number of latent fronts of a seed, uniform."""

Point = tuple[float, float]


@dataclass
class Front:
    """End of a crack, and the unit vector in which it runs."""

    at_m: Point
    way: Point
    is_at_edge: bool = False


@dataclass
class Seed:
    """Origin of cracks."""

    at_m: Point
    fronts: list[Front]


class Cracks:
    """Cracks within a rectangle from `low_m` to `high_m`; beyond `most` lines the oldest disappear.

    >>> cracks = Cracks((-1.0, -1.0), (1.0, 1.0), 100)
    >>> cracks.grow((0.0, 0.0), 0.02, 0.1, 0.3, SeededRandom(1))
    >>> len(cracks.seeds), len(cracks.lines_m)
    (1, 0)
    """

    def __init__(self, low_m: Point, high_m: Point, most: int) -> None:
        self._low, self._high = np.array(low_m), np.array(high_m)
        self.most = most
        self._ends = np.zeros((most, 2, 2))
        self.count = 0
        """Lines that ever were."""
        self.seeds: list[Seed] = []
        """Those that can still grow."""

    @property
    def lines_m(self) -> NDArray[np.float64]:
        """The present lines by their ends, the oldest first: shape (n, 2, 2)."""
        return self.latest_m(0)

    def latest_m(self, first: int) -> NDArray[np.float64]:
        """Return the present lines from number `first` on, counted over all that ever were: shape (n, 2, 2)."""
        return self._ends[np.arange(max(first, self.count - self.most), self.count) % self.most]

    def grow(self, under_m: Point, length_m: float, spacing_m: float, turn: float, draws: SeededRandom) -> None:
        """Grow the cracks by one event under a foot.

        Without a growing seed within `spacing_m`, a new one begins. Otherwise each of the n fronts of the nearest seed
        runs on by `length_m` with probability 1 / n; its unit vector turns by a normal draw of standard deviation
        `turn`.
        """
        self.seeds = [seed for seed in self.seeds if not all(front.is_at_edge for front in seed.fronts)]
        nearest = min(self.seeds, key=lambda seed: math.dist(seed.at_m, under_m), default=None)
        if nearest is None or math.dist(nearest.at_m, under_m) > spacing_m:
            self.seeds.append(_seed(under_m, draws))
            del self.seeds[: -self.most]
            return
        for front in nearest.fronts:
            if draws.happens(1.0 / len(nearest.fronts)) and not front.is_at_edge:
                self._extend(front, length_m, turn * _normal(draws))

    def _extend(self, front: Front, length_m: float, beta: float) -> None:
        """Extend a crack from its front, up to the edge of the sheet."""
        x, y = front.way
        x, y = x - beta * y, y + beta * x
        size = math.hypot(x, y)
        front.way = x / size, y / size
        begin = np.array(front.at_m)
        end = np.clip(begin + length_m * np.array(front.way), self._low, self._high)
        front.is_at_edge = bool(((end <= self._low) | (end >= self._high)).any())
        self._ends[self.count % self.most] = begin, end
        self.count += 1
        front.at_m = float(end[0]), float(end[1])


def _seed(at_m: Point, draws: SeededRandom) -> Seed:
    count = draws.one_of(range(FEWEST_FRONTS, MOST_FRONTS + 1))
    first = draws.uniform(0.0, 2.0 * math.pi)
    angles = [first + 2.0 * math.pi * k / count for k in range(count)]
    return Seed(at_m, [Front(at_m, (math.cos(angle), math.sin(angle))) for angle in angles])


def _normal(draws: SeededRandom) -> float:
    """Draw a normal value with mean 0 and standard deviation 1 (Box and Muller)."""
    radius = math.sqrt(-2.0 * math.log(1.0 - draws.uniform(0.0, 1.0)))
    return radius * math.cos(draws.uniform(0.0, 2.0 * math.pi))
