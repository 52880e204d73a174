"""How much later than the readings a reference force comes, as of a load cell that is filtered, or on another board.

While a force rises, a sensor with hysteresis and creep follows it at once, tremor of the hand and all: a curve through
force and reading fits best where both are of one moment. Falling forces do not tell it from hysteresis.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from underfoot.calibration.science.sensor_pairs import RISING, SensorPairs, smoothed
from underfoot.kernels import Floats

_STEP_S = 0.01
_LAGS_S = _STEP_S * np.arange(-10.0, 31.0)
_DEGREE, _MOST_SAMPLES = 7, 300
_MOST_OF, _RISEN, _LEAST_RISES, _LEAST_SPREAD = 0.6, 0.97, 4, 0.01
_LEAST_ERROR_S, _BY_CHANCE = 0.001, 1e-4
"""Error of a lag at least, and chance that rises agree as much (Student's t) on one that is none."""


def reference_lag_s(sensors: Sequence[SensorPairs]) -> float:
    """Return by how much the reference is late, s, below 0 if it is early; 0 where rises do not agree.

    It is found twice, once where what grows with time may be creep, and both have to have one sign: where nothing
    trembles, as in a testing machine, creep looks like a lag in one of them.
    """
    timed = [pairs for pairs in sensors if pairs.timed and pairs.has_directions]
    left = np.array([one for pairs in timed for one in _left_of_rises(pairs)])
    if len(left) < _LEAST_RISES:
        return 0.0
    lag_s, creeping_s = (_agreed_s(one) for one in np.swapaxes(left, 0, 1))
    return lag_s if lag_s * creeping_s > 0.0 else 0.0


def _agreed_s(left: Floats) -> float:
    """Return the lag that leaves least of all rises (n, lags) together, 0 where they do not agree.

    How uncertain it is, each rise that is left out tells (jackknife: Efron, The Jackknife, the Bootstrap and Other
    Resampling Plans, 1982, 3).
    """
    from scipy.special import stdtr  # scipy.stats takes half a second to load

    total, free = left.sum(axis=0), len(left) - 1
    lag_s, without_s = _least_s(total), [_least_s(total - one) for one in left]
    error_s = max(float(np.sqrt(free) * np.std(without_s)), _LEAST_ERROR_S)
    return lag_s if 2.0 * stdtr(free, -abs(lag_s) / error_s) < _BY_CHANCE else 0.0


def _left_of_rises(pairs: SensorPairs) -> Iterator[Floats]:
    """Yield, of each rise over most of full scale, the share of the force that a polynomial of the reading leaves, and
    one with time beside it, by lag: (2, lags). All are means over 50 ms: a cell's noise is no tremor.
    """
    x, force_n = smoothed(pairs.x, pairs.time_s), smoothed(pairs.force_n, pairs.time_s)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (pairs.direction == RISING).astype(int), [0]])))
    for start, stop in edges.reshape(-1, 2):
        # At its top the true force falls already, where the reference lags.
        top = start + int(np.argmax(x[start:stop] > _RISEN * x[start:stop].max()))
        chosen = np.arange(start, top + 1, max(1, (top - start) // _MOST_SAMPLES))
        chosen = chosen[pairs.usable[chosen]]
        if chosen.size <= 3 * _DEGREE or np.ptp(pairs.force_n[start:stop]) <= _MOST_OF * pairs.full_scale_n:
            continue
        later_n = np.interp(pairs.time_s[chosen] + _LAGS_S[:, None], pairs.time_s, force_n)
        spread = np.var(later_n, axis=1)
        if spread.min() > _LEAST_SPREAD * spread.max():  # a rise that is shorter than a lag tells nothing
            powers = chebvander(2.0 * x[chosen] / x.max() - 1.0, _DEGREE)
            time_s = pairs.time_s[chosen] - pairs.time_s[start]
            both = [np.linalg.qr(terms)[0] for terms in (powers, np.column_stack([powers, time_s]))]
            yield np.array([np.var(later_n - later_n @ q @ q.T, axis=1) / spread for q in both])


def _least_s(left: Floats) -> float:
    """Return the lag at which least is `left` (lags,), between steps by a parabola."""
    k = int(np.clip(np.argmin(left), 1, left.size - 2))
    bend = left[k - 1] - 2.0 * left[k] + left[k + 1]
    between = 0.5 * (left[k - 1] - left[k + 1]) / bend if bend > 0.0 else 0.0
    return float(_LAGS_S[k] + _STEP_S * np.clip(between, -1.0, 1.0))
