"""A modal bank struck by events (equation 3.4): free ringing 64 frames at a time, one row of real time.

Blocks lie at multiples of 64 session frames, whatever the calls. An event adds its response, tabulated once, to the
rest of its block, and its exact share to the phasors at the block's end; hence the same bits however the frames are
split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous: `s` holds the block's output
and the phasors at its end; `t` the response to an event of strength 1, the amplitudes and the powers of the poles.
"""

import math

from underfoot.kernels import kernel
from underfoot.models.modal.phasors import (
    BLOCK,
    PHASOR_ROWS,
    TABLE_ROWS,
    advanced,
    free_block,
    in_use,
    padded,
    tabulate,
    waves_size,
)

_PATIENCE = 32 * BLOCK  # how often modes that fell below the floor are looked for
_OUTPUT = 8  # before it, in s: modes in use, events of late, frames of the block given out; in t: modes, floor squared
_ROWS = _OUTPUT + BLOCK
# From there on in s: phasors; in t: phasors to work with (the first row keeps the amplitudes), the table, the waves.


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    120
    """
    return _ROWS + PHASOR_ROWS * padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    1800
    """
    return _ROWS + (PHASOR_ROWS + TABLE_ROWS) * padded(modes) + waves_size(modes)


@kernel
def tune(t, frequencies_hz, decays_per_s, amplitudes, rate_hz, floor):
    """Set `t` for modes a exp(-b t) sin(2 pi f t). What rings already goes on with the new frequencies and decays.

    A mode at or above half the rate is left out: it would alias. One whose amplitude falls below `floor` (output
    units; 120 dB below what is loud is a good choice) drops out, and so does the cost of the modes behind the last
    that sounds: list slow decays first.
    """
    modes = frequencies_hz.size
    row = padded(modes)
    t[:] = 0.0
    t[0] = modes
    t[1] = floor * floor
    phasors = t[_ROWS:]
    table, waves = _tables(t)
    for m in range(modes):
        if frequencies_hz[m] < 0.5 * rate_hz:
            tabulate(table, row, waves, m, frequencies_hz[m], decays_per_s[m], rate_hz)
            phasors[m] = amplitudes[m]
    free_block(t[_OUTPUT:_ROWS], table, row, waves, phasors, row)
    for m in range(modes):
        phasors[m] = amplitudes[m] if frequencies_hz[m] < 0.5 * rate_hz else 0.0


@kernel
def ring(s, t, events, count, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`; one struck by 1 adds sum a exp(-b t) sin(2 pi f t).

    `events` is flat, (time, strength, duration) for each of `count` events, in order of time; one acts from the
    frame that its time lies in. One before `frame` acts at once.
    """
    row = padded(int(t[0]))
    table, waves = _tables(t)
    block = s[_OUTPUT:_ROWS]
    phasors = s[_ROWS:]
    done = 0
    event = 0
    while done < n:
        start = (frame + done) % BLOCK
        length = min(BLOCK - start, n - done)
        struck = event < count and events[3 * event] < frame + done + length
        straight = length == BLOCK and not struck  # nothing is to be kept of this block
        if start == 0:
            if (frame + done) % _PATIENCE == 0:
                _drop(s, t)
            goal = out[done : done + BLOCK] if straight else block
            free_block(goal, table, row, waves, phasors, int(s[0]))
        while event < count and events[3 * event] < frame + done + length:
            at = int(math.floor(events[3 * event])) - (frame + done)
            _strike(s, t, table, start + max(at, 0), events[3 * event + 1])
            event += 1
        if not straight:
            for i in range(length):
                out[done + i] = block[start + i]
        done += length
        s[2] = (start + length) % BLOCK if s[0] > 0.0 else 0.0


@kernel
def rest(s, t):
    """An upper bound of |output| from here on, if nothing strikes again."""
    row = padded(int(t[0]))
    bound = 0.0
    if s[2] > 0.0:
        for i in range(_OUTPUT + int(s[2]), _ROWS):
            bound = max(bound, abs(s[i]))
    for m in range(_ROWS, _ROWS + int(s[0])):
        bound += math.sqrt(s[m] ** 2 + s[m + row] ** 2)
    return bound


@kernel
def _tables(t):
    """The powers of the poles, and their waves."""
    modes = int(t[0])
    table = _ROWS + PHASOR_ROWS * padded(modes)
    waves = table + TABLE_ROWS * padded(modes)
    return t[table:waves], t[waves : waves + waves_size(modes)]


@kernel
def _drop(s, t):
    """Set modes under the floor to exactly 0, unless events of late may still be building them up."""
    if s[1] == 0.0:
        row = padded(int(t[0]))
        last = 0
        for m in range(int(s[0])):
            x, y = _ROWS + m, _ROWS + row + m
            if s[x] * s[x] + s[y] * s[y] > t[1]:
                last = m + 1
            else:
                s[x] = s[y] = 0.0
        s[0] = in_use(last, row)
        if last == 0:
            s[_OUTPUT:] = 0.0
    s[1] = 0.0


@kernel
def _strike(s, t, table, at, strength):
    """Add an event at frame `at` of the block: the tabulated response, and its phasors at the block's end."""
    for i in range(BLOCK - at):
        s[_OUTPUT + at + i] += strength * t[_OUTPUT + i]
    modes = int(t[0])
    row = padded(modes)
    for m in range(modes):
        x, y = advanced(table, row, m, strength * t[_ROWS + m], 0.0, BLOCK - at)
        s[_ROWS + m] += x
        s[_ROWS + row + m] += y
    s[0] = row
    s[1] = 1.0
