"""Free square plate with a mass at its centre: the modes of figure 4.10 (section 4.4.4).

Rayleigh-Ritz method on products of Legendre polynomials; strain energy of a thin plate (Leissa 1969). The first mode
has its nodal lines along both centre lines and does not move the shaker; the ring mode does.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

ORDERS = 10
"""Number of polynomials along each axis, from the constant on."""
_GRID = np.linspace(-1.0, 1.0, 101)
"""Places along each axis among which the largest displacement of a mode is found, in half sides."""


@dataclass(frozen=True)
class FreeModes:
    """Bending modes of a free plate: frequencies (n,), and coefficients (ORDERS^2, n) of the polynomial products."""

    frequencies_hz: NDArray[np.float64]
    vectors: NDArray[np.float64]
    side_m: float

    def shape(self, at_m: ArrayLike, mode: int) -> NDArray[np.float64]:
        """Return the displacement of a mode at positions (..., 2), origin at the centre; its largest is 1 or -1.

        >>> ring = free_modes(1.0, 1.0, 1.0).shape([[0.5, 0.5], [0.25, 0.25]], 2)
        >>> np.abs(ring).round(2)
        array([1.  , 0.09])
        """
        at = 2.0 * np.asarray(at_m, dtype=np.float64) / self.side_m
        coefficients = self.vectors[:, mode].reshape(ORDERS, ORDERS)
        largest = np.abs(legendre.leggrid2d(_GRID, _GRID, coefficients)).max()
        return np.asarray(legendre.legval2d(at[..., 0], at[..., 1], coefficients) / largest)


def free_modes(
    side_m: float, rigidity_nm: float, kg_m2: float, middle_kg: float = 0.0, poisson: float = 0.3
) -> FreeModes:
    """Return the bending modes of a free square plate with `middle_kg` fixed to its centre.

    >>> bare = free_modes(1.0, 1.0, 1.0)  # Leissa: 13.47, 19.60, 24.27
    >>> (2.0 * math.pi * bare.frequencies_hz[:3]).round(2)
    array([13.47, 19.6 , 24.27])
    """
    at, weights = legendre.leggauss(ORDERS + 2)
    one = np.eye(ORDERS)
    flat, slope, bend = (
        np.stack([legendre.legval(at, legendre.legder(row, times)) for row in one]) for times in (0, 1, 2)
    )

    def of(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.asarray((a * weights) @ b.T)

    # Integrals of products over the plate are Kronecker products of those along each axis.
    area = side_m**2 / 4.0
    mass = kg_m2 * area * np.kron(of(flat, flat), of(flat, flat))
    along = np.array([float(legendre.legval(0.0, row)) for row in one])
    middle = np.outer(along, along).ravel()
    mass += middle_kg * np.outer(middle, middle)
    bending = np.kron(of(bend, bend), of(flat, flat)) + np.kron(of(flat, flat), of(bend, bend))
    crossed = np.kron(of(bend, flat), of(flat, bend))
    twist = np.kron(of(slope, slope), of(slope, slope))
    stiffness = bending + poisson * (crossed + crossed.T) + 2.0 * (1.0 - poisson) * twist
    stiffness *= rigidity_nm * area * (2.0 / side_m) ** 4
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    bends = slice(3, None)  # the first three are rigid: heave and two tilts
    return FreeModes(np.sqrt(squares[bends]) / (2.0 * math.pi), (inverse.T @ vectors)[:, bends], side_m)
