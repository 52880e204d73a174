"""Node types: ports, parameters and up to three functions, declared by a class of a few lines.

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

The functions are compiled, each for one row (one tile). They are passed the arguments that they name:

- `run` computes a stretch of frames. It may take the node's inputs and outputs (arrays of the stretch's frames; event
  lists), its numbers with `wire="audio"` (arrays), its other numbers, counts and choices (a choice as its index among
  the options), `controls` (these others all at once), `state`, `coefficients`, prepared tables, `rate` (frames per
  second), `frame` and `end` (the stretch in session frames) and `key` (of random draws for this seed, node and tile).
  It must write every frame of its outputs.
- `design` computes the coefficients. It is called before the first `run`, and when a number that it names has changed.
- `tail` returns a bound of the remaining output without input: 0 for a row that may sleep, infinity for one that may
  not. It may be a number for all rows; a node without `tail` has no remaining output.

`state` and `coefficients` are layouts; their sizes come from `sizes(values, rate)`. A row that falls asleep has its
state set to zero, and keeps its coefficients. The output of `run` may depend on the frames only, never on how they are
split into stretches.
"""

import builtins
import inspect
import math
import sys
from collections.abc import Callable, Mapping
from functools import cached_property
from importlib import import_module
from typing import Any

from msgspec import Struct

from underfoot.arguments import number
from underfoot.drawing import Drawing
from underfoot.errors import require
from underfoot.parameters import Number, Parameter, require_identifier
from underfoot.patch.binding import Binding, Names, Prepared, Values

ENGINE_SIGNALS = ("force_n", "x_m", "y_m", "cut")
"""Signals from the engine: a tile's tared force, the contact position in the tile's frame, and 1 while the force of a
contact comes in whose beginning was not seen.
"""
TILE_CONSTANTS = ("centre_x_m", "centre_y_m")
"""Constants of a tile: the place of its centre on the floor."""


class Port(Struct, frozen=True):
    """End point of wires. `kind` is "signal" or "event"; an empty unit accepts every unit."""

    name: str
    kind: str
    unit: str = ""
    doc: str = ""


def can_connect(source: Port, target: Port) -> bool:
    """Return whether two ports have the same kind and unit, where both have one; `Patch.connect` decides."""
    return source.kind == target.kind and (not source.unit or not target.unit or source.unit == target.unit)


class Input(Struct, frozen=True):
    """Declares an input: a signal in `unit`, or events. With `from_engine` the engine supplies it instead of a wire;
    with `of_tile` it is a constant of the tile.
    """

    unit: str = ""
    kind: str = "signal"
    doc: str = ""
    from_engine: bool = False
    of_tile: bool = False


class Output(Struct, frozen=True):
    """Declares an output: a signal in `unit`, or events."""

    unit: str = ""
    kind: str = "signal"
    doc: str = ""


def prepared(make: Callable[..., Any]) -> Prepared:
    """Declare a one-dimensional table, `make(values, rate)`, made when a program is built."""
    return Prepared(make, 1)


def prepared_columns(make: Callable[..., Any]) -> Prepared:
    """Declare a two-dimensional table, in the shape that `make(values, rate)` returns."""
    return Prepared(make, 2)


class RequestedError(Struct, frozen=True):
    """How error and cost of a node with a parameter `error` are measured.

    `of` and `cost` describe the error, and what is timed. The module `measured_by`, imported only when needed, has
    `timed_work(values)`, which prepares the work and returns a function that does it once, and
    `measured_error(values)`, the error compared with a tight solution.
    """

    of: str
    cost: str
    measured_by: str


class NodeType(Struct, frozen=True, dict=True):
    """Declaration of a node, in the form that patch, program, window and reference read."""

    type: str
    label: str
    family: str
    doc: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    engine_signals: tuple[str, ...]
    """Names of the signals that the engine supplies."""
    tile_constants: tuple[str, ...]
    """Names of the constants of the tile."""
    parameters: Mapping[str, Parameter]
    signal_parameters: tuple[Number, ...]
    """Numbers that are read every frame."""
    controls: tuple[Parameter, ...]
    """Numbers, counts and choices that are read once per span."""
    binding: Binding
    is_struck: bool
    """Whether the engine may send it events, at the last of its event inputs."""
    muted_by: tuple[str, ...] = ()
    is_sink: bool = False
    to_sound: bool = False
    """Whether its output goes to the sound channel, not to a tile."""
    also_called: str = ""
    """What it, or what it is used for, is called in other programs, by which it is found: "VCA, amplifier"."""
    is_sum: bool = False
    """Whether its inputs are added, so that solo silences those without a soloed source."""
    accuracy: str = ""
    """Accuracy, with the bound that is tested; or the quantity whose error a parameter asks for."""
    distributions: Callable[[Values], tuple[Drawing, ...]] | None = None
    """Draws the distributions or curves for an instance's values; None if there are none."""
    lasts: Callable[[Values], float] | None = None
    """Seconds that an instance with these values goes on by itself after what starts it; None if it does not."""
    requested_error: RequestedError | None = None
    """How run time and error are measured, for a node with a parameter `error`."""
    missing: str = ""
    """Why this is a stand-in for a node whose file was not run (`underfoot.patch.custom_nodes`); "" for a real node."""

    @cached_property
    def input_ports(self) -> Mapping[str, Port]:
        """Ports at which a wire may end: inputs, and parameters that a wire may drive."""
        ports = {port.name: port for port in self.inputs}
        for parameter in self.parameters.values():
            if isinstance(parameter, Number) and parameter.wire:
                ports[parameter.name] = Port(parameter.name, "signal", parameter.unit, parameter.doc)
        return ports

    @cached_property
    def drivable_ports(self) -> tuple[Port, ...]:
        """Ports of the parameters that a wire may drive."""
        return tuple(port for name, port in self.input_ports.items() if name in self.parameters)

    @cached_property
    def output_ports(self) -> Mapping[str, Port]:
        """Ports at which a wire may start."""
        return {port.name: port for port in self.outputs}

    def compile(self) -> None:
        """Compile the kernels, or load them from the cache."""
        _ = self.binding.run, self.binding.tail  # each is compiled as it is first read

    def drawings(self, values: Values) -> tuple[Drawing, ...]:
        """Return what `distributions` draws; `BadFile` names the node's file if it fails."""
        with self.binding.faults("distributions"):
            return self.distributions(values) if self.distributions else ()

    def lasting_s(self, values: Values) -> float:
        """Return the seconds of `lasts`, infinity without end; `BadFile` names the node's file if it fails.

        `BadValue` for what it returns and is none.
        """
        with self.binding.faults("lasts"):
            found = self.lasts(values) if self.lasts else 0.0
        return number(f"lasts of {self.type}", found, 0.0, math.inf, "seconds, 0 or more")

    def ends(self, port: str) -> list[str]:
        """Return the two parameters between which the signal of a port lies; none where there are no such.

        >>> from underfoot.nodes import REGISTRY
        >>> REGISTRY["lfo"].ends("out"), REGISTRY["map"].ends("signal"), REGISTRY["map"].ends("out")
        (['low', 'high'], ['low', 'high'], ['out_low', 'out_high'])
        """
        of_port = [name for name, one in self.parameters.items() if getattr(one, "unit_of", "") == port]
        ends = [name for name in of_port if name.removeprefix("out_") in ("low", "high")]
        return ends if len(ends) == 2 else []

    def values(self, given: Values) -> dict[str, Any]:
        """Return every parameter's value: the given ones checked, the others at their defaults."""
        return {
            name: parameter.check(given[name]) if name in given else parameter.default
            for name, parameter in self.parameters.items()
        }

    @property
    def initial(self) -> dict[str, Any]:
        """What a node added by hand is given: parameters that begin with another value than their default."""
        return {name: one.initial for name, one in self.parameters.items() if one.initial != one.default}


_BOUND = ("run", "design", "tail", "state", "coefficients", "sizes")
"""What `Binding` reads of a class."""
_TOLD = (
    "muted_by", "is_sink", "to_sound", "also_called", "is_sum", "accuracy", "distributions", "lasts", "requested_error",
)  # fmt: skip
"""What a `NodeType` has as its class tells it."""

Registry = Mapping[str, NodeType]
"""Node types by their name in files."""


def installed_nodes() -> Registry:
    """Return every node type: Underfoot's own, and those of plug-ins.

    The registry's module is imported by name at run time, because it is above this package.

    >>> "tile-output" in installed_nodes()
    True
    """
    found: Registry = import_module("underfoot.nodes").REGISTRY
    return found


def node(type: str, family: str, label: str = "") -> Callable[[type], NodeType]:
    """Turn a class into a `NodeType`; the module's docstring describes the functions.

    Besides ports, parameters and functions a class may have: `state` and `coefficients`, layouts, and
    `sizes(values, rate)`, the values of their symbols; prepared tables; `muted_by`, signals any of which at exactly
    zero makes the output exactly zero; `is_sink`, if its output is played: by the tile, or with `to_sound` as
    sound; `is_sum`, if its inputs are added; `also_called`, words of other programs by which it is found;
    `accuracy`; `requested_error`, how error and cost are measured for a parameter `error`; `lasts(values)`, the
    seconds that it goes on by itself; and `distributions(values)`, which draws distributions. `BadValue` for any other
    name, for a function with an unknown argument, and for a `run` without one of the outputs.
    """

    def declare(cls: builtins.type) -> NodeType:
        require_identifier(f"type of node {cls.__name__}", type)
        kept = "; start Python without -OO and PYTHONOPTIMIZE=2, which drop it" if sys.flags.optimize > 1 else ""
        require(bool(cls.__doc__), f"docstring of node {type}", cls.__doc__, f"what the node does, for its help{kept}")
        body = {name: value for base in reversed(cls.__mro__) for name, value in vars(base).items()}
        ports = {name: value for name, value in body.items() if isinstance(value, Input | Output)}
        parameters = {name: value for name, value in body.items() if isinstance(value, Parameter)}
        for parameter in parameters.values():
            parameter.check_declaration()
        tables = {name: value for name, value in body.items() if isinstance(value, Prepared)}
        known = {*ports, *parameters, *tables, *_BOUND, *_TOLD}
        other = next((name for name in body if name not in known and not name.startswith("_")), "")
        allowed = f"ports, parameters, prepared tables, {', '.join(_BOUND + _TOLD)}"
        require(not other, f"name in node {type}", other, allowed)
        also_called = body.get("also_called", "")
        words = 'words in one text, as "VCA, amplifier"'
        require(isinstance(also_called, str), f"also_called of node {type}", also_called, words)
        inputs = {name: port for name, port in ports.items() if isinstance(port, Input)}
        from_engine = _taken_out(inputs, type, "from_engine", ENGINE_SIGNALS)
        of_tile = _taken_out(inputs, type, "of_tile", TILE_CONSTANTS)
        outputs = {name: port for name, port in ports.items() if isinstance(port, Output)}
        signals = tuple(p for p in parameters.values() if isinstance(p, Number) and p.wire == "audio")
        controls = tuple(p for p in parameters.values() if p.kind in ("number", "count", "choice") and p not in signals)
        names = Names(
            signals_in=(*_of("signal", from_engine | of_tile | inputs), *(p.name for p in signals)),
            signals_out=_of("signal", outputs),
            events_in=(*_of("event", inputs), *_of("event", from_engine)),
            events_out=_of("event", outputs),
            controls={parameter.name: parameter.kind != "number" for parameter in controls},
        )
        return NodeType(
            type=type,
            label=label or type.replace("-", " ").capitalize(),
            family=family,
            doc=inspect.cleandoc(cls.__doc__ or ""),
            inputs=tuple(Port(name, p.kind, p.unit, p.doc) for name, p in inputs.items()),
            outputs=tuple(Port(name, p.kind, p.unit, p.doc) for name, p in outputs.items()),
            engine_signals=_of("signal", from_engine),
            tile_constants=tuple(of_tile),
            parameters=parameters,
            signal_parameters=signals,
            controls=controls,
            binding=Binding(cls, names, tables),
            is_struck=any(port.kind == "event" for port in from_engine.values()),
            **{name: body[name] for name in _TOLD if name in body},
        )

    return declare


def _taken_out(inputs: dict[str, Input], node: str, mark: str, known: tuple[str, ...]) -> dict[str, Input]:
    """Take the inputs with this mark out of `inputs`; `BadValue` for a signal that is not `known` by its name."""
    found = {name: inputs.pop(name) for name, port in list(inputs.items()) if getattr(port, mark)}
    for name, port in found.items():
        is_known = name in known or (port.kind == "event" and port.from_engine)
        require(is_known, f"input of node {node} with {mark}=True", name, ", ".join(known))
    return found


def _of(kind: str, ports: Mapping[str, Input | Output]) -> tuple[str, ...]:
    return tuple(name for name, port in ports.items() if port.kind == kind)
