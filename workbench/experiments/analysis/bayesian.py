"""The adaptive Bayesian method: the posterior of threshold and spread after all answers."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, ReferenceLine, series
from underfoot.errors import BadMeasurement, require
from underfoot.experiments.analysis.estimate import Estimate
from underfoot.experiments.analysis.findings import Findings, estimates_table, people_drawn
from underfoot.experiments.analysis.psychometric import estimates as curve_estimates
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.analysis.staircase import false_alarms, over_people
from underfoot.experiments.methods.bayesian import Bayesian, levels_of, quest_of
from underfoot.experiments.methods.staircases import is_yes
from underfoot.experiments.table import Row, by_value, grouped

_BEYOND = "Empty: the likeliest threshold is an end of those considered, and may lie anywhere beyond."


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's threshold and spread, in dB re the stimulus's level, with 95 % credible intervals.

    NaN where the likeliest threshold is an end of those considered: as of who says no, or yes, to every level, it may
    be anywhere beyond. Raises `BadValue` for a level that the method does not have.
    """
    given = settings.of(Bayesian)
    quest = quest_of(given)
    followed = [row for row in rows if not row.get("catch")]
    levels = quest.stim_domain["intensity"]
    by = f"{levels[0]:g} to {levels[-1]:g} by {given['step_db']:g}; `underfoot analyse --protocol` takes the study's"
    for row in followed:
        level, answer = float(row["level_db"]), "Yes" if is_yes(row, row) else "No"
        require(level in levels, "level_db", level, by)
        quest.update(stim={"intensity": level}, outcome={"response": answer})
    threshold = f"threshold {followed[0].get('comparison', '')}".rstrip() if followed else "threshold"
    likeliest = int(np.argmax(quest.marginal_posterior["mean"]))
    if followed and likeliest in (0, len(quest.param_domain["mean"]) - 1):
        return [Estimate(name, math.nan, unit="dB") for name in (threshold, "spread")]
    found = []
    for estimate, parameter in ((threshold, "mean"), ("spread", "sd")):
        values = np.asarray(quest.param_domain[parameter], np.float64)
        believed = np.asarray(quest.marginal_posterior[parameter], np.float64)
        if parameter == "mean":
            value, low, high = _posterior_interval(values, believed)
        else:  # the grid of spreads is geometric
            value, low, high = (math.exp(one) for one in _posterior_interval(np.log(values), believed))
        found.append(Estimate(estimate, value, low, high, "dB"))
    return found


def _posterior_interval(values: NDArray[np.float64], believed: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the mean of a posterior, and the ends of its central 95 % interval.

    `believed` is the posterior probability of each grid value. A grid value represents the range up to halfway to its
    neighbours.
    """
    half = 0.5 * np.diff(values)
    edges = np.concatenate([[values[0] - half[0]], values[:-1] + half, [values[-1] + half[-1]]])
    below = np.concatenate([[0.0], np.cumsum(believed)])
    low, high = np.interp((0.025, 0.975), below, edges)
    return float(values @ believed), float(low), float(high)


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: thresholds, and the chosen levels."""
    found = Findings("Adaptive, Bayesian")
    people = grouped(rows, "participant")
    lines = [(str(person), estimate) for (person,), part in people.items() for estimate in estimates(part, settings)]
    note = _BEYOND if any(math.isnan(one.value) for _, one in lines) else ""
    found.tables.append(estimates_table("Thresholds of each person", "participant", lines, note))
    thresholds = [(person, one) for person, one in lines if one.name.startswith("threshold")]
    found.tables.append(over_people("Thresholds", thresholds, rows))
    found.tables += false_alarms(rows)
    has_threshold = {person for person, one in thresholds if math.isfinite(one.value)}
    if named := [str(who) for (who,), part in people.items() if str(who) in has_threshold and _may_be_guesses(part)]:
        their = "their threshold is where levels were tried, and counts over people"
        found.remarks.append(f"The answers of {', '.join(named)} may be guesses: {their}.")
    if cut := [person for person, one in thresholds if _reaches_an_end(one, settings)]:
        found.remarks.append(
            f"The interval of {', '.join(cut)} reaches the lowest or highest threshold that is considered: theirs may "
            "lie beyond, and counts over people as it is. A wider range_db tells."
        )
    found.drawings += people_drawn("Thresholds over people", "stimulus", "level, dB", thresholds)
    for (person,), part in people.items():
        levels = [float(row["level_db"]) for row in part if not row.get("catch")]
        marks = (
            ReferenceLine("y", next(one.value for p, one in lines if p == str(person)), dashed=True, name="threshold"),
        )
        line = series("level", np.arange(1, len(levels) + 1), levels)
        found.drawings.append(Drawing(f"Levels of {person}", "trial", "level, dB", (line,), lines=marks))
    return found


def _reaches_an_end(threshold: Estimate, settings: Settings) -> bool:
    """Return whether a threshold's interval goes into the part of the lowest or highest level that is considered.

    >>> given = {"range_db": (-6.0, 6.0), "step_db": 2.0}
    >>> intervals = (-4.9, 4.9), (-5.1, 0.0), (0.0, 5.1)
    >>> [_reaches_an_end(Estimate("threshold", 0.0, *one), Settings(given)) for one in intervals]
    [False, True, True]
    """
    levels = levels_of(settings.of(Bayesian))
    return bool(threshold.low < levels[:2].mean() or threshold.high > levels[-2:].mean())


def _may_be_guesses(rows: Sequence[Row]) -> bool:
    """Return whether a person's answers of one interval may not depend on the level: a curve through them may be flat.

    Of two intervals 40 trials do not tell it; who guesses there has no threshold.

    >>> _may_be_guesses([{"level_db": k % 4, "felt": "yes" if k % 3 else "no"} for k in range(40)])
    True
    >>> _may_be_guesses([{"level_db": k % 4, "felt": "yes" if k % 4 + k % 3 > 2 else "no"} for k in range(40)])
    False
    """
    if any(row.get("comparison_at") for row in rows):
        return False
    levels = by_value([row for row in rows if not row.get("catch")], "level_db")
    yes, of = [sum(is_yes(row, row) for row in part) for _, part in levels], [len(part) for _, part in levels]
    try:
        _, slope, _ = curve_estimates([level for level, _ in levels], yes, of, bootstrap=0)
    except BadMeasurement:
        return False
    return slope.covers(0.0)
