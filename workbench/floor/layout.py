"""Tiles of a floor: positions, sensors, and output channels of their shakers.

Two frames are used, both in metres. A tile's own has its origin at the tile's centre and its axes along the tile's
edges; the floor's is common to all tiles. A tile's x axis points `rotation_deg` counter-clockwise of the floor's.
"""

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import force_setattr
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import array, integer, is_text, number, plain
from underfoot.documents import read_document
from underfoot.errors import BadFile, BadValue, refusal, require
from underfoot.files import read_file, write_file
from underfoot.parameters import require_identifier
from underfoot.quantities import counted

FORMAT = "underfoot-floor"
VERSION = 1

Point = tuple[float, float]

LOADS = ("none", "standing", "corner")
"""Loads of a tile: none, a foot in its middle, or a foot at three quarters of the distance to its first sensor."""

PLATE = np.dtype(
    [
        ("sensors_m", np.float64, (4, 2)),
        ("centre_m", np.float64, (2,)),
        ("axes", np.float64, (2, 2)),
        ("half_m", np.float64, (2,)),
    ],
    align=True,
)
"""Geometry of a tile as kernels read it: as in `Tile`, with half the size."""


class Tile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One rigid plate on four sensors. Raises `BadValue` for invalid values. Points may be lists or arrays.

    `size_m` and `sensors_m` (exactly four points, in the order of the force columns) are in the tile's frame,
    `centre_m` in the floor's. `sensor_depth_m` is how far the sensors lie below the surface that is walked on.
    `output` is the zero-based channel of the tile's shaker; None means the tile's own place in the floor.

    >>> tile = Tile("t1", (0.3, 0.3), (1.0, 0.0), 90.0, ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1)))
    >>> tile.to_floor([0.1, 0.0])
    array([1. , 0.1])
    >>> tile.to_tile([[1.0, 0.1], [0.95, 0.05]]).round(9) + 0.0
    array([[0.1 , 0.  ],
           [0.05, 0.05]])
    """

    id: str
    size_m: Point
    centre_m: Point
    rotation_deg: float = 0.0
    sensors_m: tuple[Point, ...] = ()
    sensor_depth_m: float = 0.0
    output: int | None = None

    def __post_init__(self) -> None:
        require_identifier("id", self.id)
        force_setattr(self, "size_m", _point("size_m", self.size_m))
        sides = len(self.size_m) == 2 and all(0.0 < side <= 100.0 for side in self.size_m)
        require(sides, "size_m", self.size_m, "two lengths above 0, up to 100 m")
        force_setattr(self, "centre_m", _point("centre_m", self.centre_m))
        require(_is_place(self.centre_m), "centre_m", self.centre_m, "two lengths within 10 km of 0")
        turn_deg = number("rotation_deg", self.rotation_deg, -3600.0, 3600.0, "-3600 to 3600")
        force_setattr(self, "rotation_deg", turn_deg)
        points = _listed(self.sensors_m)
        require(len(points) == 4, "sensors_m", self.sensors_m, "exactly four points")
        force_setattr(self, "sensors_m", tuple(_point("sensors_m", point) for point in points))
        require(all(map(_is_place, self.sensors_m)), "sensors_m", self.sensors_m, "two lengths each, within 10 km of 0")
        depth_m = number("sensor_depth_m", self.sensor_depth_m, 0.0, 100.0, "0 to 100 m")
        force_setattr(self, "sensor_depth_m", depth_m)
        force_setattr(self, "output", plain(self.output))
        is_channel = self.output is None or (isinstance(self.output, int) and 0 <= self.output <= 4095)
        require(is_channel, "output", self.output, "a channel, 0 to 4095")

    @property
    def axes(self) -> NDArray[np.float64]:
        """The tile's axes in the floor's frame, as rows: shape (2, 2)."""
        turn = math.radians(self.rotation_deg)
        return np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])

    def to_floor(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """Convert points of the tile's frame, shape (..., 2), to the floor's."""
        return _points(points_m) @ self.axes + self.centre_m

    def to_tile(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """Convert points of the floor's frame, shape (..., 2), to the tile's."""
        return (_points(points_m) - self.centre_m) @ self.axes.T

    def corners_m(self) -> NDArray[np.float64]:
        """Return the four corners in the floor's frame, counter-clockwise: shape (4, 2)."""
        half = np.array(self.size_m) / 2.0
        return self.to_floor([half, half * (-1, 1), -half, half * (1, -1)])

    def distance_m(self, points_m: ArrayLike) -> NDArray[np.float64]:
        """Return the distance of points of the floor's frame, shape (..., 2), from the tile: shape (...), 0 on it.

        >>> default_floor().tiles[0].distance_m([[0.1, 0.1], [0.1, -0.2]])
        array([0. , 0.2])
        """
        beyond = np.maximum(np.abs(self.to_tile(points_m)) - np.array(self.size_m) / 2.0, 0.0)
        return np.asarray(np.hypot(beyond[..., 0], beyond[..., 1]))


class Floor(msgspec.Struct, frozen=True):
    """Tiles, in the order of their rows in all arrays. Raises `BadValue` without tiles, or for equal ids.

    >>> Floor.loads(default_floor().dumps()) == default_floor()
    True
    >>> default_floor().index("t3")
    2
    """

    tiles: tuple[Tile, ...]
    title: str = ""

    def __repr__(self) -> str:
        return f"<Floor {self.title!r}: {counted(len(self.tiles), 'tile')}>"

    def __post_init__(self) -> None:
        require(is_text(self.title), "title", self.title, "text in UTF-8")
        tiles = _listed(self.tiles)
        require(len(tiles) > 0, "tiles", self.tiles, "at least one tile, in a list")
        require(all(isinstance(tile, Tile) for tile in tiles), "tiles", tiles, "Tiles")
        force_setattr(self, "tiles", tiles)
        seen: set[str] = set()
        for place, tile in enumerate(self.tiles):
            require(tile.id not in seen, f"tiles[{place}].id", tile.id, "an id that no other tile has")
            seen.add(tile.id)

    @property
    def ids(self) -> tuple[str, ...]:
        """The tiles' ids."""
        return tuple(tile.id for tile in self.tiles)

    @property
    def channels(self) -> tuple[int, ...]:
        """The output channel of each tile: its `output`, or its row."""
        return tuple(row if tile.output is None else tile.output for row, tile in enumerate(self.tiles))

    def index(self, id: str) -> int:
        """Return the row of the tile with this id; `BadValue` if there is none."""
        for row, tile in enumerate(self.tiles):  # commands look it up in the output callback: no tuple of all ids
            if tile.id == id:
                return row
        raise refusal("tile", id, ", ".join(self.ids))

    def tile_at(self, point_m: Point) -> Tile | None:
        """Return the tile at a point; None if there is none.

        >>> default_floor().tile_at((0.4, 0.1)).id
        't2'
        """
        return next((tile for tile in self.tiles if tile.distance_m(point_m) == 0.0), None)

    def bounds_m(self) -> NDArray[np.float64]:
        """Return the lower left and the upper right corner of the rectangle around all tiles, shape (2, 2).

        >>> default_floor().bounds_m()
        array([[0.   , 0.   ],
               [0.615, 0.615]])
        """
        corners = np.concatenate([tile.corners_m() for tile in self.tiles])
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    def sensors_m(self) -> NDArray[np.float64]:
        """Return all sensors, each in its tile's frame: shape (tiles, 4, 2)."""
        return np.array([tile.sensors_m for tile in self.tiles], dtype=np.float64)

    def plates(self) -> NDArray[np.void]:
        """Return the tiles' geometry for kernels: shape (tiles,) of `PLATE`."""
        table = np.zeros(len(self.tiles), PLATE)
        for plate, tile in zip(table, self.tiles, strict=True):
            plate["sensors_m"], plate["centre_m"], plate["axes"] = tile.sensors_m, tile.centre_m, tile.axes
            plate["half_m"] = np.array(tile.size_m) / 2.0
        return table

    def gaps_m(self) -> NDArray[np.float64]:
        """Return the gaps between the edges of all pairs of tiles, shape (tiles, tiles); 0 if they touch.

        Tiles of a floor lie side by side: of two that cross without a corner of either on the other, it is not 0.

        >>> default_floor(1, 3).gaps_m().round(3)
        array([[0.   , 0.005, 0.315],
               [0.005, 0.   , 0.005],
               [0.315, 0.005, 0.   ]])
        """
        # Two rectangles that lie apart are nearest at a corner of one of them.
        corners = np.array([tile.corners_m() for tile in self.tiles])
        gaps = np.array([tile.distance_m(corners).min(axis=-1) for tile in self.tiles])
        return np.minimum(gaps, gaps.T)

    def dumps(self) -> bytes:
        """Return the floor as JSON, in a fixed order."""
        tiles = [{key: v for key, v in msgspec.to_builtins(tile).items() if v is not None} for tile in self.tiles]
        title = {"title": self.title} if self.title else {}
        return msgspec.json.format(
            msgspec.json.encode({"format": FORMAT, "version": VERSION, **title, "tiles": tiles}), indent=1
        )

    @staticmethod
    def loads(text: bytes | str, source: str = "floor") -> "Floor":
        """Parse a floor from `text`; `BadFile` names `source`, the place in it, the value and what is allowed.

        >>> Floor.loads('{"format": "underfoot-floor", "version": 7}', "a.floor.json")
        Traceback (most recent call last):
        underfoot.errors.BadFile: a.floor.json: $.version is 7; allowed: 1 (a newer Underfoot may have written it)
        """
        file = read_document(text, source, FORMAT, VERSION, _FloorFile)
        try:
            return Floor(file.tiles, file.title)
        except BadValue as error:
            raise BadFile(f"{source}: $.{error}") from None

    @staticmethod
    def load(path: str | Path) -> "Floor":
        """Load a floor from a file; `BadFile` as in `loads`."""
        return Floor.loads(read_file(path), str(path))

    def save(self, path: str | Path) -> None:
        """Write the floor beside `path` and move it into place."""
        write_file(path, self.dumps() + b"\n")


def default_floor(rows: int = 2, columns: int = 2) -> Floor:
    """Return a floor of the thesis's tiles, 30.5 cm square and 2 cm thick (sections 3.3 and 5.1), in rows along x from
    a corner at 0, 0.

    They stand 5 mm apart. The sensors lie under the corners: square pads 38 mm wide, flush with the edges,
    counter-clockwise from the corner at +x, +y. Ids are t1, t2, ... row by row. Raises `BadValue` unless there are 1
    to 32 rows and columns.

    >>> default_floor(1, 2).tiles[1].centre_m
    (0.4625, 0.1525)
    """
    rows, columns = integer("rows", rows, 1, 32, "1 to 32"), integer("columns", columns, 1, 32, "1 to 32")
    side, apart = 0.305, 0.310
    inset = side / 2.0 - 0.019
    return Floor(
        tuple(
            Tile(
                id=f"t{row * columns + column + 1}",
                size_m=(side, side),
                centre_m=(round(side / 2.0 + column * apart, 6), round(side / 2.0 + row * apart, 6)),
                sensors_m=((inset, inset), (-inset, inset), (-inset, -inset), (inset, -inset)),
                sensor_depth_m=0.02,
            )
            for row in range(rows)
            for column in range(columns)
        ),
        title=f"{rows} x {columns} tiles",
    )


def grid_of(floor: Floor) -> tuple[int, int] | None:
    """Return rows and columns of a floor made by `default_floor`; None for another floor.

    >>> grid_of(default_floor(2, 3))
    (2, 3)
    """
    count = len(floor.tiles)
    sizes = ((rows, count // rows) for rows in range(1, 33) if count % rows == 0 and count // rows <= 32)
    return next((size for size in sizes if floor == default_floor(*size)), None)


class _FloorFile(msgspec.Struct, forbid_unknown_fields=True):
    tiles: tuple[Tile, ...]
    title: str = ""


def _listed(given: Any) -> tuple[Any, ...]:  # noqa: ANN401 - of a script
    """Return what is in a list or an array; nothing for what is neither."""
    try:
        return tuple(given)
    except TypeError:
        return ()


def _point(name: str, given: object) -> Point:
    """Return lengths, which may be in a list or an array, as a file holds them; `BadValue` for what are none."""
    found = array(name, given, "two lengths in metres")  # type: ignore[arg-type]
    require(found.shape == (2,), name, given, "two lengths in metres")
    return float(found[0]), float(found[1])


def _points(given: ArrayLike) -> NDArray[np.float64]:
    return array("points_m", given, "numbers in metres, shape (..., 2)", 2)


def _is_place(point_m: Point) -> bool:
    return len(point_m) == 2 and all(abs(length) <= 10_000.0 for length in point_m)
