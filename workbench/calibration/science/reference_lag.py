"""How much later than the readings a reference force comes, as of a load cell that is filtered, or on another board.

While a force rises, a sensor with hysteresis and creep follows it at once, tremor of the hand and all: a curve through
force and reading fits best where both are of one moment. Falling forces do not tell it from hysteresis.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from underfoot.calibration.science.sensor_pairs import RISING, SensorPairs

_STEP_S = 0.01
_LAGS_S = _STEP_S * np.arange(-10.0, 31.0)
_DEGREE, _MOST_SAMPLES = 7, 300
_MOST_OF, _RISEN, _LEAST_RISES = 0.6, 0.97, 4
_BY_CHANCE = 1e-4
"""Chance that rises agree as much (Student's t) on a lag that is none."""


def reference_lag_s(sensors: Sequence[SensorPairs]) -> float:
    """Return by how much the reference is late, s, below 0 if it is early; 0 where rises do not agree."""
    from scipy.special import stdtr  # scipy.stats takes half a second to load

    timed = [pairs for pairs in sensors if pairs.timed and pairs.has_directions]
    found = np.array([_lag_s(pairs, rise) for pairs in timed for rise in _rises(pairs)])
    if found.size < _LEAST_RISES:
        return 0.0
    error_s = max(float(found.std(ddof=1)), 0.1 * _STEP_S) / np.sqrt(found.size)
    chance = 2.0 * float(stdtr(found.size - 1, -abs(found.mean()) / error_s))
    return float(found.mean()) if chance < _BY_CHANCE else 0.0


def _rises(pairs: SensorPairs) -> list[slice]:
    """Return the samples of each rise over most of full scale."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (pairs.direction == RISING).astype(int), [0]])))
    runs = [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    high = _MOST_OF * pairs.full_scale_n
    return [run for run in runs if run.stop - run.start > 3 * _DEGREE and np.ptp(pairs.force_n[run]) > high]


def _lag_s(pairs: SensorPairs, rise: slice) -> float:
    """Return the lag at which a polynomial from forces to readings leaves least, between steps by a parabola."""
    x = pairs.x[rise]  # at its top the true force falls already, where the reference lags
    top = rise.start + int(np.argmax(x > _RISEN * x.max()))
    chosen = np.arange(rise.start, top + 1, max(1, (top - rise.start) // _MOST_SAMPLES))
    chosen = chosen[pairs.usable[chosen]]
    if chosen.size <= 3 * _DEGREE:
        return 0.0
    later = np.interp(pairs.time_s[chosen] + _LAGS_S[:, None], pairs.time_s, pairs.force_n)
    terms = chebvander(2.0 * later / pairs.full_scale_n - 1.0, _DEGREE)
    explained = np.einsum("lnk,n->lk", np.linalg.qr(terms)[0], pairs.x[chosen])
    left = pairs.x[chosen] @ pairs.x[chosen] - (explained**2).sum(axis=1)
    k = int(np.clip(np.argmin(left), 1, left.size - 2))
    bend = left[k - 1] - 2.0 * left[k] + left[k + 1]
    between = 0.5 * (left[k - 1] - left[k + 1]) / bend if bend > 0.0 else 0.0
    return float(_LAGS_S[k] + _STEP_S * np.clip(between, -1.0, 1.0))
