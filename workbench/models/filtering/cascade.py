"""A cascade of second-order sections in real time: what an equaliser is once it was designed.

A tuning holds sections [b0, b1, b2, 1, a1, a2]; each runs in the transposed direct form II, with two
states. `rest` bounds what a cascade can still put out, from the largest output that each of its states alone leads to.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import kernel

MOST_SECTIONS = 12
"""Sections of the largest cascade, an equaliser of order 24."""
STATE = 2 * MOST_SECTIONS
"""Floats of state of a cascade."""
TUNING = 1 + 7 * MOST_SECTIONS
"""Floats of tuning of a cascade: how many sections; b0, b1, b2, a1, a2 of each; then the reach of each state."""
LARGEST = 1e9
"""What goes into a cascade is held within this."""

_REACH = 1 + 5 * MOST_SECTIONS
_TIME_CONSTANTS = 20.0
_MOST_FRAMES = 2_000_000


def tuning(sections: ArrayLike) -> NDArray[np.float64]:
    """The tuning, shape (TUNING,), of sections [b0, b1, b2, 1, a1, a2], shape (n, 6), n at most MOST_SECTIONS.

    Raises `BadValue` for sections that are not stable.

    >>> t, s, x = tuning([[0.5, 0.0, 0.0, 1.0, -0.5, 0.0]]), np.zeros(STATE), np.ones(64)
    >>> run(s, t, x, x, 64)
    >>> round(float(x[-1]), 9)
    1.0
    """
    given = checked(sections)
    radius = max((float(np.abs(np.roots(section[3:])).max(initial=0.0)) for section in given), default=0.0)
    t = np.zeros(TUNING)
    t[0] = len(given)
    t[1 : 1 + 5 * len(given)] = given[:, [0, 1, 2, 4, 5]].ravel()
    frames = min(1 + math.ceil(_TIME_CONSTANTS / (1.0 - radius)), _MOST_FRAMES)
    _fill_reach(t, np.zeros(STATE), frames)
    return t


def checked(sections: ArrayLike) -> NDArray[np.float64]:
    """Sections as float64 (n, 6); `BadValue` unless they are finite, stable and no more than MOST_SECTIONS.

    >>> checked([[1.0, 0.0, 0.0, 1.0, -2.1, 1.1]])
    Traceback (most recent call last):
    underfoot.errors.BadValue: sections is [1.0, 0.0, 0.0, 1.0, -2.1, 1.1]; allowed: stable ones, finite, with a0 = 1
    """
    given = np.asarray(sections, dtype=np.float64)
    require(given.size == 0 or (given.ndim == 2 and given.shape[1] == 6), "sections", given.shape, "shape (n, 6)")
    given = given.reshape(-1, 6)
    require(len(given) <= MOST_SECTIONS, "sections", len(given), f"at most {MOST_SECTIONS}")
    for section in given:
        good = bool(np.isfinite(section).all()) and is_stable(section)
        require(good, "sections", section.tolist(), "stable ones, finite, with a0 = 1")
    return given


def is_stable(section: Sequence[float] | NDArray[np.float64]) -> bool:
    """Whether a section (b0, b1, b2, a0, a1, a2) has a0 = 1 and both poles within the unit circle.

    >>> is_stable((1.0, 0.0, 0.0, 1.0, -1.0, 0.5)), is_stable((1.0, 0.0, 0.0, 1.0, -2.1, 1.1))
    (True, False)
    """
    _, _, _, a0, a1, a2 = section
    # Both poles lie within the unit circle where (a1, a2) lies within this triangle.
    return bool(a0 == 1.0 and abs(a2) < 1.0 and abs(a1) < 1.0 + a2)


def at_rate(sections: ArrayLike, rate_hz: float, new_rate_hz: float) -> NDArray[np.float64]:
    """Sections designed for `rate_hz`, for `new_rate_hz`: the same below a quarter of either, poles kept in place.

    >>> at_rate([[1.0, 0.2, 0.0, 1.0, -0.3, 0.1]], 48000.0, 48000.0)
    array([[ 1. ,  0.2,  0. ,  1. , -0.3,  0.1]])
    """
    given = np.asarray(sections, dtype=np.float64).reshape(-1, 6)
    require(rate_hz > 0.0 and new_rate_hz > 0.0, "rate_hz", (rate_hz, new_rate_hz), "above 0")
    if new_rate_hz == rate_hz:
        return given.copy()
    # Back to the analogue circuit by s = (1 - z^-1) / (1 + z^-1), and forth again; at low frequencies s is pi f / rate.
    scale = rate_hz / new_rate_hz
    moved = []
    for c0, c1, c2 in given.reshape(-1, 3):
        square, line, constant = c0 - c1 + c2, 2.0 * (c0 - c2) * scale, (c0 + c1 + c2) * scale * scale
        moved.append((square + line + constant, 2.0 * (constant - square), square - line + constant))
    found = np.array(moved).reshape(-1, 6)
    return found / found[:, 3:4]


@kernel
def run(s, t, x, y, n):
    """Filter `n` frames of `x` into `y` (they may be the same array). Bit for bit the same however they are split."""
    for i in range(n):
        y[i] = step(s, t, x[i])


@kernel
def step(s, t, u):
    """One frame through the cascade."""
    for k in range(int(t[0])):
        c = 1 + 5 * k
        y = t[c] * u + s[2 * k]
        s[2 * k] = t[c + 1] * u - t[c + 3] * y + s[2 * k + 1]
        s[2 * k + 1] = t[c + 2] * u - t[c + 4] * y
        u = y
    return u


@kernel
def rest(s, t):
    """An upper bound of |output| from here on if all further input is zero."""
    bound = 0.0
    for k in range(2 * int(t[0])):
        bound += t[_REACH + k] * abs(s[k])
    return bound


@kernel
def _fill_reach(t, s, frames):
    """The largest |output| that a state of 1 leads to with no input, for each state; `s` is room for a state."""
    for k in range(2 * int(t[0])):
        s[:] = 0.0
        s[k] = 1.0
        largest = 0.0
        for _ in range(frames):
            largest = max(largest, abs(step(s, t, 0.0)))
        t[_REACH + k] = largest
