"""The joint law of a slip's duration and distance as a table from which one look-up draws a slip.

The law depends on four numbers only, the units of time and length being 1/w0 and v_b/w0. A table is flat, float64: a
head, a guide that says where a chance lies among the durations, chances and durations that straight lines join, and for
each duration a row of distances at chances sin^2(pi y / 2), y in even steps.
"""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import number
from underfoot.kernels import kernel
from underfoot.models.signals.random import uniform

LONGEST = 800.0
"""Slips are followed for so long, in 1/w0: what still lasts then is taken to end then."""

MEAN, _DURATIONS, _DISTANCES, _GUIDE = range(4)
"""The head of a table: the mean size of a distance, and how many durations and distances there are; then the guide."""

_GUIDES = 256
_CHANCES = _GUIDE + _GUIDES


def slip_table(zeta: float, noise: float, x0: float, v0: float = 0.0, error: float = 1e-3) -> NDArray[np.float64]:
    """Tabulate the joint law of a slip's duration and distance for `draw`.

    All in units of 1/w0 and v_b/w0: `zeta` is the damping over w0, `noise` D/(w0 v_b^2), `x0` and `v0` (< 1) the start.
    `error`, 3e-4 to 0.1, is the largest CDF difference of durations, distances and periods; it sets the size of the
    table. `BadValue` for values out of range, or where this error would take work out of all proportion. Takes 0.02 to
    0.3 s at an error of 1e-3: not for the audio callback.

    >>> table = slip_table(0.4, 0.5, 2.0, error=1e-2)
    >>> round(float(table[MEAN]), 1), table.size < 2000
    (3.3, True)
    """
    from underfoot.models.stick_slip.slip_distribution import SlipLaw

    number("error", error, 3e-4, 0.1, "3e-4 to 0.1")
    solved = SlipLaw.solve(1.0, zeta, noise, 1.0, x0, v0, LONGEST, error)
    law = replace(solved, error=0.25 * error)  # read at finer steps than it would take by itself
    cdf, times = law.duration.cdf, law.duration.t
    begin = int(np.flatnonzero(cdf == 0.0)[-1])
    end = int(np.flatnonzero(cdf < cdf[-1])[-1]) + 2 if cdf[-1] > 0.0 else begin + 1
    cdf, times = np.append(cdf[begin:end], 1.0), np.append(times[begin:end], LONGEST)
    durations, distances = times.size, 2 + math.ceil(1.5 / math.sqrt(error))
    fineness = max(6.0, 0.2 / math.sqrt(error))
    rows = _filled([_distances(*law.places(float(t)), x0, distances, fineness) for t in times[:-1]], distances)
    guide = np.searchsorted(cdf, np.arange(_GUIDES) / _GUIDES, side="right") - 1
    table = np.concatenate([[0.0, durations, distances], guide, cdf, times, rows.ravel()])
    table[MEAN] = _mean_size(table)
    return table


@kernel
def draw(table, key, counter):
    """Draw number `counter` of the stream `key` from a `slip_table`: a duration and a distance, in its units."""
    return look_up(table, uniform(key, 2 * counter), uniform(key, 2 * counter + 1))


@kernel
def look_up(table, first, second):
    """The duration that the chance `first`, in (0, 1), stands for, and the distance that `second` then stands for."""
    durations, distances = int(table[_DURATIONS]), int(table[_DISTANCES])
    i = int(table[_GUIDE + int(first * _GUIDES)])
    while table[_CHANCES + i + 1] <= first and i < durations - 2:
        i += 1
    lower, upper = table[_CHANCES + i], table[_CHANCES + i + 1]
    y = (first - lower) / (upper - lower)
    z = 2.0 / math.pi * math.asin(math.sqrt(second)) * (distances - 1)
    j = min(int(z), distances - 2)
    z -= j
    at = _CHANCES + durations + i
    duration = (1.0 - y) * table[at] + y * table[at + 1]
    row = _CHANCES + 2 * durations + i * distances + j
    near = (1.0 - z) * table[row] + z * table[row + 1]
    if i < durations - 2:
        row += distances
    far = (1.0 - z) * table[row] + z * table[row + 1]
    return duration, (1.0 - y) * near + y * far


def _distances(
    middles: NDArray[np.float64], masses: NDArray[np.float64], width: float, x0: float, count: int, fineness: float
) -> NDArray[np.float64] | None:
    """Rising distances at the table's chances, of slips that end as these packets say; None where next to none do.

    `fineness`: places to a packet at which the law is read.
    """
    from underfoot.models.stick_slip.slip_distribution import mixture

    if masses.sum() <= 1e-9:
        return None
    at = np.linspace(middles[0] - 5.0 * width, middles[-1] + 5.0 * width, int(fineness * (middles.size + 10)))
    law = np.empty((2, at.size))
    mixture(at, middles, np.full(middles.size, width), masses, law)
    risen = np.maximum.accumulate(np.maximum(law[1], 0.0)) + np.linspace(0.0, 1e-12 * law[1, -1], at.size)
    chances = np.sin(0.5 * math.pi * np.linspace(0.0, 1.0, count)) ** 2
    return x0 - np.interp(np.clip(chances, 1e-5, 1.0 - 1e-5) * risen[-1], risen, at)[::-1]


def _filled(rows: list[NDArray[np.float64] | None], count: int) -> NDArray[np.float64]:
    """Rows of distances; a missing one is its neighbour's, later ones first."""
    known = [k for k, row in enumerate(rows) if row is not None]
    if not known:
        return np.zeros((len(rows), count))
    nearest = [known[min(int(np.searchsorted(known, k)), len(known) - 1)] for k in range(len(rows))]
    return np.array([rows[k] for k in nearest])


def _mean_size(table: NDArray[np.float64]) -> float:
    sizes = np.empty((256, 64))
    _sizes(table, sizes)
    return float(sizes.mean())


@kernel
def _sizes(table, out):
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            _, distance = look_up(table, (i + 0.5) / out.shape[0], (j + 0.5) / out.shape[1])
            out[i, j] = abs(distance)
