"""Quantile table of the joint distribution of a slip's duration and distance; one look-up draws a slip.

The distribution depends on four numbers only, in the units 1/w0 of time and v_b/w0 of length. A table is one array of
float64, the parts of a `QuantileTable` one after the other.
"""

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import number
from underfoot.kernels import Floats, kernel
from underfoot.models.signals.random import uniform

if TYPE_CHECKING:
    from underfoot.models.stick_slip.mixture import NormalMixture
    from underfoot.models.stick_slip.slip_distribution import SlipDistribution
    from underfoot.models.stick_slip.tabulated import Distribution

LONGEST = 800.0
"""Observation time of slips, in 1/w0; longer slips are taken to end then."""

_GUIDES = 256
_HEADER = 3
"""Numbers at the start of a table: mean distance, number of durations, number of distances."""


class QuantileTable(NamedTuple):
    """The parts of a table.

    `mean_distance` is the mean size of a distance. `guide` has the start index in `levels` for each 256th of the
    quantile levels. `levels` and `durations` [n] are interpolated linearly. For each duration, a row of
    `distances` is at the quantile levels sin^2(pi y / 2), y in `steps` even steps.
    """

    mean_distance: float
    guide: Floats
    levels: Floats
    durations: Floats
    distances: Floats
    steps: int


@kernel
def parts(table: Floats) -> QuantileTable:
    """Return the parts of a table, without copies."""
    count, distances = int(table[1]), int(table[2])
    levels = _HEADER + _GUIDES
    durations, rows = levels + count, levels + 2 * count
    return QuantileTable(
        table[0],
        table[_HEADER:levels],
        table[levels:durations],
        table[durations:rows],
        table[rows:],
        distances - 1,
    )


def slip_table(zeta: float, noise: float, x0: float, v0: float = 0.0, error: float = 1e-3) -> NDArray[np.float64]:
    """Tabulate the joint distribution of a slip's duration and distance for `draw`.

    All in units of 1/w0 and v_b/w0: `zeta` is the damping rate over w0, `noise` D/(w0 v_b^2), `x0` and `v0` (< 1) the
    slip's start. `error`, 3e-4 to 0.1, is the largest CDF difference of durations, distances and periods; it determines
    the size of the table. `BadValue` for values out of range, or if this error would take an excessive amount of work.
    Takes 0.02 to 0.3 s at an error of 1e-3: not for the audio callback.

    >>> table = slip_table(0.4, 0.5, 2.0, error=1e-2)
    >>> [round(float(median), 1) for median in look_up(table, 0.5, 0.5)], table.size < 2000
    ([3.7, 3.5], True)
    """
    from underfoot.models.stick_slip.oscillator import BlockOnBelt
    from underfoot.models.stick_slip.slip_distribution import SlipDistribution

    number("error", error, 3e-4, 0.1, "3e-4 to 0.1")
    solved = SlipDistribution.solve(BlockOnBelt(1.0, zeta, noise, 1.0, x0, v0), LONGEST, error)
    dense = error * min(1.0, (error / 1e-3) ** 1.5)  # for small errors interpolation between rows matters more
    slip = replace(solved, error=0.25 * dense)  # tabulated more densely than its own error requires
    some_last = slip.survival > slip.error
    levels, times = _duration_quantiles(slip.duration, some_last)
    count = 2 + math.ceil(1.5 / math.sqrt(dense))
    points_per_component = max(6.0, 0.2 / math.sqrt(dense))
    ends = [slip.end_positions(float(t)) for t in (times[:-2] if some_last else times[:-1])]
    rows = _filled([_distance_quantiles(positions, x0, count, points_per_component) for positions in ends], count)
    if some_last:
        rows = np.vstack([rows, _lasting_distances(slip, count, points_per_component)])
    guide = np.searchsorted(levels, np.arange(_GUIDES) / _GUIDES, side="right") - 1
    table = np.concatenate([[0.0, times.size, count], guide, levels, times, rows.ravel()])
    table[0] = _mean_distance(table)
    return table


@kernel
def draw(table: Floats, key: int, counter: int) -> tuple[float, float]:
    """Draw number `counter` of the stream `key` from a `slip_table`: a duration and a distance, in its units."""
    return look_up(table, uniform(key, 2 * counter), uniform(key, 2 * counter + 1))


@kernel
def look_up(table: Floats, first: float, second: float) -> tuple[float, float]:
    """Return the duration at the quantile `first`, in (0, 1), and the distance at the quantile `second` given it."""
    _, guide, levels, durations, distances, steps = parts(table)
    i = int(guide[int(first * _GUIDES)])
    while levels[i + 1] <= first and i < durations.size - 2:
        i += 1
    y = (first - levels[i]) / (levels[i + 1] - levels[i])
    z = 2.0 / math.pi * math.asin(math.sqrt(second)) * steps
    j = min(int(z), steps - 1)
    z -= j
    duration = (1.0 - y) * durations[i] + y * durations[i + 1]
    at = i * (steps + 1) + j
    near = (1.0 - z) * distances[at] + z * distances[at + 1]
    if i < durations.size - 2:
        at += steps + 1
    far = (1.0 - z) * distances[at] + z * distances[at + 1]
    return duration, (1.0 - y) * near + y * far


def _duration_quantiles(duration: "Distribution", some_last: bool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return quantile levels from 0 to 1 and durations; with `some_last`, the last two durations are `LONGEST`."""
    cdf, times = duration.cdf, duration.points
    begin = int(np.flatnonzero(cdf == 0.0)[-1])
    end = int(np.flatnonzero(cdf < cdf[-1])[-1]) + 2 if cdf[-1] > 0.0 else begin + 1
    levels, times = cdf[begin:end], times[begin:end]
    if some_last:
        return np.append(levels, (levels[-1], 1.0)), np.append(times, (LONGEST, LONGEST))
    return np.append(levels, 1.0), np.append(times, LONGEST)


def _distance_quantiles(
    positions: "NormalMixture", x0: float, count: int, points_per_component: float
) -> NDArray[np.float64] | None:
    """Return rising distances at `count` quantile levels, for slips that end at these positions; None if hardly any do.

    `points_per_component` is the sampling density of the CDF.
    """
    means, widths, weights = positions
    if weights.sum() <= 1e-9:
        return None
    margin = 5.0 * widths[0]
    x = np.linspace(means[0] - margin, means[-1] + margin, int(points_per_component * (means.size + 10)))
    return _quantiles_at(positions, x, x0, count)


def _lasting_distances(slip: "SlipDistribution", count: int, points_per_component: float) -> NDArray[np.float64]:
    """Return rising distances at `count` quantile levels, for slips that still last at `LONGEST`."""
    positions = slip.lasting_positions()
    reach = 6.0 * positions.widths[0]  # of all blocks under free motion
    x = positions.means[0] + np.linspace(-reach, reach, int(60.0 * points_per_component))
    return _quantiles_at(positions, x, slip.block.x0, count)


def _quantiles_at(positions: "NormalMixture", x: NDArray[np.float64], x0: float, count: int) -> NDArray[np.float64]:
    """Return rising distances from x0 at `count` quantile levels of `positions`, whose CDF is sampled at `x`."""
    from underfoot.models.stick_slip.mixture import density_and_cdf

    cdf = density_and_cdf(positions, x)[1]
    rising = np.maximum.accumulate(np.maximum(cdf, 0.0)) + np.linspace(0.0, 1e-12 * cdf[-1], x.size)
    levels = np.sin(0.5 * math.pi * np.linspace(0.0, 1.0, count)) ** 2
    return x0 - np.interp(np.clip(levels, 1e-5, 1.0 - 1e-5) * rising[-1], rising, x)[::-1]


def _filled(rows: list[NDArray[np.float64] | None], count: int) -> NDArray[np.float64]:
    """Return the rows of distances, with missing rows replaced by the next known one, or else the last known one."""
    known = [k for k, row in enumerate(rows) if row is not None]
    if not known:
        return np.zeros((len(rows), count))
    nearest = [known[min(int(np.searchsorted(known, k)), len(known) - 1)] for k in range(len(rows))]
    return np.array([rows[k] for k in nearest])


def _mean_distance(table: NDArray[np.float64]) -> float:
    """Return the mean size of a distance, over evenly spaced quantile levels."""
    sizes = np.empty((256, 64))
    _distance_sizes(table, sizes)
    return float(sizes.mean())


@kernel
def _distance_sizes(table: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            _, distance = look_up(table, (i + 0.5) / out.shape[0], (j + 0.5) / out.shape[1])
            out[i, j] = abs(distance)
