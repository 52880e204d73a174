"""Running median of a window, and the median absolute deviation of one.

Only the values around the median of a window are kept, in ascending order; of the others only the number below them is
known. When the median has moved out of those that are kept, they are selected again from the whole window.
"""

import numpy as np

from underfoot.kernels import Floats, inlined, kernel

MIDDLE = np.dtype([("low", np.float64), ("high", np.float64), ("below", np.int64), ("kept", np.int64)], align=True)
"""Middle of a window: `kept` values, all those from `low` to `high`; `below` is the number of smaller ones."""

_REACH = 24  # values kept on either side of the median when they are selected
_MOST = 4 * _REACH  # largest number kept


@kernel
def begin(middle: np.record) -> None:
    """Begin an empty window; all its first values are kept."""
    middle.low, middle.high, middle.below, middle.kept = -np.inf, np.inf, 0, 0


@kernel
def insert(middle: np.record, ascending: Floats, value: float) -> None:
    """Add a value to the window, whose middle is at the beginning of `ascending`."""
    if value < middle.low:
        middle.below += 1
    elif value <= middle.high:
        kept = middle.kept
        middle.kept = kept + 1
        if kept == 0 or ascending[kept - 1] <= value:
            ascending[kept] = value
            return
        ascending[kept] = ascending[kept - 1]
        for i in range(kept - 1, 0, -1):  # the middle one of both and `value`, in vectors
            before, here = ascending[i - 1], ascending[i]
            lower = here if here < value else value
            ascending[i] = before if before > lower else lower
        ascending[0] = min(ascending[0], value)


@inlined
def exchange(middle: np.record, ascending: Floats, old: float, new: float) -> None:
    """Replace the value `old` of the window by `new`.

    Most values lie outside the middle, on either side by chance: they are counted without a branch.
    """
    low, high = middle.low, middle.high
    was_kept, is_kept = (old >= low) & (old <= high), (new >= low) & (new <= high)
    middle.below += np.int64(new < low) - np.int64(old < low)
    if was_kept | is_kept:
        _exchange_kept(middle, ascending, old, new)


@inlined
def running_median(middle: np.record, ascending: Floats, ring: Floats, newest: int, n: int) -> float:
    """Return the median of the n latest values in `ring`, which end at index `newest`; `ascending` has space for n."""
    below, kept = middle.below, middle.kept
    if (n - 1) // 2 < below or n // 2 >= below + kept or kept > _MOST:
        _centre(middle, ascending, ring, newest, n)
        below = middle.below
    return 0.5 * (ascending[(n - 1) // 2 - below] + ascending[n // 2 - below])


@kernel
def _exchange_kept(middle: np.record, ascending: Floats, old: float, new: float) -> None:
    """Exchange values of which at least one is in the middle."""
    if old == new:
        return
    if middle.low <= old <= middle.high:
        last = int(middle.kept) - 1
        for i in range(last):  # in vectors, too
            here, above = ascending[i], ascending[i + 1]
            ascending[i] = here if here < old else above
        middle.kept = last
    if middle.low <= new <= middle.high:
        insert(middle, ascending, new)


@kernel
def _centre(middle: np.record, ascending: Floats, ring: Floats, newest: int, n: int) -> None:
    """Centre the middle on the median: select it again if the median has left it, else drop what is far from it."""
    if (n - 1) // 2 < middle.below or n // 2 >= middle.below + middle.kept:
        copy_latest(ring, newest, ascending, n)
        _choose(middle, ascending, n)
    else:
        _narrow(middle, ascending, n)


@kernel
def copy_latest(ring: Floats, newest: int, values: Floats, n: int) -> None:
    """Copy the n latest values of a ring to `values`, in any order."""
    end = newest + 1
    newer = min(n, end)
    for i in range(newer):  # assigning a slice would compile Numba's string functions
        values[i] = ring[end - newer + i]
    for i in range(newer, n):
        values[i] = ring[len(ring) - n + i]


@kernel
def _choose(middle: np.record, values: Floats, n: int) -> None:
    """Select the middle of the first n values, and move it to the front, in ascending order."""
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
    # Values equal to an end belong to the middle too.
    for i in range(first - 1, -1, -1):
        if values[i] == middle.low:
            first -= 1
            values[i], values[first] = values[first], values[i]
    for i in range(last + 1, n):
        if values[i] == middle.high:
            last += 1
            values[i], values[last] = values[last], values[i]
    _keep(middle, values, first, last)


@kernel
def _narrow(middle: np.record, ascending: Floats, n: int) -> None:
    """Keep fewer values: those near the median, and those equal to the outermost of them."""
    kept = ascending[: middle.kept]
    first, last = (n - 1) // 2 - middle.below - _REACH, n // 2 - middle.below + _REACH
    first = _first_not_below(kept, kept[first]) if first > 0 else 0
    last = _first_not_below(kept, np.nextafter(kept[last], np.inf)) - 1 if last < len(kept) else len(kept) - 1
    if first > 0:
        middle.low = ascending[first]
    if last < len(kept) - 1:
        middle.high = ascending[last]
    _keep(middle, ascending, first, last)


@kernel
def _keep(middle: np.record, ascending: Floats, first: int, last: int) -> None:
    """Move the kept values to the front; those before them are now counted as below."""
    middle.kept = last + 1 - first
    if first > 0:
        for i in range(middle.kept):
            ascending[i] = ascending[first + i]
        middle.below += first


@kernel
def _first_not_below(ascending: Floats, value: float) -> int:
    """Return the index of the first value that is not below `value`, by a search without unpredictable branches."""
    first, length = 0, ascending.size
    while length > 1:
        half = length // 2
        first += half if ascending[first + half - 1] < value else 0
        length -= half
    return first + (1 if ascending[first] < value else 0)


@kernel
def _select(values: Floats, first: int, last: int, k: int) -> None:
    """Partially sort values `first` to `last` (quickselect): value k is in its place, no smaller one is after it."""
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
    """Return the median of the first n values, which are reordered.

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
    """Return the (lower) median absolute deviation of the first n values, which are overwritten.

    >>> median_deviation(np.array([9.0, 1.0, 4.0, 10.0, 2.0]), 5)
    3.0
    """
    centre = median(values, n)
    for i in range(n):
        values[i] = abs(values[i] - centre)
    _select(values, 0, n - 1, (n - 1) // 2)
    return values[(n - 1) // 2]
