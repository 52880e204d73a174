"""The honest simulator of one tile: sensors that err as sensors do, and a plate that rings as plates do.

Its parameters are a file. What is drawn from the seed (each sensor's own law, how the plate really splits a load, how
far rubber and shaker are from what they should be) is there for tests to ask, never for a wizard.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.documents import read_document, write_document
from underfoot.errors import require
from underfoot.files import read_file, write_file
from underfoot.floor.layout import Point, Tile
from underfoot.kernels import kernel
from underfoot.models import gait
from underfoot.models.filtering import poles
from underfoot.models.signals.random import normal, stream_key, uniform
from underfoot.models.tile import fsr, shaker
from underfoot.models.tile.assembly import Assembly, Foot
from underfoot.models.tile.fsr import Fsr
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.shaker import Shaker
from underfoot.models.tile.suspension import Suspension

FORMAT = "underfoot-simulation"
VERSION = 1
LOADS = ("none", "standing", "corner")
"""What stands on the tile: nothing, a foot in its middle, or a foot three quarters of the way to its first sensor."""
GRAVITY = 9.81


class Split(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How far a real plate is from a bilinear split of its load over the corners. `BadValue` outside the ranges.

    `deviation` is the typical deviation of a corner's force, as a share of the load, over places all over the plate: a
    tile's own is drawn between half and twice that (real plates: 0.7 to 2.8 %). `placement_m` is the deviation of the
    centroid from where it should be, in shift and in scale at the sensors. `shear` is the horizontal force of hands and
    feet, as a share of the vertical one (0.17 in walking); it moves the centroid by that times the sensors' depth: a
    foot's along its way, a hand's in a direction that is drawn once.
    """

    deviation: float = 0.014
    placement_m: float = 0.001
    shear: float = 0.0

    def __post_init__(self) -> None:
        for name, high in (("deviation", 0.2), ("placement_m", 0.05), ("shear", 1.0)):
            value = getattr(self, name)
            require(0.0 <= value <= high, name, value, f"0 to {high:g}")


class Accelerometer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where acceleration is measured, and how well. `BadValue` outside the ranges.

    `place` is a share of the way from the tile's centre to its edges along x and y; the default is the thesis's (figure
    4.13): halfway from the centre to the edge, 15 degrees off the diagonal. `noise` is a density, m/s^2 per root hertz;
    beyond `range_m_s2` it clips.
    """

    place: Point = (0.5, 0.2887)
    noise: float = 1e-4
    range_m_s2: float = 100.0

    def __post_init__(self) -> None:
        require(all(abs(x) <= 1.0 for x in self.place), "place", self.place, "two shares, -1 to 1")
        require(0.0 <= self.noise <= 10.0, "noise", self.noise, "0 to 10")
        require(0.0 < self.range_m_s2 <= 1e5, "range_m_s2", self.range_m_s2, "above 0, up to 1e5")


class TileParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a simulated tile is made of; the default is the thesis's (chapter 4). Raises `BadValue`.

    The suspension carries its `mass_kg` on a tile of `reference_m`; on one of another size the plate weighs by its
    area, the frame by its edges and each shaker as ever. Each of `shakers_m` has `shaker_kg` at the plate. `tolerance`
    is how far rubber, plate and shaker may be from what is said here, as a share. The `walker` follows `path_m`, in the
    floor's frame; without one, round the floor. A `recording`, a force CSV of the same tiles, walks instead of it, over
    and over; its path is taken from this file's.

    >>> TileParameters.loads(TileParameters().dumps()) == TileParameters()
    True
    >>> TileParameters.loads('{"format": "underfoot-simulation", "version": 1, "sensors": {"creep": 2}}', "a.json")
    Traceback (most recent call last):
    underfoot.errors.BadFile: a.json: $.sensors.creep is 2.0; allowed: 0 to 0.5
    """

    title: str = ""
    sensors: Fsr = Fsr()
    split: Split = Split()
    plate: Plate = Plate()
    suspension: Suspension = Suspension()
    shaker: Shaker = Shaker()
    shaker_kg: float = 1.1
    shakers_m: tuple[Point, ...] = ((0.0, 0.0),)
    reference_m: Point = (0.304, 0.304)
    foot: Foot = Foot()
    accelerometer: Accelerometer = Accelerometer()
    tolerance: float = 0.03
    walker: gait.Walker = gait.Walker()
    path_m: tuple[Point, ...] = ()
    recording: str = ""

    def __post_init__(self) -> None:
        require(0.0 <= self.tolerance <= 0.2, "tolerance", self.tolerance, "0 to 0.2")
        require(0.0 <= self.shaker_kg <= 100.0, "shaker_kg", self.shaker_kg, "0 to 100 kg")
        require(len(self.shakers_m) > 0, "shakers_m", self.shakers_m, "at least one place")
        require(all(0.0 < x <= 100.0 for x in self.reference_m), "reference_m", self.reference_m, "two lengths above 0")
        least = self.plate.mass_kg(self.reference_m) + len(self.shakers_m) * self.shaker_kg
        mass = self.suspension.mass_kg
        require(mass > least, "suspension.mass_kg", mass, f"more than plate and shakers weigh, {least:.3g} kg")
        places = (*self.shakers_m, *self.path_m)
        require(
            all(abs(x) <= 1e4 for place in places for x in place), "path_m", self.path_m, "places within 10 km of 0"
        )

    def suspension_of(self, tile: Tile) -> Suspension:
        """The suspension under this tile, with the mass that it carries."""
        bolted = len(self.shakers_m) * self.shaker_kg
        frame = self.suspension.mass_kg - self.plate.mass_kg(self.reference_m) - bolted
        frame *= sum(tile.size_m) / sum(self.reference_m)
        return msgspec.structs.replace(self.suspension, mass_kg=self.plate.mass_kg(tile.size_m) + bolted + frame)

    def heard_at_m(self, tile: Tile) -> Point:
        """Where the accelerometer sits, in the tile's frame."""
        x, y = self.accelerometer.place
        return 0.5 * x * tile.size_m[0], 0.5 * y * tile.size_m[1]

    def assembly(self, tile: Tile, load: str = "none") -> Assembly:
        """The tile as a body in motion, under one of `LOADS`; `BadValue` where it cannot be built on this tile."""
        require(load in LOADS, "load", load, ", ".join(LOADS))
        x, y = tile.sensors_m[0]
        return Assembly(
            self.plate,
            self.suspension_of(tile),
            tile.size_m,
            tile.sensors_m,
            self.shakers_m,
            self.shaker_kg,
            None if load == "none" else self.foot,
            (0.75 * x, 0.75 * y) if load == "corner" else (0.0, 0.0),
        )

    def drawn(self, *names: object) -> "TileParameters":
        """The parameters of one tile of this kind: everything within `tolerance`; sensors are drawn by themselves."""
        key = stream_key("tile", *names)
        near = [1.0 + self.tolerance * (2.0 * uniform(key, draw) - 1.0) for draw in range(5)]
        replace = msgspec.structs.replace
        return replace(
            self,
            plate=replace(self.plate, modulus_pa=self.plate.modulus_pa * near[0]),
            suspension=replace(self.suspension, modulus_pa=self.suspension.modulus_pa * near[1]),
            shaker=replace(
                self.shaker,
                force_n=self.shaker.force_n * near[2],
                resonance_hz=self.shaker.resonance_hz * near[3],
                colour_hz=self.shaker.colour_hz * near[4],
            ),
        )

    def dumps(self) -> bytes:
        """The parameters as JSON, in a fixed order."""
        return write_document(FORMAT, VERSION, self)

    @staticmethod
    def loads(text: bytes | str, source: str = "simulation") -> "TileParameters":
        """The parameters in `text`; `BadFile` names `source`, the place in it, the value and what is allowed."""
        return read_document(text, source, FORMAT, VERSION, TileParameters)

    @staticmethod
    def load(path: str | Path) -> "TileParameters":
        """The parameters in a file; `BadFile` as `loads` says."""
        found = TileParameters.loads(read_file(path), str(path))
        beside = str(Path(path).parent / found.recording) if found.recording else ""
        return msgspec.structs.replace(found, recording=beside)

    def save(self, path: str | Path) -> None:
        """Write the parameters beside `path` and move them into place."""
        write_file(path, self.dumps() + b"\n")


class SimulatedTile:
    """One tile of the kind that `parameters` describe, drawn by `seed` and the tile's id. It has rested unloaded.

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
        self._lean_m = hand_lean_m(tile, self.parameters.split, seed)
        self._memory = np.zeros((4, fsr.state_size()))
        self._tunings = np.zeros((4, fsr.tuning_size()))
        self.noise_keys = sensor_keys(seed, tile)
        self._noise_key = stream_key("accelerometer", seed, tile.id)
        self._sensed, self._sensor_hz = 0, 0.0
        self._drive_hz, self._load = 0.0, ""
        self._played = 0
        self.parameters.assembly(tile)
        self.settle()

    @property
    def preload_n(self) -> float:
        """What the tile itself weighs on each sensor, newtons."""
        return GRAVITY * self.parameters.suspension_of(self.tile).mass_kg / 4.0

    def tunings(self, rate_hz: float) -> NDArray[np.float64]:
        """The coefficients of the four sensors, as `fsr.sense_tile` reads them at a rate."""
        found = np.zeros((4, fsr.tuning_size()))
        for tuning, part in zip(found, self.parts, strict=True):
            fsr.tune(tuning, part, rate_hz)
        return found

    def settle(self) -> None:
        """Let the sensors forget: as after a long time without a load."""
        self._tune_sensors(self._sensor_hz or 1000.0)
        for sensor in range(4):
            fsr.settle(self._memory[sensor], self._tunings[sensor], self.preload_n)

    def corner_forces(
        self, at_m: ArrayLike, force_n: ArrayLike, shear_n: ArrayLike = (0.0, 0.0)
    ) -> NDArray[np.float64]:
        """What each corner carries of a force at `at_m` (..., 2), tile frame: newtons, shape (..., 4).

        A corner gives up at most its share of the plate's own weight; then it has lifted, and the other three carry
        what there is (`seat`). `shear_n` (..., 2) is a horizontal force on the surface; vertical sensors feel it as a
        shift of the centroid by depth times shear over force. `BadValue` for what is not finite.
        """
        at, force = np.asarray(at_m, dtype=np.float64), np.asarray(force_n, dtype=np.float64)
        require(at.shape[-1:] == (2,) and bool(np.isfinite(at).all()), "at_m", at_m, "finite places (x, y)")
        require(bool(np.isfinite(force).all()), "force_n", force_n, "finite forces")
        moments = force[..., None] * (at + self._lean_m) + self.tile.sensor_depth_m * np.asarray(shear_n, float)
        loaded = np.where(force != 0.0, force, 1.0)[..., None]
        place = moments / loaded
        ideal = gait.corner_forces(force, place[..., 0], place[..., 1], self.tile.sensors_m)
        carried = np.atleast_2d(ideal @ self.split.T + self.preload_n)
        _seat_all(carried.reshape(-1, 4), self.twist)
        return carried.reshape(ideal.shape) - self.preload_n

    def sense(self, forces_n: ArrayLike, rate_hz: float = 1000.0) -> NDArray[np.float64]:
        """Readings of the forces (n, 4) on the corners, one after another: whole numbers 0 to 65535, shape (n, 4).

        The sensors remember what they carried before. How readings are cut into calls does not matter. `BadValue` for
        forces that are not finite, and for a rate outside 1 to 1e6 Hz.
        """
        forces = np.asarray(forces_n, dtype=np.float64)
        require(forces.ndim == 2 and forces.shape[1] == 4, "forces_n", forces.shape, "shape (n, 4)")
        require(bool(np.isfinite(forces).all()), "forces_n", "not finite", "finite forces")
        self._tune_sensors(rate_hz)
        counts = np.empty_like(forces)
        loads = np.ascontiguousarray(forces + self.preload_n)
        fsr.sense_tile(self._memory, self._tunings, self.noise_keys, loads, counts, self._sensed, len(forces))
        self._sensed += len(forces)
        return counts

    def respond(self, drive: ArrayLike, rate_hz: float, load: str = "none") -> NDArray[np.float64]:
        """Acceleration at the accelerometer's place, m/s^2, shape (n,), of a drive (n,) at full scale 1, clipped there.

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
        _hear(given, device.range_m_s2, deviation, self._noise_key, self._played, given.size)
        self._played += given.size
        return given

    def transfer(
        self, frequencies_hz: ArrayLike, load: str = "none", at_m: ArrayLike | None = None
    ) -> NDArray[np.complex128]:
        """The truth of `respond` for small signals: m/s^2 a full-scale unit, complex; also at other places."""
        place = self.parameters.heard_at_m(self.tile) if at_m is None else at_m
        force = self.parameters.shaker.transfer(frequencies_hz)
        return force * self.parameters.assembly(self.tile, load).transfer(frequencies_hz, place)

    def _tune_sensors(self, rate_hz: float) -> None:
        require(1.0 <= rate_hz <= 1e6, "rate_hz", rate_hz, "1 to 1e6 Hz")
        if rate_hz != self._sensor_hz:
            self._tunings, self._sensor_hz = self.tunings(rate_hz), rate_hz


class Plant:
    """From drive to acceleration at one place, in real time: shaker, its compression, plate and what stands on it.

    `run` allocates nothing.
    """

    def __init__(
        self, tile: Tile, parameters: TileParameters, rate_hz: float, load: str = "none", at_m: Sequence[float] = ()
    ) -> None:
        place = at_m or parameters.heard_at_m(tile)
        self._shaker = parameters.shaker.poles().memory(rate_hz)
        self._compression = parameters.shaker.compression()
        self._body = parameters.assembly(tile, load).poles(place).memory(rate_hz)

    def run(self, drive: NDArray[np.float64], out: NDArray[np.float64], n: int) -> None:
        """n samples of drive, full scale 1, into acceleration, m/s^2; the two may be the same array."""
        poles.run(*self._shaker, drive, out, n)
        shaker.compress(self._compression, out, out, n)
        poles.run(*self._body, out, out, n)


def drawn_split(tile: Tile, split: Split, seed: int) -> NDArray[np.float64]:
    """What makes of bilinear corner forces (4,) those of a real plate: a matrix (4, 4), drawn.

    In terms of load, its two moments and the twist (+ - + -) that no moment sees: the sum is kept, the moments are
    those of a slightly shifted and scaled place, and twist is added that varies over the plate. `BadValue` for sensors
    that are not the corners of a rectangle along the tile's axes.
    """
    key = stream_key("split", seed, tile.id)
    draws = [normal(key, draw) for draw in range(10)]
    sensors = np.array(tile.sensors_m)
    centred = sensors - sensors.mean(axis=0)
    half = np.abs(centred).max(axis=0)
    upright = (
        half.min() > 0.0 and np.allclose(np.abs(centred), half, rtol=1e-6) and len(np.unique(centred > 0, axis=0)) == 4
    )
    require(bool(upright), "sensors_m", tile.sensors_m, "the corners of a rectangle along the tile's axes")
    signs = np.sign(centred)
    basis = np.stack([np.ones(4), signs[:, 0], signs[:, 1], signs[:, 0] * signs[:, 1]])
    change = np.eye(4)
    for axis in range(2):
        shift, own, other = (split.placement_m / half[axis] * draw for draw in draws[3 * axis : 3 * axis + 3])
        change[1 + axis, 0] += shift
        change[1 + axis, 1 + axis] += own
        change[1 + axis, 2 - axis] += other
    twist = np.array(draws[6:])
    size = math.sqrt(float(twist**2 @ [1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 9.0]))
    # A corner has a quarter of the twist.
    drawn = 4.0 * split.deviation * 2.0 ** (2.0 * uniform(key, 100) - 1.0)
    change[3] += drawn * twist / size
    return 0.25 * basis.T @ change @ basis


def corner_twist(tile: Tile) -> NDArray[np.float64]:
    """The forces on the corners (4,) of which neither the sum nor a moment tells: + - + - round the tile."""
    centred = np.array(tile.sensors_m) - np.mean(tile.sensors_m, axis=0)
    return np.asarray(np.sign(centred[:, 0] * centred[:, 1]))


@kernel
def seat(carried, twist):
    """Let go the corners that would pull: on rubber a corner can only push.

    Of what four corners carry (4,), the plate's own weight with it, only the twist is open; it is changed as little as
    lifts the one that pulls off its sensor. Sum and both moments stay. A plate that would tip, for it is pressed beyond
    its sensors, keeps what holds it down as forces below 0, shared by the two corners there.
    """
    least, most = -math.inf, math.inf
    for corner in range(4):
        if twist[corner] > 0.0:
            least = max(least, -carried[corner])
        else:
            most = min(most, carried[corner])
    change = min(max(0.0, least), most) if least <= most else 0.5 * (least + most)
    for corner in range(4):
        carried[corner] += change * twist[corner]


@kernel
def _seat_all(carried, twist):
    for i in range(len(carried)):
        seat(carried[i], twist)


def hand_lean_m(tile: Tile, split: Split, seed: int) -> NDArray[np.float64]:
    """How far vertical sensors misplace a hand that pushes sideways as it presses, in a direction drawn: (2,)."""
    turn = 2.0 * math.pi * uniform(stream_key("lean", seed, tile.id), 0)
    return tile.sensor_depth_m * split.shear * np.array([math.cos(turn), math.sin(turn)])


def sensor_keys(seed: int, tile: Tile) -> NDArray[np.uint64]:
    """The keys of the noise of a tile's four sensors."""
    return np.array([stream_key("sensor noise", seed, tile.id, sensor) for sensor in range(4)], dtype=np.uint64)


@kernel
def _hear(signal, most, deviation, key, frame, n):
    """Add the accelerometer's noise to n samples of `signal`, and clip it."""
    for i in range(n):
        heard = signal[i]
        if deviation > 0.0:
            heard += deviation * normal(key, frame + i)
        signal[i] = min(max(heard, -most), most)
