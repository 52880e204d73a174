"""Free ringing by phasors: 64 frames are a short table times the phasors at their start.

A phasor is (x, y), its mode's output y. Each frame multiplies it by the pole p = exp((-b + 2 pi i f) / rate). The inner
loops run over modes, whose numbers lie in rows, padded so that loops have no remainder. For few modes they run over
frames instead, with all powers of the poles tabulated, because adding up the lanes of a vector would cost more than the
modes. The end of 64 frames is a single product with p^64: no drift, 1e-11 after 10 s.
"""

import math

from underfoot.kernels import Floats, inlined, kernel, modal_kernel, widest
from underfoot.lanes import all_four, four, put
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES

BLOCK = 64

FEW = 16
"""Largest row in which each mode has its `waves`, 1 KB; more would not stay in the cache."""

_EXPONENTS = (1, 2, 3, 4, 16, 64)

POWERS = Layout(
    "powers",
    **{f"p{n}_{part}": ("row",) for n in _EXPONENTS for part in ("re", "im")},
    waves=("wave_values",),
)
"""Powers 1, 2, 3, 4, 16 and 64 of the poles: a row of real and one of imaginary parts each. `waves`, for few modes, are
64 powers of each pole: the real parts, then the imaginary parts of a mode."""

PHASORS = Layout("phasors", re=("row",), im=("row",), work_re=("row",), work_im=("row",))
"""x and y of each mode, and two rows of working memory."""


@kernel
def padded(modes: int) -> int:
    """Return the length of a row: a multiple of what the inner loops process at a time.

    >>> padded(10), padded(20)
    (12, 24)
    """
    return (modes + 3) // 4 * 4 if modes <= FEW else (modes + 7) // 8 * 8


@kernel
def in_use(last: int, row: int) -> int:
    """Return how many modes of a row to process, so that the first `last` are included.

    >>> in_use(3, 12), in_use(9, 12), in_use(9, 200)
    (8, 12, 16)
    """
    return min((last + 7) // 8 * 8, row)


def sizes(modes: int) -> dict[str, int]:
    """Return the memory sizes for `modes` modes.

    >>> sizes(10), sizes(17)
    ({'row': 12, 'wave_values': 1536}, {'row': 24, 'wave_values': 0})
    """
    row = padded(modes)
    return {"row": row, "wave_values": 2 * BLOCK * row if modes <= FEW else 0}


@kernel
def tabulate(powers: Memory, m: int, frequency_hz: float, decay_per_s: float, rate_hz: float) -> None:
    """Write the powers of the pole of mode `m`.

    Each is computed from an exactly reduced angle: rounding errors of a power would recur every 64 frames.
    """
    powers.p1_re[m], powers.p1_im[m] = _power(1, frequency_hz, decay_per_s, rate_hz)
    powers.p2_re[m], powers.p2_im[m] = _power(2, frequency_hz, decay_per_s, rate_hz)
    powers.p3_re[m], powers.p3_im[m] = _power(3, frequency_hz, decay_per_s, rate_hz)
    powers.p4_re[m], powers.p4_im[m] = _power(4, frequency_hz, decay_per_s, rate_hz)
    powers.p16_re[m], powers.p16_im[m] = _power(16, frequency_hz, decay_per_s, rate_hz)
    powers.p64_re[m], powers.p64_im[m] = _power(64, frequency_hz, decay_per_s, rate_hz)
    waves = powers.waves
    if waves.size > 0:
        re, im = waves[2 * BLOCK * m : 2 * BLOCK * m + BLOCK], waves[2 * BLOCK * m + BLOCK : 2 * BLOCK * (m + 1)]
        re[0], im[0] = 1.0, 0.0
        x, y = powers.p1_re[m], powers.p1_im[m]
        known = 1
        while known < BLOCK:
            for k in range(known):
                re[known + k] = x * re[k] - y * im[k]
                im[known + k] = x * im[k] + y * re[k]
            x, y = x * x - y * y, 2.0 * x * y
            known *= 2


@kernel
def _power(exponent: int, frequency_hz: float, decay_per_s: float, rate_hz: float) -> tuple[float, float]:
    size = math.exp(-decay_per_s * exponent / rate_hz)
    angle = 2.0 * math.pi * (frequency_hz * exponent % rate_hz / rate_hz)
    return size * math.cos(angle), size * math.sin(angle)


@kernel
def free_block(block: Floats, powers: Memory, phasors: Memory, active: int) -> None:
    """Fill `block` with the free ringing of the first `active` modes, and advance their phasors to its end.

    `active` comes from `in_use` or `padded`.
    """
    widest()
    if powers.waves.size > 0:
        _few(block, powers, phasors, active)
    else:
        _many(block, powers, phasors, active)


@modal_kernel
def _few(block: Floats, powers: Memory, phasors: Memory, active: int) -> None:
    """Process four modes at a time, frames innermost."""
    widest()
    x, y = phasors.re[:active], phasors.im[:active]
    p64, q64 = powers.p64_re[:active], powers.p64_im[:active]
    waves = powers.waves
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
    for m in range(0, active, LANES):
        r, i = four(x, m), four(y, m)
        put(x, m, r * four(p64, m) - i * four(q64, m))
        put(y, m, i * four(p64, m) + r * four(q64, m))


@modal_kernel
def _many(block: Floats, powers: Memory, phasors: Memory, active: int) -> None:
    """Keep sixteen sums at a time in registers: four phasors, four frames apart, times three tabulated powers."""
    widest()
    p1, q1, p2, q2 = powers.p1_re[:active], powers.p1_im[:active], powers.p2_re[:active], powers.p2_im[:active]
    p3, q3, p4, q4 = powers.p3_re[:active], powers.p3_im[:active], powers.p4_re[:active], powers.p4_im[:active]
    p64, q64 = powers.p64_re[:active], powers.p64_im[:active]
    x, y = phasors.re[:active], phasors.im[:active]
    u, v = phasors.work_re[:active], phasors.work_im[:active]
    for m in range(0, active, LANES):
        r, i = four(x, m), four(y, m)
        put(u, m, r)
        put(v, m, i)
        put(x, m, r * four(p64, m) - i * four(q64, m))
        put(y, m, i * four(p64, m) + r * four(q64, m))
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
def advance_phasors(begin: Memory, powers: Memory, frames: int, active: int, goal: Memory) -> None:
    """Write the first `active` phasors of `begin`, after 0 to 64 `frames`, to `goal`."""
    for m in range(0, active, LANES):
        x, y = _advanced(powers, m, four(begin.re, m), four(begin.im, m), frames)
        put(goal.re, m, x)
        put(goal.im, m, y)


@kernel
def add_advanced(powers: Memory, amplitudes: Memory, strength: float, frames: int, phasors: Memory) -> None:
    """Add the phasors `strength` times `amplitudes.re`, after 0 to 64 `frames`, to `phasors`."""
    for m in range(0, phasors.row, LANES):
        x, y = _advanced(powers, m, all_four(strength) * four(amplitudes.re, m), all_four(0.0), frames)
        put(phasors.re, m, four(phasors.re, m) + x)
        put(phasors.im, m, four(phasors.im, m) + y)


@inlined
def _advanced(powers: Memory, m: int, x: Floats, y: Floats, frames: int) -> tuple[Floats, Floats]:
    """Return four phasors (x, y), from mode `m` on, after 0 to 64 `frames`."""
    if frames == BLOCK:
        return _turn(powers.p64_re, powers.p64_im, m, x, y)
    for _ in range(frames // 16):
        x, y = _turn(powers.p16_re, powers.p16_im, m, x, y)
    for _ in range(frames % 16 // 4):
        x, y = _turn(powers.p4_re, powers.p4_im, m, x, y)
    left = frames % 4
    if left == 1:
        x, y = _turn(powers.p1_re, powers.p1_im, m, x, y)
    elif left == 2:
        x, y = _turn(powers.p2_re, powers.p2_im, m, x, y)
    elif left == 3:
        x, y = _turn(powers.p3_re, powers.p3_im, m, x, y)
    return x, y


@inlined
def _turn(re: Floats, im: Floats, m: int, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    a, b = four(re, m), four(im, m)
    return x * a - y * b, y * a + x * b
