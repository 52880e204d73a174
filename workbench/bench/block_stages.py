"""Profile of a block: the cost of each stage and each node of a patch on a floor, and which nodes sleep, and why."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path

import numpy as np

from underfoot.bench.blocks import stepping, stepping_loop
from underfoot.clock import RATE_HZ
from underfoot.devices.conversion import Conversion, nominal_readings
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.commands import equalisers_of
from underfoot.engine.loop import LoopOptions
from underfoot.engine.session_memory import SessionMemory
from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile, profiles_of
from underfoot.kernels import kernel
from underfoot.nodes import REGISTRY
from underfoot.patch.calls import cycles
from underfoot.patch.guards import guarded
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

_WARM_S, _PART_S, _PARTS = 1.0, 1.0, 8
_MS = 1e3

STAGES = {
    "source": "samples are taken from where they come",
    "rings, forces": "samples are written to where window and recorder read",
    "tracking": "lost samples are filled in, contacts followed, samples queued",
    "signals": "force and centroid of each tile are drawn at audio rate",
    "nodes": "the patch's nodes, the sum of those below",
    "driver": "what runs the nodes: who is awake, who may sleep, the sum of the outputs",
    "pulse": "the pulse that shows which tile is which",
    "equaliser": "the equalisers of the tiles' profiles",
    "safety": "DC block, limits, ramps, float32 for the card",
    "plates": "what simulated tiles do of it: shaker, plate, and who stands there",
    "rings, vibration": "what is played, and measured, is written to where window and recorder read",
    "rest": "commands, the status, the way from stage to stage",
}
"""The stages of a block, in order, with a description."""


@dataclass(frozen=True)
class StageCost:
    """Cost of a stage per second of sound, ms."""

    stage: str
    ms: float


@dataclass(frozen=True)
class NodeCost:
    """Cost of a node per second of sound, ms; its mean number of running tiles; when it sleeps, or ""."""

    node: str
    type: str
    ms: float
    tiles_awake: float
    sleeps: str


@dataclass(frozen=True)
class BlockStages:
    """Cost of a second of sound, ms: in total, by stage, and by node.

    `reading_ms` is the additional cost of the thread that reads devices, to convert readings to newtons. `left_out`
    are nodes that no output needs.
    """

    tiles: int
    stood_on: int
    block: int
    whole_ms: float
    stages: tuple[StageCost, ...]
    nodes: tuple[NodeCost, ...]
    left_out: tuple[str, ...]
    reading_ms: float


def block_stages(
    patch: Patch,
    floor: Floor,
    *,
    feet: int,
    block: int = 1024,
    profiles: str | Path | None = None,
    folder: Path | None = None,
    simulated: bool = False,
) -> BlockStages:
    """Play some seconds of `patch` as the engine does, with feet that step once a second on the first `feet` tiles.

    The tiles' `profiles`, in a folder, have equalisers and the conversion of readings to newtons; `folder` holds the
    patch's sound files; plates are simulated if the floor is `simulated`. Raises `BadValue` for an invalid number of
    feet or block, `BadFile` for a profile that cannot be read.
    """
    require(0 <= feet <= len(floor.tiles), "feet", feet, f"0 to {len(floor.tiles)}, the floor's tiles")
    require(1 <= block <= 65536, "block", block, "1 to 65536 frames")
    calibrated = profiles_of(profiles, floor)
    options = LoopOptions(block=block, equalisers=equalisers_of(calibrated), folder=folder)
    loop = stepping_loop(patch, floor, feet, options, simulated)
    memory = SessionMemory.create(len(floor.tiles), RATE_HZ, loop.source.rate_hz)
    try:
        runner = BlockRunner(loop, memory)
        parts = _parts(runner, _watched(runner))
    finally:
        memory.close()
    # Take the part whose total is the lower quartile, so that its stages add up to its total.
    whole_s, spent, of_nodes, ran = sorted(parts, key=lambda part: part[0])[len(parts) // 4]
    frames = max(round(_PART_S * RATE_HZ) // block, 1) * block
    per_second = _MS * RATE_HZ / frames
    nodes_s = float(of_nodes.sum())
    spent |= {"nodes": nodes_s, "driver": max(spent["program"] - nodes_s, 0.0)}
    spent["rest"] = whole_s - sum(spent[stage] for stage in STAGES if stage != "rest")
    sleeps = _sleeps(loop.program)
    return BlockStages(
        len(floor.tiles),
        feet,
        block,
        per_second * whole_s,
        tuple(StageCost(stage, per_second * spent[stage]) for stage in STAGES),
        tuple(
            NodeCost(id, patch.node(id).type, per_second * float(of_nodes[k]), float(ran[k]) / frames, sleeps[id])
            for id, k in loop.program.index.items()
        ),
        loop.program.left_out,
        _MS * _reading_s(floor, feet, calibrated),
    )


class _Stopwatch:
    """Accumulates the time of calls, each without the calls it made."""

    def __init__(self) -> None:
        self.spent_s = dict.fromkeys(("program", *STAGES), 0.0)
        self._inner_s = [0.0]

    def watch(self, owner: object, method: str, stage: str) -> None:
        """Count calls of an object's method as `stage`."""
        call = getattr(owner, method)

        @wraps(call)
        def watched(*given: object, **named: object) -> object:
            self._inner_s.append(0.0)
            began = time.perf_counter()
            result = call(*given, **named)
            took = time.perf_counter() - began
            self.spent_s[stage] += took - self._inner_s.pop()
            self._inner_s[-1] += took
            return result

        setattr(owner, method, watched)


def _watched(runner: BlockRunner) -> _Stopwatch:
    found, loop = _Stopwatch(), runner.loop
    for owner, method, stage in (
        (loop.source, "pull", "source"),
        (loop.intake, "on_samples", "rings, forces"),
        (loop.intake, "take", "tracking"),
        (loop.intake, "fill", "signals"),
        (loop.programs, "run", "program"),
        (loop.pulse, "apply", "pulse"),
        (loop.equalisers, "apply", "equaliser"),
        (loop.safety, "apply", "safety"),
        *((plates, "apply", "plates") for plates in loop.plates.values()),
        *(
            (getattr(runner.memory, ring), "write", "rings, vibration")
            for ring in ("vibration", "commanded", "measured")
        ),
    ):
        found.watch(owner, method, stage)
    return found


_Part = tuple[float, dict[str, float], np.ndarray, np.ndarray]


def _parts(runner: BlockRunner, watch: _Stopwatch) -> list[_Part]:
    """Return, per part: seconds in total and by stage; and per node, seconds and frames run, over all tiles."""
    tables, rate = runner.loop.program.tables, _cycles_a_second()
    tables.blocks_per_timed[:] = 1
    for _ in range(max(round(_WARM_S * RATE_HZ) // runner.loop.block, 1)):
        runner.run()
    found = []
    for _ in range(_PARTS):
        tables.cycles[:] = 0
        before, ran = dict(watch.spent_s), tables.ran.sum(axis=1)
        began = time.perf_counter()
        for _ in range(max(round(_PART_S * RATE_HZ) // runner.loop.block, 1)):
            runner.run()
        whole_s = time.perf_counter() - began
        spent = {stage: after - before[stage] for stage, after in watch.spent_s.items()}
        found.append((whole_s, spent, tables.cycles / rate, tables.ran.sum(axis=1) - ran))
    return found


def _cycles_a_second() -> float:
    """Return the frequency of the processor's counter, in which the program's tables are kept."""
    _count()
    began, first = time.perf_counter(), _count()
    time.sleep(0.02)
    return float(_count() - first) / (time.perf_counter() - began)


@kernel
def _count() -> int:
    return cycles()


def _reading_s(floor: Floor, feet: int, profiles: Mapping[str, Profile]) -> float:
    """Return the time to convert a second of readings to newtons by the profiles; the least of some runs."""
    forces = stepping(floor, feet)
    samples, tiles, _ = forces.force_n.shape
    rows = np.tile(np.arange(tiles), samples)
    time_s, readings = np.repeat(forces.time_s, tiles), nominal_readings(forces.force_n).reshape(-1, 4)
    conversion = Conversion(floor, profiles)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        conversion.newtons(rows, readings, time_s, np.zeros_like(rows))
        spent.append(time.perf_counter() - began)
    return min(spent) * forces.rate_hz / samples


def _sleeps(program: Program) -> dict[str, str]:
    """Return when each node sleeps, as words that follow 'when'; "" if never."""
    patch = program.patch
    wired = {target for _, target in patch.wires}
    _, guards = guarded(patch, REGISTRY, set(program.node_ids), program.scope_names)
    found = {}
    for id in program.node_ids:
        type = REGISTRY[patch.node(id).type]
        comes = [port.name for port in type.inputs if f"{id}.{port.name}" in wired]
        signals = [*type.engine_signals, *(name for name in comes if type.input_ports[name].kind == "signal")]
        muting = [name for name in type.muted_by if name in signals or f"{id}.{name}" in wired]
        quiet = [*(f"{name} is silent" for name in signals)]
        if type.is_struck or len(signals) < len(type.engine_signals) + len(comes):
            quiet.append("no event has come")
        if id in guards:
            found[id] = f"nobody would hear it, as {' and '.join(guards[id])} is silent"
        elif muting:
            found[id] = f"{' or '.join(muting)} is silent"
        else:
            found[id] = f"{' and '.join(quiet)}, and it has rung out" if quiet else ""
    return found
