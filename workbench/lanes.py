"""Four numbers at a time: what a kernel computes on where a loop is too short for the compiler's own vectors.

The compiler makes vectors of a loop only where it is long enough to pay for the proof that its arrays do not overlap,
at some thirty modes. `four(array, m)` are the numbers at m to m + 3; they are added, subtracted and multiplied as one
number is, and by one.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, register_model

LANES = 4

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


class Lanes(types.Type):
    """Four float64, to the compiler."""

    def __init__(self) -> None:
        super().__init__(name="four float64")


_KIND = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _VECTOR)


@intrinsic
def four(context: Any, array: Any, m: Any) -> Any:
    """The numbers m to m + 3 of an array of float64, which must have them."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, signature, arguments), align=8)

    return _KIND(array, types.intp), code


@intrinsic
def put(context: Any, array: Any, m: Any, numbers: Any) -> Any:
    """Write four numbers to the places m to m + 3 of an array."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _place(context, builder, signature, arguments), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, numbers), code


@intrinsic
def all_four(context: Any, number: Any) -> Any:
    """Four times the same number."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), arguments[0], _INDEX(0))
        return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))

    return _KIND(types.float64), code


@intrinsic
def total(context: Any, numbers: Any) -> Any:
    """The sum of the four: of the first and the third, and the second and the fourth."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (of,) = arguments
        halves = [builder.shuffle_vector(of, of, ir.Constant(ir.VectorType(_INDEX, 2), at)) for at in ([0, 1], [2, 3])]
        pair = builder.fadd(*halves)
        return builder.fadd(builder.extract_element(pair, _INDEX(0)), builder.extract_element(pair, _INDEX(1)))

    return types.float64(_KIND), code


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.bitcast(builder.gep(array.data, [arguments[1]]), _VECTOR.as_pointer())


def _operate(sign: Callable[..., Any], name: str) -> None:
    @infer_global(sign)
    class Template(AbstractTemplate):
        key = sign

        def generic(self, args: Any, kws: Any) -> Any:
            return signature(_KIND, *args) if args == (_KIND, _KIND) else None

    @lower_builtin(sign, _KIND, _KIND)
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return getattr(builder, name)(*arguments)


_operate(operator.add, "fadd")
_operate(operator.sub, "fsub")
_operate(operator.mul, "fmul")
