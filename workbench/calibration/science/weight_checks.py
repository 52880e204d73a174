"""A known weight that is not as heavy as was typed, told by the readings of the other weights."""

import math
from collections.abc import Sequence

import numpy as np

from underfoot.calibration.files.measurements import Pairs
from underfoot.kernels import Floats

_DEGREE = 3
"""Of the logarithm of force over that of the reading: it leaves 2 % of a force sensing resistor from 25 to 600 N."""
_LEAST_SHIFT, _LEAST_SCATTER = 0.12, 0.005
"""Share of a weight beyond which it is another: sensors of other kinds bend from the polynomial by up to 10 %; and
share by which readings scatter at least, by creep alone, with the time until they are taken."""
_BY_CHANCE = 1e-4
"""Chance that one of the weights of a good series is named."""
_ALIKE = 100.0
"""Factor between the chances of two weights that readings do not tell apart: of simulated tiles' sensors 2000 or more,
and 1 of sensors that are all alike, as of five weights a cubic leaves one deviation, which is any weight's."""
_OWN = 0.3
"""Share of a weight's own deviation that the curve must leave to it: near the ends it goes through nearly any."""


def weight_warnings(pairs: Pairs, values: Sequence[Floats]) -> tuple[str, ...]:
    """Return a line on the weight that does not fit the others best, if it is no chance; `pairs` has one a weight.

    Where several would explain the readings alike, it names all of them. A weight that is off by a share no larger
    than that of one step of the converter in its change of reading is as it was typed: the step divides all `values`
    (n, 4) that were read, as 256 does at 8 bits.

    The logarithm of force is a polynomial in that of the reading, for each sensor; on the way down, hysteresis and what
    has crept under the largest weight come to it. Each weight, on one sensor or on all, is tested as an outlier of mean
    shift (Cook and Weisberg, Residuals and Influence in Regression, 1982, 2.2.2), by Student's t and Bonferroni's
    inequality. Of the lightest and the heaviest nothing is known where all sensors agree: the curve bends to them.
    """
    loaded = pairs.force_n > 0.0
    sensor, force = pairs.sensor[loaded], pairs.force_n[loaded]
    rest, falls = np.zeros(4), np.zeros(force.size)
    for j in np.unique(sensor):
        rest[j] = np.median(pairs.reading[(pairs.sensor == j) & ~loaded])
        mine = np.flatnonzero(sensor == j)
        falls[mine[int(np.argmax(force[mine])) + 1 :]] = 1.0
    x = np.log(np.maximum(np.abs(pairs.reading[loaded] - rest[sensor]), 1.0))
    powers = ((x - x.mean()) / np.ptp(x))[:, None] ** np.arange(_DEGREE + 1)
    terms = [powers * (sensor == j)[:, None] for j in np.unique(sensor)]
    basis = np.linalg.qr(np.column_stack([*terms, falls, falls * force.max() / force]))[0]
    every = [(force == weight_n).astype(np.float64) for weight_n in np.unique(force)[1:-1]]
    shifts = np.array([*every, *np.eye(force.size)])
    step = math.gcd(*(int(np.gcd.reduce(np.rint(read).astype(np.int64).ravel())) for read in values))
    rounded = -np.log1p(-np.minimum(step * np.exp(-x), 0.99))  # a change may be a step less: half at each end
    least = np.maximum(_LEAST_SHIFT, shifts @ rounded / np.sum(shifts, axis=1))
    chance, times = _chances(basis, np.log(force), shifts, least)
    if chance.min() * len(shifts) > _BY_CHANCE:
        return ()
    found = []
    for k in np.flatnonzero(chance <= _ALIKE * chance.min()):
        at = int(np.argmax(shifts[k]))
        where = "" if k < len(every) else f" on sensor {sensor[at] + 1}, {'falling' if falls[at] else 'rising'},"
        found.append(f"of {force[at]:g} N{where} reads as {force[at] / times[k]:.0f} N")
    return (
        f"the weight {', or the one '.join(found)} by the other weights: is it, or one beside it, as heavy as was "
        "typed? Weigh them, and measure again",
    )


def _chances(basis: Floats, log_n: Floats, shifts: Floats, least: Floats) -> tuple[Floats, Floats]:
    """Return the chance of each shift (m, n) of `log_n` (n,) beside the columns of `basis` (n, p), and its factor.

    A shift of no more than its `least` (m,) is no shift: its chance is 1.
    """
    from scipy.special import stdtr  # scipy.stats takes half a second to load

    left_n, left = log_n - basis @ (basis.T @ log_n), shifts - (shifts @ basis) @ basis.T
    free, squares = log_n.size - basis.shape[1] - 1, np.sum(left**2, axis=1)
    own = squares > _OWN * np.sum(shifts, axis=1)
    if free < 1 or not own.any():
        return np.ones(len(shifts)), np.ones(len(shifts))
    shift = np.where(own, left @ left_n / np.maximum(squares, _OWN), 0.0)
    own &= np.abs(shift) > least
    scatter = np.sqrt(np.maximum((left_n @ left_n - shift**2 * squares) / free, _LEAST_SCATTER**2))
    chance = 2.0 * stdtr(free, -np.abs(shift) * np.sqrt(squares) / scatter)
    return np.where(own, chance, 1.0), np.exp(shift)
