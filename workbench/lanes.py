"""Explicit vectors of four or eight numbers, for kernels where the compiler does not vectorise.

It vectorises a loop only if that is long enough to pay for the check that its arrays do not overlap, at some thirty
modes, and no recursions over frames. `four(array, m)` are the numbers at m to m + 3, `eight(array, m)` those at m to
m + 7; they are added, subtracted, multiplied, divided and compared like single numbers, and with one, with identical
bits. Indices of a two-dimensional array continue from row to row.
"""

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from typing import TYPE_CHECKING, Any

import numpy as np

from underfoot.kernels import Floats, Intrinsic

if TYPE_CHECKING:
    from numba import types

    from underfoot.emission import Emission, TypingContext


def _lowered(name: str, in_python: Callable[..., Any], *given: int | str) -> Intrinsic:
    """Return the intrinsic that a function of `lane_lowering`, loaded with the first kernel, emits for its arguments'
    types, and these numbers or names; and what it does in Python, on NumPy's arrays.
    """

    def emitted(context: "TypingContext", *kinds: "types.Type") -> "Emission":
        from underfoot import lane_lowering

        emission: Emission = getattr(lane_lowering, name)(*kinds, *given)
        return emission

    taken = [Parameter("context", Parameter.POSITIONAL_OR_KEYWORD), *signature(in_python).parameters.values()]
    vars(emitted)["__signature__"] = Signature(taken)  # which Numba reads
    return Intrinsic(emitted, in_python)


def _total(numbers: Floats) -> float:
    while len(numbers) > 1:
        numbers = numbers[: len(numbers) // 2] + numbers[len(numbers) // 2 :]
    return float(numbers[0])


four = _lowered("loaded", lambda array, m: np.ravel(array)[m : m + 4].copy(), 4)
"""Return the numbers m to m + 3 of an array of float64, which must exist: `four(array, m)`."""

eight = _lowered("loaded", lambda array, m: np.ravel(array)[m : m + 8].copy(), 8)
"""Return the numbers m to m + 7 of an array of float64, which must exist: `eight(array, m)`."""

take_like = _lowered("loaded_like", lambda like, array, m: np.ravel(array)[m : m + len(like)].copy())
"""Return as many numbers as `like` has: `take_like(like, array, m)`."""

put = _lowered("stored", lambda array, m, numbers: np.put(array, range(m, m + len(numbers)), numbers))
"""Write numbers from index m on of an array of float64, or of float32: `put(array, m, numbers)`."""

put_across = _lowered("stored_across", lambda array, m, rows: np.put(array, range(m, m + 64), np.transpose(rows)))
"""Write a tuple of eight rows of eight numbers column by column: `put_across(array, m, rows)`."""

all_four = _lowered("repeated", lambda number: np.full(4, number), 4)
"""Return four copies of a number."""

all_eight = _lowered("repeated", lambda number: np.full(8, number), 8)
"""Return eight copies of a number."""

all_one = _lowered("repeated", lambda number: np.full(1, number), 1)
"""Return a number as a vector of one, for what is written for four or eight."""

full_like = _lowered("repeated_like", lambda like, number: np.full(len(like), number))
"""Return as many copies of a number as `like` has: `full_like(like, number)`."""

total = _lowered("summed", _total)
"""Return the sum of one, four or eight: the second half is added to the first, until one number is left."""

chosen = _lowered("selected", lambda where, numbers, others: np.where(where, numbers, others))
"""Return numbers where a comparison holds, and the others elsewhere: `chosen(where, numbers, others)`."""

anywhere = _lowered("judged", lambda where: bool(np.any(where)), "!=", 0)
"""Return whether a comparison holds in any lane."""

everywhere = _lowered("judged", lambda where: bool(np.all(where)), "==", -1)
"""Return whether a comparison holds in all lanes."""

roots = _lowered("each", lambda numbers: np.sqrt(numbers), "llvm.sqrt")
"""Return the square roots."""

magnitudes = _lowered("each", lambda numbers: np.abs(numbers), "llvm.fabs")
"""Return the magnitudes."""
