"""Shares of right answers by condition: of each stimulus, and of each value of its factors; of pairs, of each pair."""

from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.experiments.analysis.estimate import PEOPLE_NOTE, people_share_interval
from underfoot.experiments.analysis.findings import Cell, Table
from underfoot.experiments.methods.pairs import SAME
from underfoot.experiments.table import Row, factors_of, grouped, shares_by_person


def right_answers(rows: Sequence[Row]) -> list[Table]:
    """Return a table of right answers by condition; [] if no trial has a right answer.

    >>> rows = [{"participant": "P1", "stimulus": name, "right": k} for name in ("sand", "ice") for k in (0, 1, 1, 1)]
    >>> [row[:5] for row in right_answers(rows)[0].rows]
    [('all', 1, 6, 8, 0.75), ('ice', 1, 3, 4, 0.75), ('sand', 1, 3, 4, 0.75)]
    """
    scored = [{**(_of_pair(row) if SAME in row else row), "right": int(row["right"])} for row in rows if "right" in row]
    if not scored:
        return []
    lines = [_line("all", scored)]
    for factor in factors_of(scored):
        parts = grouped([row for row in scored if factor in row], factor)
        if len(parts) < len(grouped(scored, "stimulus")):  # else the factor has the same groups as the stimuli
            lines += [_line(f"{factor}: {value}", part) for (value,), part in _in_order(parts)]
    lines += [_line(str(name), part) for (name,), part in _in_order(grouped(scored, "stimulus"))]
    columns = ("condition", "people", "right", "of", "share", "95 % from", "to")
    return [Table("Right answers", columns, tuple(lines), f"Of one person Wilson's intervals. {PEOPLE_NOTE}")]


def _of_pair(row: Row) -> Row:
    """Return a row of both of a pair in one order, without factors, which are those of the first alone."""
    both = sorted((str(row["stimulus"]), str(row["other"])))
    return {"participant": row["participant"], "stimulus": " ".join(both)}


def _in_order(parts: Mapping[tuple[Any, ...], list[Row]]) -> list[tuple[tuple[Any, ...], list[Row]]]:
    """Return the parts sorted by value, numbers before text, because each person has a different order of trials."""
    return sorted(parts.items(), key=lambda part: [(isinstance(value, str), value) for value in part[0]])


def _line(name: str, rows: Sequence[Row]) -> tuple[Cell, ...]:
    people = shares_by_person(rows, lambda row: bool(row["right"]))
    share = people_share_interval(name, people.values())
    right = sum(count for count, _ in people.values())
    return (name, len(people), right, len(rows), share.value, share.low, share.high)
