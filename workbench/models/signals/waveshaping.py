"""Harmonic tones by Chebyshev waveshaping (thesis 3.1, 3.2) with a drift-free phase, and their roughness.

The result is a sum of sines, phases included: `sum a_k sin(k th) = sin(th) sum a_k U_(k-1)(cos th)`, k from 1, without
DC. The printed `T_k(sin th)` has other phases and a DC term (docs/models.md#tones). The sum over U is Clenshaw's
recurrence: one sine, one cosine and N multiplications per frame, with the frames of a span in parallel.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers
from underfoot.errors import require
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory

PHASE = Layout("phase", "high", "low")
"""Phase and its rounding remainder, in Hz times frames."""
LANES = 32
"""Frames that `run` processes in parallel, a span."""
STATE = Layout("tone", phase=PHASE, sine=LANES, twice_cosine=LANES, sum=LANES, before=LANES, pitch=LANES)
"""The phase, and working memory whose contents are not kept between calls."""


def tone(f0_hz: float, amplitudes: ArrayLike, seconds: float, rate: float) -> NDArray[np.float64]:
    """Return a tone of `round(seconds * rate)` frames: `sum a_k sin(2 pi k f0 t)`, k = 1 ... len(amplitudes), t from 0.

    Harmonics at or above half the rate are left out. Raises `BadValue` for f0_hz or rate not above 0, seconds
    below 0, and amplitudes that are not a row of finite numbers.

    >>> tone(50.0, [1.0], 0.02, 400.0).round(3)[:3]
    array([0.   , 0.707, 1.   ])
    """
    f0_hz = number("f0_hz", f0_hz, TINY, HUGE, "above 0 Hz")
    rate = number("rate", rate, TINY, HUGE, "above 0 Hz")
    number("seconds", seconds, 0.0, 2**31 / rate, f"0 to {2**31 / rate:.6g} s at this rate: 2^31 frames")
    weights = numbers("amplitudes", amplitudes)
    require(weights.size > 0, "amplitudes", amplitudes, "a row of at least one number")
    signal = np.empty(round(float(seconds) * rate))
    run(np.array([f0_hz]), weights, rate, STATE.zeros(), signal)
    return signal


def peak_bound(amplitudes: ArrayLike) -> float:
    """Return a bound of the samples of a tone, `sum |a_k|`.

    >>> peak_bound([1.0, -0.5])
    1.5
    """
    return float(np.abs(amplitudes).sum())


@kernel
def run(f0_hz: Floats, amplitudes: Floats, rate: float, state: Memory, out: Floats) -> None:
    """Fill `out` with the tone and advance the phase (a zero state starts at phase 0).

    `f0_hz` holds one value for the whole stretch or one per frame; the phase is its running sum.
    `amplitudes` are a_1, a_2, ... With |f0| at or above half the rate the output is 0 and the phase stands still.
    """
    moves = 1 if f0_hz.size > 1 else 0
    phase, sine, pitch, total = state.phase, state.sine, state.pitch, state.sum
    high, low, per_rate = phase.high, phase.low, 1.0 / rate
    for first in range(0, out.size, LANES):
        count = min(LANES, out.size - first)
        for j in range(count):
            f0 = f0_hz[(first + j) * moves]
            pitch[j] = abs(f0)
            sine[j] = (high + low) * per_rate
            high, low = next_phase(high, low, f0, rate)
        _sum_harmonics(state, amplitudes, 0.5 * rate)
        for j in range(count):
            out[first + j] = sine[j] * total[j]
    phase.high, phase.low = high, low


@kernel
def _sum_harmonics(work: Memory, amplitudes: Floats, half: float) -> None:
    """From the phases in `sine`, compute the sines there, and the sum over U in `sum`, for all lanes in parallel.

    Every lane is computed, used or not, so that loops have constant length and are vectorised.
    """
    sines, twice, total, before, pitch = work.sine, work.twice_cosine, work.sum, work.before, work.pitch
    for j in range(LANES):
        sine, cosine = sin_cos(sines[j])
        sines[j] = sine
        twice[j] = 2.0 * cosine
        total[j] = before[j] = 0.0
    n = amplitudes.size
    for k in range(n + n % 2, 0, -2):
        upper = amplitudes[k - 1] if k <= n else 0.0
        lower = amplitudes[k - 2]
        for j in range(LANES):
            heard = upper if k * pitch[j] < half else 0.0
            b = heard + twice[j] * total[j] - before[j]
            heard = lower if (k - 1) * pitch[j] < half else 0.0
            total[j] = heard + twice[j] * b - total[j]
            before[j] = b


@kernel
def roughen(signal: Floats, depth: Floats, frequency_hz: Floats, rate: float, phase: Memory, out: Floats) -> None:
    """Multiply `signal` by `1 + m sin(2 pi f_r t)` into `out`, another array.

    `depth` (m) and `frequency_hz` (f_r; thesis: 25 Hz) each hold one value for the stretch or one per frame; `phase` is
    that of the modulation.
    """
    deepens = 1 if depth.size > 1 else 0
    moves = 1 if frequency_hz.size > 1 else 0
    high, low, per_rate = phase.high, phase.low, 1.0 / rate
    for i in range(out.size):
        out[i] = (high + low) * per_rate
        high, low = next_phase(high, low, frequency_hz[i * moves], rate)
    phase.high, phase.low = high, low
    for i in range(out.size):  # apart from the phases, each of which needs the one before, sines are vectorised
        sine, _ = sin_cos(out[i])
        out[i] = signal[i] * (1.0 + depth[i * deepens] * sine)


@kernel
def next_phase(high: float, low: float, frequency_hz: float, rate: float) -> tuple[float, float]:
    """Return the phase one frame later, as `high + low` within half a rate of 0, in Hz times frames (a turn is `rate`).

    Frequencies are summed undivided, and the rounding error of each addition is kept in `low`; a full turn is
    subtracted where that is exact. So a constant frequency does not drift.
    """
    half = 0.5 * rate
    if not abs(frequency_hz) < half:
        return high, low
    total = high + frequency_hz
    part = total - high
    low += (high - (total - part)) + (frequency_hz - part)
    if abs(total) >= half:
        total -= math.copysign(rate, total)
        high = total + low
        return high, low - (high - total)
    return total, low


@kernel
def sin_cos(turns: float) -> tuple[float, float]:
    """Return sine and cosine of `2 pi turns`, |turns| at most 1: Taylor series on an eighth of a turn, within 3e-16.

    >>> sin_cos(0.5)[1]
    -1.0
    """
    quarter = np.floor(4.0 * turns + 0.5)  # `math.floor` gives integers of 64 bits, which are converted one by one
    x = 2.0 * math.pi * (turns - 0.25 * quarter)
    z = x * x
    sine = -1.0 / 1307674368000.0
    sine = 1.0 / 6227020800.0 + z * sine
    sine = -1.0 / 39916800.0 + z * sine
    sine = 1.0 / 362880.0 + z * sine
    sine = -1.0 / 5040.0 + z * sine
    sine = 1.0 / 120.0 + z * sine
    sine = -1.0 / 6.0 + z * sine
    sine = x + x * z * sine
    cosine = 1.0 / 20922789888000.0
    cosine = -1.0 / 87178291200.0 + z * cosine
    cosine = 1.0 / 479001600.0 + z * cosine
    cosine = -1.0 / 3628800.0 + z * cosine
    cosine = 1.0 / 40320.0 + z * cosine
    cosine = -1.0 / 720.0 + z * cosine
    cosine = 1.0 / 24.0 + z * cosine
    cosine = -0.5 + z * cosine
    cosine = 1.0 + z * cosine
    which = np.int32(quarter) & 3
    if which & 1:
        sine, cosine = cosine, -sine
    if which & 2:
        sine, cosine = -sine, -cosine
    return sine, cosine
