"""Cost of a block in the engine: from the samples of four sensors per tile, at 1 kHz, to float32 for the card.

Measured for a patch on a floor with a foot on each tile, on two, and on none; the share of the patch's nodes is given,
too.
"""

import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from underfoot.bench.timing import Timed
from underfoot.clock import RATE_HZ
from underfoot.devices.replay import Replay
from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor, default_floor
from underfoot.models import gait
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

BLOCKS = (64, 1024, 4096)
TILES = (36, 144)
SIMULATED = 36
"""Tiles of the floor with simulated plates."""
PART_S = 1.0
"""Length in seconds of sound that is timed at once."""
NOISE_N = 0.2
"""RMS of each sensor's noise: an empty tile of a real floor is never exactly at rest."""
CONTACT_S = 0.8
"""Seconds of each second for which a foot is down."""
_PEAKS_N = 800.0, 500.0, 780.0
_GOLDEN = 0.6180339887498949
_SENSOR_HZ = 1000.0
_LOOP_S = 3.0


@dataclass(frozen=True)
class BlockCost:
    """Cost of blocks of this many frames on a floor of `tiles`, with a foot on `stood_on` of them."""

    patch: str
    tiles: int
    stood_on: int
    block: int
    times_real_time: float
    """Seconds of sound per second of one core: the whole block."""
    program_times_real_time: float
    """The same for the patch's nodes alone."""
    share: float
    """Relative to the cost with a foot on every tile, at the same block size."""
    slowness: float
    spread: float
    simulated: bool = False
    """Whether the floor's plates are simulated."""


class Scene:
    """A patch playing on a floor with feet that step once a second, in blocks of this many frames.

    The plates of a `simulated` floor are simulated, too.
    """

    def __init__(self, name: str, patch: Patch, floor: Floor, feet: int, block: int, simulated: bool = False) -> None:
        self.name, self.tiles, self.feet, self.block, self.simulated = name, len(floor.tiles), feet, block, simulated
        self._loop = stepping_loop(patch, floor, feet, LoopOptions(block=block), simulated)
        self._of_program: list[float] = []
        for _ in range(3):  # until baselines, gates and ramps have settled
            self.run()
        self._of_program.clear()

    def run(self) -> None:
        """Play the next `PART_S`."""
        before, began = self._loop.programs.spent_s, time.perf_counter()
        self._loop.play(round(PART_S * RATE_HZ))
        self._of_program.append((self._loop.programs.spent_s - before) / (time.perf_counter() - began))

    @property
    def of_program(self) -> float:
        """Share of the patch's nodes in the cost of a run, the median of all so far."""
        return statistics.median(self._of_program)


def scenes(name: str, patch: Patch, tiles: Iterable[int], blocks: Sequence[int]) -> Iterator[Scene]:
    """Yield a patch on square floors of these sizes, at each block size, with feet on every tile, two and none.

    A floor of `SIMULATED` tiles with feet on every tile is included with its plates, too.
    """
    for count in tiles:
        floor = default_floor(round(count**0.5), round(count**0.5))
        for block in blocks:
            for feet in (len(floor.tiles), 2, 0):
                yield Scene(name, patch, floor, feet, block)
            if count == SIMULATED:
                yield Scene(name, patch, floor, count, block, simulated=True)


def costs(scenes: Sequence[Scene], timed: Sequence[Timed]) -> list[BlockCost]:
    """Return the costs of scenes from the times of their runs."""
    found = []
    measured = list(zip(scenes, timed, strict=True))
    every = {(s.tiles, s.block): t.at_best for s, t in measured if s.feet == s.tiles and not s.simulated}
    for scene, run in measured:
        share = run.at_best / every[scene.tiles, scene.block]
        where = scene.name, scene.tiles, scene.feet, scene.block
        speed = PART_S / run.seconds
        found.append(
            BlockCost(*where, speed, speed / scene.of_program, share, run.slowness, run.spread, scene.simulated)
        )
    return found


def stepping_loop(patch: Patch, floor: Floor, feet: int, options: LoopOptions, simulated: bool) -> Loop:
    """Return a loop that plays, under feet as in `stepping`, with the plates of a `simulated` floor."""
    if simulated:
        options = replace(options, plates=("accelerometer",))
    loop = Loop(patch, REGISTRY, Replay(stepping(floor, feet), floor, RATE_HZ, repeats=True), options)
    loop.send(Play(True))
    return loop


def stepping(floor: Floor, feet: int) -> ForceSeries:
    """Return sensor forces under this many feet, each stepping on its tile once a second, at its own moment.

    They loop seamlessly. A foot that only stood would soon be silent on most grounds. The noise lasts longer than a
    baseline's window: in one that repeats, no value enters or leaves it, which costs half as much.

    >>> forces = stepping(default_floor(1, 3), 1)
    >>> (forces.force_n.mean(axis=(0, 2)) > 100.0).tolist()
    [True, False, False]
    """
    time_s = np.arange(round(_LOOP_S * _SENSOR_HZ)) / _SENSOR_HZ
    force_n = NOISE_N * np.random.default_rng(1).standard_normal((len(time_s), len(floor.tiles), 4))
    for row, tile in enumerate(floor.tiles[:feet]):
        phase = (time_s + _GOLDEN * row) % 1.0 / CONTACT_S
        along_m = 0.2 * (gait.roll(phase) - 0.5)
        force_n[:, row] += gait.corner_forces(gait.vertical_force(phase, *_PEAKS_N), along_m, 0.0, tile.sensors_m)
    return ForceSeries(time_s, force_n, _SENSOR_HZ)
