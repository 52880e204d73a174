"""Program: a patch compiled to run, ordered, with preallocated buffers, asleep wherever possible."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from underfoot.arguments import choice
from underfoot.array_tables import addresses
from underfoot.clock import RAMP, RATE_HZ
from underfoot.errors import BadValue
from underfoot.layouts import Memory
from underfoot.models.signals.events import EVENTS, append
from underfoot.parameters import FilePath, Number, Tiles
from underfoot.patch import driver
from underfoot.patch.building import Builder, Part
from underfoot.patch.controls import on_ramp
from underfoot.patch.effective import effective_patch
from underfoot.patch.guards import guarded
from underfoot.patch.node import ENGINE_SIGNALS, Registry
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.tables import ALL
from underfoot.patch.wiring import downstream, node_id, upstream

_COUNT = list(EVENTS.parts).index("count")
"""Index of the count in an event list."""


class Program:
    """Compiled `patch` for each of `tiles`, ready to run in blocks of up to `block` frames. `tiles` has their ids, or
    the centre of each on the floor, in metres, by its id; without centres they are all at 0, 0.

    Marks are applied first (`underfoot.patch.effective`). Only nodes that reach a sink, or an output named in `scopes`
    ("node.port"), are built; the others are in `left_out`. `output` is float64 [tiles, block] in m/s^2. `sound` is
    float64 [1, block], the sum of all tiles' sound in full scale, if the program `has_sound`. Without `with_sound` the
    patch's Sound is left out, too, and the program `lacks_sound`. Each run takes the engine's `signals`; without them,
    who runs the program fills `engine_signals[name]`. `scope[name]` holds the frames of a scope. Building allocates,
    compiles and reads files; running does none of these.
    """

    def __init__(
        self,
        patch: Patch,
        registry: Registry,
        tiles: Sequence[str] | Mapping[str, tuple[float, float]],
        *,
        rate: float = RATE_HZ,
        block: int = 1024,
        scopes: Sequence[str] = (),
        folder: Path | None = None,
        with_sound: bool = True,
    ) -> None:
        patch.check(registry)
        self.patch, self.tiles, self.rate, self.block = patch, tuple(tiles), rate, block
        patch = effective_patch(patch, registry)
        kinds = {f"{node.id}.{n}": p.kind for node in patch.nodes for n, p in registry[node.type].output_ports.items()}
        self.scope_names = tuple(scope for scope in scopes if kinds.get(scope) == "signal")
        sounds = [node.id for node in patch.nodes if registry[node.type].to_sound]
        self.has_sound, self.lacks_sound = bool(sounds) and with_sound, bool(sounds) and not with_sound
        needed = _nodes_to_outputs(patch if with_sound else patch.remove(sounds), registry, scopes)
        self.node_ids, guards = guarded(patch, registry, needed, scopes)
        self.left_out = tuple(node.id for node in patch.nodes if node.id not in needed)
        self.index = {id: k for k, id in enumerate(self.node_ids)}
        """Index of each node in the tables, by its id."""
        self._parts = [_part(patch.node(id), registry, guards.get(id, ()), folder) for id in self.node_ids]
        self._pending: list[tuple[int, int, float, float, float]] = []
        self._struck_rows: list[int] = []
        self._faulty: dict[int, int] = {}  # the session frame that was told last
        self._settled = 0  # session frame at which the last ramp is over
        builder = Builder(patch, self._parts, tiles, self.scope_names, rate=rate, block=block)
        self.tables = builder.build()
        self._ramps = builder.ramp_of
        self._struck, self._lists = builder.struck, builder.lists.of
        self.engine_signals = builder.engine_signals_in(self.tables)
        self._where = addresses(self.tables)
        nodes = self.tables.nodes
        self._nonzero_inputs = set(np.flatnonzero((nodes["sleep_rule"] == ALL) & (nodes["tail"] != 0)).tolist())
        """Nodes that a changed number wakes, because it may produce output without input."""
        for k in np.flatnonzero(nodes["sleep_rule"] == ALL).tolist():
            if driver.tail(self._where, k) > driver.INAUDIBLE:
                self.tables.asleep[k] = 0
        self.signals = np.zeros((len(ENGINE_SIGNALS), 0, 0)), np.zeros(0, np.uint8)
        """The engine's signals, float64 [signal, row, frame], and the rows (uint8) in which all are zero; or none."""
        self._run_block = driver.run_block.specialised(self._where, *self.signals, 0, 0)
        # An event without a receiver loads the kernel, so that the first strike need not.
        append(EVENTS.zeros(room=1), 0.0, 0.0, 0.0)
        self.output, self.sound = self.tables.output, self.tables.sound
        self.played, self.zero_rows = self.tables.played, self.tables.zero_rows
        """Rows of `output`, then `sound`, and which of them are zero throughout."""
        self.scope = {name: self.tables.scope[i] for i, name in enumerate(self.scope_names)}
        self.reads_centroid = "x_m" in self.engine_signals or "y_m" in self.engine_signals
        self.begins_anew = False
        """Whether only nodes that follow the floor take over state from the previous program."""
        readers = [node.id for node in patch.nodes if registry[node.type].engine_signals]
        self._follow_floor = downstream(patch.wires, readers)

    # --- running ---

    def run(self, frame: int, n: int) -> None:
        """Run `n` frames, at most `block`, from session frame `frame` on."""
        if self._pending:
            self._put_strikes(frame + n)
        self._run_block(self._where, *self.signals, frame, n)
        if self._struck_rows:
            for row in self._struck_rows:
                self.tables.events[row, _COUNT] = 0.0
            self._struck_rows.clear()

    def set(self, id: str, name: str, value: float, frame: int) -> None:
        """Ramp a number of a node to `value`, beginning at `frame`, a span edge that was not run yet."""
        if id not in self.index:
            return
        k = self.index[id]
        part = self._parts[k]
        parameter = part.type.parameters.get(name)
        if not isinstance(parameter, Number):
            raise BadValue(f"{id} has no number {name!r}; allowed: numbers of a {part.type.type}")
        value = parameter.check(value)
        part.values[name] = value
        self._settled = frame + RAMP
        p = self.tables
        q = self._ramps.get((k, name))
        if q is None:
            return
        p.ramp[q, 0] = on_ramp(p.ramp[q, 0], p.ramp[q, 1], frame - p.ramp_start[q])
        p.ramp[q, 1], p.ramp_start[q] = value, frame
        if q >= len(p.drivers):
            p.signal_moving[q - len(p.drivers)] = 1
            return
        p.moving[k] = 1
        if k in self._nonzero_inputs:
            p.asleep[k], p.idle[:] = 0, 0

    def strike(self, id: str, tile: str, time: float, strength: float, duration: float = 0.0) -> None:
        """Send an event at `time` (session frames, not run yet) to a node that can be struck; "" means all of them."""
        choice("tile", tile, self.tiles)
        for k in self._struck:
            if id in ("", self.node_ids[k]):
                self._pending.append((k, self.tiles.index(tile), float(time), float(strength), float(duration)))
        self._pending.sort(key=lambda event: event[2])

    def take_over(self, old: "Program", frame: int) -> bool:
        """Take over the states of unchanged nodes (same id, type and sizes); their controls continue from their values.

        Strikes whose time has not come go on to their nodes, unless the program begins anew. Returns whether all nodes
        are unchanged.
        """
        p, q = self.tables, old.tables
        if old.tiles != self.tiles:
            return False
        all_stayed = True
        if not self.begins_anew:
            for struck, row, time, strength, duration in old._pending:
                here = self.index.get(old.node_ids[struck], -1)
                if here in self._struck:
                    self._pending.append((here, row, time, strength, duration))
        for id, k in self.index.items():
            if self.begins_anew and id not in self._follow_floor:
                continue
            j = old.index.get(id)
            if j is None or old._parts[j].type is not self._parts[k].type or not self._same_memory(k, old, j):
                all_stayed = False
                continue
            for memory in ("state", "coefficients"):
                count = p.nodes[k][f"{memory}_size"] * len(self.tiles)
                here, there = p.nodes[k][f"{memory}_at"], q.nodes[j][f"{memory}_at"]
                getattr(p, memory)[here : here + count] = getattr(q, memory)[there : there + count]
            p.asleep[k] = np.where(np.equal(p.masked[k], q.masked[j]), q.asleep[j], 0)
            outs = p.nodes[k]["outputs"]
            here, there = p.nodes[k]["outputs_at"], q.nodes[j]["outputs_at"]
            p.was_nonzero[here : here + outs] = q.was_nonzero[there : there + outs]
            for name in self._parts[k].type.parameters:
                self._take_control(old, k, j, name, frame)
        return all_stayed

    # --- reading ---

    def report(self) -> dict[str, list[str]]:
        """Return the ids of nodes that ran, that slept throughout, and that were left out."""
        ran = self.tables.ran.sum(axis=1)
        return {
            "run": [id for id, k in self.index.items() if ran[k]],
            "asleep": [id for id, k in self.index.items() if not ran[k]],
            "left_out": list(self.left_out),
        }

    def shares(self) -> dict[str, float]:
        """Return each node's share of the cycles spent since the last call, in the blocks that were timed."""
        spent = self.tables.cycles.tolist()
        self.tables.cycles[:] = 0
        total = max(sum(spent), 1)
        return {id: spent[k] / total for id, k in self.index.items()}

    def awake(self) -> dict[str, int]:
        """Return the number of tiles for which each node is awake."""
        rows = (self.tables.asleep == 0) & (self.tables.masked == 0)
        return {id: int(rows[k].sum()) for id, k in self.index.items()}

    def faults(self) -> list[tuple[str, str, int]]:
        """Return node, tile and session frame of the first value that was not finite: once for each node, and once
        more if it is so after a number was set.
        """
        found = []
        for k in np.flatnonzero(self.tables.fault[:, 0] >= 0).tolist():
            row, frame = self.tables.fault[k].tolist()
            self.tables.fault[k, 0] = -1
            if k not in self._faulty or self._faulty[k] < self._settled <= frame:
                self._faulty[k] = frame
                found.append((self.node_ids[k], self.tiles[row], frame))
        return found

    def events(self, scope: str) -> np.ndarray:
        """Return the last block's events on an output, of the last tile: (session frame, strength, duration) each."""
        found = self._events(self._lists[scope])
        return np.column_stack([found.time, found.strength, found.duration])[: len(found)]

    def _put_strikes(self, end: float) -> None:
        """Put the strikes before `end` into the tables."""
        while self._pending and self._pending[0][2] < end:
            k, row, time, strength, duration = self._pending.pop(0)
            events = self._events(self._struck[k] + row)
            if len(events) < events.room:
                append(events, time, strength, duration)
                self.tables.idle[row] = 0
                self._struck_rows.append(self._struck[k] + row)

    def _events(self, index: int) -> Memory:
        """Return one of the event lists of the present block."""
        return Memory(EVENTS, self.tables.events[index], {"room": self.block})

    def _same_memory(self, k: int, old: "Program", j: int) -> bool:
        here, there = self.tables.nodes[k], old.tables.nodes[j]
        same = all(here[size] == there[size] for size in ("state_size", "coefficients_size"))
        new, former = self._parts[k], old._parts[j]
        structural = [n for n, p in new.type.parameters.items() if not (p.is_ramped or isinstance(p, Tiles))]
        return same and all(new.values[n] == former.values[n] for n in structural)

    def _take_control(self, old: "Program", k: int, j: int, name: str, frame: int) -> None:
        q, there, before = self._ramps.get((k, name)), old._ramps.get((j, name)), old.tables
        if q is None or there is None or not isinstance(self._parts[k].type.parameters[name], Number):
            return
        now = on_ramp(before.ramp[there, 0], before.ramp[there, 1], frame - before.ramp_start[there])
        target = self._parts[k].values[name]
        if now != target:
            self.tables.ramp[q, :2] = now
            self.set(id=self.node_ids[k], name=name, value=target, frame=frame)


def _nodes_to_outputs(patch: Patch, registry: Registry, scopes: Sequence[str]) -> set[str]:
    """Return the nodes from which a path leads to a sink or a scope."""
    types = patch.node_types(registry)
    known = [f"{id}.{port}" for id, type in types.items() for port in type.output_ports]
    for scope in scopes:
        if scope not in known:
            raise BadValue(f"scope is {scope!r}; allowed: {', '.join(known) or 'none'}")
    ends = {id for id, type in types.items() if type.is_sink} | {node_id(scope) for scope in scopes}
    return upstream(patch.wires, ends)


def _part(node: PlacedNode, registry: Registry, guards: Sequence[str], folder: Path | None) -> Part:
    """Return a node to build, with absolute file paths."""
    type = registry[node.type]
    values = type.values(node.parameters)
    for name, parameter in type.parameters.items():
        if isinstance(parameter, FilePath) and values[name] and folder is not None:
            values[name] = str(folder / values[name])
    return Part(node.id, type, values, guards)
