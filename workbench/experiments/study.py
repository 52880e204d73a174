"""The state machine of a study: a sequence of pages, each with its content and questions.

A `Study` is always at one `Page`. `answer` answers it and returns the `Entry` to be stored. A study made from a
protocol, a participant's id and the stored entries has the same state as the original. Windows and terminals do not
depend on methods, and methods do not depend on them.
"""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any

import msgspec
from msgspec.structs import replace

from underfoot.arguments import choice
from underfoot.errors import BadFile, BadValue, require
from underfoot.experiments.duration import usual_s
from underfoot.experiments.latin_square import Turn
from underfoot.experiments.method import ASKED, BLOCK_ROW, COUNTERBALANCED, FOOT, RIGHT, Method
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import MethodUse, Protocol, Stage
from underfoot.experiments.questions import YES, Adjusted, needs_answer, unanswered, yes_or_no
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import IDENTIFIER, Parameter, ask

PARTICIPANT = "participant"
"""The stage, before all of the protocol's, in which its questions of the participant are answered."""
AGREED = "agreed"
INTERRUPTED = "interrupted before the answer"
"""Why a trial is spoiled that was felt when the session ended."""
_ASKED_AGAIN = ("questions", "level")
"""Kinds of pages beside trials whose answer can be taken back."""
CALIBRATIONS = "calibrations in use: "
"""Words with which the program's own note of them begins; it holds for the entries after it."""
GAIN_DB = "gain_db"
LEVEL_RANGE_DB = (-40.0, 0.0)
"""Range of a participant's gain re the protocol's levels, in dB; never above 0."""
_AS_BEGUN = "go on with the protocol, the participant and the version that it was begun with"


class Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One answered page of `stage`, of a `kind`; in trials also the `trial` and the `attempt`.

    `spoiled` is the reason for which it does not count, else "". `facts` come from the runner: times, levels.
    """

    stage: str
    kind: str
    answers: Mapping[str, Any] = {}
    trial: Trial | None = None
    attempt: int = 1
    spoiled: str = ""
    facts: Mapping[str, Any] = {}


class Page(msgspec.Struct, frozen=True):
    """The current page. `kind` is the stage's, or "end"; `questions` are to be answered.

    It is at its `attempt`; in trials, `trial` is presented at most `plays` times, started by `start`. `seconds` is the
    duration of a pause or of learning. `feedback` is the feedback on the previous answer. `share` is the completed
    share of the study, 0 to 1.
    """

    stage: str
    kind: str
    title: str
    text: str
    questions: tuple[Parameter, ...] = ()
    trial: Trial | None = None
    attempt: int = 1
    plays: int = 1
    start: str = "key"
    seconds: float = 0.0
    feedback: str = ""
    practice: bool = False
    share: float = 0.0

    @property
    def key(self) -> str:
        """Text that identifies the page within the study."""
        number = f".{self.trial.number}.{self.attempt}" if self.trial is not None else ""
        return f"{self.stage}.{self.kind}{number}"


def require_id(participant: str) -> None:
    """Raise `BadValue` if the text is not a valid participant's id."""
    require(bool(IDENTIFIER.fullmatch(participant)), "participant", participant, "an id of letters, digits, - and _")


class Study:
    """One participant's progress through a checked protocol."""

    def __init__(self, protocol: Protocol, participant: str, entries: Iterable[Entry] = ()) -> None:
        """Begin the study, and replay `entries`; raise `BadFile` if they are of another protocol or participant."""
        require_id(participant)
        self.protocol, self.participant = protocol, participant
        self._stages = all_stages(protocol, participant)
        self.entries: list[Entry] = []
        before = list(entries)
        self._rows_begun = _rows_begun(before)
        self._begin()
        for number, entry in enumerate(before, 1):
            self._take_again(entry, number)

    @property
    def page(self) -> Page:
        """The current page."""
        return replace(self._page, share=self._share())

    @property
    def is_done(self) -> bool:
        """Whether the study is at its last page."""
        return self._page.kind == "end"

    @property
    def has_all_answers(self) -> bool:
        """Whether nothing is left to be answered: what follows, if anything, is only read, such as a word of thanks."""
        return _are_read(self._stages[self._at :])

    @property
    def gain_db(self) -> float:
        """The participant's gain re the protocol's levels, in dB; at most 0."""
        return self._gain_db

    @property
    def learnable(self) -> tuple[str, ...]:
        """The stimuli of the next trials, in the order of their numbers in learning, from 1."""
        use = self._next_method
        named = use.rule.listed_stimuli(use.given(self.protocol.stimuli)) if use is not None else ()
        return tuple(named) or tuple(self.protocol.stimuli)

    @property
    def learnable_answers(self) -> dict[int, str]:
        """The right answers of these, by number, as far as the next trials can be answered with them.

        What is right of two intervals, such as the comparison, is no answer: that is the first one, or the second.
        """
        use = self._next_method
        if use is None:
            return {}
        question, found = use.rule.questions_for(use.given(self.protocol.stimuli))[0], {}
        for number, name in enumerate(self.learnable, 1):
            with suppress(BadValue):
                found[number] = str(question.check(self.protocol.stimuli[name].correct))
        return {number: word for number, word in found.items() if word}

    @property
    def _next_method(self) -> MethodUse | None:
        """The method of the next trials; None if none come."""
        return next((stage.method for stage in self._stages[self._at :] if stage.method is not None), None)

    def answer(self, values: Answers, facts: Mapping[str, Any] | None = None) -> Entry:
        """Answer the page and advance; return the entry to be stored. After `BadValue` the state is unchanged."""
        page = self._page
        require(page.kind != "end", "answer", dict(values), "none: the study is at its end")
        entry = Entry(
            stage=page.stage,
            kind=page.kind,
            answers=self._checked(values),
            trial=page.trial,
            attempt=page.attempt,
            facts=dict(facts or {}),
        )
        self._take(entry)
        return entry

    def spoil(self, reason: str, facts: Mapping[str, Any] | None = None) -> Entry:
        """Spoil the current trial for a reason, to be presented again; return the entry to be stored."""
        require(bool(reason.strip()), "reason", reason, "why the trial is repeated")
        entry = self._spoiled(reason, facts or {})
        self._take(entry)
        return entry

    def unanswered(self, facts: Mapping[str, Any]) -> Entry:
        """Return the entry of the current trial while it is felt and not answered; the state is unchanged."""
        return self._spoiled(INTERRUPTED, facts)

    @property
    def was_interrupted(self) -> bool:
        """Whether the current trial was felt before, when the session ended."""
        return bool(self.entries) and self.entries[-1].spoiled == INTERRUPTED

    @property
    def can_repeat(self) -> bool:
        """Whether the previous page was answered, and can be repeated: a trial, questions, or the level."""
        last = self.entries[-1] if self.entries else None
        return last is not None and not last.spoiled and (last.trial is not None or last.kind in _ASKED_AGAIN)

    def without_last(self, reason: str) -> "Study":
        """Return the study before its last answer, which is marked as spoiled.

        The last entry of the new study is the spoiled one; it replaces the stored one. Raises `BadValue` if the last
        page cannot be repeated.
        """
        if not self.can_repeat:
            raise BadValue("the last page cannot be repeated; allowed: an answered trial, questions, or the level")
        require(bool(reason.strip()), "reason", reason, "why it is repeated")
        changed = replace(self.entries[-1], spoiled=reason)
        return Study(self.protocol, self.participant, [*self.entries[:-1], changed])

    def _spoiled(self, reason: str, facts: Mapping[str, Any]) -> Entry:
        page = self._page
        require(page.trial is not None, "page", page.kind, "a trial, to be repeated")
        return Entry(
            stage=page.stage,
            kind=page.kind,
            trial=page.trial,
            attempt=page.attempt,
            spoiled=reason,
            facts=dict(facts),
        )

    # --- transitions ---

    def _begin(self) -> None:
        self._at, self._attempt, self._answered, self._unrested, self._gain_db = 0, 1, 0, 0, 0.0
        self._feedback, self._pause = "", 0.0
        self._method: Method | None = None
        self._page: Page
        self._open_stage()

    def _take(self, entry: Entry) -> None:
        """Advance after an entry that fits the page."""
        trial, stage = self._page.trial, self._stages[self._at]
        self.entries.append(entry)
        self._feedback, self._pause = "", 0.0
        if entry.spoiled:
            self._attempt += 1
            self._page = self._made()
            return
        if entry.kind == "level":
            self._gain_db = float(entry.answers[GAIN_DB])
        if trial is not None and self._method is not None:
            self._method.answer(entry.answers)
            self._attempt, self._answered, self._unrested = 1, self._answered + 1, self._unrested + 1
            if stage.feedback:
                self._feedback = self._method.feedback(trial, entry.answers)
        if self._method is None or self._method.trial is None or self._answered == stage.most_trials > 0:
            self._at += 1
            self._open_stage()
            return
        if trial is not None:
            self._pause = _pause_s(stage, trial, self._method.trial, self._unrested)
            self._unrested = 0 if self._pause else self._unrested
        self._page = self._made()

    def _open_stage(self) -> None:
        """Begin the next stage: create its method and its first page."""
        self._attempt, self._method, self._answered, self._unrested = 1, None, 0, 0
        if self._at < len(self._stages):
            stage = self._stages[self._at]
            if stage.method is not None:
                begun = self._rows_begun.get(stage.id, 0)
                self._method = method_of(self.protocol, stage, self.participant, begun, self._asked)
        self._page = self._made()

    @property
    def _asked(self) -> Answers:
        """The answers about the participant."""
        mine = (entry.answers for entry in self.entries if entry.stage == PARTICIPANT and not entry.spoiled)
        return next(mine, {})

    def _made(self) -> Page:
        if self._at >= len(self._stages):
            return Page("", "end", "The end", "Every answer is kept.", feedback=self._feedback)
        stage = self._stages[self._at]
        page = Page(
            stage.id,
            stage.kind,
            stage.title,
            stage.text,
            attempt=self._attempt,
            feedback=self._feedback,
            practice=stage.practice,
        )
        match stage.kind:
            case "consent":
                return replace(page, questions=(yes_or_no(AGREED, "Do you agree to take part?"),))
            case "questions":
                return replace(page, questions=tuple(question.parameter for question in stage.questions))
            case "level":
                low, high = LEVEL_RANGE_DB
                gain = Adjusted(high, low, high, doc="Lower it until you only just feel it.", unit="dB")
                return replace(page, questions=(ask(GAIN_DB, gain),))
            case "trials" if self._pause > 0.0:
                return replace(page, kind="pause", title="Pause", text="", seconds=self._pause)
            case "trials" if self._method is not None:
                trial, questions = self._method.trial, self._method.questions
                return replace(page, questions=questions, trial=trial, plays=stage.plays, start=stage.start)
        return replace(page, seconds=stage.seconds)

    def _checked(self, values: Answers) -> dict[str, Any]:
        questions = self._page.questions
        unknown = set(values) - {question.name for question in questions}
        if unknown:
            raise BadValue(f"{self._page.title or self._page.stage} does not ask for {min(unknown)}")
        for question in questions:
            if question.name not in values and needs_answer(question):
                raise unanswered(question)
        checked = {question.name: question.check(values.get(question.name, question.default)) for question in questions}
        if self._page.kind == "consent":
            require(checked[AGREED] == YES, AGREED, checked[AGREED], "yes; who does not agree does not take part")
        return checked

    def _take_again(self, entry: Entry, number: int) -> None:
        """Replay a stored entry; raise an error if it does not fit the page."""
        page, trial = self._page, entry.trial
        if trial is not None and page.trial is not None and not trial.correct:  # an earlier version noted fewer
            trial = replace(trial, correct=page.trial.correct)
        if (entry.stage, entry.kind, trial, entry.attempt) != (page.stage, page.kind, page.trial, page.attempt):
            raise BadFile(
                f"entry {number} is of {entry.stage!r} ({entry.kind}), and the protocol asks for {page.stage!r} "
                f"({page.kind}); {_AS_BEGUN}"
            )
        if not entry.spoiled:
            try:
                self._checked(entry.answers)
            except BadValue as error:
                raise BadFile(f"entry {number}: {error}; {_AS_BEGUN}") from None
        self._take(entry)

    def _share(self) -> float:
        if self._at >= len(self._stages):
            return 1.0
        within = self._method.share if self._method is not None else 0.0
        if most := self._stages[self._at].most_trials:
            within = max(within, self._answered / most)
        return (sum(self._usual_s[: self._at]) + within * self._usual_s[self._at]) / self.usual_s

    @property
    def usual_s(self) -> float:
        """The approximate duration of the study in seconds."""
        return sum(self._usual_s)

    @cached_property
    def _usual_s(self) -> list[float]:
        return [usual_s(self.protocol, stage) for stage in self._stages]


def is_over(protocol: Protocol, participant: str, entries: Sequence[Entry]) -> bool:
    """Return whether these entries leave nothing to be answered; False where trials come last, since it is not known.

    `Study.has_all_answers` knows it of these, too, but goes through all of them, which takes seconds of QUEST+.
    """
    if not entries or entries[-1].spoiled:
        return False
    order, last = protocol.order_of(participant), entries[-1]
    for at, stage in enumerate(order):
        if (last.stage, last.kind) == (stage.id, stage.kind) and stage.kind != "trials":
            return _are_read(order[at + 1 :])
    return False


def _are_read(stages: Sequence[Stage]) -> bool:
    return all(stage.kind == "read" for stage in stages)


def _rows_begun(entries: Iterable[Entry]) -> dict[str, int]:
    """Return the row of the first block of each stage whose stimuli are counterbalanced, as its first trial has it."""
    found: dict[str, int] = {}
    for entry in entries:
        row = entry.trial.facts.get(BLOCK_ROW) if entry.trial is not None else None
        if isinstance(row, int):
            found.setdefault(entry.stage, row)
    return found


def method_of(
    protocol: Protocol, stage: Stage, participant: str, begun_row: int = 0, asked: Answers | None = None
) -> Method:
    """Return a stage's method at its first trial, with this participant's random order.

    Where an earlier version began the stage, `begun_row` is the row of a Latin square that it began with. `asked` are
    the answers about the participant; where nothing was answered, the right foot is preferred.
    """
    use = stage.method
    if use is None:
        raise BadValue(f"stage {stage.id!r} has no method")
    choice(f"method of stage {stage.id!r}", use.kind, sorted(METHODS))
    draws = SeededRandom(protocol.seed, participant, stage.id)
    turn = turn_of(protocol, stage, participant)._replace(begun=begun_row)
    given = use.given(protocol.stimuli)
    if given.get(use.rule.side) == ASKED:
        given[use.rule.side] = (asked or {}).get(FOOT, RIGHT)
    return use.rule(given, protocol.stimuli, draws, turn)


def turn_of(protocol: Protocol, stage: Stage, participant: str) -> Turn:
    """Return a participant's turn at a stage: behind the rows of the stages before it, by the protocol, that have as
    many counterbalanced stimuli.
    """
    size, _ = _square(protocol, stage)
    before = protocol.stages[: [one.id for one in protocol.stages].index(stage.id)]
    rows = [rows for of, rows in (_square(protocol, one) for one in before) if of == size]
    return Turn(participant, len(protocol.counterbalanced), sum(rows))


def _square(protocol: Protocol, stage: Stage) -> tuple[int, int]:
    """Return the number of counterbalanced stimuli of a stage, and of rows that it takes; 0 and 0 for none."""
    if stage.method is None:
        return 0, 0
    method, given = stage.method.rule, stage.method.given(protocol.stimuli)
    if given.get("order") != COUNTERBALANCED:
        return 0, 0
    size = len(method.listed_stimuli(given))
    return size, method.usual_trials(given, protocol.stimuli)[0] // size


def all_stages(protocol: Protocol, participant: str) -> Sequence[Stage]:
    """Return the stages in a participant's order, with the questions about the participant after the consent."""
    stages = list(protocol.order_of(participant))
    if protocol.participant:
        first = Stage(id=PARTICIPANT, kind="questions", title="About you", questions=protocol.participant)
        stages.insert(1 if stages[0].kind == "consent" else 0, first)
    return stages


def _pause_s(stage: Stage, trial: Trial, following: Trial, unrested: int) -> float:
    """Return the pause after a trial in seconds, behind its block or after so many trials without one; 0 for none."""
    rest_s = stage.rest_s if 0 < stage.rest_every <= unrested else 0.0
    if following.block == trial.block:
        return rest_s
    is_long = stage.long_pause_every and trial.block % stage.long_pause_every == 0
    return (stage.long_pause_s if is_long else stage.block_pause_s) or rest_s
