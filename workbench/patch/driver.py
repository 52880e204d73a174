"""Compiled loop that runs a program: row by row, node after node, in stretches; rows sleep wherever possible.

Rows (tiles) are independent, so the row is the outer loop and its signals stay in the nearest cache. A buffer holds one
signal's frames of the present block; buffers between nodes are shared by all rows, buffers that the engine fills or
reads have a row for each tile.

A row of a node may fall asleep at the end of each sleep interval, four spans: checking every span would cost as much as
running a small node. It wakes at the exact frame of the first nonzero input or event.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import SPAN
from underfoot.kernels import call_at, inlined, kernel
from underfoot.layouts import Memory
from underfoot.models.signals.events import append, events_at
from underfoot.patch.calls import call_tail, cycles
from underfoot.patch.controls import fill_signal_controls, finish_ramps, read_controls
from underfoot.patch.tables import ANY, GUARDED, Tables, tables_at

SLEEP_INTERVAL = 4 * SPAN
"""Sleep interval in frames: a row may fall asleep at its multiples."""
INAUDIBLE = 1e-9
"""Bound of a row's remaining output, in full scale, below which it falls asleep."""

_EXPONENT = 0x7FF0000000000000
_MAGNITUDE = 0x7FFFFFFFFFFFFFFF
"""Bits of a float64: the exponent, all set in what is not finite, and everything but the sign."""


def blocks_per_timed(block: int) -> int:
    """Return how many blocks there are for each that is timed: reading the counter twice takes as long as 64 frames of
    a small node.

    The number is odd, so that the timed blocks do not always begin sleep intervals.

    >>> blocks_per_timed(64), blocks_per_timed(1024)
    (17, 1)
    """
    return 2 * (512 // block) + 1


@kernel
def run_block(
    where: NDArray[np.int64], signals: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, n: int
) -> None:
    """Run `n` frames of the program whose tables are at the addresses `where`, from session frame `frame` on.

    The engine's `signals` are [signal, row, frame], and zero in `zero_rows`; without rows, the buffers have them.
    """
    p = tables_at(where)
    _take_signals(p, signals, zero_rows, n)
    fill_signal_controls(p, frame, n)
    if p.no_sound[0] == 0:
        p.sound[:] = 0.0
        p.no_sound[0] = 1
    is_timed = frame // max(n, 1) % p.blocks_per_timed[0] == 0
    first = SLEEP_INTERVAL - frame % SLEEP_INTERVAL
    intervals = 1 if n <= first else 1 + (n - first + SLEEP_INTERVAL - 1) // SLEEP_INTERVAL
    row = 0
    while row < p.output.shape[0]:
        end = _end_of_idle(p, row, n)
        if end > row:
            _skip(p, row, end, n)
            row = end
            continue
        for buffer in p.read_engine_buffers:
            _scan(p, buffer, row, first, intervals, n)
        ran = False
        for k in range(p.nodes.shape[0]):
            ran |= _run_node(p, k, row, frame, n, (first, intervals), is_timed)
        for buffer in range(p.was_nonzero.shape[0]):
            carry = p.nonzero[buffer, intervals - 1] if (frame + n) % SLEEP_INTERVAL != 0 else 0
            p.was_nonzero[buffer, row] = carry
            ran |= carry != 0
        _play(p, row, n)
        p.idle[row] = not ran
        row += 1
    finish_ramps(p, frame, n)


@kernel
def tail(where: NDArray[np.int64], k: int) -> float:
    """Return the output bound of a node's first row without input, from its `tail`: 0 for most."""
    p = tables_at(where)
    return _tail(p, k, 0) if p.nodes[k].tail != 0 and p.output.shape[0] > 0 else 0.0


@inlined
def _take_signals(p: Tables, signals: NDArray[np.float64], zero_rows: NDArray[np.uint8], n: int) -> None:
    """Copy `n` frames of the engine's signals to the buffers that nodes read.

    A row marked as zero is not read, and written only if it was not zero before.
    """
    for row in range(zero_rows.size):
        zero = zero_rows[row] != 0
        if zero and p.engine_zero[row] != 0:
            continue
        p.engine_zero[row] = zero
        for signal in range(p.engine_buffers.size):
            buffer = p.engine_buffers[signal]
            if buffer < 0:
                continue
            at = np.uint64(p.buffer_at[buffer] + row * p.row_stride[buffer])
            if zero:
                for i in range(np.uint64(p.output.shape[1])):
                    p.buffers[at + i] = 0.0
            else:
                for i in range(np.uint64(n)):
                    p.buffers[at + i] = signals[signal, row, i]


@inlined
def _end_of_idle(p: Tables, row: int, n: int) -> int:
    """Return the end of the rows from `row` on that are idle and receive only zeros from the engine in this block."""
    while row < p.output.shape[0] and p.idle[row] != 0 and p.silent[row] != 0:
        if p.engine_zero[row] == 0:
            for buffer in p.read_engine_buffers:
                at = p.buffer_at[buffer] + row * p.row_stride[buffer]
                if _nonzero(p, at, at + n):
                    return row
        row += 1
    return row


@inlined
def _skip(p: Tables, row: int, end: int, n: int) -> None:
    """Write the scopes of idle rows as zeros, and leave no events behind the last row."""
    for j in range(p.scopes.size):
        for one in range(row, end):
            for i in range(np.uint64(n)):
                p.scope[j, one, i] = 0.0
    if end == p.output.shape[0]:
        _forget_events(p)


@inlined
def _nonzero(p: Tables, at: int, end: int) -> bool:
    """Return whether the buffer memory from `at` to `end` has a nonzero value."""
    some = np.int64(0)
    for i in range(np.uint64(at), np.uint64(end)):  # unsigned: no test for a negative index, which would keep it scalar
        some |= p.bits[i]
    return some & _MAGNITUDE != 0


@inlined
def _forget_events(p: Tables) -> None:
    """Clear the events of this block, as for a row without any."""
    for k in range(p.nodes.shape[0]):
        for j in range(p.nodes[k].event_outputs):
            p.events[p.nodes[k].event_outputs_at + j, 0] = 0.0


@inlined
def _scan(p: Tables, buffer: int, row: int, first: int, intervals: int, n: int) -> None:
    """Find the intervals in which a buffer filled by the engine is nonzero."""
    at = p.buffer_at[buffer] + row * p.row_stride[buffer]
    f = 0
    for interval in range(intervals):
        g = min(first + interval * SLEEP_INTERVAL, n)
        fed = p.engine_zero[row] == 0 and _nonzero(p, at + f, at + g)
        p.nonzero[buffer, interval] = fed or (interval == 0 and p.was_nonzero[buffer, row] != 0)
        f = g


@inlined
def _run_node(p: Tables, k: int, row: int, frame: int, n: int, sleep: tuple[int, int], is_timed: bool) -> bool:
    """Run a row of a node for the block; return whether it was awake at any time.

    `sleep` is the frame at which the first sleep interval ends, and the number of intervals.
    """
    first, intervals = sleep
    _begin_block(p, k, row, intervals)
    by_span = p.nodes[k].is_driven != 0 or p.moving[k] != 0
    asleep = p.asleep[k, row] != 0
    ran = not asleep and p.masked[k, row] == 0
    f = 0
    if p.masked[k, row] != 0 or (asleep and not _may_wake(p, k, row, intervals)):
        _silence(p, k, 0, n, n)
        f = n
    interval = 0
    while f < n:
        end_of_interval = min(first + interval * SLEEP_INTERVAL, n)
        if asleep:
            wake = _wake(p, k, row, frame, f, end_of_interval, interval)
            _silence(p, k, f, wake, n)
            f = wake
        if f < end_of_interval:
            began = cycles() if is_timed else 0
            ran = True
            if asleep:
                asleep = False
                into_span = (frame + f) % SPAN
                if by_span and 0 < into_span <= f:
                    read_controls(p, k, row, frame, f - into_span)
            f, interval = _run_awake(p, k, row, frame, f, interval, (by_span, first, n))
            if (frame + f) % SLEEP_INTERVAL == 0 and _may_sleep(p, k, row, frame + f, interval):
                at = p.nodes[k].state_at + row * p.nodes[k].state_size
                for i in range(at, at + p.nodes[k].state_size):
                    p.state[i] = 0.0
                asleep = True
            if is_timed:
                p.cycles[k] += cycles() - began
        interval += 1
    p.asleep[k, row] = asleep
    last = n - 1 - (frame + n - 1) % SPAN
    if by_span and asleep and last >= 0:
        read_controls(p, k, row, frame, last)
    return ran


@inlined
def _begin_block(p: Tables, k: int, row: int, intervals: int) -> None:
    """Reset a node for the block: no events read or written, outputs nonzero only as the interval was before it."""
    outputs_at = p.nodes[k].outputs_at
    for j in range(p.nodes[k].event_inputs):
        p.cursor[p.nodes[k].event_inputs_at + j] = 0
    for j in range(p.nodes[k].event_outputs):
        p.events[p.nodes[k].event_outputs_at + j, 0] = 0.0
    for buffer in range(outputs_at, outputs_at + p.nodes[k].outputs):
        p.nonzero[buffer, 0] = p.was_nonzero[buffer, row]
        for interval in range(1, intervals):
            p.nonzero[buffer, interval] = 0


@inlined
def _run_awake(
    p: Tables, k: int, row: int, frame: int, f: int, interval: int, block: tuple[bool, int, int]
) -> tuple[int, int]:
    """Run an awake row from frame `f` to the end of an interval, in stretches; return frame and interval reached."""
    by_span, first, n = block
    end_of_interval = min(first + interval * SLEEP_INTERVAL, n)
    while f < end_of_interval:
        g = end_of_interval
        if by_span:
            if (frame + f) % SPAN == 0:
                read_controls(p, k, row, frame, f)
            g = min(g, f + SPAN - (frame + f) % SPAN)
        else:
            g = _stretch_end(p, k, g, interval, first, n)
        _stretch(p, k, row, frame, f, g, interval, first)
        f = g
        while first + interval * SLEEP_INTERVAL < f:
            interval += 1
        end_of_interval = min(first + interval * SLEEP_INTERVAL, n)
    return f, interval


@inlined
def _may_wake(p: Tables, k: int, row: int, intervals: int) -> bool:
    """Return whether anything in this block could wake a sleeping row."""
    watched_at, watched = p.nodes[k].watched_at, p.nodes[k].watched
    for interval in range(intervals):
        nonzero = 0
        for j in range(watched_at, watched_at + watched):
            nonzero += p.nonzero[p.watched[j], interval] != 0
        if nonzero > 0 and (p.nodes[k].sleep_rule != ANY or nonzero == watched):
            return True
    for j in range(p.nodes[k].event_inputs_at, p.nodes[k].event_inputs_at + p.nodes[k].event_inputs):
        source = p.event_inputs[j]
        if len(_events(p, source + row * p.event_stride[source])) > 0:
            return True
    return False


@inlined
def _wake(p: Tables, k: int, row: int, frame: int, f: int, g: int, interval: int) -> int:
    """Return the first frame in [f, g) at which a sleeping row must wake, or g."""
    watched_at, watched = p.nodes[k].watched_at, p.nodes[k].watched
    wake = g
    if p.nodes[k].sleep_rule == ANY:
        for j in range(watched_at, watched_at + watched):
            if p.nonzero[p.watched[j], interval] == 0:
                return g
        for i in range(f, g):
            all_nonzero = True
            for j in range(watched_at, watched_at + watched):
                buffer = p.watched[j]
                if p.bits[p.buffer_at[buffer] + row * p.row_stride[buffer] + i] & _MAGNITUDE == 0:
                    all_nonzero = False
            if all_nonzero:
                return i
        return g
    for j in range(watched_at, watched_at + watched):
        buffer = p.watched[j]
        if p.nonzero[buffer, interval] != 0:
            at = p.buffer_at[buffer] + row * p.row_stride[buffer]
            for i in range(f, wake):
                if p.bits[at + i] & _MAGNITUDE != 0:
                    wake = i
                    break
    for j in range(p.nodes[k].event_inputs_at, p.nodes[k].event_inputs_at + p.nodes[k].event_inputs):
        source = p.event_inputs[j]
        events = _events(p, source + row * p.event_stride[source])
        if p.cursor[j] < len(events):
            wake = min(wake, max(f, int(math.floor(events.time[p.cursor[j]])) - frame))
    return wake


@inlined
def _silence(p: Tables, k: int, f: int, g: int, n: int) -> None:
    """Write exact zeros to the outputs from frame f to g."""
    if f == g:
        return
    for buffer in range(p.nodes[k].outputs_at, p.nodes[k].outputs_at + p.nodes[k].outputs):
        if p.is_zero[buffer] != 0:
            continue
        at = p.buffer_at[buffer]
        if f == 0 and g == n:
            g = p.output.shape[1]
            p.is_zero[buffer] = 1
        for i in range(np.uint64(at + f), np.uint64(at + g)):
            p.buffers[i] = 0.0


@inlined
def _stretch_end(p: Tables, k: int, g: int, interval: int, first: int, n: int) -> int:
    """Return the end of a stretch: the first end of an interval from `g` on at which its row could fall asleep."""
    while g < n:
        nonzero = 0
        for j in range(p.nodes[k].watched_at, p.nodes[k].watched_at + p.nodes[k].watched):
            nonzero += p.nonzero[p.watched[j], interval] != 0
        if nonzero == 0 or (p.nodes[k].sleep_rule == ANY and nonzero < p.nodes[k].watched):
            break
        interval += 1
        g = min(first + interval * SLEEP_INTERVAL, n)
    return g


@inlined
def _stretch(p: Tables, k: int, row: int, frame: int, f: int, g: int, interval: int, first: int) -> None:
    """Call a node's kernel for frames f to g of the block, and check its output."""
    x = p.pointers.ctypes.data
    at = 0
    for j in range(p.nodes[k].inputs):
        buffer = p.inputs[p.nodes[k].inputs_at + j]
        p.pointers[at] = p.buffers.ctypes.data + 8 * (p.buffer_at[buffer] + row * p.row_stride[buffer] + f)
        at += 1
    y = x + 8 * at
    for j in range(p.nodes[k].outputs):
        buffer = p.nodes[k].outputs_at + j
        p.pointers[at] = p.buffers.ctypes.data + 8 * (p.buffer_at[buffer] + f)
        p.is_zero[buffer] = p.unread[buffer]
        at += 1
    e = x + 8 * at
    for j in range(p.nodes[k].event_inputs):
        p.pointers[at] = _stage(p, p.nodes[k].event_inputs_at + j, j, row, frame, g)
        at += 1
    o = x + 8 * at
    for j in range(p.nodes[k].event_outputs):
        p.pointers[at] = p.events.ctypes.data + 8 * p.events.shape[1] * (p.nodes[k].event_outputs_at + j)
        at += 1
    c, s, t, d = _memories(p, k, row)
    call_at(p.nodes[k].run, x, y, c, s, t, d, e, o, p.keys[k, row], p.settings[0], frame + f, g - f)
    p.ran[k, row] += g - f
    for j in range(p.nodes[k].outputs):
        buffer = p.nodes[k].outputs_at + j
        if p.unread[buffer] != 0:
            continue
        a = f
        q = interval
        while a < g:
            b = min(first + q * SLEEP_INTERVAL, g)
            if _mark_nonzero(p, buffer, a, b, q):
                _contain(p, k, row, frame, f, g)
                return
            a = b
            q += 1


@inlined
def _mark_nonzero(p: Tables, buffer: int, f: int, g: int, interval: int) -> bool:
    """Mark the interval as nonzero if a frame is nonzero; return whether a value is not finite."""
    at = p.buffer_at[buffer]
    largest = np.int64(0)
    for i in range(np.uint64(at + f), np.uint64(at + g)):
        largest = max(largest, p.bits[i] & _MAGNITUDE)
    if largest != 0:
        p.nonzero[buffer, interval] = 1
    return bool(largest >= _EXPONENT)


@inlined
def _contain(p: Tables, k: int, row: int, frame: int, f: int, g: int) -> None:
    """Contain a kernel's non-finite output: zero its outputs and state, and report its name to the engine."""
    first = g
    for buffer in range(p.nodes[k].outputs_at, p.nodes[k].outputs_at + p.nodes[k].outputs):
        at = p.buffer_at[buffer]
        for i in range(f, g):
            if p.bits[at + i] & _MAGNITUDE >= _EXPONENT:
                first = min(first, i)
            p.buffers[at + i] = 0.0
    for i in range(p.nodes[k].state_size):
        p.state[p.nodes[k].state_at + row * p.nodes[k].state_size + i] = 0.0
    for i in range(p.nodes[k].coefficients_size):
        p.coefficients[p.nodes[k].coefficients_at + row * p.nodes[k].coefficients_size + i] = 0.0
    if p.fault[k, 0] < 0:
        p.fault[k, 1] = frame + first
        p.fault[k, 0] = row


@inlined
def _stage(p: Tables, entry: int, j: int, row: int, frame: int, g: int) -> int:
    """Return the address of a list of an input's events before frame g of the block that were not read yet."""
    source = p.event_inputs[entry]
    events = _events(p, source + row * p.event_stride[source])
    staged = events_at(p.staged[j], (p.output.shape[1],))
    staged.count = 0.0
    taken = p.cursor[entry]
    while taken < len(events) and math.floor(events.time[taken]) < frame + g:
        append(staged, events.time[taken], events.strength[taken], events.duration[taken])
        taken += 1
    if len(staged) > 0:
        p.cursor[entry] = taken
        p.last_event[entry, row] = int(math.floor(staged.time[len(staged) - 1]))
    return p.staged.ctypes.data + 8 * p.staged.shape[1] * j


@inlined
def _events(p: Tables, index: int) -> Memory:
    """Return one of the event lists of this block."""
    return events_at(p.events[index], (p.output.shape[1],))


@inlined
def _may_sleep(p: Tables, k: int, row: int, now: int, interval: int) -> bool:
    """Return whether a row's inputs were zero in the interval that ends at session frame `now`, and its tail is 0."""
    zero = 0
    for j in range(p.nodes[k].watched_at, p.nodes[k].watched_at + p.nodes[k].watched):
        zero += p.nonzero[p.watched[j], interval] == 0
    if p.nodes[k].sleep_rule == ANY:
        return zero > 0
    if zero < p.nodes[k].watched:
        return False
    if p.nodes[k].sleep_rule == GUARDED:
        return True
    for j in range(p.nodes[k].event_inputs_at, p.nodes[k].event_inputs_at + p.nodes[k].event_inputs):
        if p.last_event[j, row] >= now - SLEEP_INTERVAL:
            return False
    return p.nodes[k].tail == 0 or _tail(p, k, row) <= INAUDIBLE


@inlined
def _tail(p: Tables, k: int, row: int) -> float:
    c, s, t, d = _memories(p, k, row)
    return call_tail(p.nodes[k].tail, c, s, t, d)


@inlined
def _memories(p: Tables, k: int, row: int) -> tuple[int, int, int, int]:
    """Return the addresses of a row's controls, state and coefficients, and of its node's data."""
    c = p.control.ctypes.data + 8 * (p.nodes[k].control_memory + row * p.nodes[k].controls)
    s = p.state.ctypes.data + 8 * (p.nodes[k].state_at + row * p.nodes[k].state_size)
    t = p.coefficients.ctypes.data + 8 * (p.nodes[k].coefficients_at + row * p.nodes[k].coefficients_size)
    return c, s, t, p.data.ctypes.data + 8 * p.nodes[k].data_at


@inlined
def _play(p: Tables, row: int, n: int) -> None:
    """Sum the sinks into the output, sound into that of all rows, and copy the scopes."""
    some = 0
    for buffer in p.sinks:
        some += p.is_zero[buffer] == 0
    if some > 0 or p.silent[row] == 0:
        p.silent[row] = some == 0
        for i in range(np.uint64(p.output.shape[1])):
            p.output[row, i] = 0.0
    for buffer in p.sinks:
        if p.is_zero[buffer] == 0:
            at = np.uint64(p.buffer_at[buffer])
            for i in range(np.uint64(n)):
                p.output[row, i] += p.buffers[at + i]
    for buffer in p.sound_sinks:
        if p.is_zero[buffer] == 0:
            at = np.uint64(p.buffer_at[buffer])
            p.no_sound[0] = 0
            for i in range(np.uint64(n)):
                p.sound[0, i] += p.buffers[at + i]
    for j in range(p.scopes.size):
        at = np.uint64(p.buffer_at[p.scopes[j]])
        for i in range(np.uint64(n)):
            p.scope[j, row, i] = p.buffers[at + i]
