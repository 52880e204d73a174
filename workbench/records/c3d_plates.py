"""Force plates of a C3D file as a floor: their corners are its tiles, their forces its corner forces.

Types 1 to 4 of the C3D manual. A plate of type 3 has four vertical forces of its own. Of the others the vertical force
and the centre of pressure are given to four sensors in the corners: of the same sum and moments.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile, BadValue
from underfoot.floor.forces import LEAST_HZ, MOST_HZ, ForceSeries
from underfoot.floor.layout import Floor, Tile
from underfoot.parameters import IDENTIFIER

PLATE_SIGNS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Corners and sensors of a plate in its own frame, in the manual's order."""
_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
_LENGTHS_M = {"mm": 1e-3, "mil": 1e-3, "cm": 1e-2, "cen": 1e-2, "m": 1.0, "met": 1.0}
"""Units of length by their first three letters: some are written out, or cut after four."""
_MOMENTS_NM = {"nmm": 1e-3, "ncm": 1e-2, "nm": 1.0, "knmm": 1.0, "knm": 1e3}
"""Units of moments: a file in millimetres may have its moments in N m. Without a unit it is that of lengths."""
_LEVEL = 0.02
"""Corners of a plate are level when their heights differ by less, relative to its sides: they are measured."""
MOST_FRAMES = 65_535
"""Frames that a header can count; with this number it tells nothing."""
_BIG_ENDIAN = 86
"""The manual's number of processors of SGI and MIPS; 84 is Intel, 85 DEC, both little-endian."""
_LEAST_N = 1.0
"""Below this force there is no centre of pressure."""


def read_plates(path: str | Path) -> tuple[ForceSeries, Floor]:
    """Read the forces of all plates, and their floor; `BadFile` names what cannot be read.

    A press is positive, whichever way the file's plates look.
    """
    try:
        import ezc3d
    except ImportError:
        raise BadFile(f"{path} cannot be read: ezc3d is missing; install underfoot[c3d]") from None
    try:
        content = ezc3d.c3d(str(path))
        parameters = content["parameters"]
        samples = np.asarray(content["data"]["analogs"], np.float64)[0]
        rate_hz = float(np.ravel(parameters["ANALOG"]["RATE"]["value"])[0])
        plates = {
            name: parameters["FORCE_PLATFORM"][name]["value"] for name in ("TYPE", "CORNERS", "ORIGIN", "CHANNEL")
        }
        count = int(np.ravel(parameters["FORCE_PLATFORM"]["USED"]["value"])[0])
    except (OSError, RuntimeError, ValueError, KeyError, IndexError, MemoryError) as error:
        raise BadFile(f"{path} is no C3D file that can be read: {' '.join(str(error).split())[:120]}") from None
    _require_whole(path, content["data"]["points"].shape[2])
    if count < 1:
        raise BadFile(f"{path} has no force plates; allowed: FORCE_PLATFORM with plates of type 1 to 4")
    if samples.shape[1] < 2:
        raise BadFile(f"{path} has no force samples")
    if not LEAST_HZ <= rate_hz <= MOST_HZ:
        raise BadFile(f"{path}: ANALOG:RATE is {rate_hz:g}; allowed: {LEAST_HZ:g} to {MOST_HZ:g} Hz")
    length = _text(parameters["POINT"].get("UNITS")) or "mm"
    scale = _LENGTHS_M.get(length.lower()[:3])
    if scale is None:
        raise BadFile(f"{path}: POINT:UNITS is {length!r}; allowed: mm, cm, m")
    names, units = _tile_names(parameters, count), _units(parameters["ANALOG"])
    tiles, forces = [], []
    for number in range(count):
        try:
            plate = _Plate(path, number, plates, parameters["FORCE_PLATFORM"], scale, units)
        except (IndexError, KeyError, ValueError):
            raise BadFile(
                f"{path}: plate {number + 1} is not described; allowed: TYPE, CORNERS, ORIGIN and CHANNEL (and "
                f"CAL_MATRIX for type 4) for each of the {count} plates of USED"
            ) from None
        tiles.append(plate.tile(names[number]))
        forces.append(plate.corner_forces(samples))
    force_n = np.stack(forces, axis=1)
    try:
        floor = Floor(tuple(tiles), f"plates of {Path(path).stem}")
    except BadValue as error:
        raise BadFile(f"{path}: {error}") from None
    return ForceSeries(np.arange(len(force_n)) / rate_hz, force_n, rate_hz), floor


def _require_whole(path: str | Path, found: int) -> None:
    """Raise `BadFile` for a file that ends before its header says, such as one whose copying was stopped.

    ezc3d reads what there is, and changes the header that it returns, so this reads the file's own: words 4 and 5 are
    the first and the last frame, and the fourth byte of the parameters is the kind of processor.
    """
    with Path(path).open("rb") as file:
        header = file.read(512)
        file.seek(512 * (header[0] - 1) + 3)
        order: Literal["big", "little"] = "big" if file.read(1) == bytes([_BIG_ENDIAN]) else "little"
    first, last = (int.from_bytes(header[at : at + 2], order) for at in (6, 8))
    told = last - first + 1
    if found < told and last < MOST_FRAMES:
        raise BadFile(f"{path} ends after {found} of its {told} frames; allowed: a whole file; copy or export it again")


class _Plate:
    """One plate: where it lies, and what its channels say."""

    def __init__(
        self,
        path: str | Path,
        number: int,
        plates: dict[str, Any],
        group: Mapping[str, Any],
        scale: float,
        units: list[str],
    ) -> None:
        self._where, self._scale = f"{path}: plate {number + 1}", scale
        self.type = int(np.ravel(plates["TYPE"])[number])
        if self.type not in _CHANNELS:
            raise BadFile(f"{self._where} has type {self.type}; allowed: 1, 2, 3, 4")
        corners_m = scale * np.asarray(plates["CORNERS"], np.float64).reshape(3, 4, -1, order="A")
        if not np.isfinite(corners_m).all():
            raise BadFile(f"{self._where} has corners that are not finite; allowed: numbers")
        up = int(np.ptp(corners_m[:, :, 0], axis=1).argmin())  # the axis along which the first plate is thin
        self.corners_m = np.roll(corners_m[:, :, number], 2 - up, axis=0).T
        origin_m = scale * np.asarray(plates["ORIGIN"], np.float64).reshape(3, -1)[:, number]
        self.origin_m = -origin_m if origin_m[2] > 0.0 else origin_m
        """The surface as seen from the origin: above it, so z is negative. Many files tell the opposite vector."""
        self.channels = np.asarray(plates["CHANNEL"], np.intp)[np.arange(_CHANNELS[self.type]), number] - 1
        force, moment = (
            re.sub(r"[^a-z]", "", units[at].lower()) if 0 <= at < len(units) else ""
            for at in self.channels[[4 if self.type == 3 else 2, 3]]
        )
        self._force_scale = 1e3 if force == "kn" and self.type != 4 else 1.0
        self._moment_scale = _MOMENTS_NM.get(moment, scale)
        if self.type == 4:
            self._calibration = np.asarray(group["CAL_MATRIX"]["value"], np.float64)[:, :, number]
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

    def corner_forces(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the forces of the four sensors (n, 4) in newtons, positive when pressed."""
        if self.channels.min() < 0 or self.channels.max() >= len(samples):
            raise BadFile(f"{self._where} has channels up to {self.channels.max() + 1}; allowed: 1 to {len(samples)}")
        values = samples[self.channels]
        if not np.isfinite(values).all():
            raise BadFile(f"{self._where} has samples that are not finite; allowed: numbers")
        if self.type == 4:
            values = self._calibration @ values
        if self.type == 3:
            force_n = self._force_scale * values[4:8].T
        else:
            force_n = self._shared_out(*self._vertical(values))
        if self._down:  # in the order of a tile's sensors: counter-clockwise as seen from above
            force_n = force_n[:, ::-1]
        total = force_n.sum(axis=1)
        return -force_n if -total.min() > total.max() else force_n

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


def _tile_names(parameters: Mapping[str, Any], count: int) -> list[str]:
    """Return the tiles' ids from a file written by Underfoot; else p1, p2, ..."""
    given = []
    if "UNDERFOOT" in parameters and "TILES" in parameters["UNDERFOOT"]:
        given = [str(name).strip() for name in parameters["UNDERFOOT"]["TILES"]["value"]]
    if len(given) == count == len(set(given)) and all(re.fullmatch(IDENTIFIER, name) for name in given):
        return given
    return [f"p{number + 1}" for number in range(count)]


def _units(analog: Mapping[str, Any]) -> list[str]:
    """Return the unit of each analog channel; those from the 256th on are in UNITS2, UNITS3, ..."""
    parts = [analog[name]["value"] for name in ("UNITS", *(f"UNITS{k}" for k in range(2, 10))) if name in analog]
    return [str(unit) for part in parts for unit in part]


def _text(parameter: Mapping[str, Any]) -> str:
    return str(parameter["value"][0]).strip() if parameter is not None and len(parameter["value"]) else ""
