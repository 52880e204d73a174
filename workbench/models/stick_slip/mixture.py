"""Mixtures of normal densities: their density and cumulative distribution function."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import allocating, kernel


class NormalMixture(NamedTuple):
    """Mixture of normal densities, all arrays [components]. The weights need not sum to 1."""

    means: NDArray[np.float64]
    widths: NDArray[np.float64]
    """Standard deviations."""
    weights: NDArray[np.float64]


@allocating
@kernel
def density_and_cdf(mixture: NormalMixture, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return density and CDF of a mixture at `points`, as [2, points].

    >>> mixture = NormalMixture(np.array([1.0, 9.0]), np.array([0.5, 0.5]), np.array([0.3, 0.7]))
    >>> round(float(density_and_cdf(mixture, np.array([1.0]))[1, 0]), 3)
    0.15
    """
    found = np.empty((2, points.size))
    for i in range(points.size):
        density = 0.0
        cdf = 0.0
        for q in range(mixture.means.size):
            z = (points[i] - mixture.means[q]) / mixture.widths[q]
            if z > 8.0:
                cdf += mixture.weights[q]
            elif z > -8.0:
                density += mixture.weights[q] * normal_density(z) / mixture.widths[q]
                cdf += mixture.weights[q] * normal_cdf(z)
        found[0, i] = density
        found[1, i] = cdf
    return found


@kernel
def normal_density(z: float) -> float:
    """Return the density of the standard normal distribution."""
    return math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)


@kernel
def normal_cdf(z: float) -> float:
    """Return the CDF of the standard normal distribution.

    >>> normal_cdf(0.0)
    0.5
    """
    return 0.5 * math.erfc(-z / math.sqrt(2.0))
