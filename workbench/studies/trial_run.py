"""One trial with a participant: its intervals are presented one after another, and measured, until it is answered."""

import math
import time
from typing import Any

from underfoot.devices.force_source import WITHOUT_HARDWARE
from underfoot.experiments.columns import FORCE_FROM
from underfoot.experiments.questions import Adjusted
from underfoot.experiments.study import Page
from underfoot.experiments.trials import NOTHING, Presentation
from underfoot.patch.patch import Patch
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.apparatus import Apparatus, TimedStimulus
from underfoot.studies.foot_answers import FootAnswers
from underfoot.studies.markers import BEGIN, END, ONSET
from underfoot.studies.page_run import Answered, Interrupted, PageRun
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE
from underfoot.studies.target import FloorTarget

CROSSINGS = 2


class TrialRun(PageRun):
    """A trial: each interval is waited for (pause, plate, floor), ready (for a key or a step) and presented; then it is
    answered.
    """

    def __init__(self, apparatus: Apparatus, page: Page, gain_db: float, pause_s: float) -> None:
        """Begin with a pause of `pause_s`; stimuli play at the participant's `gain_db`."""
        assert page.trial is not None
        super().__init__(Phase.WAITING)
        self._apparatus, self._page, self._trial, self._gain_db = apparatus, page, page.trial, gain_db
        self._stage, self._by_key = apparatus.protocol.stage(page.stage), page.start == "key"
        self._intervals = page.trial.intervals
        """What is presented; nothing where a button appears."""
        self._stimulus = TimedStimulus(apparatus)
        self._armed_s = math.inf
        self._stood = False
        self._adjusted = self._made_adjusting()
        self._wait(pause_s)

    def poll(self) -> Answered | Interrupted | None:
        match self.phase:
            case Phase.WAITING:
                self._try_to_present()
            case Phase.READY:
                self._await_step()
            case Phase.PRESENTING:
                return self._present()
            case Phase.ANSWERING:
                return self._answer_by_foot() if self._adjusted is None else self._adjust()
        return None

    @property
    def adjusting(self) -> Adjusting | None:
        return self._adjusted if self.phase is Phase.ANSWERING else None

    @property
    def can_be_started(self) -> bool:
        if self.adjusting is not None:
            return True
        again = self.phase is Phase.ANSWERING and len(self._intervals) == 1 and self.record.plays < self._page.plays
        return self._by_key and (self.phase is Phase.READY or again)

    def start(self) -> None:
        """Present the first interval, after a key press; while something is moved, the other one."""
        if self.adjusting is not None:
            self.adjusting.switch()
            return
        self.interval = 0
        self._begin_by_key()

    # --- before a presentation ---

    def _wait(self, seconds: float) -> None:
        """Wait for `seconds` before an interval, while the plate moves to its stiffness."""
        self.phase, self.due = Phase.WAITING, time.perf_counter() + seconds
        self._set_plate()
        self._prepare()

    def _set_plate(self) -> None:
        """Move the plate to this interval's stiffness; if it has none, to where the plate is, which takes as long: else
        whoever waits would know of a catch trial.
        """
        plate, stimuli = self._apparatus.equipment.plate, self._apparatus.protocol.stimuli.values()
        usual = next((one.stiffness_n_mm for one in stimuli if one.stiffness_n_mm > 0.0), 0.0)
        if plate is not None and self._intervals and usual > 0.0:
            wanted = self._stiffness_of(self._intervals[self.interval])
            plate.request_stiffness(wanted or plate.wanted_n_mm or usual)

    def _stiffness_of(self, interval: Presentation) -> float:
        """Return the stiffness that the protocol asks for, in N/mm; 0 for none."""
        stimuli = self._apparatus.protocol.stimuli
        return stimuli[interval.stimulus].stiffness_n_mm if interval.stimulus != NOTHING else 0.0

    def _prepare(self) -> None:
        """Let a stimulus that a key begins settle under the feet that stand there."""
        if self._intervals and self._by_key:
            self._stimulus.prepare(self._patch)

    def _try_to_present(self) -> None:
        """Present, or be ready to, once the plate, the pause and the floor allow it."""
        watch, plate = self._apparatus.watch, self._apparatus.equipment.plate
        if plate is not None and not plate.poll(is_loaded=watch.is_loaded):
            self.hint = "The plate moves. Please step off." if watch.is_loaded else "The plate moves."
            return
        if time.perf_counter() < self.due or not self._apparatus.presenter.has_settled():
            self.hint = ""
        elif not self._intervals:
            self._show_target()
        elif self._by_key and self.interval == 0:
            self.phase, self.hint = Phase.READY, ""
        elif self._by_key:
            self._begin_by_key()
        elif watch.is_loaded:
            self.hint = "Please step off."
        else:
            self._arm()

    def _arm(self) -> None:
        """Play the stimulus, and wait for a step."""
        self._apparatus.presenter.request(self._patch)
        if self._apparatus.presenter.since_frame is not None:
            self._armed_s = self._apparatus.watch.now_s
            self.phase = Phase.READY
            self.hint = "Step on the tile." if self._page.start == "step" else "Cross the plate there and back."

    def _await_step(self) -> None:
        visits = self._apparatus.watch.visits_since(self._armed_s)
        if visits and not self._by_key:
            self._begin(visits[0].start_s)

    def _show_target(self) -> None:
        assert self._stage.method is not None
        watch, given = self._apparatus.watch, self._stage.method.given(self._apparatus.protocol.stimuli)
        self.target = FloorTarget.of(self._trial, given, watch.now_s, time.perf_counter(), watch.contacts)
        self._begin(watch.now_s)

    # --- during a presentation ---

    def _begin_by_key(self) -> None:
        self._begin(self._apparatus.session.played_s)
        self._stood = self._apparatus.watch.is_on
        self._stimulus.begin(self._patch)

    def _begin(self, first_s: float) -> None:
        """Begin an interval whose first force, or key press, was at `first_s` of the session."""
        self.phase, self.hint, self.foot = Phase.PRESENTING, "", None
        if self.interval == 0:
            self.record.begin_anew()
            if (kind := self._apparatus.session.target.kind) in WITHOUT_HARDWARE:
                self.record.facts[FORCE_FROM] = kind
            if any(self._stiffness_of(one) > 0.0 for one in self._intervals):
                self.record.facts["stiffness_set"] = self._apparatus.equipment.plate is not None
        self.record.first_s, self.record.onset_s = first_s, math.nan
        self._apparatus.mark(BEGIN, self._page, None if self._by_key else first_s)
        if self._adjusted is not None:  # it is felt while it is answered
            self.phase, self.record.ended = Phase.ANSWERING, time.perf_counter()

    def _present(self) -> Answered | Interrupted | None:
        watch = self._apparatus.watch
        self.record.look_for_onset(self._apparatus.presenter, by_foot=not self._by_key)
        if watch.is_silent:
            return Interrupted("no force comes from the floor")
        if self.target is not None:
            return self._judge(self.target)
        if self._by_key and self._stood and not watch.is_on:
            return Interrupted("the participant left the floor")
        if self._by_key:
            if self._stimulus.has_ended(self._apparatus.protocol.present_s):
                self._end_interval()
        else:
            self._follow_visits()
        return None

    def _follow_visits(self) -> None:
        wanted = CROSSINGS if self._page.start == "crossings" else 1
        visits = self._apparatus.watch.visits_since(self._armed_s)
        if len(visits) >= wanted and visits[wanted - 1].end_s < math.inf:
            self._end_interval()
        elif visits and visits[-1].end_s < math.inf:
            self.hint = "Now back."

    def _judge(self, target: FloorTarget) -> Answered | None:
        answers = target.judged(self._apparatus.watch.contacts, self._apparatus.watch.now_s, time.perf_counter())
        if answers is None:
            return None
        self._measure()
        return Answered(answers)

    def _end_interval(self) -> None:
        """Measure this interval, and begin the next one, or the answer."""
        self._measure()
        self._apparatus.presenter.request(IDLE)
        self.record.ended, self.hint = time.perf_counter(), ""
        if self.interval + 1 < len(self._intervals):
            self.interval += 1
            self._wait(self._stage.interval_pause_s)
            return
        self.phase = Phase.ANSWERING
        if self.can_be_started:
            self._prepare()
        if self._stage.foot is not None:
            floor, now_s = self._apparatus.session.target.floor, self._apparatus.watch.now_s
            self.foot = FootAnswers(self._stage.foot, self._page.questions[0], floor, now_s)
            self.hint = self.foot.hint

    def _measure(self) -> None:
        """Measure this interval, and send its markers."""
        apparatus, record, before = self._apparatus, self.record, len(self.record.excerpts)
        record.measure(apparatus.presenter, apparatus.watch, self.interval, by_foot=not self._by_key)
        apparatus.pack(record.excerpts[before:])
        if math.isfinite(record.onset_s):
            apparatus.mark(ONSET, self._page, record.onset_s)
        apparatus.mark(END, self._page)

    # --- after it ---

    def _adjust(self) -> Interrupted | None:
        """Follow what is felt while it is moved, by who stands there or steps as often as they like."""
        self.record.look_for_onset(self._apparatus.presenter, by_foot=not self._by_key)
        if self._by_key:
            self._stimulus.has_ended(math.inf)
        return Interrupted("no force comes from the floor") if self._apparatus.watch.is_silent else None

    def conclude(self) -> dict[str, Any]:
        record, adjusting = self.record, self.adjusting
        if adjusting is not None:
            self._measure()
            self._apparatus.presenter.request(IDLE)
            record.facts |= {"changes": adjusting.changes, "standard_plays": adjusting.standard_plays}
        record.complete(self._apparatus.presenter)
        if self.phase is not Phase.ANSWERING:
            return dict(record.facts)
        return {**record.facts, "response_s": round(time.perf_counter() - record.ended, 4), "plays": record.plays}

    def _made_adjusting(self) -> Adjusting | None:
        """Return what is to be moved in this trial; None where its question is answered otherwise."""
        question, stimuli = next(iter(self._page.questions), None), self._apparatus.stimuli
        if not isinstance(question, Adjusted):
            return None
        comparison, *others = self._intervals
        standard = next((stimuli.presented(one, self._gain_db) for one in others), None)
        present = self._stimulus.begin if self._by_key else self._apparatus.presenter.request
        return Adjusting(
            question, lambda at: stimuli.adjusted(comparison.stimulus, question, at, self._gain_db), present, standard
        )

    def _answer_by_foot(self) -> Answered | None:
        if self.foot is None:
            return None
        answers = self.foot.judged(self._apparatus.watch.contacts, self._apparatus.watch.now_s)
        self.hint = self.foot.hint
        if answers is None:
            return None
        self.record.complete(self._apparatus.presenter)
        self.record.facts |= self.foot.facts
        return Answered(answers)

    @property
    def _patch(self) -> Patch:
        """The patch of the current interval at the participant's level."""
        if self._adjusted is not None:
            return self._adjusted.patch
        return self._apparatus.stimuli.presented(self._intervals[self.interval], self._gain_db)
