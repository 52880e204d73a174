"""Piecewise linear curves."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, kernel


def table(points: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Return points (x, y), in any order, as the array [2, point] for `value_at`; without points y is 0.

    >>> table([(1.0, 5.0), (0.0, 3.0)])
    array([[0., 1.],
           [3., 5.]])
    """
    return np.array(sorted(points, key=lambda point: point[0]) or [(0.0, 0.0)], np.float64).T.copy()


@kernel
def value_at(points: Floats, x: float) -> float:
    """Return the curve at `x`: linear between points, constant before the first and after the last.

    >>> curve = table([(0.0, 1.0), (10.0, 2.0), (10.0, 4.0)])
    >>> value_at(curve, -1.0), value_at(curve, 5.0), value_at(curve, 10.0), value_at(curve, 99.0)
    (1.0, 1.5, 4.0, 4.0)
    """
    last = points.shape[1] - 1
    if x < points[0, 0]:
        return points[1, 0]
    if x >= points[0, last]:
        return points[1, last]
    k = 0
    while points[0, k + 1] <= x:
        k += 1
    share = (x - points[0, k]) / (points[0, k + 1] - points[0, k])
    return points[1, k] + share * (points[1, k + 1] - points[1, k])
