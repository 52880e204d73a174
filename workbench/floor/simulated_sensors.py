"""The sensors of a whole simulated floor, honest ones, in real time: from the forces on its tiles to what is read."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.floor.live_readings import COUNTS, NOMINAL, correct_floor, tables_of, uncalibrated
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile, TileParameters, hand_lean_m, seat
from underfoot.kernels import kernel
from underfoot.models.tile import fsr


class FloorSensors:
    """Every tile is a `SimulatedTile` of its own, drawn by `seed` and its id; `profiles` by tile id turn counts into
    newtons, with what sensors remember taken out and centroids in their place (`reading`).

    A tile without one is read by the nominal law of its kind of sensor, with the nominal weight of the plate taken off;
    `lines` name these. `counts` (most, tiles, 4) are the last readings. `lean_m` (tiles, 2) is where a hand's shear
    moves it, `leans_m` (tiles,) how far a foot's does.
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
        self.lean_m = np.array([hand_lean_m(tile, parameters.split, seed) for tile in floor.tiles])
        self.leans_m = np.array([tile.sensor_depth_m * parameters.split.shear for tile in floor.tiles])
        self._splits = np.array([one.split for one in self.tiles])
        self._alike = np.array([np.eye(4)] * len(floor.tiles))
        self._preloads = np.array([one.preload_n for one in self.tiles])
        self._twists = np.array([one.twist for one in self.tiles])
        self._keys = np.array([one.noise_keys for one in self.tiles])
        self._tunings = np.array([one.tunings(rate_hz) for one in self.tiles])
        self._memory = np.zeros((len(floor.tiles), 4, fsr.state_size()))
        for k in range(len(floor.tiles)):
            for sensor in range(4):
                fsr.settle(self._memory[k, sensor], self._tunings[k, sensor], self._preloads[k])
        self.lines = uncalibrated(floor, profiles or {}, "the nominal law of the sensors is assumed")
        self._tables = tables_of(floor, profiles or {}, parameters.sensors.corner_n(np.arange(COUNTS)))
        self._learned = bool(self._tables.learned.any())
        self._zeros = np.where(self._tables.curve == NOMINAL, self._preloads[:, None], 0.0)
        self._period_s = 1.0 / rate_hz
        self.read(np.zeros((0, len(floor.tiles), 4)), 0, 0)  # loads the kernels

    def read(self, forces_n: NDArray[np.float64], first: int, count: int, is_split: bool = False) -> None:
        """Put in place of the first `count` of `forces_n` (n, tiles, 4) the newtons that are read of them.

        `first` is the absolute number of the first sample. Forces are split bilinearly, or, if `is_split`, as a real
        plate did; a corner that would pull lifts off. Allocates nothing.
        """
        _read(
            self._memory, self._tunings, self._keys, self._alike if is_split else self._splits, self._preloads,
            self._twists, self._tables.curve, self._tables.curves, self._zeros, forces_n, self.counts, first, count,
        )  # fmt: skip
        if self._learned:
            correct_floor(self._tables, first, count, self._period_s, forces_n)


@kernel
def _read(memory, tunings, keys, splits, preloads, twists, curve, curves, zeros, forces, counts, first, count):
    for k in range(len(splits)):
        for i in range(count):
            # Loads stand where the counts will: what is sensed may be written over it.
            for sensor in range(4):
                load = preloads[k]
                for other in range(4):
                    load += splits[k, sensor, other] * forces[i, k, other]
                counts[i, k, sensor] = load
            seat(counts[i, k], twists[k])
        fsr.sense_tile(memory[k], tunings[k], keys[k], counts[:, k], counts[:, k], first, count)
        for i in range(count):
            for sensor in range(4):
                forces[i, k, sensor] = curves[curve[k, sensor], int(counts[i, k, sensor])] - zeros[k, sensor]
