"""Absolute identification: rates, learning, confusions and information (thesis figures 3.8 to 3.11)."""

from collections.abc import Mapping, Sequence
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, HeatMap, ReferenceLine, series
from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.comparisons import Test, groups_compared
from underfoot.experiments.analysis.estimate import PEOPLE_NOTE, Estimate, people_share_interval, share_interval
from underfoot.experiments.analysis.findings import Cell, Findings, Table, estimates_table
from underfoot.experiments.analysis.information import information
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.table import Row, grouped, shares_by_person


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's rate of right answers, over all sessions and each, and the transmitted information."""
    found = [_rate("rate", rows)]
    found += [_rate(f"rate in session {block}", part) for (block,), part in grouped(rows, "block").items()]
    return [*found, information(confusion(rows, settings)[2])]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: rates by person and set, learning, confusions, and tests between sets."""
    found = Findings("Absolute identification")
    people = grouped(rows, "participant")
    by_person = [(f"{person}{_set_of(part)}", _rate("rate", part)) for (person,), part in people.items()]
    found.tables.append(estimates_table("Rates of each person", "participant", by_person, "Intervals are Wilson's."))
    sets = grouped(rows, "set")
    for (name,), part in sets.items():
        title = f"Set {name}" if name else "All"
        lines = [("all sessions", _over_people(part))]
        for (block,), session in grouped(part, "block").items():
            lines.append((f"session {block}", _over_people(session)))
        stimuli, answers, counts = confusion(part, settings)
        lines.append(("all people together", information(counts)))
        notes = (PEOPLE_NOTE, _spread_of_people(part), _THESIS if name in thesis.SETS else "")
        found.tables.append(estimates_table(title, "of", lines, " ".join(filter(None, notes))))
        found.tables.append(_confusion_table(title, stimuli, answers, counts))
        found.drawings.append(_confusion_drawn(title, counts))
    found.drawings.insert(0, _learning_drawn(sets, 1.0 / counts.shape[1]))
    if len(sets) > 1:
        found.add_tests("Do the sets differ?", lambda: _tests(sets), _of_whom(sets))
    return found


_THESIS = (
    f"Thesis 3.4.2: mean {thesis.IDENTIFIED_MEAN:.0%}, standard deviation {thesis.IDENTIFIED_SD:.0%}, chance "
    f"{thesis.CHANCE:.1%}; the best stimulus {thesis.LEAST_CONFUSED:.0%}, the worst {thesis.MOST_CONFUSED:.0%}."
)


def confusion(rows: Sequence[Row], settings: Settings) -> tuple[list[str], list[str], NDArray[np.int64]]:
    """Return stimuli, answers, and counts of [presented, answered]: both from number 1 on, or answers as words.

    With words, stimuli are in the order of their right answers, so that right answers lie on the diagonal.
    """
    if any("answer" in row for row in rows):
        words = list(map(str, settings.given.get("answers") or sorted({str(row["answer"]) for row in rows})))
        places = {word: place for place, word in enumerate(words)}
        parts = sorted(
            grouped(rows, "stimulus").items(),
            key=lambda part: (places.get(str(part[1][0]["correct"]), len(words)), str(part[0][0])),
        )
        table = [[sum(str(row["answer"]) == word for row in part) for word in words] for _, part in parts]
        return [str(name) for (name,), _ in parts], words, np.array(table, np.int64)
    names = dict(enumerate(map(str, settings.given.get("identified", ())), 1))  # also of what was not presented yet
    names |= {int(row["correct"]): str(row.get("stimulus", row["correct"])) for row in rows}
    most = max([*names, *(int(row["number"]) for row in rows)])
    counts = np.zeros((most, most), np.int64)
    for row in rows:
        counts[int(row["correct"]) - 1, int(row["number"]) - 1] += 1
    stimuli = [names.get(k + 1, str(k + 1)) for k in range(most)]
    return stimuli, stimuli, counts


def _rate(name: str, rows: Sequence[Row]) -> Estimate:
    return share_interval(name, sum(map(_is_right, rows)), len(rows))


def _over_people(rows: Sequence[Row]) -> Estimate:
    return people_share_interval("rate", shares_by_person(rows, _is_right).values())


def _spread_of_people(rows: Sequence[Row]) -> str:
    """Return the standard deviation of people's rates in a sentence; "" for one person."""
    rates = [count / of for count, of in shares_by_person(rows, _is_right).values()]
    return f"Standard deviation of people: {np.std(rates, ddof=1):.3g}." if len(rates) > 1 else ""


def _is_right(row: Row) -> bool:
    return str(row.get("answer", row.get("number"))) == str(row["correct"])


def _set_of(rows: Sequence[Row]) -> str:
    return f", {rows[0]['set']}" if rows and "set" in rows[0] else ""


def _tests(sets: dict[tuple[str, ...], list[Row]]) -> list[Test]:
    def compared(name: str, block: object = None) -> list[Test]:
        groups = {}
        for (label,), part in sets.items():
            people = grouped((row for row in part if block in (None, row["block"])), "participant")
            groups[str(label)] = {str(who): _rate("", rows).value for (who,), rows in people.items()}
        return groups_compared(name, groups)

    blocks = sorted({row["block"] for part in sets.values() for row in part})
    sessions = [test for block in blocks for test in compared(f"session {block}", block)]
    return [*compared("all sessions"), *sessions]


def _of_whom(sets: Mapping[tuple[str, ...], Sequence[Row]]) -> str:
    """Return who is tested, if people had several sets."""
    had = [str(who) for part in sets.values() for (who,) in grouped(part, "participant")]
    if len(set(had)) == len(had):
        return ""
    rest = ", ".join(sorted(who for who in set(had) if had.count(who) < len(sets)))
    return f"Repeated measures of who had all sets.{f' Left out: {rest}.' if rest else ''}"


def _confusion_table(title: str, stimuli: list[str], answers: list[str], counts: NDArray[np.int64]) -> Table:
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (name, *map(int, line)) for name, line in zip(stimuli, counts, strict=True)
    )
    return Table(f"{title}: answers to each stimulus", ("stimulus", *answers), rows)


def _confusion_drawn(title: str, counts: NDArray[np.int64]) -> Drawing:
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    levels = np.round(255.0 * shares).astype(np.uint8)
    presented, answered = ((0.5, n + 0.5) for n in counts.shape)
    heat = HeatMap(levels, answered, presented)
    return Drawing(f"{title}: confusions", "answered", "presented", heat=heat, x_range=answered, y_range=presented)


def _learning_drawn(sets: dict[tuple[str, ...], list[Row]], chance: float) -> Drawing:
    lines = []
    for colour, ((name,), part) in zip(cycle(("vibration", "force", "muted")), sets.items(), strict=False):
        blocks, means, ends = [], [], []
        for (block,), session in grouped(part, "block").items():
            one = _over_people(session)
            blocks.append(float(block))
            means.append(one.value)
            ends.append((one.low, one.high))
        lines.append(series(str(name) or "rate", blocks, means, colour=colour))
        lines.append(series("", blocks, means, "dots", colour))  # of one session, too
        for k, label in ((0, "95 %"), (1, "")):
            lines.append(series(label, blocks, [end[k] for end in ends], "dashed", colour))
    marks = [ReferenceLine("y", chance, dashed=True, name="chance")]
    if any(name in thesis.SETS for (name,) in sets):
        marks.append(ReferenceLine("y", thesis.IDENTIFIED_MEAN, dashed=True, name="thesis, mean"))
    return Drawing("Learning", "session", "right answers", tuple(lines), y_range=(0.0, 1.0), lines=tuple(marks))
