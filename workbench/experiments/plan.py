"""The trials of one participant in advance, as they follow from seed, id and protocol."""

from collections.abc import Sequence
from typing import Any

from underfoot.experiments.columns import NOT_FACTORS
from underfoot.experiments.method import ListedMethod
from underfoot.experiments.protocol import MethodUse, Protocol, Stage
from underfoot.experiments.study import Entry, method_of, require_id
from underfoot.experiments.table import rows_of
from underfoot.experiments.trials import NOTHING, Presentation, Trial

COLUMNS = ("stage", "block", "trial", "condition", "stimulus", "level_m_s2", "correct")
ADAPTIVE = "adaptive: follows the answers"
_OF_TRIAL = ("series", "comparison_at", "width_m", "distance_m", "bearing_rad", "announced")
"""Facts of a trial that a person arranges or looks for; the others follow from the stimuli."""


def plan_of(protocol: Protocol, participant: str) -> list[dict[str, Any]]:
    """Return the trials of all stages in the order in which a participant gets them, one row each, with `COLUMNS`.

    A stage whose trials depend on the answers has one row, which says so. Levels are those of the protocol; a
    participant who has set a level gets lower ones.

    >>> from underfoot.patch import preset_files
    >>> protocol = Protocol.load(preset_files.protocols()["identification-impact"])
    >>> len(plan_of(protocol, "P01"))
    96
    """
    require_id(participant)
    uses = [(stage, stage.method) for stage in protocol.order_of(participant) if stage.method is not None]
    return [row for stage, use in uses for row in _rows(protocol, stage, use, participant)]


def _rows(protocol: Protocol, stage: Stage, use: MethodUse, participant: str) -> list[dict[str, Any]]:
    if not issubclass(use.rule, ListedMethod):
        names = ", ".join(use.rule.peak_gains_db(use.given(protocol.stimuli)))
        return [{**dict.fromkeys(COLUMNS, ""), "stage": stage.id, "stimulus": names, "level_m_s2": ADAPTIVE}]
    method = method_of(protocol, stage, participant)
    assert isinstance(method, ListedMethod)
    trials = method.trials[: stage.most_trials or None]
    entries = [Entry(stage=stage.id, kind=stage.kind, trial=trial, spoiled="not yet") for trial in trials]
    tables = rows_of(protocol, participant, entries)
    return [_row(protocol, stage, trial, row) for trial, row in zip(trials, tables, strict=True)]


def _row(protocol: Protocol, stage: Stage, trial: Trial, known: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one trial; of two intervals the first is named first."""
    facts = {name: value for name, value in known.items() if name not in NOT_FACTORS or name in _OF_TRIAL}
    for name in ("judged_more", "level_m_s2"):  # the question's, and in a column of its own
        facts.pop(name, None)
    return {
        "stage": stage.id,
        "block": trial.block,
        "trial": trial.number,
        "condition": ", ".join(f"{name} {_short(value)}" for name, value in facts.items()),
        "stimulus": _each([one.stimulus or "nothing" for one in trial.intervals]),
        "level_m_s2": _each([_level(protocol, one) for one in trial.intervals]),
        "correct": trial.correct,
    }


def _each(words: Sequence[str]) -> str:
    return ", then ".join(words)


def _level(protocol: Protocol, one: Presentation) -> str:
    peak_m_s2 = 0.0 if one.stimulus == NOTHING else protocol.stimuli[one.stimulus].peak_m_s2(one.gain_db)
    return "not known" if peak_m_s2 is None else f"{peak_m_s2:.4g}"


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
