"""A cascade of second-order sections in real time: what an equaliser is once it was designed.

Each section [b0, b1, b2, 1, a1, a2] runs in the transposed direct form II, with two states. `tail` bounds what a
cascade can still put out, from the largest output that each of its states alone leads to.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats, kernel

MAX_SECTIONS = 12
"""Sections of the largest cascade, an equaliser of order 24."""
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
"""How many sections there are, what each multiplies with, and the largest |output| that a state of 1 leads to."""
LARGEST = 1e9
"""What goes into a cascade is held within this."""

_TIME_CONSTANTS = 20.0
_MOST_FRAMES = 2_000_000


def coefficients(sections: ArrayLike) -> np.record:
    """The coefficients (`COEFFICIENTS`) of sections [b0, b1, b2, 1, a1, a2], shape (n, 6), n at most MAX_SECTIONS.

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
    """Sections as float64 (n, 6); `BadValue` unless they are finite, stable and no more than MAX_SECTIONS.

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
def run(state: np.record, coefficients: np.record, given: Floats, out: Floats) -> None:
    """Filter the frames of `given` into `out` (they may be the same array). Bit for bit the same however it is cut."""
    for i in range(len(given)):
        out[i] = step(state, coefficients, given[i])


@kernel
def step(state: np.record, coefficients: np.record, value: float) -> float:
    """One frame through the cascade."""
    c = coefficients
    for k in range(c.sections):
        out = c.b0[k] * value + state.z1[k]
        state.z1[k] = c.b1[k] * value - c.a1[k] * out + state.z2[k]
        state.z2[k] = c.b2[k] * value - c.a2[k] * out
        value = out
    return value


@kernel
def tail(state: np.record, coefficients: np.record) -> float:
    """An upper bound of |output| from here on if all further input is zero."""
    bound = 0.0
    for k in range(coefficients.sections):
        bound += coefficients.peak_of_z1[k] * abs(state.z1[k])
        bound += coefficients.peak_of_z2[k] * abs(state.z2[k])
    return bound


@kernel
def reset(state: np.record) -> None:
    """A state at rest."""
    state.z1[:] = 0.0
    state.z2[:] = 0.0


@kernel
def _find_peaks(coefficients: np.record, state: np.record, frames: int) -> None:
    """Fill in the largest |output| that each state alone leads to with no input; `state` is room for one."""
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
