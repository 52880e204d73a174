"""Curves of many samples as a few points that look the same: the least and the largest of each step."""

import numpy as np
from numpy.typing import NDArray

GAP_PERIODS = 1.5
"""A curve is broken where samples are further apart than this many of the usual distances."""

_FEW = 3.0
"""Samples a step up to which a curve stays as it is."""


def thinned(
    x: NDArray[np.float64], y: NDArray[np.floating], step: float
) -> tuple[NDArray[np.float64], NDArray[np.floating]]:
    """Curves `y` [n, curves] over evenly sampled, ascending `x` [n], as `extremes` gives them, with a NaN in each gap.

    A curve of few points stays as it is.

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
    """Curves `y` [n, curves] over ascending `x` [n] with two points, least and largest, for each `step` of x; and where
    in `x` each step begins.

    Steps begin at multiples of `step`, so that a curve which moves along does not flicker, and one that falls has its
    largest point first, so that slopes are not jagged.
    """
    cell = np.floor(x / step)
    starts = np.flatnonzero(np.diff(cell, prepend=-np.inf))
    thin_y = np.empty((2 * len(starts), y.shape[1]), np.result_type(y, np.float32))
    least, largest = np.minimum.reduceat(y, starts, axis=0), np.maximum.reduceat(y, starts, axis=0)
    falls = y[np.append(starts[1:], len(y)) - 1] < y[starts]
    thin_y[0::2] = np.where(falls, largest, least)
    thin_y[1::2] = np.where(falls, least, largest)
    thin_x = np.repeat((cell[starts] + 0.25) * step, 2)
    thin_x[1::2] += 0.5 * step
    return thin_x, thin_y, starts
