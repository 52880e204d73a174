"""Closed-form impact of a hammer on a rigid wall with force k x^a (1 + mu x'): force over penetration.

With v = x' the equation m v dv/dx = -k x^a (1 + mu v) separates:

    (a + 1) m / k (G(v0) - G(v)) = x^(a+1),   G(v) = v / mu - ln(1 + mu v) / mu^2,   v^2 / 2 for mu = 0.

The impact begins at v0 and ends at the other root of G(v) = G(v0), which lies above -1 / mu.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import HUGE, TINY, number


class WallImpact(NamedTuple):
    """Penetration (m) and force (N) over the contact, and the coefficient of restitution."""

    penetration_m: NDArray[np.float64]
    force_n: NDArray[np.float64]
    restitution: float


def wall_impact(
    mass_kg: float, velocity_m_s: float, stiffness: float, exponent: float, damping: float, points: int = 200
) -> WallImpact:
    """Return the impact of a hammer of `mass_kg` at `velocity_m_s`, with `stiffness` (N/m^exponent) and mu (s/m).

    Raises `BadValue` for a damping below 0, and for anything else not above 0.

    >>> spring = wall_impact(2.0, 1.0, 800.0, 1.0, 0.0)
    >>> float(round(spring.penetration_m.max(), 6)), float(round(spring.force_n.max(), 6)), spring.restitution
    (0.05, 40.0, 1.0)
    """
    m, v0 = (number(n, v, TINY, HUGE, "above 0") for n, v in (("mass_kg", mass_kg), ("velocity_m_s", velocity_m_s)))
    k, a = (number(n, v, TINY, HUGE, "above 0") for n, v in (("stiffness", stiffness), ("exponent", exponent)))
    mu = number("damping", damping, 0.0, HUGE, "0 or more")
    leaves = _leaving(mu * v0) * v0
    # Even in angle: dense at the start and the end, where force changes fast with speed.
    turn = np.linspace(0.0, math.pi, points | 1)
    speed = 0.5 * (v0 - leaves) + 0.5 * (v0 + leaves) * np.cos(turn)
    speed[points // 2] = 0.0 if mu == 0.0 else speed[points // 2]
    depth = (np.maximum((a + 1.0) * m / k * v0 * v0 * (_g(mu * v0, 1.0) - _g(mu * v0, speed / v0)), 0.0)) ** (
        1.0 / (a + 1.0)
    )
    depth[[0, -1]] = 0.0
    return WallImpact(depth, k * depth**a * (1.0 + mu * speed), leaves / v0)


def _g(c: float, u: float | NDArray[np.float64]) -> NDArray[np.float64]:
    """Return G / v0^2 for u = v / v0 and c = mu v0."""
    u = np.asarray(u, np.float64)
    if c < 1e-4:
        return 0.5 * u * u - c * u**3 / 3.0 + 0.25 * c * c * u**4
    return u / c - np.log1p(c * u) / (c * c)


def _leaving(c: float) -> float:
    """Return the coefficient of restitution, by bisection."""
    if c == 0.0:
        return 1.0
    goal, low, high = float(_g(c, 1.0)), 0.0, min(1.0, (1.0 - 1e-15) / c)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(_g(c, -middle)) < goal else (low, middle)
    return high
