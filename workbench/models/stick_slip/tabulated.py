"""Tabulated distribution, dense enough for linear interpolation."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import array, number
from underfoot.drawing import Drawing, series
from underfoot.drawing.picture import Picture

_MOST_HALVINGS = 12


@dataclass(frozen=True, repr=False)
class Distribution:
    """Distribution of one quantity, tabulated so densely that linear interpolation keeps the requested error.

    >>> Distribution(np.array([0.0, 2.0]), np.array([0.5, 0.5]), np.array([0.0, 1.0]), 0.0, "duration, s")
    <Distribution of duration, s: median 1, 2 points>
    """

    points: NDArray[np.float64]
    """Values of the quantity, rising: s or m."""
    density: NDArray[np.float64]
    """Probability density at the points, 1/s or 1/m."""
    cdf: NDArray[np.float64]
    """Probability, over all slips, up to each point; it ends at 1 - `unobserved`."""
    unobserved: float
    """Probability that the quantity has no value, e.g. because the slip still lasts at the end of the observation."""
    name: str = "value"
    """Name of the quantity, with its unit."""

    def __repr__(self) -> str:
        half = f"{self.quantile(0.5):.4g}" if self.cdf.size and self.cdf[-1] >= 0.5 else "none"
        return f"<Distribution of {self.name}: median {half}, {self.points.size} points>"

    def cdf_at(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return the probability up to these values of the quantity, of any shape.

        >>> Distribution(np.array([0.0, 2.0]), np.array([0.5, 0.5]), np.array([0.0, 1.0]), 0.0).cdf_at([0.5, 3.0])
        array([0.25, 1.  ])
        """
        return np.asarray(np.interp(array("values", values, "numbers"), self.points, self.cdf))

    def quantile(self, probability: float) -> float:
        """Return the value at this cumulative probability; NaN if it is never reached. `BadValue` beyond 0 to 1."""
        number("probability", probability, 0.0, 1.0, "a number, 0 to 1")
        reached = self.cdf.size > 0 and probability <= self.cdf[-1]
        return float(np.interp(probability, self.cdf, self.points)) if reached else float("nan")

    def plot(self) -> Picture:
        """Return a picture of density and distribution function."""
        density = Drawing("Density", self.name, "density, 1/unit", (series("", self.points, self.density),))
        cdf = Drawing("Distribution", self.name, "probability", (series("", self.points, self.cdf, colour="force"),))
        return Picture((density, cdf))


def tabulate(
    density_and_cdf: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ends: tuple[float, float],
    seeds: NDArray[np.float64],
    tolerance: float,
    unobserved: float,
    name: str = "value",
) -> Distribution:
    """Tabulate a distribution between its `ends`, halving intervals until the CDF is linear to `tolerance`.

    `density_and_cdf(points)` returns [2, points]. `seeds` are initial points, added to evenly spaced ones.

    >>> def exponential(t):
    ...     return np.array([np.exp(-t), 1.0 - np.exp(-t)])
    >>> found = tabulate(exponential, (0.0, 40.0), np.zeros(0), 1e-6, 0.0)
    >>> round(found.quantile(0.5), 5)  # ln 2
    0.69315
    """
    low, high = ends
    points = np.unique(np.concatenate([np.linspace(low, high, 65), np.clip(seeds, low, high)]))
    least = 1e-12 * max(abs(low), abs(high))
    points = points[np.diff(points, prepend=-np.inf) > least]
    values = density_and_cdf(points)
    for _ in range(_MOST_HALVINGS if points.size > 1 else 0):
        middles = 0.5 * (points[1:] + points[:-1])
        between = density_and_cdf(middles)
        curved = np.abs(between[1] - 0.5 * (values[1, 1:] + values[1, :-1])) > tolerance
        # Neighbours too: a curve with its inflection at the midpoint looks straight there.
        curved = (np.convolve(curved, np.ones(3), mode="same") > 0.0) & (np.diff(points) > 2.0 * least)
        if not curved.any():
            break
        points = np.concatenate([points, middles[curved]])
        order = np.argsort(points)
        points = points[order]
        values = np.concatenate([values, between[:, curved]], axis=1)[:, order]
    density = np.maximum(values[0], 0.0)
    cdf = np.clip(np.maximum.accumulate(values[1]), 0.0, 1.0)
    return Distribution(points, density, cdf, unobserved, name)
