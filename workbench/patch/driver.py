"""The compiled loop that runs a program: for each row, node after node, in stretches, asleep wherever it can be.

Rows (tiles) do not know of one another, so the row is the outer loop: one row's signals stay in the nearest cache. A
lane is one signal's frames of the present block; lanes between nodes are shared by all rows, lanes that the engine
fills or reads have a row for each tile.

A row of a node is looked at for sleep on every fourth span edge (`NAP` frames): looking at each costs as much as
running a small node. Waking happens at the very frame of the first nonzero input or event.
"""

import math

import numpy as np
from numba import njit

from underfoot.clock import RAMP, SPAN
from underfoot.kernels import kernel
from underfoot.patch.calls import call_rest, call_run, cycles
from underfoot.patch.tables import (
    ANY,
    CONTROL_AT,
    CONTROL_MEMORY,
    CONTROLS,
    DATA_AT,
    DRIVEN,
    EVENT_IN_AT,
    EVENT_INS,
    EVENT_OUT_AT,
    EVENT_OUTS,
    GUARDED,
    IN_AT,
    INS,
    MODE,
    OUT_AT,
    OUTS,
    REST,
    RUN,
    STATE,
    STATE_AT,
    TUNING,
    TUNING_AT,
    WATCHED,
    WATCHED_AT,
    tables_at,
)

_inner = njit(nogil=True, error_model="numpy", forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)

NAP = 4 * SPAN
QUIET = 1e-9
"""What remains of a signal, of full scale, below which its row falls asleep."""

_EXPONENT = 0x7FF0000000000000
_MAGNITUDE = 0x7FFFFFFFFFFFFFFF


@kernel
def run_block(where, frame, n):
    """Run `n` frames of the program whose tables are at `addresses`, the first of them session frame `frame`."""
    p = tables_at(where)
    _fill_signal_controls(p, frame, n)
    first = NAP - frame % NAP
    naps = 1 if n <= first else 1 + (n - first + NAP - 1) // NAP
    row = 0
    while row < p.output.shape[0]:
        end = _left_alone(p, row, n)
        if end > row:
            _skip(p, row, end, n)
            row = end
            continue
        for lane in p.hosts:
            _listen(p, lane, row, first, naps, n)
        ran = False
        for k in range(p.nodes.shape[0]):
            ran |= _run_node(p, k, row, frame, n, first, naps)
        for lane in range(p.carry.shape[0]):
            carry = p.loud[lane, naps - 1] if (frame + n) % NAP != 0 else 0
            p.carry[lane, row] = carry
            ran |= carry != 0
        _play(p, row, n)
        p.idle[row] = not ran
        row += 1
    _finish_ramps(p, frame, n)


@kernel
def remains(where, k):
    """What a node puts out in its first row with no input, by its own word: 0 for most."""
    p = tables_at(where)
    return _remains(p, k, 0) if p.nodes[k, REST] != 0 and p.output.shape[0] > 0 else 0.0


@_inner
def _fill_signal_controls(p, frame, n):
    """Parameters that are signals: filled once when steady, frame by frame while they move."""
    for j in range(p.signal_controls.size):
        state = p.signal_moving[j]
        if state == 0:
            continue
        at = p.lane_at[p.signal_controls[j]]
        begin, end, start = p.signal_ramp[j, 0], p.signal_ramp[j, 1], p.signal_start[j]
        if state == 2 or frame >= start + RAMP:
            for i in range(p.output.shape[1]):
                p.lanes[at + i] = end
            p.signal_moving[j] = 0
            continue
        for i in range(n):
            p.lanes[at + i] = on_ramp(begin, end, frame + i - start)


@kernel
def on_ramp(begin, end, frames):
    """A control `frames` after it was sent from `begin` to `end`."""
    if frames >= RAMP:
        return end
    if frames <= 0:
        return begin
    return begin + (end - begin) * (frames / RAMP)


@_inner
def _left_alone(p, row, n):
    """The end of the rows from `row` on that are idle, and to which the engine brings only zeros in this block."""
    while row < p.output.shape[0] and p.idle[row] != 0 and p.still[row] != 0:
        for lane in p.hosts:
            at = p.lane_at[lane] + row * p.lane_step[lane]
            if _loud(p, at, at + n):
                return row
        row += 1
    return row


@_inner
def _skip(p, row, end, n):
    """There is nothing to be done for these rows."""
    for j in range(p.scopes.size):
        for one in range(row, end):
            for i in range(n):
                p.scope[j, one, i] = 0.0
    if end == p.output.shape[0]:
        _forget_events(p)


@_inner
def _loud(p, at, end):
    """Whether anything from place `at` of the lanes on, to `end`, is not zero."""
    some = np.int64(0)
    for i in range(np.uint64(at), np.uint64(end)):  # unsigned: no test for a negative index, which would keep it scalar
        some |= p.bits[i]
    return some & _MAGNITUDE != 0


@_inner
def _forget_events(p):
    """No events in this block, as the last row has none."""
    for k in range(p.nodes.shape[0]):
        for j in range(p.nodes[k, EVENT_OUTS]):
            p.events[p.nodes[k, EVENT_OUT_AT] + j, 0] = 0.0


@_inner
def _listen(p, lane, row, first, naps, n):
    """Find out in which naps a lane that the engine filled is loud."""
    at = p.lane_at[lane] + row * p.lane_step[lane]
    f = 0
    for nap in range(naps):
        g = min(first + nap * NAP, n)
        p.loud[lane, nap] = _loud(p, at + f, at + g) or (nap == 0 and p.carry[lane, row] != 0)
        f = g


@_inner
def _run_node(p, k, row, frame, n, first, naps):
    """Run a row of a node for the block; true if it was awake for any of it."""
    outs, out_at = p.nodes[k, OUTS], p.nodes[k, OUT_AT]
    for j in range(p.nodes[k, EVENT_INS]):
        p.cursor[p.nodes[k, EVENT_IN_AT] + j] = 0
    for j in range(p.nodes[k, EVENT_OUTS]):
        p.events[p.nodes[k, EVENT_OUT_AT] + j, 0] = 0.0
    for lane in range(out_at, out_at + outs):
        p.loud[lane, 0] = p.carry[lane, row]
        for nap in range(1, naps):
            p.loud[lane, nap] = 0
    by_span = p.nodes[k, DRIVEN] != 0 or p.moving[k] != 0
    asleep = p.asleep[k, row] != 0
    ran = not asleep and p.masked[k, row] == 0
    f = 0
    if p.masked[k, row] != 0 or (asleep and not _stirred(p, k, row, naps)):
        _silence(p, k, 0, n, n)
        f = n
    nap = 0
    while f < n:
        end_of_nap = min(first + nap * NAP, n)
        if asleep:
            wake = _wake(p, k, row, frame, f, end_of_nap, nap)
            _silence(p, k, f, wake, n)
            f = wake
        if f < end_of_nap:
            began = cycles()
            ran = True
            if asleep:
                asleep = False
                into_span = (frame + f) % SPAN
                if by_span and 0 < into_span <= f:
                    _read_controls(p, k, row, frame, f - into_span)
            while f < end_of_nap:
                g = end_of_nap
                if by_span:
                    if (frame + f) % SPAN == 0:
                        _read_controls(p, k, row, frame, f)
                    g = min(g, f + SPAN - (frame + f) % SPAN)
                else:
                    g = _far(p, k, g, nap, first, n)
                _stretch(p, k, row, frame, f, g, nap, first)
                f = g
                while first + nap * NAP < f:
                    nap += 1
                end_of_nap = min(first + nap * NAP, n)
            if (frame + f) % NAP == 0 and _may_sleep(p, k, row, frame + f, nap):
                at = p.nodes[k, STATE_AT] + row * p.nodes[k, STATE]
                for i in range(at, at + p.nodes[k, STATE]):
                    p.state[i] = 0.0
                asleep = True
            p.cycles[k] += cycles() - began
        nap += 1
    p.asleep[k, row] = asleep
    last = n - 1 - (frame + n - 1) % SPAN
    if by_span and asleep and last >= 0:
        _read_controls(p, k, row, frame, last)
    return ran


@_inner
def _stirred(p, k, row, naps):
    """Whether anything in this block could wake a sleeping row."""
    watched_at, watched = p.nodes[k, WATCHED_AT], p.nodes[k, WATCHED]
    for nap in range(naps):
        loud = 0
        for j in range(watched_at, watched_at + watched):
            loud += p.loud[p.watched[j], nap] != 0
        if loud > 0 and (p.nodes[k, MODE] != ANY or loud == watched):
            return True
    for j in range(p.nodes[k, EVENT_IN_AT], p.nodes[k, EVENT_IN_AT] + p.nodes[k, EVENT_INS]):
        source = p.events_in[j]
        if p.events[source + row * p.event_step[source], 0] > 0.0:
            return True
    return False


@_inner
def _read_controls(p, k, row, frame, f):
    """Controls of one row as they stand at frame `f` of the block, which begins a span."""
    memory = p.nodes[k, CONTROL_MEMORY] + row * p.nodes[k, CONTROLS]
    for j in range(p.nodes[k, CONTROLS]):
        q = p.nodes[k, CONTROL_AT] + j
        lane = p.drivers[q]
        if lane < 0:
            p.control[memory + j] = on_ramp(p.ramp[q, 0], p.ramp[q, 1], frame + f - p.ramp_start[q])
        else:
            value = p.lanes[p.lane_at[lane] + row * p.lane_step[lane] + f]
            if not math.isnan(value):
                p.control[memory + j] = min(max(value, p.ramp[q, 2]), p.ramp[q, 3])


@_inner
def _wake(p, k, row, frame, f, g, nap):
    """The first frame in [f, g) at which a sleeping row has something to do, or g."""
    watched_at, watched = p.nodes[k, WATCHED_AT], p.nodes[k, WATCHED]
    wake = g
    if p.nodes[k, MODE] == ANY:
        for j in range(watched_at, watched_at + watched):
            if p.loud[p.watched[j], nap] == 0:
                return g
        for i in range(f, g):
            all_loud = True
            for j in range(watched_at, watched_at + watched):
                lane = p.watched[j]
                if p.bits[p.lane_at[lane] + row * p.lane_step[lane] + i] & _MAGNITUDE == 0:
                    all_loud = False
            if all_loud:
                return i
        return g
    for j in range(watched_at, watched_at + watched):
        lane = p.watched[j]
        if p.loud[lane, nap] != 0:
            at = p.lane_at[lane] + row * p.lane_step[lane]
            for i in range(f, wake):
                if p.bits[at + i] & _MAGNITUDE != 0:
                    wake = i
                    break
    for j in range(p.nodes[k, EVENT_IN_AT], p.nodes[k, EVENT_IN_AT] + p.nodes[k, EVENT_INS]):
        source = p.events_in[j]
        taken = p.cursor[j]
        events = p.events[source + row * p.event_step[source]]
        if taken < events[0]:
            wake = min(wake, max(f, int(math.floor(events[3 * taken + 1])) - frame))
    return wake


@_inner
def _silence(p, k, f, g, n):
    """Exact zeros in the outputs from frame f to g."""
    if f == g:
        return
    for lane in range(p.nodes[k, OUT_AT], p.nodes[k, OUT_AT] + p.nodes[k, OUTS]):
        if p.clean[lane] != 0:
            continue
        at = p.lane_at[lane]
        if f == 0 and g == n:
            for i in range(p.output.shape[1]):
                p.lanes[at + i] = 0.0
            p.clean[lane] = 1
        else:
            for i in range(f, g):
                p.lanes[at + i] = 0.0


@_inner
def _far(p, k, g, nap, first, n):
    """How far a stretch may go on: over the end of each nap at which its row could not fall asleep anyway."""
    while g < n:
        loud = 0
        for j in range(p.nodes[k, WATCHED_AT], p.nodes[k, WATCHED_AT] + p.nodes[k, WATCHED]):
            loud += p.loud[p.watched[j], nap] != 0
        if loud == 0 or (p.nodes[k, MODE] == ANY and loud < p.nodes[k, WATCHED]):
            break
        nap += 1
        g = min(first + nap * NAP, n)
    return g


@_inner
def _stretch(p, k, row, frame, f, g, nap, first):
    """Call a node's kernel for frames f to g of the block, and look at what it wrote."""
    x = p.pointers.ctypes.data
    at = 0
    for j in range(p.nodes[k, INS]):
        lane = p.signals_in[p.nodes[k, IN_AT] + j]
        p.pointers[at] = p.lanes.ctypes.data + 8 * (p.lane_at[lane] + row * p.lane_step[lane] + f)
        at += 1
    y = x + 8 * at
    for j in range(p.nodes[k, OUTS]):
        lane = p.nodes[k, OUT_AT] + j
        p.pointers[at] = p.lanes.ctypes.data + 8 * (p.lane_at[lane] + f)
        p.clean[lane] = 0
        at += 1
    e = x + 8 * at
    for j in range(p.nodes[k, EVENT_INS]):
        p.pointers[at] = _stage(p, p.nodes[k, EVENT_IN_AT] + j, j, row, frame, g)
        at += 1
    o = x + 8 * at
    for j in range(p.nodes[k, EVENT_OUTS]):
        p.pointers[at] = p.events.ctypes.data + 8 * p.events.shape[1] * (p.nodes[k, EVENT_OUT_AT] + j)
        at += 1
    c = p.control.ctypes.data + 8 * (p.nodes[k, CONTROL_MEMORY] + row * p.nodes[k, CONTROLS])
    s = p.state.ctypes.data + 8 * (p.nodes[k, STATE_AT] + row * p.nodes[k, STATE])
    t = p.tuning.ctypes.data + 8 * (p.nodes[k, TUNING_AT] + row * p.nodes[k, TUNING])
    d = p.data.ctypes.data + 8 * p.nodes[k, DATA_AT]
    call_run(p.nodes[k, RUN], x, y, c, s, t, d, e, o, p.keys[k, row], p.settings[0], frame + f, g - f)
    p.ran[k, row] += g - f
    for j in range(p.nodes[k, OUTS]):
        lane = p.nodes[k, OUT_AT] + j
        a = f
        q = nap
        while a < g:
            b = min(first + q * NAP, g)
            if _look(p, lane, a, b, q):
                _contain(p, k, row, frame, f, g)
                return
            a = b
            q += 1


@_inner
def _look(p, lane, f, g, nap):
    """Mark the nap as loud if a frame is not zero; true if one is not finite."""
    at = p.lane_at[lane]
    some = np.int64(0)
    largest = np.int64(0)
    for i in range(np.uint64(at + f), np.uint64(at + g)):
        magnitude = p.bits[i] & _MAGNITUDE
        some |= magnitude
        largest = max(largest, magnitude)
    if some != 0:
        p.loud[lane, nap] = 1
    return largest >= _EXPONENT


@_inner
def _contain(p, k, row, frame, f, g):
    """A kernel made something that is not finite: its outputs and state to zero, and its name to the engine."""
    first = g
    for lane in range(p.nodes[k, OUT_AT], p.nodes[k, OUT_AT] + p.nodes[k, OUTS]):
        at = p.lane_at[lane]
        for i in range(f, g):
            if p.bits[at + i] & _MAGNITUDE >= _EXPONENT:
                first = min(first, i)
            p.lanes[at + i] = 0.0
    for i in range(p.nodes[k, STATE]):
        p.state[p.nodes[k, STATE_AT] + row * p.nodes[k, STATE] + i] = 0.0
    for i in range(p.nodes[k, TUNING]):
        p.tuning[p.nodes[k, TUNING_AT] + row * p.nodes[k, TUNING] + i] = 0.0
    if p.fault[0] < 0:
        p.fault[1] = row
        p.fault[2] = frame + first
        p.fault[0] = k


@_inner
def _stage(p, entry, j, row, frame, g):
    """The address of a list of the events on one input before frame g of the block that were not taken yet."""
    source = p.events_in[entry]
    events = p.events[source + row * p.event_step[source]]
    taken = p.cursor[entry]
    stage = p.stage[j]
    count = 0
    while taken < events[0] and math.floor(events[3 * taken + 1]) < frame + g:
        for i in range(1, 4):
            stage[3 * count + i] = events[3 * taken + i]
        count += 1
        taken += 1
    stage[0] = count
    if count > 0:
        p.cursor[entry] = taken
        p.last_event[entry, row] = int(math.floor(stage[3 * count - 2]))
    return p.stage.ctypes.data + 8 * p.stage.shape[1] * j


@_inner
def _may_sleep(p, k, row, now, nap):
    """Whether a row's inputs were zero for the nap that ends at session frame `now`, and nothing remains in it."""
    quiet = 0
    for j in range(p.nodes[k, WATCHED_AT], p.nodes[k, WATCHED_AT] + p.nodes[k, WATCHED]):
        quiet += p.loud[p.watched[j], nap] == 0
    if p.nodes[k, MODE] == ANY:
        return quiet > 0
    if quiet < p.nodes[k, WATCHED]:
        return False
    if p.nodes[k, MODE] == GUARDED:
        return True
    for j in range(p.nodes[k, EVENT_IN_AT], p.nodes[k, EVENT_IN_AT] + p.nodes[k, EVENT_INS]):
        if p.last_event[j, row] >= now - NAP:
            return False
    return p.nodes[k, REST] == 0 or _remains(p, k, row) <= QUIET


@_inner
def _remains(p, k, row):
    c = p.control.ctypes.data + 8 * (p.nodes[k, CONTROL_MEMORY] + row * p.nodes[k, CONTROLS])
    s = p.state.ctypes.data + 8 * (p.nodes[k, STATE_AT] + row * p.nodes[k, STATE])
    t = p.tuning.ctypes.data + 8 * (p.nodes[k, TUNING_AT] + row * p.nodes[k, TUNING])
    return call_rest(p.nodes[k, REST], c, s, t, p.data.ctypes.data + 8 * p.nodes[k, DATA_AT])


@_inner
def _play(p, row, n):
    """The sum of the sinks to the output, and copies of the lanes that somebody looks at."""
    some = 0
    for lane in p.sinks:
        some += p.clean[lane] == 0
    if some > 0 or p.still[row] == 0:
        p.still[row] = some == 0
        for i in range(p.output.shape[1]):
            p.output[row, i] = 0.0
    for lane in p.sinks:
        if p.clean[lane] == 0:
            at = np.uint64(p.lane_at[lane])
            for i in range(np.uint64(n)):
                p.output[row, i] += p.lanes[at + i]
    for j in range(p.scopes.size):
        at = np.uint64(p.lane_at[p.scopes[j]])
        for i in range(np.uint64(n)):
            p.scope[j, row, i] = p.lanes[at + i]


@_inner
def _finish_ramps(p, frame, n):
    """Give all rows the controls as they stand at the last span edge of the block, and end what has arrived."""
    last = frame + n - 1 - (frame + n - 1) % SPAN
    if last < frame:
        return
    for k in range(p.nodes.shape[0]):
        if p.moving[k] == 0:
            continue
        moving = False
        for j in range(p.nodes[k, CONTROLS]):
            q = p.nodes[k, CONTROL_AT] + j
            if p.drivers[q] >= 0:
                continue
            moving |= last < p.ramp_start[q] + RAMP
            for row in range(p.output.shape[0]):
                value = on_ramp(p.ramp[q, 0], p.ramp[q, 1], last - p.ramp_start[q])
                p.control[p.nodes[k, CONTROL_MEMORY] + row * p.nodes[k, CONTROLS] + j] = value
        p.moving[k] = moving
