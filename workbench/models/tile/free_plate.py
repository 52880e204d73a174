"""Free square plate with a mass at its centre: the modes of figure 4.10 (section 4.4.4).

Rayleigh-Ritz method on products of Legendre polynomials; strain energy of a thin plate (Leissa 1969). The first mode
has its nodal lines along both centre lines and does not move the shaker; the ring mode does.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import ArrayLike, NDArray

ORDERS = 10
"""Number of polynomials along each axis, from the constant on."""


@dataclass(frozen=True)
class FreeModes:
    """Bending modes of a free plate: frequencies (n,), and coefficients (ORDERS^2, n) of the polynomial products."""

    frequencies_hz: NDArray[np.float64]
    vectors: NDArray[np.float64]
    side_m: float

    def shape(self, at_m: ArrayLike, mode: int) -> NDArray[np.float64]:
        """Return the shape of a mode at positions (..., 2), origin at the centre; normalised to a maximum of 1."""
        at = 2.0 * np.asarray(at_m, dtype=np.float64) / self.side_m
        moved = legendre.legval2d(at[..., 0], at[..., 1], self.vectors[:, mode].reshape(ORDERS, ORDERS))
        return np.asarray(moved / np.abs(moved).max())


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

    def of(a: Any, b: Any) -> Any:
        return (a * weights) @ b.T

    area = side_m**2 / 4.0
    mass = kg_m2 * area * _products(of(flat, flat), of(flat, flat))
    along = np.array([float(legendre.legval(0.0, row)) for row in one])
    middle = np.outer(along, along).ravel()
    mass += middle_kg * np.outer(middle, middle)
    bending = _products(of(bend, bend), of(flat, flat)) + _products(of(flat, flat), of(bend, bend))
    crossed = _products(of(bend, flat), of(flat, bend))
    twist = _products(of(slope, slope), of(slope, slope))
    stiffness = bending + poisson * (crossed + crossed.T) + 2.0 * (1.0 - poisson) * twist
    stiffness *= rigidity_nm * area * (2.0 / side_m) ** 4
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    bends = slice(3, None)  # the first three are rigid: heave and two tilts
    return FreeModes(np.sqrt(squares[bends]) / (2.0 * math.pi), (inverse.T @ vectors)[:, bends], side_m)


def _products(along: Any, across: Any) -> Any:
    """Return integrals of products of polynomials, from those along each axis."""
    return np.kron(along, across)
