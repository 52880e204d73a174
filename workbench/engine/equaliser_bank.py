"""The equalisers of all tiles: the drive at which each tile gives the commanded acceleration."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.clock import FADE, LONG_AGO, SPAN
from underfoot.floor.profile import NOMINAL_ACCELERATION
from underfoot.kernels import block_kernel
from underfoot.models.filtering import cascade

QUIET = 1e-9 * NOMINAL_ACCELERATION
"""Acceleration in m/s^2 below which an equaliser's ringing ends: 1e-9 of a usual full scale."""

ROW = np.dtype(
    [("slot", np.int64), ("awake", np.bool_), ("zero_frames", np.int64), ("fade_frame", np.int64)], align=True
)
"""State of a tile's equaliser: which of its two slots is in use, whether it still rings, the number of zero input
frames since, and the frame at which the fade from the other slot began.
"""


class EqualiserBank:
    """The equalisers of `rows` tiles, with their initial `coefficients`; a tile without one costs nothing."""

    def __init__(self, rows: int, coefficients: Mapping[int, np.record]) -> None:
        self._coefficients = np.zeros((rows, 2), cascade.COEFFICIENTS)
        self._states = np.zeros((rows, 2), cascade.STATE)
        self._rows = np.zeros(rows, ROW)
        self._rows["fade_frame"] = LONG_AGO
        for row, given in coefficients.items():
            self._coefficients[row, 0] = given
        self._works = bool(self._coefficients["sections"].any())
        # Load the kernel now, so that the first equaliser does not delay the callback.
        _equalise(np.zeros((0, 1)), np.zeros(0, np.uint8), self._coefficients, self._states, self._rows, 0, 0)

    def change(self, row: int, coefficients: np.record, frame: int) -> None:
        """Fade a tile's equaliser to another from `frame` on; the previous fade must be over."""
        slot = 1 - int(self._rows["slot"][row])
        self._coefficients[row, slot] = coefficients
        self._states[row, slot] = np.zeros((), cascade.STATE)
        self._rows["slot"][row], self._rows["fade_frame"][row] = slot, frame
        self._works = True

    def free_from(self, row: int) -> int:
        """Return the first frame at which a tile's equaliser can be changed."""
        return int(self._rows["fade_frame"][row]) + FADE

    def ringing(self) -> tuple[bool, ...]:
        """Return, for each tile, whether its equaliser is still decaying."""
        return tuple(bool(awake) for awake in self._rows["awake"])

    def apply(self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, n: int) -> None:
        """Equalise `n` frames of float64 [row, frame] in place, from session frame `frame` on. Allocates nothing.

        `zero_rows` marks rows that are zero throughout; the mark is cleared where an equaliser still rings.
        """
        if self._works:
            _equalise(acceleration, zero_rows, self._coefficients, self._states, self._rows, frame, n)


def coefficients_of(sections: ArrayLike, rate_hz: float, engine_rate_hz: float) -> np.record:
    """Return the coefficients at `engine_rate_hz` of sections designed for `rate_hz`; `BadValue` if unstable."""
    return cascade.coefficients(cascade.at_rate(sections, rate_hz, engine_rate_hz))


@block_kernel
def _equalise(
    acceleration: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    coefficients: NDArray[np.void],
    states: NDArray[np.void],
    rows: NDArray[np.void],
    frame: int,
    n: int,
) -> None:
    for k in range(acceleration.shape[0]):
        row = rows[k]
        now, before = coefficients[k, row.slot], coefficients[k, 1 - row.slot]
        fades = frame < row.fade_frame + FADE
        if now.sections == 0 and not (fades and before.sections != 0):
            row.awake = False
            continue
        silent = zero_rows[k] != 0
        if silent and not row.awake:
            continue
        zero_rows[k] = 0
        state, state_before = states[k, row.slot], states[k, 1 - row.slot]
        for i in range(n):
            x = 0.0 if silent else acceleration[k, i]
            if x != 0.0:
                row.awake, row.zero_frames = True, 0
            else:
                row.zero_frames += 1
            held = min(max(x, -cascade.LARGEST), cascade.LARGEST) if math.isfinite(x) else 0.0
            y = cascade.step(state, now, held)
            since = frame + i - row.fade_frame
            if since < FADE:
                old = cascade.step(state_before, before, held)
                y = old + (y - old) * (since / FADE)
            acceleration[k, i] = y if math.isfinite(x) else x  # the safety stage counts values that are not finite
            if row.awake and row.zero_frames >= SPAN and (frame + i + 1) % SPAN == 0:
                remains = cascade.tail(state, now) + (cascade.tail(state_before, before) if since < FADE else 0.0)
                if remains < QUIET:
                    cascade.reset(state)
                    cascade.reset(state_before)
                    row.awake = False
