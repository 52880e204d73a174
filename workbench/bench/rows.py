"""Rows of models as a program runs them: block by block, their memory on cache lines and known by its address.

An array that Python made costs a kernel more: each part that is taken of it is counted, with locked instructions.
"""

import ctypes
from collections.abc import Callable
from functools import partial

import numpy as np
from numba import carray, types
from numpy.typing import NDArray

from underfoot.kernels import callback, kernel
from underfoot.memory import aligned_zeros
from underfoot.models.modal import driven_bank, struck_bank
from underfoot.models.modal import hammer as impact_row

BLOCK = 960
"""Frames; a fiftieth of a second at 48 kHz."""
_FLOATS, _COUNT = types.CPointer(types.float64), types.int64
Floats = NDArray[np.float64]


def strike(s: Floats, t: Floats, events: Floats, blocks: int) -> Callable[[], None]:
    """What lets a modal bank ring that is struck by `events`, from session frame 0 on."""
    arguments = *_sized(s), *_sized(t), *_sized(events), *_sized(aligned_zeros(BLOCK)), blocks
    return lambda: _strike.ctypes(*arguments)


def drive(s: Floats, t: Floats, excitation: Floats, blocks: int) -> Callable[[], None]:
    """What lets a modal bank ring that is driven in every frame, by the same block again and again."""
    arguments = *_sized(s), *_sized(t), *_sized(excitation), *_sized(aligned_zeros(BLOCK)), blocks
    return lambda: _drive.ctypes(*arguments)


def hit(s: Floats, t: Floats, hammer: Floats, events: Floats, first: int, blocks: int) -> Callable[[], None]:
    """What lets an object ring that is hit by a hammer at `events`, from block `first` on."""
    arguments = (
        *_sized(s),
        *_sized(t),
        *_sized(hammer),
        *_sized(events),
        *_sized(aligned_zeros(2 * BLOCK)),
        first,
        blocks,
    )
    return lambda: _hit.ctypes(*arguments)


def _sized(values: Floats):
    return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)), values.size


@kernel
def _in_block(events, k):
    """How many of the events that are left are in block `k`."""
    count = 0
    while 3 * count < events.size and events[3 * count] < (k + 1) * BLOCK:
        count += 1
    return count


@partial(callback, types.void(*[_FLOATS, _COUNT] * 4, _COUNT))
def _strike(s, s_size, t, t_size, events, e_size, out, o_size, blocks):
    state, tuning, heard = carray(s, s_size), carray(t, t_size), carray(out, o_size)
    strikes = carray(events, e_size)
    for k in range(blocks):
        count = _in_block(strikes, k)
        struck_bank.ring(state, tuning, strikes, count, heard, k * BLOCK, BLOCK)
        strikes = strikes[3 * count :]


@partial(callback, types.void(*[_FLOATS, _COUNT] * 4, _COUNT))
def _drive(s, s_size, t, t_size, excitation, e_size, out, o_size, blocks):
    state, tuning, heard = carray(s, s_size), carray(t, t_size), carray(out, o_size)
    for k in range(blocks):
        driven_bank.ring(state, tuning, carray(excitation, e_size), heard, k * BLOCK, BLOCK)


@partial(callback, types.void(*[_FLOATS, _COUNT] * 5, _COUNT, _COUNT))
def _hit(s, s_size, t, t_size, hammer, h_size, events, e_size, out, o_size, first, blocks):
    state, tuning, heard = carray(s, s_size), carray(t, t_size), carray(out, o_size)
    force, acceleration = heard[:BLOCK], heard[BLOCK:]
    throws = carray(events, e_size)
    for k in range(first, first + blocks):
        count = _in_block(throws, k)
        impact_row.ring(
            state, tuning, carray(hammer, h_size), throws, count, force, acceleration, heard[:0], k * BLOCK, BLOCK
        )
        throws = throws[3 * count :]
