"""Readings of a floor's sensors to newtons: by the tiles' profiles, and nominally where there is none."""

from collections.abc import Mapping
from datetime import date

import numpy as np
from numpy.typing import ArrayLike, NDArray

from workbench.floor.layout import Floor
from workbench.floor.profile import Profile
from workbench.kernels import kernel

COUNTS = 0x10000
"""How many readings there are: 0 to 65535."""
NOMINAL_COUNTS_A_NEWTON, NOMINAL_ZERO = 20.0, 1000.0
"""What a sensor that nobody calibrated is taken to read: up to 3.2 kN, and pulls of up to 50 N, which real plates
show."""


def nominal_force(readings: ArrayLike) -> NDArray[np.float64]:
    """Newtons of readings, any shape, of sensors that nobody calibrated.

    >>> nominal_force([1000, 3000])
    array([  0., 100.])
    """
    return (np.asarray(readings, np.float64) - NOMINAL_ZERO) / NOMINAL_COUNTS_A_NEWTON


def nominal_readings(force_n: ArrayLike) -> NDArray[np.int64]:
    """What such sensors read of newtons, any shape: rounded, and kept within 0 to 65535.

    >>> nominal_readings([-1e6, 0.0, 100.0, 1e6])
    array([    0,  1000,  3000, 65535])
    """
    counts = np.rint(np.asarray(force_n, np.float64) * NOMINAL_COUNTS_A_NEWTON + NOMINAL_ZERO)
    return np.clip(counts, 0, COUNTS - 1).astype(np.int64)


class Conversion:
    """Newtons of what the tiles of `floor` send; `profiles` by tile id, as `profiles_of` gives them.

    A sensor's curve is looked up in a table of all its readings, so that no tile costs more than another. `lines` say
    which tiles are not calibrated, and what their profiles have against themselves today.

    >>> from workbench.floor.layout import default_floor
    >>> conversion = Conversion(default_floor(1, 2), {})
    >>> conversion.newtons(np.array([1]), np.array([[1000, 3000, 5000, 1020]]))
    array([[  0., 100., 200.,   1.]])
    >>> conversion.lines
    ('uncalibrated: t1, t2 (20 counts a newton are assumed)',)
    """

    def __init__(self, floor: Floor, profiles: Mapping[str, Profile], today: date | None = None) -> None:
        every = np.arange(COUNTS)
        nominal = nominal_force(every)
        self._which = np.zeros((len(floor.tiles), 4), np.int64)
        curves = [nominal]
        uncalibrated: list[str] = []
        flags: list[str] = []
        for row, tile in enumerate(floor.tiles):
            profile = profiles.get(tile.id)
            if profile is None or not profile.is_calibrated:
                uncalibrated.append(tile.id)
                continue
            flags += profile.flags(tile.id, today or date.today())
            newtons = profile.force(np.repeat(every[:, None], 4, axis=1))
            for sensor in range(4):
                if np.isfinite(newtons[:, sensor]).all():  # else it has no curve, and the profile says so
                    self._which[row, sensor] = len(curves)
                    curves.append(newtons[:, sensor])
        self._curves = np.array(curves)
        if uncalibrated:
            some = uncalibrated if len(uncalibrated) <= 6 else [*uncalibrated[:5], "...", uncalibrated[-1]]
            flags.insert(0, f"uncalibrated: {', '.join(some)} (20 counts a newton are assumed)")
        self.lines = tuple(flags)
        _look_up(np.zeros(0, np.int64), np.zeros((0, 4), np.int64), self._which, self._curves, np.zeros((0, 4)))

    def newtons(self, rows: NDArray[np.int64], readings: NDArray[np.int64]) -> NDArray[np.float64]:
        """Newtons of readings (n, 4), each of the floor's tile in `rows` (n,)."""
        out = np.empty((len(rows), 4))
        _look_up(np.ascontiguousarray(rows), np.ascontiguousarray(readings), self._which, self._curves, out)
        return out


@kernel
def _look_up(rows, readings, which, curves, out):
    for i in range(len(rows)):
        for sensor in range(4):
            out[i, sensor] = curves[which[rows[i], sensor], readings[i, sensor]]
