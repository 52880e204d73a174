"""What goes on while one page of a study is shown, from its first moment to the outcome that ends it."""

import math
import time
from dataclasses import dataclass
from typing import Any

from underfoot.experiments.questions import Adjusted
from underfoot.experiments.store import time_of_day
from underfoot.experiments.study import Page
from underfoot.experiments.trials import Answers
from underfoot.phrases import Phrase
from underfoot.studies.adjusting import Adjusting
from underfoot.studies.apparatus import Apparatus, TimedStimulus
from underfoot.studies.foot_answers import FootAnswers
from underfoot.studies.measuring import TrialRecord
from underfoot.studies.phase import Phase
from underfoot.studies.presenter import IDLE
from underfoot.studies.target import FloorTarget


@dataclass(frozen=True)
class Prepared:
    """All stimuli are compiled: the first page can be opened."""


@dataclass(frozen=True)
class Answered:
    """The page was answered on the floor, or by its time."""

    values: Answers


@dataclass(frozen=True)
class Interrupted:
    """Why the presentation cannot go on."""

    reason: str


Outcome = Prepared | Answered | Interrupted


class PageRun:
    """A page that is read or answered, a pause, or the end. Nothing is felt at it, and its time may end it."""

    is_prepared = True
    tried: TimedStimulus | None = None
    """Plays the stimuli that are tried out; None where none can be."""
    interval = 0
    """The index of the current interval."""
    target: FloorTarget | None = None
    """The button on the floor that can be pressed now."""
    foot: FootAnswers | None = None
    """The fields on the floor for the question; None if it has no answer by foot."""

    def __init__(self, phase: Phase, seconds: float = math.inf) -> None:
        self.phase, self.hint = phase, ""
        self.due = time.perf_counter() + seconds
        self.record = TrialRecord(started_at=time_of_day())
        """What is measured of what is felt, and stored with the answer."""

    def poll(self) -> Outcome | None:
        """Advance without blocking; return how the page ends, once it does without a key."""
        return Answered({}) if time.perf_counter() >= self.due else None

    @property
    def seconds_left(self) -> float:
        """The remaining seconds of a countdown; 0 without one."""
        return max(self.due - time.perf_counter(), 0.0) if self.due < math.inf else 0.0

    @property
    def adjusting(self) -> Adjusting | None:
        """What is moved now while it is felt; None where nothing is."""
        return None

    @property
    def can_be_started(self) -> bool:
        """Whether a key can start a presentation, for the first time or again."""
        return False

    def start(self) -> None:
        """Present what a key starts, where `can_be_started`."""

    def conclude(self) -> dict[str, Any]:
        """End what is felt as the page is answered; return the facts to store with the answer."""
        return {}


class Preparation(PageRun):
    """Each patch is played once in silence, so that all are compiled; sound begins once nothing but `IDLE` plays."""

    is_prepared = False

    def __init__(self, apparatus: Apparatus) -> None:
        super().__init__(Phase.PREPARING)
        self._apparatus = apparatus
        self._left = [IDLE, *apparatus.stimuli.kinds()]  # the last one first

    def poll(self) -> Prepared | None:
        presenter, masking = self._apparatus.presenter, self._apparatus.equipment.masking
        if not self._apparatus.session.health.running or presenter.since_frame is None:
            return None
        if self._left:
            self.hint = Phrase("Preparing: {count} left", count=len(self._left))
            presenter.request(self._left.pop())
            return None
        if not presenter.has_settled():
            return None  # the patch that was open fades out
        presenter.begin()
        if masking is not None:
            masking.start()
        return Prepared()


class Learning(PageRun):
    """Stimuli are tried out by number, until a key ends it or, if the page has any, after its seconds."""

    tried: TimedStimulus

    def __init__(self, apparatus: Apparatus, page: Page) -> None:
        super().__init__(Phase.PAGE, page.seconds or math.inf)
        self._apparatus, self.tried = apparatus, TimedStimulus(apparatus)

    def poll(self) -> Outcome | None:
        if self.tried.has_ended(self._apparatus.protocol.present_s):
            self._apparatus.presenter.request(IDLE)
        return super().poll()


class LevelRun(PageRun):
    """The level of one stimulus is lowered until it is only just felt; it is felt at once."""

    tried: TimedStimulus

    def __init__(self, apparatus: Apparatus, page: Page, question: Adjusted) -> None:
        super().__init__(Phase.PAGE)
        stimuli, name = apparatus.stimuli, apparatus.protocol.stage(page.stage).stimulus
        self.tried = TimedStimulus(apparatus)
        self._level = Adjusting(question, lambda db: stimuli.adjusted(name, question, db, 0.0), self.tried.begin)
        self._level.play()

    @property
    def adjusting(self) -> Adjusting:
        return self._level

    def poll(self) -> None:
        self.tried.has_ended(math.inf)


class Stopped(PageRun):
    """A page that was stopped: all is silent, and what was measured of it is kept until the study goes on."""

    def __init__(self, run: PageRun, reason: str) -> None:
        colon = "" if reason.startswith("by ") else ":"
        super().__init__(Phase.STOPPED)
        self.reason, self.hint = f"stopped{colon} {reason}", f"Stopped{colon} {reason}."
        self.record, self.interval, self.is_prepared = run.record, run.interval, run.is_prepared
