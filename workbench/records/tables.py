"""Tables: columns by name for scripts, and CSV files of commands.

A file is UTF-8 CSV with a header, written beside its target and moved there when it is complete. Commands write line by
line in a `with` block; an earlier file is replaced only if the block ends without an exception. A table of what cannot
be measured again is `live`: it is moved there at once, and gets whole lines, so that a full disk or a killed process
leaves what came before. `BadFile` if it cannot be written.
"""

import csv
import io
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, fields
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import BadFile, BadValue, UnderfootError, refusal, require, shown
from underfoot.files import path_of, replaced, written
from underfoot.floor.contacts import ContactRows
from underfoot.floor.footsteps import BODY_WEIGHT_MEASURES, Step
from underfoot.floor.layout import Floor

if TYPE_CHECKING:
    import pandas

_STEP_COLUMNS = {
    "step": "d",
    "tile": "s",
    "side": "s",
    "start_s": ".6f",
    "contact_ms": ".3f",
    "peak1_n": ".3f",
    "valley_n": ".3f",
    "peak2_n": ".3f",
    "impulse_ns": ".4f",
    "loading_kn_s": ".4f",
    "path_mm": ".3f",
    "net_mm": ".3f",
    "person": "d",
    "cadence_per_min": ".3f",
    "step_length_mm": ".3f",
    "step_width_mm": ".3f",
    "swing_ms": ".3f",
    "double_support_ms": ".3f",
    "heading_deg": ".2f",
    "heading_error_deg": ".2f",
    "spike": "d",
    "contact": "d",
}
_RECORDED = {**_STEP_COLUMNS, "left_out": "s", "body_weight_n": ".1f", **dict.fromkeys(BODY_WEIGHT_MEASURES, ".2f")}
"""Columns of the steps of a recording, with what is noted of them."""
_KINDS = {one.name: one.type for one in fields(Step)}
"""Kinds of values of columns, of which others are float."""


class Table(Mapping[str, NDArray[Any]]):
    """Columns of equal length by their names, in order: `table["force_n"]` is an array. `BadValue` for other columns.

    >>> import numpy as np
    >>> table = Table("presses", {"tile": np.array(["t1", "t2"]), "force_n": np.array([40.0, 55.5])})
    >>> table
    <2 presses: tile, force_n>
    >>> float(table["force_n"].sum())
    95.5
    """

    __eq__, __hash__ = object.__eq__, object.__hash__  # arrays have no one truth value that a mapping could compare

    def __init__(self, what: str, columns: Mapping[str, ArrayLike]) -> None:
        allowed = 'arrays by name, such as {"force_n": force_n}'
        are_named = isinstance(columns, Mapping) and all(isinstance(name, str) for name in columns)
        require(are_named, "columns", columns, allowed)
        try:
            self._what, self._columns = what, {name: np.asarray(column) for name, column in columns.items()}
        except ValueError:  # of lists of unequal length
            raise refusal("columns", columns, allowed) from None
        lengths = {name: len(column) if column.ndim else None for name, column in self._columns.items()}
        is_table = None not in lengths.values() and len(set(lengths.values())) <= 1
        require(is_table, "the length of columns", lengths, "one length of all")

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self:
            raise BadValue(f"{self._what} have no column {shown(name)}; allowed: {', '.join(self._columns)}")
        return self._columns[name]

    def get(self, name: str, default: Any = None) -> Any:  # noqa: ANN401 - of the default's kind
        """Return a column, or `default` where there is none."""
        return self._columns.get(name, default)

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._columns

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(next(iter(self._columns.values()), ()))

    def __repr__(self) -> str:
        return f"<{self.rows} {self._what}: {', '.join(self)}>"

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return a pandas DataFrame with these columns."""
        return to_dataframe(self._columns)

    def save(self, path: str | Path) -> None:
        """Write a CSV file, with empty cells for NaN; `BadFile` if that fails."""
        with _table(path, csv_line(self)) as lines:
            cells = zip(*(column.tolist() for column in self.values()), strict=True)
            lines(csv_line("" if value != value else _cell(value) for value in row) for row in cells)


def to_dataframe(columns: Mapping[str, Any]) -> "pandas.DataFrame":
    """Return a pandas DataFrame of columns by name; `UnderfootError` if pandas is not installed."""
    try:
        import pandas
    except ModuleNotFoundError:
        raise UnderfootError("to_dataframe needs pandas: pip install pandas") from None
    return pandas.DataFrame(dict(columns))


def csv_line(cells: Iterable[str]) -> str:
    """Return a line of a CSV file without its end; a cell with a comma, or another sign of CSV, is in quotes.

    >>> csv_line(["soft, wet", "1.5", ""])
    '"soft, wet",1.5,'
    """
    line = io.StringIO()
    csv.writer(line).writerow(cells)  # whose own line end puts cells with a part of it in quotes
    return line.getvalue().removesuffix("\r\n")


def measures_csv(kind: type[Struct], rows: Iterable[Struct]) -> str:
    """Return measures, structs of numbers of this `kind`, as a CSV with a column for each; empty where not known."""
    lines = (csv_line("" if value != value else f"{value:.3f}" for value in astuple(row)) for row in rows)
    return "\n".join([csv_line(kind.__struct_fields__), *lines])


def force_table(path: str | Path, columns: Mapping[str, Any]) -> None:
    """Write a force CSV, `time_s` to the microsecond and forces in newtons to the millinewton."""
    with _table(path, ",".join(columns)) as lines:
        rows = zip(*(column.tolist() for column in columns.values()), strict=True)
        lines(f"{time_s:.6f}," + ",".join(f"{force:.3f}" for force in forces) for time_s, *forces in rows)


@contextmanager
def step_table(
    path: str | Path, *, live: bool = False, recorded: bool = False
) -> Iterator[Callable[[Iterable[Step]], None]]:
    """Open a step table for writing; yield a function that appends steps, one line each. NaN is an empty cell.

    One of `recorded` steps has what is noted of them.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> with step_table(Path(folder.name) / "steps.csv") as write:
    ...     write([Step(1, "t1", "left", 0.2, 600.0, 760.0, 500.0, 740.0, 320.0, math.nan, 210.0, 200.0)])
    >>> header, line = (Path(folder.name) / "steps.csv").read_text().splitlines()
    >>> print(header.partition(",person")[0])
    step,tile,side,start_s,contact_ms,peak1_n,valley_n,peak2_n,impulse_ns,loading_kn_s,path_mm,net_mm
    >>> line
    '1,t1,left,0.200000,600.000,760.000,500.000,740.000,320.0000,,210.000,200.000,0,,,,,,,,0,0'
    >>> folder.cleanup()
    """
    columns = _RECORDED if recorded else _STEP_COLUMNS
    with (_live_table if live else _table)(path, ",".join(columns)) as lines:
        yield lambda steps: lines(_step_line(step, columns) for step in steps)


def step_columns(steps: Iterable[Step], *, recorded: bool = False) -> dict[str, NDArray[Any]]:
    """Return the columns of a step table by name, each an array of its kind, also without a step.

    >>> {name: str(step_columns([])[name].dtype) for name in ("step", "side", "spike", "peak1_n")}
    {'step': 'int64', 'side': '<U1', 'spike': 'bool', 'peak1_n': 'float64'}
    """
    every = list(steps)
    names = _RECORDED if recorded else _STEP_COLUMNS
    return {name: np.array([getattr(step, name) for step in every], _KINDS.get(name, float)) for name in names}


def recorded_step_lines(steps: Iterable[Step]) -> list[str]:
    """Return the lines of a table of recorded steps, header first."""
    return [",".join(_RECORDED), *(_step_line(step, _RECORDED) for step in steps)]


@contextmanager
def contact_table(path: str | Path, floor: Floor, *, live: bool = False) -> Iterator[Callable[[ContactRows], None]]:
    """Open a contact table for writing, in the floor's frame; yield a function that appends rows, one line each."""
    with (_live_table if live else _table)(path, "time_s,contact,x_m,y_m,force_n,tiles") as lines:
        yield lambda rows: lines(_contact_lines(rows, floor))


def require_table_name(path: str | Path) -> None:
    """Raise `BadFile` for a name that says that the file is something else than a table."""
    if path_of(path).suffix.lower() not in ("", ".csv", ".txt"):
        raise BadFile(f"{path} cannot be written: tables are CSV; allowed: a name that ends in .csv")


@contextmanager
def _table(path: str | Path, header: str) -> Iterator[Callable[[Iterable[str]], None]]:
    require_table_name(path)
    with replaced(path) as part:
        with written(path):
            file = part.open("w", encoding="utf-8", newline="\n")

        def lines(texts: Iterable[str]) -> None:
            with written(path):
                file.writelines(f"{text}\n" for text in texts)

        try:
            lines([header])
            yield lines
        finally:
            with written(path):
                file.close()


@contextmanager
def _live_table(path: str | Path, header: str) -> Iterator[Callable[[Iterable[str]], None]]:
    with _table(path, header):
        pass
    with written(path):
        file = path_of(path).open("ab", buffering=0)

    def lines(texts: Iterable[str]) -> None:
        left = memoryview("".join(f"{text}\n" for text in texts).encode())
        whole = file.tell()
        with written(path):
            try:
                while left:  # a disk may take a part
                    left = left[file.write(left) :]
            except OSError:
                file.truncate(whole)
                raise

    with file:
        yield lines


def _cell(value: object) -> str:
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _step_line(step: Step, columns: Mapping[str, str]) -> str:
    cells = ((getattr(step, name), form) for name, form in columns.items())
    return csv_line("" if isinstance(v, float) and math.isnan(v) else format(v, form) for v, form in cells)


def _contact_lines(rows: ContactRows, floor: Floor) -> Iterator[str]:
    columns = (rows.time_s, rows.contact, rows.x_m, rows.y_m, rows.force_n)
    table = zip(*(column.tolist() for column in columns), rows.tiles(floor), strict=True)
    return (f"{t:.6f},{contact},{x:.6f},{y:.6f},{force:.3f},{tiles}" for t, contact, x, y, force, tiles in table)
