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

import numpy as np

from underfoot.engine.commands import Level
from underfoot.engine.reports import Notice, ProcessDied, Report
from underfoot.engine.session import Session
from underfoot.engine.session_memory import ForceReader
from underfoot.errors import BadFile, BadValue, require
from underfoot.experiments.methods.target_selection import TargetSelection
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.store import SessionFile, time_of_day
from underfoot.experiments.study import AGREED, Entry, Page, Study, method_of
from underfoot.experiments.trials import NOTHING, Answers, Presentation
from underfoot.patch.patch import Patch
from underfoot.studies.equipment import Equipment
from underfoot.studies.floor_watch import FloorWatch
from underfoot.studies.foot_answers import FootAnswers, require_fields
from underfoot.studies.markers import ANSWER, BEGIN, END, ONSET, STOP, place_of
from underfoot.studies.measuring import TrialRecord
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE, PRESENTED_S, WAITED_S, Presenter
from underfoot.studies.stimulus_patches import StimulusPatches
from underfoot.studies.target import SELECTED_S, FloorTarget, require_on_floor

CROSSINGS = 2
SETTLED_S = 0.3
"""Silence before a presentation, so that its excerpt contains nothing of the previous one."""


class Runner:
    """A running study: a live session, the session file, and the study. `close` restores the session."""

    def __init__(
        self,
        session: Session,
        file: SessionFile,
        protocol: Protocol,
        folder: Path | None = None,
        equipment: Equipment | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin or continue the study at the state of the file; `folder` contains the protocol's patches."""
        require_on_floor(protocol, session.target.floor)
        require_fields(protocol, session.target.floor)
        self.session, self.file, self.protocol = session, file, protocol
        self._clock = clock
        self._stimuli = StimulusPatches(protocol, session.registry, folder)
        self._equipment = equipment or Equipment()
        self.study: Study = file.study(protocol)
        target = session.target
        self.presenter = Presenter(session)
        self.watch = FloorWatch(
            ForceReader(session.memory.force), target.floor, float(target.rate), session.force_rate_hz
        )
        self.phase = Phase.PREPARING
        self.hint = ""
        """An instruction for the participant, in one sentence."""
        self.messages: list[str] = []
        """Messages for the experimenter, newest last."""
        self._before = (session.patch, session.level_db, session.playing)
        self._unprepared = self._stimuli.kinds()
        self._interval, self._due = 0, 0.0
        self._armed_s = math.inf
        self._presented = TrialRecord()
        self._playing_until = math.inf
        self._stood = False
        self._floor_target: FloorTarget | None = None
        self._selected: tuple[FloorTarget | None, float] = (None, 0.0)
        self.foot: FootAnswers | None = None
        """The fields on the floor for the current question; None if it has no answer by foot."""
        self._resumed = Phase.PAGE
        session.stop()  # silence while patches are compiled

    # --- display ---

    @property
    def page(self) -> Page:
        """The current page of the study."""
        return self.study.page

    @property
    def interval(self) -> int:
        """The current interval of the trial, from 1."""
        return self._interval + 1

    @property
    def plays(self) -> int:
        """The number of presentations of the trial so far."""
        return self._presented.plays

    @property
    def seconds_left(self) -> float:
        """The remaining seconds of a pause or wait; 0 without a countdown."""
        counted = self.phase in (Phase.PAUSE, Phase.WAITING) or self.page.kind == "learn"
        return max(self._due - self._clock(), 0.0) if counted else 0.0

    @property
    def may_play(self) -> bool:
        """Whether a key can start a presentation, for the first time or again."""
        if self.phase is Phase.READY:
            return self.page.start == "key"
        again = self.phase is Phase.ANSWERING and self.page.start == "key" and len(self._intervals) == 1
        return again and self._presented.plays < self.page.plays

    @property
    def target(self) -> FloorTarget | None:
        """The button on the floor that can be pressed now; None if there is none."""
        return self._floor_target if self.phase is Phase.PRESENTING else None

    @property
    def selected(self) -> FloorTarget | None:
        """The button that was just pressed in time, and is highlighted; None if there is none."""
        target, until = self._selected
        return target if self.phase is Phase.WAITING and self._clock() < until else None

    # --- actions ---

    def poll(self, reports: Iterable[Report]) -> None:
        """Advance the study, with the session's reports since the last call."""
        several = list(reports)
        self.presenter.take(several)
        self.presenter.read(PRESENTED_S if self.phase is Phase.PRESENTING else WAITED_S)
        self._equipment.forces(self.watch.read())
        for report in several:
            if isinstance(report, ProcessDied) and report.process == "engine":
                self._lost(f"the engine was lost: {report.reason}")
            elif isinstance(report, Notice):
                self.messages.append(report.text)
        if self.presenter.problem:
            self.messages.append(self.presenter.problem)
            self.presenter.problem = ""
            self.stop("a stimulus cannot be played")
        _STEPS[self.phase](self)

    def start(self) -> None:
        """Start or repeat a presentation, after a key press; raise `BadValue` if that is not allowed now."""
        require(self.may_play, "phase", str(self.phase), "ready for a key")
        self._interval = 0
        self._begin_by_key()

    def play(self, stimulus: str) -> None:
        """Play a stimulus in learning; raise `BadValue` on any other page."""
        kind = self.page.kind
        require(
            self.phase is Phase.PAGE and kind in ("learn", "level"), "page", kind, "one of learning, or of the level"
        )
        require(stimulus in self.protocol.stimuli, "stimulus", stimulus, ", ".join(self.protocol.stimuli))
        self.presenter.request(self._patch(Presentation(stimulus)))
        self._playing_until = math.inf

    def set_level(self, gain_db: float) -> None:
        """Set the level of the stimulus to `gain_db` re the protocol's, on the page of the level."""
        stage = self.protocol.stage(self.page.stage)
        require(stage.kind == "level", "page", stage.kind, "that of the level")
        self.presenter.request(self._stimuli.at(stage.stimulus, min(gain_db, 0.0)))
        self._playing_until = math.inf

    def answer(self, values: Answers) -> None:
        """Answer the page, and store the answer; raise `BadValue` if it is invalid or too early.

        A participant who does not consent stops the study; a note stores the time.
        """
        allowed = self.phase in (Phase.PAGE, Phase.ANSWERING)
        require(allowed, "phase", str(self.phase), "a page to answer, or the end of a presentation")
        if self.page.kind == "consent" and values.get(AGREED) == NO:
            self.stop("the participant does not agree to take part")
        else:
            self._take_answer(values, {})

    def end_pause(self) -> None:
        """End a pause early; the remaining seconds are stored."""
        require(self.phase is Phase.PAUSE, "phase", str(self.phase), "a pause")
        self._keep({}, {"left_s": round(self.seconds_left, 1)})

    def spoil(self, reason: str) -> None:
        """Spoil the current trial for a reason, and present it again."""
        self._store(self.study.spoil(reason, self._presented.facts))
        self._open_page()

    def repeat_last(self, reason: str) -> None:
        """Spoil the last answer for a reason, and present its trial again."""
        before = self.study.without_last(reason)
        self.file.replace_last(before.entries[-1])
        self.study = before
        self._open_page()

    def note(self, text: str) -> None:
        """Store a note of the experimenter."""
        self.file.add_note(text)

    def stop(self, reason: str) -> None:
        """Silence the output at once; a current trial begins again on `go_on`."""
        if self.phase in (Phase.STOPPED, Phase.END):
            return
        self.session.panic()
        self._resumed = Phase.PREPARING if self.phase is Phase.PREPARING else Phase.PAGE
        self.phase, self.hint = Phase.STOPPED, f"Stopped: {reason}."
        self._mark(STOP)
        self.note(f"stopped: {reason}")

    def go_on(self) -> None:
        """Continue at the current page after a stop."""
        require(self.phase is Phase.STOPPED, "phase", str(self.phase), "stopped")
        self.file.write_waiting()
        self.note("went on")
        if self._resumed is Phase.PREPARING:
            self.session.panic()
            self.phase = Phase.PREPARING
            return
        self.presenter.request(IDLE)
        self.presenter.begin()
        self._open_page()

    def close(self) -> None:
        """Restore the session, and close the file."""
        patch, level_db, playing = self._before
        self.session.edit(patch)
        self.session.send(Level(level_db))
        (self.session.play if playing else self.session.stop)()
        self.close_file()

    def close_file(self) -> None:
        """Close the file and all equipment; leave the session unchanged."""
        self._equipment.close()
        try:
            self.file.write_waiting()
        finally:
            self.file.close()

    # --- phases ---

    def _prepare(self) -> None:
        """Play each patch once, so that all are compiled."""
        if not self.session.health.running or self.presenter.since_frame is None:
            return
        if self._unprepared:
            self.hint = f"Preparing: {len(self._unprepared)} left"
            self.presenter.request(self._unprepared.pop())
            return
        self.presenter.request(IDLE)
        self.presenter.begin()
        if self._equipment.masking is not None:
            self._equipment.masking.start()
        self._open_page()

    def _open_page(self) -> None:
        """Begin the phase of the current page."""
        page = self.study.page
        self.hint, self._interval = "", 0
        self._presented, self._floor_target, self.foot = TrialRecord(started_at=time_of_day()), None, None
        self._playing_until = math.inf
        self.presenter.request(IDLE)
        now = self._clock()
        if page.kind == "end":
            self.phase = Phase.END
        elif page.kind == "pause":
            self.phase, self._due = Phase.PAUSE, now + page.seconds
        elif page.trial is None:
            self.phase, self._due = Phase.PAGE, now + page.seconds
        else:
            last = self.study.entries[-1] if self.study.entries else None
            within = last is not None and last.trial is not None and last.stage == page.stage
            pause = self.protocol.stage(page.stage).trial_pause_s if within else 0.0
            self._wait(pause)

    def _wait(self, seconds: float) -> None:
        """Wait for `seconds` before an interval, while the plate moves to its stiffness."""
        self.phase, self._due = Phase.WAITING, self._clock() + seconds
        if self._intervals and self._equipment.plate is not None:
            stimulus = self._intervals[self._interval].stimulus
            stiffness = self.protocol.stimuli[stimulus].stiffness_n_mm if stimulus != NOTHING else 0.0
            if stiffness > 0.0:
                self._equipment.plate.request_stiffness(stiffness)

    def _waiting(self) -> None:
        plate = self._equipment.plate
        if plate is not None and not plate.poll(is_loaded=self.watch.is_loaded):
            self.hint = "The plate moves. Please step off." if self.watch.is_loaded else "The plate moves."
            return
        by_foot = self.page.start != "key" or not self._intervals
        if self._clock() < self._due or not self.presenter.has_played(SETTLED_S):
            self.hint = ""
        elif by_foot and self._intervals and self.watch.is_loaded:
            self.hint = "Please step off."
        elif not self._intervals:
            self._show_target()
        elif not by_foot and self._interval == 0:
            self.phase, self.hint = Phase.READY, ""
        elif not by_foot:
            self._begin_by_key()
        else:
            self._arm()

    def _arm(self) -> None:
        """Play the stimulus, and wait for a step."""
        self.presenter.request(self._patch(self._intervals[self._interval]))
        if self.presenter.since_frame is not None:
            self._armed_s = self.watch.now_s
            self.phase = Phase.READY
            self.hint = "Step on the tile." if self.page.start == "step" else "Cross the plate there and back."

    def _ready(self) -> None:
        if self.page.start == "key":
            return
        visits = self.watch.visits_since(self._armed_s)
        if visits:
            self._begin(visits[0].start_s)

    def _begin_by_key(self) -> None:
        self._begin(self.session.health.frame / self.session.target.rate)
        self._stood = self.watch.is_on
        self.presenter.request(self._patch(self._intervals[self._interval]))
        self._playing_until = math.inf

    def _begin(self, first_s: float) -> None:
        self.phase, self.hint, self.foot = Phase.PRESENTING, "", None
        if self._interval == 0:
            self._presented.begin_anew()
        self._presented.first_s = first_s
        self._mark(BEGIN, self.session.health.frame / self.session.target.rate - first_s)

    def _presenting(self) -> None:
        if self.watch.is_silent:
            self.stop("no force comes from the floor")
        elif self._floor_target is not None:
            self._watch_target(self._floor_target)
        elif self.page.start == "key" and self._stood and not self.watch.is_on:
            self.stop("the participant left the floor")
        elif self.page.start == "key":
            self._timed(self.protocol.present_s, self._end_interval)
        else:
            wanted = CROSSINGS if self.page.start == "crossings" else 1
            visits = self.watch.visits_since(self._armed_s)
            if len(visits) >= wanted and visits[wanted - 1].end_s < math.inf:
                self._end_interval()
            elif visits and visits[-1].end_s < math.inf:
                self.hint = "Now back."

    def _timed(self, seconds: float, then: Callable[[], None]) -> None:
        """Send the event by hand once the patch plays, and call `then` after `seconds`."""
        since = self.presenter.since_frame
        if since is None:
            return
        if self._playing_until == math.inf:
            most_loaded = int(np.argmax(self.watch.loads_n))  # on the tile under the participant
            self.presenter.strike(self.session.target.floor.tiles[most_loaded].id)
            self._playing_until = self._clock() + seconds
        elif self._clock() >= self._playing_until:
            self._playing_until = math.inf
            then()

    def _end_interval(self) -> None:
        """Measure this interval, and begin the next one, or the answer."""
        self._measure()
        self.presenter.request(IDLE)
        self._presented.ended, self.hint = self._clock(), ""
        if self._interval + 1 < len(self._intervals):
            self._interval += 1
            self._wait(self.protocol.stage(self.page.stage).interval_pause_s)
        else:
            self.phase = Phase.ANSWERING
            foot = self.protocol.stage(self.page.stage).foot
            if foot is not None:
                self.foot = FootAnswers(foot, self.page.questions[0], self.session.target.floor, self.watch.now_s)
                self.hint = self.foot.hint

    def _answering(self) -> None:
        """Poll for an answer by foot while the participant answers."""
        if self.foot is None:
            return
        answers = self.foot.judged(self.watch.contacts, self.watch.now_s)
        if answers is not None:
            self._take_answer(answers, self.foot.facts)

    def _page(self) -> None:
        """End stimuli and the time of learning after their duration."""
        kind = self.page.kind
        if kind == "learn" and self.page.seconds and self._clock() >= self._due:
            self._keep({}, {})
        elif kind == "learn":
            self._timed(self.protocol.present_s, lambda: self.presenter.request(IDLE))
        elif kind == "level":
            self._timed(math.inf, lambda: None)

    def _pause(self) -> None:
        if self._clock() >= self._due:
            self._keep({}, {})

    def _ended(self) -> None:
        """Do nothing: the study is over, or stopped."""

    # --- targets ---

    def _show_target(self) -> None:
        trial = self.page.trial
        method = method_of(self.protocol, self.protocol.stage(self.page.stage), self.study.participant)
        if trial is None or not isinstance(method, TargetSelection):
            raise BadValue(f"stage {self.page.stage!r} presents nothing")
        self._floor_target = FloorTarget.of(trial, method.given, self.watch.now_s, self._clock())
        self._begin(self.watch.now_s)

    def _watch_target(self, target: FloorTarget) -> None:
        answers = target.judged(self.watch.contacts, self.watch.now_s, self._clock())
        if answers is None:
            return
        if answers["selected"] == YES:
            self._selected = (target, self._clock() + SELECTED_S)
        self._measure()
        self._presented.complete(self.presenter)
        self._keep(answers, dict(self._presented.facts), pause_s=target.pause_s)

    # --- storing ---

    def _take_answer(self, values: Answers, facts: Mapping[str, Any]) -> None:
        """Store an answer with the facts of its trial and the response time."""
        self._presented.complete(self.presenter)
        known = {**self._presented.facts, **facts}
        if self.phase is Phase.ANSWERING:
            known |= {"response_s": round(self._clock() - self._presented.ended, 4), "plays": self._presented.plays}
        self._keep(values, known)

    def _keep(self, values: Answers, facts: Mapping[str, Any], pause_s: float = 0.0) -> None:
        """Take an answer and store it with its excerpts; only then open the next page."""
        known = {"started_at": self._presented.started_at, **facts}
        entry = self.study.answer(values, known)
        self._store(entry)
        self._equipment.mark(ANSWER, place_of(entry))
        self._open_page()
        if pause_s and self.phase is Phase.WAITING:
            self._due = self._clock() + pause_s

    def _store(self, entry: Entry) -> None:
        """Write an entry; if the disk refuses it, keep it in memory and stop the study."""
        try:
            self.file.add(entry, self._presented.excerpts)
        except BadFile:
            with suppress(BadFile):
                self.stop("the disk refuses the answer, which is kept until you go on; make room first")
            raise

    def _measure(self) -> None:
        """Measure this interval, and send its markers."""
        before = len(self._presented.excerpts)
        self._presented.measure(self.presenter, self.watch, self._interval, self.page.start != "key")
        self.file.begin_packing(self._presented.excerpts[before:])
        now_s = self.session.health.frame / self.session.target.rate
        if math.isfinite(self._presented.onset_s):
            self._mark(ONSET, now_s - self._presented.onset_s)
        self._mark(END)

    def _mark(self, what: str, ago_s: float = 0.0) -> None:
        self._equipment.mark(what, place_of(self.page), ago_s)

    def _lost(self, why: str) -> None:
        """Spoil a presentation during which the engine stopped."""
        self.messages.append(why)
        if self.page.trial is not None and self.phase in (Phase.PRESENTING, Phase.READY, Phase.WAITING):
            if self.phase is Phase.PRESENTING:
                self.spoil(why)
            else:
                self._open_page()

    @property
    def _intervals(self) -> tuple[Presentation, ...]:
        trial = self.study.page.trial
        return trial.intervals if trial is not None else ()

    def _patch(self, presentation: Presentation) -> Patch:
        """Return the patch of a presentation at the participant's level."""
        return self._stimuli.presented(presentation, self.study.gain_db)


_STEPS: Mapping[Phase, Callable[[Runner], None]] = {
    Phase.PREPARING: Runner._prepare,
    Phase.PAGE: Runner._page,
    Phase.PAUSE: Runner._pause,
    Phase.WAITING: Runner._waiting,
    Phase.READY: Runner._ready,
    Phase.PRESENTING: Runner._presenting,
    Phase.ANSWERING: Runner._answering,
    Phase.STOPPED: Runner._ended,
    Phase.END: Runner._ended,
}
