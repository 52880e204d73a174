"""Conversion of hardware tiles' readings to newtons, by the tiles' profiles, or nominally without one."""

from collections.abc import Mapping
from datetime import date

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.floor.layout import Floor
from underfoot.floor.live_readings import (
    COUNTS,
    ConversionTables,
    Whole,
    conversion_tables,
    correct_all,
    reset_sensors,
    uncalibrated,
)
from underfoot.floor.profile import Profile
from underfoot.kernels import Floats, kernel

NOMINAL_COUNTS_A_NEWTON, NOMINAL_ZERO = 20.0, 1000.0
"""Nominal sensor without calibration: range up to 3.2 kN, and pulls of up to 50 N, which real plates show."""


def nominal_force(readings: ArrayLike) -> NDArray[np.float64]:
    """Return the force in newtons of readings of uncalibrated sensors, any shape.

    >>> nominal_force([1000, 3000])
    array([  0., 100.])
    """
    return (np.asarray(readings, np.float64) - NOMINAL_ZERO) / NOMINAL_COUNTS_A_NEWTON


def nominal_readings(force_n: ArrayLike) -> NDArray[np.int64]:
    """Return the readings of such sensors for forces in newtons, any shape: rounded, and clipped to 0 to 65535.

    >>> nominal_readings([-1e6, 0.0, 100.0, 1e6])
    array([    0,  1000,  3000, 65535])
    """
    counts = np.rint(np.asarray(force_n, np.float64) * NOMINAL_COUNTS_A_NEWTON + NOMINAL_ZERO)
    return np.clip(counts, 0, COUNTS - 1).astype(np.int64)


class Conversion:
    """Converts readings of the tiles of `floor` to newtons; `profiles` by tile id, as from `profiles_of`.

    Hysteresis and creep are compensated, and centroids corrected, where a profile has them (`floor.live_readings`).
    `notices` name the tiles that are not calibrated, and signs that a profile no longer holds.

    >>> from underfoot.floor.layout import default_floor
    >>> conversion = Conversion(default_floor(1, 2), {})
    >>> conversion.newtons(np.array([1]), np.array([[1000, 3000, 5000, 1020]]), np.zeros(1), np.zeros(1, int))
    array([[  0., 100., 200.,   1.]])
    >>> conversion.notices
    ('uncalibrated: t1, t2 (20 counts a newton are assumed)',)
    """

    def __init__(self, floor: Floor, profiles: Mapping[str, Profile]) -> None:
        notices = list(uncalibrated(floor, profiles, f"{NOMINAL_COUNTS_A_NEWTON:g} counts a newton are assumed"))
        for tile in floor.tiles:
            profile = profiles.get(tile.id)
            if profile is not None and profile.is_calibrated:
                notices += profile.flags(tile.id, date.today())
        self.notices = tuple(notices)
        self._tables = conversion_tables(floor, profiles, nominal_force(np.arange(COUNTS)))
        self._is_corrected = bool(self._tables.corrected.any())
        self._epochs = np.zeros(len(floor.tiles), np.int64)
        nothing = np.zeros(0, np.int64)
        self.newtons(nothing, np.zeros((0, 4), np.int64), np.zeros(0), nothing)  # loads the kernel

    def newtons(self, rows: Whole, readings: Whole, time_s: Floats, epochs: Whole) -> Floats:
        """Return the forces (n, 4) in newtons of readings (n, 4) of the tiles in `rows` (n,), in order of arrival.

        `time_s` is the tile's own clock; a change of a tile's number in `epochs` means that it has restarted, with its
        sensors at rest.
        """
        out = np.empty((len(rows), 4))
        tables, rows = self._tables, np.ascontiguousarray(rows)
        _look_up(tables, rows, np.ascontiguousarray(readings), np.ascontiguousarray(epochs), self._epochs, out)
        if self._is_corrected:
            correct_all(tables, rows, time_s, out)
        return out


@kernel
def _look_up(tables: ConversionTables, rows: Whole, readings: Whole, epochs: Whole, known: Whole, out: Floats) -> None:
    for i in range(len(rows)):
        k = rows[i]
        for j in range(4):
            out[i, j] = tables.curves[tables.curve[k, j], readings[i, j]]
        if known[k] != epochs[i]:
            known[k] = epochs[i]
            reset_sensors(tables, k)
