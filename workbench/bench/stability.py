"""Stress tests of nodes and patches: all declared parameter values, at every rate, with extreme inputs.

A patch is stressed on one tile for each of `ROWS`, all in one program: each tile has another kind of input, and each
is struck. Requirements: every signal is finite; no fault except that of the NaN input, at the node that read it; the
output of `Safety` is within its limits; no node breaks its invariant (`invariants`).
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import invariants
from underfoot.bench.stress_patches import minimal_patch, random_patch, random_points
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play, Strike
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.safety import Limits, Safety
from underfoot.floor.layout import default_floor
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program
from underfoot.patch.wiring import sources

RATES = (8_000, 44_100, 48_000, 96_000, 192_000)
ROWS = ("zero", "full", "steps", "impulses", "constant", "tiny", "huge", "nan")
"""One tile per kind of input: nothing, full scale, steps, single frames, DC, 1e-310, 1e6, and NaN."""
FULL_N, FULL_M = 750.0, 0.15
"""Full scale of a force, and of a position on a tile."""
FRAMES = 768
_BLOCKS = (1, 31, 224, 512)
_STRIKES = (40.4, 411.0)
_STRENGTHS = (1.0, 1.0, 10.0, 0.5, 1.0, 1e-310, 1e6, 1.0)
_LARGEST_SIGNAL = 1e100
"""A patch whose signals exceed this overflows by its own arithmetic, such as a product of products, which is no
fault.
"""


@dataclass(frozen=True)
class Failure:
    """A failure, with the patch and rate that reproduce it: `stress(patch, registry, rate)`."""

    what: str
    patch: Patch
    rate: int

    def line(self) -> str:
        """Return a line for a person, and one with the patch."""
        return f"{self.what}, at {self.rate} Hz, with\n{self.patch.dumps().decode()}"


@dataclass
class Stability:
    """Number of trials, and the failures."""

    nodes: int = 0
    points: int = 0
    patches: int = 0
    simulated_s: float = 0.0
    cut_short: dict[str, int] = field(default_factory=dict)
    """Nodes whose time was up, and the number of points tried."""
    failures: list[Failure] = field(default_factory=list)

    def data(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "nodes": self.nodes,
            "points": self.points,
            "patches": self.patches,
            "simulated_s": round(self.simulated_s, 3),
            "cut_short": self.cut_short,
            "failures": [{"what": f.what, "rate_hz": f.rate, "patch": f.patch.dumps().decode()} for f in self.failures],
        }


@dataclass(frozen=True)
class Extent:
    """How much `run` tries: corners and random points per node, random patches, and seconds of running patches.

    All corners are tried if there are no more. A node may take `budget_s`.
    """

    corners: int = 1024
    points: int = 10_000
    patches: int = 2_000
    seconds: float = 3600.0
    budget_s: float = 600.0


def run(
    registry: Registry,
    sound: Path,
    extent: Extent | None = None,
    seed: int = 1,
    progress: Callable[[str], None] = lambda line: None,
) -> Stability:
    """Stress every node at its corners and at random points, at each of `RATES`, and random patches; then run patches.

    `sound` is a sound file for nodes that play one. At most one failure per node is kept, with a minimal patch.
    """
    extent = extent or Extent()
    result = Stability()
    rng = np.random.default_rng(seed)
    for type in sorted(registry):
        progress(f"stability: {type}")
        result.nodes += 1
        until = time.perf_counter() + extent.budget_s
        tries = random_points(type, registry, str(sound), extent.corners, extent.points, rng)
        for tried, patch in enumerate(tries):
            if tried and time.perf_counter() > until:
                result.cut_short[type] = tried
                break
            result.points += 1
            if _fails(result, patch, registry, RATES):
                break
    progress("stability: patches")
    for _ in range(extent.patches):
        result.patches += 1
        _fails(result, random_patch(registry, str(sound), rng), registry, (int(rng.choice(RATES)),))
    longest = max(1.0, extent.seconds / 60.0)
    while result.simulated_s < extent.seconds:
        length = min(longest, extent.seconds - result.simulated_s)
        patch, rate = random_patch(registry, str(sound), rng), int(rng.choice(RATES))
        what = run_long(patch, registry, rate, length, int(rng.integers(0, 24 * 3600)) * rate)
        if what:
            result.failures.append(Failure(what, patch, rate))
        result.patches += 1
        result.simulated_s += length
        progress(f"stability: {result.simulated_s:.0f} s simulated")
    return result


def stress(patch: Patch, registry: Registry, rate: int) -> str:
    """Run `patch` with every kind of input at `rate`; return what fails, or "".

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tile-force", REGISTRY).add("low-pass", REGISTRY)
    >>> stress(patch.connect("tile-force.force", "low-pass.signal", REGISTRY), REGISTRY, 48_000)
    ''
    """
    signals, events = _outputs(patch, registry)
    program = Program(patch, registry, ROWS, rate=rate, block=max(_BLOCKS), scopes=signals + events)
    rows = len(ROWS)
    safety = Safety([Limits()] * rows, list(range(rows)), float(rate), max(_BLOCKS), rows + 1, sound_channel=rows)
    safety.open(0)
    for tile, strength in zip(ROWS, _STRENGTHS, strict=True):
        for strike in _STRIKES:
            program.strike("", tile, strike, strength)
    seen = np.zeros((len(program.scope_names), len(ROWS), FRAMES))
    readers = {node.id for node in patch.nodes if registry[node.type].engine_signals}
    faults = []
    for at, n in _blocks():
        _write_inputs(program, slice(None), at, n)
        program.run(at, n)
        seen[:, :, at : at + n] = program.tables.scope[:, :, :n]
        if not (np.isfinite(program.output[:, :n]).all() and np.isfinite(program.sound[:, :n]).all()):
            return "the output is not finite"
        safety.apply(program.played, program.zero_rows, at, 0, n)
        if not (np.abs(safety.out[:n]) <= Limits().peak).all():
            return f"{np.abs(safety.out[:n]).max()} of full scale reaches a shaker"
        faults += program.faults()
    if not np.isfinite(seen).all():
        return "a signal is not finite"
    if np.abs(seen).max(initial=0.0) > _LARGEST_SIGNAL:
        return ""
    for node, tile, frame in faults:
        if tile != "nan" or node not in readers:
            return f"{node} makes a value that is not finite at frame {frame}, input {tile!r}"
    if readers & set(program.node_ids) and not faults:
        return "an input that is not a number names no node"
    scopes = dict(zip(program.scope_names, seen, strict=True))
    for row, tile in enumerate(ROWS):
        found = _broken_invariant(patch, registry, rate, {name: signal[row] for name, signal in scopes.items()}, {})
        if found:
            return f"{found}, input {tile!r}"
    return _broken_event_invariant(patch, registry, rate, signals, events)


def run_long(patch: Patch, registry: Registry, rate: int, seconds: float, frame: int) -> str:
    """Run a walker over `patch` for `seconds` from session frame `frame` on; return what fails, or ""."""
    source = SimulatedFloor(default_floor(1, 2), rate, patch.seed)
    source.skip(frame)
    loop = Loop(patch, registry, source, LoopOptions(rate_hz=rate, block=1024, frame=frame))
    loop.send(Play(True))
    for k in range(round(seconds * rate) // 1024):
        if k % 64 == 0:
            loop.send(Strike("", source.floor.ids[k // 64 % 2], 1.0))
        loop.run(1024)
        if not (np.abs(loop.out) <= Limits().peak).all():  # false for NaN
            return f"{np.abs(loop.out).max()} of full scale reaches a shaker at frame {loop.frame}"
        faults = loop.program.faults()
        if faults and np.abs(loop.program.tables.buffers).max(initial=0.0) < _LARGEST_SIGNAL:
            node, tile, frame = faults[0]
            return f"{node} makes a value that is not finite at frame {frame}, tile {tile}"
    return ""


def _broken_event_invariant(patch: Patch, registry: Registry, rate: int, scopes: list[str], events: list[str]) -> str:
    """Check the invariants that need events, on a single tile: the program keeps the events of its last one."""
    row = ROWS.index("constant")
    program = Program(patch, registry, ROWS[row : row + 1], rate=rate, block=max(_BLOCKS), scopes=scopes + events)
    program.strike("", ROWS[row], _STRIKES[0], _STRENGTHS[row])
    signals = {name: np.zeros(FRAMES) for name in program.scope_names}
    lists: dict[str, list[NDArray[np.float64]]] = {name: [] for name in events}
    for at, n in _blocks():
        _write_inputs(program, slice(row, row + 1), at, n)
        program.run(at, n)
        for name, signal in signals.items():
            signal[at : at + n] = program.scope[name][0, :n]
        for name, found in lists.items():
            found.append(program.events(name))
    event_arrays = {name: np.concatenate(found) for name, found in lists.items()}
    for name, list_ in event_arrays.items():
        if not np.isfinite(list_).all():
            return f"{name} gives an event that is not finite"
        if (np.diff(np.floor(list_[:, 0])) <= 0.0).any():
            return f"{name} gives two events in one frame, or not in order"
    return _broken_invariant(patch, registry, rate, signals, event_arrays)


def _broken_invariant(
    patch: Patch,
    registry: Registry,
    rate: int,
    signals: dict[str, NDArray[np.float64]],
    events: dict[str, NDArray[np.float64]],
) -> str:
    """Return the first invariant that a node broke on one tile, from all its outputs there."""
    wired = sources(patch.wires)
    for node in patch.nodes:
        type = registry[node.type]
        values = type.values(node.parameters)

        steady = {name: value for name, value in values.items() if f"{node.id}.{name}" not in wired}
        ins = {name: wired.get(f"{node.id}.{name}", "") for name in type.input_ports}
        outs = {name: f"{node.id}.{name}" for name in type.output_ports}
        ports = (_named(ins, signals), _named(outs, signals), _named(ins, events), _named(outs, events))
        seen = invariants.NodeSignals(rate, steady, *ports)
        what = invariants.broken_invariant(node.type, seen)
        if what:
            return f"{node.id} {what}"
    return ""


def _named(ends: dict[str, str], found: dict[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Return the data at the ends of wires, by the names of the ports there."""
    return {name: found[end] for name, end in ends.items() if end in found}


def _fails(result: Stability, patch: Patch, registry: Registry, rates: tuple[int, ...]) -> bool:
    """Whether a patch fails at one of the rates; if so, store the failure with the smallest patch that shows it."""
    for rate in rates:
        if stress(patch, registry, rate):
            patch = minimal_patch(patch, lambda less: bool(stress(less, registry, rate)))  # noqa: B023
            result.failures.append(Failure(stress(patch, registry, rate), patch, rate))
            return True
    return False


def _outputs(patch: Patch, registry: Registry) -> tuple[list[str], list[str]]:
    """Return every output of a patch: signals, and events."""
    found: dict[str, list[str]] = {"signal": [], "event": []}
    for node in patch.nodes:
        for name, port in registry[node.type].output_ports.items():
            found[port.kind].append(f"{node.id}.{name}")
    return found["signal"], found["event"]


def _blocks() -> Iterator[tuple[int, int]]:
    at = 0
    for k in count():
        if at >= FRAMES:
            return
        n = min(_BLOCKS[k % len(_BLOCKS)], FRAMES - at)
        yield at, n
        at += n


def _inputs(full: float) -> NDArray[np.float64]:
    """Return every kind of input, [row, frame]; `full` is full scale."""
    frame = np.arange(FRAMES)
    begun = frame >= 10
    signals = np.zeros((len(ROWS), FRAMES))
    signals[1] = full * np.cos(frame * 0.7)
    signals[2] = full * (frame // 160 % 2)
    signals[3] = full * (frame % 97 == 5)
    signals[4] = full * begun
    signals[5] = 1e-310 * begun
    signals[6] = 1e6 * begun * np.where(frame < 500, 1.0, (-1.0) ** frame)
    signals[7] = np.where(frame < 300, full * np.sin(frame * 0.05), np.nan)
    return signals


_INPUTS = {"force_n": _inputs(FULL_N), "x_m": _inputs(FULL_M), "y_m": _inputs(-FULL_M), "cut": _inputs(0.0)}


def _write_inputs(program: Program, rows: slice, at: int, n: int) -> None:
    for name, signal in program.engine_signals.items():
        signal[:, :n] = _INPUTS[name][rows, at : at + n]
