"""What a shaker is sent so that its tile gives what was asked: each tile's equaliser, from its profile."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from underfoot.clock import FADE, SPAN
from underfoot.engine.messages import Correct
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile
from underfoot.kernels import kernel
from underfoot.models.filtering import cascade

QUIET = 1e-9 * 20.0
"""m/s^2 below which an equaliser's ringing ends: 1e-9 of a usual full scale."""

_SLOT, _AWAKE, _ZEROS, _FROM, _WIDTH = range(5)
_LONG_AGO = -(1 << 60)


def corrections_of(profiles: Mapping[str, Profile]) -> tuple[Correct, ...]:
    """The corrections of tiles whose response was measured.

    >>> corrections_of({"t1": Profile(tile="t1")})
    ()
    """
    return tuple(correction_of(tile, profile) for tile, profile in profiles.items() if profile.response is not None)


def correction_of(tile: str, profile: Profile) -> Correct:
    """How a tile with this profile is driven; as an uncalibrated one where its response was not measured.

    >>> correction_of("t1", Profile(tile="t1"))
    Correct(tile='t1', acceleration_per_unit=20.0, sections=(), rate_hz=48000)
    """
    response = profile.response
    if response is None:
        return Correct(tile, profile.acceleration_per_unit)
    return Correct(tile, response.acceleration_per_unit, response.equaliser, response.rate_hz)


class Correction:
    """The equalisers of a floor's tiles; a tile without one costs nothing."""

    def __init__(self, floor: Floor, corrections: Sequence[Correct], rate_hz: float) -> None:
        rows = len(floor.tiles)
        self._tunings = np.zeros((rows, 2, cascade.TUNING))
        self._states = np.zeros((rows, 2, cascade.STATE))
        self._rows = np.zeros((rows, _WIDTH), np.int64)
        self._rows[:, _FROM] = _LONG_AGO
        for correction in corrections:
            self._tunings[floor.index(correction.tile), 0] = tuning_of(correction, rate_hz)
        self._works = bool(self._tunings.any())
        tuning_of(Correct(""), rate_hz)  # loads the kernels, so that no correction is late for them
        _correct(np.zeros((0, 1)), np.zeros(0, np.uint8), self._tunings, self._states, self._rows, 0, 0)

    def change(self, row: int, tuning: np.ndarray, frame: int) -> None:
        """Fade a tile's equaliser over to the one of `tuning` from `frame` on; the fade before it must be over."""
        slot = 1 - self._rows[row, _SLOT]
        self._tunings[row, slot] = tuning
        self._states[row, slot] = 0.0
        self._rows[row, _SLOT], self._rows[row, _FROM] = slot, frame
        self._works = True

    def free(self, row: int) -> int:
        """The first frame at which a tile's equaliser may be changed."""
        return int(self._rows[row, _FROM]) + FADE

    def ringing(self) -> tuple[bool, ...]:
        """Of each tile, whether anything is left in its equaliser."""
        return tuple(bool(awake) for awake in self._rows[:, _AWAKE])

    def apply(self, acceleration: np.ndarray, still: np.ndarray, frame: int, n: int) -> None:
        """Correct `n` frames of float64 [row, frame] in place, from session frame `frame` on. Allocates nothing.

        `still` marks rows that are zero throughout, and is cleared where an equaliser rings on.
        """
        if self._works:
            _correct(acceleration, still, self._tunings, self._states, self._rows, frame, n)


def tuning_of(correction: Correct, rate_hz: float) -> np.ndarray:
    """The equaliser of a correction, ready to run at `rate_hz`; `BadValue` for one that is not stable."""
    return cascade.tuning(cascade.at_rate(correction.sections, correction.rate_hz, rate_hz))


@kernel
def _correct(x, still, tunings, states, rows, frame, n):
    for row in range(x.shape[0]):
        own = rows[row]
        slot = own[_SLOT]
        now, before = tunings[row, slot], tunings[row, 1 - slot]
        fades = frame < own[_FROM] + FADE
        if now[0] == 0.0 and not (fades and before[0] != 0.0):
            own[_AWAKE] = 0
            continue
        silent = still[row] != 0
        if silent and own[_AWAKE] == 0:
            continue
        still[row] = 0
        s, s_before = states[row, slot], states[row, 1 - slot]
        for i in range(n):
            u = 0.0 if silent else x[row, i]
            if u != 0.0:
                own[_AWAKE], own[_ZEROS] = 1, 0
            else:
                own[_ZEROS] += 1
            held = min(max(u, -cascade.LARGEST), cascade.LARGEST) if math.isfinite(u) else 0.0
            y = cascade.step(s, now, held)
            since = frame + i - own[_FROM]
            if since < FADE:
                old = cascade.step(s_before, before, held)
                y = old + (y - old) * (since / FADE)
            x[row, i] = y if math.isfinite(u) else u  # what is not a number is for the safety stage to count
            if own[_AWAKE] != 0 and own[_ZEROS] >= SPAN and (frame + i + 1) % SPAN == 0:
                remains = cascade.rest(s, now) + (cascade.rest(s_before, before) if since < FADE else 0.0)
                if remains < QUIET:
                    s[:] = 0.0
                    s_before[:] = 0.0
                    own[_AWAKE] = 0
