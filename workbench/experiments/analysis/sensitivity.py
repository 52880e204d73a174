"""Sensitivity d' and criterion c of yes-no answers, by signal detection theory (Macmillan and Creelman 2005)."""

import math
from collections.abc import Sequence
from statistics import NormalDist

from underfoot.errors import require
from underfoot.experiments.analysis.estimate import Z_95, Estimate, mean_interval
from underfoot.experiments.analysis.findings import Cell, Table
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.table import Row, grouped


def sensitivity(rows: Sequence[Row]) -> list[Table]:
    """Return a table of each person's d' and c; [] unless both "yes" and "no" are right answers.

    >>> row = {"participant": "P1", "correct": "yes", "felt": "yes"}
    >>> (table,) = sensitivity([row] * 16 + [{**row, "felt": "no"}] * 4 + [{**row, "correct": "no"}] * 20)
    >>> [round(cell, 3) for cell in table.rows[0][1:3]]
    [0.8, 1.0]
    """
    scored = [row for row in rows if row.get("felt") in (YES, NO) and row.get("correct") in (YES, NO)]
    if {row["correct"] for row in scored} != {YES, NO}:
        return []
    lines, found = list[tuple[Cell, ...]](), list[Estimate]()
    for (person,), part in grouped(scored, "participant").items():
        said = {right: [row["felt"] == YES for row in part if row["correct"] == right] for right in (YES, NO)}
        hits, false_alarms = ((sum(one), len(one)) for one in (said[YES], said[NO]))
        if hits[1] and false_alarms[1]:
            one, criterion = d_prime(hits, false_alarms)
            found.append(one)
            rates = (hits[0] / hits[1], false_alarms[0] / false_alarms[1])
            lines.append((str(person), *rates, one.value, one.low, one.high, criterion))
    if len(found) > 1:
        mean = mean_interval("d'", [one.value for one in found])
        lines.append(("mean", math.nan, math.nan, mean.value, mean.low, mean.high, math.nan))
    columns = ("participant", "hits", "false alarms", "d'", "95 % from", "to", "criterion c")
    note = "Rates for d' and c are (n + 0.5) / (N + 1) (Hautus 1995); intervals by Gourevitch and Galanter (1967)."
    return [Table("Sensitivity", columns, tuple(lines), note)]


def d_prime(hits: tuple[int, int], false_alarms: tuple[int, int]) -> tuple[Estimate, float]:
    """Return d' with its interval, and the criterion c. `hits` and `false_alarms` are (count, of).

    >>> found, criterion = d_prime((79, 99), (39, 99))  # rates 0.795 and 0.395
    >>> round(found.value, 2), round(criterion, 2)
    (1.09, -0.28)
    """
    normal, z, variance = NormalDist(), [], 0.0
    for count, of in (hits, false_alarms):
        require(0 <= count <= of and of > 0, "count, of", (count, of), "a count of 0 to of, of at least 1")
        rate = (count + 0.5) / (of + 1.0)
        z.append(normal.inv_cdf(rate))
        variance += rate * (1.0 - rate) / (of * normal.pdf(z[-1]) ** 2)
    value, half = z[0] - z[1], Z_95 * math.sqrt(variance)
    return Estimate("d'", value, value - half, value + half), -0.5 * (z[0] + z[1])
