"""Memory with names: what a kernel keeps and computes with, declared once, in one stretch of float64 values.

A layout names numbers, arrays and layouts within it. A kernel is given a memory of it and reads and writes
`state.x1` or `state.re[m]`; nobody counts places. Sizes that differ from instance to instance are symbols, and are
known when the memory is made. To compiled code a memory is an address and these sizes.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import FunctionType
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.imputils import lower_getattr_generic, lower_setattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, intrinsic, overload, register_model, unbox
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.kernel_cache import digest
from underfoot.memory import aligned_zeros, whole_lines

Size = int | str
"""How long a dimension is: a number, or the symbol of one that each memory has for itself."""

_OWN = ("address", "layout", "sizes", "values")
"""What a memory has besides its parts."""

_WORD = ir.IntType(64)


@dataclass(frozen=True)
class Part:
    """A named part of a layout: a number (`shape` is empty), an array, or a layout within it."""

    name: str
    shape: tuple[Size, ...] = ()
    layout: "Layout | None" = None

    @property
    def is_number(self) -> bool:
        """Whether it is one value."""
        return not self.shape and self.layout is None


class Layout:
    """What a memory holds: numbers by name, then arrays (`name=length` or `name=(rows, columns)`) and layouts.

    A length is a number or a symbol; a memory has the sizes of its symbols as attributes, too, and `values`, all of it.

    >>> bank = Layout("bank", "active", block=2, re=("modes",))
    >>> memory = bank.zeros(modes=3)
    >>> memory.active, memory.re[1] = 2.0, 7.0
    >>> memory.active, memory.re.tolist(), memory.modes, bank.size({"modes": 3})
    (2.0, [0.0, 7.0, 0.0], 3, 24)
    """

    def __init__(self, name: str, *numbers: str, **parts: "Size | tuple[Size, ...] | Layout") -> None:
        self.name = name
        made = [Part(number) for number in numbers]
        for label, what in parts.items():
            if isinstance(what, Layout):
                made.append(Part(label, layout=what))
            else:
                made.append(Part(label, what if isinstance(what, tuple) else (what,)))
        self.parts = {part.name: part for part in made}
        symbols: list[str] = []
        for part in made:
            require(part.name not in _OWN, "name of a part", part.name, f"one that is not of {', '.join(_OWN)}")
            symbols += part.layout.symbols if part.layout else [size for size in part.shape if isinstance(size, str)]
        self.symbols: tuple[str, ...] = tuple(dict.fromkeys(symbols))
        """The sizes that each memory has for itself, in order."""
        for symbol in self.symbols:
            require(symbol not in self.parts, "size", symbol, f"a name that no part of {name} has")

    def __repr__(self) -> str:
        return (
            f"{self.name}({', '.join(f'{part.name}{part.layout or list(part.shape)}' for part in self.parts.values())})"
        )

    def __reduce__(self) -> Any:
        return _layout_of, (self.name, tuple(self.parts.values()))

    def size(self, sizes: Mapping[str, Any]) -> Any:
        """The float64 values of a memory with these sizes."""
        return list(self.places(sizes))[-1]

    def places(self, sizes: Mapping[str, Any]) -> Iterator[Any]:
        """Where each part begins, and where the last one ends. Sizes are whole numbers, or words of compiled code."""
        at: Any = 0
        for part in self.parts.values():
            if not part.is_number:
                at = whole_lines(at)
            yield at
            length: Any = part.layout.size(sizes) if part.layout else 1
            for size in part.shape:
                length = length * (sizes[size] if isinstance(size, str) else size)
            at = at + length
        yield at if all(part.is_number for part in self.parts.values()) else whole_lines(at)

    def zeros(self, **sizes: int) -> "Memory":
        """A memory of zeros that begins on a cache line."""
        return Memory(self, aligned_zeros(self.size(sizes)), sizes)

    @cached_property
    def type(self) -> "MemoryType":
        """A memory of this layout, to the compiler."""
        return MemoryType(self)

    @cached_property
    def at(self) -> Any:
        """For compiled code: `layout.at(values, sizes)`, the memory in an array of float64 or at a pointer to one.

        `sizes` is a tuple of those in `symbols`.
        """
        kind = self.type

        @intrinsic
        def memory_at(context: Any, values: Any, sizes: Any) -> Any:
            def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
                made = cgutils.create_struct_proxy(kind)(context, builder)
                if isinstance(signature.args[0], types.Array):
                    made.pointer = context.make_array(signature.args[0])(context, builder, arguments[0]).data
                else:
                    made.pointer = arguments[0]
                for k, name in enumerate(kind.layout.symbols):
                    setattr(made, name, builder.extract_value(arguments[1], k))
                return made._getvalue()

            return kind(values, sizes), code

        return memory_at


def _layout_of(name: str, parts: tuple[Part, ...]) -> Layout:
    numbers = [part.name for part in parts if part.is_number]
    return Layout(name, *numbers, **{part.name: part.layout or part.shape for part in parts if not part.is_number})


class Memory:
    """A memory of a layout in Python: its numbers and arrays are attributes, `values` is all of it, float64."""

    def __init__(self, layout: Layout, values: NDArray[np.float64], sizes: Mapping[str, int]) -> None:
        own = {name: int(sizes[name]) for name in layout.symbols}
        vars(self).update(layout=layout, values=values, sizes=own, address=values.ctypes.data)
        vars(self).update(_numba_type_=layout.type)  # where Numba looks for the type of an argument

    def __getattr__(self, name: str) -> Any:
        fields = vars(self)
        if name in fields["sizes"]:
            return fields["sizes"][name]
        part, begin = self._find(name)
        if part.layout:
            size = part.layout.size(fields["sizes"])
            return Memory(part.layout, fields["values"][begin : begin + size], fields["sizes"])
        if part.is_number:
            return float(fields["values"][begin])
        shape = [fields["sizes"][size] if isinstance(size, str) else size for size in part.shape]
        return fields["values"][begin : begin + int(np.prod(shape))].reshape(shape)

    def __setattr__(self, name: str, value: float) -> None:
        part, begin = self._find(name)
        if not part.is_number:
            raise AttributeError(f"{name} is no number; write to its elements")
        self.values[begin] = value

    def __len__(self) -> int:
        """The number named `count`, of a layout that has one: how many there are of what it holds."""
        return int(self.count)

    def _find(self, name: str) -> tuple[Part, int]:
        layout = vars(self)["layout"]
        for part, begin in zip(layout.parts.values(), layout.places(vars(self)["sizes"]), strict=False):
            if part.name == name:
                return part, begin
        raise AttributeError(f"{layout.name} has no {name!r}; it has {', '.join(layout.parts)}")


@overload(len)
def _length(memory: Any) -> Any:
    def count(memory: Any) -> int:
        return int(memory.count)

    return count if isinstance(memory, MemoryType) and "count" in memory.layout.parts else None


class MemoryType(types.Type):
    """A memory, to the compiler."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        super().__init__(name=f"memory of {layout!r}")


@register_model(MemoryType)
class _MemoryModel(models.StructModel):
    def __init__(self, manager: Any, kind: MemoryType) -> None:
        sizes = [(name, types.int64) for name in kind.layout.symbols]
        super().__init__(manager, kind, [("pointer", types.CPointer(types.float64)), *sizes])


@unbox(MemoryType)
def _unbox(kind: MemoryType, memory: Any, context: Any) -> NativeValue:
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
    """A whole number of compiled code, for the sums of `Layout.places`."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def __add__(self, other: Any) -> "_Word":
        return _Word(self.builder, self.builder.add(self.value, _value(other)))

    def __mul__(self, other: Any) -> "_Word":
        return _Word(self.builder, self.builder.mul(self.value, _value(other)))

    def __and__(self, other: int) -> "_Word":
        return _Word(self.builder, self.builder.and_(self.value, _value(other)))

    __radd__, __rmul__ = __add__, __mul__


def _value(number: Any) -> Any:
    return number.value if isinstance(number, _Word) else ir.Constant(_WORD, number)


def _located(context: Any, builder: Any, kind: MemoryType, value: Any, name: str) -> tuple[Part, Any, dict[str, Any]]:
    """A part, its address, and the memory's sizes as words."""
    memory = cgutils.create_struct_proxy(kind)(context, builder, value)
    sizes = {symbol: _Word(builder, getattr(memory, symbol)) for symbol in kind.layout.symbols}
    for part, begin in zip(kind.layout.parts.values(), kind.layout.places(sizes), strict=False):
        if part.name == name:
            return part, builder.gep(memory.pointer, [_value(begin)]), sizes
    raise AssertionError(name)


@lower_getattr_generic(MemoryType)
def _get(context: Any, builder: Any, kind: MemoryType, value: Any, name: str) -> Any:
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


def _array(context: Any, builder: Any, pointer: Any, shape: list[Any]) -> Any:
    """A borrowed array of float64 at an address."""
    array = context.make_array(types.Array(types.float64, len(shape), "C"))(context, builder)
    strides = [ir.Constant(_WORD, 8)]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    populate_array(array, pointer, shape, strides, ir.Constant(_WORD, 8), None)
    return array._getvalue()


@lower_setattr_generic(MemoryType)
def _set(context: Any, builder: Any, signature: Any, arguments: Any, name: str) -> None:
    part, pointer, _ = _located(context, builder, signature.args[0], arguments[0], name)
    assert part.is_number, name
    builder.store(context.cast(builder, arguments[1], signature.args[1], types.float64), pointer)


def _functions(named: Mapping[str, Any]) -> Iterator[FunctionType]:
    """Every function of this file, those of its classes too."""
    for value in named.values():
        if getattr(value, "__module__", "") == __name__:
            if isinstance(value, FunctionType):
                yield value
            elif isinstance(value, type):
                yield from _functions(vars(value))


LOWERING = "".join(digest(function)[:8] for function in _functions(dict(globals())))
"""What identifies how memories are compiled: part of every kernel's digest, which does not see what Numba calls."""
