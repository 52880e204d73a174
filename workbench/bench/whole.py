"""The whole bench in one run, or its times alone."""

import os
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from underfoot.bench import accuracy, blocks, latency, reach, scene_latency, stability
from underfoot.bench.blocks import BlockCost
from underfoot.bench.reach import Reach
from underfoot.bench.reach.blocks import COARSE, floors, presets
from underfoot.bench.report import Bench
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

Tell = Callable[[str], None]


def run(quick: bool = False, seed: int = 1, tell: Tell = lambda line: None, cluster: str | None = None) -> Bench:
    """Measure times, requirements, latency, accuracy and stability. Quick takes about five minutes.

    In full: some minutes for the first three; then at most ten for each node, every corner and point, random patches,
    and an hour of sound, which takes several hours. The requirements that are not times run on a `cluster`, if given
    (`reach.run`).
    """
    load = os.getloadavg()[0]
    floor_costs, times = _times(blocks.TILES, blocks.BLOCKS, list(preset_files.patches()), 0.6 if quick else 6.0, tell)
    reaches = [
        *times,
        *reach.run(quick, tell, cluster),
        *latency.reaches(quick, tell),
        *scene_latency.reaches(quick, tell),
    ]
    comparisons = accuracy.run(quick, tell)
    with tempfile.TemporaryDirectory() as folder:
        sound = Path(folder, "sound.wav")
        _write_sound(sound)
        if quick:
            stable = stability.run(
                REGISTRY, sound, corners=8, points=60, patches=60, seconds=20.0, budget_s=1.0, seed=seed, tell=tell
            )
        else:
            stable = stability.run(REGISTRY, sound, seed=seed, tell=tell)
    return Bench(reaches, floor_costs, comparisons, stable, load, cores())


def run_times(tell: Tell = lambda line: None) -> Bench:
    """Measure times only: about twenty seconds."""
    load = os.getloadavg()[0]
    floor_costs, times = _times((36,), (64, 1024), [], 0.3, tell)
    return Bench(times, floor_costs, load=load, cores=cores())


def _times(
    tiles: tuple[int, ...], block_sizes: tuple[int, ...], presets_named: list[str], budget_s: float, tell: Tell
) -> tuple[list[BlockCost], list[Reach]]:
    """Measure all times by turns: coarse gravel on large floors, presets, and the timings of the model families."""
    tell("times: kernels are loaded")
    coarse = {COARSE: Patch.load(preset_files.patches()[COARSE], REGISTRY)}
    scenes = list(blocks.scenes(coarse, REGISTRY, tiles, block_sizes))
    walked = {name: _walked(name) for name in presets_named}
    timings = list(reach.timings())
    played = [Run(call) for call in (*(scene.run for scene in scenes), *walked.values())]
    runs = [*played, *(timing.run for timing in timings)]
    took = timed_in_turn(runs, budget_s, tell)
    costs = blocks.costs(scenes, took[: len(scenes)])
    of_presets = dict(zip(walked, took[len(scenes) :], strict=False))
    rows = [timing.reach(one) for timing, one in zip(timings, took[len(played) :], strict=True)]
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
