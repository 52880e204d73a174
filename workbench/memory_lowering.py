"""Lowering of memories to an address and sizes, whose parts are located by the layout."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.datamodel.manager import DataModelManager
from numba.core.imputils import lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, overload, register_model, unbox

from underfoot.emission import Arguments, BaseContext, Emission, Signature, TypingContext, UnboxContext

_WORD = ir.IntType(64)


def memory_at(kind: "MemoryType") -> Callable[..., Emission]:
    """Return the definition of the intrinsic `layout.at`."""

    def made_at(context: TypingContext, values: types.Type, sizes: types.BaseTuple) -> Emission:
        def code(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments) -> ir.Value:
            made = cgutils.create_struct_proxy(kind)(context, builder)
            if isinstance(signature.args[0], types.Array):
                made.pointer = context.make_array(signature.args[0])(context, builder, arguments[0]).data
            else:
                made.pointer = arguments[0]
            for k, name in enumerate(kind.layout.symbols):
                setattr(made, name, builder.extract_value(arguments[1], k))
            return made._getvalue()

        return kind(values, sizes), code

    return made_at


@overload(len)
def _length(memory: "MemoryType") -> "Callable[[MemoryType], int] | None":
    def count(memory: "MemoryType") -> int:
        return int(memory.count)

    return count if isinstance(memory, MemoryType) and "count" in memory.layout.parts else None


class MemoryType(types.Type):
    """Numba type of a memory."""

    def __init__(self, layout: Any) -> None:  # noqa: ANN401 - a layout, whose file imports this one
        self.layout = layout
        super().__init__(name=f"memory of {layout!r}")


@register_model(MemoryType)
class _MemoryModel(models.StructModel):
    def __init__(self, manager: DataModelManager, kind: MemoryType) -> None:
        sizes = [(name, types.int64) for name in kind.layout.symbols]
        super().__init__(manager, kind, [("pointer", types.CPointer(types.float64)), *sizes])


@unbox(MemoryType)
def _unbox(kind: MemoryType, memory: ir.Value, context: UnboxContext) -> NativeValue:
    made = cgutils.create_struct_proxy(kind)(context.context, context.builder)
    address = context.pyapi.object_getattr_string(memory, "address")
    made.pointer = context.builder.inttoptr(context.pyapi.long_as_longlong(address), made.pointer.type)
    context.pyapi.decref(address)
    for name in kind.layout.symbols:
        size = context.pyapi.object_getattr_string(memory, name)
        setattr(made, name, context.pyapi.long_as_longlong(size))
        context.pyapi.decref(size)
    return NativeValue(made._getvalue(), is_error=cgutils.is_not_null(context.builder, context.pyapi.err_occurred()))


@infer_getattr
class _MemoryAttributes(AttributeTemplate):
    key = MemoryType

    def generic_resolve(self, kind: MemoryType, name: str) -> types.Type | None:
        if name in kind.layout.symbols:
            return types.int64
        if name == "values":
            return types.Array(types.float64, 1, "C")
        part = kind.layout.parts.get(name)
        if part is None:
            return None
        if part.layout:
            return part.layout.type
        return types.float64 if part.is_number else types.Array(types.float64, len(part.shape), "C")


class _Word:
    """Integer of compiled code, for the sums of `Layout.places`."""

    def __init__(self, builder: ir.IRBuilder, value: ir.Value) -> None:
        self.builder, self.value = builder, value

    def __add__(self, other: "_Word | int") -> "_Word":
        return _Word(self.builder, self.builder.add(self.value, _value(other)))

    def __mul__(self, other: "_Word | int") -> "_Word":
        return _Word(self.builder, self.builder.mul(self.value, _value(other)))

    def __and__(self, other: int) -> "_Word":
        return _Word(self.builder, self.builder.and_(self.value, _value(other)))

    __radd__, __rmul__ = __add__, __mul__


def _value(number: "_Word | int") -> ir.Value:
    return number.value if isinstance(number, _Word) else ir.Constant(_WORD, number)


def _located(
    context: BaseContext, builder: ir.IRBuilder, kind: MemoryType, value: ir.Value, name: str
) -> tuple[Any, ir.Value, dict[str, _Word]]:
    """Return a part, its address, and the memory's sizes as words."""
    memory = cgutils.create_struct_proxy(kind)(context, builder, value)
    sizes = {symbol: _Word(builder, getattr(memory, symbol)) for symbol in kind.layout.symbols}
    for part, begin in zip(kind.layout.parts.values(), kind.layout.places(sizes), strict=False):
        if part.name == name:
            return part, builder.gep(memory.pointer, [_value(begin)]), sizes
    raise AssertionError(name)


@lower_getattr_generic(MemoryType)
def _get(context: BaseContext, builder: ir.IRBuilder, kind: MemoryType, value: ir.Value, name: str) -> ir.Value:
    if name in kind.layout.symbols:
        return getattr(cgutils.create_struct_proxy(kind)(context, builder, value), name)
    if name == "values":
        memory = cgutils.create_struct_proxy(kind)(context, builder, value)
        sizes = {symbol: _Word(builder, getattr(memory, symbol)) for symbol in kind.layout.symbols}
        return _array(context, builder, memory.pointer, [_value(kind.layout.size(sizes))])
    part, pointer, sizes = _located(context, builder, kind, value, name)
    if part.is_number:
        return builder.load(pointer)
    if part.layout:
        inner = cgutils.create_struct_proxy(part.layout.type)(context, builder)
        inner.pointer = pointer
        for symbol in part.layout.symbols:
            setattr(inner, symbol, sizes[symbol].value)
        return inner._getvalue()
    return _array(
        context, builder, pointer, [_value(sizes[size] if isinstance(size, str) else size) for size in part.shape]
    )


def _array(context: BaseContext, builder: ir.IRBuilder, pointer: ir.Value, shape: list[ir.Value]) -> ir.Value:
    """Return a borrowed array of float64 at an address."""
    from numba.np.arrayobj import populate_array  # 40 ms, not needed for a kernel that is only loaded

    array = context.make_array(types.Array(types.float64, len(shape), "C"))(context, builder)
    strides = [ir.Constant(_WORD, 8)]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(array, pointer, shape, strides, ir.Constant(_WORD, 8), None)
    return array._getvalue()


@lower_setattr_generic(MemoryType)
def _set(context: BaseContext, builder: ir.IRBuilder, signature: Signature, arguments: Arguments, name: str) -> None:
    part, pointer, _ = _located(context, builder, signature.args[0], arguments[0], name)
    assert part.is_number, name
    builder.store(context.cast(builder, arguments[1], signature.args[1], types.float64), pointer)
