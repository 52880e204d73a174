"""Magnitude estimation: relative magnitudes, and the exponent of Stevens's power law.

Numbers are compared by their ratios. Each person's are divided by the geometric mean over their stimuli, because each
chooses a modulus of their own (Lane, Catania and Stevens, J. Acoust. Soc. Am. 33, 1961). The exponent is the slope of a
straight line through logarithms, by least squares.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, Series, series
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.comparisons import paired_t
from underfoot.experiments.analysis.constant import axis_label, further_factors, prepared
from underfoot.experiments.analysis.estimate import Estimate, mean_interval, student_interval
from underfoot.experiments.analysis.findings import Findings, estimates_table
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.table import Row, by_value, grouped

_COLOURS = ("vibration", "force", "contact", "events", "muted")


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's exponents, one for each condition, and the relative magnitude of each stimulus.

    >>> rows = [{"stimulus": f"s{x}", "loudness": x, "magnitude": 3.0 * x**0.5} for x in (1, 4, 16)]
    >>> [(one.name, round(one.value, 9)) for one in estimates(rows, Settings())]
    [('exponent', 0.5), ('magnitude s1', 0.5), ('magnitude s16', 2.0), ('magnitude s4', 1.0)]
    """
    return [*_exponents(rows), *_magnitudes(rows)]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: relative magnitudes, exponents, and tests of exponents between conditions."""
    found = Findings("Magnitude estimation")
    people = {str(person): estimates(part, settings) for (person,), part in grouped(rows, "participant").items()}
    lines = [(person, one) for person, several in people.items() for one in several]
    note = "Magnitudes re the geometric mean over the person's stimuli; Student's intervals."
    found.tables.append(estimates_table("Magnitudes of each person", "participant", lines, note))
    names = {one.name for _, one in lines if not _is_exponent(one.name)}
    lacking = [person for person, several in people.items() if names - {one.name for one in several}]
    if lacking:
        found.remarks.append(f"Magnitudes over people are without {', '.join(lacking)}, who lack a stimulus.")
    values: dict[str, list[float]] = {}
    for person, one in lines:
        if _is_exponent(one.name) or person not in lacking:
            values.setdefault(one.name, []).append(one.value)
    over = [
        ("all people", mean_interval(name, of) if _is_exponent(name) else geometric_interval(name, of))
        for name, of in values.items()
    ]
    note = "Exponents: mean over people. Magnitudes: geometric mean. Student's intervals, of magnitudes for logarithms."
    found.tables.append(estimates_table("Magnitudes over people", "of", over, note))
    try:
        rows, axis, condition = prepared(rows, in_si=True)
    except BadMeasurement as error:
        found.remarks.append(f"No exponent: {error}.")
        return found
    if several := ", ".join(further_factors(rows, axis, condition)):
        found.remarks.append(f"Each exponent is over all values of {several}: they are told apart by {condition} only.")
    compared = {name: of for name, of in values.items() if _is_exponent(name) and len(of) == len(people)}
    if len(compared) > 1:
        note = "Paired t; p times the number of tests."
        found.add_tests(f"Does {condition} change the exponent?", lambda: paired_t(compared), note)
    found.drawings.append(_drawn(rows, axis, condition))
    return found


def _is_exponent(name: str) -> bool:
    return name.split(" ")[0] == "exponent"


def geometric_interval(name: str, values: Sequence[float]) -> Estimate:
    """Return the geometric mean of values with Student's 95 % interval of their logarithms.

    >>> found = geometric_interval("x", [1.0, 10.0, 100.0])
    >>> round(found.value, 9), round(found.low * found.high, 6)
    (10.0, 100.0)
    """
    return _raised(mean_interval(name, [math.log(value) for value in values]))


def _raised(one: Estimate) -> Estimate:
    """Return the estimate of which this is the logarithm."""
    value, low, high = np.exp((one.value, one.low, one.high)).tolist()
    return replace(one, value=value, low=low, high=high)


def _exponents(rows: Sequence[Row]) -> list[Estimate]:
    try:
        rows, axis, condition = prepared(rows, in_si=True)
    except BadMeasurement:
        return []
    found = []
    for value, part in _lines(rows, axis, condition):
        x, y = _logarithms(part, axis)
        if not np.ptp(x):
            continue
        centred, y = x - x.mean(), y - y[0]  # which is 0 where all are alike, and not what a mean leaves
        slope = float(centred @ y / (centred @ centred))
        rest = y - y.mean() - slope * centred
        free = len(x) - 2
        error = math.sqrt(float(rest @ rest) / free / float(centred @ centred)) if free else math.nan
        found.append(student_interval(f"exponent {value}".rstrip(), slope, error, free))
    return found


def _magnitudes(rows: Sequence[Row]) -> list[Estimate]:
    """Return the magnitude of each stimulus re the geometric mean over stimuli; trials vary alike for all of them."""
    parts = sorted((str(name), np.log([row["magnitude"] for row in part])) for name, part in _by_stimulus(rows))
    means = np.array([part.mean() for _, part in parts])
    free = sum(len(part) - 1 for _, part in parts)
    spread = math.sqrt(sum(((part - part.mean()) ** 2).sum() for _, part in parts) / free) if free else math.nan
    shares = np.array([1.0 / len(part) for _, part in parts])
    count = len(parts)
    errors = spread * np.sqrt(shares * (1.0 - 2.0 / count) + shares.sum() / count**2)
    return [
        _raised(student_interval(f"magnitude {name}", mean - means.mean(), error, free))
        for (name, _), mean, error in zip(parts, means.tolist(), errors.tolist(), strict=True)
    ]


def _by_stimulus(rows: Sequence[Row]) -> list[tuple[Any, list[Row]]]:
    return [(name, part) for (name,), part in grouped(rows, "stimulus").items()]


def _lines(rows: Sequence[Row], axis: str, condition: str) -> list[tuple[Any, list[Row]]]:
    """Return the rows that a power law is of, by condition: a logarithm needs a value above 0 on the axis."""
    there = [row for row in rows if row[axis] > 0]
    return by_value(there, condition) if condition else [("", there)] if there else []


def _logarithms(rows: Sequence[Row], axis: str) -> tuple[Any, Any]:
    return np.log([float(row[axis]) for row in rows]), np.log([row["magnitude"] for row in rows])


def _drawn(rows: Sequence[Row], axis: str, condition: str) -> Drawing:
    """Draw geometric means over people with their intervals, and the line of all people together."""
    middle = {person: np.mean([np.log(part).mean() for part in of]) for person, of in _by_person(rows).items()}
    rows = [{**row, "magnitude": row["magnitude"] / math.exp(middle[row["participant"]])} for row in rows]
    drawn: list[Series] = []
    for colour, (value, part) in zip(cycle(_COLOURS), _lines(rows, axis, condition), strict=False):
        points, ends = list[tuple[float, float]](), list[tuple[float, float]]()
        for _, here in _by_stimulus(part):
            people = [_logarithms(one, axis) for one in grouped(here, "participant").values()]
            at = math.exp(np.mean([x.mean() for x, _ in people]))
            mean = geometric_interval("", [math.exp(y.mean()) for _, y in people])
            points.append((at, mean.value))
            ends += [(at, mean.low), (at, mean.high), (at, math.nan)]
        name = f"{value} {condition}" if condition else "geometric mean"
        for label, where, style in ((name, points, "dots"), ("", ends, "line")):
            across, up = np.transpose(where)
            drawn.append(series(label, across, up, style, colour))
        x, y = _logarithms(part, axis)
        if np.ptp(x):
            slope, height = np.polyfit(x, y, 1)
            reach = np.array([x.min(), x.max()])
            drawn.append(series("", np.exp(reach), np.exp(height + slope * reach), "dashed", colour))
    return Drawing("Magnitudes", axis_label(axis), "relative magnitude", tuple(drawn), x_log=True, y_log=True)


def _by_person(rows: Sequence[Row]) -> dict[Any, list[list[float]]]:
    """Return each person's magnitudes, by stimulus."""
    return {
        person: [[row["magnitude"] for row in of] for _, of in _by_stimulus(part)]
        for (person,), part in grouped(rows, "participant").items()
    }
