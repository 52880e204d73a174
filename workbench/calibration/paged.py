"""Common part of all procedures: a sequence of pages, the data taken by each, and the way back."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.procedure import Answers, Page, PageProgress
from underfoot.calibration.result import Inconclusive, Result
from underfoot.calibration.rig import NO_READINGS, Readings
from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement, BadValue

TIMEOUT_S = 120.0
"""Seconds of readings after which an incomplete page is given up."""
LONGEST_GAP_S = 0.5
"""Seconds without a reading after which a page begins again: what happened meanwhile is not known."""
EMPTY_TILE = "Take everything off the tile and stand clear."
"""What a tare asks for."""
_LEAST_PAGES = 12
"""Smallest number of pages for the progress display, as the number is unknown before the first answer."""


@dataclass(frozen=True)
class Step:
    """Page with the way it takes its measurement.

    `take` examines all readings since the page was opened; it returns what is still missing, or None when there is
    enough. It raises `BadMeasurement`. Steps of one `group`, a sensor or a position, are skipped together. A step that
    `lets_go` of the load of the one before is measured again only with that one. One that `needs_all` is passed over
    where any other was skipped.
    """

    page: Page
    take: Callable[[Readings], PageProgress | None] | None = None
    group: int | str | None = None
    lets_go: bool = field(default=False, kw_only=True)
    needs_all: bool = field(default=False, kw_only=True)


class StepData(NamedTuple):
    """Data taken by one step: its readings, and the answers to its page."""

    step: Step
    readings: Readings
    answers: Answers


class PagedProcedure:
    """Runs through steps. A subclass gives the first page, plans the steps from its answers, and makes the result."""

    def __init__(self, first: Page) -> None:
        self._steps: list[Step] = [Step(first)]
        self._at = 0
        self._step_data: dict[int, Readings] = {}
        self._skipped: set[int] = set()
        self._answers: dict[int, Answers] = {}
        self._incoming = NO_READINGS
        self._progress = PageProgress()
        self._result: Result | None = None

    def plan(self, answers: Answers) -> list[Step]:
        """Return the steps after the first page from its checked answers; `BadMeasurement` if they are inconsistent."""
        raise AssertionError(f"{type(self).__name__} has no plan")

    def conclude(self) -> Result:
        """Return the result of all data taken; `BadMeasurement` or `BadValue` if there is none."""
        raise AssertionError(f"{type(self).__name__} comes to no conclusion")

    def check_answers(self, step: Step, answers: Answers) -> None:
        """Check the answers of a later page before they apply; `BadMeasurement` if they cannot be right."""

    @property
    def page(self) -> Page:
        """Return the present page."""
        step = self._steps[self._at]
        questions = () if self._at in self._answers and step.take is not None else step.page.questions
        share = 1.0 if step.page.last else self._at / max(len(self._steps) - 1, _LEAST_PAGES)
        return replace(step.page, questions=questions, share=share)

    @property
    def progress(self) -> PageProgress:
        """Return the progress of the page's measurement."""
        return self._progress

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Return drawings of the data so far; none unless a subclass overrides this."""
        return ()

    @property
    def result(self) -> Result | None:
        """Return the result; None before the last page."""
        return self._result if self._steps[self._at].page.last else None

    def answer(self, values: Answers) -> None:
        """Answer the page and go on; `BadValue` and `BadMeasurement` leave everything unchanged."""
        page = self.page
        if page.last:
            return
        if page.wants_press:
            raise BadValue(f"{page.title}: this page takes a press, not an answer")
        values = {name: value for name, value in values.items() if value is not None}
        unknown = set(values) - {ask.name for ask in page.questions}
        if unknown:
            raise BadValue(f"{page.title} does not ask for {sorted(unknown)[0]}")
        checked = {ask.name: ask.check(values.get(ask.name, ask.default)) for ask in page.questions}
        if self._at == 0:
            end = Step(Page("result", "Result", "Look at it, and save it.", last=True))
            self._steps = [self._steps[0], *self.plan(checked), end]
        else:
            self.check_answers(self._steps[self._at], checked)
        self._answers[self._at] = checked
        if self._steps[self._at].take is None:
            self._go_on()

    def feed(self, readings: Readings) -> None:
        """Take readings as they arrive; goes on when the page has enough."""
        step = self._steps[self._at]
        if step.take is None or self.page.questions or readings.time_s.size == 0:
            return
        self._incoming = self._incoming.followed_by(readings)
        try:
            gap_s = float(np.diff(self._incoming.time_s).max(initial=0.0))
            if gap_s > LONGEST_GAP_S:
                raise BadMeasurement(f"{step.page.title}: nothing was read for {gap_s:.1f} s; is the tile plugged in?")
            progress = step.take(self._incoming)
            if progress is not None and np.ptp(self._incoming.time_s) > TIMEOUT_S:
                raise BadMeasurement(f"{step.page.title}: not complete after {TIMEOUT_S:.0f} s. {progress.hint}")
            if progress is not None:
                self._progress = progress
                return
            self._step_data[self._at] = self._incoming
            self._go_on()
        except Inconclusive:
            raise
        except BadMeasurement:
            self.begin_again()
            raise

    def begin_again(self) -> None:
        """Discard what was read on this page, and begin with the load again that it lets go of."""
        again = self._with_load(self._at)
        for k in range(again, self._at + 1):
            self._step_data.pop(k, None)
            self._answers.pop(k, None)
        self._open(again)

    def take_recording(self, recorded: NDArray[np.float64]) -> None:
        """Take the recording of the page's sound; `BadValue` unless a subclass plays sounds."""
        raise BadValue(f"{self.page.title}: this page takes no recording")

    def skip(self) -> None:
        """Skip this page and those of the same sensor or position."""
        step = self._steps[self._at]
        if not step.page.may_skip:
            raise BadValue(f"{step.page.title} cannot be skipped")
        for k in [k for k in self._step_data if self._steps[k].group == step.group]:
            del self._step_data[k]
        while self._steps[self._at + 1].group == step.group:
            self._skipped.add(self._at)
            self._at += 1
        self._skipped.add(self._at)
        self._go_on()

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the raw data so far, where `reason` keeps them from a result; None unless a subclass has any."""
        return None

    def back(self) -> None:
        """Return to the previous page that does not let go, or to the first of a skipped group; discard data since."""
        if self._at == 0:
            return
        at = self._beside(-1)
        if at in self._skipped:
            at = next(k for k, step in enumerate(self._steps) if step.group == self._steps[at].group)
        at = self._with_load(at)
        self._skipped = {k for k in self._skipped if k < at}
        self._step_data = {k: readings for k, readings in self._step_data.items() if k < at}
        self._answers = {k: answers for k, answers in self._answers.items() if k < at}
        self._result = None
        self._open(at)

    def step_data(self) -> list[StepData]:
        """Return the data taken so far, in order."""
        return [StepData(self._steps[k], self._step_data[k], self._answers.get(k, {})) for k in sorted(self._step_data)]

    def _with_load(self, at: int) -> int:
        """Return the index of a step, or of the one whose load it lets go of."""
        while self._steps[at].lets_go:
            at -= 1
        return at

    def _open(self, at: int) -> None:
        self._at, self._incoming, self._progress = at, NO_READINGS, PageProgress()

    def next_step(self) -> int:
        """Return the index of the step after the present one."""
        return self._beside(1)

    def _beside(self, by: int) -> int:
        """Return the index of the step after (1) or before (-1) the present one, past one that `needs_all` in vain."""
        at = self._at + by
        return at + by if self._steps[at].needs_all and self._skipped - {at} else at

    def _go_on(self) -> None:
        self._open(self.next_step())
        self._conclude_if_last()

    def _conclude_if_last(self) -> None:
        if not self._steps[self._at].page.last:
            return
        try:
            self._result = self.conclude()
        except (BadMeasurement, BadValue) as error:
            self._open(self._beside(-1))
            raise Inconclusive(str(error)) from None


class SoundProcedure(PagedProcedure):
    """Runs through steps whose pages play sounds and record the response."""

    def take_sound(self, key: str, played: NDArray[np.float64], recording: NDArray[np.float64]) -> None:
        """Evaluate the recording of this page's sound; `BadMeasurement` if that fails."""
        raise AssertionError(f"{type(self).__name__} takes no sound")

    def answer(self, values: Answers) -> None:
        """Answer the page and go on."""
        if self.page.sound is not None:
            raise BadValue(f"{self.page.title}: this page takes a recording, not an answer")
        super().answer(values)

    def take_recording(self, recorded: NDArray[np.float64]) -> None:
        """Take the recording of the page's sound, (frames,), in full scale, and go on."""
        page = self.page
        if page.sound is None:
            raise BadValue(f"{page.title}: this page takes no recording")
        recording = np.asarray(recorded, dtype=np.float64)
        if recording.ndim != 1 or not np.isfinite(recording).all():
            raise BadMeasurement(f"{page.title}: the recording is not one channel of finite samples")
        if recording.size < page.sound.signal.size:
            rate_hz = page.sound.rate_hz
            raise BadMeasurement(
                f"{page.title}: the recording lasts {recording.size / rate_hz:.2f} s, "
                f"the sound {page.sound.signal.size / rate_hz:.2f} s"
            )
        self.take_sound(page.key, page.sound.signal, recording)
        self._go_on()
