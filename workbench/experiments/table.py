"""The table of trials: one row per presented trial, with all variables of the analysis."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from underfoot.errors import BadValue
from underfoot.experiments.columns import FIRST_COLUMNS, NOT_FACTORS
from underfoot.experiments.latin_square import number_of_row
from underfoot.experiments.methods.adjustment import LEVEL_DB, SET_TO
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.stimuli import Stimulus
from underfoot.experiments.study import GAIN_DB, PARTICIPANT, Entry
from underfoot.experiments.trials import NOTHING, Presentation, is_right

Row = Mapping[str, Any]
"""One trial: values by column name; missing values are not in the row."""

LEVEL = "level_m_s2"
OF_PERSON = "participant."
"""Prefix of the columns with participants' answers about themselves."""
_LEFT_OUT = "left out: "
"""Why no trial of a session counts that is left out: scripts that pass over spoiled trials pass over it, too."""


def rows_of(protocol: Protocol, participant: str, entries: Iterable[Entry]) -> list[dict[str, Any]]:
    """Return the rows of one participant, with spoiled and practice trials.

    `stimulus`, `gain_db` and `level_m_s2` are those of the judged interval; with two intervals, `other` is the other
    stimulus. Facts, factors of the stimulus, answers and times have columns with their own names. Answers about the
    participant have the prefix "participant.", and those of a questionnaire "participant." and its stage.
    """
    stages = {stage.id: stage for stage in protocol.stages}
    found: list[dict[str, Any]] = []
    gain_db = 0.0
    person: dict[str, Any] = {}
    if size := len(protocol.counterbalanced):
        person["stages_row"] = number_of_row(participant, size)
    for number, entry in enumerate(entries, 1):
        try:
            if entry.trial is None and entry.spoiled:
                continue
            if entry.stage == PARTICIPANT:
                person |= {f"{OF_PERSON}{name}": value for name, value in entry.answers.items()}
            if entry.kind == "questions" and entry.stage in stages:
                person |= {f"{OF_PERSON}{entry.stage}.{name}": value for name, value in entry.answers.items()}
            if entry.kind == "level":
                gain_db = float(entry.answers[GAIN_DB])
            if entry.trial is not None:
                found.append(_row(protocol, stages[entry.stage], participant, entry, number, gain_db))
        except (KeyError, TypeError, ValueError) as error:
            raise BadValue(f"entry {number} of {participant} does not fit its protocol ({error})") from None
    return [{**row, **person} for row in found]


def as_left_out(rows: Iterable[Row], why: str) -> list[Row]:
    """Return the rows of a session that the experimenter has left out: none of its trials counts, for this reason.

    >>> as_left_out([{"participant": "P3", "trial": 1}], "loose shoe")
    [{'participant': 'P3', 'trial': 1, 'spoiled': 'left out: loose shoe'}]
    """
    return [{**row, "spoiled": f"{_LEFT_OUT}{why}"} for row in rows]


def why_left_out(row: Row) -> str:
    """Return why the session of a row is left out; "" if it is not.

    >>> why_left_out({"spoiled": "left out: loose shoe"}), why_left_out({"spoiled": "telephone"})
    ('loose shoe', '')
    """
    spoiled = str(row.get("spoiled", ""))
    return spoiled.removeprefix(_LEFT_OUT) if spoiled.startswith(_LEFT_OUT) else ""


def with_levels(rows: Sequence[Row], protocol: Protocol) -> list[Row]:
    """Return the rows of a table from elsewhere with the levels that the protocol has of their stimuli, if the table
    has no column of levels.
    """
    if any(LEVEL in row for row in rows):
        return list(rows)
    return [{**row, **_level_of(row, protocol)} for row in rows]


def _level_of(row: Row, protocol: Protocol) -> dict[str, float]:
    """Return the level of a row's stimulus; {} if the protocol does not have it."""
    stimulus, gain_db = protocol.stimuli.get(str(row.get("stimulus"))), row.get("gain_db", 0.0)
    if stimulus is None or not isinstance(gain_db, int | float) or SET_TO in row:
        return {}
    return _level_cell(stimulus, gain_db)


def _level_cell(stimulus: Stimulus, gain_db: float) -> dict[str, float]:
    """Return a stimulus's level by its column; {} for one that is not known, which is not the level of nothing."""
    peak_m_s2 = stimulus.peak_m_s2(gain_db)
    return {} if peak_m_s2 is None else {LEVEL: float(f"{peak_m_s2:.6g}")}


def counted(rows: Sequence[Row]) -> list[Row]:
    """Return the rows that the analysis counts: neither practice nor spoiled.

    >>> counted([{"trial": 1, "spoiled": "noise"}, {"trial": 1}, {"trial": 2, "practice": True}])
    [{'trial': 1}]
    """
    return [row for row in rows if not row.get("practice") and not row.get("spoiled")]


def columns_of(rows: Iterable[Row]) -> list[str]:
    """Return the columns of a table: the common ones, then others in order of appearance."""
    names: dict[str, None] = dict.fromkeys(FIRST_COLUMNS)
    for row in rows:
        names |= dict.fromkeys(row)
    return list(names)


def alike_ids(rows: Iterable[Row]) -> list[tuple[str, ...]]:
    """Return the participants' ids that differ from each other in letter case only.

    >>> alike_ids([{"participant": "P01"}, {"participant": "P02"}, {"participant": "p01"}])
    [('P01', 'p01')]
    """
    found: dict[str, dict[str, None]] = {}
    for row in rows:
        found.setdefault(str(row["participant"]).casefold(), {})[str(row["participant"])] = None
    return [tuple(ids) for ids in found.values() if len(ids) > 1]


def grouped(rows: Iterable[Row], *columns: str) -> dict[tuple[Any, ...], list[Row]]:
    """Return the rows grouped by the values of columns, in order of first appearance.

    >>> grouped([{"a": 1, "b": 2}, {"a": 1, "b": 3}], "a")
    {(1,): [{'a': 1, 'b': 2}, {'a': 1, 'b': 3}]}
    """
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row.get(column, "") for column in columns), []).append(row)
    return found


def shares_by_person(rows: Iterable[Row], is_counted: Callable[[Row], bool]) -> dict[str, tuple[int, int]]:
    """Return how many rows of each person are counted, and of how many.

    >>> rows = [{"participant": "P1", "selected": "yes"}, {"participant": "P1", "selected": "no"}]
    >>> shares_by_person(rows, lambda row: row["selected"] == "yes")
    {'P1': (1, 2)}
    """
    people = grouped(rows, "participant").items()
    return {str(who): (sum(map(is_counted, part)), len(part)) for (who,), part in people}


def _row(
    protocol: Protocol, stage: Stage, participant: str, entry: Entry, number: int, gain_db: float
) -> dict[str, Any]:
    """Return the row of a trial's entry, without the participant's previous answers; `number` is the entry's."""
    trial = entry.trial
    assert trial is not None
    judged, other = _judged(trial.intervals, trial.facts.get("comparison"))
    row: dict[str, Any] = {
        "participant": participant,
        "stage": entry.stage,
        "method": stage.method.kind if stage.method is not None else "",
        "practice": stage.practice,
        "trial": trial.number,
        "block": trial.block,
        "attempt": entry.attempt,
        "spoiled": entry.spoiled,
        "entry": number,
    }
    if trial.correct != "":
        row["correct"] = trial.correct
        if not entry.spoiled:
            row["right"] = int(is_right(trial.correct, entry.answers))
    if judged is not None:
        row["stimulus"] = judged.stimulus
        if judged.stimulus != NOTHING:
            stimulus = protocol.stimuli[judged.stimulus]
            row["gain_db"] = float(entry.answers.get(LEVEL_DB, judged.gain_db)) + gain_db
            row |= _level_cell(stimulus, row["gain_db"]) if SET_TO not in entry.answers else {}
            mine = [name for name in protocol.factors if name in stimulus.factors and name not in row]
            row |= {name: stimulus.factors[name] for name in mine}  # whichever stimulus came first, in one order
    if other is not None:
        row["other"] = other.stimulus
    return {**row, **dict(trial.facts), **dict(entry.answers), **dict(entry.facts)}


def _judged(intervals: Sequence[Presentation], comparison: object) -> tuple[Presentation | None, Presentation | None]:
    """Return the judged presentation, which is the comparison if there is one, and the other one of the trial."""
    if not intervals:
        return None, None
    if len(intervals) == 1:
        return intervals[0], None
    first, second = intervals[0], intervals[1]
    return (second, first) if second.stimulus == comparison and first.stimulus != comparison else (first, second)


def by_value(rows: Iterable[Row], column: str) -> list[tuple[Any, list[Row]]]:
    """Return the rows grouped by the values of a column, sorted; every row must have the column.

    >>> by_value([{"a": 2, "b": 2}, {"a": 1, "b": 3}], "a")
    [(1, [{'a': 1, 'b': 3}]), (2, [{'a': 2, 'b': 2}])]
    """
    found: dict[Any, list[Row]] = {}
    for row in rows:
        found.setdefault(row[column], []).append(row)
    return sorted(found.items(), key=lambda part: part[0])


def factors_of(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the columns that are factors of stimuli and have more than one value.

    A table from another program has more columns. One that differs only between people is no factor. A number is one
    if each stimulus has a single value of it. Where no number is so, those are taken that neither count the trials nor
    were measured in each.

    >>> factors_of([{"stimulus": "a", "set": "WS"}, {"stimulus": "b", "set": "IT"}])
    ('set',)
    """
    names = possible_factors(rows)
    of_stimulus = {name for name in names if _is_one_for_each(rows, name, "stimulus")}
    of_person = {name for name in names if _is_one_for_each(rows, name, "participant")} - of_stimulus
    numbers = {name for name in names if all(isinstance(row.get(name, 0), int | float) for row in rows)} - {LEVEL}
    chosen = numbers & of_stimulus or {name for name in numbers if _is_chosen(rows, name)}
    others = (of_person | numbers - chosen) - {LEVEL}
    return tuple(name for name in names if name not in others)


def possible_factors(rows: Sequence[Row]) -> list[str]:
    """Return the columns that are not the table's own and have more than one value."""
    names = [name for name in columns_of(rows) if name not in NOT_FACTORS and not name.startswith(OF_PERSON)]
    return [name for name in names if len({row[name] for row in rows if name in row}) > 1]


def _is_one_for_each(rows: Sequence[Row], name: str, column: str) -> bool:
    """Return whether a column has one value for each value of another."""
    return all(len({row[name] for row in part if name in row}) < 2 for part in grouped(rows, column).values())


def _is_chosen(rows: Sequence[Row], name: str) -> bool:
    """Return whether a number comes back in the trials of each person, and for some of them also falls.

    >>> [_is_chosen([{"x": x} for x in xs], "x") for xs in ((1, 2, 1, 2), (1, 1, 2, 2), (0.3, 0.1, 0.2))]
    [True, False, False]
    """
    people = [[row[name] for row in part if name in row] for part in grouped(rows, "participant").values()]
    return all(2 * len(set(xs)) <= len(xs) for xs in people) and any(xs != sorted(xs) for xs in people)
