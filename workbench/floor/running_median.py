"""Running median and median absolute deviation: a window of values, kept in ascending order."""

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import kernel

Floats = NDArray[np.float64]


@kernel
def insert(ascending: Floats, n: int, value: float) -> None:
    """Put a value among the first n, which are in ascending order."""
    while n > 0 and ascending[n - 1] > value:
        ascending[n] = ascending[n - 1]
        n -= 1
    ascending[n] = value


@kernel
def exchange(ascending: Floats, goes: float, comes: float) -> None:
    """Replace one value of a full window by another: only what lies between the two moves."""
    place = np.searchsorted(ascending, goes)
    while place + 1 < ascending.size and ascending[place + 1] < comes:
        ascending[place] = ascending[place + 1]
        place += 1
    while place > 0 and ascending[place - 1] > comes:
        ascending[place] = ascending[place - 1]
        place -= 1
    ascending[place] = comes


@kernel
def median(ascending: Floats, n: int) -> float:
    """The median of the first n.

    >>> median(np.array([1.0, 2.0, 4.0, 9.0]), 4)
    3.0
    """
    return 0.5 * (ascending[(n - 1) // 2] + ascending[n // 2])


@kernel
def median_deviation(ascending: Floats, n: int) -> float:
    """The median absolute deviation of the first n: the nearer half is a stretch of the row, found from its middle.

    >>> median_deviation(np.array([1.0, 2.0, 4.0, 9.0, 10.0]), 5)
    3.0
    """
    middle = median(ascending, n)
    below, above = (n - 1) // 2, (n - 1) // 2 + 1
    distance = 0.0
    for _ in range((n + 1) // 2):
        if above >= n or (below >= 0 and middle - ascending[below] <= ascending[above] - middle):
            distance = middle - ascending[below]
            below -= 1
        else:
            distance = ascending[above] - middle
            above += 1
    return distance
