"""Free ringing by phasors: 64 frames are a short table times the phasors at their start.

A phasor is (x, y), its mode's output y. It turns and shrinks by the pole p = exp((-b + 2 pi i f) / rate) each frame.
The inner loops run over modes, whose numbers lie in rows; a row is padded so that loops have no remainder. Where modes
are few, they run over frames instead, for which all powers of the poles are tabulated: to add up the lanes of a vector
would cost more than the modes do. The end of 64 frames is one product with p^64 away: nothing drifts, 1e-11 after 10 s.
"""

import math

from underfoot.kernels import kernel, modal_kernel, widest

BLOCK = 64
TABLE_ROWS = 12
"""Powers 1, 2, 3, 4, 16 and 64 of the poles: a row of real parts, then one of imaginary parts, for each."""
PHASOR_ROWS = 4
"""x and y, and two rows to work with."""

FEW = 16
"""In a row of at most so many modes each has its `waves`, 1 KB; beyond, they would no longer stay in the cache."""

_EXPONENTS = (1, 2, 3, 4, 16, 64)
P64 = 10
"""The row of p^64."""


@kernel
def padded(modes):
    """The length of a row, a multiple of what the inner loops take at a time.

    >>> padded(10), padded(20)
    (12, 24)
    """
    return (modes + 3) // 4 * 4 if modes <= FEW else (modes + 7) // 8 * 8


@kernel
def in_use(last, row):
    """How many modes of a row to go through, so that the first `last` are among them.

    >>> in_use(3, 12), in_use(9, 12), in_use(9, 200)
    (8, 12, 16)
    """
    return min((last + 7) // 8 * 8, row)


@kernel
def waves_size(modes):
    """The floats of `waves`: 64 powers of each pole, real parts and then imaginary parts, where modes are few.

    >>> waves_size(10), waves_size(17)
    (1536, 0)
    """
    return 2 * BLOCK * padded(modes) if modes <= FEW else 0


@kernel
def tabulate(table, row, waves, m, frequency_hz, decay_per_s, rate_hz):
    """Write the powers of the pole of mode `m`.

    Of an angle reduced exactly, each: what rounding does to one power, the next 64 frames would do again.
    """
    for i in range(6):
        size = math.exp(-decay_per_s * _EXPONENTS[i] / rate_hz)
        angle = 2.0 * math.pi * (frequency_hz * _EXPONENTS[i] % rate_hz / rate_hz)
        table[2 * i * row + m] = size * math.cos(angle)
        table[(2 * i + 1) * row + m] = size * math.sin(angle)
    if waves.size > 0:
        re, im = waves[2 * BLOCK * m : 2 * BLOCK * m + BLOCK], waves[2 * BLOCK * m + BLOCK : 2 * BLOCK * (m + 1)]
        re[0], im[0] = 1.0, 0.0
        x, y = table[m], table[row + m]
        known = 1
        while known < BLOCK:
            for k in range(known):
                re[known + k] = x * re[k] - y * im[k]
                im[known + k] = x * im[k] + y * re[k]
            x, y = x * x - y * y, 2.0 * x * y
            known *= 2


@kernel
def free_block(block, table, row, waves, phasors, active):
    """Fill `block` with the free ringing of the first `active` modes, and move their phasors to its end.

    `active` is what `in_use` or `padded` gives.
    """
    widest()
    if waves.size > 0:
        _few(block, table, row, waves, phasors, active)
    else:
        _many(block, table, row, phasors, active)


@modal_kernel
def _few(block, table, row, waves, phasors, active):
    """Four modes at a time, frames innermost."""
    widest()
    x, y = phasors[:active], phasors[row : row + active]
    p64, q64 = table[10 * row : 10 * row + active], table[11 * row : 11 * row + active]
    for k in range(BLOCK):
        block[k] = 0.0
    for m in range(0, active, 4):
        w = waves[2 * BLOCK * m : 2 * BLOCK * (m + 4)]
        x0, x1, x2, x3 = x[m], x[m + 1], x[m + 2], x[m + 3]
        y0, y1, y2, y3 = y[m], y[m + 1], y[m + 2], y[m + 3]
        for k in range(BLOCK):
            block[k] += (y0 * w[k] + x0 * w[64 + k] + y1 * w[128 + k] + x1 * w[192 + k]) + (
                y2 * w[256 + k] + x2 * w[320 + k] + y3 * w[384 + k] + x3 * w[448 + k]
            )
    for m in range(active):
        r, i = x[m], y[m]
        x[m] = r * p64[m] - i * q64[m]
        y[m] = i * p64[m] + r * q64[m]


@modal_kernel
def _many(block, table, row, phasors, active):
    """Sixteen sums at a time stay in registers: four phasors, four frames apart, times three tabulated powers."""
    widest()
    p1, q1 = table[:active], table[row : row + active]
    p2, q2 = table[2 * row : 2 * row + active], table[3 * row : 3 * row + active]
    p3, q3 = table[4 * row : 4 * row + active], table[5 * row : 5 * row + active]
    p4, q4 = table[6 * row : 6 * row + active], table[7 * row : 7 * row + active]
    p64, q64 = table[10 * row : 10 * row + active], table[11 * row : 11 * row + active]
    x, y = phasors[:active], phasors[row : row + active]
    u, v = phasors[2 * row : 2 * row + active], phasors[3 * row : 3 * row + active]
    for m in range(active):
        r, i = x[m], y[m]
        u[m], v[m] = r, i
        x[m] = r * p64[m] - i * q64[m]
        y[m] = i * p64[m] + r * q64[m]
    for k in range(0, BLOCK, 16):
        a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = c0 = c1 = c2 = c3 = d0 = d1 = d2 = d3 = 0.0
        for m in range(active):
            r, i = u[m], v[m]
            a0 += i
            a1 += i * p1[m] + r * q1[m]
            a2 += i * p2[m] + r * q2[m]
            a3 += i * p3[m] + r * q3[m]
            r, i = r * p4[m] - i * q4[m], i * p4[m] + r * q4[m]
            b0 += i
            b1 += i * p1[m] + r * q1[m]
            b2 += i * p2[m] + r * q2[m]
            b3 += i * p3[m] + r * q3[m]
            r, i = r * p4[m] - i * q4[m], i * p4[m] + r * q4[m]
            c0 += i
            c1 += i * p1[m] + r * q1[m]
            c2 += i * p2[m] + r * q2[m]
            c3 += i * p3[m] + r * q3[m]
            r, i = r * p4[m] - i * q4[m], i * p4[m] + r * q4[m]
            d0 += i
            d1 += i * p1[m] + r * q1[m]
            d2 += i * p2[m] + r * q2[m]
            d3 += i * p3[m] + r * q3[m]
            u[m] = r * p4[m] - i * q4[m]
            v[m] = i * p4[m] + r * q4[m]
        block[k], block[k + 1], block[k + 2], block[k + 3] = a0, a1, a2, a3
        block[k + 4], block[k + 5], block[k + 6], block[k + 7] = b0, b1, b2, b3
        block[k + 8], block[k + 9], block[k + 10], block[k + 11] = c0, c1, c2, c3
        block[k + 12], block[k + 13], block[k + 14], block[k + 15] = d0, d1, d2, d3


@kernel
def advanced(table, row, m, x, y, frames):
    """The phasor (x, y) of mode `m` after 0 to 64 `frames`."""
    if frames == BLOCK:
        return _times(table, row, m, 10, x, y)
    for _ in range(frames // 16):
        x, y = _times(table, row, m, 8, x, y)
    for _ in range(frames % 16 // 4):
        x, y = _times(table, row, m, 6, x, y)
    if frames % 4 > 0:
        x, y = _times(table, row, m, 2 * (frames % 4 - 1), x, y)
    return x, y


@kernel
def _times(table, row, m, i, x, y):
    a, b = table[i * row + m], table[(i + 1) * row + m]
    return x * a - y * b, y * a + x * b
