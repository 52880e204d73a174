"""Lowering of lanes to vectors of the processor."""

import operator
from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core.datamodel import models
from numba.core.datamodel.manager import DataModelManager
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import register_model

from underfoot.emission import Arguments, BaseContext, Code, Emission, Signature

_INDEX = ir.IntType(32)


class Lanes(types.Type):
    """Numba type of `count` float64 values."""

    def __init__(self, count: int) -> None:
        self.count, self.vector = count, ir.VectorType(ir.DoubleType(), count)
        super().__init__(name=f"{count} float64")


class Compared(types.Type):
    """Numba type of the comparison of `count` float64 values: a truth value for each."""

    def __init__(self, count: int) -> None:
        self.count, self.vector = count, ir.VectorType(ir.IntType(1), count)
        super().__init__(name=f"{count} comparisons")


@register_model(Lanes)
@register_model(Compared)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: DataModelManager, kind: Lanes | Compared) -> None:
        super().__init__(manager, kind, kind.vector)


def loaded(array: types.Type, m: types.Type, count: int) -> Emission:
    """Load `count` numbers of an array."""
    kind = Lanes(count)

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        return builder.load(_place(context, builder, signature, arguments, kind.vector), align=8)

    return kind(array, types.intp), code


def loaded_like(like: Lanes, array: types.Type, m: types.Type) -> Emission:
    """Load as many numbers as `like` has."""
    return _after(like, *loaded(array, m, like.count))


def stored(array: types.Array, m: types.Type, kind: Lanes) -> Emission:
    """Store numbers to an array; to one of float32 rounded to nearest."""

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        _store(context, builder, signature, arguments, arguments[2])
        return context.get_dummy_value()

    return types.void(array, types.intp, kind), code


def stored_across(array: types.Array, m: types.Type, kind: types.UniTuple) -> Emission:
    """Store a square block of numbers, column by column."""
    count = kind.count
    assert kind.dtype == Lanes(count)

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        rows = [builder.extract_value(arguments[2], k) for k in range(count)]
        # Rows half of `step` apart exchange halves of their blocks, until the blocks are single numbers.
        step = count
        while step > 1:
            step //= 2
            low = [k if k & step == 0 else k - step + count for k in range(count)]
            high = [k + step if k & step == 0 else k + count for k in range(count)]
            for k in range(count):
                if k & step == 0:
                    pair = rows[k], rows[k + step]
                    rows[k], rows[k + step] = (builder.shuffle_vector(*pair, _places(at)) for at in (low, high))
        for k, row in enumerate(rows):
            at = builder.add(arguments[1], arguments[1].type(k * count))
            _store(context, builder, signature, (arguments[0], at), row)
        return context.get_dummy_value()

    return types.void(array, types.intp, kind), code


def repeated(number: types.Type, count: int) -> Emission:
    """Broadcast a number to `count` lanes."""
    kind = Lanes(count)

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        one = builder.insert_element(ir.Constant(kind.vector, ir.Undefined), arguments[0], _INDEX(0))
        return builder.shuffle_vector(one, one, _places([0] * count))

    return kind(types.float64), code


def repeated_like(like: Lanes, number: types.Type) -> Emission:
    """Broadcast a number to as many lanes as `like` has."""
    return _after(like, *repeated(number, like.count))


def _after(like: Lanes, rest: Signature, code: Code) -> Emission:
    """Return an intrinsic with one more argument, before the others, of which only the type matters."""

    def code_of_rest(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments
    ) -> ir.Value:
        return code(context, builder, rest, arguments[1:])

    return rest.return_type(like, *rest.args), code_of_rest


def summed(kind: Lanes) -> Emission:
    """Return the sum of one, four or eight: the second half is added to the first, until one number is left."""

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        (of,) = arguments
        count = kind.count
        while count > 1:
            count //= 2
            first, second = ([*range(begin, begin + count)] for begin in (0, count))
            of = builder.fadd(*(builder.shuffle_vector(of, of, _places(half)) for half in (first, second)))
        return builder.extract_element(of, _INDEX(0))

    return types.float64(kind), code


def selected(where: Compared, numbers: Lanes, others: Lanes) -> Emission:
    """Select numbers where a comparison holds, and the others elsewhere."""

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        return builder.select(*arguments)

    return numbers(where, numbers, others), code


def judged(where: Compared, sign: str, bits: int) -> Emission:
    """Compare the bits of a comparison, one for each lane, with `bits`, where -1 has all: by "==" or "!=", `sign`."""

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        word = builder.bitcast(arguments[0], ir.IntType(where.count))
        return builder.icmp_signed(sign, word, word.type(bits))

    return types.boolean(where), code


def each(kind: Lanes, name: str) -> Emission:
    """Apply an LLVM intrinsic of one number to each lane."""

    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        function = ir.FunctionType(kind.vector, [kind.vector])
        declared = builder.module.declare_intrinsic(f"{name}.v{kind.count}f64", fnty=function)
        return builder.call(declared, arguments)

    return kind(kind), code


def _places(at: list[int]) -> ir.Constant:
    return ir.Constant(ir.VectorType(_INDEX, len(at)), at)


def _place(
    context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments, vector: ir.VectorType
) -> ir.Value:
    assert signature.args[0].ndim == 1 or signature.args[0].layout == "C"
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.bitcast(builder.gep(array.data, [arguments[1]]), vector.as_pointer())


def _store(
    context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments, numbers: ir.Value
) -> None:
    """Store numbers to the array and index that are the first two arguments."""
    if signature.args[0].dtype == types.float32:
        numbers = builder.fptrunc(numbers, ir.VectorType(ir.FloatType(), numbers.type.count))
    builder.store(numbers, _place(context, builder, signature, arguments, numbers.type), align=4)


def _operate(
    sign: Callable[..., object], of: type, result: Callable[[int], types.Type], write: Callable[..., ir.Value]
) -> None:
    """Define an operator between two values of the same kind; `write(builder, a, b)` emits its code."""

    @infer_global(sign)
    class Template(AbstractTemplate):
        key = sign

        def generic(self, args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Signature | None:
            alike = len(args) == 2 and isinstance(args[0], of) and args[0] == args[1]
            return signature(result(args[0].count), *args) if alike else None

    @lower_builtin(sign, of, of)
    def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
        return write(builder, *arguments)


_operate(operator.add, Lanes, Lanes, lambda builder, a, b: builder.fadd(a, b))
_operate(operator.sub, Lanes, Lanes, lambda builder, a, b: builder.fsub(a, b))
_operate(operator.mul, Lanes, Lanes, lambda builder, a, b: builder.fmul(a, b))
_operate(operator.truediv, Lanes, Lanes, lambda builder, a, b: builder.fdiv(a, b))
_operate(operator.gt, Lanes, Compared, lambda builder, a, b: builder.fcmp_ordered(">", a, b))
_operate(operator.lt, Lanes, Compared, lambda builder, a, b: builder.fcmp_ordered("<", a, b))
_operate(operator.eq, Lanes, Compared, lambda builder, a, b: builder.fcmp_ordered("==", a, b))
_operate(operator.and_, Compared, Compared, lambda builder, a, b: builder.and_(a, b))
