"""What a node is: ports, parameters and up to three functions, declared by a class of a few lines.

    @node("low-pass", "Filters")
    class LowPass:
        \"\"\"What it does, for the palette and the reference.\"\"\"

        signal = Input()
        cutoff = Number(300.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="where it begins to cut")
        out = Output()
        state, coefficients = second_order.STATE, second_order.COEFFICIENTS

        def design(cutoff, rate, coefficients): ...
        def run(signal, coefficients, state, out): ...
        def tail(state, coefficients): ...

The functions are compiled, each for one row, which is one tile. They are given what they name, and nothing else:

- `run` computes a stretch of frames. It may take the node's inputs and outputs (arrays of the stretch's frames; lists
  of events), its numbers with `wire="audio"` (arrays), its other numbers, counts and choices (a choice as its place
  among the options), `controls` (these others all at once), `state`, `coefficients`, prepared tables, `rate` (frames a
  second), `frame` and `end` (the stretch in session frames) and `key` (of random draws for this seed, node and tile).
  It must write every frame of its outputs.
- `design` computes the coefficients. It is called before the first `run`, and when a number that it names has moved.
- `tail` gives a bound of what can still come out when nothing comes in: 0 for a row that may sleep, infinity for one
  that may not. It may be a number for all rows; without it a node leaves nothing behind.

`state` and `coefficients` are layouts; their sizes come from `sizes(values, rate)`. A row that falls asleep has its
state set to zero, and keeps its coefficients. What `run` writes may depend on the frames only, never on how they are
cut into stretches.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing
from underfoot.parameters import Number, Parameter
from underfoot.patch.binding import Binding, Names, Prepared, Values


@dataclass(frozen=True)
class Port:
    """A place where a wire ends. `kind` is "signal" or "event"; an empty unit fits every unit."""

    name: str
    kind: str
    unit: str = ""
    doc: str = ""


@dataclass(frozen=True)
class Input:
    """Declares an input: a signal in `unit`, or events. What `is_brought` comes from the engine instead of a wire."""

    unit: str = ""
    kind: str = "signal"
    doc: str = ""
    is_brought: bool = False


@dataclass(frozen=True)
class Output:
    """Declares an output: a signal in `unit`, or events."""

    unit: str = ""
    kind: str = "signal"
    doc: str = ""


def prepared(make: Callable[..., Any]) -> Prepared:
    """A table of one dimension that is made of the node's values, and of the rate, when a program is built."""
    return Prepared(make, 1)


def prepared_columns(make: Callable[..., Any]) -> Prepared:
    """A table of two dimensions, [column, row], that is made of the node's values, and of the rate."""
    return Prepared(make, 2)


@dataclass(frozen=True)
class AskedError:
    """How a node that keeps the error which its parameter `error` asks for is measured.

    `of` and `cost` say what the error is of, and what is timed. The module `measured_by`, which is imported only then,
    has `work(values)`, which makes ready what costs and gives what does it once, and `error_found(values)`, the error
    that comes of it beside a tight solution.
    """

    of: str
    cost: str
    measured_by: str


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
    """Names of the signals that the engine brings."""
    parameters: Mapping[str, Parameter]
    binding: Binding
    muted_by: tuple[str, ...]
    is_sink: bool
    to_sound: bool
    """Whether what it plays goes to the channel for ears, not to a tile."""
    is_struck: bool
    """Whether the engine may bring it events, as the last of its event inputs."""
    is_sum: bool = False
    """Whether its inputs are added, so that solo silences those that lead from nothing soloed."""
    accuracy: str = ""
    """How exact it is, with the bound that is tested; or that it keeps an error that a parameter asks for."""
    laws: Callable[[Values], tuple[Drawing, ...]] | None = None
    """What draws the laws of an instance's values: distributions, curves. None where there are none to be drawn."""
    asked: AskedError | None = None
    """How its run time and error are measured, where its parameter `error` asks for one."""
    missing: str = ""
    """Why this only stands for a node whose own file was not run (`underfoot.patch.own_nodes`); "" for a real one."""

    @cached_property
    def signal_parameters(self) -> tuple[Number, ...]:
        """Numbers that are read once a frame."""
        return _signal_parameters(self.parameters)

    @cached_property
    def controls(self) -> tuple[Parameter, ...]:
        """Numbers, counts and choices that are read once a span."""
        return _controls(self.parameters)

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
        """Every port that a wire may begin at."""
        return {port.name: port for port in self.outputs}

    def compile(self) -> None:
        """Have the kernels compiled, or loaded from the cache."""
        for kernel in (self.binding.run, self.binding.tail):
            assert kernel is None or kernel.address

    def data(self, values: Values, rate: float) -> NDArray[np.float64]:
        """What the kernels of an instance with these values read besides its controls."""
        return self.binding.data(values, rate)

    def values(self, given: Values) -> dict[str, Any]:
        """Every parameter's value: the given ones checked, the others at their defaults."""
        return {
            name: parameter.check(given[name]) if name in given else parameter.default
            for name, parameter in self.parameters.items()
        }


Registry = Mapping[str, NodeType]
"""Node types by their name in files."""


def installed_nodes() -> Registry:
    """Every node type there is: Underfoot's own, and those of plug-ins.

    The module is asked for by its name and not imported: which nodes there are is known above this package.

    >>> "tile-output" in installed_nodes()
    True
    """
    found: Registry = import_module("underfoot.nodes").REGISTRY
    return found


def node(type: str, family: str, label: str = "") -> Callable[[type], NodeType]:
    """Turn a class into a `NodeType`; the module says what the class may hold.

    Besides ports, parameters and functions that is: `state` and `coefficients`, layouts, and `sizes(values, rate)`,
    what their symbols are; prepared tables; `muted_by`, the names of signals any of which at exactly zero makes the
    output exactly zero; `is_sink`, when its output is played: by the tile, or with `to_sound` for ears; `is_sum`, when
    its inputs are added; `accuracy`, how exact it is; `asked`, how that is measured where a parameter `error` asks
    for it; and `laws(values)`, what draws distributions. `BadValue` for a function that names what is not there.
    """

    def declare(cls: Any) -> NodeType:
        body = {name: value for base in reversed(cls.__mro__) for name, value in vars(base).items()}
        ports = {name: value for name, value in body.items() if isinstance(value, Input | Output)}
        parameters = {name: value for name, value in body.items() if isinstance(value, Parameter)}
        tables = {name: value for name, value in body.items() if isinstance(value, Prepared)}
        inputs = {name: port for name, port in ports.items() if isinstance(port, Input) and not port.is_brought}
        brought = {name: port for name, port in ports.items() if isinstance(port, Input) and port.is_brought}
        outputs = {name: port for name, port in ports.items() if isinstance(port, Output)}
        names = Names(
            signals_in=(
                *_of("signal", brought),
                *_of("signal", inputs),
                *(p.name for p in _signal_parameters(parameters)),
            ),
            signals_out=_of("signal", outputs),
            events_in=(*_of("event", inputs), *_of("event", brought)),
            events_out=_of("event", outputs),
            controls={parameter.name: parameter.kind != "number" for parameter in _controls(parameters)},
            tables={name: table.dimensions for name, table in tables.items()},
        )
        return NodeType(
            type=type,
            label=label or type.replace("-", " ").capitalize(),
            family=family,
            doc=inspect.cleandoc(cls.__doc__),
            inputs=tuple(Port(name, p.kind, p.unit, p.doc) for name, p in inputs.items()),
            outputs=tuple(Port(name, p.kind, p.unit, p.doc) for name, p in outputs.items()),
            hosts=_of("signal", brought),
            parameters=parameters,
            binding=Binding(cls, names, tables),
            muted_by=body.get("muted_by", ()),
            is_sink=body.get("is_sink", False),
            to_sound=body.get("to_sound", False),
            is_struck=any(port.kind == "event" for port in brought.values()),
            is_sum=body.get("is_sum", False),
            accuracy=body.get("accuracy", ""),
            laws=body.get("laws"),
            asked=body.get("asked"),
        )

    return declare


def _of(kind: str, ports: Mapping[str, Input | Output]) -> tuple[str, ...]:
    return tuple(name for name, port in ports.items() if port.kind == kind)


def _signal_parameters(parameters: Mapping[str, Parameter]) -> tuple[Number, ...]:
    return tuple(p for p in parameters.values() if isinstance(p, Number) and p.wire == "audio")


def _controls(parameters: Mapping[str, Parameter]) -> tuple[Parameter, ...]:
    signals = _signal_parameters(parameters)
    return tuple(p for p in parameters.values() if p.kind in ("number", "count", "choice") and p not in signals)
