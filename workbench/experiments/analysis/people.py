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
    stage, such as an age group or shoes, if two people or more gave each answer: else it is free text. Who has no
    estimate, or was not asked yet, is in none of these; the others are, if they are enough.
    """
    named = {name: [one.get(name, math.nan) for one in estimates] for one in estimates for name in one}
    enough = [name for name, of in named.items() if sum(map(math.isfinite, of)) >= LEAST_PEOPLE]
    values = {name: named[name] for name in enough[:MOST_ESTIMATES]}
    tests: list[Test] = []
    for column in columns_of(people):
        label, given = column.removeprefix(OF_PERSON), [person.get(column) for person in people]
        if not column.startswith(OF_PERSON):
            continue
        there = [one for one in given if one is not None]
        words = [one for one in given if isinstance(one, str)]
        if all(isinstance(one, int | float) for one in there):
            numbers = [float(one) if isinstance(one, int | float) else math.nan for one in given]
            tests += _ranked(label, values, numbers)
        elif len(words) == len(given) and "." not in label and _are_groups(words):  # STAGE.NAME was asked later
            groups = {name: _split(of, words) for name, of in values.items()}
            findings.tables.append(_means(label, words, groups))
            tests += [one_way_anova(f"{name}, {label}", of) for name, of in groups.items() if min(map(len, of)) > 1]
    if tests:
        findings.add_tests("Who takes part", lambda: tests, _NOTE)


def _ranked(label: str, values: Mapping[str, Sequence[float]], numbers: Sequence[float]) -> list[Test]:
    """Return the rank correlations of estimates with numbers, each of who has both, if these are enough and differ."""
    tests = []
    for name, of in values.items():
        both = [pair for pair in zip(of, numbers, strict=True) if all(map(math.isfinite, pair))]
        x, y = [one for one, _ in both], [one for _, one in both]
        if len(both) >= LEAST_PEOPLE and min(len(set(x)), len(set(y))) > 2:
            tests.append(spearman(f"{name}, {label}", x, y))
    return tests


_NOTE = (
    "Over people: Spearman's rank correlation with numbers, one-way ANOVA between groups; p is not corrected for their "
    "number."
)


def _are_groups(words: Sequence[str]) -> bool:
    counts = Counter(words).values()
    return len(counts) > 1 and min(counts) > 1


def _split(values: Sequence[float], words: Sequence[str]) -> list[list[float]]:
    """Return the values of each group, by the order of its first person, without those who have none."""
    there = [(value, word) for value, word in zip(values, words, strict=True) if math.isfinite(value)]
    return [[value for value, word in there if word == group] for group in dict.fromkeys(words)]


def _means(label: str, words: Sequence[str], groups: Mapping[str, Sequence[Sequence[float]]]) -> Table:
    """Return the mean of each estimate over those of each group who have it."""
    rows: list[tuple[Cell, ...]] = [
        (name, group, len(one), float(np.mean(one)) if one else math.nan)
        for name, of in groups.items()
        for group, one in zip(dict.fromkeys(words), of, strict=True)
    ]
    return Table(f"Groups by {label}", ("estimate", label, "people", "mean"), tuple(rows))
