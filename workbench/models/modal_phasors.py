"""Free ringing by phasors: a block of 64 frames is a short table times the phasors at its start.

A phasor is (x, y), its mode's output y: a flat array holds x and y of one mode after the other. The table holds for
each mode powers of its pole p = exp((-b + 2 pi i f) / rate). The block's end is one product with p^64 away, so that
nothing drifts: 1e-11 after 10 s.
"""

import math

from workbench.kernels import kernel

BLOCK = 64
TABLE = 40
"""Floats a mode in the table: 16 powers, real and imaginary parts, p^16, p^64, and four for the table's owner."""

_STEPS = 16
_P16, _P64 = 32, 34
OWN = 36


@kernel
def tabulate(table, o, frequency_hz, decay_per_s, rate_hz):
    """Write the powers of a mode's pole at `table[o]`."""
    size = math.exp(-decay_per_s / rate_hz)
    angle = 2.0 * math.pi * (frequency_hz / rate_hz)
    a, b = size * math.cos(angle), size * math.sin(angle)
    x, y = 1.0, 0.0
    for k in range(_STEPS):
        table[o + k], table[o + _STEPS + k] = x, y
        x, y = x * a - y * b, y * a + x * b
    table[o + _P16], table[o + _P16 + 1] = x, y
    # From block to block errors would add up, so this power is its own, of an angle reduced exactly.
    size = math.exp(-decay_per_s * BLOCK / rate_hz)
    angle = 2.0 * math.pi * (frequency_hz * BLOCK % rate_hz / rate_hz)
    table[o + _P64], table[o + _P64 + 1] = size * math.cos(angle), size * math.sin(angle)


@kernel
def free_block(block, table, phasors, modes):
    """Fill `block` with the free ringing of the first `modes` modes, and move their phasors to its end.

    Four phasors, 16 frames apart, share a table of 16 powers; the inner loop runs over frames.
    """
    block[:] = 0.0
    for m in range(modes):
        o = TABLE * m
        x, y = phasors[2 * m], phasors[2 * m + 1]
        a, b = table[o + _P16], table[o + _P16 + 1]
        x1, y1 = x * a - y * b, y * a + x * b
        x2, y2 = x1 * a - y1 * b, y1 * a + x1 * b
        x3, y3 = x2 * a - y2 * b, y2 * a + x2 * b
        for k in range(_STEPS):
            c, d = table[o + k], table[o + _STEPS + k]
            block[k] = (block[k] + y * c) + x * d
            block[k + 16] = (block[k + 16] + y1 * c) + x1 * d
            block[k + 32] = (block[k + 32] + y2 * c) + x2 * d
            block[k + 48] = (block[k + 48] + y3 * c) + x3 * d
        a, b = table[o + _P64], table[o + _P64 + 1]
        phasors[2 * m], phasors[2 * m + 1] = x * a - y * b, y * a + x * b


@kernel
def advanced(table, o, x, y, frames):
    """The phasor (x, y) after 0 to 64 `frames`, its mode's table at `table[o]`."""
    if frames == BLOCK:
        a, b = table[o + _P64], table[o + _P64 + 1]
        return x * a - y * b, y * a + x * b
    a, b = table[o + _P16], table[o + _P16 + 1]
    for _ in range(frames // _STEPS):
        x, y = x * a - y * b, y * a + x * b
    a, b = table[o + frames % _STEPS], table[o + _STEPS + frames % _STEPS]
    return x * a - y * b, y * a + x * b
