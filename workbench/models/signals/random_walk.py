"""Ornstein-Uhlenbeck process, computed by position.

The value at a grid point follows from the stream's key and that point alone, so that sleep, block length and the first
frame read cannot change it. Points far apart are independent draws; between two known points the process is a bridge,
whose midpoint, h from both, is normal with

    mean (a + b) / (2 cosh(h / tau)),   variance sigma^2 tanh(h / tau),

which follows from its covariance sigma^2 exp(-|t| / tau). An interval of 2^21 points, halved 21 times, leads to any
point. This is exact in distribution, and each value is a smooth function of tau: the time constant may change.
"""

import math

from underfoot.clock import SPAN
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.signals.random import normal

LEVELS = 21
"""Number of halvings between independent points (23 minutes apart, at 48 kHz) and neighbours of the grid."""
LONGEST_S = 30.0
"""Longest time constant: the correlation of the farthest points is then e^-46 at 48 kHz, e^-12 at 192."""
STATE = Layout("random_walk", "at", "here", "there", "tau", point=(LEVELS + 1,), value=(LEVELS + 1,))
"""Last grid point passed (0: none, else its index plus one), values there and at the next point; per level the last
point drawn, counted likewise, and its value; and the time constant for which these hold."""
COEFFICIENTS = Layout("random_walk_coefficients", "tau", weight=(LEVELS + 1,), spread=(LEVELS + 1,))
"""Time constant; per level the factor on the sum of the ends, and the standard deviation of the midpoint."""


@kernel
def design(time_constant_s: float, rate: float, coefficients: Memory) -> None:
    """Design the bridges of a walk with unit standard deviation; grid points are a span apart."""
    coefficients.tau = time_constant_s
    for level in range(1, LEVELS + 1):
        apart = 2.0 ** (level - 1) * SPAN / (rate * time_constant_s)
        decay = math.exp(-apart)
        coefficients.weight[level] = decay / (1.0 + decay * decay)
        coefficients.spread[level] = math.sqrt(math.tanh(apart))


@kernel
def value_at(key: int, k: int, coefficients: Memory, state: Memory) -> float:
    """Return the walk at grid point `k`, from 0, in standard deviations. `state` caches points drawn before.

    >>> import numpy as np
    >>> coefficients = COEFFICIENTS.zeros()
    >>> design(1.0, 48000.0, coefficients)
    >>> state = STATE.zeros()
    >>> walked = [value_at(np.uint64(1), k, coefficients, state) for k in range(100)]
    >>> value_at(np.uint64(1), 77, coefficients, STATE.zeros()) == walked[77]
    True
    """
    low = k - k % (1 << LEVELS)
    before, after = normal(key, low), normal(key, low + (1 << LEVELS))
    for level in range(LEVELS, 0, -1):
        if k == low:
            return before
        half = 1 << (level - 1)
        middle = low + half
        if state.point[level] != middle + 1.0:
            state.point[level] = middle + 1.0
            drawn = coefficients.spread[level] * normal(key, middle)
            state.value[level] = coefficients.weight[level] * (before + after) + drawn
        if k >= middle:
            low, before = middle, state.value[level]
        else:
            after = state.value[level]
    return before


@kernel
def run(key: int, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Fill `out` with the walk, in standard deviations: exact at multiples of a span, linear between.

    >>> import numpy as np
    >>> coefficients, whole, half = COEFFICIENTS.zeros(), np.empty(64), np.empty(32)
    >>> design(1.0, 48000.0, coefficients)
    >>> run(np.uint64(1), 0, coefficients, STATE.zeros(), whole)
    >>> run(np.uint64(1), 32, coefficients, STATE.zeros(), half)
    >>> bool((whole[32:] == half).all())
    True
    """
    if state.tau != coefficients.tau:
        state.tau = coefficients.tau
        for level in range(LEVELS + 1):
            state.point[level] = 0.0
    for i in range(out.size):
        k, into = (frame + i) // SPAN, (frame + i) % SPAN
        if state.at != k + 1.0:
            state.here = state.there if state.at == float(k) and k > 0 else value_at(key, k, coefficients, state)
            state.there = value_at(key, k + 1, coefficients, state)
            state.at = k + 1.0
        out[i] = state.here + (state.there - state.here) * (into / SPAN)
