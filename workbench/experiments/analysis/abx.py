"""Blind comparisons of two patches (ABX): the rate of right answers, and whether it can be chance."""

from collections.abc import Sequence

from underfoot.experiments.analysis.estimate import PEOPLE_NOTE, Estimate, people_share_interval, share_interval
from underfoot.experiments.analysis.findings import Findings, Table
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.blind_comparison import chance_p
from underfoot.experiments.table import Row, grouped, shares_by_person


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's rate of right answers."""
    return [_rate(rows)]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Count right answers per participant and pair of patches, and in total, with the p of at least as many by
    guessing.
    """
    found = Findings("Blind comparison")
    lines = []
    for (person, a, b), part in grouped(rows, "participant", "a", "b").items():
        lines.append((str(person), f"{a or 'A'} or {b or 'B'}", *_figures(part, _rate(part))))
    note = "Intervals are Wilson's; p is of so many right answers or more by guessing: exact binomial."
    if len(lines) > 1:
        rate = people_share_interval("rate", shares_by_person(rows, _is_right).values())
        lines.append(("all", "", *_figures(rows, rate)))
        note += f" {PEOPLE_NOTE}"
    columns = ("participant", "which", "right", "of", "rate", "95 % from", "to", "p")
    found.tables.append(Table("Is X A or B?", columns, tuple(lines), note))
    return found


def _figures(rows: Sequence[Row], rate: Estimate) -> tuple[int, int, float, float, float, float]:
    right = _right(rows)
    return right, len(rows), rate.value, rate.low, rate.high, chance_p(right, len(rows))


def _is_right(row: Row) -> bool:
    return bool(row["answered"] == row["correct"])


def _right(rows: Sequence[Row]) -> int:
    return sum(map(_is_right, rows))


def _rate(rows: Sequence[Row]) -> Estimate:
    return share_interval("rate", _right(rows), len(rows))
