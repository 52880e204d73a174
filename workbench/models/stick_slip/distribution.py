"""Friction: stick-slip as a first-passage problem (thesis chapter 8), its laws, its paths and a texture that plays it.

A block on a spring rides a belt at v_b. From slip onset at (x0, v0) it follows `dx = v dt`,
`dv = (-w0^2 x - zeta v) dt + sqrt(2 D) dW` until its velocity reaches the belt's; then it sticks and rides back to x0.
The laws are exact to the error asked for: no grid, step or box is to be chosen (`boundary_integral` says how).

The rest of the family: `sample_paths.paths` draws slips, `quantile_table` tabulates the joint law of durations and
distances and `texture` plays it, `upcrossings` has the thesis's expansions in upcrossings, corrected,
to compare with.
"""

from underfoot.models.stick_slip.sample_paths import Paths, paths
from underfoot.models.stick_slip.slip_distribution import Law, SlipLaw

__all__ = ["Law", "Paths", "SlipLaw", "distances", "first_passage", "paths", "periods"]


def first_passage(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t_end: float,
    error: float = 1e-4,
) -> Law:
    """The law of the slip's duration: `.t` s, `.density` 1/s, `.cdf` (8.3).

    w0: rad/s; zeta: damping rate, 1/s, >= 0; noise: D, m^2/s^3; belt_velocity: v_b > 0 m/s; the slip starts at x0 m
    with v0 m/s < v_b and is followed for t_end s; error: the largest CDF difference, 1e-6 to 0.1. The `.cdf` ends at
    the share that has ended by t_end; `.missing` is the rest. `BadValue` for values out of range, and where this error
    would take work out of all proportion. Fokker-Planck equation 8.5 with the edge 8.6, both as the errata have them.

    >>> import numpy as np
    >>> law = first_passage(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, error=1e-3)
    >>> bool(abs(np.interp(3.0, law.t, law.cdf) - 0.81434) < 1e-3)
    True
    """
    return SlipLaw.solve(w0, zeta, noise, belt_velocity, x0, v0, t_end, error).duration


def periods(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t_end: float,
    error: float = 1e-4,
) -> Law:
    """The law of the cycle's period, slip and stick: `.t` s, `.density` 1/s, `.cdf` (8.15, with the factor v_b).

    Parameters as for `first_passage`. Slips that end ahead of x0 have no stick time and so no period: their share
    (`SlipLaw.negative_stick`) and that of slips longer than t_end are `.missing`.

    >>> law = periods(1.0, 0.4, 0.1, 0.45, 0.9, 0.0, 20.0, error=1e-2)
    >>> bool(abs(law.cdf[-1] + law.missing - 1.0) < 1e-2)
    True
    """
    return SlipLaw.solve(w0, zeta, noise, belt_velocity, x0, v0, t_end, error).period


def distances(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t_end: float,
    error: float = 1e-4,
) -> Law:
    """The law of the slip's distance x0 - x: `.at` m, `.density` 1/m, `.cdf` (8.16). Parameters as `first_passage`.

    >>> import numpy as np
    >>> law = distances(1.0, 0.4, 0.1, 0.45, 0.9, 0.0, 20.0, error=1e-2)
    >>> bool(np.interp(0.1, law.at, law.cdf) - np.interp(-0.1, law.at, law.cdf) < 0.02)
    True
    """
    return SlipLaw.solve(w0, zeta, noise, belt_velocity, x0, v0, t_end, error).distance
