"""Runs a study with a participant, without a window: presents stimuli, takes answers, and stores them at once.

A `Runner` is always in one `Phase`. The window or terminal calls `poll` about 60 times a second, displays `page`,
`phase` and `hint`, and passes keys and answers to it. The runner never blocks. It stores a trial's answer, times, force
and vibration before it begins the next trial.
"""

import math
import time
from collections.abc import Callable, Iterable, Mapping
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
from underfoot.experiments.store import SessionFile, time_of_day
from underfoot.experiments.study import AGREED, CALIBRATIONS, Entry, Page, Study
from underfoot.experiments.trials import Answers, Presentation
from underfoot.floor.profile_parts import PARTS, lines_of
from underfoot.patch.patch import Patch
from underfoot.phrases import Phrase
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.apparatus import Apparatus, TimedStimulus
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.foot_answers import FootAnswers, require_fields
from underfoot.studies.markers import ANSWER, STOP, place_of
from underfoot.studies.measuring import TrialRecord
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE, PRESENTED_S, WAITED_S, Presenter
from underfoot.studies.stimulus_patches import StimulusPatches
from underfoot.studies.target import SELECTED_S, FloorTarget, require_on_floor
from underfoot.studies.trial_run import Answered, Interrupted, TrialRun


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
        self._unprepared = self._all_patches()
        self._phase, self._hint = Phase.PREPARING, ""  # while no trial runs
        self._trial: TrialRun | None = None
        self._record = TrialRecord()
        self._stimulus = TimedStimulus(self._apparatus)  # in learning, and for the level
        self._adjusting: Adjusting | None = None  # on the page of the level
        self._page_due = 0.0
        self._selected: tuple[FloorTarget | None, float] = (None, 0.0)
        self._equipment_problem = ""  # the last one that was told
        self._why_stopped = ""
        self._kept_felt = (0, False)
        if self.study.was_interrupted and self.page.trial is not None:
            number = f"trial {self.page.trial.number} of {self.page.stage}"
            self.messages.append(f"{number} was felt and not answered when the session ended; it comes again")
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
        if self._why_stopped:
            return Phase.STOPPED
        return self._phase if self._trial is None else self._trial.phase

    @property
    def hint(self) -> str:
        """An instruction for the participant, in one sentence, in English; of a stop, why."""
        return self._hint if self._trial is None or self._why_stopped else self._trial.hint

    @property
    def interval(self) -> int:
        """The current interval of the trial, from 1."""
        return 1 if self._trial is None else self._trial.interval + 1

    @property
    def plays(self) -> int:
        """The number of presentations of the trial so far."""
        return self._record.plays

    @property
    def began_s(self) -> float:
        """Session seconds at which the last presentation of this page began; NaN before the first."""
        return self._record.first_s

    @property
    def seconds_left(self) -> float:
        """The remaining seconds of a pause or wait; 0 without a countdown."""
        if self.phase is Phase.WAITING and self._trial is not None:
            return max(self._trial.due - time.perf_counter(), 0.0)
        counted = self.phase is Phase.PAUSE or self.page.kind == "learn"
        return max(self._page_due - time.perf_counter(), 0.0) if counted else 0.0

    @property
    def is_prepared(self) -> bool:
        """Whether all stimuli have been prepared; before, nothing can be felt."""
        return self._phase is not Phase.PREPARING

    @property
    def may_play(self) -> bool:
        """Whether a key can start a presentation, for the first time or again."""
        return self._trial is not None and not self._why_stopped and self._trial.can_be_started

    @property
    def adjusting(self) -> Adjusting | None:
        """What is moved now while it is felt; None where nothing is, or if it is stopped."""
        if self._why_stopped:
            return None
        return self._adjusting if self._trial is None else self._trial.adjusting

    @property
    def foot(self) -> FootAnswers | None:
        """The fields on the floor for the current question; None without an answer by foot, or if it is stopped."""
        return self._trial.foot if self._trial is not None and not self._why_stopped else None

    @property
    def target(self) -> FloorTarget | None:
        """The button on the floor that can be pressed now; None if there is none."""
        return self._trial.target if self._trial is not None and self.phase is Phase.PRESENTING else None

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
        if self.phase in _STEPS:
            _STEPS[self.phase](self)
        elif self._trial is not None and not self._why_stopped:
            self._poll_trial(self._trial)
        self._keep_felt()

    def start(self) -> None:
        """Start or repeat a presentation, after a key press; raise `BadValue` if that is not allowed now."""
        require(self.may_play, "phase", str(self.phase), "ready for a key")
        assert self._trial is not None
        self._trial.start()

    def play(self, stimulus: str) -> None:
        """Play a stimulus in learning; raise `BadValue` on any other page."""
        kind = self.page.kind
        require(
            self.phase is Phase.PAGE and kind in ("learn", "level"), "page", kind, "one of learning, or of the level"
        )
        choice("stimulus", stimulus, self.protocol.stimuli)
        self._stimulus.begin(self._stimuli.presented(Presentation(stimulus), self.study.gain_db))

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
            self._take_answer(values if self.adjusting is None else self.adjusting.answers, {})

    def end_pause(self) -> None:
        """End a pause early; the remaining seconds are stored."""
        require(self.phase is Phase.PAUSE, "phase", str(self.phase), "a pause")
        self._keep({}, {"left_s": round(self.seconds_left, 1)})

    def spoil(self, reason: str) -> None:
        """Spoil the current trial for a reason, and present it again, also after a stop; it was presented before."""
        self._require_prepared()
        require(self.plays > 0, "plays", self.plays, "1 or more: nothing of this trial was presented yet")
        self._store(self.study.spoil(reason, self._record.facts))
        self._present_anew()

    def repeat_last(self, reason: str) -> None:
        """Spoil the last answer for a reason, and present its trial again, also after a stop."""
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
        colon = "" if reason.startswith("by ") else ":"
        self._why_stopped, self._hint = f"stopped{colon} {reason}", f"Stopped{colon} {reason}."
        self._apparatus.mark(STOP, self.page)
        self.note(f"stopped: {reason}")

    def go_on(self) -> None:
        """Continue at the current page after a stop; what was felt of it is kept as a spoiled attempt."""
        require(self.phase is Phase.STOPPED, "phase", str(self.phase), "stopped")
        self.file.write_waiting()
        if self._phase is Phase.PREPARING:
            self.note("went on")
            self._unprepared = self._all_patches()
            self.session.panic()
            self._why_stopped = ""
        elif self.file.has_felt:
            self.spoil(self._why_stopped)
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

    # --- phases ---

    def _prepare(self) -> None:
        """Play each patch once in silence, so that all are compiled; sound begins once nothing but `IDLE` plays."""
        if not self.session.health.running or self.presenter.since_frame is None:
            return
        if self._unprepared:
            self._hint = Phrase("Preparing: {count} left", count=len(self._unprepared))
            self.presenter.request(self._unprepared.pop())
            return
        if not self.presenter.has_settled():
            return  # the patch that was open fades out
        self.presenter.begin()
        if self._equipment.masking is not None:
            self._equipment.masking.start()
        self._open_page()

    def _all_patches(self) -> list[Patch]:
        """Return what is played in silence before the first page, the last one first."""
        return [IDLE, *self._stimuli.kinds()]

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
        require(self.is_prepared, "phase", str(self._phase), "what follows the preparation")

    def _present_anew(self) -> None:
        """Open the current page; after a stop, which is silent, with what is to be felt."""
        if self._why_stopped:
            self.note("went on")
            self.presenter.begin()
        self._open_page()

    def _open_page(self) -> None:
        """Begin the phase of the current page."""
        page = self.study.page
        self._why_stopped, self._trial, self._hint, self._kept_felt = "", None, "", (0, False)
        self._adjusting = None
        self._record = TrialRecord(started_at=time_of_day())
        self._stimulus.begin(IDLE)
        self._page_due = time.perf_counter() + page.seconds
        if page.kind == "end":
            self._phase = Phase.END
        elif page.kind == "pause":
            self._phase = Phase.PAUSE
        elif page.trial is None:
            self._phase = Phase.PAGE
            (question, *_) = page.questions or (None,)
            if isinstance(question, Adjusted):
                self._adjusting = self._adjusted_level(question, self.protocol.stage(page.stage).stimulus)
                self._adjusting.play()  # what is to be lowered is felt at once
        else:
            study = self.study
            last = study.entries[-1] if study.entries else None
            within = last is not None and last.trial is not None and last.stage == page.stage
            pause_s = self.protocol.stage(page.stage).trial_pause_s if within else 0.0
            self._phase = Phase.WAITING
            self._trial = TrialRun(self._apparatus, page, study.participant, study.gain_db, self._record, pause_s)

    def _adjusted_level(self, question: Adjusted, stimulus: str) -> Adjusting:
        """Return the level of a stimulus, to be moved on the page of the level."""
        return Adjusting(question, lambda db: self._stimuli.adjusted(stimulus, question, db, 0.0), self._stimulus.begin)

    def _poll_trial(self, trial: TrialRun) -> None:
        """Advance the trial; store an answer that was given on the floor."""
        match trial.poll():
            case Interrupted(reason):
                self.stop(reason)
            case Answered(values, facts, pause_s) if trial.target is not None:
                if values["selected"] == YES:
                    self._selected = (trial.target, time.perf_counter() + SELECTED_S)
                self._keep(values, facts)
                if pause_s and self._trial is not None:
                    self._trial.due = time.perf_counter() + pause_s
            case Answered(values, facts):
                self._take_answer(values, facts)

    def _page(self) -> None:
        """End stimuli and the time of learning after their duration."""
        kind = self.page.kind
        if kind == "learn" and self.page.seconds and time.perf_counter() >= self._page_due:
            self._keep({}, {})
        elif kind == "learn":
            if self._stimulus.has_ended(self.protocol.present_s):
                self.presenter.request(IDLE)
        elif kind == "level":
            self._stimulus.has_ended(math.inf)

    def _pause(self) -> None:
        if time.perf_counter() >= self._page_due:
            self._keep({}, {})

    # --- storing ---

    def _take_answer(self, values: Answers, facts: Mapping[str, Any]) -> None:
        """Store an answer with the facts of its trial and the response time."""
        if self._trial is not None:
            self._trial.conclude()
        self._record.complete(self.presenter)
        known = {**self._record.facts, **facts}
        if self.phase is Phase.ANSWERING:
            known |= {"response_s": round(time.perf_counter() - self._record.ended, 4), "plays": self._record.plays}
        self._keep(values, known)

    def _keep(self, values: Answers, facts: Mapping[str, Any]) -> None:
        """Take an answer and store it with its excerpts; only then open the next page."""
        entry = self.study.answer(values, {"started_at": self._record.started_at, **facts})
        self._store(entry)
        self._equipment.mark(ANSWER, place_of(entry))
        self._open_page()

    def _keep_felt(self) -> None:
        """Store that a trial is felt, before it is answered: when it begins to vibrate, and when it has ended.

        Else nobody would know of it, if the program were killed.
        """
        record, has_ended = self._record, self.phase is Phase.ANSWERING
        state = record.plays, has_ended
        if state != self._kept_felt and (has_ended or (self.phase is Phase.PRESENTING and "onset_s" in record.facts)):
            self._kept_felt = state
            facts = {"started_at": record.started_at, "plays": record.plays, **record.facts}
            self.file.keep_felt(self.study.unanswered(facts))

    def _store(self, entry: Entry) -> None:
        """Write an entry; if the disk refuses it, keep it in memory and stop the study."""
        try:
            self.file.add(entry, self._record.excerpts)
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


_STEPS: Mapping[Phase, Callable[[Runner], None]] = {
    Phase.PREPARING: Runner._prepare,
    Phase.PAGE: Runner._page,
    Phase.PAUSE: Runner._pause,
}
"""The steps of `poll` in phases without a trial; none when stopped, and at the end."""
