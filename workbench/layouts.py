"""Memory with named fields: the state and coefficients of a kernel, declared once, in one block of float64 values.

A layout names numbers, arrays and nested layouts. A kernel is passed a memory of that layout and reads and writes
`state.x1` or `state.re[m]`. Sizes that differ between instances are symbols, with values given when the memory is
made. In compiled code a memory is an address and these sizes.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.kernels import Intrinsic
from underfoot.memory import aligned_zeros, whole_lines

if TYPE_CHECKING:
    from underfoot.memory_lowering import MemoryType

Size = int | str
"""Length of a dimension: a number, or the symbol of a size of each memory."""

_OWN = ("address", "layout", "sizes", "values")
"""Attributes of a memory besides its parts."""


class Part(Struct, frozen=True):
    """Named part of a layout: a number (`shape` is empty), an array, or a nested layout."""

    name: str
    shape: tuple[Size, ...] = ()
    layout: "Layout | None" = None

    @property
    def is_number(self) -> bool:
        """Whether it is a single value."""
        return not self.shape and self.layout is None


class Layout:
    """Fields of a memory: numbers by name, then arrays (`name=length` or `name=(rows, columns)`) and layouts.

    A length is a number or a symbol. A memory also has the sizes of its symbols as attributes, and `values`, all of it.

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
        """Symbols whose sizes each memory has, in order."""
        for symbol in self.symbols:
            require(symbol not in self.parts, "size", symbol, f"a name that no part of {name} has")

    def __repr__(self) -> str:
        return (
            f"{self.name}({', '.join(f'{part.name}{part.layout or list(part.shape)}' for part in self.parts.values())})"
        )

    def __reduce__(self) -> tuple[Callable[..., "Layout"], tuple[str, tuple[Part, ...]]]:
        return _layout_of, (self.name, tuple(self.parts.values()))

    def size(self, sizes: Mapping[str, Any]) -> Any:  # noqa: ANN401 - as the sizes
        """Return the number of float64 values in a memory with these sizes."""
        return list(self.places(sizes))[-1]

    def places(self, sizes: Mapping[str, Any]) -> Iterator[Any]:
        """Yield the start of each part, and the end of the last one. Sizes are integers, or words of compiled code."""
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
        """Return a zeroed memory, aligned to a cache line."""
        return Memory(self, aligned_zeros(self.size(sizes)), sizes)

    @cached_property
    def type(self) -> "MemoryType":
        """Numba type of a memory of this layout."""
        from underfoot.memory_lowering import MemoryType

        return MemoryType(self)

    @cached_property
    def at(self) -> Any:  # noqa: ANN401 - compiled code calls it
        """For compiled code: `layout.at(values, sizes)` views a memory in an array of float64 or at a pointer to one.

        `sizes` is a tuple of those in `symbols`.
        """
        return MemoryAt(self)


class MemoryAt(Struct, frozen=True, dict=True):
    """Constructor of a layout's memory in compiled code."""

    layout: Layout

    @cached_property
    def _numba_type_(self) -> object:
        from underfoot.memory_lowering import memory_at

        return Intrinsic(memory_at(self.layout.type))._numba_type_


def _layout_of(name: str, parts: tuple[Part, ...]) -> Layout:
    numbers = [part.name for part in parts if part.is_number]
    return Layout(name, *numbers, **{part.name: part.layout or part.shape for part in parts if not part.is_number})


class Memory:
    """Memory of a layout in Python: numbers and arrays are attributes, `values` is all of it, float64."""

    def __init__(self, layout: Layout, values: NDArray[np.float64], sizes: Mapping[str, int]) -> None:
        own = {name: int(sizes[name]) for name in layout.symbols}
        vars(self).update(layout=layout, values=values, sizes=own, address=values.ctypes.data)

    @cached_property
    def _numba_type_(self) -> object:
        """Type of an argument for Numba."""
        return self.layout.type

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - of the part's type
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

    def with_numpy_numbers(self) -> "Memory":
        """Return the same memory with numbers of NumPy, which divide by zero as compiled code does."""
        return _NumPyMemory(self.layout, self.values, self.sizes)

    def __len__(self) -> int:
        """The number named `count`, in layouts that have one: the number of items."""
        return int(self.count)

    def _find(self, name: str) -> tuple[Part, int]:
        layout = vars(self)["layout"]
        found = _parts(layout, *vars(self)["sizes"].values()).get(name)
        if found is None:
            raise AttributeError(f"{layout.name} has no {name!r}; it has {', '.join(layout.parts)}")
        return found


class _NumPyMemory(Memory):
    def __getattr__(self, name: str) -> object:
        found = super().__getattr__(name)
        if isinstance(found, Memory):
            return found.with_numpy_numbers()
        return np.float64(found) if isinstance(found, float) else found


@lru_cache(maxsize=512)
def _parts(layout: Layout, *sizes: int) -> dict[str, tuple[Part, int]]:
    """Return each part of a memory by its name, and where it starts; `sizes` in the order of the layout's symbols."""
    places = layout.places(dict(zip(layout.symbols, sizes, strict=True)))
    return {part.name: (part, begin) for part, begin in zip(layout.parts.values(), places, strict=False)}
