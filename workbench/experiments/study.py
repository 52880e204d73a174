"""A study without a screen: a state machine of pages, each with what it shows and what it asks.

A `Study` stands on one `Page` at a time. A page is answered with `answer`, which gives the `Entry` to be kept; made
from a protocol, a participant's id and the entries so far, a study stands where it stood. Whoever shows the pages, a
window or a terminal, knows no method, and no method knows who shows them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import msgspec

from underfoot.errors import BadFile, BadValue, require
from underfoot.experiments.duration import usual_s
from underfoot.experiments.method import Method
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.questions import ask, needs_answer, unanswered, yes_or_no
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import IDENTIFIER, Number, Parameter

PARTICIPANT = "participant"
"""The stage, before all of the protocol's, in which its questions of the participant are answered."""
AGREED = "agreed"
GAIN_DB = "gain_db"
LEVEL_RANGE_DB = (-40.0, 0.0)
"""How far a participant can be below the protocol's levels; never above."""


class Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One page that was answered: of which `stage`, and of what `kind`; in trials which `trial`, at which `attempt`.

    `spoiled` is the reason why it does not count; "" where it does. `facts` are what the runner knows: times, levels.
    """

    stage: str
    kind: str
    answers: Mapping[str, Any] = {}
    trial: Trial | None = None
    attempt: int = 1
    spoiled: str = ""
    facts: Mapping[str, Any] = {}


@dataclass(frozen=True)
class Page:
    """What is shown now. `kind` is the stage's, or "end"; `questions` are what is answered.

    In trials: `trial`, at which `attempt`, with as many `plays`, begun by `start`. `seconds` is how long a pause or a
    time of learning lasts. `feedback` is what to show of the answer before. `share` is how much is done, 0 to 1.
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
        """What tells it from all other pages of the study."""
        number = f".{self.trial.number}.{self.attempt}" if self.trial is not None else ""
        return f"{self.stage}.{self.kind}{number}"


def require_id(participant: str) -> None:
    """Raise `BadValue` for what is no participant's id."""
    require(bool(IDENTIFIER.fullmatch(participant)), "participant", participant, "an id of letters, digits, - and _")


class Study:
    """One participant's way through a protocol, which must have been checked."""

    def __init__(self, protocol: Protocol, participant: str, entries: Iterable[Entry] = ()) -> None:
        """`BadFile` where the entries are not of this protocol and participant."""
        require_id(participant)
        self.protocol, self.participant = protocol, participant
        self._stages = all_stages(protocol)
        self.entries: list[Entry] = []
        self._begin()
        for number, entry in enumerate(entries, 1):
            self._take_again(entry, number)

    @property
    def page(self) -> Page:
        """What is shown now."""
        return replace(self._page, share=self._share())

    @property
    def is_done(self) -> bool:
        """Whether the last page is reached."""
        return self._page.kind == "end"

    @property
    def gain_db(self) -> float:
        """How far below the protocol's levels this participant is, 0 or less."""
        return self._gain_db

    @property
    def learnable(self) -> tuple[str, ...]:
        """The stimuli that can be tried in learning, by their number from 1: those of the next trials."""
        stages = self.protocol.order()
        here = next((k for k, stage in enumerate(stages) if stage.id == self._page.stage), 0)
        for stage in stages[here:]:
            if stage.method is not None:
                method = METHODS[stage.method.kind]
                given = method.checked(stage.method.parameters, self.protocol.stimuli)
                named = next((value for name, value in given.items() if method.names_stimuli(name)), ())
                return tuple(named) or tuple(self.protocol.stimuli)
        return tuple(self.protocol.stimuli)

    def answer(self, values: Answers, facts: Mapping[str, Any] | None = None) -> Entry:
        """Answer the page and go on; what is to be kept of it. `BadValue` leaves all as it was."""
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
        """Leave the trial that is shown unanswered, for a reason, and present it again: the entry to be kept."""
        page = self._page
        require(page.trial is not None, "page", page.kind, "a trial, to be repeated")
        require(bool(reason.strip()), "reason", reason, "why the trial is repeated")
        entry = Entry(
            stage=page.stage,
            kind=page.kind,
            trial=page.trial,
            attempt=page.attempt,
            spoiled=reason,
            facts=dict(facts or {}),
        )
        self._take(entry)
        return entry

    @property
    def can_repeat(self) -> bool:
        """Whether the last page was a trial that was answered, which can be taken back."""
        last = self.entries[-1] if self.entries else None
        return last is not None and last.trial is not None and not last.spoiled

    def without_last(self, reason: str) -> "Study":
        """This study before its last answer, which is spoiled for a reason; `BadValue` where that is no trial.

        The new study's last entry is the spoiled one, to be kept in the place of the one before.
        """
        if not self.can_repeat:
            raise BadValue("the last page was no trial that was answered; only such can be repeated")
        require(bool(reason.strip()), "reason", reason, "why the trial is repeated")
        changed = msgspec.structs.replace(self.entries[-1], spoiled=reason)
        return Study(self.protocol, self.participant, [*self.entries[:-1], changed])

    # --- how it goes on ---

    def _begin(self) -> None:
        self._at, self._attempt, self._answered, self._gain_db = 0, 1, 0, 0.0
        self._feedback, self._pause = "", 0.0
        self._method: Method | None = None
        self._page: Page
        self._open_stage()

    def _take(self, entry: Entry) -> None:
        """Go on behind an entry that fits the page."""
        stage, page = self._stages[self._at], self._page
        self.entries.append(entry)
        self._feedback, self._pause = "", 0.0
        if entry.spoiled:
            self._attempt += 1
            self._page = self._made()
            return
        if page.kind == "level":
            self._gain_db = float(entry.answers[GAIN_DB])
        if page.trial is None or self._method is None:
            if not (page.kind == "pause" and stage.kind == "trials"):
                self._at += 1
                self._open_stage()
                return
        else:
            self._method.answer(entry.answers)
            self._attempt, self._answered = 1, self._answered + 1
            if stage.feedback:
                self._feedback = self._method.feedback(page.trial, entry.answers)
            self._pause = _pause_s(stage, page.trial, self._method.trial)
        if self._method is not None and (self._method.trial is None or self._answered == stage.most_trials > 0):
            self._pause = 0.0
            self._at += 1
            self._open_stage()
        else:
            self._page = self._made()

    def _open_stage(self) -> None:
        """Come to the stage that is now due: make its method, and its first page."""
        self._attempt, self._method, self._answered = 1, None, 0
        if self._at < len(self._stages):
            stage = self._stages[self._at]
            if stage.method is not None:
                self._method = method_of(self.protocol, stage, self.participant)
        self._page = self._made()

    def _made(self) -> Page:
        if self._at >= len(self._stages):
            return Page("", "end", "Thank you", "This is the end.", feedback=self._feedback)
        stage = self._stages[self._at]
        page = Page(stage.id, stage.kind, stage.title, stage.text, feedback=self._feedback, practice=stage.practice)
        match stage.kind:
            case "consent":
                return replace(page, questions=(yes_or_no(AGREED, "Do you agree to take part?"),))
            case "questions":
                return replace(page, questions=tuple(question.parameter for question in stage.questions))
            case "level":
                low, high = LEVEL_RANGE_DB
                gain = Number(high, low, high, doc="Where you only just feel it.", unit="dB")
                return replace(page, questions=(ask(GAIN_DB, gain),))
            case "trials" if self._pause > 0.0:
                return replace(page, kind="pause", title="Pause", text="", seconds=self._pause)
            case "trials" if self._method is not None:
                trial, questions = self._method.trial, self._method.questions
                return replace(
                    page, questions=questions, trial=trial, attempt=self._attempt, plays=stage.plays, start=stage.start
                )
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
            require(checked[AGREED] == "yes", AGREED, checked[AGREED], "yes; who does not agree does not take part")
        return checked

    def _take_again(self, entry: Entry, number: int) -> None:
        """Take an entry that was kept; it must fit what the protocol asks at that place."""
        page = self._page
        if (entry.stage, entry.kind, entry.trial, entry.attempt) != (page.stage, page.kind, page.trial, page.attempt):
            raise BadFile(
                f"entry {number} is of {entry.stage!r} ({entry.kind}), and the protocol asks for {page.stage!r} "
                f"({page.kind}); go on with the protocol, the participant and the version that it was begun with"
            )
        if not entry.spoiled:
            try:
                self._checked(entry.answers)
            except BadValue as error:
                raise BadFile(f"entry {number}: {error}") from None
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
        """About how many seconds all pages take."""
        return sum(self._usual_s)

    @cached_property
    def _usual_s(self) -> list[float]:
        return [usual_s(self.protocol, stage) for stage in self._stages]


def method_of(protocol: Protocol, stage: Stage, participant: str) -> Method:
    """The method of a stage at its first trial, as a participant gets it."""
    use = stage.method
    if use is None:
        raise BadValue(f"stage {stage.id!r} has no method")
    require(use.kind in METHODS, f"method of stage {stage.id!r}", use.kind, ", ".join(sorted(METHODS)))
    given = METHODS[use.kind].checked(use.parameters, protocol.stimuli)
    return METHODS[use.kind](given, protocol.stimuli, SeededRandom(protocol.seed, participant, stage.id))


def all_stages(protocol: Protocol) -> Sequence[Stage]:
    """The stages in their order, with the questions of the participant behind the consent."""
    stages = list(protocol.order())
    if protocol.participant:
        first = Stage(id=PARTICIPANT, kind="questions", title="About you", questions=protocol.participant)
        stages.insert(1 if stages[0].kind == "consent" else 0, first)
    return stages


def _pause_s(stage: Stage, trial: Trial, following: Trial | None) -> float:
    """The pause behind the last trial of a block."""
    if following is None or following.block == trial.block:
        return 0.0
    if stage.long_pause_every and trial.block % stage.long_pause_every == 0:
        return stage.long_pause_s
    return stage.block_pause_s
