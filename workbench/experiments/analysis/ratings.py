"""Ratings: means by condition, and the effects of the factors (thesis figures 6.5 and 6.6)."""

import math
from collections.abc import Sequence

import numpy as np

from underfoot.drawing import Drawing, series
from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.comparisons import paired_t, repeated_measures_anova
from underfoot.experiments.analysis.constant import axis_label
from underfoot.experiments.analysis.estimate import Estimate, mean_interval
from underfoot.experiments.analysis.findings import Findings, bars, means_table
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.table import LEVEL, Row, factors_of, grouped

_NOTE = (
    "Corrected: by Greenhouse and Geisser, with df times epsilon. The p above it assumes sphericity: where the "
    "differences between three or more levels do not all vary alike, it is too small."
)


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's mean rating of each condition."""
    parts = grouped(_in_order(rows, settings), "stimulus").items()
    return [mean_interval(f"rating {name}", [float(row["rating"]) for row in part]) for (name,), part in parts]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: means, a within-subject analysis of variance, and each condition against none, or, where
    they have no factors, against each other.
    """
    found, rows = Findings("Ratings"), _in_order(rows, settings)
    means = {
        (str(person), str(stimulus)): float(np.mean([float(row["rating"]) for row in part]))
        for (person, stimulus), part in grouped(rows, "participant", "stimulus").items()
    }
    conditions = list(dict.fromkeys(str(row["stimulus"]) for row in rows))
    lines = [(c, "rating", [v for (_, s), v in means.items() if s == c], "") for c in conditions]
    found.tables.append(means_table("Means over people", "condition", lines))
    people = sorted({person for person, _ in means})
    whole_people = [person for person in people if all((person, c) in means for c in conditions)]
    if 1 < len(whole_people) < len(people):
        rest = ", ".join(person for person in people if person not in whole_people)
        found.remarks.append(f"Tests are of who has rated every condition. Left out of them: {rest}.")
        people = whole_people
    factors, kept = _factors([row for row in rows if str(row["participant"]) in people])
    if not _are_crossed(kept, factors):
        effects = f"Effects of {', '.join(factors)}"
        found.remarks.append(f"{effects}: the test needs all combinations of their values among the conditions")
        factors = ()
    if len({row["stimulus"] for row in kept}) > 1:
        factors = factors or ("stimulus",)
        note = f"Thesis 6.4.1 tests the same. {_NOTE}" if set(factors) == set(thesis.RATED_FACTORS) else _NOTE
        title = f"Effects of {', '.join(factors)}"
        found.add_tests(title, lambda: repeated_measures_anova(kept, "rating", factors), note)
    whole = {c: [means[p, c] for p in people] for c in conditions if all((p, c) in means for p in people)}
    plain = _without_vibration(rows)
    against = plain if plain in whole else ""
    if len(whole) > 1 and (against or factors == ("stimulus",)):
        title = f"Each against {against or 'each'}"
        found.add_tests(title, lambda: paired_t(whole, against), "Paired t; p times the number of tests.")
    found.drawings += [_drawn(rows, factor) for factor in factors]
    return found


def _in_order(rows: Sequence[Row], settings: Settings) -> list[Row]:
    """Return the rows in the order of the protocol's conditions; others behind these, by name."""
    order = {name: k for k, name in enumerate(settings.given.get("rated", ()))}
    return sorted(rows, key=lambda row: (order.get(row["stimulus"], len(order)), str(row["stimulus"])))


def _without_vibration(rows: Sequence[Row]) -> str:
    """Return the condition whose level is 0, "" for none."""
    found = {str(row["stimulus"]) for row in rows if row.get(LEVEL) == 0.0}
    return min(found) if found else ""


def _factors(rows: Sequence[Row]) -> tuple[tuple[str, ...], list[Row]]:
    """Return the factors of the conditions, and their rows, without the condition without vibration."""
    plain = _without_vibration(rows)
    kept = [row for row in rows if row["stimulus"] != plain]
    return tuple(name for name in factors_of(kept) if name != LEVEL), kept


def _are_crossed(rows: Sequence[Row], factors: Sequence[str]) -> bool:
    """Return whether there are all combinations of the factors' values."""
    cells = {tuple(row.get(name) for name in factors) for row in rows}
    return math.prod(len({row.get(name) for row in rows}) for name in factors) == len(cells)


def _drawn(rows: Sequence[Row], factor: str) -> Drawing:
    """Plot the means of a factor's values over people, with standard errors; of words in the order of the rows."""
    parts = [(value, part) for (value,), part in grouped([row for row in rows if factor in row], factor).items()]
    are_numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value, _ in parts)
    if are_numbers:
        parts.sort(key=lambda part: part[0])
    means, errors = [], []
    for _, part in parts:
        values = [np.mean([float(row["rating"]) for row in p]) for p in grouped(part, "participant").values()]
        means.append(float(np.mean(values)))
        errors.append(float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0)
    x = [float(value) for value, _ in parts] if are_numbers else np.arange(1.0, len(parts) + 1.0)
    names = () if are_numbers else tuple(str(value) for value, _ in parts)
    low, high = np.subtract(means, errors), np.add(means, errors)
    lines = (series("mean", x, means, "dots"), bars("1 SE", x, low, high))
    return Drawing(f"Rating by {factor}", axis_label(factor), "rating", lines, x_names=names)
