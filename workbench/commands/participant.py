"""A study on a person in the terminal: pages are printed, answers typed, presentations begun by Enter or by foot."""

import re
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from underfoot.commands.files import require_outputs_writable
from underfoot.commands.typed_lines import TypedLines
from underfoot.devices.sound import require_card
from underfoot.errors import BadFile, BadValue, require
from underfoot.experiments.questions import Adjusted, asked, typed_answer
from underfoot.files import make_folder, remove_file
from underfoot.parameters import IDENTIFIER, Parameter
from underfoot.phrases import ENGLISH, Language, Phrase

if TYPE_CHECKING:
    from underfoot.commands.experiment_options import ExperimentOptions
    from underfoot.engine.session import Session
    from underfoot.experiments.protocol import Protocol
    from underfoot.experiments.store import SessionFile
    from underfoot.experiments.study import Page
    from underfoot.studies.equipment import Equipment
    from underfoot.studies.runner import Runner

_POLL_S = 1.0 / 60.0
_ENTER_STEPS = "Enter steps on the simulated floor."
_STEPS = {"+": (1, True), "-": (-1, True), "++": (1, False), "--": (-1, False)}
"""Way of a typed step, and whether it is a small one."""
_OTHER = "o"
"""What is typed to feel the standard, or what is moved after it."""
_HELP = "Type stop to stop, repeat WHY to take the last answer back, note WORDS to keep a note."


def run_pilot(options: "ExperimentOptions", protocol: "Protocol", folder: Path) -> None:
    """Run two trials of each stage as a pilot; without --session, in a new numbered file of a separate folder."""
    kept = Path(f"{Path(options.protocol).stem}-pilot")
    path = options.session or next(p for k in count(1) if not (p := kept / f"{k}.session").exists())
    if options.session is None:
        make_folder(kept)
    person = pilot_id(path.stem, follows_number=protocol.follows_number)
    run_on_person(replace(options, participant=person, session=path), protocol.pilot(), folder)
    _say(f"The pilot is kept in {path}, apart from the participants' sessions.")


def pilot_id(stem: str, *, follows_number: bool) -> str:
    """Return the id of a pilot in a file of this name; where orders follow the number in it, with one.

    >>> pilot_id("my try", follows_number=False), pilot_id("try", follows_number=True)
    ('my-try', 'try-1')
    """
    id = re.sub(f"(?!{IDENTIFIER.pattern}).", "-", stem)
    return f"{id}-1" if follows_number and not re.search(r"\d", id) else id


def run_on_person(options: "ExperimentOptions", protocol: "Protocol", folder: Path) -> None:
    """Run or go on with a study, whose patches lie in `folder`."""
    if options.session is None:
        raise BadValue("--participant needs --session FILE, where answers are kept")
    _run(options, lambda: _session_file(options, protocol, folder), folder)


def go_on_as_begun(options: "ExperimentOptions") -> None:
    """Continue the session file that is named in place of a protocol, with the protocol stored in it."""
    from underfoot.experiments.store import SessionFile

    path = Path(options.protocol)
    _run(options, lambda: SessionFile.open(path))


def _run(options: "ExperimentOptions", open_file: "Callable[[], SessionFile]", beside: Path | None = None) -> None:
    """Run or go on with a session; ends with it, at "stop", at a signal, or where standard input ends."""
    from underfoot.engine.card_process import CardProcess
    from underfoot.engine.session import Session
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch
    from underfoot.studies.runner import Runner

    target = options.session_target(walker=False)
    if target.sound is not None:
        CardProcess(require_card, target.sound).close()  # a session would go on without what is to be felt
    is_new = options.session is not None and not options.session.exists()
    with ExitStack() as opened:
        unless_begun = opened.enter_context(ExitStack())
        file = open_file()
        if is_new:
            unless_begun.callback(remove_file, file.path)  # an empty one would seem to have been begun
        unless_begun.callback(file.close)
        file.hold()  # before equipment is opened, which another window may use with this session
        beside = beside or file.folder
        protocol, folder = file.as_begun(beside)
        session = Session(target, Patch(title="study"), REGISTRY, beside)
        opened.callback(session.close)
        equipment = _equipment(options, protocol, session)
        unless_begun.callback(equipment.close)
        session.start()
        runner = Runner(session, file, protocol, folder, equipment)
        unless_begun.pop_all()
        opened.callback(runner.close_file)
        _Terminal(runner, opened.enter_context(TypedLines())).run()


def _equipment(options: "ExperimentOptions", protocol: "Protocol", session: "Session") -> "Equipment":
    """Return the equipment that the options choose."""
    from underfoot.engine.target import sound_device
    from underfoot.studies.equipment import EquipmentChoice

    choice = EquipmentChoice(options.plate or "", sound_device(options.masking), options.trigger or "", options.lsl)
    return choice.opened(protocol.sounds, session.target.floor, session.force_rate_hz)


def _session_file(options: "ExperimentOptions", protocol: "Protocol", folder: Path) -> "SessionFile":
    from underfoot.experiments.store import SessionFile

    path, person = Path(options.session or ""), options.participant or ""
    if not path.exists():
        require_outputs_writable(path)
        alike = next((p.name for p in _beside(path) if p.name.casefold() == path.name.casefold()), "")
        if alike:  # some file systems would take one for the other
            raise BadValue(f"{path} differs from {alike} in letter case only; go on with that, or choose another name")
        return SessionFile.create(path, protocol, person, folder)
    file = SessionFile.open(path)
    if file.participant != person:
        kept = file.participant
        file.close()
        raise BadValue(f"{path} is of participant {kept}, not {person}; choose another --session")
    if not file.is_of(protocol, folder):
        file.close()
        raise file.begun_otherwise()
    return file


def _beside(path: Path) -> list[Path]:
    """Return the files in the folder of a new file."""
    return list(path.parent.iterdir()) if path.parent.is_dir() else []


@dataclass
class _Shown:
    """The last lines printed, so that none is printed twice."""

    key: str = ""
    hint: str = ""
    is_empty: bool = False
    """That nobody stands on the floor, until somebody does."""


class _Terminal:
    """Displays a runner in a terminal, and passes typed answers to it."""

    def __init__(self, runner: "Runner", lines: TypedLines) -> None:
        from underfoot.studies.simulated_foot import SimulatedFoot

        self._words = runner.language.say
        self._runner, self._lines, self._foot = runner, lines, SimulatedFoot()
        self._shown = _Shown()
        self._printed_messages = 0
        self._disk_refused = False

    def run(self) -> None:
        from underfoot.studies.page_words import text_of
        from underfoot.studies.phase import Phase

        _say(_HELP)
        while self._runner.phase is not Phase.END:
            try:
                self._runner.poll(self._runner.session.poll())  # which stores pauses that end, and answers by foot
            except BadFile as error:
                self._say_refused(error)
            self._foot.tick(self._runner)
            self._show()
            line = self._lines.next()
            if line is None:
                if self._lines.ended:
                    _say("Stopped: nothing more is typed. Start again to go on.")
                    return
                time.sleep(_POLL_S)
                continue
            try:
                self._take(line.strip())
            except BadValue as error:
                _say(self._words(*error.args))
                self._shown.key = ""
            except BadFile as error:
                self._say_refused(error)
            if self._runner.phase is Phase.STOPPED and not self._disk_refused:
                _say(f"{self._runner.hint} Start again to go on; what was answered is kept.")
                return
        _say(_sentences(text_of(self._runner), self._words(self._runner.page.title)))

    def _say_refused(self, error: BadFile) -> None:
        """Say that an answer is not written, and kept, or a note, which is not: the disk is full, or the file moved."""
        from underfoot.studies.phase import Phase

        self._disk_refused = self._runner.phase is Phase.STOPPED
        if not self._disk_refused:
            _say(f"{error}. Type it again when it can be written.")
            self._shown.key = ""
            return
        _say(f"{error}. When it can be written, press Enter, which does that first; type stop to stop without it.")

    def _take(self, line: str) -> None:
        from underfoot.studies.page_words import questions_of
        from underfoot.studies.phase import Phase
        from underfoot.studies.simulated_foot import may_step

        runner = self._runner
        word, _, rest = line.partition(" ")
        if self._disk_refused:
            if line != "stop":
                runner.go_on()
            self._disk_refused = False
        elif line == "stop":
            runner.stop("by the participant")
        elif word == "note":
            require(bool(rest.strip()), "note", rest, "words, as in: note shoes changed")
            runner.note(rest)
            _say(f"Noted: {rest}")
            self._shown.key = ""  # what is asked is asked still
        elif word == "repeat":
            runner.repeat_last(rest)
        elif runner.phase is Phase.PAUSE and word == "skip":
            runner.end_pause()
        elif runner.page.kind == "learn" and line:
            number = answers_of(questions_of(runner), line, runner.language)["number"]
            runner.play(runner.study.learnable[number - 1])
        elif runner.adjusting is not None and line:
            self._adjust(line)
        elif runner.adjusting is not None:
            runner.answer({})
        elif line == "" and runner.may_play:
            runner.start()
        elif line == "" and may_step(runner):
            self._foot.step(runner)
        elif runner.phase in (Phase.PAGE, Phase.ANSWERING):
            runner.answer(answers_of(runner.page.questions, line, runner.language))

    def _adjust(self, line: str) -> None:
        """Move what is adjusted as a line says."""
        from underfoot.studies.page_words import title_of
        from underfoot.studies.simulated_foot import may_step

        if line in _STEPS:
            way, is_fine = _STEPS[line]
            self._runner.adjust(way, is_fine=is_fine)
        elif line == _OTHER and self._runner.may_play:
            self._runner.start()
        else:
            words = "{given} is no step; allowed: {steps}, or Enter to keep it"
            raise BadValue(Phrase(words, given=repr(line), steps=(*_STEPS, _OTHER)))
        if may_step(self._runner):
            self._foot.step(self._runner)
        _say(_sentences(title_of(self._runner), self._words("Enter keeps it.")))

    def _show(self) -> None:
        from underfoot.studies.empty_floor import empty_floor_text
        from underfoot.studies.page_words import hint_of, text_of, title_of
        from underfoot.studies.phase import Phase

        runner, page = self._runner, self._runner.page
        empty = empty_floor_text(runner)
        if empty and not self._shown.is_empty:
            _say(empty)
        self._shown.is_empty = not runner.watch.is_loaded and (self._shown.is_empty or bool(empty))
        for text in runner.messages[self._printed_messages :]:
            _say(text)
        self._printed_messages = len(runner.messages)
        key = f"{page.key} {runner.phase} {runner.interval}"
        if key != self._shown.key:
            self._shown.key = key
            if runner.phase is Phase.PAGE and page.kind != "end":
                _say("\n" + _sentences(self._words(page.title), text_of(runner)))
                self._ask(page)
            elif runner.phase is Phase.PAUSE:
                pause = Phrase("Pause of {seconds} s; {skip} ends it.", seconds=round(page.seconds), skip="skip")
                _say(_sentences(text_of(runner), self._words(pause)))
            elif runner.phase is Phase.READY:
                _say(_sentences(text_of(runner), title_of(runner), self._words(_trial(page))))
            elif runner.phase is Phase.ANSWERING:
                self._ask(page)
        hint = hint_of(runner, _ENTER_STEPS)
        if hint != self._shown.hint:
            self._shown.hint = hint
            if hint:
                _say(hint)

    def _ask(self, page: "Page") -> None:
        if page.kind == "learn":
            _say(self._words("Type a number to feel it; it ends by itself."))
            return
        for question in page.questions:
            words = self._words(asked(question))
            if isinstance(question, Adjusted):
                moves = self._words("Type + and - for small steps, ++ and -- for large ones; Enter keeps it.")
                other = self._words(Phrase("Type {key} to feel the other one.", key=_OTHER))
                _say(_sentences(words, moves, other if page.trial and len(page.trial.intervals) > 1 else ""))
            else:
                _say(f"{words} ({self._words(question.allowed)})" if question.kind != "text" else words)
        if not page.questions:
            _say(self._words("Press Enter to go on."))


def answers_of(questions: Sequence[Parameter], line: str, language: Language = ENGLISH) -> dict[str, Any]:
    """Return the answers in a line, separated by semicolons, one per question; an empty one is omitted.

    >>> from underfoot.experiments.questions import yes_or_no
    >>> answers_of((yes_or_no("felt", "Did you?"),), "y")
    {'felt': 'yes'}
    """
    parts = [part.strip() for part in line.split(";")] if len(questions) > 1 else [line.strip()]
    if len(parts) > max(len(questions), 1):
        raise BadValue(f"{len(parts)} answers are given; allowed: {len(questions)}, separated by semicolons")
    return {one.name: typed_answer(one, part, language) for one, part in zip(questions, parts, strict=False) if part}


def _sentences(*words: str) -> str:
    """Return texts in one line, each with a stop at its end.

    >>> _sentences("It was 7.", "", "Which one is it?", "Trial 2")
    'It was 7. Which one is it? Trial 2.'
    """
    return " ".join(text if text[-1] in ".!?:" else f"{text}." for text in words if text)


def _trial(page: "Page") -> Phrase:
    """Return which trial it is, and what begins it."""
    assert page.trial is not None
    trial = Phrase("Trial {number} again" if page.attempt > 1 else "Trial {number}", number=page.trial.number)
    return Phrase("{trial}: press Enter to begin.", trial=trial) if page.start == "key" else trial


def _say(text: str) -> None:
    print(text, file=sys.stdout, flush=True)
