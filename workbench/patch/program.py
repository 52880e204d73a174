"""A patch made ready to run: in order, with its buffers taken once, asleep wherever it can be."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from underfoot.clock import RAMP, RATE_HZ
from underfoot.errors import BadValue, require
from underfoot.memory import aligned_zeros
from underfoot.models.signals.random import stream_key
from underfoot.parameters import Number, Parameter, Tiles
from underfoot.patch import driver, tables
from underfoot.patch.guards import guarded
from underfoot.patch.node import NodeType, Registry
from underfoot.patch.patch import Patch

HOSTS = ("force_n", "x_m", "y_m")
"""Signals that the engine brings: a tile's tared force, and where on the tile it stands (tile frame)."""

_LONG_AGO = -(1 << 60)


class Program:
    """What `patch` does for each of `tiles`, ready to run in blocks of up to `block` frames.

    Only nodes that reach a sink, or an output named in `scopes` ("node.port"), are built; the others are in `left_out`.
    `output` is float64 [tiles, block] in m/s^2, `hosts[name]` is what the engine fills before each run, `scope[name]`
    the frames of a scope. Building allocates, compiles and reads files; running does none of these.
    """

    def __init__(
        self,
        patch: Patch,
        registry: Registry,
        tiles: Sequence[str],
        *,
        rate: float = RATE_HZ,
        block: int = 1024,
        scopes: Sequence[str] = (),
        folder: Path | None = None,
        seed: int | None = None,
    ) -> None:
        patch.check(registry)
        self.patch, self.tiles, self.rate, self.block = patch, tuple(tiles), rate, block
        kinds = {f"{node.id}.{n}": p.kind for node in patch.nodes for n, p in registry[node.type].output_ports.items()}
        self.scope_names = tuple(scope for scope in scopes if kinds.get(scope) == "signal")
        alive = _alive(patch, registry, scopes)
        self.node_ids, self._guards = guarded(patch, registry, alive, scopes)
        self.left_out = tuple(node.id for node in patch.nodes if node.id not in alive)
        self._index = {id: k for k, id in enumerate(self.node_ids)}
        self._types = [registry[patch.node(id).type] for id in self.node_ids]
        self._values = [
            _placed(type.values(patch.node(id).parameters), type, folder)
            for id, type in zip(self.node_ids, self._types, strict=True)
        ]
        self._pending: list[tuple[int, int, float, float, float]] = []
        self._build(patch.seed if seed is None else seed)

    # --- running ---

    def run(self, frame: int, n: int) -> None:
        """Run `n` frames, at most `block`, the first of them session frame `frame`."""
        if self._pending:
            self._bring(frame + n)
        driver.run_block(self._where, frame, n)
        if self._brought:
            for row in self._brought:
                self.tables.events[row, 0] = 0.0
            self._brought.clear()

    def set(self, id: str, name: str, value: float, frame: int) -> None:
        """Let a number of a node go to `value` in a ramp that begins at `frame`, a span edge that was not run yet."""
        if id not in self._index:
            return
        k = self._index[id]
        parameter = self._types[k].parameters.get(name)
        if not isinstance(parameter, Number):
            raise BadValue(f"{id} has no number {name!r}; allowed: numbers of a {self._types[k].type}")
        value = parameter.check(value)
        self._values[k][name] = value
        p = self.tables
        if (k, name) in self._controls:
            q = self._controls[k, name]
            p.ramp[q, 0] = driver.on_ramp(p.ramp[q, 0], p.ramp[q, 1], frame - p.ramp_start[q])
            p.ramp[q, 1], p.ramp_start[q] = value, frame
            p.moving[k] = 1
        elif (k, name) in self._signals:
            q = self._signals[k, name]
            p.signal_ramp[q, 0] = driver.on_ramp(p.signal_ramp[q, 0], p.signal_ramp[q, 1], frame - p.signal_start[q])
            p.signal_ramp[q, 1], p.signal_start[q], p.signal_moving[q] = value, frame, 1

    def strike(self, id: str, tile: str, time: float, strength: float, duration: float = 0.0) -> None:
        """Bring an event at `time` (session frames, not run yet) to a node that can be struck; "" is every such."""
        require(tile in self.tiles, "tile", tile, ", ".join(self.tiles))
        for k in self._struck:
            if id in ("", self.node_ids[k]):
                self._pending.append((k, self.tiles.index(tile), time, strength, duration))
        self._pending.sort(key=lambda event: event[2])

    def take_over(self, old: "Program", frame: int) -> None:
        """Take the states of nodes that stayed (same id, type and sizes); their controls go on from where they are."""
        p, q = self.tables, old.tables
        if old.tiles != self.tiles:
            return
        for id, k in self._index.items():
            j = old._index.get(id)
            if j is None or old._types[j] is not self._types[k] or not self._same_memory(k, old, j):
                continue
            for memory, size, at in (
                ("state", tables.STATE, tables.STATE_AT),
                ("tuning", tables.TUNING, tables.TUNING_AT),
            ):
                count = p.nodes[k, size] * len(self.tiles)
                here, there = p.nodes[k, at], q.nodes[j, at]
                getattr(p, memory)[here : here + count] = getattr(q, memory)[there : there + count]
            p.asleep[k] = np.where(np.equal(p.masked[k], q.masked[j]), q.asleep[j], 0)
            outs = p.nodes[k, tables.OUTS]
            here, there = p.nodes[k, tables.OUT_AT], q.nodes[j, tables.OUT_AT]
            p.carry[here : here + outs] = q.carry[there : there + outs]
            for name in self._types[k].parameters:
                self._take_control(old, k, j, name, frame)

    # --- reading ---

    def report(self) -> dict[str, list[str]]:
        """Ids of the nodes that ran, that slept throughout, and that were left out."""
        ran = self.tables.ran.sum(axis=1)
        return {
            "run": [id for id, k in self._index.items() if ran[k]],
            "asleep": [id for id, k in self._index.items() if not ran[k]],
            "left_out": list(self.left_out),
        }

    def shares(self) -> dict[str, float]:
        """Each node's share of the cycles spent since this was last asked."""
        spent = self.tables.cycles.tolist()
        self.tables.cycles[:] = 0
        total = max(sum(spent), 1)
        return {id: spent[k] / total for id, k in self._index.items()}

    def awake(self) -> dict[str, int]:
        """How many tiles each node is awake for."""
        rows = (self.tables.asleep == 0) & (self.tables.masked == 0)
        return {id: int(rows[k].sum()) for id, k in self._index.items()}

    def fault(self) -> tuple[str, str, int] | None:
        """The node, tile and session frame of the first value that was not finite, once."""
        k, row, frame = (int(v) for v in self.tables.fault)
        if k < 0:
            return None
        self.tables.fault[0] = -1
        return self.node_ids[k], self.tiles[row], frame

    def events(self, scope: str) -> np.ndarray:
        """The last block's events on an output, of the last tile: (session frame, strength, duration) each."""
        found = self.tables.events[self._lists[scope]]
        return found[1 : 1 + 3 * int(found[0])].reshape(-1, 3).copy()

    def value(self, id: str, name: str) -> Any:
        """A parameter's value as it was last set."""
        return self._values[self._index[id]][name]

    # --- building ---

    def _build(self, seed: int) -> None:
        patch, rows = self.patch, len(self.tiles)
        count = len(self.node_ids)
        wire_to = {target: source for source, target in patch.wires}
        lane_rows: list[int] = [0]  # lane 0 is silence, for inputs without a wire
        event_rows: list[int] = [0]  # list 0 is empty
        self._host_lanes = {}
        for name in HOSTS:
            if any(name in type.hosts for type in self._types):
                self._host_lanes[name] = len(lane_rows)
                lane_rows.append(rows)
        nodes = np.zeros((count, tables.COLUMNS), np.int64)
        lane_of, list_of = {}, {}
        for k, (id, type) in enumerate(zip(self.node_ids, self._types, strict=True)):
            signals = [port for port in type.outputs if port.kind == "signal"]
            events = [port for port in type.outputs if port.kind == "event"]
            nodes[k, [tables.OUTS, tables.OUT_AT]] = len(signals), len(lane_rows)
            nodes[k, [tables.EVENT_OUTS, tables.EVENT_OUT_AT]] = len(events), len(event_rows)
            for port in signals:
                lane_of[f"{id}.{port.name}"] = len(lane_rows)
                lane_rows.append(0)
            for port in events:
                list_of[f"{id}.{port.name}"] = len(event_rows)
                event_rows.append(0)
        signals_in: list[int] = []
        watched: list[int] = []
        events_in: list[int] = []
        self._controls: dict[tuple[int, str], int] = {}
        self._signals: dict[tuple[int, str], int] = {}
        self._struck: dict[int, int] = {}
        signal_lanes: list[int] = []
        signal_values: list[float] = []
        drivers: list[int] = []
        ramp: list[tuple[float, float, float, float]] = []
        control: list[float] = []
        state = tuning = data = 0
        data_parts: list[np.ndarray] = []
        awake_at_first = np.zeros(count, bool)
        for k, (id, type, values) in enumerate(zip(self.node_ids, self._types, self._values, strict=True)):
            inputs = {f"{h}": self._host_lanes[h] for h in type.hosts}
            live = set(type.hosts)
            nodes[k, tables.EVENT_IN_AT] = len(events_in)
            wired_events = 0
            for port in type.inputs:
                source = wire_to.get(f"{id}.{port.name}")
                if port.kind == "event":
                    events_in.append(list_of[source] if source else 0)
                    wired_events += source is not None
                else:
                    inputs[port.name] = lane_of[source] if source else 0
                    live |= {port.name} if source else set()
            if type.is_struck:
                self._struck[k] = len(event_rows)
                events_in.append(len(event_rows))
                event_rows.extend([1] * rows)
                wired_events += 1
            nodes[k, tables.EVENT_INS] = len(events_in) - nodes[k, tables.EVENT_IN_AT]
            for parameter in type.signal_parameters:
                source = wire_to.get(f"{id}.{parameter.name}")
                if source:
                    inputs[parameter.name] = lane_of[source]
                    continue
                self._signals[k, parameter.name] = len(signal_lanes)
                inputs[parameter.name] = len(lane_rows)
                signal_lanes.append(len(lane_rows))
                signal_values.append(values[parameter.name])
                lane_rows.append(0)
            nodes[k, [tables.INS, tables.IN_AT]] = len(inputs), len(signals_in)
            signals_in.extend(inputs.values())
            muting = [n for n in type.muted_by if n in live or f"{id}.{n}" in wire_to]
            guards = [lane_of[name] for name in self._guards.get(id, ())]
            watch = guards or [inputs[n] for n in (muting or [n for n in inputs if n in live])]
            nodes[k, [tables.WATCHED, tables.WATCHED_AT]] = len(watch), len(watched)
            nodes[k, tables.MODE] = tables.GUARDED if guards else tables.ANY if muting else tables.ALL
            watched.extend(watch)
            awake_at_first[k] = not watch and not wired_events
            nodes[k, [tables.CONTROLS, tables.CONTROL_AT]] = len(type.controls), len(drivers)
            nodes[k, tables.CONTROL_MEMORY] = len(control)
            numbers = []
            for control_of in type.controls:
                source = wire_to.get(f"{id}.{control_of.name}")
                self._controls[k, control_of.name] = len(drivers)
                drivers.append(lane_of[source] if source else -1)
                nodes[k, tables.DRIVEN] |= source is not None
                value = _number(control_of, values[control_of.name])
                low, high = (control_of.low, control_of.high) if isinstance(control_of, Number) else (value, value)
                numbers.append(value)
                ramp.append((value, value, low, high))
            control.extend(numbers * rows)
            made = np.ascontiguousarray(type.prepare(values, self.rate), np.float64).ravel()
            data_parts.append(np.append(made, np.zeros(-made.size % 8)))
            nodes[k, [tables.RUN, tables.REST]] = type.run.address, type.rest.address if type.rest else 0
            nodes[k, [tables.STATE, tables.STATE_AT]] = _whole(type.state(values, self.rate)), state
            nodes[k, [tables.TUNING, tables.TUNING_AT]] = _whole(type.tuning(values, self.rate)), tuning
            nodes[k, tables.DATA_AT] = data
            state += int(nodes[k, tables.STATE]) * rows
            tuning += int(nodes[k, tables.TUNING]) * rows
            data += data_parts[-1].size
        self._lists = list_of
        stride = self.block + -self.block % 8 + 8
        steps = np.array([stride if r else 0 for r in lane_rows], np.int64)
        starts = np.concatenate([[0], np.cumsum([stride * max(r, 1) for r in lane_rows])])
        lanes = aligned_zeros(int(starts[-1]))
        sinks = [
            lane_of[f"{id}.{type.outputs[0].name}"]
            for id, type in zip(self.node_ids, self._types, strict=True)
            if type.is_sink
        ]
        self._brought: list[int] = []
        self.tables = tables.Tables(
            nodes=nodes,
            keys=np.array(
                [[stream_key(seed, id, tile) for tile in self.tiles] for id in self.node_ids], np.uint64
            ).reshape(count, rows),
            masked=self._masks(),
            asleep=np.repeat(~awake_at_first[:, None], rows, axis=1).astype(np.uint8),
            ran=np.zeros((count, rows), np.int64),
            cycles=np.zeros(count, np.int64),
            moving=np.zeros(count, np.uint8),
            signals_in=np.array(signals_in, np.int64),
            watched=np.array(watched, np.int64),
            events_in=np.array(events_in, np.int64),
            last_event=np.full((len(events_in), rows), _LONG_AGO, np.int64),
            cursor=np.zeros(len(events_in), np.int64),
            lanes=lanes,
            bits=lanes.view(np.int64),
            lane_at=starts[:-1].astype(np.int64),
            lane_step=steps,
            clean=np.array([r == 0 for r in lane_rows], np.uint8),
            loud=np.zeros((len(lane_rows), self.block // driver.NAP + 2), np.uint8),
            carry=np.zeros((len(lane_rows), rows), np.uint8),
            hosts=np.array([lane for lane in self._host_lanes.values() if lane in watched], np.int64),
            events=np.zeros((len(event_rows), 1 + 3 * self.block)),
            event_step=np.array(event_rows, np.int64),
            stage=np.zeros((max([1, *nodes[:, tables.EVENT_INS]]), 1 + 3 * self.block)),
            control=np.array(control, np.float64),
            drivers=np.array(drivers, np.int64),
            ramp=np.array(ramp, np.float64).reshape(-1, 4),
            ramp_start=np.full(len(drivers), -RAMP, np.int64),
            signal_controls=np.array(signal_lanes, np.int64),
            signal_ramp=np.array([(v, v) for v in signal_values], np.float64).reshape(-1, 2),
            signal_start=np.full(len(signal_lanes), -RAMP, np.int64),
            signal_moving=np.full(len(signal_lanes), 2, np.uint8),
            state=aligned_zeros(state),
            tuning=aligned_zeros(tuning),
            data=np.concatenate([*data_parts, np.zeros(8)]),
            sinks=np.array(sinks, np.int64),
            output=np.zeros((rows, self.block)),
            still=np.zeros(rows, np.uint8),
            idle=np.zeros(rows, np.uint8),
            scopes=np.array([lane_of[name] for name in self.scope_names], np.int64),
            scope=np.zeros((len(self.scope_names), rows, self.block)),
            fault=np.array([-1, 0, 0], np.int64),
            pointers=np.zeros(
                1
                + int((nodes[:, [tables.INS, tables.OUTS, tables.EVENT_INS, tables.EVENT_OUTS]]).sum(1).max(initial=0)),
                np.int64,
            ),
            settings=np.array([float(self.rate)]),
        )
        self._where = tables.addresses(self.tables)
        for loud in np.flatnonzero(nodes[:, tables.MODE] == tables.ALL).tolist():
            if driver.remains(self._where, loud) > driver.QUIET:
                self.tables.asleep[loud] = 0
        driver.run_block(self._where, 0, 0)  # no frames: loads the driver, so that the first block need not
        self.output = self.tables.output
        self.scope = {name: self.tables.scope[i] for i, name in enumerate(self.scope_names)}
        self.hosts = {
            name: lanes[starts[lane] : starts[lane] + rows * stride].reshape(rows, stride)[:, : self.block]
            for name, lane in self._host_lanes.items()
        }

    def _masks(self) -> np.ndarray:
        masked = np.zeros((len(self.node_ids), len(self.tiles)), np.uint8)
        for k, (type, values) in enumerate(zip(self._types, self._values, strict=True)):
            for parameter in type.parameters.values():
                if isinstance(parameter, Tiles):
                    masked[k] = [not Tiles.has(values[parameter.name], tile) for tile in self.tiles]
        return masked

    def _bring(self, end: float) -> None:
        """Put the strikes that fall before `end` where the driver finds them."""
        while self._pending and self._pending[0][2] < end:
            k, row, time, strength, duration = self._pending.pop(0)
            events = self.tables.events[self._struck[k] + row]
            count = int(events[0])
            if 3 * count + 4 > events.size:
                continue
            events[3 * count + 1 : 3 * count + 4] = time, strength, duration
            events[0] = count + 1
            self.tables.idle[row] = 0
            self._brought.append(self._struck[k] + row)

    def _same_memory(self, k: int, old: "Program", j: int) -> bool:
        sizes = [tables.STATE, tables.TUNING]
        same = (self.tables.nodes[k, sizes] == old.tables.nodes[j, sizes]).all()
        structural = [n for n, p in self._types[k].parameters.items() if p.kind not in ("number", "tiles")]
        return bool(same) and all(self._values[k][n] == old._values[j][n] for n in structural)

    def _take_control(self, old: "Program", k: int, j: int, name: str, frame: int) -> None:
        for ids, old_ids, table, start in (
            (self._controls, old._controls, "ramp", "ramp_start"),
            (self._signals, old._signals, "signal_ramp", "signal_start"),
        ):
            if (k, name) in ids and (j, name) in old_ids and isinstance(self._types[k].parameters[name], Number):
                theirs, began = (
                    getattr(old.tables, table)[old_ids[j, name]],
                    getattr(old.tables, start)[old_ids[j, name]],
                )
                now = driver.on_ramp(theirs[0], theirs[1], frame - began)
                target = self._values[k][name]
                if now != target:
                    getattr(self.tables, table)[ids[k, name], :2] = now
                    self.set(id=self.node_ids[k], name=name, value=target, frame=frame)


def _alive(patch: Patch, registry: Registry, scopes: Sequence[str]) -> set[str]:
    """Nodes from which a wire leads to a sink or to an output that somebody looks at."""
    types = {node.id: registry[node.type] for node in patch.nodes}
    known = [f"{id}.{port}" for id, type in types.items() for port in type.output_ports]
    for scope in scopes:
        if scope not in known:
            raise BadValue(f"scope is {scope!r}; allowed: {', '.join(known) or 'none'}")
    alive = {id for id, type in types.items() if type.is_sink} | {scope.partition(".")[0] for scope in scopes}
    frontier = list(alive)
    sources: dict[str, list[str]] = {}
    for source, target in patch.wires:
        sources.setdefault(target.partition(".")[0], []).append(source.partition(".")[0])
    while frontier:
        for source in sources.get(frontier.pop(), []):
            if source not in alive:
                alive.add(source)
                frontier.append(source)
    return alive


def _placed(values: dict[str, Any], type: NodeType, folder: Path | None) -> dict[str, Any]:
    """Values with file paths made absolute."""
    for name, parameter in type.parameters.items():
        if parameter.kind == "file" and values[name] and folder is not None:
            values[name] = str(folder / values[name])
    return values


def _number(parameter: Parameter, value: Any) -> float:
    """A control as the kernel reads it: a choice is its place among the options."""
    return float(parameter.options.index(value)) if parameter.kind == "choice" else float(value)  # type: ignore[attr-defined]


def _whole(size: int) -> int:
    """A size rounded up to whole cache lines, so that every row begins on one."""
    return size + -size % 8
