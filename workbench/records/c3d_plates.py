"""Force plates of a C3D file as a floor: their corners are its tiles, their forces its corner forces.

Types 1 to 4 of the C3D manual. A plate of type 3 has four vertical forces of its own. Of the others the vertical force
and the centre of pressure are given to four sensors in the corners: of the same sum and moments.
"""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile, BadValue
from underfoot.floor.forces import LEAST_HZ, MOST_HZ, ForceSeries, require_room
from underfoot.floor.layout import Floor, Tile
from underfoot.parameters import IDENTIFIER
from underfoot.records.c3d_files import C3DFile

PLATE_SIGNS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Corners and sensors of a plate in its own frame, in the manual's order."""
_CHANNELS = {1: range(6), 2: range(6), 3: range(4, 8), 4: range(6)}
"""Channels that are read: of type 3 the vertical forces."""
_LENGTHS_M = {"mm": 1e-3, "mil": 1e-3, "cm": 1e-2, "cen": 1e-2, "m": 1.0, "met": 1.0}
"""Units of length by their first three letters: some are written out, or cut after four."""
_FORCES_N = {"n": 1.0, "kn": 1e3, "kgf": 9.80665, "kg": 9.80665, "kp": 9.80665}
_FORCES_N |= dict.fromkeys(("lbf", "lbsf", "lb", "lbs"), 4.4482216152605)
"""Units of forces, in small letters alone. Any other is taken as newtons: many files say V, though SCALE gives N."""
_ARMS_M = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254, "ft": 0.3048}
_MOMENTS_NM = {
    unit: force * arm
    for first, force in _FORCES_N.items()
    for second, arm in _ARMS_M.items()
    for unit in (first + second, second + first)
}
"""Units of moments: a file in millimetres may have its moments in N m. Without a unit it is that of lengths."""
_LEVEL = 0.02
"""Corners of a plate are level when their heights differ by less, relative to its sides: they are measured."""
_LEAST_N = 1.0
"""Below this force there is no centre of pressure."""


def read_plates(path: str | Path) -> tuple[ForceSeries, Floor]:
    """Read the forces of all plates, and their floor; `BadFile` names what cannot be read.

    A press is positive, whichever way the file's plates look.
    """
    file = C3DFile(path)
    plates = _plates(file)
    floor = _floor(file, plates)
    rate_hz = file.number("ANALOG:RATE", 0.0)
    if file.samples < 2:
        raise BadFile(f"{path} has no force samples")
    if not LEAST_HZ <= rate_hz <= MOST_HZ:
        raise BadFile(f"{path}: ANALOG:RATE is {rate_hz:g}; allowed: {LEAST_HZ:g} to {MOST_HZ:g} Hz")
    require_room(path, file.samples / rate_hz, rate_hz, len(plates))
    force_n = np.empty((file.samples, len(plates), 4))
    channels = np.concatenate([plate.channels for plate in plates])
    ends = np.cumsum([len(plate.channels) for plate in plates])[:-1]
    at, pressed = 0, 0.0
    for values in file.analogs(channels):  # an hour of them would take several times the memory of the forces
        part = force_n[at : at + values.shape[1]]
        for number, (plate, one) in enumerate(zip(plates, np.split(values, ends), strict=True)):
            part[:, number] = plate.corner_forces(one)
        loads_n = part.sum(axis=2)
        pressed += float((loads_n * np.abs(loads_n)).sum())
        at += len(part)
    if pressed < 0.0:
        np.negative(force_n, out=force_n)
    return ForceSeries(np.arange(len(force_n)) / rate_hz, force_n, rate_hz), floor


def floor_of_plates(path: str | Path) -> Floor:
    """Return the floor alone, without reading samples; `BadFile` as `read_plates`."""
    file = C3DFile(path)
    return _floor(file, _plates(file))


def _plates(file: C3DFile) -> "list[_Plate]":
    count = round(file.number("FORCE_PLATFORM:USED", 0.0))
    if count < 1:
        raise BadFile(f"{file.path} has no force plates; allowed: FORCE_PLATFORM with plates of type 1 to 4")
    length = next(iter(file.texts.get("POINT:UNITS", [])), "") or "mm"
    scale = _LENGTHS_M.get(length.lower()[:3])
    if scale is None:
        raise BadFile(f"{file.path}: POINT:UNITS is {length!r}; allowed: mm, cm, m")
    plates = []
    for number in range(count):
        try:
            plates.append(_Plate(file, number, scale))
        except (IndexError, KeyError, ValueError):
            raise BadFile(
                f"{file.path}: plate {number + 1} is not described; allowed: TYPE, CORNERS, ORIGIN and CHANNEL (and "
                f"CAL_MATRIX for type 4) for each of the {count} plates of USED"
            ) from None
    return plates


def _floor(file: C3DFile, plates: "list[_Plate]") -> Floor:
    names = _tile_names(file, len(plates))
    tiles = tuple(plate.tile(name) for plate, name in zip(plates, names, strict=True))
    try:
        return Floor(tiles, f"plates of {file.path.stem}")
    except BadValue as error:
        raise BadFile(f"{file.path}: {error}") from None


class _Plate:
    """One plate: where it lies, and what its channels say."""

    def __init__(self, file: C3DFile, number: int, scale: float) -> None:
        def of(name: str) -> NDArray[np.float64]:
            return file.numbers[f"FORCE_PLATFORM:{name}"]

        self._where, self._scale = f"{file.path}: plate {number + 1}", scale
        self.type = int(of("TYPE").ravel()[number])
        if self.type not in _CHANNELS:
            raise BadFile(f"{self._where} has type {self.type}; allowed: 1, 2, 3, 4")
        corners_m = scale * of("CORNERS").reshape(3, 4, -1, order="F")
        if not np.isfinite(corners_m).all():
            raise BadFile(f"{self._where} has corners that are not finite; allowed: numbers")
        up = int(np.ptp(corners_m[:, :, 0], axis=1).argmin())  # the axis along which the first plate is thin
        self.corners_m = np.roll(corners_m[:, :, number], 2 - up, axis=0).T
        origin_m = scale * of("ORIGIN").reshape(3, -1, order="F")[:, number]
        self.origin_m = -origin_m if origin_m[2] > 0.0 else origin_m
        """The surface as seen from the origin: above it, so z is negative. Many files tell the opposite vector."""
        channels = of("CHANNEL").astype(np.intp)[list(_CHANNELS[self.type]), number] - 1
        if channels.min() < 0 or channels.max() >= file.channels:
            told = f"{channels.min() + 1} to {channels.max() + 1}"
            raise BadFile(f"{self._where} has channels {told}; allowed: 1 to {file.channels}")
        self.channels = channels
        """Those that are read, counted from 0."""
        units = file.of_channels("ANALOG:UNITS")
        force, moment = (
            re.sub(r"[^a-z]", "", units[at].lower()) if at < len(units) else ""
            for at in self.channels[[0 if self.type == 3 else 2, 3]]
        )
        self._force_scale = 1.0 if self.type == 4 else _FORCES_N.get(force, 1.0)
        self._moment_scale = _MOMENTS_NM.get(moment, scale)
        if self.type == 4:
            self._calibration = of("CAL_MATRIX")[:, :, number]
        if np.ptp(self.corners_m[:, 2]) > _LEVEL * np.ptp(self.corners_m[:, :2]):
            raise BadFile(f"{self._where} does not lie level; allowed: corners of one height, as of the first plate")
        along = self.corners_m[[0, 3]].mean(axis=0) - self.corners_m[[1, 2]].mean(axis=0)
        across = self.corners_m[[0, 1]].mean(axis=0) - self.corners_m[[3, 2]].mean(axis=0)
        self._size_m = round(float(np.hypot(*along[:2])), 6), round(float(np.hypot(*across[:2])), 6)
        self._rotation_deg = float(np.degrees(np.arctan2(along[1], along[0])))
        self._down = float(along[0] * across[1] - along[1] * across[0]) < 0.0
        """Whether the plate's z points into the floor: then its y is against the tile's."""

    @property
    def _half_m(self) -> NDArray[np.float64]:
        """Half the distances of the sensors: the plate's own for type 3, else its corners."""
        return np.abs(self.origin_m[:2]) if self.type == 3 else np.array(self._size_m) / 2.0

    def tile(self, name: str) -> Tile:
        """Return the plate as a tile."""
        if not self._half_m.all():
            half = "half the sensors' distances in x and y"
            raise BadFile(f"{self._where} has its sensors at one place; allowed: an ORIGIN of {half} for type 3")
        sensors = PLATE_SIGNS * self._half_m
        x, y = self.corners_m[:, :2].mean(axis=0).tolist()
        try:
            return Tile(
                id=name,
                size_m=self._size_m,
                centre_m=(round(x, 9), round(y, 9)),
                rotation_deg=round(self._rotation_deg, 6),
                sensors_m=tuple((float(at), float(up)) for at, up in sensors),
                sensor_depth_m=abs(float(self.origin_m[2])),
            )
        except BadValue as error:
            raise BadFile(f"{self._where}: {error}") from None

    def corner_forces(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the upward forces at the four sensors (n, 4) in newtons, of samples of its channels [channel, n].

        A press is negative where the file has the forces on the plate, positive where it has those on the foot.
        """
        if not np.isfinite(values).all():
            raise BadFile(f"{self._where} has samples that are not finite; allowed: numbers")
        if self.type == 4:
            values = self._calibration @ values
        force_n = self._force_scale * values.T if self.type == 3 else self._shared_out(*self._vertical(values))
        # in the order of a tile's sensors: counter-clockwise as seen from above
        return -force_n[:, ::-1] if self._down else force_n

    def _vertical(self, values: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """Return the vertical force, N, and its moments about the middle of the surface, N m."""
        f_x, f_y, f_z = self._force_scale * values[:3]
        if self.type == 1:  # its channels are the centre of pressure
            x_m, y_m = self._scale * values[3], self._scale * values[4]
            pressed = np.abs(f_z) > _LEAST_N
            return f_z, np.where(pressed, y_m * f_z, 0.0), np.where(pressed, -x_m * f_z, 0.0)
        m_x, m_y = self._moment_scale * values[3], self._moment_scale * values[4]
        x, y, z = self.origin_m
        return f_z, m_x - (y * f_z - z * f_y), m_y - (z * f_x - x * f_z)

    def _shared_out(
        self, f_z: NDArray[np.float64], m_x: NDArray[np.float64], m_y: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the least corner forces with the same sum and moments."""
        a, b = self._half_m
        return 0.25 * (f_z[:, None] + PLATE_SIGNS[:, 1] * m_x[:, None] / b - PLATE_SIGNS[:, 0] * m_y[:, None] / a)


def _tile_names(file: C3DFile, count: int) -> list[str]:
    """Return the tiles' ids from a file written by Underfoot; else p1, p2, ..."""
    given = file.texts.get("UNDERFOOT:TILES", [])
    if len(given) == count == len(set(given)) and all(re.fullmatch(IDENTIFIER, name) for name in given):
        return given
    return [f"p{number + 1}" for number in range(count)]
