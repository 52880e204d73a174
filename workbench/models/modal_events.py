"""A modal bank struck by events (equation 3.4): free ringing by phasors, 64 frames at a time, one row of real time.

Between events a mode is a turning, shrinking phasor, so 64 frames are a short table times the phasors at their
start, and their end is one complex product away: nothing drifts. Blocks lie at multiples of 64 session frames,
whatever the calls. An event adds its response, tabulated once, to the rest of its block, and its exact share to the
phasors at the block's end; hence the same bits however the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous:
`s` holds the block's output and the phasors at its end, `t` the poles' powers, the amplitudes and the response.
"""

import math

from workbench.kernels import kernel, modal_kernel

BLOCK = 64
_HEAD = 8  # s: modes in use, events in the block; t: modes, floor squared
_ROWS = _HEAD + BLOCK  # then rows of one number a mode
_X, _Y, _U, _V = range(4)  # rows of s: phasors at the block's end, and a working copy
_AMPLITUDES, _P1, _P2, _P3, _P4, _P16, _P64, _SPARE = 0, 1, 3, 5, 7, 9, 11, 13  # of t: pairs, real and imaginary


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    136
    """
    return _ROWS + 4 * _padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    312
    """
    return _ROWS + 15 * _padded(modes)


@kernel
def tune(t, frequencies_hz, decays_per_s, amplitudes, rate_hz, floor):
    """Set `t` for modes a exp(-b t) sin(2 pi f t). What rings already goes on with the new frequencies and decays.

    A mode at or above half the rate is left out: it would alias. One whose amplitude falls below `floor` (output
    units; 120 dB below what is loud is a good choice) drops out, and so does the cost of the modes behind the last
    that sounds: list slow decays first.
    """
    modes = frequencies_hz.size
    t[:] = 0.0
    t[0] = modes
    t[1] = floor * floor
    table = _rows(t, 15, modes)
    for m in range(modes):
        if frequencies_hz[m] < 0.5 * rate_hz:
            size = math.exp(-decays_per_s[m] / rate_hz)
            angle = 2.0 * math.pi * (frequencies_hz[m] / rate_hz)
            x, y = size * math.cos(angle), size * math.sin(angle)
            x2, y2 = _squared(x, y)
            x4, y4 = _squared(x2, y2)
            x8, y8 = _squared(x4, y4)
            table[_AMPLITUDES, m] = amplitudes[m]
            table[_P1, m], table[_P1 + 1, m] = x, y
            table[_P2, m], table[_P2 + 1, m] = x2, y2
            table[_P3, m], table[_P3 + 1, m] = x2 * x - y2 * y, x2 * y + y2 * x
            table[_P4, m], table[_P4 + 1, m] = x4, y4
            table[_P16, m], table[_P16 + 1, m] = _squared(x8, y8)
            # From block to block errors would add up, so this power is its own, of an angle reduced exactly.
            size = math.exp(-decays_per_s[m] * BLOCK / rate_hz)
            angle = 2.0 * math.pi * (frequencies_hz[m] * BLOCK % rate_hz / rate_hz)
            table[_P64, m], table[_P64 + 1, m] = size * math.cos(angle), size * math.sin(angle)
            table[_SPARE, m] = amplitudes[m]
    _free_block(table, _SPARE, table, table.shape[1], t)


@kernel
def ring(s, t, events, count, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`; one struck by 1 adds sum a exp(-b t) sin(2 pi f t).

    `events` is flat, (time, strength, duration) for each of `count` events, in order of time; one acts from the
    frame that its time lies in. One before `frame` acts at once.
    """
    modes = int(t[0])
    rows = _rows(s, 4, modes)
    table = _rows(t, 15, modes)
    done = 0
    event = 0
    while done < n:
        start = (frame + done) % BLOCK
        if start == 0:
            _begin_block(s, rows, t, table)
        length = min(BLOCK - start, n - done)
        while event < count and events[3 * event] < frame + done + length:
            at = int(math.floor(events[3 * event])) - (frame + done)
            _strike(s, rows, t, table, start + max(at, 0), events[3 * event + 1])
            event += 1
        for i in range(length):
            out[done + i] = s[_HEAD + start + i]
        done += length


@kernel
def rest(s, t):
    """An upper bound of |output| from here on, if nothing strikes again."""
    rows = _rows(s, 4, int(t[0]))
    bound = 0.0
    for i in range(_HEAD, _ROWS):
        bound = max(bound, abs(s[i]))
    for m in range(int(s[0])):
        bound += math.sqrt(rows[_X, m] ** 2 + rows[_Y, m] ** 2)
    return bound


@kernel
def _padded(modes):
    """The length of a row: vector loops over whole eights have no remainder."""
    return (modes + 7) // 8 * 8


@kernel
def _rows(array, count, modes):
    """The rows of `s` or `t`, one number a mode in each. (Made once a call: a view costs more than a mode's block.)"""
    row = _padded(modes)
    return array[_ROWS : _ROWS + count * row].reshape((count, row))


@kernel
def _squared(x, y):
    return x * x - y * y, 2.0 * x * y


@modal_kernel
def _begin_block(s, rows, t, table):
    """Fill the block with the free ringing of what sounds, and move the phasors to its end."""
    active = int(s[0])
    if s[1] == 0.0 and active > 0:  # a block with events may still be building a mode up
        last = 0
        for m in range(active):
            x, y = rows[_X, m], rows[_Y, m]
            sounds = x * x + y * y > t[1]
            rows[_X, m] = x if sounds else 0.0
            rows[_Y, m] = y if sounds else 0.0
            last = max(last, m + 1 if sounds else 0)
        active = _padded(last)
        s[0] = active
    s[1] = 0.0
    if active == 0:
        for i in range(_HEAD, _ROWS):
            s[i] = 0.0
        return
    for m in range(active):
        rows[_U, m] = rows[_X, m]
        rows[_V, m] = rows[_Y, m]
    _free_block(rows, _U, table, active, s)
    _turn(rows, _X, table, _P64, active)


@kernel
def _strike(s, rows, t, table, at, strength):
    """Add an event at frame `at` of the block: the tabulated response, and its phasors at the block's end."""
    for i in range(BLOCK - at):
        s[_HEAD + at + i] += strength * t[_HEAD + i]
    row = rows.shape[1]
    for m in range(row):
        rows[_U, m] = table[_AMPLITUDES, m]
        rows[_V, m] = 0.0
    left = BLOCK - at
    for _ in range(left // 16):
        _turn(rows, _U, table, _P16, row)
    for _ in range(left % 16 // 4):
        _turn(rows, _U, table, _P4, row)
    if left % 4 > 0:
        _turn(rows, _U, table, _P1 + 2 * (left % 4 - 1), row)
    for m in range(row):
        rows[_X, m] += strength * rows[_U, m]
        rows[_Y, m] += strength * rows[_V, m]
    s[0] = row
    s[1] = 1.0


@kernel
def _turn(rows, x, table, power, active):
    """Advance the phasors in rows `x` and `x + 1` by a tabulated power of their poles."""
    for m in range(active):
        u, v = rows[x, m], rows[x + 1, m]
        a, b = table[power, m], table[power + 1, m]
        rows[x, m] = u * a - v * b
        rows[x + 1, m] = v * a + u * b


@modal_kernel
def _free_block(rows, x, table, active, block):
    """64 frames of Im(sum of phasors) into a block; the phasors in rows `x` and `x + 1` are used up.

    Sixteen sums at a time stay in registers: four phasors, four frames apart, times three tabulated powers.
    """
    for k in range(_HEAD, _ROWS, 16):
        a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = c0 = c1 = c2 = c3 = d0 = d1 = d2 = d3 = 0.0
        for m in range(active):
            u, v = rows[x, m], rows[x + 1, m]
            x1, y1 = table[_P1, m], table[_P1 + 1, m]
            x2, y2 = table[_P2, m], table[_P2 + 1, m]
            x3, y3 = table[_P3, m], table[_P3 + 1, m]
            x4, y4 = table[_P4, m], table[_P4 + 1, m]
            a0, a1, a2, a3 = a0 + v, a1 + (v * x1 + u * y1), a2 + (v * x2 + u * y2), a3 + (v * x3 + u * y3)
            u, v = u * x4 - v * y4, v * x4 + u * y4
            b0, b1, b2, b3 = b0 + v, b1 + (v * x1 + u * y1), b2 + (v * x2 + u * y2), b3 + (v * x3 + u * y3)
            u, v = u * x4 - v * y4, v * x4 + u * y4
            c0, c1, c2, c3 = c0 + v, c1 + (v * x1 + u * y1), c2 + (v * x2 + u * y2), c3 + (v * x3 + u * y3)
            u, v = u * x4 - v * y4, v * x4 + u * y4
            d0, d1, d2, d3 = d0 + v, d1 + (v * x1 + u * y1), d2 + (v * x2 + u * y2), d3 + (v * x3 + u * y3)
        block[k], block[k + 1], block[k + 2], block[k + 3] = a0, a1, a2, a3
        block[k + 4], block[k + 5], block[k + 6], block[k + 7] = b0, b1, b2, b3
        block[k + 8], block[k + 9], block[k + 10], block[k + 11] = c0, c1, c2, c3
        block[k + 12], block[k + 13], block[k + 14], block[k + 15] = d0, d1, d2, d3
        if k < _ROWS - 16:
            _turn(rows, x, table, _P16, active)
