"""A modal bank struck by events (equation 3.4): free ringing by phasors, 64 frames at a time, one row of real time.

Between events a mode is a turning, shrinking phasor, so 64 frames are a short table times the phasors at their
start, and their end is one complex product away: nothing drifts. Blocks lie at multiples of 64 session frames,
whatever the calls. An event adds its response, tabulated once, to the rest of its block, and its exact share to the
phasors at the block's end; hence the same bits however the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous:
`s` holds the block's output and the phasors at its end; `t` the response to an event and the modes' tables.
"""

import math

from workbench.kernels import kernel

BLOCK = 64
_PATIENCE = 8 * BLOCK  # how often modes that fell below the floor are looked for
_OUTPUT = 8  # before it, in s: modes in use, events of late; in t: modes, floor squared
_MODES = _OUTPUT + BLOCK  # in s: real and imaginary parts; in t: a table a mode:
_STEPS = 16  # powers 0 to 15 of its pole, real parts, then imaginary parts, then
_P16, _P64, _AMPLITUDE = 32, 34, 36
_TABLE = 40


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
    return _MODES + (_TABLE + 2) * modes


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
    for m in range(modes):
        if frequencies_hz[m] < 0.5 * rate_hz:
            _tabulate(t, _MODES + _TABLE * m, frequencies_hz[m], decays_per_s[m], rate_hz)
            t[_MODES + _TABLE * m + _AMPLITUDE] = amplitudes[m]
            t[_MODES + _TABLE * modes + 2 * m] = amplitudes[m]
    _free_block(t[_OUTPUT:_MODES], t, t[_MODES + _TABLE * modes :], modes)


@kernel
def ring(s, t, events, count, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`; one struck by 1 adds sum a exp(-b t) sin(2 pi f t).

    `events` is flat, (time, strength, duration) for each of `count` events, in order of time; one acts from the
    frame that its time lies in. One before `frame` acts at once.
    """
    done = 0
    event = 0
    while done < n:
        start = (frame + done) % BLOCK
        if start == 0:
            if (frame + done) % _PATIENCE == 0:
                _drop(s, t)
            _free_block(s[_OUTPUT:_MODES], t, s[_MODES:], int(s[0]))
        length = min(BLOCK - start, n - done)
        while event < count and events[3 * event] < frame + done + length:
            at = int(math.floor(events[3 * event])) - (frame + done)
            _strike(s, t, start + max(at, 0), events[3 * event + 1])
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
def _tabulate(t, o, frequency_hz, decay_per_s, rate_hz):
    """Write the powers of a mode's pole at `t[o]`."""
    size = math.exp(-decay_per_s / rate_hz)
    angle = 2.0 * math.pi * (frequency_hz / rate_hz)
    a, b = size * math.cos(angle), size * math.sin(angle)
    x, y = 1.0, 0.0
    for k in range(_STEPS):
        t[o + k], t[o + _STEPS + k] = x, y
        x, y = x * a - y * b, y * a + x * b
    t[o + _P16], t[o + _P16 + 1] = x, y
    # From block to block errors would add up, so this power is its own, of an angle reduced exactly.
    size = math.exp(-decay_per_s * BLOCK / rate_hz)
    angle = 2.0 * math.pi * (frequency_hz * BLOCK % rate_hz / rate_hz)
    t[o + _P64], t[o + _P64 + 1] = size * math.cos(angle), size * math.sin(angle)


@kernel
def _free_block(block, t, phasors, modes):
    """Fill `block` with the free ringing of the first `modes` modes, and move their phasors to its end.

    Four phasors, 16 frames apart, share a table of 16 powers; the inner loop runs over frames.
    """
    block[:] = 0.0
    for m in range(modes):
        o = _MODES + _TABLE * m
        x, y = phasors[2 * m], phasors[2 * m + 1]
        a, b = t[o + _P16], t[o + _P16 + 1]
        x1, y1 = x * a - y * b, y * a + x * b
        x2, y2 = x1 * a - y1 * b, y1 * a + x1 * b
        x3, y3 = x2 * a - y2 * b, y2 * a + x2 * b
        for k in range(_STEPS):
            c, d = t[o + k], t[o + _STEPS + k]
            block[k] = (block[k] + y * c) + x * d
            block[k + 16] = (block[k + 16] + y1 * c) + x1 * d
            block[k + 32] = (block[k + 32] + y2 * c) + x2 * d
            block[k + 48] = (block[k + 48] + y3 * c) + x3 * d
        a, b = t[o + _P64], t[o + _P64 + 1]
        phasors[2 * m], phasors[2 * m + 1] = x * a - y * b, y * a + x * b


@kernel
def _advanced(t, o, x, y, frames):
    """The phasor x + iy after 0 to 64 `frames`."""
    a, b = t[o + _P16], t[o + _P16 + 1]
    for _ in range(frames // _STEPS):
        x, y = x * a - y * b, y * a + x * b
    a, b = t[o + frames % _STEPS], t[o + _STEPS + frames % _STEPS]
    return x * a - y * b, y * a + x * b


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
def _strike(s, t, at, strength):
    """Add an event at frame `at` of the block: the tabulated response, and its phasors at the block's end."""
    for i in range(BLOCK - at):
        s[_OUTPUT + at + i] += strength * t[_OUTPUT + i]
    for m in range(int(t[0])):
        o = _MODES + _TABLE * m
        x, y = _advanced(t, o, strength * t[o + _AMPLITUDE], 0.0, BLOCK - at)
        s[_MODES + 2 * m] += x
        s[_MODES + 2 * m + 1] += y
    s[0] = t[0]
    s[1] = 1.0
