"""Selection of the analysis for each method, and analysis of a table of trials."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from underfoot.arguments import choice
from underfoot.errors import BadMeasurement, BadValue, require
from underfoot.experiments.analysis import (
    abx,
    adjustment,
    bayesian,
    constant,
    identification,
    labels,
    magnitudes,
    pairs,
    ratings,
    staircase,
    targets,
)
from underfoot.experiments.analysis.counterbalance import counterbalance
from underfoot.experiments.analysis.estimate import Estimate
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.people import LEAST_PEOPLE, add_people
from underfoot.experiments.analysis.questionnaires import questionnaires
from underfoot.experiments.analysis.right_answers import right_answers
from underfoot.experiments.analysis.sensitivity import sensitivity
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.analysis.stages import Estimates, changes, stages_compared
from underfoot.experiments.blind_comparison import METHOD, SLOTS
from underfoot.experiments.method import BLOCK_ROW
from underfoot.experiments.methods import METHODS
from underfoot.experiments.methods.adjustment import ASCENDING, DESCENDING, SET_TO
from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.methods.staircases import is_silent
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import FIRST, NO, SECOND, YES
from underfoot.experiments.table import OF_PERSON, Row, columns_of, counted, factors_of, grouped, possible_factors


@dataclass(frozen=True)
class Analysis:
    """Estimates from one person's rows, findings from all rows, and the columns that both need."""

    estimates: Callable[[Sequence[Row], Settings], list[Estimate]]
    findings: Callable[[Sequence[Row], Settings], Findings]
    needs: tuple[str, ...]
    name: str = ""
    """Name used if no protocol has the method."""
    needs_protocol: bool = False
    """Whether estimates depend on the method's parameters, which a table of trials does not contain."""


ANALYSES: Mapping[str, Analysis] = {
    "absolute-identification": Analysis(
        identification.estimates, identification.findings, ("correct", "number or answer")
    ),
    "constant-stimuli": Analysis(constant.estimates, constant.findings, ("stimulus",)),
    "staircases": Analysis(
        staircase.estimates, staircase.findings, ("staircase", "comparison", "level_db"), needs_protocol=True
    ),
    "adjustment": Analysis(adjustment.estimates, adjustment.findings, ("comparison", "series", "level_db or set_to")),
    "rating": Analysis(ratings.estimates, ratings.findings, ("stimulus", "rating")),
    "magnitude-estimation": Analysis(magnitudes.estimates, magnitudes.findings, ("stimulus", "magnitude")),
    "pairs": Analysis(pairs.estimates, pairs.findings, ("stimulus", "other", f"{DISSIMILARITY} or {SAME}")),
    "free-labels": Analysis(labels.estimates, labels.findings, ("stimulus", "label")),
    "target-selection": Analysis(
        targets.estimates, targets.findings, ("selected", "time_s", "width_m", "distance_m", "bearing_rad")
    ),
    "bayesian": Analysis(bayesian.estimates, bayesian.findings, ("level_db",), needs_protocol=True),
    METHOD: Analysis(abx.estimates, abx.findings, ("correct", "answered"), "Blind comparison"),
}


def settings_of(protocol: Protocol | None, stage: str, settings: Settings) -> Settings:
    """Return the settings with the parameters of a stage's method; the method's own without a protocol."""
    if protocol is None:
        return settings
    use = protocol.stage(stage).method
    if use is None:
        return settings
    given = use.given(protocol.stimuli)
    return replace(settings, given=given, is_beside_silence=is_silent(given, protocol.stimuli))


def analysed(rows: Sequence[Row], protocol: Protocol | None, settings: Settings) -> list[Findings]:
    """Return the findings of every stage that counts. Raises `BadMeasurement` if no trial counts.

    Raises `BadValue` for an unknown method, or a missing column.
    """
    found: list[Findings] = []
    people: dict[str, dict[str, Callable[[], Estimates]]] = {}
    for stage, method, part in _parts(rows):
        analysis = ANALYSES[method]
        findings = analysis.findings(part, settings_of(protocol, stage, settings))
        findings.title = f"{analysis.name or METHODS[method].name}: {stage}"
        findings.tables += [*right_answers(part), *sensitivity(part)]
        factors = factors_of(part)
        if aside := [name for name in possible_factors(part) if name not in factors]:
            findings.remarks.append(f"No factors of the stimuli, and left out: {', '.join(aside)}.")
        if protocol is None and analysis.needs_protocol:
            findings.remarks.append(
                "These trials come without their protocol: analysed with the method's usual parameters. "
                "`underfoot analyse --protocol` takes those of the study."
            )
        if not_set := sum(row.get("stiffness_set") is False for row in part):
            findings.remarks.append(
                f"In {not_set} of {len(part)} trials no plate set the stiffness that the table has."
            )
        findings.remarks += _spoiled(row for row in rows if row.get("stage", "") == stage and not row.get("practice"))
        of_people = cache(partial(_values, part, analysis, settings_of(protocol, stage, settings)))
        people.setdefault(method, {})[stage] = of_people
        _add_people(findings, part, of_people)
        found.append(findings)
    found += _stages_compared(people, counted(rows))
    return found if protocol is None else [*found, *questionnaires(rows, protocol), *counterbalance(rows, protocol)]


def estimates_of_people(rows: Sequence[Row], protocol: Protocol | None, settings: Settings) -> list[dict[str, Any]]:
    """Return a row of each person, as statistics programs want them: `participant`, what was asked, in the columns of
    the trials, and each estimate of each stage, as STAGE.NAME (UNIT); none where it is lacking.

    Raises errors as `analysed` does.
    """
    people: dict[str, dict[str, Any]] = {
        str(row["participant"]): {"participant": row["participant"]} for row in counted(rows)
    }
    for row in counted(rows):
        people[str(row["participant"])] |= {name: row[name] for name in row if name.startswith(OF_PERSON)}
    for stage, method, part in _parts(rows):
        for who, values in _estimates(part, ANALYSES[method], settings_of(protocol, stage, settings)):
            people[who] |= {f"{stage}.{_column(one)}": one.value for one in values if math.isfinite(one.value)}
    return list(people.values())


def _parts(rows: Sequence[Row]) -> Iterator[tuple[str, str, list[Row]]]:
    """Yield each stage that counts, with its method and rows, which are checked."""
    _check_truths(rows)
    parts = grouped(counted(rows), "stage", "method")
    if not parts:
        raise BadMeasurement("there is no trial that counts: all are practice, spoiled, or there are none")
    for (stage, method), part in parts.items():
        choice("method", method, ANALYSES)
        have = {name for row in part for name in row}
        for name in ANALYSES[method].needs:
            if not have & set(name.split(" or ")):
                needs = ", ".join(ANALYSES[method].needs)
                raise BadValue(f"the trials of {method} have no column {name}; allowed: a table with {needs}")
        _check_cells(part)
        yield stage, method, _trial_rows(part)


def _stages_compared(
    methods: Mapping[str, Mapping[str, Callable[[], Estimates]]], rows: Sequence[Row]
) -> list[Findings]:
    """Compare the stages of each method that has several, if two people or more did each of them, and by what these
    were asked how much each of them changed.
    """
    found = []
    for method, stages in methods.items():
        if len(stages) > 1:
            estimates = {stage: of_people() for stage, of_people in stages.items()}
            if min(map(len, estimates.values())) > 1:
                found.append(stages_compared(ANALYSES[method].name or METHODS[method].name, estimates))
                _add_people(found[-1], rows, partial(changes, estimates))
    return found


def _values(rows: Sequence[Row], analysis: Analysis, settings: Settings) -> dict[str, dict[str, float]]:
    """Return the values of each person's estimates, by name."""
    return {who: {one.name: one.value for one in found} for who, found in _estimates(rows, analysis, settings)}


def _estimates(rows: Sequence[Row], analysis: Analysis, settings: Settings) -> Iterator[tuple[str, list[Estimate]]]:
    """Yield each person's estimates, without the time that intervals take."""
    settings = replace(settings, bootstrap=0)
    for (who,), part in grouped(rows, "participant").items():
        yield str(who), analysis.estimates(part, settings)


def _column(one: Estimate) -> str:
    """Return an estimate's name with its unit, as a table of people has nothing else that says it."""
    return f"{one.name} ({one.unit})" if one.unit else one.name


def _spoiled(rows: Iterable[Row]) -> list[str]:
    """Return how many trials do not count, and why.

    >>> _spoiled([{"spoiled": "telephone"}, {"spoiled": "telephone"}, {"spoiled": "slipped"}, {"spoiled": ""}])
    ['3 spoiled trials are left out: telephone (2), slipped.']
    """
    reasons = Counter(str(row["spoiled"]) for row in rows if row.get("spoiled"))
    if not reasons:
        return []
    named = [f"{reason} ({count})" if count > 1 else reason for reason, count in reasons.most_common()]
    trials = f"{number} spoiled trials are" if (number := reasons.total()) > 1 else "1 spoiled trial is"
    return [f"{trials} left out: {', '.join(named)}."]


_NUMBERS = (
    *("trial", "block", "run", "rating", DISSIMILARITY, "magnitude", "level_db", "gain_db", "level_m_s2", "time_s"),
    *(SET_TO, "start_at", "standard_at"),
    *("width_m", "distance_m", "bearing_rad", "stages_row", BLOCK_ROW),
)
_WHOLE = ("number", "correct")
_WORDS = {
    "felt": (YES, NO),
    SAME: (YES, NO),
    "selected": (YES, NO),
    "interval": (FIRST, SECOND),
    "comparison_at": (FIRST, SECOND),
    "series": (ASCENDING, DESCENDING),
    "answered": SLOTS,
}
"""The words of answers; any other would count as the opposite."""
_MOST_FACTOR, _MOST_STIMULI = 1e15, 1000


class _TrialRow(dict[str, Any]):
    """A row of trials for an analysis; reading a missing cell raises an error that names the trial."""

    def __missing__(self, name: str) -> object:
        place = f"trial {self.get('trial')} of {self.get('participant')}"
        raise BadValue(f"{place} has no {name}; allowed: a {name} wherever the other trials have one")


def _trial_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the rows for an analysis, of each person in the order of trials, which spreadsheets can sort otherwise.

    A factor's values are all numbers, or all text; numbers of stimuli are whole.
    """
    people = grouped(rows, "participant").values()
    rows = [row for part in people for row in sorted(part, key=lambda row: float(row.get("trial", 0)))]
    words = []
    for name in factors_of(rows):
        values = [row[name] for row in rows if name in row]
        if not all(isinstance(value, int | float) and abs(value) <= _MOST_FACTOR for value in values):
            words.append(name)
    as_text = ({name: str(row[name]) for name in words if name in row} for row in rows)
    whole = ({name: int(row[name]) for name in _WHOLE if "number" in row} for row in rows)
    return [_TrialRow({**row, **text, **number}) for row, text, number in zip(rows, as_text, whole, strict=True)]


def _check_truths(rows: Sequence[Row]) -> None:
    """Raise `BadValue` where a trial is said to be practice, or empty, in words: it would not count."""
    for row in rows:
        for name in ("practice", "catch", "announced"):
            place = f"trial {row.get('trial')} of {row.get('participant')}: {name}"
            require(row.get(name, False) in (False, True), place, row.get(name), "true or false")


def _check_cells(rows: Sequence[Row]) -> None:
    """Raise `BadValue` for a cell whose value its column does not allow; tables can come from other programs."""
    for row in rows:
        place = f"trial {row.get('trial')} of {row.get('participant')}: "
        for name in _NUMBERS:
            value, most = row.get(name, 0), "300" if name.endswith("_db") else "1e6"
            good = isinstance(value, int | float) and abs(value) <= float(most)
            require(good, place + name, value, f"a number up to {most}")
        require(row.get("magnitude", 1) > 0, place + "magnitude", row.get("magnitude"), "a number above 0")
        require(row.get("right", 0) in (0, 1), place + "right", row.get("right"), "0 or 1")
        for name, words in _WORDS.items():
            require(row.get(name, words[0]) in words, place + name, row.get(name), " or ".join(words))
        for name in _WHOLE if "number" in row else ():
            value = row.get(name)
            good = isinstance(value, int | float) and value % 1 == 0 and 0 < value <= _MOST_STIMULI
            require(good, place + name, value, f"a whole number, 1 to {_MOST_STIMULI}")


def _add_people(findings: Findings, rows: Sequence[Row], estimates: Callable[[], Estimates]) -> None:
    """Add what of the estimates of each person follows what they were asked, of enough people."""
    people = grouped(rows, "participant").values()
    if len(people) >= LEAST_PEOPLE and any(name.startswith(OF_PERSON) for name in columns_of(rows)):
        of_people = estimates()
        of_each = [of_people.get(str(part[0]["participant"]), {}) for part in people]
        add_people(findings, [part[0] for part in people], of_each)
