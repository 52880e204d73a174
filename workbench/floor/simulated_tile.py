"""The simulation of one tile with non-ideal sensors, on a plate that rings.

What is drawn from the seed (each sensor's own curve, hysteresis and creep, how the plate really splits a load, how far
rubber and shaker are from their nominal values) is there for tests to compare with, never for a calibration to use.
"""

import math
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.floor.corner_split import corner_twist, drawn_split, hand_shift_m, lift_corners_all
from underfoot.floor.layout import Tile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import kernel
from underfoot.models import gait
from underfoot.models.filtering import poles
from underfoot.models.signals.random import normal, stream_key
from underfoot.models.tile import fsr, shaker

GRAVITY = 9.81
"""m/s^2."""


class SimulatedTile:
    """One tile of the kind that `parameters` describe, drawn by `seed` and the tile's id. It has rested without a load.

    Raises `BadValue` unless the tile's sensors are the corners of a rectangle along its axes and its parts can be
    built.

    >>> from underfoot.floor.layout import default_floor
    >>> tile = SimulatedTile(default_floor(1, 1).tiles[0], TileParameters(), seed=3)
    >>> corners = tile.corner_forces([0.05, -0.02], 400.0)
    >>> round(float(corners.sum()), 6)
    400.0
    >>> tile.sense(np.tile(corners, (1000, 1)), 1000.0).shape
    (1000, 4)
    """

    def __init__(self, tile: Tile, parameters: TileParameters | None = None, seed: int = 1) -> None:
        self.tile = tile
        self.parameters = (parameters or TileParameters()).drawn(seed, tile.id)
        self.parts = tuple(self.parameters.sensors.part(seed, tile.id, sensor) for sensor in range(4))
        self.split = drawn_split(tile, self.parameters.split, seed)
        self.twist = corner_twist(tile)
        self._hand_shift_m = hand_shift_m(tile, self.parameters.split, seed)
        self._states = np.zeros(4, fsr.STATE)
        self._coefficients = np.zeros(4, fsr.COEFFICIENTS)
        self.noise_keys = sensor_keys(seed, tile)
        self._noise_key = stream_key("accelerometer", seed, tile.id)
        self._sensed, self._sensor_hz = 0, 0.0
        self._drive_hz, self._load = 0.0, ""
        self._played = 0
        self.parameters.assembly(tile)
        self.settle()

    @cached_property
    def preload_n(self) -> float:
        """What the tile itself weighs on each sensor, newtons."""
        return GRAVITY * self.parameters.suspension_of(self.tile).mass_kg / 4.0

    def coefficients(self, rate_hz: float) -> NDArray[np.void]:
        """Return the coefficients of the four sensors at a rate, for `fsr.sense`: shape (4,)."""
        return fsr.coefficients(self.parts, rate_hz)

    def settle(self) -> None:
        """Set the sensors to their state after a long time without a load."""
        self._set_rate(self._sensor_hz or 1000.0)
        fsr.settle(self._states, self._coefficients, self.preload_n)

    def corner_forces(
        self, at_m: ArrayLike, force_n: ArrayLike, shear_n: ArrayLike = (0.0, 0.0)
    ) -> NDArray[np.float64]:
        """Return the share of each corner in a force at `at_m` (..., 2), tile frame: newtons, shape (..., 4).

        A corner gives up at most its share of the plate's own weight; then it has lifted, and the other three carry
        the load (`lift_corners`). `shear_n` (..., 2) is a horizontal force on the surface; to vertical sensors it is a
        shift of the centroid by depth times shear over force. `BadValue` for what is not finite.
        """
        at, force = np.asarray(at_m, dtype=np.float64), np.asarray(force_n, dtype=np.float64)
        require(at.shape[-1:] == (2,) and bool(np.isfinite(at).all()), "at_m", at_m, "finite places (x, y)")
        require(bool(np.isfinite(force).all()), "force_n", force_n, "finite forces")
        moments = force[..., None] * (at + self._hand_shift_m) + self.tile.sensor_depth_m * np.asarray(shear_n, float)
        loaded = np.where(force != 0.0, force, 1.0)[..., None]
        place = moments / loaded
        ideal = gait.corner_forces(force, place[..., 0], place[..., 1], self.tile.sensors_m)
        carried = np.atleast_2d(ideal @ self.split.T + self.preload_n)
        lift_corners_all(carried.reshape(-1, 4), self.twist)
        return carried.reshape(ideal.shape) - self.preload_n

    def sense(self, forces_n: ArrayLike, rate_hz: float = 1000.0) -> NDArray[np.float64]:
        """Return readings of successive forces (n, 4) at the corners: whole numbers 0 to 65535, shape (n, 4).

        The sensors have hysteresis and creep from call to call; how readings are cut into calls does not matter.
        `BadValue` for forces that are not finite, and for a rate outside 1 to 1e6 Hz.
        """
        forces = np.asarray(forces_n, dtype=np.float64)
        require(forces.ndim == 2 and forces.shape[1] == 4, "forces_n", forces.shape, "shape (n, 4)")
        require(bool(np.isfinite(forces).all()), "forces_n", "not finite", "finite forces")
        self._set_rate(rate_hz)
        counts = np.empty_like(forces)
        loads = np.ascontiguousarray(forces + self.preload_n)
        fsr.sense(self._states, self._coefficients, self.noise_keys, loads, counts, self._sensed, len(forces))
        self._sensed += len(forces)
        return counts

    def respond(self, drive: ArrayLike, rate_hz: float, load: str = "none") -> NDArray[np.float64]:
        """Return the acceleration at the accelerometer, m/s^2, shape (n,), for a drive (n,) at full scale 1, clipped
        there.

        The plate goes on ringing from call to call, and is at rest after a change of rate or of `load` (`LOADS`).
        How the drive is cut into calls does not matter, to the bit. `BadValue` for a drive that is not finite, and for
        a rate outside 1 kHz to 1 MHz.
        """
        given = np.array(drive, dtype=np.float64)
        require(given.ndim == 1 and bool(np.isfinite(given).all()), "drive", drive, "finite numbers in one dimension")
        require(1e3 <= rate_hz <= 1e6, "rate_hz", rate_hz, "1e3 to 1e6 Hz")
        if (rate_hz, load) != (self._drive_hz, self._load):
            self._plant = Plant(self.tile, self.parameters, rate_hz, load)
            self._drive_hz, self._load = rate_hz, load
        np.clip(given, -1.0, 1.0, out=given)
        self._plant.run(given, given, given.size)
        device = self.parameters.accelerometer
        deviation = device.noise * math.sqrt(rate_hz / 2.0)
        _measure(given, device.range_m_s2, deviation, self._noise_key, self._played, given.size)
        self._played += given.size
        return given

    def transfer(self, frequencies_hz: ArrayLike, load: str = "none") -> NDArray[np.complex128]:
        """Return the transfer function of `respond` for small signals: m/s^2 at full scale, complex."""
        place = self.parameters.accelerometer_m(self.tile)
        force = self.parameters.shaker.transfer(frequencies_hz)
        return force * self.parameters.assembly(self.tile, load).transfer(frequencies_hz, place)

    def _set_rate(self, rate_hz: float) -> None:
        require(1.0 <= rate_hz <= 1e6, "rate_hz", rate_hz, "1 to 1e6 Hz")
        if rate_hz != self._sensor_hz:
            self._coefficients, self._sensor_hz = self.coefficients(rate_hz), rate_hz


class Plant:
    """From drive to acceleration, in real time: shaker, its compression, plate and what stands on it.

    `run` allocates nothing.
    """

    def __init__(self, tile: Tile, parameters: TileParameters, rate_hz: float, load: str) -> None:
        place = parameters.accelerometer_m(tile)
        self._shaker = parameters.shaker.poles().at_rate(rate_hz)
        self._compression = parameters.shaker.compression()
        self._body = parameters.assembly(tile, load).poles(place).at_rate(rate_hz)

    def run(self, drive: NDArray[np.float64], out: NDArray[np.float64], n: int) -> None:
        """Convert n samples of drive, full scale 1, to acceleration in m/s^2; the two may be the same array."""
        poles.run(*self._shaker, drive[:n], out)
        shaker.compress(self._compression, out, out, n)
        poles.run(*self._body, out[:n], out)


def sensor_keys(seed: int, tile: Tile) -> NDArray[np.uint64]:
    """Return the keys of the noise of a tile's four sensors."""
    return np.array([stream_key("sensor noise", seed, tile.id, sensor) for sensor in range(4)], dtype=np.uint64)


@kernel
def _measure(
    signal: NDArray[np.float64], range_m_s2: float, deviation: float, key: np.uint64, frame: int, n: int
) -> None:
    """Add the accelerometer's noise to n samples of `signal`, and clip it."""
    for i in range(n):
        measured = signal[i]
        if deviation > 0.0:
            measured += deviation * normal(key, frame + i)
        signal[i] = min(max(measured, -range_m_s2), range_m_s2)
