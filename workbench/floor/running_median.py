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
    """Replace one value of a full window by another: only what lies between the two moves.

    >>> window = np.array([1.0, 2.0, 4.0, 9.0])
    >>> exchange(window, 2.0, 5.0)
    >>> window
    array([1., 4., 5., 9.])
    """
    if goes == comes:
        return
    left, found = _first_not_below(ascending, goes), _first_not_below(ascending, comes)
    if comes > goes:
        for i in range(np.uint64(left), np.uint64(found - 1)):  # unsigned: no test for a negative index
            ascending[i] = ascending[i + np.uint64(1)]
        ascending[found - 1] = comes
    else:
        for down in range(np.uint64(left - found)):
            k = np.uint64(left) - down
            ascending[k] = ascending[k - np.uint64(1)]
        ascending[found] = comes


@kernel
def _first_not_below(ascending: Floats, value: float) -> int:
    """The place of the first value that is not below `value`. Without a jump in the loop: values come at random."""
    first, length = 0, ascending.size
    while length > 1:
        half = length // 2
        first += half if ascending[first + half - 1] < value else 0
        length -= half
    return first + (1 if ascending[first] < value else 0)


@kernel
def median(ascending: Floats, n: int) -> float:
    """The median of the first n.

    >>> median(np.array([1.0, 2.0, 4.0, 9.0]), 4)
    3.0
    """
    return 0.5 * (ascending[(n - 1) // 2] + ascending[n // 2])


@kernel
def median_deviation(ascending: Floats, n: int) -> float:
    """The median absolute deviation of the first n: the nearer half is a stretch of the row.

    >>> median_deviation(np.array([1.0, 2.0, 4.0, 9.0, 10.0]), 5)
    3.0
    """
    middle = median(ascending, n)
    # The stretch holds `nearer` values, `taken` of them from the lower half: found by bisection.
    lower, nearer = (n - 1) // 2 + 1, (n + 1) // 2
    least, most = max(nearer - (n - lower), 0), min(lower, nearer)
    while least < most:
        taken = (least + most) // 2
        next_below, last_above = ascending[lower - 1 - taken], ascending[lower + nearer - taken - 1]
        if middle - next_below <= last_above - middle:
            least = taken + 1
        else:
            most = taken
    below = middle - ascending[lower - least] if least > 0 else 0.0
    above = ascending[lower + nearer - least - 1] - middle if least < nearer else 0.0
    return max(below, above)
