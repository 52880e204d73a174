"""Builds a program's tables from a patch: buffers, event lists, controls and memories, node after node."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from underfoot.clock import LONG_AGO, RAMP
from underfoot.memory import LINE, aligned_zeros, whole_lines
from underfoot.models.signals.events import EVENTS
from underfoot.models.signals.random import stream_key
from underfoot.parameters import Choice, Number, Parameter, Tiles
from underfoot.patch import driver, tables
from underfoot.patch.node import ENGINE_SIGNALS, TILE_CONSTANTS, NodeType
from underfoot.patch.patch import Patch
from underfoot.patch.tables import NODE, Tables
from underfoot.patch.wiring import node_id, sources


class Part(Struct, frozen=True):
    """Node to build: its type, its values, and the outputs ("node.port") that guard it."""

    id: str
    type: NodeType
    values: dict[str, Any]
    guards: Sequence[str] = ()


class _Buffers(Struct):
    """Signal buffers, or event lists, of a block. With 0 `rows`, one is shared by all tiles."""

    rows: list[int] = field(default_factory=lambda: [0])  # the first is zero, or empty, for inputs without a wire
    of: dict[str, int] = field(default_factory=dict)

    def add(self, name: str = "", rows: int = 0) -> int:
        if name:
            self.of[name] = len(self.rows)
        self.rows.append(rows)
        return len(self.rows) - 1


class Builder:
    """Builds the tables of `parts`, in running order, for `tiles`: their ids, or the centre of each by its id.

    `controls` and `signals` have the places in them of numbers, by node and name; `struck` the first list of events of
    each node that can be struck, and `lists.of` those of outputs, "node.port".
    """

    def __init__(
        self,
        patch: Patch,
        parts: Sequence[Part],
        tiles: Sequence[str] | Mapping[str, tuple[float, float]],
        scopes: Sequence[str],
        *,
        rate: float,
        block: int,
    ) -> None:
        self.parts, self.tiles, self.scopes = parts, tuple(tiles), scopes
        self.centres_m = [tiles[tile] if isinstance(tiles, Mapping) else (0.0, 0.0) for tile in self.tiles]
        self.rate, self.block, self.seed = rate, block, patch.seed
        self.sources = sources(patch.wires)
        self.nodes = np.zeros(len(parts), NODE)
        self.buffers, self.lists = _Buffers(), _Buffers()
        self.inputs: list[int] = []
        self.watched: list[int] = []
        self.event_inputs: list[int] = []
        self.struck: dict[int, int] = {}
        self.controls: dict[tuple[int, str], int] = {}
        self.drivers: list[int] = []
        self.ramps: list[tuple[float, float, float, float]] = []
        self.control: list[float] = []
        self.signals: dict[tuple[int, str], int] = {}
        self.signal_buffers: list[int] = []
        self.signal_values: list[float] = []
        self.data: list[NDArray[np.float64]] = []
        self.awake_at_first = np.zeros(len(parts), bool)

    @property
    def ramp_of(self) -> dict[tuple[int, str], int]:
        """The ramp of each number, by node and name."""
        return self.controls | {key: len(self.drivers) + j for key, j in self.signals.items()}

    def build(self) -> Tables:
        """Build everything, step by step."""
        self._add_engine_signals()
        for k, part in enumerate(self.parts):
            self._add_outputs(k, part)
        for k, part in enumerate(self.parts):
            events = self._connect_events(k, part)
            inputs = self._connect_signals(k, part)
            self._watch(k, part, inputs, events)
            self._add_controls(k, part)
            self._add_memory(k, part)
        return self._tables()

    # --- node by node ---

    def _add_engine_signals(self) -> None:
        for name in (*ENGINE_SIGNALS, *TILE_CONSTANTS):
            if any(name in (*part.type.engine_signals, *part.type.tile_constants) for part in self.parts):
                self.buffers.add(name, len(self.tiles))

    def _add_outputs(self, k: int, part: Part) -> None:
        node = self.nodes[k]
        node["outputs_at"], node["event_outputs_at"] = len(self.buffers.rows), len(self.lists.rows)
        for port in part.type.outputs:
            place = self.buffers if port.kind == "signal" else self.lists
            place.add(f"{part.id}.{port.name}")
            node["outputs" if port.kind == "signal" else "event_outputs"] += 1

    def _connect_events(self, k: int, part: Part) -> int:
        """Connect the node's event inputs; return how many of them may carry events."""
        begin, wired = len(self.event_inputs), 0
        for port in part.type.inputs:
            if port.kind == "event":
                source = self.sources.get(f"{part.id}.{port.name}")
                self.event_inputs.append(self.lists.of[source] if source else 0)
                wired += source is not None
        if part.type.is_struck:
            self.struck[k] = self.lists.add(rows=1)
            for _ in self.tiles[1:]:
                self.lists.add(rows=1)
            self.event_inputs.append(self.struck[k])
            wired += 1
        self.nodes[k]["event_inputs"], self.nodes[k]["event_inputs_at"] = len(self.event_inputs) - begin, begin
        return wired

    def _connect_signals(self, k: int, part: Part) -> dict[str, int]:
        """Return the buffer of each signal that the node reads: the engine's, constants, inputs, per-frame numbers."""
        found = {name: self.buffers.of[name] for name in (*part.type.engine_signals, *part.type.tile_constants)}
        for port in part.type.inputs:
            if port.kind == "signal":
                found[port.name] = self._buffer_into(part, port.name) or 0
        for parameter in part.type.signal_parameters:
            wired = self._buffer_into(part, parameter.name)
            if wired is None:
                self.signals[k, parameter.name] = len(self.signal_buffers)
                wired = self.buffers.add()
                self.signal_buffers.append(wired)
                self.signal_values.append(part.values[parameter.name])
            found[parameter.name] = wired
        self.nodes[k]["inputs"], self.nodes[k]["inputs_at"] = len(found), len(self.inputs)
        self.inputs.extend(found.values())
        return found

    def _buffer_into(self, part: Part, name: str) -> int | None:
        source = self.sources.get(f"{part.id}.{name}")
        return self.buffers.of[source] if source else None

    def _watch(self, k: int, part: Part, inputs: dict[str, int], events: int) -> None:
        """Register the buffers that must be zero for the node to sleep."""
        type = part.type
        wired = {name for name in inputs if f"{part.id}.{name}" in self.sources}
        connected = {*type.engine_signals, *(port.name for port in type.inputs if port.name in wired)}
        muting = [name for name in type.muted_by if name in connected | wired]
        guards = [self.buffers.of[name] for name in part.guards]
        watch = guards or [inputs[name] for name in (muting or [name for name in inputs if name in connected])]
        node = self.nodes[k]
        node["watched"], node["watched_at"] = len(watch), len(self.watched)
        node["sleep_rule"] = tables.GUARDED if guards else tables.ANY if muting else tables.ALL
        self.watched.extend(watch)
        self.awake_at_first[k] = not watch and not events

    def _add_controls(self, k: int, part: Part) -> None:
        node, numbers = self.nodes[k], []
        node["controls"], node["controls_at"] = len(part.type.controls), len(self.drivers)
        node["control_memory"] = len(self.control)
        for control in part.type.controls:
            wired = self._buffer_into(part, control.name)
            self.controls[k, control.name] = len(self.drivers)
            self.drivers.append(-1 if wired is None else wired)
            node["is_driven"] |= wired is not None
            value = _number(control, part.values[control.name])
            low, high = (control.low, control.high) if isinstance(control, Number) else (value, value)
            numbers.append(value)
            self.ramps.append((value, value, low, high))
        self.control.extend(numbers * len(self.tiles))

    def _add_memory(self, k: int, part: Part) -> None:
        binding, node = part.type.binding, self.nodes[k]
        node["run"], node["tail"] = binding.run.address, binding.tail.address if binding.tail else 0
        node["state_size"] = whole_lines(binding.state_size(part.values, self.rate))
        node["coefficients_size"] = whole_lines(binding.coefficients_size(part.values, self.rate))
        node["data_at"] = sum(one.size for one in self.data)
        self.data.append(binding.data(part.values, self.rate))

    # --- all together ---

    def _tables(self) -> Tables:
        nodes, rows, count = self._placed_nodes(), len(self.tiles), len(self.parts)
        (starts, buffers), room = self._places(), EVENTS.size({"room": self.block})
        played, zero_rows = np.zeros((rows + 1, self.block)), np.repeat([0, 1], [rows, 1]).astype(np.uint8)
        return Tables(
            nodes=nodes,
            keys=self._keys(),
            masked=self._masks(),
            asleep=np.repeat(~self.awake_at_first[:, None], rows, axis=1).astype(np.uint8),
            ran=np.zeros((count, rows), np.int64),
            cycles=np.zeros(count, np.int64),
            blocks_per_timed=np.array([driver.blocks_per_timed(self.block)], np.int64),
            moving=np.zeros(count, np.uint8),
            inputs=np.array(self.inputs, np.int64),
            watched=np.array(self.watched, np.int64),
            event_inputs=np.array(self.event_inputs, np.int64),
            last_event=np.full((len(self.event_inputs), rows), LONG_AGO, np.int64),
            cursor=np.zeros(len(self.event_inputs), np.int64),
            buffers=buffers,
            bits=buffers.view(np.int64),
            buffer_at=starts[:-1],
            row_stride=np.array([self._stride if r else 0 for r in self.buffers.rows], np.int64),
            unread=self._unread(),
            is_zero=np.array([r == 0 for r in self.buffers.rows], np.uint8),
            nonzero=np.zeros((len(self.buffers.rows), self.block // driver.SLEEP_INTERVAL + 2), np.uint8),
            was_nonzero=np.zeros((len(self.buffers.rows), rows), np.uint8),
            read_engine_buffers=np.array(
                [self.buffers.of[h] for h in ENGINE_SIGNALS if self.buffers.of.get(h) in self.watched], np.int64
            ),
            engine_buffers=np.array([self.buffers.of.get(name, -1) for name in ENGINE_SIGNALS], np.int64),
            engine_zero=np.zeros(rows, np.uint8),
            events=_empty_lists(len(self.lists.rows), room, self.block),
            event_stride=np.array(self.lists.rows, np.int64),
            staged=_empty_lists(int(nodes["event_inputs"].max(initial=1)), room, self.block),
            control=np.array(self.control, np.float64),
            drivers=np.array(self.drivers, np.int64),
            ramp=np.array(self.ramps + [(v,) * 4 for v in self.signal_values], np.float64).reshape(-1, 4),
            ramp_start=np.full(len(self.drivers) + len(self.signal_buffers), -RAMP, np.int64),
            signal_controls=np.array(self.signal_buffers, np.int64),
            signal_moving=np.full(len(self.signal_buffers), 2, np.uint8),
            state=aligned_zeros(int(nodes["state_size"].sum()) * rows),
            coefficients=aligned_zeros(int(nodes["coefficients_size"].sum()) * rows),
            data=_aligned_copy([*self.data, np.zeros(LINE)]),
            sinks=self._sinks(to_sound=False),
            sound_sinks=self._sinks(to_sound=True),
            played=played,
            output=played[:rows],
            sound=played[rows:],
            zero_rows=zero_rows,
            silent=zero_rows[:rows],
            no_sound=zero_rows[rows:],
            idle=np.zeros(rows, np.uint8),
            scopes=np.array([self.buffers.of[name] for name in self.scopes], np.int64),
            scope=np.zeros((len(self.scopes), rows, self.block)),
            fault=np.full((len(self.parts), 2), -1, np.int64),
            pointers=np.zeros(1 + self._most_pointers(), np.int64),
            settings=np.array([float(self.rate)]),
        )

    def _placed_nodes(self) -> NDArray[np.void]:
        """Return the nodes with the places of their states and coefficients, one after the other."""
        for size, at in (("state_size", "state_at"), ("coefficients_size", "coefficients_at")):
            self.nodes[at] = (np.cumsum(self.nodes[size]) - self.nodes[size]) * len(self.tiles)
        return self.nodes

    def _sinks(self, to_sound: bool) -> NDArray[np.int64]:
        """Return the buffers that tiles play, or those of the sound output."""
        sinks = [part for part in self.parts if part.type.is_sink and part.type.to_sound == to_sound]
        return np.array([self.buffers.of[_first(part)] for part in sinks], np.int64)

    def _unread(self) -> NDArray[np.uint8]:
        """Return the outputs that go neither to a node, nor to an output of the floor, nor to a scope."""
        ids = {part.id for part in self.parts}
        read = {source for target, source in self.sources.items() if node_id(target) in ids}
        read |= {*self.scopes, *(_first(part) for part in self.parts if part.type.is_sink)}
        outputs = {f"{part.id}.{port.name}" for part in self.parts for port in part.type.outputs}
        unread = np.zeros(len(self.buffers.rows), np.uint8)
        unread[[at for name, at in self.buffers.of.items() if name in outputs - read]] = 1
        return unread

    @property
    def _stride(self) -> int:
        """Return the distance between rows of a buffer."""
        return whole_lines(self.block) + LINE

    def _places(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the position of each buffer, and the memory of all."""
        starts = np.concatenate([[0], np.cumsum([self._stride * max(r, 1) for r in self.buffers.rows])]).astype(
            np.int64
        )
        memory = aligned_zeros(int(starts[-1]))
        for axis, name in enumerate(TILE_CONSTANTS):
            if name in self.buffers.of:
                self._rows(name, starts, memory)[:] = [[centre_m[axis]] for centre_m in self.centres_m]
        return starts, memory

    def _rows(self, name: str, starts: NDArray[np.int64], memory: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a buffer that has a row for each tile: [tile, frame]."""
        at, rows = int(starts[self.buffers.of[name]]), len(self.tiles)
        return memory[at : at + rows * self._stride].reshape(rows, self._stride)[:, : self.block]

    def engine_signals_in(self, made: Tables) -> dict[str, NDArray[np.float64]]:
        """Return the arrays that the engine fills: float64 [tile, frame] by name."""
        names = [name for name in ENGINE_SIGNALS if name in self.buffers.of]
        return {name: self._rows(name, made.buffer_at, made.buffers) for name in names}

    def _keys(self) -> NDArray[np.uint64]:
        """Return the keys of the random draws of each node and tile."""
        keys = [[stream_key(self.seed, part.id, tile) for tile in self.tiles] for part in self.parts]
        return np.array(keys, np.uint64).reshape(len(self.parts), len(self.tiles))

    def _masks(self) -> NDArray[np.uint8]:
        """Return the tiles that each node does not apply to."""
        masked = np.zeros((len(self.parts), len(self.tiles)), np.uint8)
        for k, part in enumerate(self.parts):
            for parameter in part.type.parameters.values():
                if isinstance(parameter, Tiles):
                    masked[k] = [not Tiles.has(part.values[parameter.name], tile) for tile in self.tiles]
        return masked

    def _most_pointers(self) -> int:
        """Return the largest number of pointers in the call of one node."""
        kinds = ("inputs", "outputs", "event_inputs", "event_outputs")
        return max((int(sum(node[kind] for kind in kinds)) for node in self.nodes), default=0)


def _number(parameter: Parameter, value: float | str) -> float:
    """Return a control as the kernel reads it: a choice is its index among the options."""
    return float(parameter.options.index(value)) if isinstance(parameter, Choice) else float(value)


def _first(part: Part) -> str:
    return f"{part.id}.{part.type.outputs[0].name}"


def _aligned_copy(parts: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    found = aligned_zeros(sum(part.size for part in parts))
    found[:] = np.concatenate(parts)
    return found


def _empty_lists(count: int, room: int, capacity: int) -> NDArray[np.float64]:
    """Return `count` empty event lists, each in `room` values."""
    found = aligned_zeros(count * room).reshape(count, room)
    found[:, list(EVENTS.parts).index("capacity")] = capacity
    return found
