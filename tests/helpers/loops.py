"""Engine loops on a simulated floor, and their output."""

import numpy as np

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY

FLOOR = default_floor()


def loop_of(patch, block=256, registry=REGISTRY, walking=True, floor=FLOOR, **options):
    """Return a loop that plays."""
    loop = Loop(patch, registry, SimulatedFloor(floor, walking=walking), LoopOptions(block=block, **options))
    loop.send(Play(True))
    return loop


def played(loop, frames, blocks=None):
    """Return the next frames that a loop plays, in blocks of these sizes in turn."""
    out = np.empty((frames, loop.out.shape[1]), np.float32)
    blocks = blocks or [loop.block]
    at = turn = 0
    while at < frames:
        n = min(blocks[turn % len(blocks)], frames - at)
        loop.run(n)
        out[at : at + n] = loop.out[:n]
        at, turn = at + n, turn + 1
    return out
