"""Thinning of curves for display: minimum and maximum per step."""

import numpy as np
from numpy.typing import NDArray

GAP_PERIODS = 1.5
"""Distance of samples, in usual distances, beyond which a curve is broken."""

_FEW = 3.0
"""Samples per step up to which a curve is not thinned."""
_SHORT = 60
"""Most samples of a step that are compared side by side; beyond, NumPy's own reduction is as fast."""


def thinned(
    x: NDArray[np.float64], y: NDArray[np.floating], step: float
) -> tuple[NDArray[np.float64], NDArray[np.floating]]:
    """Thin curves `y` [n, curves] over evenly sampled, ascending `x` [n] by `extremes`, with a NaN in each gap.

    A curve of few points is unchanged.

    >>> thinned(np.arange(6.0), np.array([[0.0], [9], [1], [5], [7], [6]]), 3.0)[1].ravel()
    array([0., 9., 5., 7.])
    """
    if len(x) < 2:
        return x.copy(), y.copy()
    usual = float(np.median(np.diff(x[-64:])))
    after_gap = np.flatnonzero(np.diff(x) > GAP_PERIODS * usual) + 1
    if usual * _FEW > step:
        thin_x, thin_y = x.copy(), y.copy()
    else:
        thin_x, thin_y, starts = extremes(x, y, step)
        after_gap = 2 * np.searchsorted(starts, after_gap)
    if not len(after_gap):
        return thin_x, thin_y
    return np.insert(thin_x, after_gap, np.nan), np.insert(thin_y, after_gap, np.nan, axis=0)


def extremes(
    x: NDArray[np.float64], y: NDArray[np.floating], step: float
) -> tuple[NDArray[np.float64], NDArray[np.floating], NDArray[np.intp]]:
    """Reduce curves `y` [n, curves] over ascending `x` [n] to minimum and maximum for each `step` of x; also return
    where in `x` each step begins.

    Steps begin at multiples of `step`, so that a moving curve does not flicker; a falling curve has its maximum first,
    so that slopes are not jagged.
    """
    cell = np.floor(x / step)
    starts = np.flatnonzero(np.diff(cell, prepend=-np.inf))
    thin_y = np.empty((2 * len(starts), y.shape[1]), np.result_type(y, np.float32))
    last = np.append(starts[1:], len(y)) - 1
    least, largest = _ranges(y, starts, last)
    falls = y[last] < y[starts]
    thin_y[0::2] = np.where(falls, largest, least)
    thin_y[1::2] = np.where(falls, least, largest)
    thin_x = np.repeat((cell[starts] + 0.25) * step, 2)
    thin_x[1::2] += 0.5 * step
    return thin_x, thin_y, starts


def _ranges(
    y: NDArray[np.floating], first: NDArray[np.intp], last: NDArray[np.intp]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return minimum and maximum of each stretch of `y` [n, curves] from one row to another, inclusive."""
    longest = int((last - first).max()) + 1
    if longest > _SHORT or longest * len(first) > 2 * len(y):
        return np.minimum.reduceat(y, first, axis=0), np.maximum.reduceat(y, first, axis=0)
    # The above takes 50 ns for each stretch of each curve: short ones of like length are compared side by side.
    beside = np.take(y.T, np.minimum(first + np.arange(longest)[:, np.newaxis], last), axis=1)
    return beside.min(axis=1).T, beside.max(axis=1).T
