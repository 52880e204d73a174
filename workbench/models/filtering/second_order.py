"""Second-order sections and a DC block whose coefficients may move while they run.

A section is the trapezoidal (bilinear, prewarped) state-variable filter. Its states x1 and x2 are those of the two
integrators of the analogue circuit

    x1' = w (u - k x1 - x2),   x2' = w x1,   g = tan(pi f / rate), k = 1 / Q

so a step of the coefficients never steps a state. With no input the trapezoidal rule gives
`x1+^2 + x2+^2 = x1^2 + x2^2 - 4 g k v1^2`, v the midpoint of old and new state: the energy cannot grow for any
g, k > 0, even if they change at every frame. This keeps a moving section stable, and it is the bound that `rest` gives.
"""

import math

from underfoot.kernels import kernel

SECTION_STATE = 2
"""Floats of dynamic state a section needs."""
SECTION_TUNING = 8
"""Floats of tuning a section needs: a1, a2, a3, the gains of input, x1 and x2 in the output, then g and k."""
DC_BLOCK_STATE = 1
"""Floats of dynamic state a DC block needs."""
DC_BLOCK_TUNING = 2
"""Floats of tuning a DC block needs."""

BUTTERWORTH = math.sqrt(0.5)
"""The Q of a maximally flat second-order low-pass or high-pass."""

LOWEST, HIGHEST = 1e-7, 0.49
"""Frequencies and widths are held within these fractions of the rate."""
LEAST_Q, MOST_Q = 0.01, 1e4
"""Q is held within these."""


@kernel
def tune_low_pass(t, frequency_hz, q, rate):
    """Fill `t` (SECTION_TUNING) for a low-pass of gain 1 at 0 Hz and q at `frequency_hz`.

    >>> import numpy as np
    >>> t, s, y = np.zeros(SECTION_TUNING), np.zeros(SECTION_STATE), np.ones(4800)
    >>> tune_low_pass(t, 100.0, BUTTERWORTH, 48000.0)
    >>> run(s, t, y, y, 4800)
    >>> bool(abs(y[-1] - 1.0) < 1e-6)
    True
    """
    tune_section(t, _warped(frequency_hz, rate), 1.0 / _held(q, LEAST_Q, MOST_Q), 0.0, 0.0, 1.0)


@kernel
def tune_high_pass(t, frequency_hz, q, rate):
    """Fill `t` (SECTION_TUNING) for a high-pass of gain 1 at half the rate and q at `frequency_hz`."""
    k = 1.0 / _held(q, LEAST_Q, MOST_Q)
    tune_section(t, _warped(frequency_hz, rate), k, 1.0, -k, -1.0)


@kernel
def tune_band_pass(t, centre_hz, width_hz, rate):
    """Fill `t` (SECTION_TUNING) for a band-pass of gain 1 at `centre_hz`, exactly `width_hz` wide at -3 dB.

    The width is prewarped too: `k g / (1 + g^2) = tan(pi width / rate)`, so it holds at any centre.
    """
    g = _warped(centre_hz, rate)
    k = _warped(width_hz, rate) * (1.0 + g * g) / g
    tune_section(t, g, k, 0.0, k, 0.0)


@kernel
def tune_section(t, g, k, gain_input, gain_x1, gain_x2):
    """Fill `t` (SECTION_TUNING) from g > 0, k > 0 and the gains of input, x1 and x2 in the output."""
    t[0] = 1.0 / (1.0 + g * (g + k))
    t[1] = g * t[0]
    t[2] = g * t[1]
    t[3], t[4], t[5] = gain_input, gain_x1, gain_x2
    t[6], t[7] = g, k


@kernel
def run(s, t, x, y, n):
    """Filter `n` frames of `x` into `y` (they may be the same array); `s` is the section's state, `t` its tuning."""
    a1, a2, a3, gain_input, gain_x1, gain_x2 = t[0], t[1], t[2], t[3], t[4], t[5]
    x1, x2 = s[0], s[1]
    for i in range(n):
        u = x[i]
        rise = u - x2
        v1 = a1 * x1 + a2 * rise
        v2 = x2 + a2 * x1 + a3 * rise
        x1 = 2.0 * v1 - x1
        x2 = 2.0 * v2 - x2
        y[i] = gain_input * u + gain_x1 * v1 + gain_x2 * v2
    s[0], s[1] = x1, x2


@kernel
def rest(s, t):
    """An upper bound of |output| from here on if all further input is zero.

    The midpoint v is no longer than the states it lies between, and those never grow (see the module's head), so
    Cauchy and Schwarz bound `gain_x1 v1 + gain_x2 v2`.
    """
    return math.hypot(t[4], t[5]) * math.hypot(s[0], s[1])


@kernel
def tune_dc_block(t, frequency_hz, rate):
    """Fill `t` (DC_BLOCK_TUNING) for a first-order high-pass, -3 dB at `frequency_hz` and exactly 0 at 0 Hz."""
    g = _warped(frequency_hz, rate)
    t[0] = g / (1.0 + g)
    t[1] = 1.0 / (1.0 + g)


@kernel
def run_dc_block(s, t, x, y, n):
    """Take the DC off `n` frames of `x` into `y` (they may be the same array).

    >>> import numpy as np
    >>> t, s, y = np.zeros(DC_BLOCK_TUNING), np.zeros(DC_BLOCK_STATE), np.ones(48000)
    >>> tune_dc_block(t, 5.0, 48000.0)
    >>> run_dc_block(s, t, y, y, 48000)
    >>> bool(abs(y[-1]) < 1e-12)
    True
    """
    share, state = t[0], s[0]
    for i in range(n):
        u = x[i]
        move = share * (u - state)
        slow = state + move
        state = slow + move
        y[i] = u - slow
    s[0] = state


@kernel
def rest_dc_block(s, t):
    """The largest |output| from here on if all further input is zero: that of the next frame."""
    return t[1] * abs(s[0])


@kernel
def _warped(frequency_hz, rate):
    return math.tan(math.pi * _held(frequency_hz / rate, LOWEST, HIGHEST))


@kernel
def _held(value, low, high):
    return min(max(value, low), high)
