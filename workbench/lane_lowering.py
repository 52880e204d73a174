"""How four numbers at a time are compiled: to a vector of the processor's."""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import register_model

from underfoot.memory import LANES

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_INDEX = ir.IntType(32)


class Lanes(types.Type):
    """Four float64, to the compiler."""

    def __init__(self) -> None:
        super().__init__(name="four float64")


KIND = Lanes()


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Lanes) -> None:
        super().__init__(manager, kind, _VECTOR)


def loaded(array: types.Type) -> Any:
    """Four numbers of an array."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(_place(context, builder, signature, arguments), align=8)

    return KIND(array, types.intp), code


def stored(array: types.Type) -> Any:
    """Four numbers, written to an array."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[2], _place(context, builder, signature, arguments), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, KIND), code


def repeated() -> Any:
    """Four times the same number."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), arguments[0], _INDEX(0))
        return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))

    return KIND(types.float64), code


def summed() -> Any:
    """The sum of the four: of the first and the third, and the second and the fourth."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (of,) = arguments
        halves = [builder.shuffle_vector(of, of, ir.Constant(ir.VectorType(_INDEX, 2), at)) for at in ([0, 1], [2, 3])]
        pair = builder.fadd(*halves)
        return builder.fadd(builder.extract_element(pair, _INDEX(0)), builder.extract_element(pair, _INDEX(1)))

    return types.float64(KIND), code


def _place(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.bitcast(builder.gep(array.data, [arguments[1]]), _VECTOR.as_pointer())


def _operate(sign: Callable[..., Any], name: str) -> None:
    @infer_global(sign)
    class Template(AbstractTemplate):
        key = sign

        def generic(self, args: Any, kws: Any) -> Any:
            return signature(KIND, *args) if args == (KIND, KIND) else None

    @lower_builtin(sign, KIND, KIND)
    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return getattr(builder, name)(*arguments)


_operate(operator.add, "fadd")
_operate(operator.sub, "fsub")
_operate(operator.mul, "fmul")
