"""The document of a study: its participants, stimuli and stages.

A protocol is immutable. `check` verifies that it can be run, and names the place of a mistake. No content of a file is
executed.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from underfoot.arguments import choice
from underfoot.documents import parse, placed, refusals
from underfoot.errors import BadFile, BadValue, UnderfootError, require
from underfoot.experiments.columns import NOT_FACTORS
from underfoot.experiments.foot import FootAnswer
from underfoot.experiments.languages import EN, language_of
from underfoot.experiments.latin_square import number_of_row, row_of
from underfoot.experiments.method import ASKED, COUNTERBALANCED, FOOT, LEFT, RIGHT, Method
from underfoot.experiments.methods import METHODS
from underfoot.experiments.questions import Question
from underfoot.experiments.stimuli import Level, Stimulus, parameters_of, patch_path
from underfoot.files import read_file, write_file
from underfoot.parameters import IDENTIFIER, Number, require_identifier
from underfoot.patch.custom_nodes import files_needed
from underfoot.patch.node_files import NodeFile, has_nodes
from underfoot.patch.patch import Patch

FORMAT = "underfoot-protocol"
VERSION = 1

Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=86400.0)]
Decibels = Annotated[float, msgspec.Meta(ge=-120.0, le=0.0)]


def _described(text: str, label: str = "") -> msgspec.Meta:
    """Return a field's description and label for forms."""
    return msgspec.Meta(description=text, title=label or None)


_PILOT_TRIALS, _PILOT_PAUSE_S = 2, 5.0
END = "end"
"""The value of `Stage.next` for the end of the study."""


class MethodUse(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The method of a stage, and its parameters."""

    kind: str
    parameters: Mapping[str, Any] = {}

    @property
    def rule(self) -> type[Method]:
        """The method of this kind."""
        return METHODS[self.kind]

    def given(self, stimuli: Mapping[str, Stimulus]) -> dict[str, Any]:
        """Return all of the method's parameters, as `Method.checked` does."""
        return self.rule.checked(self.parameters, stimuli)

    def of_either_foot(self) -> "MethodUse":
        """Return the method without the foot that it is for, as far as the rows of its trials are alike for either."""
        side = self.rule.side if self.kind in METHODS else ""
        return MethodUse(self.kind, {name: value for name, value in self.parameters.items() if name != side})


class Stage(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One stage. `kind`: "consent", "questions", "read" (an instruction), "learn" (stimuli to try by number, for
    `seconds`), "level" (adjustment until `stimulus` is just felt), "trials" of a `method`, or a "pause" of `seconds`.

    In trials, `start` is what starts a presentation: a key, a step onto the tile, or two crossings of it (there and
    back). `most_trials` limits the number of trials. The pauses are `trial_pause_s` between trials, `interval_pause_s`
    between the intervals of a trial and `block_pause_s` between blocks, or `long_pause_s` after every
    `long_pause_every` blocks. After `rest_every` trials without any of these last two, also within a block, there is
    one of `rest_s`. `practice` excludes the stage from the analysis. `foot` allows answers by stepping on the
    floor. `next` is the id of the next stage: "end" for none, "" for the next in the list.
    """

    id: str
    kind: Literal["consent", "questions", "read", "learn", "level", "trials", "pause"]
    title: str = ""
    text: Annotated[str, _described("Read on its page; in trials before each one, or feedback in its place.")] = ""
    questions: tuple[Question, ...] = ()
    method: MethodUse | None = None
    stimulus: str = ""
    practice: Annotated[bool, _described("Left out of the analysis.")] = False
    start: Annotated[
        Literal["key", "step", "crossings"],
        _described("A key, a step onto the tile, or crossing it there and back.", "Begun by"),
    ] = "key"
    plays: Annotated[int, msgspec.Meta(ge=1, le=1000), _described("How often it can be felt, by a key.")] = 1
    most_trials: Annotated[
        int, msgspec.Meta(ge=0, le=100_000), _described("Ends after so many trials; 0: after all of them.")
    ] = 0
    feedback: Annotated[bool, _described("Whether the right answer is shown, where there is one.")] = False
    foot: FootAnswer | None = None
    seconds: Annotated[
        Seconds, _described("How long it lasts; 0 in learning: until the participant goes on.", "Lasts")
    ] = 0.0
    trial_pause_s: Annotated[Seconds, _described("Between trials.")] = 0.0
    interval_pause_s: Annotated[Seconds, _described("Between the two intervals of a trial.")] = 0.5
    block_pause_s: Annotated[Seconds, _described("Between blocks.")] = 0.0
    long_pause_s: Annotated[Seconds, _described("In its place, after every so many blocks.")] = 0.0
    long_pause_every: Annotated[int, msgspec.Meta(ge=0, le=1000), _described("Blocks until a long pause; 0: none.")] = 0
    rest_s: Annotated[Seconds, _described("After so many trials without a pause, also within a block.")] = 0.0
    rest_every: Annotated[int, msgspec.Meta(ge=0, le=100_000), _described("Trials until such a rest; 0: none.")] = 0
    next: Annotated[str, _described("Where the study goes on behind this stage.", "Followed by")] = ""

    def pause_s(self, stimuli: Mapping[str, Stimulus]) -> float:
        """Return the pause from one of its trials to the next: its method's own, or `trial_pause_s`."""
        own = self.method.given(stimuli).get("pause_s", 0.0) if self.method is not None else 0.0
        return float(own or self.trial_pause_s)


_WORDS = ("title", "text")
FIELDS_OF_KIND: Mapping[str, tuple[str, ...]] = {
    "consent": _WORDS,
    "questions": (*_WORDS, "questions"),
    "read": _WORDS,
    "learn": (*_WORDS, "seconds"),
    "level": (*_WORDS, "stimulus"),
    "trials": (*_WORDS, "method", "most_trials", "start", "plays", "feedback", "practice", "foot", "trial_pause_s",
               "interval_pause_s", "block_pause_s", "long_pause_s", "long_pause_every", "rest_s", "rest_every"),
    "pause": (*_WORDS, "seconds"),
}  # fmt: skip
"""The fields of a stage that say something, by its kind; `id` and `next` every stage has."""


class Sounds(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Sound during the whole study, on a separate sound card: masking `noise` at `noise_db` (RMS, dB re full scale),
    and a metronome at `metronome_hz` (0 for none) with clicks of `metronome_db`. `channel` of the card counts from 0.
    """

    noise: Annotated[Literal["none", "pink", "white"], _described("Masks what the tiles sound like.")] = "none"
    noise_db: Annotated[Decibels, _described("RMS, re full scale.", "Noise level")] = -30.0
    metronome_hz: Annotated[float, msgspec.Meta(ge=0.0, le=10.0), _described("Clicks a second; 0: none.")] = 0.0
    metronome_db: Annotated[Decibels, _described("Of the clicks, re full scale.", "Metronome level")] = -30.0
    channel: Annotated[int, msgspec.Meta(ge=0, le=255), _described("Of the sound card, from 0.")] = 0


class Protocol(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A study. `limit_m_s2` limits the acceleration of all stimuli, in m/s^2; `present_s` is the duration of a
    presentation started by a key, in seconds. `language` is that of the program's words on participants' pages: "en",
    another preset's name, or a file's beside the protocol.
    """

    format: str = FORMAT
    version: int = VERSION
    title: Annotated[str, _described("What it is called in the list.")] = ""
    about: Annotated[str, _described("What it is about, for experimenters.")] = ""
    seed: Annotated[int, msgspec.Meta(ge=0, le=2**53), _described("The same seed and participant: the same order.")] = 0
    counterbalanced: Annotated[
        tuple[str, ...],
        _described(
            "Ids of stages that change places from participant to participant: rows of Williams's Latin square, by the "
            "number in the participant's id."
        ),
    ] = ()
    double_blind: Annotated[
        bool, _described("The experimenter's page and the level meter show neither vibration nor answers by stimulus.")
    ] = False
    participant: tuple[Question, ...] = ()
    limit_m_s2: Annotated[Level, _described("Nothing is presented above this peak acceleration.")] = 20.0
    language: Annotated[
        str, _described("Of what the program says to participants; what you wrote yourself stays as it is.")
    ] = EN
    present_s: Annotated[
        float, msgspec.Meta(ge=0.05, le=600.0), _described("How long a presentation by a key lasts.", "Presented for")
    ] = 2.0
    sounds: Sounds = Sounds()
    stimuli: Mapping[str, Stimulus] = {}
    stages: tuple[Stage, ...] = ()

    def stage(self, id: str) -> Stage:
        """Return the stage with this id; raise `BadValue` if there is none."""
        for stage in self.stages:
            if stage.id == id:
                return stage
        raise BadValue(f"there is no stage {id!r}; allowed: {', '.join(s.id for s in self.stages) or 'none'}")

    def order(self) -> tuple[Stage, ...]:
        """Return the stages in order of execution; raise `BadValue` for a cycle."""
        following = {stage.id: place for place, stage in enumerate(self.stages)}
        order: dict[str, Stage] = {}
        at = 0
        while 0 <= at < len(self.stages):
            stage = self.stages[at]
            if stage.id in order:
                loop = [*list(order)[list(order).index(stage.id) :], stage.id]
                raise BadValue(f"stages make a cycle: {' -> '.join(loop)}; let one of them be followed by {END!r}")
            order[stage.id] = stage
            at = at + 1 if not stage.next else following.get(stage.next, -1)
        return tuple(order.values())

    def order_of(self, participant: str) -> tuple[Stage, ...]:
        """Return the stages in a participant's order: those that are counterbalanced have changed places."""
        order, size = list(self.order()), len(self.counterbalanced)
        if size:
            places = [k for k, stage in enumerate(order) if stage.id in self.counterbalanced]
            row = row_of(size, number_of_row(participant, size))
            for place, which in zip(places, row, strict=True):
                order[place] = self.stage(self.counterbalanced[which])
        return tuple(order)

    @property
    def factors(self) -> tuple[str, ...]:
        """The names of its stimuli's factors, in the order in which it has them."""
        return tuple(dict.fromkeys(name for stimulus in self.stimuli.values() for name in stimulus.factors))

    @property
    def follows_number(self) -> bool:
        """Whether an order is counterbalanced, and follows the number in a participant's id."""
        uses = (stage.method.parameters for stage in self.stages if stage.method is not None)
        return bool(self.counterbalanced) or any(given.get("order") == COUNTERBALANCED for given in uses)

    def pilot(self) -> "Protocol":
        """Return a short version for a trial run by the experimenter: two trials per stage, short pauses, and no
        questions about the participant.
        """
        title, stages = f"{self.title}, pilot", tuple(map(_pilot, self.stages))
        return msgspec.structs.replace(self, title=title, participant=(), stages=stages)

    def without_words(self) -> "Protocol":
        """Return this protocol without what changes no row of a trial: titles, texts, language, words of questions,
        whether it is double-blind, and the foot from which the places of its buttons are counted.
        """

        def unread(questions: tuple[Question, ...]) -> tuple[Question, ...]:
            return tuple(msgspec.structs.replace(one, text="") for one in questions)

        stages = tuple(
            msgspec.structs.replace(
                stage,
                title="",
                text="",
                questions=unread(stage.questions),
                method=stage.method and stage.method.of_either_foot(),
            )
            for stage in self.stages
        )
        none = {"title": "", "about": "", "language": EN, "double_blind": False}
        return msgspec.structs.replace(self, **none, participant=unread(self.participant), stages=stages)

    # --- checks ---

    def check(self, folder: Path | None = None) -> "Protocol":
        """Return this protocol if it can be run; else raise `BadValue` with the place, the value, and what is allowed.

        Patches and languages are presets, or files in `folder`.
        """
        require(self.format == FORMAT, "format", self.format, FORMAT)
        require(self.version == VERSION, "version", self.version, str(VERSION))
        try:
            language_of(self.language, folder)
        except UnderfootError as error:
            raise BadValue(f"language: {error}") from None
        for name, stimulus in self.stimuli.items():
            require(bool(IDENTIFIER.fullmatch(name)), "stimuli", name, "names of letters, digits, - and _")
            stimulus.check(f"stimuli.{name}", folder, self.limit_m_s2)
        _check_questions("participant", self.participant)
        require(bool(self.stages), "stages", [], "at least one")
        seen: set[str] = set()
        for i, stage in enumerate(self.stages):
            place = f"stages[{i}]"
            require_identifier(f"{place}.id", stage.id)
            require(
                stage.id not in seen | {END, "participant"}, f"{place}.id", stage.id, "an id that no other stage has"
            )
            seen.add(stage.id)
        for i, stage in enumerate(self.stages):
            self._check_stage(f"stages[{i}]", stage, seen)
            self._check_settings(f"stages[{i}].method.parameters.parameter", stage, folder)
        left_out = seen - {stage.id for stage in self.order()}
        if left_out:
            first = min(left_out)
            raise BadValue(f"stages: no stage leads to {first!r}; name it in the next of another, or remove it")
        several = len(set(self.counterbalanced)) == len(self.counterbalanced) != 1 and seen.issuperset(
            self.counterbalanced
        )
        allowed = f"two or more stages of this protocol ({', '.join(sorted(seen))}), each once, or none"
        require(several, "counterbalanced", list(self.counterbalanced), allowed)
        return self

    def _check_stage(self, place: str, stage: Stage, ids: set[str]) -> None:
        allowed = f"stages of this protocol ({', '.join(sorted(ids))}), or {END!r}"
        require(stage.next in ids | {"", END}, f"{place}.next", stage.next, allowed)
        _check_questions(f"{place}.questions", stage.questions)
        if stage.kind == "questions":
            require(bool(stage.questions), f"{place}.questions", [], "at least one")
        if stage.kind == "level":
            have = ", ".join(self.stimuli) or "none"
            require(stage.stimulus in self.stimuli, f"{place}.stimulus", stage.stimulus, f"the stimuli: {have}")
        if stage.kind == "learn":
            require(bool(self.stimuli), f"{place}.kind", stage.kind, "learn only where there are stimuli")
        if stage.kind != "trials":
            require(stage.method is None, f"{place}.method", "a method", "none, in a stage that has no trials")
            require(stage.foot is None, f"{place}.foot", "an answer by foot", "none, in a stage that has no trials")
            return
        if stage.method is None:
            raise BadValue(f"{place}.method is missing; allowed: {', '.join(METHODS)}")
        kind = stage.method.kind
        choice(f"{place}.method.kind", kind, METHODS)
        rule = stage.method.rule
        try:
            given = stage.method.given(self.stimuli)
        except BadValue as error:
            raise BadValue(f"{place}.method.parameters.{error}") from None
        if given.get(rule.side) == ASKED:
            self._require_foot_asked(f"{place}.method.parameters.{rule.side}")
        right = rule.right_answers(given)
        for name, gain_db in rule.peak_gains_db(given).items():
            correct = self.stimuli[name].correct
            allowed = f"{', '.join(filter(None, right))} (of {stage.id!r})"
            require(not right or correct in right, f"stimuli.{name}.correct", correct, allowed)
            peak = self.stimuli[name].peak_m_s2(gain_db) or 0.0  # one that is not known is not refused
            where = f"{place}.method reaches {peak:.3g} m/s^2 with {name}"
            if peak > self.limit_m_s2 * (1.0 + 1e-9):
                lower = (
                    f"its gain goes up to {gain_db:g} dB; lower that, or its level"
                    if gain_db > 0.0
                    else "lower its level"
                )
                raise BadValue(f"{where}; allowed: up to limit_m_s2, {self.limit_m_s2:g}: {lower}")
        if stage.foot is not None:
            stage.foot.check(f"{place}.foot", rule.questions_for(given))

    def _check_settings(self, place: str, stage: Stage, folder: Path | None) -> None:
        """Raise `BadValue` for numbers of patches that a method cannot move, or not so far."""
        use = stage.method
        for name, parameter, value in use.rule.settings_reached(use.given(self.stimuli)) if use is not None else ():
            stimulus = self.stimuli[name]
            known = parameters_of(stimulus.patch, folder) if stimulus.patch else {}
            numbers = [of for of, one in known.items() if isinstance(one, Number) and of != stimulus.scaled_by]
            require(parameter in numbers, place, parameter, f"numbers of {name}: {', '.join(numbers) or 'none'}")
            moved = msgspec.structs.replace(stimulus, settings={**stimulus.settings, parameter: value})
            try:
                moved.check(f"stimuli.{name}", folder, self.limit_m_s2)
            except BadValue as error:
                raise BadValue(f"{place}: {error}") from None

    def _require_foot_asked(self, place: str) -> None:
        """Raise `BadValue` where the participant is not asked which foot is preferred."""
        options = next((set(one.options) for one in self.participant if one.name == FOOT), set())
        allowed = f"{RIGHT} or {LEFT}, or {ASKED} with a question {FOOT} about the participant whose options these are"
        require(options == {RIGHT, LEFT}, place, ASKED, allowed)

    def _require_meaning(self) -> None:
        """Raise `BadValue` where answers would say nothing, or the table of trials could not hold them.

        Sessions that were measured so before this was refused are read all the same.
        """
        for name, stimulus in self.stimuli.items():
            for factor in stimulus.factors:
                allowed = "names that are not columns of the table of trials already"
                require(factor not in NOT_FACTORS, f"stimuli.{name}.factors", factor, allowed)
        for i, stage in enumerate(self.stages):
            if stage.kind == "level":
                self._require_level_moves(f"stages[{i}].stimulus", stage.stimulus)
            elif stage.method is not None:
                rule, place = stage.method.rule, f"stages[{i}].method.parameters"
                given = stage.method.given(self.stimuli)
                for name in rule.moved(given):
                    self._require_level_moves(f"{place}.followed", name)
                try:
                    rule.require_meaning(given, self.stimuli)
                except BadValue as error:
                    raise BadValue(f"{place}.{error}") from None

    def _require_level_moves(self, place: str, name: str) -> None:
        """Raise `BadValue` for a stimulus of which every level would be presented alike."""
        stimulus = self.stimuli[name]
        can_move = bool(stimulus.scaled_by) and stimulus.level_m_s2 > 0.0
        require(can_move, place, name, "stimuli with a level above 0, and with scaled_by, which the level moves")

    # --- files ---

    def dumps(self) -> bytes:
        """Return the protocol as JSON with a fixed order of fields; fields with default values are omitted."""
        fields = _without_defaults(self)
        return (
            msgspec.json.format(msgspec.json.encode({"format": FORMAT, "version": VERSION, **fields}), indent=1) + b"\n"
        )

    @staticmethod
    def loads(
        text: bytes | str, source: str = "protocol", folder: Path | None = None, *, of_session: bool = False
    ) -> "Protocol":
        """Return the protocol in `text`; that `of_session` was measured, and is read also if its answers say little.

        Raises `BadFile` with `source`, the place of the mistake, the value and what is allowed.
        """
        raw = parse(text, source, FORMAT, VERSION)
        with refusals(source, raw):
            _check_types_of_stimuli(raw, source)
            found = msgspec.convert(raw, Protocol).check(folder)
            if not of_session:
                found._require_meaning()
            return found

    @staticmethod
    def unchecked(text: bytes | str, source: str) -> "Protocol":
        """Parse a protocol but check only its form: stimuli and stages may be any."""
        raw = parse(text, source, FORMAT, VERSION)
        with refusals(source, raw):
            return msgspec.convert(raw, Protocol)

    @staticmethod
    def load(path: str | Path) -> "Protocol":
        """Return the protocol in a file; its patches are presets, or files beside it."""
        return Protocol.loads(read_file(path), str(path), Path(path).parent)

    def save(self, path: str | Path) -> None:
        """Write the protocol beside `path` and move it into place."""
        write_file(path, self.dumps())


def node_files_of(path: Path) -> list[NodeFile]:
    """Return the files of custom nodes that the patches of a protocol need and that are not allowed to run yet."""
    stimuli = parse(read_file(path), str(path), FORMAT, VERSION).get("stimuli")
    found: dict[str, NodeFile] = {}
    for stimulus in stimuli.values() if isinstance(stimuli, dict) else ():
        name = stimulus.get("patch") if isinstance(stimulus, dict) else None
        if isinstance(name, str) and name and has_nodes((patch := patch_path(name, path.parent)).parent):
            used = Patch.unchecked(read_file(patch), str(patch)).types.values()
            found |= {file.path: file for file in files_needed(used, patch.parent)}
    return list(found.values())


def _check_types_of_stimuli(raw: Mapping[str, Any], source: str) -> None:
    """Raise `BadFile` for a stimulus with fields of wrong types, with its name, which the library's error lacks."""
    stimuli = raw.get("stimuli")
    for name, stimulus in stimuli.items() if isinstance(stimuli, dict) else ():
        try:
            msgspec.convert(stimulus, Stimulus)
        except msgspec.ValidationError as error:
            raise BadFile(f"{source}: $.stimuli.{name}{placed(error, stimulus).removeprefix('$')}") from None


def _pilot(stage: Stage) -> Stage:
    match stage.kind:
        case "trials":
            return msgspec.structs.replace(stage, most_trials=_PILOT_TRIALS)
        case "pause":
            return msgspec.structs.replace(stage, seconds=min(stage.seconds, _PILOT_PAUSE_S))
        case _:
            return stage


def _check_questions(place: str, questions: tuple[Question, ...]) -> None:
    seen: set[str] = set()
    for i, question in enumerate(questions):
        question.check(f"{place}[{i}]")
        require(question.name not in seen, f"{place}[{i}].name", question.name, "a name that no other question has")
        seen.add(question.name)


def _without_defaults(document: msgspec.Struct) -> dict[str, Any]:
    """Return the fields whose values differ from their defaults, nested structs included."""
    found: dict[str, Any] = {}
    for field in msgspec.structs.fields(document):
        value = getattr(document, field.name)
        default = {} if field.default_factory is dict else field.default
        if field.name not in ("format", "version") and (field.required or value != default):
            found[field.name] = _without_empty(value)
    return found


def _without_empty(value: object) -> object:
    if isinstance(value, msgspec.Struct):
        return _without_defaults(value)
    if isinstance(value, Mapping):
        return {key: _without_empty(item) for key, item in value.items()}
    return [_without_empty(item) for item in value] if isinstance(value, tuple | list) else value
