"""Runs a study with a participant, without a window: presents stimuli, takes answers, and stores them at once.

A `Runner` is always in one `Phase`. The window or terminal calls `poll` about 60 times a second, displays `page`,
`phase` and `hint`, and passes keys and answers to it. The runner never blocks. It stores a trial's answer, times, force
and vibration before it begins the next trial.
"""

import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from underfoot.arguments import choice
from underfoot.engine.commands import Level
from underfoot.engine.reports import Notice, ProcessDied, Report
from underfoot.engine.session import Session
from underfoot.engine.session_memory import ForceReader
from underfoot.errors import BadFile, BadValue, require
from underfoot.experiments.languages import language_of
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES, Adjusted
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import AGREED, CALIBRATIONS, Entry, Page, Study
from underfoot.experiments.trials import Answers, Presentation
from underfoot.floor.profile_parts import PARTS, lines_of
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.apparatus import Apparatus
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.foot_answers import FootAnswers, require_fields
from underfoot.studies.markers import ANSWER, STOP, place_of
from underfoot.studies.measuring import TrialRecord
from underfoot.studies.page_run import (
    Answered,
    Interrupted,
    Learning,
    LevelRun,
    PageRun,
    Preparation,
    Prepared,
    Stopped,
)
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE, PRESENTED_S, WAITED_S, Presenter
from underfoot.studies.set_up import set_up_of
from underfoot.studies.stimulus_patches import StimulusPatches
from underfoot.studies.target import SELECTED_S, FloorTarget, require_on_floor
from underfoot.studies.trial_run import TrialRun


class Runner:
    """A running study: a live session, the session file, and the study. `close` restores the session."""

    def __init__(
        self,
        session: Session,
        file: SessionFile,
        protocol: Protocol,
        folder: Path | None = None,
        equipment: Equipment | None = None,
    ) -> None:
        """Begin or continue the study at the state of the file; `folder` contains the protocol's patches."""
        require_on_floor(protocol, session.target.floor)
        require_fields(protocol, session.target.floor)
        self._equipment = equipment or Equipment()
        lacking = self._equipment.lacks(protocol)
        file.hold()
        self.session, self.file, self.protocol = session, file, protocol
        self.study: Study = file.study(protocol)
        self.language = language_of(protocol.language, folder)
        """What the participant reads of the program's words is in it."""
        target = session.target
        self.presenter = Presenter(session, is_felt=any(one.patch for one in protocol.stimuli.values()))
        self.watch = FloorWatch(
            ForceReader(session.memory.force), target.floor, float(target.rate), session.force_rate_hz
        )
        self._stimuli = StimulusPatches(protocol, folder)
        self._apparatus = Apparatus(
            session, protocol, self._stimuli, self._equipment, self.presenter, self.watch, file.begin_packing
        )
        self.messages: list[str] = [lacking] if lacking else []
        """Messages for the experimenter, newest last."""
        self._before = (session.patch, session.level_db, session.playing)
        self._run: PageRun = Preparation(self._apparatus)
        self._selected: tuple[FloorTarget | None, float] = (None, 0.0)
        self._equipment_problem = ""  # the last one that was told
        if self.study.was_interrupted and self.page.trial is not None:
            number = f"trial {self.page.trial.number} of {self.page.stage}"
            self.messages.append(f"{number} was felt and not answered when the session ended; it comes again")
        file.set_up(set_up_of(target))
        self._note_calibrations()
        if lacking:
            self.note(lacking)
        session.stop()  # silence while patches are compiled

    # --- display ---

    @property
    def page(self) -> Page:
        """The current page of the study."""
        return self.study.page

    @property
    def phase(self) -> Phase:
        """The phase of the current page."""
        return self._run.phase

    @property
    def hint(self) -> str:
        """An instruction for the participant, in one sentence, in English; of a stop, why."""
        return self._run.hint

    @property
    def interval(self) -> int:
        """The current interval of the trial, from 1."""
        return self._run.interval + 1

    @property
    def plays(self) -> int:
        """The number of presentations of the trial so far."""
        return self._run.record.plays

    @property
    def began_s(self) -> float:
        """Session seconds at which the last presentation of this page began; NaN before the first."""
        return self._run.record.first_s

    @property
    def seconds_left(self) -> float:
        """The remaining seconds of a pause or wait; 0 without a countdown."""
        return self._run.seconds_left

    @property
    def is_prepared(self) -> bool:
        """Whether all stimuli have been prepared; before, nothing can be felt."""
        return self._run.is_prepared

    @property
    def may_play(self) -> bool:
        """Whether a key can start a presentation, for the first time or again."""
        return self._run.can_be_started

    @property
    def adjusting(self) -> Adjusting | None:
        """What is moved now while it is felt; None where nothing is, or if it is stopped."""
        return self._run.adjusting

    @property
    def foot(self) -> FootAnswers | None:
        """The fields on the floor for the current question; None without an answer by foot, or if it is stopped."""
        return self._run.foot

    @property
    def target(self) -> FloorTarget | None:
        """The button on the floor that can be pressed now; None if there is none."""
        return self._run.target

    @property
    def selected(self) -> FloorTarget | None:
        """The button that was just pressed in time, and is highlighted; None if there is none."""
        target, until = self._selected
        return target if self.phase is Phase.WAITING and time.perf_counter() < until else None

    # --- actions ---

    def poll(self, reports: Iterable[Report]) -> None:
        """Advance the study, with the session's reports since the last call."""
        several = list(reports)
        self.presenter.take(several)
        self.presenter.read(PRESENTED_S if self.phase is Phase.PRESENTING else WAITED_S)
        force_n = self.watch.read()
        self._equipment.forces(self.watch.now_s, self.session.played_s - self.watch.now_s, force_n)
        for report in several:
            if isinstance(report, ProcessDied) and report.process == "engine":
                self._lost(f"the engine was lost: {report.reason}")
            elif isinstance(report, Notice):
                self.messages.append(report.text)
        if self._equipment.problem != self._equipment_problem:
            self._equipment_problem = self._equipment.problem
            self.messages.append(self._equipment_problem or "markers are sent again")
        if self.presenter.problem:
            self.messages.append(self.presenter.problem)
            self.stop("a stimulus cannot be played")
            self.presenter.problem = ""  # which silence, too, has while the card is away
        match self._run.poll():
            case Prepared():
                self._open_page()
            case Interrupted(reason):
                self.stop(reason)
            case Answered(values):
                self._take_answer(values)
        self._keep_felt()

    def start(self) -> None:
        """Start or repeat a presentation, after a key press; raise `BadValue` if that is not allowed now."""
        require(self.may_play, "phase", str(self.phase), "ready for a key")
        self._run.start()

    def play(self, stimulus: str) -> None:
        """Play a stimulus in learning; raise `BadValue` on any other page."""
        if self._run.tried is None:
            raise BadValue(f"page is {self.page.kind!r}; allowed: one of learning, or of the level")
        choice("stimulus", stimulus, self.protocol.stimuli)
        self._run.tried.begin(self._stimuli.presented(Presentation(stimulus), self.study.gain_db))

    def adjust(self, way: int, *, is_fine: bool) -> None:
        """Move what is adjusted by a step up (`way` 1) or down (-1); raise `BadValue` where nothing is."""
        adjusting = self.adjusting
        if adjusting is None:
            raise BadValue(f"page is {self.page.kind}; allowed: one on which something is moved while it is felt")
        adjusting.move(way, is_fine=is_fine)

    def answer(self, values: Answers) -> None:
        """Answer the page, and store the answer; raise `BadValue` if it is invalid or too early.

        Where something is moved while it is felt, the answer is what it has been moved to.
        A participant who does not consent stops the study; a note stores the time.
        """
        allowed = self.phase in (Phase.PAGE, Phase.ANSWERING)
        require(allowed, "phase", str(self.phase), "a page to answer, or the end of a presentation")
        if self.page.kind == "consent" and values.get(AGREED) == NO:
            self.stop("the participant does not agree to take part")
        else:
            self._take_answer(values if self.adjusting is None else self.adjusting.answers)

    def end_pause(self) -> None:
        """End a pause early; the remaining seconds are stored."""
        require(self.phase is Phase.PAUSE, "phase", str(self.phase), "a pause")
        self._keep({}, {"left_s": round(self.seconds_left, 1)})

    def spoil(self, reason: str) -> None:
        """Spoil the current trial for a reason, and present it again, also after a stop; it was presented before."""
        self._require_prepared()
        require(self.plays > 0, "plays", self.plays, "1 or more: nothing of this trial was presented yet")
        self._store(self.study.spoil(reason, self._run.record.facts))
        self._present_anew()

    def repeat_last(self, reason: str) -> None:
        """Spoil the last answer for a reason, which is noted, and open its page again, also after a stop."""
        self._require_prepared()
        before = self.study.without_last(reason)
        if self.file.has_felt:
            self.note(f"{self.page.key} was felt, and comes after the one that is repeated")
            self.file.forget_felt()
        self.file.replace_last(before.entries[-1])
        self.study = before
        self._present_anew()

    def note(self, text: str) -> None:
        """Store a note of the experimenter."""
        self.file.add_note(text)

    def stop(self, reason: str) -> None:
        """Silence the output at once; a current trial begins again on `go_on`."""
        if self.phase in (Phase.STOPPED, Phase.END):
            return
        self.session.panic()
        self.presenter.request(IDLE)  # until the study goes on, when what was felt is not to sound once more
        self._run = Stopped(self._run, reason)
        self._apparatus.mark(STOP, self.page)
        self.note(f"stopped: {reason}")

    def go_on(self) -> None:
        """Continue at the current page after a stop; what was felt of it is kept as a spoiled attempt."""
        stopped = self._run
        if not isinstance(stopped, Stopped):
            raise BadValue(f"phase is {str(self.phase)!r}; allowed: stopped")
        self.file.write_waiting()
        if not stopped.is_prepared:
            self.note("went on")
            self._run = Preparation(self._apparatus)
            self.session.panic()
        elif self.file.has_felt:
            self.spoil(stopped.reason)
        else:
            self._present_anew()

    def close(self) -> None:
        """Restore the session, and close the file."""
        patch, level_db, playing = self._before
        self.session.edit(patch)
        self.session.send(Level(level_db))
        (self.session.play if playing else self.session.stop)()
        self.close_file()

    def close_file(self) -> None:
        """Close the file and all equipment; leave the session unchanged.

        Who stops at a word of thanks, which may ask to tell the experimenter, has done the study: it counts as read.
        """
        self._equipment.close()
        try:
            self.file.write_waiting()
            while self.study.entries and self.study.has_all_answers and not self.study.is_done:
                self.file.add(self.study.answer({}))
        finally:
            self.file.close()

    # --- pages ---

    def _note_calibrations(self) -> None:
        """Note which calibrations are in use, with day and digest, where that has changed since the last time."""
        noted = [note.text for note in self.file.notes() if note.text.startswith(CALIBRATIONS)]
        lines, plate = lines_of(self.session.calibrations), self._equipment.plate
        if plate is not None and plate.calibration.made:
            lines.append(f"plate: {PARTS['plate']} {plate.calibration.identity}")
        used = CALIBRATIONS + ("; ".join(lines) or "none")
        if used != (noted[-1] if noted else f"{CALIBRATIONS}none"):
            self.note(used)

    def _require_prepared(self) -> None:
        require(self.is_prepared, "phase", str(Phase.PREPARING), "what follows the preparation")

    def _present_anew(self) -> None:
        """Open the current page; after a stop, which is silent, with what is to be felt."""
        if self.phase is Phase.STOPPED:
            self.note("went on")
            self.presenter.begin()
        self._open_page()

    def _open_page(self) -> None:
        """Begin the current page."""
        self.presenter.request(IDLE)
        self._run = PageRun(Phase.WAITING)  # in which nothing is answered, if the page cannot be opened
        self._run = self._made_run(self.study.page)

    def _made_run(self, page: Page) -> PageRun:
        question = next(iter(page.questions), None)
        if page.trial is not None:
            last = self.study.entries[-1] if self.study.entries else None
            behind = self.protocol.stage(last.stage) if last is not None and last.trial is not None else None
            pause_s = 0.0 if behind is None else behind.pause_s(self.protocol.stimuli)
            return TrialRun(self._apparatus, page, self.study.gain_db, pause_s)
        if isinstance(question, Adjusted):
            return LevelRun(self._apparatus, page, question)
        match page.kind:
            case "learn":
                return Learning(self._apparatus, page)
            case "pause":
                return PageRun(Phase.PAUSE, page.seconds)
            case "end":
                return PageRun(Phase.END)
        return PageRun(Phase.PAGE)

    # --- storing ---

    def _take_answer(self, values: Answers) -> None:
        """Store an answer with the facts of what was felt; a button that was pressed in time is highlighted."""
        target = self.target
        self._keep(values, self._run.conclude())
        if target is not None and values["selected"] == YES:
            self._selected = (target, time.perf_counter() + SELECTED_S)

    def _keep(self, values: Answers, facts: Mapping[str, Any]) -> None:
        """Take an answer and store it with its excerpts; only then open the next page."""
        entry = self.study.answer(values, {"started_at": self._run.record.started_at, **facts})
        self._store(entry)
        self._equipment.mark(ANSWER, place_of(entry))
        self._open_page()

    def _keep_felt(self) -> None:
        """Store that a trial is felt, before it is answered: when it begins to vibrate, and when it has ended.

        Else nobody would know of it, if the program were killed.
        """
        record, has_ended = self._run.record, self.phase is Phase.ANSWERING
        state = record.plays, has_ended
        if state != record.kept and (has_ended or (self.phase is Phase.PRESENTING and "onset_s" in record.facts)):
            record.kept = state
            facts = {"started_at": record.started_at, "plays": record.plays, **record.facts}
            self.file.keep_felt(self.study.unanswered(facts))

    def _store(self, entry: Entry) -> None:
        """Write an entry with what was measured; if the disk refuses it, keep both in memory and stop the study."""
        record, self._run.record = self._run.record, TrialRecord()  # the page that follows has not been felt
        try:
            self.file.add(entry, record.excerpts)
        except BadFile:
            with suppress(BadFile):
                self.stop("the answer cannot be written, and is kept until you go on")
            raise

    def _lost(self, why: str) -> None:
        """Spoil a presentation during which the engine stopped."""
        self.messages.append(why)
        is_felt = self.phase in (Phase.PRESENTING, Phase.READY, Phase.WAITING) or self.adjusting is not None
        if self.page.trial is not None and is_felt:
            if self.phase is Phase.PRESENTING or self.file.has_felt:
                self.spoil(why)
            else:
                self._open_page()
