"""What all procedures have in common: pages one after another, what each has taken, and the way back."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.procedure import Answers, Live, Page
from underfoot.calibration.result import Result
from underfoot.calibration.rig import NO_READINGS, Readings
from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement, BadValue

TIMEOUT_S = 120.0
"""A page that has not got what it needs after so many seconds of readings is given up."""
_LEAST_PAGES = 12
"""Progress is counted in at least so many pages: before the first answer nobody knows how many there will be."""


@dataclass(frozen=True)
class Step:
    """One page and how it takes its measurement.

    `take` looks at all readings since the page was opened; it returns what is still missing, or None when there is
    enough. It raises `BadMeasurement`. Steps of one `group`, a sensor or a place, are skipped together.
    """

    page: Page
    take: Callable[[Readings], Live | None] | None = None
    group: int | str | None = None


class Taken(NamedTuple):
    """What one step has taken: its readings, and what its page was answered."""

    step: Step
    readings: Readings
    answers: Answers


class PagedProcedure:
    """Goes through steps. A subclass gives the first page, plans the steps from its answers, and makes the result."""

    def __init__(self, first: Page) -> None:
        self._steps: list[Step] = [Step(first)]
        self._at = 0
        self._taken: dict[int, Readings] = {}
        self._skipped: set[int] = set()
        self._answers: dict[int, Answers] = {}
        self._incoming = NO_READINGS
        self._live = Live()
        self._result: Result | None = None

    def plan(self, answers: Answers) -> list[Step]:
        """The steps after the first page, whose checked answers these are; `BadMeasurement` where they make no
        sense."""
        raise AssertionError(f"{type(self).__name__} has no plan")

    def conclude(self) -> Result:
        """The result of all that was taken; `BadMeasurement` where nothing can come of it."""
        raise AssertionError(f"{type(self).__name__} comes to no conclusion")

    def check_answers(self, step: Step, answers: Answers) -> None:
        """Look at the answers of a later page before they count; `BadMeasurement` where they cannot be right."""

    @property
    def page(self) -> Page:
        """What is wanted now."""
        step = self._steps[self._at]
        asks = () if self._at in self._answers and step.take is not None else step.page.asks
        share = 1.0 if step.page.last else self._at / max(len(self._steps) - 1, _LEAST_PAGES)
        return replace(step.page, asks=asks, share=share)

    @property
    def live(self) -> Live:
        """How far the page's measurement is."""
        return self._live

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """What was taken so far; none unless a subclass draws it."""
        return ()

    @property
    def result(self) -> Result | None:
        """What came of it; None before the last page."""
        return self._result if self._steps[self._at].page.last else None

    def answer(self, values: Answers) -> None:
        """Give what the page asks for, and go on; `BadValue` and `BadMeasurement` leave everything as it was."""
        page = self.page
        if page.last:
            return
        if page.press is not None and not page.asks:
            raise BadValue(f"{page.title}: this page takes a press, not an answer")
        unknown = set(values) - {ask.name for ask in page.asks}
        if unknown:
            raise BadValue(f"{page.title} does not ask for {sorted(unknown)[0]}")
        checked = {ask.name: ask.check(values.get(ask.name, ask.default)) for ask in page.asks}
        if self._at == 0:
            end = Step(Page("result", "Result", "Look at it, and save it.", last=True))
            self._steps = [self._steps[0], *self.plan(checked), end]
        else:
            self.check_answers(self._steps[self._at], checked)
        self._answers[self._at] = checked
        if self._steps[self._at].take is None:
            self._go_on()

    def feed(self, readings: Readings) -> None:
        """Take readings as they come; goes on by itself when the page has what it needs."""
        step = self._steps[self._at]
        if step.take is None or self.page.asks or readings.time_s.size == 0:
            return
        self._incoming = self._incoming.followed_by(readings)
        try:
            live = step.take(self._incoming)
            if live is not None and np.ptp(self._incoming.time_s) > TIMEOUT_S:
                raise BadMeasurement(f"{step.page.title}: not complete after {TIMEOUT_S:.0f} s. {live.hint}")
            if live is not None:
                self._live = live
                return
            self._taken[self._at] = self._incoming
            self._go_on()
        except BadMeasurement:
            self._taken.pop(self._at, None)
            self._answers.pop(self._at, None)
            self._incoming, self._live = NO_READINGS, Live()
            raise

    def hear(self, recorded: NDArray[np.float64]) -> None:
        """Take what was recorded of the page's sound; `BadValue` unless a subclass plays sounds."""
        raise BadValue(f"{self.page.title}: this page takes no recording")

    def skip(self) -> None:
        """Leave out this page and those of the same sensor or place."""
        step = self._steps[self._at]
        if not step.page.may_skip:
            raise BadValue(f"{step.page.title} cannot be skipped")
        for k in [k for k in self._taken if self._steps[k].group == step.group]:
            del self._taken[k]
        while self._steps[self._at].group == step.group:
            self._skipped.add(self._at)
            self._taken.pop(self._at, None)
            self._open(self._at + 1)
        self._conclude_if_last()

    def back(self) -> None:
        """Return to the page before, and forget what was taken from there on."""
        if self._at == 0:
            return
        at = self._at - 1
        while at in self._skipped:
            self._skipped.discard(at)
            at -= 1
        self._taken = {k: readings for k, readings in self._taken.items() if k < at}
        self._answers = {k: answers for k, answers in self._answers.items() if k < at}
        self._result = None
        self._open(at)

    def taken(self) -> list[Taken]:
        """What was taken so far, in order."""
        return [Taken(self._steps[k], self._taken[k], self._answers.get(k, {})) for k in sorted(self._taken)]

    def _open(self, at: int) -> None:
        self._at, self._incoming, self._live = at, NO_READINGS, Live()

    def _go_on(self) -> None:
        self._open(self._at + 1)
        self._conclude_if_last()

    def _conclude_if_last(self) -> None:
        if not self._steps[self._at].page.last:
            return
        try:
            self._result = self.conclude()
        except BadMeasurement:
            self._open(self._at - 1)
            raise


class SoundingProcedure(PagedProcedure):
    """Goes through steps whose pages play sounds, and take what is recorded of them."""

    def take_sound(self, key: str, played: NDArray[np.float64], heard: NDArray[np.float64]) -> None:
        """Measure what the page of this key has recorded of its sound; `BadMeasurement` where nothing comes of it."""
        raise AssertionError(f"{type(self).__name__} takes no sound")

    def answer(self, values: Answers) -> None:
        """Give what the page asks for, and go on."""
        if self.page.sound is not None:
            raise BadValue(f"{self.page.title}: this page takes a recording, not an answer")
        super().answer(values)

    def hear(self, recorded: NDArray[np.float64]) -> None:
        """Take what was recorded of the page's sound, (frames,), of full scale; goes on."""
        page = self.page
        if page.sound is None:
            raise BadValue(f"{page.title}: this page takes no recording")
        heard = np.asarray(recorded, dtype=np.float64)
        if heard.ndim != 1 or not np.isfinite(heard).all():
            raise BadMeasurement(f"{page.title}: the recording is not one channel of finite samples")
        if heard.size < page.sound.signal.size:
            rate_hz = page.sound.rate_hz
            raise BadMeasurement(
                f"{page.title}: the recording lasts {heard.size / rate_hz:.2f} s, "
                f"the sound {page.sound.signal.size / rate_hz:.2f} s"
            )
        self.take_sound(page.key, page.sound.signal, heard)
        self._go_on()
