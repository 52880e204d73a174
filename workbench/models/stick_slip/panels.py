"""Representation of the first-passage density F(x, t): panels in time, with a mixture of normal densities in x.

A panel is an interval of time with `NODES_PER_PANEL` Gauss-Legendre nodes; between them F is their interpolating
polynomial. At each node F is a mixture of normal densities of one width with evenly spaced means; the grid of means may
move at a constant speed.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legint, legvander
from numpy.typing import NDArray

from underfoot.kernels import kernel

NODES_PER_PANEL = 8
GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(NODES_PER_PANEL)
"""Nodes and weights of the Gauss-Legendre rule on [-1, 1]."""

_BARYCENTRIC = np.array([1.0 / np.prod(node - np.delete(GAUSS_NODES, i)) for i, node in enumerate(GAUSS_NODES)])

TO_LEGENDRE = np.linalg.inv(legvander(GAUSS_NODES, NODES_PER_PANEL - 1))
"""[term, node]: values at the nodes to Legendre coefficients."""

TO_LEGENDRE_OF_INTEGRAL = legint(TO_LEGENDRE, lbnd=-1)
"""[term, node]: values at the nodes to the Legendre coefficients of their integral from -1."""

TO_INTEGRAL = legvander(GAUSS_NODES, NODES_PER_PANEL) @ TO_LEGENDRE_OF_INTEGRAL
"""[node, node]: values at the nodes to their integrals from -1 to each node."""

PANEL = np.dtype(
    [
        ("start", np.float64),
        ("length", np.float64),
        ("first", np.float64),
        ("spacing", np.float64),
        ("width", np.float64),
        ("speed", np.float64),
        ("components", np.int64),
        ("offset", np.int64),
    ],
    align=True,
)
"""One panel, from `start` s, `length` s long. The means of its components start at `first` m (at the panel's start),
`spacing` m apart, and move at `speed` m/s; `width` is their standard deviation, m.
`offset` is the index of the first weight."""


class Panels(NamedTuple):
    """F(x, t) on consecutive panels in time."""

    table: NDArray[np.record]
    """[panels] of `PANEL`."""
    weights: NDArray[np.float64]
    """Flat, panel after panel, node after node: the weight of each component, 1/s (a density in time)."""
    rates: NDArray[np.float64]
    """[panels, NODES_PER_PANEL]: the density of the slip's duration at the nodes, 1/s."""


@kernel
def lagrange_basis(z: float, basis: NDArray[np.float64]) -> None:
    """Write the Lagrange polynomials of a panel's nodes at `z` in [-1, 1] (its ends) to `basis` [NODES_PER_PANEL].

    >>> basis = np.empty(NODES_PER_PANEL)
    >>> lagrange_basis(0.3, basis)
    >>> bool(abs(basis @ GAUSS_NODES**3 - 0.3**3) < 1e-12)
    True
    """
    total = 0.0
    for n in range(NODES_PER_PANEL):
        distance = z - GAUSS_NODES[n]
        if abs(distance) < 1e-13:
            basis[:] = 0.0
            basis[n] = 1.0
            return
        basis[n] = _BARYCENTRIC[n] / distance
        total += basis[n]
    for n in range(NODES_PER_PANEL):
        basis[n] /= total


@kernel
def interpolate_weights(panels: Panels, index: int, basis: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    """Write the weights of all components of panel `index` at the point with Lagrange polynomials `basis` to `out`."""
    components = panels.table[index].components
    offset = panels.table[index].offset
    out[:components] = 0.0
    for n in range(NODES_PER_PANEL):
        if basis[n] != 0.0:
            for q in range(components):
                out[q] += basis[n] * panels.weights[offset + n * components + q]
