"""Several numbers at a time: what a kernel computes on where the compiler makes no vectors by itself.

It makes them of a loop only where that is long enough to pay for the proof that its arrays do not overlap, at some
thirty modes, and of nothing whose frames follow from one another. `four(array, m)` are the numbers at m to m + 3,
`eight(array, m)` those at m to m + 7; they are added, subtracted, multiplied, divided and compared as one number is,
and by one, each to the bits of one. In an array of two dimensions places go on from row to row.
"""

from typing import Any

from underfoot.kernels import intrinsic


@intrinsic
def four(context: Any, array: Any, m: Any) -> Any:
    """The numbers m to m + 3 of an array of float64, which must have them."""
    from underfoot.lane_lowering import loaded

    return loaded(array, 4)


@intrinsic
def eight(context: Any, array: Any, m: Any) -> Any:
    """The numbers m to m + 7 of an array of float64, which must have them."""
    from underfoot.lane_lowering import loaded

    return loaded(array, 8)


@intrinsic
def put(context: Any, array: Any, m: Any, numbers: Any) -> Any:
    """Write numbers to the places from m on of an array of float64, or of float32."""
    from underfoot.lane_lowering import stored

    return stored(array, numbers)


@intrinsic
def put_across(context: Any, array: Any, m: Any, rows: Any) -> Any:
    """Write a tuple of eight rows of eight numbers column after column, from place m of an array on."""
    from underfoot.lane_lowering import stored_across

    return stored_across(array, rows)


@intrinsic
def all_four(context: Any, number: Any) -> Any:
    """Four times the same number."""
    from underfoot.lane_lowering import repeated

    return repeated(4)


@intrinsic
def all_eight(context: Any, number: Any) -> Any:
    """Eight times the same number."""
    from underfoot.lane_lowering import repeated

    return repeated(8)


@intrinsic
def total(context: Any, numbers: Any) -> Any:
    """The sum of four or eight: the second half is added to the first, until one number is left."""
    from underfoot.lane_lowering import summed

    return summed(numbers)


@intrinsic
def chosen(context: Any, where: Any, numbers: Any, others: Any) -> Any:
    """Numbers where a comparison holds, and the others elsewhere."""
    from underfoot.lane_lowering import selected

    return selected(where, numbers, others)


@intrinsic
def anywhere(context: Any, where: Any) -> Any:
    """Whether a comparison holds for any of its numbers."""
    from underfoot.lane_lowering import any_of

    return any_of(where)


@intrinsic
def everywhere(context: Any, where: Any) -> Any:
    """Whether a comparison holds for all of its numbers."""
    from underfoot.lane_lowering import all_of

    return all_of(where)


@intrinsic
def roots(context: Any, numbers: Any) -> Any:
    """The square root of each."""
    from underfoot.lane_lowering import each

    return each(numbers, "llvm.sqrt")


@intrinsic
def magnitudes(context: Any, numbers: Any) -> Any:
    """The magnitude of each."""
    from underfoot.lane_lowering import each

    return each(numbers, "llvm.fabs")
