"""Comparisons without a numeric factor: the share of trials in which each stimulus was judged greater."""

from collections.abc import Sequence

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.experiments.analysis.estimate import PEOPLE_NOTE, Estimate, people_share_interval, share_interval
from underfoot.experiments.analysis.findings import LINE_COLOURS, Findings, Table
from underfoot.experiments.table import Row, grouped

_COUNTED = "counted"
"""Column: whether a trial's comparison was judged greater; `constant` adds it to the rows."""


def share_estimates(rows: Sequence[Row]) -> list[Estimate]:
    """Return one person's share of trials in which each stimulus was judged greater, with Wilson's interval.

    >>> rows = [{"stimulus": "snow", "counted": k < 3} for k in range(4)]
    >>> [(one.name, one.value) for one in share_estimates(rows)]
    [('share snow', 0.75)]
    """
    parts = sorted(grouped(rows, "stimulus").items())
    return [share_interval(f"share {name}", _count(part), len(part)) for (name,), part in parts]


def preferences(rows: Sequence[Row]) -> Findings:
    """Return each person's shares, their p by guessing, and the mean over people.

    The p is the probability of a share at least as far from 0.5.
    """
    found = Findings("Constant stimuli")
    by_name: dict[str, list[tuple[int, int]]] = {}
    lines = []
    for (person, name), part in grouped(rows, "participant", "stimulus").items():
        share = share_interval("", _count(part), len(part))
        by_name.setdefault(str(name), []).append((_count(part), len(part)))
        beside = str(part[0].get("other", "") or "nothing") if "other" in part[0] else ""
        lines.append((str(person), str(name), beside, _count(part), len(part), share.value, share.low, share.high,
                      _chance_p(part)))  # fmt: skip
    columns = ("participant", "stimulus", "beside", "judged more", "of", "share", "95 % from", "to", "p")
    note = "Intervals are Wilson's; p is of a share so far from a half by guessing: exact binomial, two sides (SciPy)."
    found.tables.append(Table("Which is more?", columns, tuple(lines), note))
    if len(grouped(rows, "participant")) > 1:
        means = [people_share_interval(name, shares) for name, shares in sorted(by_name.items())]
        over = tuple((mean.name, mean.value, mean.low, mean.high) for mean in means)
        found.tables.append(Table("Shares over people", ("stimulus", "mean", "95 % from", "to"), over, PEOPLE_NOTE))
    found.drawings.append(_drawn(rows))
    return found


def _count(rows: Sequence[Row]) -> int:
    return sum(bool(row[_COUNTED]) for row in rows)


def _chance_p(rows: Sequence[Row]) -> float:
    """Return the p of guessing; NaN for one interval, where "yes" has no chance level of 0.5."""
    if "other" not in rows[0]:
        return float("nan")
    from scipy.stats import binomtest

    return float(binomtest(_count(rows), len(rows)).pvalue)


def _drawn(rows: Sequence[Row]) -> Drawing:
    """Draw the share of each stimulus over all people, as a function of the number of answers; say how many are not."""
    lines, parts = [], sorted(grouped(rows, "stimulus").items())
    for colour, ((name,), part) in zip(LINE_COLOURS, parts, strict=False):
        so_far = np.cumsum([bool(row[_COUNTED]) for row in part]) / np.arange(1, len(part) + 1)
        lines.append(series(str(name), np.arange(1, len(part) + 1), so_far, colour=colour))
    half = (ReferenceLine("y", 0.5, dashed=True),)
    title = "Judged more, so far"
    if len(parts) > len(lines):
        title += f" ({len(lines)} of {len(parts)} stimuli)"
    return Drawing(title, "answers", "share", tuple(lines), y_range=(0.0, 1.0), lines=half)
