"""Stages of one method, such as with and without shoes: whether their estimates differ, and by how much."""

import math
from collections.abc import Mapping

import numpy as np

from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.comparisons import Test, groups_compared
from underfoot.experiments.analysis.findings import Cell, Findings, Table, table_of_tests
from underfoot.experiments.analysis.people import MOST_ESTIMATES

Estimates = Mapping[str, Mapping[str, float]]
"""Values by participant and by the estimate's name."""


def stages_compared(method: str, stages: Mapping[str, Estimates]) -> Findings:
    """Return means and tests of the estimates that two people or more have in all of these stages."""
    found = Findings(f"{method}: {', '.join(stages)} compared")
    first = next(iter(next(iter(stages.values())).values()))
    groups = {name: {stage: _finite(name, people) for stage, people in stages.items()} for name in first}
    shared = [(name, of) for name, of in groups.items() if min(map(len, of.values())) > 1][:MOST_ESTIMATES]
    means: list[tuple[Cell, ...]] = []
    tests: list[Test] = []
    for name, of in shared:
        means.append((name, *(float(np.mean(list(one.values()))) for one in of.values())))
        try:
            tests += groups_compared(name, of)
        except BadMeasurement as error:
            found.remarks.append(f"{name}: {error}")
    found.tables.append(Table("Means over people", ("estimate", *stages), tuple(means)))
    if tests:
        found.tables.append(table_of_tests("Do the stages differ?", tests, _NOTE))
    return found


def changes(stages: Mapping[str, Estimates]) -> dict[str, dict[str, float]]:
    """Return by how much each person's estimates are more in each later stage than in the first, of who has both.

    A one-way ANOVA of these between groups is that of the interaction of group and two stages.

    >>> changes({"pre": {"P1": {"pse": 90.0}, "P2": {"pse": 95.0}}, "post": {"P1": {"pse": 97.0}}})
    {'P1': {'pse, post - pre': 7.0}, 'P2': {}}
    """
    (first, before), *later = stages.items()
    return {
        who: {
            f"{name}, {stage} - {first}": now[who][name] - value
            for name, value in of.items()
            for stage, now in later
            if name in now.get(who, {})
        }
        for who, of in before.items()
    }


_NOTE = (
    "Repeated measures of who had all stages, one-way ANOVA where everybody had one; p is not corrected for the number "
    "of estimates."
)


def _finite(name: str, people: Estimates) -> dict[str, float]:
    return {who: of[name] for who, of in people.items() if math.isfinite(of.get(name, math.nan))}
