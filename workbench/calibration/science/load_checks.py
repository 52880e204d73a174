"""Loads over single sensors while they are measured: what a reading looks like, and what other sensors bear."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.curves import Curve

Values = NDArray[np.float64]

_MOST_SHARED = 0.1
"""The other sensors bear at most this share of a load over one sensor."""


def apparent_load_n(change: float, weights: Sequence[tuple[float, float]]) -> float:
    """The load that a change of reading looks like, by known weights: (change of reading, newtons) of each.

    Interpolated on logarithmic axes; beyond the weights along the last slope.

    >>> round(apparent_load_n(400.0, [(100.0, 10.0), (200.0, 20.0), (800.0, 80.0)]), 6)
    40.0
    """
    x, f = np.log(np.array(weights)).T
    order = np.argsort(x)
    x, f = x[order], np.maximum.accumulate(f[order])
    at = float(np.log(max(change, 1.0)))
    if x[0] <= at <= x[-1]:
        return float(np.exp(np.interp(at, x, f)))
    two = slice(-2, None) if at > x[-1] else slice(0, 2)
    slope = float(np.clip(np.diff(f[two])[0] / max(np.diff(x[two])[0], 1e-3), 0.3, 4.0))
    end = -1 if at > x[-1] else 0
    return float(np.exp(f[end] + slope * (at - x[end])))


def share_of_others(curves: Sequence[Curve], sensor: int, time_s: Values, readings: Values, load_n: Values) -> float:
    """The share of loads (n,) over one sensor that the other sensors bear, for a plate is never quite true.

    `curves` are those of all sensors, `readings` (n, 4) at `time_s` (n,). It is the slope of the others' sum over the
    load, with a slow drift taken out: they still creep after loads of their own.
    """
    others = np.nansum([curve.force(readings[:, k]) for k, curve in enumerate(curves) if k != sensor], axis=0)
    terms = np.stack([load_n, np.ones(load_n.size), time_s - time_s[0], np.log1p(time_s - time_s[0])], axis=1)
    slope = float(np.linalg.lstsq(terms, others, rcond=None)[0][0])
    return float(np.clip(slope, -_MOST_SHARED, _MOST_SHARED))
