"""Explicit vectors of four or eight numbers, for kernels where the compiler does not vectorise.

It vectorises a loop only if that is long enough to pay for the check that its arrays do not overlap, at some thirty
modes, and no recursions over frames. `four(array, m)` are the numbers at m to m + 3, `eight(array, m)` those at m to
m + 7; they are added, subtracted, multiplied, divided and compared like single numbers, and with one, with identical
bits. Indices of a two-dimensional array continue from row to row.
"""

from typing import TYPE_CHECKING

import numpy as np

from underfoot.kernels import Floats, intrinsic_or

if TYPE_CHECKING:
    from numba import types

    from underfoot.emission import Emission, TypingContext
    from underfoot.lane_lowering import Compared, Lanes


@intrinsic_or(lambda array, m: np.ravel(array)[m : m + 4].copy())
def four(context: "TypingContext", array: "types.Array", m: "types.Type") -> "Emission":
    """Return the numbers m to m + 3 of an array of float64, which must exist."""
    from underfoot.lane_lowering import loaded

    return loaded(array, 4)


@intrinsic_or(lambda array, m: np.ravel(array)[m : m + 8].copy())
def eight(context: "TypingContext", array: "types.Array", m: "types.Type") -> "Emission":
    """Return the numbers m to m + 7 of an array of float64, which must exist."""
    from underfoot.lane_lowering import loaded

    return loaded(array, 8)


@intrinsic_or(lambda like, array, m: np.ravel(array)[m : m + len(like)].copy())
def take_like(context: "TypingContext", like: "Lanes", array: "types.Array", m: "types.Type") -> "Emission":
    """Return the numbers of an array of float64 from index m on, as many as `like` has; all must exist."""
    from underfoot.lane_lowering import after, loaded

    return after(like, *loaded(array, like.count))


@intrinsic_or(lambda array, m, numbers: np.put(array, range(m, m + len(numbers)), numbers))
def put(context: "TypingContext", array: "types.Array", m: "types.Type", numbers: "Lanes") -> "Emission":
    """Write numbers from index m on of an array of float64, or of float32."""
    from underfoot.lane_lowering import stored

    return stored(array, numbers)


@intrinsic_or(lambda array, m, rows: np.put(array, range(m, m + 64), np.transpose(rows)))
def put_across(context: "TypingContext", array: "types.Array", m: "types.Type", rows: "types.UniTuple") -> "Emission":
    """Write a tuple of eight rows of eight numbers column by column, from index m of an array on."""
    from underfoot.lane_lowering import stored_across

    return stored_across(array, rows)


@intrinsic_or(lambda number: np.full(4, number))
def all_four(context: "TypingContext", number: "types.Type") -> "Emission":
    """Return four copies of a number."""
    from underfoot.lane_lowering import repeated

    return repeated(4)


@intrinsic_or(lambda number: np.full(8, number))
def all_eight(context: "TypingContext", number: "types.Type") -> "Emission":
    """Return eight copies of a number."""
    from underfoot.lane_lowering import repeated

    return repeated(8)


@intrinsic_or(lambda number: np.full(1, number))
def all_one(context: "TypingContext", number: "types.Type") -> "Emission":
    """Return a number as a vector of one, for what is written for four or eight."""
    from underfoot.lane_lowering import repeated

    return repeated(1)


@intrinsic_or(lambda like, number: np.full(len(like), number))
def full_like(context: "TypingContext", like: "Lanes", number: "types.Type") -> "Emission":
    """Return as many copies of a number as `like` has."""
    from underfoot.lane_lowering import after, repeated

    return after(like, *repeated(like.count))


def _total(numbers: Floats) -> float:
    while len(numbers) > 1:
        numbers = numbers[: len(numbers) // 2] + numbers[len(numbers) // 2 :]
    return float(numbers[0])


@intrinsic_or(_total)
def total(context: "TypingContext", numbers: "Lanes") -> "Emission":
    """Return the sum of one, four or eight: the second half is added to the first, until one number is left."""
    from underfoot.lane_lowering import summed

    return summed(numbers)


@intrinsic_or(lambda where, numbers, others: np.where(where, numbers, others))
def chosen(context: "TypingContext", where: "Compared", numbers: "Lanes", others: "Lanes") -> "Emission":
    """Return numbers where a comparison holds, and the others elsewhere."""
    from underfoot.lane_lowering import selected

    return selected(where, numbers, others)


@intrinsic_or(lambda where: bool(np.any(where)))
def anywhere(context: "TypingContext", where: "Compared") -> "Emission":
    """Return whether a comparison holds in any lane."""
    from underfoot.lane_lowering import any_of

    return any_of(where)


@intrinsic_or(lambda where: bool(np.all(where)))
def everywhere(context: "TypingContext", where: "Compared") -> "Emission":
    """Return whether a comparison holds in all lanes."""
    from underfoot.lane_lowering import all_of

    return all_of(where)


@intrinsic_or(lambda numbers: np.sqrt(numbers))
def roots(context: "TypingContext", numbers: "Lanes") -> "Emission":
    """Return the square roots."""
    from underfoot.lane_lowering import each

    return each(numbers, "llvm.sqrt")


@intrinsic_or(lambda numbers: np.abs(numbers))
def magnitudes(context: "TypingContext", numbers: "Lanes") -> "Emission":
    """Return the magnitudes."""
    from underfoot.lane_lowering import each

    return each(numbers, "llvm.fabs")
