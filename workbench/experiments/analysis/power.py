"""Results of simulated participants, as a plan for a study: a table and plots of bias and spread."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.experiments.analysis.findings import Cell, Findings, Table
from underfoot.experiments.simulation import Summary
from underfoot.parameters import Parameter
from underfoot.quantities import counted

GROUPS = (10, 20, 40)
"""Numbers of people for which the standard error of the mean is given."""
_COLOURS = ("vibration", "force", "contact", "events", "muted")
_MOST_LINES = 5


def power_of(
    summaries: Sequence[Summary], people: int, truths: Mapping[str, tuple[Parameter, float]] | None = None
) -> Findings:
    """Return tables of every estimate and of the people's true values, and plots.

    The plots are of spread against trials, and of standard error against people.
    """
    found = Findings(counted(people, "simulated participant"))
    whole = [summary for summary in summaries if summary.share == 1.0]
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            one.name,
            one.unit,
            one.truth,
            one.mean,
            one.bias,
            one.spread,
            *(one.spread_of(n) for n in GROUPS),
            one.covered,
        )
        for one in whole
    )
    columns = ("estimate", "unit", "truth", "mean", "bias", "spread", *(f"SE of {n}" for n in GROUPS), "95 % hold")
    note = (
        "Truth is the mean over people. Bias and spread are mean and standard deviation of what an estimate is beside "
        "its person's truth; SE is the standard error of the mean of so many people, who may differ; the last column "
        "is how often 95 % intervals hold their person's truth."
    )
    found.tables.append(Table("Estimates beside the truth", columns, rows, note))
    if truths:
        found.tables.append(_people(truths))
    for name in dict.fromkeys(one.name.split(" ")[0] for one in whole):
        of_kind = [one for one in whole if one.name.split(" ")[0] == name][:_MOST_LINES]
        found.drawings.append(_against_trials(of_kind, summaries))
        found.drawings.append(_against_people(of_kind))
    if not whole:
        found.remarks.append("Nothing is estimated: there are no trials, or all are practice.")
    missing = [one for one in whole if one.missing > 0.0]
    found.remarks += [f"{one.name}: {one.missing:.1%} of the people have no estimate." for one in missing]
    return found


def _people(truths: Mapping[str, tuple[Parameter, float]]) -> Table:
    lines = tuple((name, value, getattr(one, "unit", ""), one.doc) for name, (one, value) in truths.items())
    differ = [name for name, (_, value) in truths.items() if name.endswith("_differ") and value > 0.0]
    note = "All people are alike; they differ only in what they answer by chance."
    if differ:
        note = f"People differ: {', '.join(differ)}. At 0 they are all alike."
    return Table("The simulated people", ("what is true", "value", "unit", "what it is"), lines, note)


def _unit(of_kind: Sequence[Summary]) -> str:
    """Return the label of an axis of these estimates."""
    units = {one.unit for one in of_kind}
    return "in the unit of the estimate" if len(units) > 1 else ", ".join(filter(None, ("error", *units)))


def _against_trials(of_kind: Sequence[Summary], summaries: Sequence[Summary]) -> Drawing:
    """Plot spread and bias at shares of the trials, beside theory: the spread falls as 1 / sqrt(trials)."""
    lines, names = [], [one.name for one in of_kind]
    for colour, name in zip(_COLOURS, names, strict=False):
        parts = sorted((summary for summary in summaries if summary.name == name), key=lambda one: one.share)
        shares = np.array([100.0 * part.share for part in parts])
        lines.append(series(name, shares, [part.spread for part in parts], colour=colour))
        theory = parts[-1].spread * np.sqrt(100.0 / shares)
        lines.append(series("", shares, theory, "dashed", colour))
        lines.append(series("", shares, [part.bias for part in parts], "dots", colour))
    title = f"{names[0].split(' ')[0]}: spread (line), 1 / sqrt(trials) (dashed), bias (dots)"
    return Drawing(title, "trials, %", _unit(of_kind), tuple(lines), lines=(ReferenceLine("y", 0.0),))


def _against_people(of_kind: Sequence[Summary]) -> Drawing:
    people = np.arange(1, 61)
    lines = tuple(
        series(one.name, people, one.spread_of(1) / np.sqrt(people), colour=colour)
        for colour, one in zip(_COLOURS, of_kind, strict=False)
        if math.isfinite(one.spread)
    )
    title = f"{of_kind[0].name.split(' ')[0]}: standard error of the mean"
    return Drawing(title, "people", _unit(of_kind), lines)
