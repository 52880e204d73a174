"""Rigs with a variable stiffness plate: any rig whose servo moves, and simulated feet that step on it."""

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import NO_READINGS, PressRequest, Readings, Rig, Sound
from underfoot.devices.plate import SIMULATED, SIMULATED_CALIBRATION, PlateServo
from underfoot.errors import BadMeasurement, BadValue, DeviceError
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.models.gait import vertical_force

_RATE_HZ = 1000.0
_BLOCK_S = 0.1
_STANCE_S, _GAP_S = (0.6, 0.8), (0.5, 0.7)
"""Shortest and longest footstep, and pause before one."""
_PEAKS_N = (500.0, 900.0)
_FOAM = 0.01
"""Standard deviation of the stiffness from footstep to footstep: foam remembers, and feet differ."""
_TRACKING_MM = 0.02
"""Standard deviation of the displacement sensor."""
_CELL_N = 3.0
"""Standard deviation of the load cell under the plate."""


class PlateRig:
    """Rig with the servo of a plate: it moves to the position of a `PressRequest`, and holds otherwise."""

    def __init__(self, rig: Rig, servo: PlateServo) -> None:
        self._rig, self._servo = rig, servo
        self._wanted: float | None = None
        self._position = float("nan")
        self._is_free = False

    def press(self, press: PressRequest | None) -> None:
        """Request a press, and a move."""
        wanted = None if press is None else press.position
        self._is_free = wanted is not None
        if wanted is not None and wanted != self._wanted:
            self._servo.request_position(wanted)
            self._wanted, self._position = wanted, float("nan")
        self._rig.press(None if press is None else replace(press, position=self._position))

    def read(self) -> Readings:
        """Return the readings since the last call, with the servo's position."""
        try:
            if self._servo.poll(is_loaded=not self._is_free) and self._wanted is not None:
                self._position = self._wanted
        except DeviceError as error:
            self._wanted = None
            raise BadMeasurement(str(error)) from None
        readings = self._rig.read()
        return replace(readings, position=np.full(readings.time_s.size, self._position))

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play as the rig inside does."""
        return self._rig.play(sound)

    def close(self) -> None:
        """Stop the servo, and release the tile."""
        try:
            self._servo.close()
        finally:
            self._rig.close()


class SimulatedFootsteps:
    """Feet that step on a plate on the simulated tile, one after another while footsteps are requested.

    The plate is a spring, as stiff as the simulated plate is at its position, with the spread of foam; a load cell is
    under it, and its displacement is tracked from outside. Time is simulated; `in_real_time` it goes with the clock
    while nobody steps, because a real servo takes its time.
    """

    def __init__(self, tile: SimulatedTile, seed: int = 1, in_real_time: bool = False) -> None:
        self._tile, self._in_real_time = tile, in_real_time
        self._random = np.random.default_rng(seed)
        self._press = PressRequest((0.0, 0.0), 0.0)
        self._coming_n, self._coming_mm = np.empty(0), np.empty(0)
        self._samples, self._read_s = 0, time.perf_counter()

    def now(self) -> float:
        """Return the simulated time in seconds: a clock."""
        return self._samples / _RATE_HZ

    def press(self, press: PressRequest | None) -> None:
        """Request footsteps, on a plate at `position`, or to stand clear."""
        self._press = press or PressRequest((0.0, 0.0), 0.0)
        if not self._press.footstep:
            self._coming_n = self._coming_mm = np.empty(0)  # no person steps on it

    def read(self) -> Readings:
        """Return the next readings, a tenth of a second at most."""
        count = round(_BLOCK_S * _RATE_HZ)
        now_s = time.perf_counter()
        if self._in_real_time and not self._press.footstep:
            count = min(count, int(_RATE_HZ * (now_s - self._read_s)))
            if count == 0:
                return NO_READINGS
        self._read_s = now_s
        if self._press.footstep and len(self._coming_n) < count:
            self._begin()
        force, displacement = np.zeros(count), np.zeros(count)
        there = min(count, len(self._coming_n))
        force[:there], displacement[:there] = self._coming_n[:there], self._coming_mm[:there]
        self._coming_n, self._coming_mm = self._coming_n[there:], self._coming_mm[there:]
        time_s = (self._samples + np.arange(count)) / _RATE_HZ
        self._samples += count
        corners = self._tile.corner_forces(np.zeros((count, 2)), force)
        cell = force + _CELL_N * self._random.standard_normal(count)
        tracked = displacement + _TRACKING_MM * self._random.standard_normal(count)
        return Readings(time_s, self._tile.sense(corners, _RATE_HZ), cell, tracked)

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Refuse: nothing plays here."""
        raise BadValue("a plate plays no sound")

    def close(self) -> None:
        """Do nothing: no resources are held."""

    def _begin(self) -> None:
        """Begin a pause, and a footstep after it."""
        random = self._random
        samples = round(_RATE_HZ * random.uniform(*_STANCE_S))
        force = vertical_force(np.linspace(0.0, 1.0, samples), *random.uniform(*_PEAKS_N, 3))
        position = self._press.position
        stiffness = SIMULATED_CALIBRATION.stiffness(0.0 if position is None or np.isnan(position) else position)
        pause = np.zeros(round(_RATE_HZ * random.uniform(*_GAP_S)))
        self._coming_n = np.concatenate([self._coming_n, pause, force])
        displacement = force / (stiffness * random.normal(1.0, _FOAM))
        self._coming_mm = np.concatenate([self._coming_mm, pause, displacement])


def simulated_plate_rig(tile: SimulatedTile, port: str, seed: int = 1) -> PlateRig:
    """Return simulated feet on a plate at a serial port, or on the simulated one, whose time is then simulated, too.

    >>> from underfoot.floor.layout import default_floor
    >>> rig = simulated_plate_rig(SimulatedTile(default_floor(1, 1).tiles[0]), "simulated")
    >>> rig.press(PressRequest((0.0, 0.0), 0.0, position=0.5))
    >>> [float(rig.read().position[-1]) for _ in range(42)][-1]
    0.5
    """
    feet = SimulatedFootsteps(tile, seed, in_real_time=port != SIMULATED)
    return PlateRig(feet, PlateServo(port, clock=feet.now) if port == SIMULATED else PlateServo(port))
