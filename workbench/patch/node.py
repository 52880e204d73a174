"""What a node is: ports, parameters, state and one kernel, declared by a class of a few lines.

A node's kernel handles one row, which is one tile, for a stretch of frames. All kernels share one signature, so that a
whole program runs in one compiled call:

    run(x, y, c, s, t, d, e, o, key, rate, frame, n)

    x[j][i]   signal j in at frame i: what the engine brings, the inputs, then the parameters that are read once a frame
    y[j][i]   output j at frame i; every one of the n frames must be written
    c[j]      the other numbers and choices (as an index) at the beginning of this span, in the order of declaration
    s[j]      state; all zero is at rest, and it is set to zero when the row falls asleep
    t[j]      tuning: what is computed from c, kept while the row sleeps; all zero at first
    d[j]      what `prepare` made of the values, the same for every row
    e[j]      events in on port j: [count, time, strength, duration, time, ...]
    o[j]      events out, the same form; the kernel appends
    key       of the random draws for (seed, node, tile)
    rate      session frames a second
    frame, n  the first session frame, and how many

What a kernel writes may depend on the frames only, never on how they are cut into stretches.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numba import carray, types

from underfoot.kernels import callback, kernel
from underfoot.parameters import Number, Parameter

_P = types.CPointer(types.float64)
_PP = types.CPointer(_P)
_RUN = types.void(_PP, _PP, _P, _P, _P, _P, _PP, _PP, types.uint64, types.float64, types.int64, types.int64)
_REST = types.float64(_P, _P, _P, _P)

NEVER = np.inf
"""What a `rest` kernel answers when its row may not sleep."""


@dataclass(frozen=True)
class Port:
    """A place where a wire ends. `kind` is "signal" or "event"; an empty unit fits every unit."""

    name: str
    kind: str
    unit: str = ""
    doc: str = ""


@dataclass(frozen=True)
class Input:
    """Declares an input: a signal in `unit`, or events. `host` names a signal that the engine brings."""

    unit: str = ""
    kind: str = "signal"
    doc: str = ""
    host: str = ""


@dataclass(frozen=True)
class Output:
    """Declares an output: a signal in `unit`, or events."""

    unit: str = ""
    kind: str = "signal"
    doc: str = ""


class RowKernel:
    """A kernel that is compiled, or loaded from the cache, when its address is first asked for."""

    def __init__(self, function: Callable, signature: Any) -> None:
        self.function = function
        self.signature = signature

    @cached_property
    def _compiled(self) -> Any:
        return callback(self.signature, self.function)

    @property
    def address(self) -> int:
        """Where the compiled kernel is."""
        return self._compiled.address


def run_kernel(function: Callable) -> Any:
    """Mark the kernel of a node; the module says what it is given."""
    return RowKernel(function, _RUN)


def rest_kernel(function: Callable) -> Any:
    """Mark `rest(c, s, t, d)`: a bound of what the row can still put out when its inputs stay zero, or `NEVER`."""
    return RowKernel(function, _REST)


@kernel
def frames(pointer, count):
    """The `count` float64 values at `pointer` as an array, for models that take arrays."""
    return carray(pointer, count)


@kernel
def event_list(events):
    """The events of a list in or out as the flat array that models take: [time, strength, duration, time, ...]."""
    return carray(events, 1 + 3 * int(events[0]))[1:]


@kernel
def room(events, count):
    """Room for `count` more events at the end of a list out, as a flat array; `grow` says how many were written."""
    return carray(events, 1 + 3 * (int(events[0]) + count))[1 + 3 * int(events[0]) :]


@kernel
def grow(events, count):
    """Take the `count` events that were written into `room` into the list."""
    events[0] += count


@kernel
def emit(events, time, strength, duration):
    """Append an event to a list of events out; one in the last one's frame is added to it, at their weighted time."""
    count = int(events[0])
    if count > 0 and np.floor(events[3 * count - 2]) == np.floor(time):
        last = 3 * count - 2
        total = events[last + 1] + strength
        if total != 0.0:
            events[last] += (time - events[last]) * (strength / total)
        events[last + 1] = total
        events[last + 2] = max(events[last + 2], duration)
        return
    events[3 * count + 1] = time
    events[3 * count + 2] = strength
    events[3 * count + 3] = duration
    events[0] = count + 1


@kernel
def moved(c, t, count):
    """Whether any of the first `count` controls differs from the copy kept at the head of `t`; renews the copy."""
    differs = False
    for j in range(count):
        if c[j] != t[j]:
            t[j] = c[j]
            differs = True
    return differs


@dataclass(frozen=True)
class NodeType:
    """What the class of a node declares, in the form that patch, program, window and reference read."""

    type: str
    label: str
    family: str
    doc: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    hosts: tuple[str, ...]
    parameters: Mapping[str, Parameter]
    run: RowKernel
    rest: RowKernel | None
    state: Callable[[Mapping[str, Any], float], int]
    tuning: Callable[[Mapping[str, Any], float], int]
    prepare: Callable[[Mapping[str, Any], float], np.ndarray]
    muted_by: tuple[str, ...]
    is_sink: bool
    is_struck: bool

    @cached_property
    def signal_parameters(self) -> tuple[Number, ...]:
        """Numbers that are read once a frame."""
        return tuple(p for p in self.parameters.values() if isinstance(p, Number) and p.wire == "audio")

    @cached_property
    def controls(self) -> tuple[Parameter, ...]:
        """Numbers, counts and choices that are read once a span."""
        return tuple(
            p
            for p in self.parameters.values()
            if p.kind in ("number", "count", "choice") and p not in self.signal_parameters
        )

    @cached_property
    def input_ports(self) -> Mapping[str, Port]:
        """Every port that a wire may end at: the inputs, and the parameters that a wire may drive."""
        ports = {port.name: port for port in self.inputs}
        for parameter in self.parameters.values():
            if isinstance(parameter, Number) and parameter.wire:
                ports[parameter.name] = Port(parameter.name, "signal", parameter.unit, parameter.doc)
        return ports

    @cached_property
    def output_ports(self) -> Mapping[str, Port]:
        return {port.name: port for port in self.outputs}

    def compile(self) -> None:
        """Have the kernels compiled, or loaded from the cache."""
        for compiled in (self.run, self.rest):
            assert compiled is None or compiled.address

    def values(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Every parameter's value: the given ones checked, the others at their defaults."""
        return {
            name: parameter.check(given[name]) if name in given else parameter.default
            for name, parameter in self.parameters.items()
        }


Registry = Mapping[str, NodeType]
"""Node types by their name in files."""


def node(type: str, family: str, label: str = "") -> Callable[[type], NodeType]:
    """Turn a class into a `NodeType`.

    The class may say: `run` (required), `rest`; `state` and `tuning`, each a number of float64 values or a function of
    (values, rate); `prepare(values, rate)`, an array for `d`; `muted_by`, the names of signals any of which at exactly
    zero makes the output exactly zero; `is_sink`, when its output is what a tile plays; `is_struck`, when the engine
    may bring it events, as the last of its event inputs.
    """

    def declare(cls: Any) -> NodeType:
        body = vars(cls)
        ports = {name: value for name, value in body.items() if isinstance(value, Input | Output)}
        return NodeType(
            type=type,
            label=label or type.replace("-", " ").capitalize(),
            family=family,
            doc=inspect.cleandoc(cls.__doc__),
            inputs=tuple(
                Port(name, p.kind, p.unit, p.doc) for name, p in ports.items() if isinstance(p, Input) and not p.host
            ),
            outputs=tuple(Port(n, p.kind, p.unit, p.doc) for n, p in ports.items() if isinstance(p, Output)),
            hosts=tuple(p.host for p in ports.values() if isinstance(p, Input) and p.host),
            parameters={name: value for name, value in body.items() if isinstance(value, Parameter)},
            run=body["run"],
            rest=body.get("rest"),
            state=_size(body.get("state", 0)),
            tuning=_size(body.get("tuning", 0)),
            prepare=body.get("prepare", _nothing),
            muted_by=body.get("muted_by", ()),
            is_sink=body.get("is_sink", False),
            is_struck=body.get("is_struck", False),
        )

    return declare


def _size(size: int | Callable) -> Callable[[Mapping[str, Any], float], int]:
    return size if callable(size) else lambda values, rate: size


def _nothing(values: Mapping[str, Any], rate: float) -> np.ndarray:
    return np.zeros(0)
