"""Force CSV: `time_s`, then one column per sensor, `<tile>.<1 to 4>`, in newtons.

Cells are separated by commas, semicolons or tabs; between semicolons and tabs, and in quotes, a number may have a
decimal comma. Lines that begin with # are left alone, and so are further columns, and the line `sep=;` of Excel.
"""

import csv
import os
import re
from pathlib import Path

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.csv_tables import delimiter_of, table_text
from underfoot.errors import BadFile
from underfoot.files import head_of, no_file, read_file
from underfoot.floor.layout import Floor
from underfoot.quantities import counted

MOST_BYTES = 512 << 20
"""Largest size of forces in memory, and of a table that they are read from."""
_HEAD_BYTES = 1 << 16
"""Of a table of which only the names of its columns are asked for."""
GAP_PERIODS = 1.5
"""Samples further apart than this many median periods have a gap between them."""

LARGEST = 1e12
"""Largest allowed force in newtons or time in seconds, so that all results are finite."""
_ALLOWED = f"allowed: a number, {-LARGEST:g} to {LARGEST:g}"

LEAST_HZ, MOST_HZ = 20.0, 100_000.0
"""Range of sample rates."""


class ForceSeries(Struct, frozen=True, eq=False):
    """Corner forces of a whole floor: `time_s` (n,) ascending, `force_n` (n, tiles, 4) with the floor's tiles in
    order.

    `rate_hz` is that of `rate_of`. Times are the file's own: where samples are missing they stay missing.
    """

    time_s: NDArray[np.float64]
    force_n: NDArray[np.float64]
    rate_hz: float

    @property
    def seconds(self) -> float:
        """Duration, including one period after the last sample."""
        return float(self.time_s[-1] - self.time_s[0]) + 1.0 / self.rate_hz

    @property
    def is_whole(self) -> NDArray[np.bool_]:
        """Which samples (n,) all tiles have: what a tile of a recording lost is NaN."""
        return np.asarray(np.isfinite(self.force_n).all(axis=(1, 2)))

    def gaps(self) -> NDArray[np.intp]:
        """Return the indices of the last samples before gaps: shape (gaps,).

        >>> ForceSeries(np.array([0.0, 0.1, 0.2, 0.5, 0.6]), np.zeros((5, 1, 4)), 10.0).gaps()
        array([2])
        """
        return np.flatnonzero(np.diff(self.time_s) > GAP_PERIODS / self.rate_hz)


def rate_of(time_s: NDArray[np.float64]) -> float:
    """Return the samples per second of two or more ascending times: by their mean distance, gaps left out.

    The median would follow times that are rounded: at 240 Hz, milliseconds are 4, 4 and 5 apart. A whole number is
    taken where it moves no sample by a quarter of a period.

    >>> rate_of(np.round(np.arange(1000) / 240.0, 3)), rate_of(np.array([0.0, 0.01, 0.02, 0.5, 0.51]))
    (240.0, 100.0)
    """
    apart_s = np.diff(time_s)
    usual_s = apart_s[apart_s <= GAP_PERIODS * np.median(apart_s) * (1.0 + 1e-9)]
    rate_hz = 1.0 / max(float(usual_s.mean()), 1e-9)
    is_whole = abs(rate_hz - round(rate_hz)) * float(usual_s.sum()) < 0.25
    return float(round(rate_hz)) if is_whole else rate_hz


def floor_beside(path: str | Path) -> Path:
    """Return the path of a force CSV's floor: walk.csv has walk.floor.json beside it.

    >>> floor_beside("data/walk.csv").name
    'walk.floor.json'
    """
    return Path(path).parent / f"{Path(path).stem}.floor.json"


def longest_s(rate_hz: float, tiles: int) -> float:
    """Return how many seconds of forces of so many tiles are `MOST_BYTES`."""
    return MOST_BYTES / (rate_hz * 32 * tiles)


def require_room(path: str | Path, length_s: float, rate_hz: float, tiles: int) -> None:
    """Raise `BadFile` if forces of so many tiles and seconds are more than `MOST_BYTES`."""
    most_s = longest_s(rate_hz, tiles)
    if length_s > most_s:
        raise BadFile(
            f"{path}: {length_s:.0f} s are too much to be played at once; allowed: {most_s:.0f} s, such as a stretch "
            "of a recording that `underfoot export` writes as .csv"
        )


def load_floor_beside(path: str | Path) -> Floor:
    """Load the floor of a force CSV; `BadFile` if either is not there, or cannot be read."""
    beside = floor_beside(path)
    if not os.path.isfile(path):
        raise BadFile(f"{path} cannot be read: {no_file(path)}")
    if not beside.is_file():
        _require_force_columns(path)  # a table of steps, say, needs no floor
        raise BadFile(
            f"{path} has no floor beside it ({beside.name}); put one there, or give one by --floor in a terminal, by "
            f'floor= in a script: underfoot.default_floor(1, 2).save("{beside.name}") makes one of two tiles in a row'
        )
    return Floor.load(beside)


def read_forces(path: str | Path, floor: Floor) -> ForceSeries:
    """Read the forces of a CSV file: at least two samples of every sensor of `floor`, with columns in any order.

    Raises `BadFile`, one line that names the file and the line in it: a file that cannot be read or is not text, a
    column that is missing, given twice or of a tile or sensor that the floor does not have, a cell of these that is not
    a number (nor may it be inf or nan), a line with a cell too many or too few, and a time that is not later than the
    one before.
    """
    delimiter, lines, names = _headed(path, read_file(path, MOST_BYTES), floor.ids[0])
    (_, head), *rows = lines
    if delimiter != ",":
        rows = [(number, line.replace(",", ".")) for number, line in rows]
    order = _columns(path, names, floor, lines[0][0])
    if len(rows) < 2:
        raise BadFile(f"{path} has {counted(len(rows), 'sample')}; allowed: 2 or more")
    even = all(line.count(delimiter) == head.count(delimiter) for _, line in rows)
    try:
        table = np.loadtxt([line for _, line in rows], delimiter=delimiter, comments=None, ndmin=2, usecols=order)
    except (ValueError, IndexError) as error:
        raise _fault(path, names, order, delimiter, rows) or BadFile(f"{path}: {error}") from None
    if not even or not (np.abs(table) <= LARGEST).all() or (np.diff(table[:, 0]) <= 0.0).any():
        raise _fault(path, names, order, delimiter, rows) or BadFile(f"{path} is no force CSV that can be read")
    time_s = np.ascontiguousarray(table[:, 0])
    rate_hz = rate_of(time_s)
    if not LEAST_HZ <= rate_hz <= MOST_HZ:
        raise BadFile(
            f"{path}: time_s rises by {1.0 / rate_hz:.6g} from line to line, {rate_hz:.6g} samples a second; "
            f"allowed: {LEAST_HZ:g} to {MOST_HZ:g} a second, with time_s in seconds"
        )
    force_n = np.ascontiguousarray(table[:, 1:]).reshape(len(table), len(floor.tiles), 4)
    return ForceSeries(time_s, force_n, rate_hz)


def _require_force_columns(path: str | Path) -> None:
    """Raise `BadFile` for a file that is no table of forces on any floor."""
    _, lines, names = _headed(path, head_of(path, _HEAD_BYTES) or read_file(path), "t1")
    lacks = "time_s" if "time_s" not in names else "t1.1"
    if lacks == "time_s" or not any(re.fullmatch(r"[\w-]+\.[1-4]", name) for name in names):
        raise _no_column(path, lines[0][0], lacks, names, ["time_s", "t1.1", "t1.2", "t1.4"])


def _headed(path: str | Path, data: bytes, id: str) -> tuple[str, list[tuple[int, str]], list[str]]:
    """Return the delimiter, the numbered lines, and the names in the first; `id` is a tile of the floor."""
    lines = _lines(path, data)
    if not lines:
        raise BadFile(f"{path} is empty; its first line must name the columns: time_s,{id}.1,...")
    delimiter, lines = _delimited(lines)
    return delimiter, lines, [name.strip() for name in lines[0][1].split(delimiter)]


def _lines(path: str | Path, data: bytes) -> list[tuple[int, str]]:
    """Return the numbered lines of a text, without empty ones and remarks."""
    text = table_text(path, data, "a force CSV", "latin-1")  # what is read is ASCII: remarks may be in any older code
    return [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip(' \t"').startswith("#")
    ]


def _delimited(lines: list[tuple[int, str]]) -> tuple[str, list[tuple[int, str]]]:
    """Return the delimiter, and the lines without quotes and Excel's line `sep=;`."""
    delimiter, is_said = delimiter_of(*(line for _, line in [*lines, (0, "")][:2]))
    lines = lines[is_said:]
    if not any('"' in line for _, line in lines):
        return delimiter, lines
    return "\t", [(number, "\t".join(_unquoted(line, delimiter))) for number, line in lines]


def _unquoted(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line without their quotes; a quote ends with its line."""
    try:
        return [cell.replace("\t", " ") for cell in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error:  # a cell of 128 KiB
        return [line]


_DECIMAL_COMMAS = " (with decimal commas, semicolons or tabs between cells)"


def _no_column(path: str | Path, line: int, name: str, names: list[str], expected: list[str]) -> BadFile:
    return BadFile(
        f"{path}: line {line} has no column {name} among {_some(tuple(one[:60] for one in names))}; "
        f"name them time_s, {expected[1]}, {expected[2]} to {expected[-1]}: seconds, and newtons of each corner"
    )


def _columns(path: str | Path, names: list[str], floor: Floor, line: int) -> list[int]:
    """Return the columns of time and of each sensor of the floor, from the header line."""
    expected = ["time_s", *(f"{id}.{sensor}" for id in floor.ids for sensor in range(1, 5))]
    if len(names) == 1 and re.search(r"time_s\s", names[0]):
        raise BadFile(f"{path}: line {line} is a single cell; allowed: commas, semicolons or tabs between cells")
    for column, name in enumerate(names, start=1):
        id, dot, sensor = name.rpartition(".")
        if not dot or name in expected:
            continue
        place = f"{path}: line {line}, column {column} is {name[:60]!r}"
        if id in floor.ids:
            raise BadFile(f"{place}; allowed: {id}.1 to {id}.4, a tile has four sensors")
        if re.fullmatch(r"[1-4]", sensor):
            raise BadFile(f"{place}; allowed: tiles of the floor ({_some(floor.ids)})")
    for name in expected:
        if name not in names:
            raise _no_column(path, line, name, names, expected)
        if names.count(name) > 1:
            raise BadFile(f"{path}: line {line} has the column {name} {names.count(name)} times; allowed: once")
    return [names.index(name) for name in expected]


def _fault(
    path: str | Path, names: list[str], order: list[int], delimiter: str, rows: list[tuple[int, str]]
) -> BadFile | None:
    """Return the first fault of a file that could not be parsed, found line by line."""
    before = -np.inf
    for number, line in rows:
        cells = line.split(delimiter)
        if len(cells) != len(names):
            hint = _DECIMAL_COMMAS if delimiter == "," and len(cells) > len(names) else ""
            columns = counted(len(cells), "column")
            return BadFile(f"{path}: line {number} has {columns}; allowed: {len(names)} as in the first{hint}")
        for column in sorted(order):
            if not _is_number(cells[column]):
                given = cells[column].strip()[:60]
                return BadFile(f"{path}: line {number}, column {names[column]} is {given!r}; {_ALLOWED}")
        now = float(cells[order[0]])
        if now <= before:
            return BadFile(f"{path}: line {number}, time_s is {now!r} after {before!r}; allowed: a later time")
        before = now
    return None


def _is_number(cell: str) -> bool:
    try:
        return "_" not in cell and abs(float(cell)) <= LARGEST
    except ValueError:
        return False


def _some(ids: tuple[str, ...]) -> str:
    return ", ".join(ids) if len(ids) <= 6 else f"{', '.join(ids[:5])}, ... {ids[-1]}"
