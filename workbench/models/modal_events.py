"""A modal bank struck by events (equation 3.4): free ringing 64 frames at a time, one row of real time.

Blocks lie at multiples of 64 session frames, whatever the calls. An event adds its response, tabulated once, to the
rest of its block, and its exact share to the phasors at the block's end; hence the same bits however the frames are
split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous: `s` holds the block's output
and the phasors at its end; `t` the response to an event of strength 1 and the modes' tables.
"""

import math

from workbench.kernels import kernel
from workbench.models.modal_phasors import BLOCK, OWN, TABLE, advanced, free_block, tabulate

_PATIENCE = 8 * BLOCK  # how often modes that fell below the floor are looked for
_OUTPUT = 8  # before it, in s: modes in use, events of late; in t: modes, floor squared
_MODES = _OUTPUT + BLOCK  # in s: phasors; in t: tables, which own the amplitude, then phasors to work with


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    92
    """
    return _MODES + 2 * modes


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    492
    """
    return _MODES + (TABLE + 2) * modes


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
    table = t[_MODES:]
    phasors = t[_MODES + TABLE * modes :]
    for m in range(modes):
        if frequencies_hz[m] < 0.5 * rate_hz:
            tabulate(table, TABLE * m, frequencies_hz[m], decays_per_s[m], rate_hz)
            table[TABLE * m + OWN] = phasors[2 * m] = amplitudes[m]
    free_block(t[_OUTPUT:_MODES], table, phasors, modes)


@kernel
def ring(s, t, events, count, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`; one struck by 1 adds sum a exp(-b t) sin(2 pi f t).

    `events` is flat, (time, strength, duration) for each of `count` events, in order of time; one acts from the
    frame that its time lies in. One before `frame` acts at once.
    """
    table = t[_MODES:]
    done = 0
    event = 0
    while done < n:
        start = (frame + done) % BLOCK
        if start == 0:
            if (frame + done) % _PATIENCE == 0:
                _drop(s, t)
            free_block(s[_OUTPUT:_MODES], table, s[_MODES:], int(s[0]))
        length = min(BLOCK - start, n - done)
        while event < count and events[3 * event] < frame + done + length:
            at = int(math.floor(events[3 * event])) - (frame + done)
            _strike(s, t, table, start + max(at, 0), events[3 * event + 1])
            event += 1
        for i in range(length):
            out[done + i] = s[_OUTPUT + start + i]
        done += length


@kernel
def rest(s, t):
    """An upper bound of |output| from here on, if nothing strikes again."""
    bound = 0.0
    for i in range(_OUTPUT, _MODES):
        bound = max(bound, abs(s[i]))
    for m in range(int(s[0])):
        bound += math.hypot(s[_MODES + 2 * m], s[_MODES + 2 * m + 1])
    return bound


@kernel
def _drop(s, t):
    """Set modes under the floor to exactly 0, unless events of late may still be building them up."""
    if s[1] == 0.0:
        last = 0
        for m in range(int(s[0])):
            x, y = s[_MODES + 2 * m], s[_MODES + 2 * m + 1]
            if x * x + y * y > t[1]:
                last = m + 1
            else:
                s[_MODES + 2 * m] = s[_MODES + 2 * m + 1] = 0.0
        s[0] = last
    s[1] = 0.0


@kernel
def _strike(s, t, table, at, strength):
    """Add an event at frame `at` of the block: the tabulated response, and its phasors at the block's end."""
    for i in range(BLOCK - at):
        s[_OUTPUT + at + i] += strength * t[_OUTPUT + i]
    for m in range(int(t[0])):
        x, y = advanced(table, TABLE * m, strength * table[TABLE * m + OWN], 0.0, BLOCK - at)
        s[_MODES + 2 * m] += x
        s[_MODES + 2 * m + 1] += y
    s[0] = t[0]
    s[1] = 1.0
