"""Target selection: rates and times by width, distance and bearing (thesis figure 5.12)."""

import math
from collections.abc import Sequence

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.comparisons import Test, fisher, logistic_regression, shares_compared
from underfoot.experiments.analysis.estimate import (
    PEOPLE_NOTE,
    Estimate,
    mean_interval,
    mixed_share_interval,
    people_share_interval,
)
from underfoot.experiments.analysis.findings import Findings, estimates_table
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.questions import YES
from underfoot.experiments.table import Row, by_value, grouped, shares_by_person

FACTORS = {
    "width": ("width_m", 100.0, "cm"),
    "distance": ("distance_m", 100.0, "cm"),
    "bearing": ("bearing_rad", 1.0, "rad"),
}
NEAR_M, FAR_M = 0.15, 0.25
"""The two distances that the thesis compares (5.6.1)."""


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's selection rates, of all targets and of each width, and the mean time of selections."""
    found = [_rate("rate", rows)]
    for width, part in by_value(rows, "width_m"):
        found.append(_rate(f"rate at {100.0 * float(width):g} cm", part))
    times = [float(row["time_s"]) for row in filter(_is_selected, rows)]
    return [*found, mean_interval("time", times, "s")]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: rates by each factor, a logistic regression, and a test of two distances."""
    found = Findings("Target selection")
    people = [(str(person), _rate("rate", part)) for (person,), part in grouped(rows, "participant").items()]
    found.tables.append(
        estimates_table(
            "Rates of each person", "participant", people, "Wilson's intervals of the widths, put together."
        )
    )
    widths = {float(row["width_m"]) for row in rows}
    is_thesis = (min(widths), max(widths)) == thesis.WIDTHS_M
    for name, (column, factor, unit) in FACTORS.items():
        parts = by_value(rows, column)
        lines = [(f"{factor * float(value):.4g} {unit}", _over_people(part)) for value, part in parts]
        times = [(text, _time_over_people(part)) for (text, _), (_, part) in zip(lines, parts, strict=True)]
        beside = _THESIS if name == "width" and is_thesis else ""
        found.tables.append(estimates_table(f"By {name}", name, lines + times, f"{PEOPLE_NOTE} {beside}".rstrip()))
        found.drawings.append(_drawn(name, rows, beside=name == "width" and is_thesis))
    columns = {f"{n}, {u}": [f * float(row[c]) for row in rows] for n, (c, f, u) in FACTORS.items()}
    success = [_is_selected(row) for row in rows]
    note = f"Printed: {thesis.SELECTION_LOGIT}." if is_thesis else ""
    who = [row["participant"] for row in rows]
    found.add_tests("Logistic regression", lambda: logistic_regression(success, columns, who), note)
    near, far = ([row for row in rows if math.isclose(float(row["distance_m"]), at)] for at in (NEAR_M, FAR_M))
    if near and far:
        note = f"{_BY_FISHER} {thesis.NEAR_AND_FAR}." if is_thesis else ""
        found.add_tests("15 cm against 25 cm", lambda: _distances_compared(near, far, is_thesis=is_thesis), note)
    return found


_THESIS = (
    f"Thesis 5.6.1: {thesis.SELECTED_LARGEST:.0%} of the largest and {thesis.SELECTED_SMALLEST:.0%} of the smallest "
    "buttons were selected."
)
_BY_FISHER = "Fisher's test of all trials is the thesis's: its p is too small where people differ."


def _distances_compared(near: Sequence[Row], far: Sequence[Row], *, is_thesis: bool) -> list[Test]:
    """Test the rates at two distances; beside the thesis's study also by its test, of all trials."""
    near_of, far_of = (shares_by_person(rows, _is_selected) for rows in (near, far))
    tests = shares_compared("distance by success", {"15 cm": near_of, "25 cm": far_of})
    if is_thesis and tests[0].statistic == "t":
        table = [(count, of - count) for count, of in (_selected(near), _selected(far))]
        tests.append(fisher("distance by success, all trials", table))
    return tests


def _selected(rows: Sequence[Row]) -> tuple[int, int]:
    """Return how many buttons were selected, and of how many."""
    return sum(map(_is_selected, rows)), len(rows)


def _is_selected(row: Row) -> bool:
    return bool(row["selected"] == YES)


def _rate(name: str, rows: Sequence[Row]) -> Estimate:
    """Return the rate of selection; each width has its own."""
    parts = grouped(rows, "width_m").values()
    return mixed_share_interval(name, [_selected(part) for part in parts])


def _over_people(rows: Sequence[Row]) -> Estimate:
    """Return the rate of selection of all people; of one, `_rate`."""
    people = shares_by_person(rows, _is_selected)
    return _rate("rate", rows) if len(people) == 1 else people_share_interval("rate", people.values())


def _time_over_people(rows: Sequence[Row]) -> Estimate:
    """Return the mean of people's mean times; of one, of the trials."""
    selected = filter(_is_selected, rows)
    people = [[float(row["time_s"]) for row in part] for part in grouped(selected, "participant").values()]
    return mean_interval("time", people[0] if len(people) == 1 else [float(np.mean(one)) for one in people], "s")


def _drawn(name: str, rows: Sequence[Row], *, beside: bool) -> Drawing:
    column, factor, unit = FACTORS[name]
    parts = [(factor * float(value), _over_people(part)) for value, part in by_value(rows, column)]
    x = np.array([value for value, _ in parts])
    lines = (
        series("rate", x, [one.value for _, one in parts], "dots"),
        series("95 %", x, [one.low for _, one in parts], "dashed"),
        series("", x, [one.high for _, one in parts], "dashed"),
    )
    printed = (thesis.SELECTED_SMALLEST, thesis.SELECTED_LARGEST) if beside else ()
    marks = tuple(ReferenceLine("y", at, dashed=True, name="thesis") for at in printed)
    return Drawing(f"Selected by {name}", f"{name}, {unit}", "share", lines, y_range=(0.0, 1.0), lines=marks)
