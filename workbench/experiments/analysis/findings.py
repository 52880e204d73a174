"""Results of an analysis: tables and drawings, and remarks on what could not be computed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from underfoot.drawing import Drawing, Series, series
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.comparisons import DIFFERENCE, Test
from underfoot.experiments.analysis.estimate import Estimate, mean_interval

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


def means_table(title: str, first: str, rows: Sequence[tuple[str, str, Sequence[float], str]], note: str = "") -> Table:
    """Return a table of means of people's values, with Student's intervals, standard deviations and how many people.

    A row is the text of the `first` column, what the mean is of, the values, NaN for who has none, and their unit.

    >>> means_table("Means", "in", [("dB", "pse TD", [1.0, 3.0, math.nan], "dB")]).rows[0][-3:]
    ('dB', 1.4142135623730951, 2)
    """
    several = [[float(value) for value in values if math.isfinite(value)] for _, _, values, _ in rows]
    means = [(text, mean_interval(name, values, unit)) for text, name, values, unit in rows]
    table = estimates_table(title, first, means, note)
    further = [(float(np.std(of, ddof=1)) if len(of) > 1 else math.nan, len(of)) for of in several]
    lines = tuple((*row, *more) for row, more in zip(table.rows, further, strict=True))
    return Table(title, (*table.columns, "SD of people", "people"), lines, note)


def people_drawn(title: str, x: str, y: str, lines: Sequence[tuple[str, Estimate]]) -> list[Drawing]:
    """Plot each person's estimates, and the mean of each over people with Student's interval; [] of one person.

    `y` is the label of their axis, with the unit, and `x` that of what they are of, by the words behind an estimate's
    first one: "pse TD" is of TD.

    >>> lines = [("P1", Estimate("pse TD", 1.0)), ("P2", Estimate("pse TD", 3.0))]
    >>> (drawing,) = people_drawn("PSE", "stimulus", "level, dB", lines)
    >>> drawing.x_names, [one.name for one in drawing.series], drawing.series[2].y
    (('TD',), ['each person', '95 %', 'mean'], array([2.]))
    >>> people_drawn("PSE", "stimulus", "level, dB", lines[:1])
    []
    """
    names = list(dict.fromkeys(one.name for _, one in lines))
    if len({person for person, _ in lines}) < 2:
        return []
    several = [[one.value for _, one in lines if one.name == name] for name in names]
    means, at = [mean_interval("", of) for of in several], np.arange(1.0, len(names) + 1.0)
    drawn = (
        series("each person", np.repeat(at - 0.15, [*map(len, several)]), np.concatenate(several), "dots", "muted"),
        bars("95 %", at, [mean.low for mean in means], [mean.high for mean in means]),
        series("mean", at, [mean.value for mean in means], "dots"),
    )
    return [Drawing(title, x, y, drawn, x_names=tuple(name.partition(" ")[2] for name in names))]


def bars(name: str, x: ArrayLike, low: ArrayLike, high: ArrayLike) -> Series:
    """Return vertical lines from `low` to `high` at each `x`."""
    ends = np.column_stack([low, high, np.full(np.size(x), np.nan)])
    return series(name, np.repeat(x, 3), ends.ravel(), colour="force")


def table_of_tests(title: str, tests: Sequence[Test], note: str) -> Table:
    """Return a table of tests."""
    columns: tuple[str, ...] = ("test", "statistic", "value", "df", "p", "effect", "size")
    rows = list[tuple[Cell, ...]]()
    tested = next((test.tested.name for test in tests if test.tested is not None), "")
    if tested:
        columns = (*columns, tested, "95 % from", "to")
    if tested == DIFFERENCE:
        note = f"{note} Differences are means over people, with Student's interval of each by itself.".lstrip()
    for test in tests:
        df = ", ".join(f"{value:g}" for value in test.df)
        of = test.tested or Estimate(tested, math.nan)
        more = (of.value, of.low, of.high) if tested else ()
        rows.append((test.name, test.statistic, test.value, df, test.p, test.effect, test.size, *more))
    return Table(title, columns, tuple(rows), note)


def cell_text(cell: Cell) -> str:
    """Format a cell for display.

    >>> cell_text(0.00001234), cell_text(12.3456), cell_text(math.nan), cell_text("F")
    ('1.23e-05', '12.35', '', 'F')
    """
    if isinstance(cell, float):
        return "" if math.isnan(cell) else f"{cell:.4g}" if abs(cell) >= 1e-3 or cell == 0.0 else f"{cell:.3g}"
    return str(cell)
