"""Binding of a node's functions, which name their arguments, to kernels that the driver calls by address.

The driver calls all nodes alike, with pointers. An adapter, generated from the argument names, passes arrays of the
stretch's frames, numbers and memories, and calls `design` when a parameter that it names has changed.

    run   (x, y, c, s, t, d, e, o, key, rate, frame, n)     tail  (c, s, t, d), a float64

    x, y   input and output signals; e, o input and output event lists     c   the controls, one float64 each
    s      state: a memory of the node's layout, zeroed when the row falls asleep
    t      1 once designed, copies of the controls that `design` names, then a memory of the layout of coefficients
    d      data of the instance: sizes, position and shape of each prepared table, the tables
"""

import dis
import inspect
import math
import operator
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.errors import BadFile, BadValue, UnderfootError, kind_and_words, require
from underfoot.kernels import Intrinsic, allocating, callback, kernel
from underfoot.layouts import Layout
from underfoot.memory import LINE, whole_lines
from underfoot.models.signals.events import events_at

if TYPE_CHECKING:
    from llvmlite import ir
    from numba.core.ccallback import CFunc

    from underfoot.emission import Arguments, BaseContext, Emission, Signature, Type, TypingContext

Values = Mapping[str, Any]
"""Values of a node's parameters, by name."""

_P = "CPointer(float64)"
_PP = f"CPointer({_P})"
_RUN = f"void({_PP}, {_PP}, {_P}, {_P}, {_P}, {_P}, {_PP}, {_PP}, uint64, float64, int64, int64)"
_TAIL = f"float64({_P}, {_P}, {_P}, {_P})"
_RUN_ARGUMENTS = "x, y, c, s, t, d, e, o, key, rate, frame, n"
_CLOCK = {"rate": "rate", "frame": "frame", "end": "frame + n", "key": "key"}
"""Arguments of `run` besides those declared by its node."""


class Prepared(Struct, frozen=True):
    """Table returned by `make(values, rate)` when a program is built, with its number of dimensions."""

    make: Callable[[Values, float], Any]
    dimensions: int

    def table(self, values: Values, rate: float) -> NDArray[np.float64]:
        """Return the table as passed to the kernels."""
        made = np.ascontiguousarray(self.make(values, rate), np.float64)
        return made.reshape((0,) * self.dimensions) if made.size == 0 and made.ndim != self.dimensions else made


_RAISES = dis.opmap["RAISE_VARARGS"]
"""Operation code of `raise`. Every other byte of a function's code is one; `dis` would need 10 ms for all nodes."""


class Names(Struct, frozen=True):
    """Names available to a node's functions: its ports, and its controls in order."""

    signals_in: tuple[str, ...]
    signals_out: tuple[str, ...]
    events_in: tuple[str, ...]
    events_out: tuple[str, ...]
    controls: Mapping[str, bool]
    """Numbers read once per span, in order, and whether each is passed as a whole number."""


class Binding:
    """Functions of a node, `design`, `run` and `tail`, and the memory that they share."""

    def __init__(self, cls: type, names: Names, prepared: Mapping[str, Prepared]) -> None:
        self.cls, self.names, self.prepared = cls, names, prepared
        functions = {name: getattr(cls, name, None) for name in ("design", "run", "tail")}
        self.functions = {name: function for name, function in functions.items() if callable(function)}
        self.controls = Layout("controls", *names.controls)
        self.state: Layout | None = getattr(cls, "state", None)
        self.coefficients: Layout | None = getattr(cls, "coefficients", None)
        for name in ("state", "coefficients"):
            memory = getattr(cls, name, None)
            require(memory is None or isinstance(memory, Layout), f"{name} of {cls.__name__}", memory, "a Layout")
        layouts = [layout for layout in (self.state, self.coefficients) if layout is not None]
        self.symbols = tuple(dict.fromkeys(symbol for layout in layouts for symbol in layout.symbols))
        self._check()

    # --- the memory of a row ---

    def state_size(self, values: Values, rate: float) -> int:
        """Return the number of float64 values in a row's state."""
        return self.state.size(self.sizes(values, rate)) if self.state else 0

    def coefficients_size(self, values: Values, rate: float) -> int:
        """Return the number of float64 values in a row's coefficients, including the flag that they were designed."""
        return self._head + (self.coefficients.size(self.sizes(values, rate)) if self.coefficients else 0)

    def sizes(self, values: Values, rate: float) -> Mapping[str, int]:
        """Return the values of the layouts' symbols; `BadFile` names the node's file if it does not give them."""
        if not self.symbols:
            return {}
        with self.faults("sizes"):
            given = self.cls.sizes(values, rate)  # type: ignore[attr-defined]
            found = {symbol: operator.index(given[symbol]) for symbol in self.symbols}
            if negative := [f"{symbol} is {size}" for symbol, size in found.items() if size < 0]:
                raise ValueError(f"{negative[0]}; allowed: 0 or more")
            return found

    def data(self, values: Values, rate: float) -> NDArray[np.float64]:
        """Return the data of an instance: its sizes and its prepared tables."""
        tables = [self._table(name, values, rate) for name in self.prepared]
        sizes = self.sizes(values, rate)
        head = [float(sizes[symbol]) for symbol in self.symbols]
        at = whole_lines(len(head) + sum(1 + table.ndim for table in tables))
        parts = []
        for table in tables:
            head += [at, *table.shape]
            parts.append(np.pad(table.ravel(), (0, -table.size % LINE)))
            at += parts[-1].size
        return np.concatenate([np.pad(head, (0, -len(head) % LINE)), *parts])

    def _table(self, name: str, values: Values, rate: float) -> NDArray[np.float64]:
        """Return a prepared table; `BadFile` names the node's file if it cannot be made."""
        wanted = self.prepared[name].dimensions
        with self.faults(name):
            table = self.prepared[name].table(values, rate)
        if table.ndim != wanted:
            raise BadFile(f"{self._file}: {name} of {self.cls.__name__} has {table.ndim} dimensions; allowed: {wanted}")
        return table

    @contextmanager
    def faults(self, name: str) -> Iterator[None]:
        """Turn an error in what the node declares as `name`, which can be any, into a line with the node's file."""
        try:
            yield
        except UnderfootError:
            raise
        except Exception as error:
            reason = kind_and_words(error)
            raise BadFile(f"{self._file}: {name} of {self.cls.__name__} cannot be made: {reason}") from error

    @property
    def _file(self) -> str:
        return getattr(sys.modules.get(self.cls.__module__), "__file__", None) or "<node>"  # a notebook has no file

    # --- the adapters ---

    @cached_property
    def run(self) -> "CFunc":
        """Return the kernel that the driver calls for a stretch of frames."""
        lines = [*self._memories("run"), *self._designing(), f"    run({self._arguments('run')})"]
        return self._compiled("run", f"({_RUN_ARGUMENTS})", lines, _RUN)

    @cached_property
    def tail(self) -> "CFunc | None":
        """Return the kernel that bounds the remaining output of a row; None for a node without a tail."""
        constant = getattr(self.cls, "tail", 0.0)
        if constant == 0.0:
            return None
        if "tail" in self.functions:
            lines = [*self._memories("tail"), f"    return tail({self._arguments('tail')})"]
        else:
            lines = [f"    return {constant!r}"]
        return self._compiled("tail", "(c, s, t, d)", lines, _TAIL)

    @property
    def _head(self) -> int:
        return whole_lines(1 + len(self._watched)) if "design" in self.functions else 0

    @property
    def _watched(self) -> list[str]:
        """Return the controls that `design` names, individually or as `controls`."""
        taken = _taken(self.functions["design"])
        return [name for name in self.names.controls if name in taken or "controls" in taken]

    def _check(self) -> None:
        port_names = [*self.names.signals_in, *self.names.signals_out, *self.names.events_in, *self.names.events_out]
        reserved = ("controls", "state", "coefficients", *_CLOCK, *self.prepared)
        for name in [*port_names, *self.names.controls]:
            allowed = f"any name but {', '.join(reserved)}"
            require(name not in reserved, f"name of a port or parameter of {self.cls.__name__}", name, allowed)
        muting, signals = getattr(self.cls, "muted_by", ()), self.names.signals_in
        is_signals = isinstance(muting, tuple) and set(muting) <= set(signals)
        require(is_signals, f"muted_by of {self.cls.__name__}", muting, f"a tuple of {', '.join(signals) or 'none'}")
        tail = getattr(self.cls, "tail", 0.0)
        is_tail = callable(tail) or (isinstance(tail, int | float) and tail >= 0.0)
        require(is_tail, f"tail of {self.cls.__name__}", tail, "a number from 0 to math.inf, or a function")
        if port_names and "run" not in self.functions:
            raise BadValue(f"{self.cls.__name__} has no function run, which computes its outputs")
        for name, function in self.functions.items():
            known = self._expressions(name)
            for taken in _taken(function):
                if taken not in known:
                    allowed = ", ".join(known)
                    raise BadValue(f"{name} of {self.cls.__name__} takes {taken!r}; allowed: {allowed}")
            if name == "run" and (omitted := {*self.names.signals_out, *self.names.events_out} - set(_taken(function))):
                raise BadValue(
                    f"run of {self.cls.__name__} does not take its output {min(omitted)!r}, which it must write"
                )
            if _RAISES in inspect.unwrap(function).__code__.co_code[::2]:
                says = "raises an error, which nothing could catch while it plays; allowed: to write 0"
                raise BadValue(f"{name} of {self.cls.__name__} {says}")

    def _expressions(self, function: str) -> dict[str, str]:
        """Return the expression for each name in the adapter of a function."""
        names = self.names
        known = {
            name: f"int(c[{k}])" if is_whole else f"c[{k}]" for k, (name, is_whole) in enumerate(names.controls.items())
        }
        known["controls"] = "controls_at(c, ())"
        at = len(self.symbols)
        for name, table in self.prepared.items():
            shape = ", ".join(f"int(d[{at + 1 + k}])" for k in range(table.dimensions))
            known[name] = f"carray(shifted(d, int(d[{at}])), ({shape},))"
            at += 1 + table.dimensions
        if self.coefficients is not None:
            known["coefficients"] = "coefficients"
        if self.state is not None and function != "design":
            known["state"] = "state"
        if function == "design":
            known["rate"] = "rate"
        if function == "run":
            for pointer, ports in (("x", names.signals_in), ("y", names.signals_out)):
                known |= {port: f"carray({pointer}[{k}], (n,))" for k, port in enumerate(ports)}
            for pointer, ports in (("e", names.events_in), ("o", names.events_out)):
                known |= {port: f"events_at({pointer}[{k}], (int({pointer}[{k}][1]),))" for k, port in enumerate(ports)}
            known |= _CLOCK
        return known

    def _arguments(self, function: str) -> str:
        known = self._expressions(function)
        return ", ".join(known[name] for name in _taken(self.functions[function]))

    def _memories(self, function: str) -> list[str]:
        taken = set(_taken(self.functions[function]))
        if function == "run" and "design" in self.functions:
            taken |= set(_taken(self.functions["design"]))
        lines = []
        for name, layout, pointer in (
            ("state", self.state, "s"),
            ("coefficients", self.coefficients, f"shifted(t, {self._head})"),
        ):
            if layout is not None and name in taken:
                sizes = "".join(f"int(d[{self.symbols.index(symbol)}]), " for symbol in layout.symbols)
                lines.append(f"    {name} = {name}_at({pointer}, ({sizes}))")
        return lines

    def _designing(self) -> list[str]:
        if "design" not in self.functions:
            return []
        places = list(self.names.controls)
        pairs = [(places.index(name), k) for k, name in enumerate(self._watched, 1)]
        moved = " or ".join(["t[0] == 0.0", *(f"c[{j}] != t[{k}]" for j, k in pairs)])
        copies = "".join(f"        t[{k}] = c[{j}]\n" for j, k in pairs)
        return [f"    if {moved}:\n        t[0] = 1.0\n{copies}        design({self._arguments('design')})"]

    def _compiled(self, name: str, arguments: str, lines: Iterable[str], signature: "Signature") -> "CFunc":
        """Compile an adapter as if it were in the node's file."""
        from numba import carray

        adapter = f"{self.cls.__name__}_{name}"
        source = "\n".join([f"def {adapter}{arguments}:", *lines])
        names: dict[str, Any] = {"carray": carray, "shifted": shifted, "events_at": events_at, "inf": math.inf}
        names["controls_at"] = self.controls.at
        names |= {function: allocating(kernel(body)) for function, body in self.functions.items()}
        for layout, key in ((self.state, "state_at"), (self.coefficients, "coefficients_at")):
            if layout is not None:
                names[key] = layout.at
        exec(compile(source, self._file, "exec"), names)
        function = names[adapter]
        function.__module__ = self.cls.__module__
        return callback(signature, function)


def _taken(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)


@Intrinsic
def shifted(context: "TypingContext", pointer: "Type", places: "Type") -> "Emission":
    """Return the pointer shifted by `places` float64 values."""
    from numba import types

    def code(
        context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", arguments: "Arguments"
    ) -> "ir.Value":
        return builder.gep(arguments[0], [arguments[1]])

    return pointer(pointer, types.int64), code
