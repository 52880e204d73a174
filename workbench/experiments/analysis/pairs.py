"""Pairs: dissimilarities with a map of the stimuli, and d' of same and different."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from underfoot.drawing import Drawing, series
from underfoot.experiments.analysis.estimate import Z_95, Estimate, mean_interval
from underfoot.experiments.analysis.findings import Cell, Findings, Table, estimates_table, means_table, people_drawn
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.questions import NO
from underfoot.experiments.table import Row, grouped

_NOTE_D = (
    "Of each pair, and of each of its two beside itself. Differencing model of same and different (Macmillan and "
    "Creelman 2005, chapter 9), with rates (n + 0.5) / (N + 1); intervals by profile likelihood."
)
_FARTHEST = 20.0
"""Where d' and criterion end, in standard deviations of one stimulus."""


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's mean dissimilarity of each pair, or d' where same and different were told.

    >>> rows = [{"stimulus": "A", "other": "B", "dissimilarity": x} for x in (40.0, 60.0)]
    >>> [(one.name, one.value) for one in estimates(rows, Settings())]
    [('dissimilarity A B', 50.0)]
    """
    found = []
    for one, other in _pairs(rows, settings):
        mine = [row for row in rows if {row["stimulus"], row["other"]} == {one, other}]
        if mine and SAME in mine[0]:
            of_one = [row for row in rows if row["stimulus"] == row["other"] in (one, other)]
            if of_one:
                hits, false_alarms = ((sum(row[SAME] == NO for row in part), len(part)) for part in (mine, of_one))
                found.append(d_prime_same_different(f"d' {one} {other}", hits, false_alarms))
        elif mine:
            found.append(mean_interval(f"{DISSIMILARITY} {one} {other}", [float(row[DISSIMILARITY]) for row in mine]))
    return found


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report means over people, a map of three or more stimuli, and each person's estimates, which are many."""
    found, names = Findings("Pairs"), _names(rows, settings)
    people = {str(person): estimates(part, settings) for (person,), part in grouped(rows, "participant").items()}
    lines = [(person, one) for person, several in people.items() for one in several]
    values: dict[str, list[float]] = {}
    for _, one in lines:
        values.setdefault(one.name, []).append(one.value)
    over = [("all people", name, of, "") for name, of in values.items()]
    found.tables.append(means_table("Means over people", "of", over))
    if SAME in rows[0]:
        found.drawings += people_drawn("Sensitivity", "pair", "d'", lines)
        found.tables.append(estimates_table("Sensitivity of each person", "participant", lines, _NOTE_D))
        return found
    _add_map(found, names, {name: float(np.mean(of)) for name, of in values.items()})
    found.tables.append(estimates_table("Dissimilarities of each person", "participant", lines))
    return found


def _add_map(found: Findings, names: Sequence[str], means: Mapping[str, float]) -> None:
    """Add the matrix of mean dissimilarities, and the map that is drawn from it, or a remark if there is none."""
    far = np.zeros((len(names), len(names)))
    for i, j in combinations(range(len(names)), 2):
        far[i, j] = far[j, i] = means.get(f"{DISSIMILARITY} {names[i]} {names[j]}", math.nan)
    if len(names) < 3 or not np.isfinite(far).all():
        found.remarks.append("No map: it needs three or more stimuli, and a dissimilarity of each pair.")
        return
    found.tables.append(Table("Mean dissimilarities", ("stimulus", *names), _lines(names, far)))
    places, share = classical_scaling(far)
    note = (
        "Classical scaling of the mean dissimilarities (Torgerson 1952). How the map is turned and mirrored means "
        f"nothing. Two dimensions hold {100.0 * share:.0f} % of the eigenvalues' absolute sum."
    )
    found.tables.append(Table("Map", ("stimulus", "dimension 1", "dimension 2"), _lines(names, places), note))
    dots = replace(series("", places[:, 0], places[:, 1], "dots"), labels=tuple(names))
    found.drawings.append(Drawing("Map", "dimension 1", "dimension 2", (dots,), equal=True))


def _lines(names: Sequence[str], values: NDArray[np.float64]) -> tuple[tuple[Cell, ...], ...]:
    return tuple((name, *map(float, line)) for name, line in zip(names, values, strict=True))


def classical_scaling(dissimilarities: ArrayLike) -> tuple[NDArray[np.float64], float]:
    """Return places [n, 2] whose distances are near the `dissimilarities` [n, n], and the share that they hold of the
    eigenvalues' absolute sum (Torgerson, Psychometrika 17, 1952).

    >>> places, share = classical_scaling([[0.0, 3.0, 4.0], [3.0, 0.0, 5.0], [4.0, 5.0, 0.0]])
    >>> [round(float(np.hypot(*(places[i] - places[j]))), 9) for i, j in ((0, 1), (0, 2), (1, 2))], round(share, 9)
    ([3.0, 4.0, 5.0], 1.0)
    """
    squares = np.asarray(dissimilarities, np.float64) ** 2
    middle = np.eye(len(squares)) - 1.0 / len(squares)
    values, vectors = np.linalg.eigh(-0.5 * middle @ squares @ middle)
    largest = np.maximum(values[:-3:-1], 0.0)
    whole = float(np.abs(values).sum())
    return vectors[:, :-3:-1] * np.sqrt(largest), float(largest.sum()) / whole if whole else 0.0


def d_prime_same_different(name: str, hits: tuple[int, int], false_alarms: tuple[int, int]) -> Estimate:
    """Return d' of the differencing model, 0 where no more pairs of two are called different than pairs of one.

    `hits` and `false_alarms` are (called different, of).

    >>> found = d_prime_same_different("d'", (799, 1000), (200, 1000))
    >>> round(found.value, 2), found.low < found.value < found.high
    (2.99, True)
    """
    from scipy.optimize import brentq

    counts = tuple((count + 0.5, of + 1.0) for count, of in (hits, false_alarms))
    (hit, of_hit), (false, of_false) = counts
    best, value = _best(0.0, counts), 0.0
    if hit / of_hit > false / of_false:
        tolerance = brentq(lambda k: _different(0.0, k) - false / of_false, 0.0, _FARTHEST)
        value = float(brentq(lambda d: _different(d, tolerance) - hit / of_hit, 0.0, _FARTHEST))
        best = _log_likelihood(value, tolerance, counts)

    def beyond(d: float) -> float:
        return 2.0 * (best - _best(d, counts)) - Z_95**2  # chi squared with one degree of freedom

    low = float(brentq(beyond, 0.0, value)) if beyond(0.0) > 0.0 else 0.0
    return Estimate(name, value, low, float(brentq(beyond, value, _FARTHEST)))


def _different(d: float, tolerance: float) -> float:
    """Return the chance that two stimuli `d` apart are called different."""
    return 0.5 * (math.erfc(0.5 * (tolerance - d)) + math.erfc(0.5 * (tolerance + d)))


def _log_likelihood(d: float, tolerance: float, counts: Sequence[tuple[float, float]]) -> float:
    found = 0.0
    for (count, of), far in zip(counts, (d, 0.0), strict=True):
        chance = min(max(_different(far, tolerance), 1e-12), 1.0 - 1e-12)
        found += count * math.log(chance) + (of - count) * math.log(1.0 - chance)
    return found


def _best(d: float, counts: Sequence[tuple[float, float]]) -> float:
    """Return the largest likelihood of this d', over all tolerances."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(lambda k: -_log_likelihood(d, k, counts), bounds=(0.0, _FARTHEST), method="bounded")
    return -float(found.fun)


def _names(rows: Sequence[Row], settings: Settings) -> list[str]:
    """Return the stimuli in the order of the protocol; others behind these, by name."""
    there = {str(row[column]) for row in rows for column in ("stimulus", "other")}
    known: Mapping[str, int] = {name: k for k, name in enumerate(settings.given.get("paired", ()))}
    return sorted(there, key=lambda name: (known.get(name, len(known)), name))


def _pairs(rows: Sequence[Row], settings: Settings) -> list[tuple[str, str]]:
    return list(combinations(_names(rows, settings), 2))
