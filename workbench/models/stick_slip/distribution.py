"""Stick-slip friction as a first-passage problem (thesis chapter 8): functions for scripts.

A block on a spring rides a belt at v_b. From slip onset at (x0, v0) it follows `dx = v dt`,
`dv = (-w0^2 x - zeta v) dt + sqrt(2 D) dW` until its velocity first reaches the belt's; then it sticks and is carried
back to x0. `BlockOnBelt` holds these parameters. The distributions are exact to the requested error, without a choice
of grid, step or range (see `boundary_integral`).

Related modules: `sample_paths.paths` draws slips; `quantile_table` tabulates the joint distribution of durations and
distances, and `texture` plays it in real time; `upcrossings` has the thesis's approximations by upcrossings, corrected,
for comparison.
"""

from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.sample_paths import Paths, paths
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.tabulated import Distribution

__all__ = [
    "BlockOnBelt",
    "Distribution",
    "Paths",
    "SlipDistribution",
    "distances",
    "first_passage",
    "paths",
    "periods",
]


def first_passage(block: BlockOnBelt, t_end: float, error: float = 1e-4) -> Distribution:
    """Return the distribution of the slip duration, s: first passage through the belt's velocity (8.3).

    `t_end` is the observation time, s; `error` the largest CDF difference, 1e-6 to 0.1. The CDF ends at the probability
    that the slip has ended by `t_end`; `unobserved` is the rest. `BadValue` for values out of range, and if this error
    would take an excessive amount of work. Solves the Fokker-Planck equation 8.5 with the boundary condition 8.6, both
    corrected (docs/models.md#stick-slip).

    >>> duration = first_passage(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0), 20.0, error=1e-3)
    >>> bool(abs(duration.cdf_at(3.0) - 0.81434) < 1e-3)
    True
    """
    return SlipDistribution.solve(block, t_end, error).duration


def periods(block: BlockOnBelt, t_end: float, error: float = 1e-4) -> Distribution:
    """Return the distribution of the cycle's period, slip and stick, s (8.15, with its missing factor v_b).

    Arguments as for `first_passage`. Slips that end ahead of x0 have no stick time and so no period: their probability
    (`SlipDistribution.negative_stick`) and that of slips longer than `t_end` are `unobserved`.

    >>> period = periods(BlockOnBelt(1.0, 0.4, 0.1, 0.45, 0.9, 0.0), 20.0, error=1e-2)
    >>> bool(abs(period.cdf[-1] + period.unobserved - 1.0) < 1e-2)
    True
    """
    return SlipDistribution.solve(block, t_end, error).period


def distances(block: BlockOnBelt, t_end: float, error: float = 1e-4) -> Distribution:
    """Return the distribution of the slip distance x0 - x, m (8.16). Arguments as for `first_passage`.

    >>> distance = distances(BlockOnBelt(1.0, 0.4, 0.1, 0.45, 0.9, 0.0), 20.0, error=1e-2)
    >>> bool(distance.cdf_at(0.1) - distance.cdf_at(-0.1) < 0.02)
    True
    """
    return SlipDistribution.solve(block, t_end, error).distance
