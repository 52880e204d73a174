"""Cascade of second-order sections in real time: the form in which an equaliser runs.

Each section [b0, b1, b2, 1, a1, a2] runs in transposed direct form II, with two states. `tail` bounds the remaining
output, from the largest output that each state alone causes.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats, kernel

MAX_SECTIONS = 12
"""Number of sections of the largest cascade, an equaliser of order 24."""
STATE = np.dtype([("z1", np.float64, (MAX_SECTIONS,)), ("z2", np.float64, (MAX_SECTIONS,))], align=True)
"""The two states of each section."""
COEFFICIENTS = np.dtype(
    [
        ("sections", np.int64),
        ("b0", np.float64, (MAX_SECTIONS,)),
        ("b1", np.float64, (MAX_SECTIONS,)),
        ("b2", np.float64, (MAX_SECTIONS,)),
        ("a1", np.float64, (MAX_SECTIONS,)),
        ("a2", np.float64, (MAX_SECTIONS,)),
        ("peak_of_z1", np.float64, (MAX_SECTIONS,)),
        ("peak_of_z2", np.float64, (MAX_SECTIONS,)),
    ],
    align=True,
)
"""Number of sections, their coefficients, and the largest |output| caused by a state of 1."""
LARGEST = 1e9
"""Inputs are limited to this size."""

_TIME_CONSTANTS = 20.0
_MOST_FRAMES = 2_000_000


def coefficients(sections: ArrayLike) -> np.record:
    """Return the `COEFFICIENTS` of sections [b0, b1, b2, 1, a1, a2], shape (n, 6), n at most MAX_SECTIONS.

    Raises `BadValue` for sections that are not stable.

    >>> lag, state, out = coefficients([[0.5, 0.0, 0.0, 1.0, -0.5, 0.0]]), np.zeros(1, STATE)[0], np.ones(64)
    >>> run(state, lag, out, out)
    >>> round(float(out[-1]), 9)
    1.0
    """
    given = checked(sections)
    radius = max((float(np.abs(np.roots(section[3:])).max(initial=0.0)) for section in given), default=0.0)
    found = np.zeros(1, COEFFICIENTS)[0]
    found["sections"] = len(given)
    for name, column in zip(("b0", "b1", "b2", "a1", "a2"), (0, 1, 2, 4, 5), strict=True):
        found[name][: len(given)] = given[:, column]
    frames = min(1 + math.ceil(_TIME_CONSTANTS / (1.0 - radius)), _MOST_FRAMES)
    _find_peaks(found, np.zeros(1, STATE)[0], frames)
    return found


def checked(sections: ArrayLike) -> NDArray[np.float64]:
    """Return sections as float64 (n, 6); `BadValue` unless they are finite, stable and no more than MAX_SECTIONS.

    >>> checked([[1.0, 0.0, 0.0, 1.0, -2.1, 1.1]])
    Traceback (most recent call last):
    underfoot.errors.BadValue: sections is [1.0, 0.0, 0.0, 1.0, -2.1, 1.1]; allowed: stable ones, finite, with a0 = 1
    """
    given = np.asarray(sections, dtype=np.float64)
    require(given.size == 0 or (given.ndim == 2 and given.shape[1] == 6), "sections", given.shape, "shape (n, 6)")
    given = given.reshape(-1, 6)
    require(len(given) <= MAX_SECTIONS, "sections", len(given), f"at most {MAX_SECTIONS}")
    for section in given:
        good = bool(np.isfinite(section).all()) and is_stable(section)
        require(good, "sections", section.tolist(), "stable ones, finite, with a0 = 1")
    return given


def is_stable(section: Sequence[float] | NDArray[np.float64]) -> bool:
    """Return whether a section (b0, b1, b2, a0, a1, a2) has a0 = 1 and both poles within the unit circle.

    >>> is_stable((1.0, 0.0, 0.0, 1.0, -1.0, 0.5)), is_stable((1.0, 0.0, 0.0, 1.0, -2.1, 1.1))
    (True, False)
    """
    _, _, _, a0, a1, a2 = section
    # Both poles lie within the unit circle if (a1, a2) lies within this triangle.
    return bool(a0 == 1.0 and abs(a2) < 1.0 and abs(a1) < 1.0 + a2)


def at_rate(sections: ArrayLike, rate_hz: float, new_rate_hz: float) -> NDArray[np.float64]:
    """Convert sections from `rate_hz` to `new_rate_hz`: equal below a quarter of either rate, poles kept in place.

    >>> at_rate([[1.0, 0.2, 0.0, 1.0, -0.3, 0.1]], 48000.0, 48000.0)
    array([[ 1. ,  0.2,  0. ,  1. , -0.3,  0.1]])
    """
    given = np.asarray(sections, dtype=np.float64).reshape(-1, 6)
    require(rate_hz > 0.0 and new_rate_hz > 0.0, "rate_hz", (rate_hz, new_rate_hz), "above 0")
    if new_rate_hz == rate_hz:
        return given.copy()
    # To the analogue domain by s = (1 - z^-1) / (1 + z^-1), and back; at low frequencies s is pi f / rate.
    scale = rate_hz / new_rate_hz
    moved = []
    for c0, c1, c2 in given.reshape(-1, 3):
        square, line, constant = c0 - c1 + c2, 2.0 * (c0 - c2) * scale, (c0 + c1 + c2) * scale * scale
        moved.append((square + line + constant, 2.0 * (constant - square), square - line + constant))
    found = np.array(moved).reshape(-1, 6)
    return found / found[:, 3:4]


@kernel
def run(state: np.record, coefficients: np.record, given: Floats, out: Floats) -> None:
    """Filter `given` into `out` (may be the same array). Results do not depend on how frames are split into calls."""
    for i in range(len(given)):
        out[i] = step(state, coefficients, given[i])


@kernel
def step(state: np.record, coefficients: np.record, value: float) -> float:
    """Filter one frame."""
    c = coefficients
    for k in range(c.sections):
        out = c.b0[k] * value + state.z1[k]
        state.z1[k] = c.b1[k] * value - c.a1[k] * out + state.z2[k]
        state.z2[k] = c.b2[k] * value - c.a2[k] * out
        value = out
    return value


@kernel
def tail(state: np.record, coefficients: np.record) -> float:
    """Return an upper bound of |output| from here on if all further input is zero."""
    bound = 0.0
    for k in range(coefficients.sections):
        bound += coefficients.peak_of_z1[k] * abs(state.z1[k])
        bound += coefficients.peak_of_z2[k] * abs(state.z2[k])
    return bound


@kernel
def reset(state: np.record) -> None:
    """Reset a state to rest."""
    state.z1[:] = 0.0
    state.z2[:] = 0.0


@kernel
def _find_peaks(coefficients: np.record, state: np.record, frames: int) -> None:
    """Compute the largest |output| that each state alone causes without input; `state` is working memory."""
    for k in range(coefficients.sections):
        reset(state)
        state.z1[k] = 1.0
        coefficients.peak_of_z1[k] = _peak(state, coefficients, frames)
        reset(state)
        state.z2[k] = 1.0
        coefficients.peak_of_z2[k] = _peak(state, coefficients, frames)


@kernel
def _peak(state: np.record, coefficients: np.record, frames: int) -> float:
    largest = 0.0
    for _ in range(frames):
        largest = max(largest, abs(step(state, coefficients, 0.0)))
    return largest
