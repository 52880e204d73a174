"""Measurement tables: pairs of reading and force, and presses at known positions.

FSR pairs: `time_s,tile,sensor,reading,force_n`; presses: `tile,x_m,y_m,force_n,r1,r2,r3,r4`, in the tile's frame,
readings in the sensors' own units, and, if known, n1,n2,n3,n4: the sensors' newtons, less those of the empty tile, and
c1,c2,c3,c4: the same, with hysteresis and creep compensated. Columns may be in any order, separated by commas,
semicolons or tabs; between semicolons and tabs a number can have a decimal comma. Other columns and lines that begin
with # are ignored.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.csv_tables import read_csv_table
from underfoot.errors import BadFile, BadValue, require

LARGEST_READING = 65535.0
_LARGEST = 1e9
_PAIRS = ("time_s", "tile", "sensor", "reading", "force_n")
_PRESSES = ("tile", "x_m", "y_m", "force_n", "r1", "r2", "r3", "r4")
_NEWTONS = ("n1", "n2", "n3", "n4"), ("c1", "c2", "c3", "c4")


@dataclass(frozen=True)
class Pairs:
    """Pairs of a sensor's reading and the reference force: all (n,), in file order; `sensor` 0 to 3.

    `BadValue` for columns that are no finite numbers, or not of one length.
    """

    tile: str
    time_s: NDArray[np.float64]
    sensor: NDArray[np.intp]
    reading: NDArray[np.float64]
    force_n: NDArray[np.float64]

    def __post_init__(self) -> None:
        _check_rows(self, time_s=(), sensor=(), reading=(), force_n=())
        wrong = self.sensor[~np.isin(self.sensor, (0, 1, 2, 3))]
        if wrong.size:
            raise BadValue(f"sensor is {wrong[0]:g}; allowed: 0 to 3, for the sensors that files number 1 to 4")
        object.__setattr__(self, "sensor", self.sensor.astype(np.intp))

    def rows(self) -> NDArray[np.float64]:
        """Return time, sensor from 1, reading and force: (n, 4)."""
        return np.stack([self.time_s, self.sensor + 1.0, self.reading, self.force_n], axis=1)


@dataclass(frozen=True)
class Presses:
    """Loads on one tile at known positions: `at_m` (n, 2), `force_n` (n,), `readings` (n, 4).

    `newtons` (n, 4) are the sensors' forces, less those of the empty tile, where they are known; (n, 8) with those in
    which hysteresis and creep are compensated. `BadValue` for other shapes, and positions, loads or readings that are
    no finite numbers.
    """

    tile: str
    at_m: NDArray[np.float64]
    force_n: NDArray[np.float64]
    readings: NDArray[np.float64]
    newtons: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        _check_rows(self, at_m=(2,), force_n=(), readings=(4,))
        if self.newtons is not None:
            object.__setattr__(self, "newtons", np.array(self.newtons, np.float64))
            rows, known = len(self.force_n), self.newtons.shape
            require(known in ((rows, 4), (rows, 8)), "the shape of newtons", known, f"({rows}, 4) or ({rows}, 8)")

    @property
    def static_n(self) -> NDArray[np.float64]:
        """The sensors' forces (n, 4) by their static curves; the readings where these are not known."""
        return self.readings if self.newtons is None else self.newtons[:, :4]

    @property
    def header(self) -> str:
        """The columns of a table of these presses."""
        known = 0 if self.newtons is None else self.newtons.shape[1] // 4
        return ",".join(sum(_NEWTONS[:known], _PRESSES))

    def rows(self) -> NDArray[np.float64]:
        """Return position, force, readings and newtons: (n, 7) to (n, 15)."""
        newtons = self.readings[:, :0] if self.newtons is None else self.newtons
        return np.column_stack([self.at_m, self.force_n, self.readings, newtons])


def _check_rows(measured: Pairs | Presses, **shapes: tuple[int, ...]) -> None:
    """Make arrays of these columns; `BadValue` unless they are finite, and a row of each has its shape."""
    rows: tuple[int, ...] = ()
    for name, shape in shapes.items():
        try:
            column = np.array(getattr(measured, name), np.float64, ndmin=1)
        except (TypeError, ValueError):
            raise BadValue(f"{name} is no array of numbers; allowed: {', '.join(shapes)} of equal length") from None
        rows = rows or column.shape[:1]
        require(column.shape == rows + shape, f"the shape of {name}", column.shape, f"{rows + shape}")
        require(bool(np.isfinite(column).all()), name, column, "finite numbers")
        object.__setattr__(measured, name, column)


PAIR_HEADER = ",".join(_PAIRS)


def read_pairs(path: str | Path, tile: str = "") -> Pairs:
    """Read the pairs of `tile`, which is optional if the file has only one tile.

    Raises `BadFile` with file and line for a file that is not text, a missing column, a cell that is not a number, a
    sensor other than 1 to 4, a reading outside 0 to 65535, or a missing tile.
    """
    names, numbers, columns = _read(path, _PAIRS)
    mine = _of_tile(path, names, tile)
    sensor, reading = columns["sensor"], columns["reading"]
    _within(path, "sensor", sensor, np.isin(sensor, (1.0, 2.0, 3.0, 4.0)), "1 to 4", mine, numbers)
    inside = (reading >= 0.0) & (reading <= LARGEST_READING)
    _within(path, "reading", reading, inside, "0 to 65535", mine, numbers)
    return Pairs(
        str(names[mine][0]),
        columns["time_s"][mine],
        sensor[mine].astype(np.intp) - 1,
        reading[mine],
        columns["force_n"][mine],
    )


def read_presses(path: str | Path, tile: str = "") -> Presses:
    """Read the presses on `tile`, optional if the file has only one tile; `BadFile` as in `read_pairs`."""
    names, numbers, columns = _read(path, _PRESSES, _NEWTONS)
    mine = _of_tile(path, names, tile)
    _within(path, "force_n", columns["force_n"], columns["force_n"] > 0.0, "above 0", mine, numbers)
    at_m = np.stack([columns["x_m"], columns["y_m"]], axis=1)[mine]
    readings = np.stack([columns[f"r{j}"] for j in (1, 2, 3, 4)], axis=1)[mine]
    newtons = [columns[name][mine] for group in _NEWTONS for name in group if name in columns]
    known = np.stack(newtons, axis=1) if newtons else None
    return Presses(str(names[mine][0]), at_m, columns["force_n"][mine], readings, known)


def table(header: str, rows: NDArray[np.float64], tile: str) -> bytes:
    """Return a CSV of numbers; a column `tile` in the header is filled in."""
    names = header.split(",")
    at = names.index("tile") if "tile" in names else None
    before, after = (rows, rows[:, :0]) if at is None else (rows[:, :at], rows[:, at:])
    inserted = [] if at is None else [tile]
    lines = [header]
    for left, right in zip(before, after, strict=True):
        lines.append(",".join([*(f"{v:.10g}" for v in left), *inserted, *(f"{v:.10g}" for v in right)]))
    return ("\n".join(lines) + "\n").encode()


def _read(
    path: str | Path, wanted: tuple[str, ...], optional: tuple[tuple[str, ...], ...] = ()
) -> tuple[NDArray[np.str_], NDArray[np.intp], dict[str, NDArray[np.float64]]]:
    """Return the tile and the line number of each line, and the other columns as numbers.

    Groups of columns that are `optional` follow each other; each is read if its first column is there.
    """
    found = read_csv_table(path, "a table of measurements", remark="#")
    names = [name.strip().lower() for name in found.names]
    for group in optional:
        if group[0] not in names:
            break
        wanted += group
    for name in wanted:
        if names.count(name) != 1:
            there = f"{names.count(name)} columns {name}" if name in names else f"no column {name}"
            raise BadFile(f"{path}: line {found.head} has {there}; allowed: {','.join(wanted)}")
    if not found.rows:
        raise BadFile(f"{path} has no line under its header")
    tiles = np.array([cells[names.index("tile")].strip() for _, cells in found.rows])
    columns = {name: _numbers(path, name, names.index(name), found.rows) for name in wanted if name != "tile"}
    return tiles, np.array([number for number, _ in found.rows]), columns


def _numbers(path: str | Path, name: str, at: int, kept: list[tuple[int, list[str]]]) -> NDArray[np.float64]:
    try:
        values = np.array([float(cells[at]) for _, cells in kept])
    except ValueError:
        values = np.array([_number(cells[at]) for _, cells in kept])
    bad = np.flatnonzero(~(np.abs(values) <= _LARGEST))
    if bad.size:
        number, cells = kept[bad[0]]
        allowed = f"a number, {-_LARGEST:g} to {_LARGEST:g}"
        raise BadFile(f"{path}: line {number}, {name} is {cells[at].strip()[:60]!r}; allowed: {allowed}")
    return values


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return np.nan


def _within(
    path: str | Path,
    name: str,
    values: NDArray[np.float64],
    good: NDArray[np.bool_],
    allowed: str,
    mine: NDArray[np.bool_],
    numbers: NDArray[np.intp],
) -> None:
    """Refuse a value out of range in the lines that are `mine`."""
    bad = np.flatnonzero(mine & ~good)
    if bad.size:
        raise BadFile(f"{path}: line {numbers[bad[0]]}, {name} is {values[bad[0]]:g}; allowed: {allowed}")


def _of_tile(path: str | Path, names: NDArray[np.str_], tile: str) -> NDArray[np.bool_]:
    there = list(dict.fromkeys(names.tolist()))
    if not tile and len(there) > 1:
        raise BadFile(f"{path} has {len(there)} tiles; name one with --tile: {', '.join(there[:8])}")
    if tile and tile not in there:
        raise BadFile(f"{path} has no tile {tile}; allowed: {', '.join(there[:8])}")
    return np.asarray(names == (tile or there[0]))
