"""Second-order sections whose coefficients may change while they run.

A section is the trapezoidal (bilinear, prewarped) state-variable filter. Its states x1 and x2 are those of the two
integrators of the analogue circuit

    x1' = w (u - k x1 - x2),   x2' = w x1,   g = tan(pi f / rate), k = 1 / Q

so a step of the coefficients never steps a state. Without input the trapezoidal rule gives
`x1+^2 + x2+^2 = x1^2 + x2^2 - 4 g k v1^2`, v the midpoint of old and new state: the energy cannot grow for any
g, k > 0, even if they change at every frame. This keeps a changing section stable, and gives the bound in `tail`.
"""

import math

from underfoot.clock import SPAN
from underfoot.kernels import Floats, copy, inlined, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.signals.glide import glided

STATE = Layout("section", "x1", "x2")
COEFFICIENTS = Layout("section_coefficients", "a1", "a2", "a3", "gain_input", "gain_x1", "gain_x2", "g", "k")
"""Coefficients of the recursion, the output gains of input, x1 and x2, then g and k."""

MOVING_STATE = Layout("moving_section", "mean", section=STATE, now=COEFFICIENTS)
"""State of a section whose coefficients change frame by frame, with the present coefficients, and the mean of the input
of a band-pass."""

BUTTERWORTH = math.sqrt(0.5)
"""Q of a maximally flat second-order low-pass or high-pass."""

LOWEST, HIGHEST = 1e-7, 0.49
"""Frequencies and widths are limited to these fractions of the rate."""
LEAST_Q, MOST_Q = 0.01, 1e4
"""Q is limited to these values."""
_MEAN_PACE = 1.0 / 512.0
"""Weight of a frame in the mean of the input, which has 11 ms at 48 kHz: long for what is felt, short for a load."""


@kernel
def design_low_pass(frequency_hz: float, q: float, rate: float, coefficients: Memory) -> None:
    """Design a low-pass with gain 1 at 0 Hz and gain q at `frequency_hz`.

    >>> import numpy as np
    >>> coefficients, state, signal = COEFFICIENTS.zeros(), STATE.zeros(), np.ones(4800)
    >>> design_low_pass(100.0, BUTTERWORTH, 48000.0, coefficients)
    >>> run(signal, coefficients, state, signal)
    >>> bool(abs(signal[-1] - 1.0) < 1e-6)
    True
    """
    design(_warped(frequency_hz, rate), 1.0 / _held(q, LEAST_Q, MOST_Q), 0.0, 0.0, 1.0, coefficients)


@kernel
def design_high_pass(frequency_hz: float, q: float, rate: float, coefficients: Memory) -> None:
    """Design a high-pass with gain 1 at half the rate and gain q at `frequency_hz`."""
    k = 1.0 / _held(q, LEAST_Q, MOST_Q)
    design(_warped(frequency_hz, rate), k, 1.0, -k, -1.0, coefficients)


@kernel
def design_band_pass(centre_hz: float, width_hz: float, rate: float, coefficients: Memory) -> None:
    """Design a band-pass with gain 1 at `centre_hz`, exactly `width_hz` wide at -3 dB.

    The width is prewarped too: `k g / (1 + g^2) = tan(pi width / rate)`, so it holds at any centre.
    """
    g = _warped(centre_hz, rate)
    k = _warped(width_hz, rate) * (1.0 + g * g) / g
    design(g, k, 0.0, k, 0.0, coefficients)


@kernel
def design(g: float, k: float, gain_input: float, gain_x1: float, gain_x2: float, coefficients: Memory) -> None:
    """Design any section, from g > 0, k > 0 and the output gains of input, x1 and x2."""
    coefficients.a1 = 1.0 / (1.0 + g * (g + k))
    coefficients.a2 = g * coefficients.a1
    coefficients.a3 = g * coefficients.a2
    coefficients.gain_input, coefficients.gain_x1, coefficients.gain_x2 = gain_input, gain_x1, gain_x2
    coefficients.g, coefficients.k = g, k


@kernel
def run(signal: Floats, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Filter `signal` into `out`; the two may be the same array."""
    section = _section(coefficients)
    x1, x2 = state.x1, state.x2
    for i in range(out.size):
        out[i], x1, x2 = _step(signal[i], section, x1, x2)
    state.x1, state.x2 = x1, x2


@kernel
def run_two(signal: Floats, first: Memory, second: Memory, states: tuple[Memory, Memory], out: Floats) -> None:
    """Filter `signal` by two sections, one after the other, into `out`, in little more time than by one."""
    one, two = _section(first), _section(second)
    x1, x2, z1, z2 = states[0].x1, states[0].x2, states[1].x1, states[1].x2
    for i in range(out.size):
        between, x1, x2 = _step(signal[i], one, x1, x2)
        out[i], z1, z2 = _step(between, two, z1, z2)
    states[0].x1, states[0].x2, states[1].x1, states[1].x2 = x1, x2, z1, z2


_Section = tuple[float, float, float, float, float, float]


@inlined
def _section(coefficients: Memory) -> _Section:
    """Return coefficients as `_step` takes them: in memory, they would be read in every frame."""
    c = coefficients
    return 2.0 * c.a1, 2.0 * c.a2, 2.0 * c.a3, c.gain_input, 0.5 * c.gain_x1, 0.5 * c.gain_x2


@inlined
def _step(u: float, section: _Section, x1: float, x2: float) -> tuple[float, float, float]:
    """Return the output for the input u, and the new states.

    It computes twice the midpoints v1 and v2, which is exact, and spares a multiplication from one state to the next.
    """
    a1, a2, a3, gain_input, gain_v1, gain_v2 = section
    rise = u - x2
    v1 = a1 * x1 + a2 * rise
    v2 = (2.0 * x2 + a2 * x1) + a3 * rise
    return gain_input * u + gain_v1 * v1 + gain_v2 * v2, v1 - x1, v2 - x2


@kernel
def run_moving(signal: Floats, coefficients: Memory, frame: int, state: Memory, out: Floats) -> None:
    """Filter as `run` does, from session frame `frame` on, with a `MOVING_STATE`: no jumps when coefficients change.

    g, g k and the gains move to their new values over a span, because steps of the gains would be steps of the output.
    """
    now, is_band = state.now, coefficients.gain_x1 == coefficients.k
    if now.k == 0.0:
        copy(coefficients.values, now.values)
    done = 0
    while done < out.size and not _same(now, coefficients):
        before = now.k
        _move(now, coefficients, frame + done)
        if is_band:
            _keep_level(state, before)
            _follow(signal[done : done + 1], state)
        run(signal[done : done + 1], now, state.section, out[done : done + 1])
        done += 1
    if is_band:
        _follow(signal[done:], state)
    run(signal[done:], coefficients, state.section, out[done:])


@kernel
def _move(now: Memory, c: Memory, frame: int) -> None:
    """Move the coefficients `now` by a frame; the bandwidth g k moves evenly, as k would make it wide on its way."""
    if (frame + 1) % SPAN == 0:
        copy(c.values, now.values)
        return
    g = glided(now.g, c.g, frame)
    k, gain_x1 = glided(now.g * now.k, c.g * c.k, frame) / g, glided(now.g * now.gain_x1, c.g * c.gain_x1, frame) / g
    gain_input, gain_x2 = glided(now.gain_input, c.gain_input, frame), glided(now.gain_x2, c.gain_x2, frame)
    design(g, k, gain_input, gain_x1, gain_x2, now)


@kernel
def _keep_level(state: Memory, before: float) -> None:
    """Keep the level of what rings in a band-pass as its gain k moves from `before`: as if k were before the filter.

    The mean of the input rests in x2, and does not ring: a foot that stands must not be felt when the band moves. Nor
    does what x2 holds beyond critical damping, k = 2.
    """
    section, k = state.section, state.now.k
    section.x1 *= before / k
    section.x2 = state.mean + (section.x2 - state.mean) * (min(before, 2.0) / min(k, 2.0))


@kernel
def _follow(signal: Floats, state: Memory) -> None:
    mean = state.mean
    for i in range(signal.size):
        mean += _MEAN_PACE * (signal[i] - mean)
    state.mean = mean


@kernel
def _same(a: Memory, b: Memory) -> bool:
    gains = a.gain_input == b.gain_input and a.gain_x1 == b.gain_x1 and a.gain_x2 == b.gain_x2
    return gains and a.g == b.g and a.k == b.k


@kernel
def tail_moving(state: Memory, coefficients: Memory) -> float:
    """Return the bound of `tail` for a `MOVING_STATE`."""
    return max(tail(state.section, coefficients), tail(state.section, state.now))


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return an upper bound of |output| from here on if all further input is zero.

    The midpoint v is no longer than the states it lies between, which never grow (see the module's docstring), so the
    Cauchy-Schwarz inequality bounds `gain_x1 v1 + gain_x2 v2`.
    """
    return math.hypot(coefficients.gain_x1, coefficients.gain_x2) * math.hypot(state.x1, state.x2)


@kernel
def _warped(frequency_hz: float, rate: float) -> float:
    return math.tan(math.pi * _held(frequency_hz / rate, LOWEST, HIGHEST))


@kernel
def _held(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)
