"""Cost and accuracy of the table of a stick-slip node."""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import kernel
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.quantile_table import LONGEST, look_up, slip_table
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.tabulated import Distribution

_TIGHT = 3e-5
_DRAWS = 400_000
_FIRST, _SECOND = 0.7548776662466927, 0.5698402909980532
"""Steps of the plastic number's recurrence, a low-discrepancy sequence in the unit square."""


def timed_work(values: Mapping[str, Any]) -> Callable[[], NDArray[np.float64]]:
    """Return a function that makes the table of a node with these values."""
    numbers = _numbers(values)
    return lambda: slip_table(*numbers, error=float(values["error"]))


def measured_error(values: Mapping[str, Any]) -> float:
    """Return the largest CDF difference between table and exact distributions, of durations, distances and periods.

    >>> 0.0 < measured_error({"damping": 40, "noise": 50, "start": 200, "error": "0.01"}) <= 0.01
    True
    """
    drawn = np.empty((_DRAWS, 2))
    _draw_evenly(timed_work(values)(), drawn)
    durations, distances = drawn.T
    slip = _solved(*_numbers(values))
    ended = durations < LONGEST * (1.0 - 1e-12)  # linear interpolation between two of them rounds to this
    return max(
        _difference(durations[ended], slip.duration),
        _difference(distances[ended], slip.distance),
        _difference((durations + distances)[ended & (distances >= 0.0)], slip.period),
        _difference(distances, slip.distance_in_the_end),
    )


def _numbers(values: Mapping[str, Any]) -> tuple[float, float, float]:
    damping, noise, start = (0.01 * values[name] for name in ("damping", "noise", "start"))
    return damping, noise, start


@cache
def _solved(zeta: float, noise: float, x0: float) -> SlipDistribution:
    return SlipDistribution.solve(BlockOnBelt(1.0, zeta, noise, 1.0, x0, 0.0), LONGEST, _TIGHT)


def _difference(drawn: NDArray[np.float64], distribution: Distribution) -> float:
    """Return the largest difference of the draws' CDF from that of a distribution, over all slips."""
    if drawn.size == 0 or distribution.points.size == 0:
        return 0.0
    rising = np.sort(drawn)
    cdf = (np.arange(rising.size) + 0.5) / _DRAWS
    return float(np.abs(distribution.cdf_at(rising) - cdf).max())


@kernel
def _draw_evenly(table: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    first = second = 0.5
    for i in range(out.shape[0]):
        first = (first + _FIRST) % 1.0
        second = (second + _SECOND) % 1.0
        out[i, 0], out[i, 1] = look_up(table, first, second)
