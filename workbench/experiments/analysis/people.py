"""Who takes part: whether estimates follow what participants were asked about themselves."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from underfoot.experiments.analysis.comparisons import Test, one_way_anova, spearman
from underfoot.experiments.analysis.findings import Cell, Findings, Table
from underfoot.experiments.table import OF_PERSON, Row, columns_of

LEAST_PEOPLE = 5
"""Least number of people for correlations and comparisons of groups."""
MOST_ESTIMATES = 6


def add_people(findings: Findings, people: Sequence[Row], estimates: Sequence[Mapping[str, float]]) -> None:
    """Add rank correlations of estimates with numbers that were asked, and means of groups by words, with their tests.

    `people` has a row of each person, and `estimates` their values by name. Groups are what was asked before the first
    stage, such as an age group or shoes, if two people or more gave each answer: else it is free text.
    """
    shared = [name for name in estimates[0] if all(math.isfinite(one.get(name, math.nan)) for one in estimates)]
    values = {name: [one[name] for one in estimates] for name in shared[:MOST_ESTIMATES]}
    tests: list[Test] = []
    for column in columns_of(people):
        label, given = column.removeprefix(OF_PERSON), [person.get(column) for person in people]
        if not column.startswith(OF_PERSON):
            continue
        numbers = [float(one) for one in given if isinstance(one, int | float)]
        words = [one for one in given if isinstance(one, str)]
        if len(numbers) == len(given) and len(set(numbers)) > 2:
            of = [name for name, ranked in values.items() if len(set(ranked)) > 2]
            tests += [spearman(f"{name}, {label}", values[name], numbers) for name in of]
        elif len(words) == len(given) and "." not in label and _are_groups(words):  # STAGE.NAME was asked later
            findings.tables.append(_means(label, words, values))
            tests += [one_way_anova(f"{name}, {label}", _split(of, words)) for name, of in values.items()]
    if tests:
        findings.add_tests("Who takes part", lambda: tests, _NOTE)


_NOTE = (
    "Over people: Spearman's rank correlation with numbers, one-way ANOVA between groups; p is not corrected for their "
    "number."
)


def _are_groups(words: Sequence[str]) -> bool:
    counts = Counter(words).values()
    return len(counts) > 1 and min(counts) > 1


def _split(values: Sequence[float], words: Sequence[str]) -> list[list[float]]:
    """Return the values of each group, by the order of its first person."""
    return [[v for v, word in zip(values, words, strict=True) if word == group] for group in dict.fromkeys(words)]


def _means(label: str, words: Sequence[str], values: Mapping[str, Sequence[float]]) -> Table:
    means = {name: [float(np.mean(group)) for group in _split(of, words)] for name, of in values.items()}
    rows: list[tuple[Cell, ...]] = [
        (group, words.count(group), *(of[k] for of in means.values())) for k, group in enumerate(dict.fromkeys(words))
    ]
    return Table(f"Groups by {label}", (label, "people", *means), tuple(rows), "Means over people.")
