"""Results of an analysis: tables and drawings, and remarks on what could not be computed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.comparisons import Test
from underfoot.experiments.analysis.estimate import Estimate

Cell = str | float | int
LINE_COLOURS = ("force", "vibration", "contact", "events", "muted")
"""Of the lines of a plot, in their order."""


@dataclass(frozen=True)
class Table:
    """Rows of cells under `columns`; NaN is an empty cell. `note` explains the table."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


@dataclass
class Findings:
    """Results of one stage: `tables`, `drawings`, and `remarks` on what could not be computed."""

    title: str
    tables: list[Table] = field(default_factory=list)
    drawings: list[Drawing] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)

    def add_tests(self, title: str, make: Callable[[], Sequence[Test]], note: str = "") -> None:
        """Add a table of tests, or a remark if they cannot be computed from these data."""
        try:
            tests = make()
        except BadMeasurement as error:
            self.remarks.append(f"{title}: {error}")
            return
        self.tables.append(table_of_tests(title, tests, note))


def estimates_table(title: str, first: str, rows: Sequence[tuple[str, Estimate]], note: str = "") -> Table:
    """Return a table of estimates with their intervals; `first` is the heading of the first column."""
    return Table(
        title,
        (first, "estimate", "value", "95 % from", "to", "unit"),
        tuple((text, e.name, e.value, e.low, e.high, e.unit) for text, e in rows),
        note,
    )


def table_of_tests(title: str, tests: Sequence[Test], note: str) -> Table:
    """Return a table of tests."""
    rows = []
    for test in tests:
        df = ", ".join(f"{value:g}" for value in test.df)
        rows.append((test.name, test.statistic, test.value, df, test.p, test.effect, test.size))
    return Table(title, ("test", "statistic", "value", "df", "p", "effect", "size"), tuple(rows), note)


def cell_text(cell: Cell) -> str:
    """Format a cell for display.

    >>> cell_text(0.00001234), cell_text(12.3456), cell_text(math.nan), cell_text("F")
    ('1.23e-05', '12.35', '', 'F')
    """
    if isinstance(cell, float):
        return "" if math.isnan(cell) else f"{cell:.4g}" if abs(cell) >= 1e-3 or cell == 0.0 else f"{cell:.3g}"
    return str(cell)
