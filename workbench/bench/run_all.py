"""The whole bench in one run, or its times alone."""

import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from underfoot.bench import accuracy, blocks, latency, requirements, scene_latency, stability
from underfoot.bench.blocks import BlockCost
from underfoot.bench.report import Bench
from underfoot.bench.requirements import Requirement
from underfoot.bench.requirements.blocks import COARSE, floors, presets
from underfoot.bench.timing import Run, timed_in_turn
from underfoot.clock import RATE_HZ
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop
from underfoot.engine.worker_pool import cores
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

Progress = Callable[[str], None]


def run(
    quick: bool = False, seed: int = 1, progress: Progress = lambda line: None, cluster: str | None = None
) -> Bench:
    """Measure times, requirements, latency, accuracy and stability. Quick takes about five minutes.

    In full: some minutes for the first three; then at most ten for each node, every corner and point, random patches,
    and an hour of sound, which takes several hours. The requirements that are not times run on a `cluster`, if given
    (`requirements.run`).
    """
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    floor_costs, times = _times(
        blocks.TILES, blocks.BLOCKS, list(preset_files.patches()), 0.6 if quick else 6.0, progress
    )
    found = [
        *times,
        *requirements.run(quick, progress, cluster),
        *latency.requirements(quick, progress),
        *scene_latency.requirements(quick, progress),
    ]
    comparisons = accuracy.run(quick, progress)
    with tempfile.TemporaryDirectory() as folder:
        sound = Path(folder, "sound.wav")
        _write_sound(sound)
        extent = stability.Extent(corners=8, points=60, patches=60, seconds=20.0, budget_s=1.0) if quick else None
        stable = stability.run(REGISTRY, sound, extent, seed, progress)
    return Bench(found, floor_costs, comparisons, stable, load, cores())


def run_times(progress: Progress = lambda line: None) -> Bench:
    """Measure times only: about twenty seconds."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    floor_costs, times = _times((36,), (64, 1024), [], 0.3, progress)
    return Bench(times, floor_costs, load=load, cores=cores())


def _times(
    tiles: tuple[int, ...], block_sizes: tuple[int, ...], presets_named: list[str], budget_s: float, progress: Progress
) -> tuple[list[BlockCost], list[Requirement]]:
    """Measure all times by turns: coarse gravel on large floors, presets, and the timings of the model families."""
    progress("times: kernels are loaded")
    coarse = Patch.load(preset_files.patches()[COARSE], REGISTRY)
    scenes = list(blocks.scenes(COARSE, coarse, tiles, block_sizes))
    walked = {name: _walked(name) for name in presets_named}
    timings = list(requirements.timings())
    played = [Run(call) for call in (*(scene.run for scene in scenes), *walked.values())]
    runs = [*played, *(timing.run for timing in timings)]
    times_found = timed_in_turn(runs, budget_s, progress)
    costs = blocks.costs(scenes, times_found[: len(scenes)])
    of_presets = dict(zip(walked, times_found[len(scenes) :], strict=False))
    rows = [timing.requirement(one) for timing, one in zip(timings, times_found[len(played) :], strict=True)]
    return costs, [*floors(costs), *(presets(of_presets) if walked else ()), *rows]


def _walked(name: str) -> Callable[[], object]:
    """Return a function that runs the next second of a preset under the walker."""
    loop = Loop(Patch.load(preset_files.patches()[name], REGISTRY), REGISTRY, SimulatedFloor(default_floor()))
    loop.send(Play(True))
    return partial(loop.play, RATE_HZ)


def _write_sound(path: Path) -> None:
    """Write a short sound with an unusual rate, for nodes that play one."""
    import soundfile

    soundfile.write(path, np.sin(np.arange(2000) * 0.05), 22_050)
