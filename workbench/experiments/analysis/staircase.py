"""Staircases: their reversals, and thresholds or points of equality (thesis figure 6.9, table 6.1)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, ReferenceLine, Series, series
from underfoot.experiments.analysis import thesis
from underfoot.experiments.analysis.estimate import Estimate, mean_interval
from underfoot.experiments.analysis.findings import Findings, Table, estimates_table, means_table, people_drawn
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods.staircases import (
    PSE,
    THRESHOLD,
    Staircase,
    Staircases,
    balanced_share,
    is_yes,
    move,
)
from underfoot.experiments.questions import YES
from underfoot.experiments.table import LEVEL, Row, grouped

_COLOURS = ("force", "vibration", "contact", "events")


@dataclass
class Run:
    """The last run of one staircase: its levels in dB, the indices of its reversals, and whether it was held at the
    highest or lowest level by an answer that would have led beyond.
    """

    levels_db: list[float]
    turned_at: list[int]
    is_held: bool = False

    @property
    def turns_db(self) -> list[float]:
        """The levels of its reversals, in dB."""
        return [self.levels_db[at] for at in self.turned_at]


def staircases(rows: Sequence[Row], settings: Settings) -> dict[tuple[str, int, str], Run]:
    """Return one person's staircases by stimulus, block and start; of each, the run after the last false alarm."""
    given = settings.of(Staircases)
    states: dict[tuple[str, int, str], tuple[int, Staircase, Run]] = {}
    for row in rows:
        if row.get("staircase") in (None, ""):
            continue
        key = (str(row["comparison"]), int(row["block"]), str(row["staircase"]))
        number, level = int(row.get("run") or 0), float(row["level_db"])
        if key not in states or states[key][0] != number:
            states[key] = (number, Staircase(level), Run([], []))
        _, one, run = states[key]
        run.levels_db.append(level)
        one.level_db = level
        turns, said_yes = len(one.reversals_db), is_yes(row, row)
        run.is_held |= level <= given["lowest_db"] if said_yes else level >= given["highest_db"]
        move(one, said_yes, given)
        if len(one.reversals_db) > turns:
            run.turned_at.append(len(run.levels_db) - 1)
    newest: dict[int, int] = {}
    for (_, block, _), (number, _, _) in states.items():
        newest[block] = max(number, newest.get(block, 0))
    return {key: run for key, (number, _, run) in states.items() if number == newest[key[1]]}


def estimates(rows: Sequence[Row], settings: Settings) -> list[Estimate]:
    """Estimate one person's threshold, or PSE, for each stimulus, the mean of its staircases, in dB re its level."""
    last, point = settings.of(Staircases)["last"], _point(rows, settings)
    values: dict[str, list[float]] = {}
    for (stimulus, _, _), run in staircases(rows, settings).items():
        values.setdefault(stimulus, [])
        if len(run.turned_at) >= _least_reversals(settings):
            values[stimulus].append(float(np.mean(run.turns_db[-last:])))
    order = dict.fromkeys([*settings.given.get("followed", ()), *sorted(values)])
    return [mean_interval(f"{point} {name}", values[name], "dB") for name in order if name in values]


def findings(rows: Sequence[Row], settings: Settings) -> Findings:
    """Report over people: thresholds or PSEs, in dB and m/s^2, false alarms, and the staircases themselves."""
    found, title, chosen = Findings("Staircases"), "Thresholds", "are yes"
    if settings.is_beside_silence:
        chosen = "are right"
    elif _point(rows, settings) == PSE:
        title, chosen = "Points of subjective equality (PSE)", "name the comparison"
    people = grouped(rows, "participant")
    several = {str(person): estimates(part, settings) for (person,), part in people.items()}
    lines = [(person, one) for person, of in several.items() for one in of]
    note = "Student's intervals over the staircases of each person; dB re the level of the stimulus."
    if settings.given:
        share = balanced_share(settings.of(Staircases))
        note += f" The level tends to where {100.0 * share:.3g} % of the answers {chosen}."
    if any(math.isnan(one.value) for _, one in lines):
        note += f" Empty: no staircase of theirs has {_least_reversals(settings)} reversals yet."
    found.tables.append(estimates_table(f"{title} of each person", "participant", lines, note))
    found.tables.append(over_people(title, lines, rows, _beside(rows, settings)))
    found.tables += false_alarms(rows)
    if settings.given and (held := _held(people, settings)):
        point = "PSE" if _point(rows, settings) == PSE else THRESHOLD
        found.remarks.append(
            f"Held by answers at the highest or lowest level, beyond which the {point} may lie: {held}."
        )
    found.drawings += people_drawn(f"{title} over people", "stimulus", "level, dB", lines)
    found.drawings += [_drawn(str(person), part, settings) for (person,), part in people.items()]
    return found


def over_people(
    title: str, lines: Sequence[tuple[str, Estimate]], rows: Sequence[Row], note: str = "", unit: str = "dB"
) -> Table:
    """Return the mean of each threshold, or PSE, over people, in its unit and, where levels are known, in m/s^2, with
    the standard deviation of people.
    """
    references, over = _references(rows), list[tuple[str, str, Sequence[float], str]]()
    for name in dict.fromkeys(one.name for _, one in lines):
        values = {person: one.value for person, one in lines if one.name == name}
        at_0_db = {person: references.get((person, name.partition(" ")[2])) for person in values}
        levels = [level * 10.0 ** (values[person] / 20.0) for person, level in at_0_db.items() if level]
        for of_unit, of in ((unit, list(values.values())), ("m/s^2", levels)):
            if of:
                over.append((of_unit, name, of, of_unit))
    return means_table(f"{title} over people", "in", over, note)


def false_alarms(rows: Sequence[Row]) -> list[Table]:
    """Return a table of each person's answers of yes to nothing; [] without catch trials.

    >>> rows = [{"participant": f"P{k}", "catch": True, "felt": felt} for k in (1, 2) for felt in ("no", "yes", "no")]
    >>> false_alarms(rows)[0].rows, false_alarms(rows[:5])[0].note
    ((('P1', 1, 3), ('P2', 1, 3)), 'Median: 1.')
    """
    people = grouped((row for row in rows if row.get("catch")), "participant").items()
    alarms = [(str(who), sum(row.get("felt") == YES for row in part), len(part)) for (who,), part in people]
    note = f"Median: {median(count for _, count, _ in alarms):g}." if len(alarms) > 1 else ""
    if any(row.get("comparison") == "TD" for row in rows):
        note = f"{note} Thesis 6.4.2: median {thesis.FALSE_ALARMS_MEDIAN:g}.".lstrip()
    return [Table("False alarms", ("participant", "yes to nothing", "of"), tuple(alarms), note)] if alarms else []


def _held(people: Mapping[tuple[Any, ...], Sequence[Row]], settings: Settings) -> str:
    """Return whose staircases were held at an end of the levels, each person with the stimuli; "" for nobody."""
    found = list[str]()
    for (person,), rows in people.items():
        of = dict.fromkeys(stimulus for (stimulus, _, _), run in staircases(rows, settings).items() if run.is_held)
        found += [f"{person} ({', '.join(of)})"] if of else []
    return ", ".join(found)


def _point(rows: Sequence[Row], settings: Settings) -> str:
    """Return what a level tends to: beside a standard that vibrates it is equal to that, else it is just felt."""
    is_compared = not settings.is_beside_silence and any(row.get("comparison_at") for row in rows)
    return PSE if is_compared else THRESHOLD


def _least_reversals(settings: Settings) -> int:
    """Return the number of reversals that a staircase needs to be counted."""
    rule = settings.of(Staircases)
    return min(int(rule["reversals"]), int(rule["last"]))


def _beside(rows: Sequence[Row], settings: Settings) -> str:
    """Return what the thesis found of these stimuli, "" for stimuli, or a question, that are not its own."""
    names = {row.get("comparison") for row in rows} & set(thesis.STIMULI)
    if not names or settings.is_beside_silence:
        return ""
    if any(row.get("comparison_at") for row in rows):
        return "Thesis 6.3.5, equal intensity: the peaks of table 6.1."
    level, spread = thesis.THRESHOLD_M_S2, thesis.THRESHOLD_SD_M_S2
    return f"Thesis 6.4.2: {level:g} m/s^2 peak, standard deviation {spread:g}." if "TD" in names else ""


def _references(rows: Sequence[Row]) -> dict[tuple[str, str], float]:
    """Return each person's level of each stimulus in m/s^2, at 0 dB; a level that a participant set is in it."""
    return {
        (str(row["participant"]), str(row["comparison"])): float(row[LEVEL]) / 10.0 ** (row["level_db"] / 20.0)
        for row in rows
        if row.get("comparison") and row.get(LEVEL) not in (None, "")
    }


def _drawn(person: str, rows: Sequence[Row], settings: Settings) -> Drawing:
    lines: list[Series] = []
    for k, ((stimulus, block, which), run) in enumerate(staircases(rows, settings).items()):
        colour = _COLOURS[k % len(_COLOURS)]
        x = np.arange(1, len(run.levels_db) + 1)
        lines.append(series(f"{stimulus} {block} {which}" if k < 6 else "", x, run.levels_db, "line", colour))
        lines.append(series("", x[run.turned_at], run.turns_db, "dots", colour))
    marks = tuple(
        ReferenceLine("y", estimate.value, dashed=True, name=estimate.name)
        for estimate in estimates(rows, settings)[:3]
    )
    return Drawing(f"Staircases of {person}", "trial of the staircase", "level, dB", tuple(lines), lines=marks)
