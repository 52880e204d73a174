"""Non-ideal sensors of a simulated floor in real time: from forces on its tiles to measured newtons."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.corner_split import hand_shift_m, lift_corners
from underfoot.floor.layout import Floor
from underfoot.floor.live_readings import COUNTS, NOMINAL, conversion_tables, correct_floor, uncalibrated
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import Floats, kernel
from underfoot.models.tile import fsr


class SimulatedSensors:
    """Every tile is a `SimulatedTile` of its own, drawn by `seed` and its id; `profiles` by tile id turn counts into
    newtons, with hysteresis and creep compensated and centroids corrected (`live_readings`).

    A tile without one is read by the nominal curve of its kind of sensor, with the nominal weight of the plate taken
    off; `lines` name these. `counts` (most, tiles, 4) are the last readings. `hand_shift_m` (tiles, 2) is how far a
    hand's shear moves its centroid, `foot_shift_m` (tiles,) how far a foot's does.
    """

    def __init__(
        self,
        floor: Floor,
        parameters: TileParameters,
        seed: int,
        rate_hz: float,
        most: int,
        profiles: Mapping[str, Profile] | None = None,
    ) -> None:
        self.tiles = [SimulatedTile(tile, parameters, seed) for tile in floor.tiles]
        self.counts = np.zeros((most, len(floor.tiles), 4))
        self.hand_shift_m = np.array([hand_shift_m(tile, parameters.split, seed) for tile in floor.tiles])
        self.foot_shift_m = np.array([tile.sensor_depth_m * parameters.split.shear for tile in floor.tiles])
        self.lines = uncalibrated(floor, profiles or {}, "the nominal curve of the sensors is assumed")
        self._tables = conversion_tables(floor, profiles or {}, parameters.sensors.corner_n(np.arange(COUNTS)))
        self._is_corrected = bool(self._tables.corrected.any())
        preloads_n = np.array([tile.preload_n for tile in self.tiles])
        arrays = _Arrays(
            states=np.zeros((len(floor.tiles), 4), fsr.STATE),
            coefficients=np.array([tile.coefficients(rate_hz) for tile in self.tiles]),
            keys=np.array([tile.noise_keys for tile in self.tiles]),
            splits=np.array([tile.split for tile in self.tiles]),
            preloads_n=preloads_n,
            twists=np.array([tile.twist for tile in self.tiles]),
            curve=self._tables.curve,
            curves=self._tables.curves,
            zeros_n=np.where(self._tables.curve == NOMINAL, preloads_n[:, None], 0.0),
        )
        for k, preload_n in enumerate(preloads_n):
            fsr.settle(arrays.states[k], arrays.coefficients[k], preload_n)
        # For a named tuple Numba makes new strings at each call.
        self._arrays = tuple(arrays)
        self._already_split = tuple(arrays._replace(splits=np.array([np.eye(4)] * len(floor.tiles))))
        self._period_s = 1.0 / rate_hz
        self.read(np.zeros((0, len(floor.tiles), 4)), 0, 0)  # loads the kernels

    def read(self, forces_n: Floats, first: int, count: int, *, is_split: bool = False) -> None:
        """Replace the first `count` of `forces_n` (n, tiles, 4) by the measured newtons.

        `first` is the absolute number of the first sample. Forces are split bilinearly, or, if `is_split`, as a real
        plate did; a corner that would pull lifts off. Allocates nothing.
        """
        _read(self._already_split if is_split else self._arrays, forces_n, self.counts, first, count)
        if self._is_corrected:
            correct_floor(self._tables, first, count, self._period_s, forces_n)


class _Arrays(NamedTuple):
    """Sensors of a floor as the kernel reads them; the first axis is the tile, the second the sensor."""

    states: NDArray[np.void]  # (tiles, 4) of `fsr.STATE`
    coefficients: NDArray[np.void]  # (tiles, 4) of `fsr.COEFFICIENTS`
    keys: NDArray[np.uint64]  # (tiles, 4): of the noise
    splits: Floats  # (tiles, 4, 4): what each sensor carries of each bilinear corner force
    preloads_n: Floats  # (tiles,): the plate's own weight on a sensor
    twists: Floats  # (tiles, 4)
    curve: NDArray[np.int64]  # (tiles, 4): which of `curves` a sensor has
    curves: Floats  # (curves, COUNTS): newtons of every reading
    zeros_n: Floats  # (tiles, 4): newtons of the unloaded tile, taken off


@kernel
def _read(arrays: tuple[Any, ...], forces_n: Floats, counts: Floats, first: int, count: int) -> None:
    a = _Arrays(*arrays)
    for k in range(len(a.splits)):
        for i in range(count):
            # Loads stand where the counts will: what is sensed may be written over it.
            for sensor in range(4):
                load_n = a.preloads_n[k]
                for other in range(4):
                    load_n += a.splits[k, sensor, other] * forces_n[i, k, other]
                counts[i, k, sensor] = load_n
            lift_corners(counts[i, k], a.twists[k])
        fsr.sense(a.states[k], a.coefficients[k], a.keys[k], counts[:, k], counts[:, k], first, count)
        for i in range(count):
            for sensor in range(4):
                forces_n[i, k, sensor] = a.curves[a.curve[k, sensor], int(counts[i, k, sensor])] - a.zeros_n[k, sensor]
