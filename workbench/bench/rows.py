"""Rows of models as a program runs them: block by block, with all memory in one array, passed by address.

A call from Python with a dozen arrays takes longer than a block; and slices of an array made by Python cost a kernel
reference counting with locked instructions.
"""

import ctypes
from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
from numba import types
from numba.core.ccallback import CFunc
from numpy.typing import ArrayLike

from underfoot.kernels import Floats, callback, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.modal import contact_motion, driven_bank, hammer, phasors, struck_bank
from underfoot.models.modal.impact import ModalObject
from underfoot.models.signals.events import EVENTS, append, event_list

BLOCK = 960
"""Frames per block; a fiftieth of a second at 48 kHz."""

STRUCK = Layout(
    "struck_row",
    state=struck_bank.STATE,
    coefficients=struck_bank.COEFFICIENTS,
    events=EVENTS,
    events_of_block=EVENTS,
    out=BLOCK,
)
DRIVEN = Layout(
    "driven_row", state=driven_bank.STATE, coefficients=driven_bank.COEFFICIENTS, excitation=BLOCK, out=BLOCK
)
HIT = Layout(
    "hit_row",
    state=contact_motion.STATE,
    object=contact_motion.OBJECT,
    hammer=hammer.HAMMER,
    events=EVENTS,
    events_of_block=EVENTS,
    force=BLOCK,
    acceleration=BLOCK,
)

_struck_at, _driven_at, _hit_at = STRUCK.at, DRIVEN.at, HIT.at
_POINTER, _COUNT = types.CPointer(types.float64), types.int64


def struck(modes: ArrayLike, rate: float, floor: float, events: Sequence[Sequence[float]]) -> Memory:
    """Return a `struck_bank` at rest that is struck at `events`: (time, strength), from session frame 0 on.

    `modes` [3, m] are rows of frequency (Hz), decay (1/s) and amplitude.
    """
    values = np.array(modes, np.float64)
    row = STRUCK.zeros(**phasors.sizes(values.shape[1]), room=max(len(events), 1))
    struck_bank.design(values, 1.0, 1.0, float(rate), floor, row.coefficients)
    row.events.values[:] = event_list(*events, room=row.room).values
    return row


def driven(modes: ArrayLike, rate: float, floor: float, excitation: Floats) -> Memory:
    """Return a `driven_bank` at rest that is driven by the same block repeatedly; `modes` as above."""
    values = np.array(modes, np.float64)
    row = DRIVEN.zeros(**driven_bank.sizes(values.shape[1]))
    driven_bank.design(values, float(rate), floor, row.coefficients)
    row.excitation[:] = excitation
    return row


def hit(modes: ArrayLike | ModalObject, rate: float, events: Sequence[Sequence[float]], **of_hammer: float) -> Memory:
    """Return an object at rest, hit at `events` (time, velocity) by a hammer with the fields of `hammer.HAMMER`.

    `modes` [4, m] are rows of frequency (Hz), decay (1/s), modal mass (kg) and shape.
    """
    values = np.array(tuple(modes) if isinstance(modes, ModalObject) else modes, np.float64)
    row = HIT.zeros(**phasors.sizes(values.shape[1]), room=max(len(events), 1))
    hammer.design(values, 1.0, 1.0, float(rate), 0.0, row.object)
    row.events.values[:] = event_list(*events, room=row.room).values
    for name, value in of_hammer.items():
        setattr(row.hammer, name, value)
    return row


def ringing(row: Memory, first: int, blocks: int) -> Callable[[], None]:
    """Return a function that runs this many blocks of a row from block `first` on.

    >>> row = driven([[12_000.0], [0.0], [2.0]], 48_000.0, 0.0, np.eye(1, BLOCK)[0])
    >>> ringing(row, 0, 1)()
    >>> row.out[:5].round(9) + 0.0
    array([ 0.,  2.,  0., -2.,  0.])
    """
    address = row.values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    return partial(_compiled(row.layout).ctypes, address, *row.sizes.values(), first, blocks)


@cache
def _compiled(layout: Layout) -> CFunc:
    """Return the kernel for rows of a layout: of address, the layout's sizes, first block and number of blocks."""
    runs: dict[Layout, Callable[..., None]] = {STRUCK: _strike, DRIVEN: _drive, HIT: _hit}
    return callback(types.void(_POINTER, *[_COUNT] * (len(layout.symbols) + 2)), runs[layout])


@kernel
def _take(events: Memory, following: int, end: int, taken: Memory) -> int:
    """Copy the events from number `following` on that are before frame `end`; return the number of the next one."""
    taken.count = 0.0
    while following < len(events) and events.time[following] < end:
        append(taken, events.time[following], events.strength[following], events.duration[following])
        following += 1
    return following


def _strike(address: int, row: int, wave_values: int, room: int, first: int, blocks: int) -> None:
    memory = _struck_at(address, (row, wave_values, room))
    events = memory.events_of_block
    following = _take(memory.events, 0, first * BLOCK, events)
    for k in range(first, first + blocks):
        following = _take(memory.events, following, (k + 1) * BLOCK, events)
        struck_bank.ring(events, k * BLOCK, memory.coefficients, memory.state, memory.out)


def _drive(address: int, row: int, first: int, blocks: int) -> None:
    memory = _driven_at(address, (row,))
    for k in range(first, first + blocks):
        driven_bank.ring(memory.excitation, k * BLOCK, memory.coefficients, memory.state, memory.out)


def _hit(address: int, row: int, wave_values: int, room: int, first: int, blocks: int) -> None:
    memory = _hit_at(address, (row, wave_values, room))
    events = memory.events_of_block
    out = hammer.Response(memory.force, memory.acceleration, memory.force[:0])
    following = _take(memory.events, 0, first * BLOCK, events)
    for k in range(first, first + blocks):
        following = _take(memory.events, following, (k + 1) * BLOCK, events)
        hammer.ring(events, memory.hammer, k * BLOCK, memory.object, memory.state, out)
