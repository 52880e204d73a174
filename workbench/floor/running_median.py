"""Running median of a window, and the median absolute deviation of one.

Of a window only the values around its median are kept in order: a value that comes or goes below or above these is
counted, no more. The few in the middle are found anew when the median has left them.
"""

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import kernel, part

Floats = NDArray[np.float64]

MIDDLE = np.dtype([("low", np.float64), ("high", np.float64), ("below", np.int64), ("kept", np.int64)], align=True)
"""The middle of a window: all its values from `low` to `high`, `kept` of them, and how many are `below`."""

_REACH = 32  # values that are kept on either side of the median, at least when they are chosen
_MOST = 4 * _REACH  # values that may be kept before they are fewer again


@kernel
def begin(middle: np.record) -> None:
    """An empty window, of which all that comes is kept."""
    middle.low, middle.high, middle.below, middle.kept = -np.inf, np.inf, 0, 0


@kernel
def insert(middle: np.record, ascending: Floats, value: float) -> None:
    """Let a value into the window, whose middle is the first of `ascending`."""
    if value < middle.low:
        middle.below += 1
    elif value <= middle.high:
        at = middle.kept
        while at > 0 and ascending[at - 1] > value:
            ascending[at] = ascending[at - 1]
            at -= 1
        ascending[at] = value
        middle.kept += 1


@kernel
def exchange(middle: np.record, ascending: Floats, goes: float, comes: float) -> None:
    """Replace one value of the window by another."""
    if goes == comes:
        return
    if goes < middle.low:
        middle.below -= 1
    elif goes <= middle.high:
        last = int(middle.kept) - 1
        for i in range(_first_not_below(ascending[: last + 1], goes), last):
            ascending[i] = ascending[i + 1]
        middle.kept = last
    insert(middle, ascending, comes)


@kernel
def running_median(middle: np.record, ascending: Floats, ring: Floats, newest: int, n: int) -> float:
    """The median of a window of n values, the latest of which is `ring[newest]`, the one before at `newest` - 1.

    `ascending` has room for n.
    """
    if (n - 1) // 2 < middle.below or n // 2 >= middle.below + middle.kept:
        copy_latest(ring, newest, ascending, n)
        _choose(middle, ascending, n)
    elif middle.kept > _MOST:
        _narrow(middle, ascending, n)
    return 0.5 * (ascending[(n - 1) // 2 - middle.below] + ascending[n // 2 - middle.below])


@part
def copy_latest(ring: Floats, newest: int, values: Floats, n: int) -> None:
    """The latest n values of a ring, in no order that matters, into the first of `values`."""
    end = newest + 1
    newer = min(n, end)
    for i in range(newer):  # no slices: in Numba, assigning one brings the code for strings of its error
        values[i] = ring[end - newer + i]
    for i in range(newer, n):
        values[i] = ring[len(ring) - n + i]


@part
def _choose(middle: np.record, values: Floats, n: int) -> None:
    """Find the middle of the first n values, and put it first, in order."""
    first, last = max((n - 1) // 2 - _REACH, 0), min(n // 2 + _REACH, n - 1)
    _select(values, 0, n - 1, first)
    _select(values, first, n - 1, last)
    middle.below = 0
    for i in range(first + 1, last):
        value, at = values[i], i
        while at > first and values[at - 1] > value:
            values[at] = values[at - 1]
            at -= 1
        values[at] = value
    middle.low, middle.high = values[first], values[last]
    # What equals an end belongs to the middle, too.
    for i in range(first - 1, -1, -1):
        if values[i] == middle.low:
            first -= 1
            values[i], values[first] = values[first], values[i]
    for i in range(last + 1, n):
        if values[i] == middle.high:
            last += 1
            values[i], values[last] = values[last], values[i]
    _keep(middle, values, first, last)


@part
def _narrow(middle: np.record, ascending: Floats, n: int) -> None:
    """Keep fewer values: those near the median, and what equals the outermost of them."""
    kept = ascending[: middle.kept]
    first, last = (n - 1) // 2 - middle.below - _REACH, n // 2 - middle.below + _REACH
    first = _first_not_below(kept, kept[first]) if first > 0 else 0
    last = _first_not_below(kept, np.nextafter(kept[last], np.inf)) - 1 if last < len(kept) else len(kept) - 1
    if first > 0:
        middle.low = ascending[first]
    if last < len(kept) - 1:
        middle.high = ascending[last]
    _keep(middle, ascending, first, last)


@part
def _keep(middle: np.record, ascending: Floats, first: int, last: int) -> None:
    """Move what is kept to the front; before it were values below."""
    middle.kept = last + 1 - first
    if first > 0:
        for i in range(middle.kept):
            ascending[i] = ascending[first + i]
        middle.below += first


@part
def _first_not_below(ascending: Floats, value: float) -> int:
    """The place of the first value that is not below `value`. Without a jump in the loop: values come at random."""
    first, length = 0, ascending.size
    while length > 1:
        half = length // 2
        first += half if ascending[first + half - 1] < value else 0
        length -= half
    return first + (1 if ascending[first] < value else 0)


@part
def _select(values: Floats, first: int, last: int, k: int) -> None:
    """Order the values from `first` to `last` so far that number k is in its place, none below it behind it."""
    while first < last:
        one, two, three = values[first], values[(first + last) // 2], values[last]
        pivot = max(min(one, two), min(max(one, two), three))
        i, j = first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if j < k:
            first = i
        if k < i:
            last = j


@kernel
def median(values: Floats, n: int) -> float:
    """The median of the first n, which changes places.

    >>> median(np.array([4.0, 1.0, 9.0, 2.0]), 4)
    3.0
    """
    middle = n // 2
    _select(values, 0, n - 1, middle)
    below = values[middle]
    if n % 2 == 0:
        below = values[0]
        for i in range(1, middle):
            below = max(below, values[i])
    return 0.5 * (below + values[middle])


@kernel
def median_deviation(values: Floats, n: int) -> float:
    """The median absolute deviation of the first n, the lower of two; the values are lost.

    >>> median_deviation(np.array([9.0, 1.0, 4.0, 10.0, 2.0]), 5)
    3.0
    """
    centre = median(values, n)
    for i in range(n):
        values[i] = abs(values[i] - centre)
    _select(values, 0, n - 1, (n - 1) // 2)
    return values[(n - 1) // 2]
