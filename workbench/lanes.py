"""Four numbers at a time: what a kernel computes on where a loop is too short for the compiler's own vectors.

The compiler makes vectors of a loop only where it is long enough to pay for the proof that its arrays do not overlap,
at some thirty modes. `four(array, m)` are the numbers at m to m + 3; they are added, subtracted and multiplied as one
number is, and by one.
"""

from typing import Any

from underfoot.kernels import intrinsic


@intrinsic
def four(context: Any, array: Any, m: Any) -> Any:
    """The numbers m to m + 3 of an array of float64, which must have them."""
    from underfoot.lane_lowering import loaded

    return loaded(array)


@intrinsic
def put(context: Any, array: Any, m: Any, numbers: Any) -> Any:
    """Write four numbers to the places m to m + 3 of an array."""
    from underfoot.lane_lowering import stored

    return stored(array)


@intrinsic
def all_four(context: Any, number: Any) -> Any:
    """Four times the same number."""
    from underfoot.lane_lowering import repeated

    return repeated()


@intrinsic
def total(context: Any, numbers: Any) -> Any:
    """The sum of the four: of the first and the third, and the second and the fourth."""
    from underfoot.lane_lowering import summed

    return summed()
