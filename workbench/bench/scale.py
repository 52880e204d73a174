"""What a large floor costs: a patch on many tiles, with a foot on each, with a foot on two, and with none.

Cost is time inside `Program.run`, kernels warm, one process: the median of twenty runs of half a second of sound each.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE = 48_000
TILES = 36
BLOCKS = (1024, 64)
_REPEATS = 20


@dataclass(frozen=True)
class Cost:
    """What one patch costs at one block size with feet on `stood_on` of `tiles`."""

    patch: str
    tiles: int
    stood_on: int
    block: int
    times_real_time: float
    """Seconds of sound a second of one core."""
    share: float
    """Of the cost with a foot on every tile, at the same block size."""

    def data(self) -> dict[str, Any]:
        """As plain data."""
        return asdict(self)


def run(
    patches: dict[str, Patch],
    registry: Registry,
    *,
    tiles: int = TILES,
    repeats: int = _REPEATS,
    tell: Callable[[str], None] = lambda line: None,
) -> list[Cost]:
    """The cost of each patch with every tile stood on, two and none, at each of `BLOCKS`."""
    found = []
    for name, patch in patches.items():
        tell(f"scale: {name}")
        for block in BLOCKS:
            whole = None
            for stood_on in (tiles, 2, 0):
                spent = cost(patch, registry, tiles, stood_on, block, repeats)
                whole = whole or spent
                found.append(Cost(name, tiles, stood_on, block, 1.0 / spent, spent / whole))
    return found


def cost(patch: Patch, registry: Registry, tiles: int, stood_on: int, block: int, repeats: int) -> float:
    """Seconds inside `Program.run` for a second of sound, the median of `repeats` runs of half a second.

    What the looks at the clock take themselves, a twentieth of a short block, is taken off.
    """
    program = Program(patch, registry, [f"t{k}" for k in range(tiles)], rate=RATE, block=block)
    length = RATE // 2 // 1024 * 1024
    feet = standing(tiles, stood_on, length)
    frame = 0
    spent = []
    clock = _clock_s()
    for _ in range(repeats + 1):
        inside = 0.0
        for at in range(0, length, block):
            for name, signal in program.hosts.items():
                signal[:] = feet[name][:, at : at + block]
            began = time.perf_counter()
            program.run(frame, block)
            inside += time.perf_counter() - began - clock
            frame += block
        spent.append(inside * RATE / length)
    return statistics.median(spent[1:])  # the first run loads the kernels and wakes the tiles


def _clock_s() -> float:
    """How long two looks at the clock are apart."""
    looks = [time.perf_counter() for _ in range(1001)]
    return statistics.median(after - before for before, after in pairwise(looks))


def standing(tiles: int, stood_on: int, frames: int) -> dict[str, np.ndarray]:
    """Host signals of feet that never rest: each shifts its weight and its place, at its own moment.

    A whole number of shifts fits into `frames`, so that a repeat goes on without a step.

    >>> standing(3, 1, 64)["force_n"].min(axis=1)[1:]
    array([0., 0.])
    """
    turn = 2.0 * np.pi * np.arange(frames) / frames
    own = np.arange(tiles)[:, None]
    on = own < stood_on
    return {
        "force_n": np.where(on, 450.0 + 300.0 * np.sin(2.0 * turn + own), 0.0),
        "x_m": np.where(on, 0.1 * np.cos(turn + own), 0.0),
        "y_m": np.where(on, 0.1 * np.sin(turn + own), 0.0),
    }
