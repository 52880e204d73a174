"""Calibration procedures as state machines of pages, independent of any screen.

A `Procedure` is at one `Page` at a time. A page gives an instruction, asks for values, and takes data from a `Rig`:
readings under a press, or an accelerometer's recording of a sound. The window shows the pages and a command runs
through them (`run`), on hardware or on the simulator; neither knows what is measured, and no procedure knows who
presses. Nothing is changed except by saving the `Result`.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from underfoot.calibration.result import Inconclusive, Result
from underfoot.calibration.rig import NO_READINGS, PressRequest, Readings, Rig, Sound
from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement, BadValue, DeviceError
from underfoot.kernels import Floats
from underfoot.parameters import Parameter

TIMEOUT_S = 120.0
"""Seconds of readings after which an incomplete page is given up."""
LONGEST_GAP_S = 0.5
"""Seconds without a reading after which a page begins again: what happened meanwhile is not known."""
EMPTY_TILE = "Take everything off the tile and stand clear."
"""What a tare asks for."""
_PAUSE_S = 0.005
"""Pause when a rig has no new data."""
_LEAST_PAGES = 12
"""Smallest number of pages for the progress display, as the number is unknown before the first answer."""
Answers = Mapping[str, Any]
"""Answers to pages, by name; each value is checked by its parameter, and None is its default."""


@dataclass(frozen=True)
class Page:
    """One page: `title`, the `instruction` in a sentence or two, and what it takes.

    `questions` are values to give (`Procedure.answer`), each with its default; `press` is what to press while readings
    arrive; `sound` is what to play. A page with none of the three is only read, and answered with nothing. A page with
    `questions` and `press` needs its answer first (a known weight, typed in); then the same key comes again without
    `questions`. `places_m`, shape (n, 2) as tuples, are all positions of a series of presses, to be drawn on the tile.
    `may_skip` allows `Procedure.skip`. `share` is the progress of the whole, 0 to 1; `last` marks the page of the
    result.
    """

    key: str
    title: str
    instruction: str
    questions: tuple[Parameter, ...] = ()
    press: PressRequest | None = None
    sound: Sound | None = None
    places_m: tuple[tuple[float, float], ...] = ()
    may_skip: bool = False
    share: float = 0.0
    last: bool = False

    @property
    def wants_press(self) -> bool:
        """Whether it takes readings of its press now."""
        return self.press is not None and not self.questions


@dataclass(frozen=True)
class PageProgress:
    """Live state of a page: `hint` tells the user what is missing, `ready` is the progress, 0 to 1."""

    hint: str = ""
    ready: float = 0.0
    quantities: tuple[tuple[str, float, str], ...] = ()
    """Name, value, unit: e.g. the live reading, and the covered part of the range."""


@dataclass(frozen=True)
class Step:
    """Page with the way it takes its measurement.

    `take` examines all readings since the page was opened; it returns what is still missing, or None when there is
    enough. `hear` evaluates the recording of the page's sound, beside what was played, both (frames,) in full scale.
    Both raise `BadMeasurement`. Steps of one `group`, a sensor or a position, are skipped together. A step that
    `lets_go` of the load of the one before is measured again only with that one. One that `needs_all` is passed over
    where any other was skipped.
    """

    page: Page
    take: Callable[[Readings], PageProgress | None] | None = None
    group: int | str | None = None
    hear: Callable[[Floats, Floats], None] | None = field(default=None, kw_only=True)
    lets_go: bool = field(default=False, kw_only=True)
    needs_all: bool = field(default=False, kw_only=True)


class StepData(NamedTuple):
    """Data taken by one step: its readings, and the answers to its page."""

    step: Step
    readings: Readings
    answers: Answers


class Procedure(ABC):
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

    @abstractmethod
    def plan(self, answers: Answers) -> list[Step]:
        """Return the steps after the first page from its checked answers; `BadMeasurement` if they are inconsistent."""

    @abstractmethod
    def conclude(self) -> Result:
        """Return the result of all data taken; `BadMeasurement` or `BadValue` if there is none."""

    def check_answers(self, step: Step, answers: Answers) -> None:  # noqa: B027 - most procedures have nothing to check
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
        if page.sound is not None:
            raise BadValue(f"{page.title}: this page takes a recording, not an answer")
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

    def take_recording(self, recorded: Floats) -> None:
        """Take the recording of the page's sound, (frames,), in full scale, and go on."""
        page, hear = self.page, self._steps[self._at].hear
        if page.sound is None or hear is None:
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
        hear(page.sound.signal, recording)
        self._go_on()

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


def step(procedure: Procedure, rig: Rig, values: Answers | None = None) -> bool:
    """Do one step of the page: answer it with `values` or defaults, feed it new readings, or play its sound.

    Returns False if no readings have arrived since the last step. Where none come any more (`DeviceError`), the page
    begins again: they would have a gap.
    """
    page = procedure.page
    if page.wants_press:
        rig.press(page.press)
        try:
            readings = rig.read()
        except DeviceError:
            procedure.begin_again()
            raise
        procedure.feed(readings)
        return readings.time_s.size > 0
    if page.sound is not None:
        procedure.take_recording(rig.play(page.sound))
    elif not page.last:
        given = values or {}
        procedure.answer({ask.name: given.get(ask.name, ask.default) for ask in page.questions})
    return True


def run(
    procedure: Procedure,
    rig: Rig,
    values: Answers | None = None,
    seen: Callable[[Page], None] | None = None,
    skips: Callable[[Page], bool] = lambda page: False,
) -> Result:
    """Run a procedure to its end; `values` answer the pages by name, defaults the rest.

    `seen` is called with every page once. Optional pages of which `skips` is true are left out. Exceptions of the
    procedure pass through; it can then be continued from its present page.
    """
    shown = ""
    while procedure.result is None:
        if procedure.page.may_skip and skips(procedure.page):
            procedure.skip()
            continue
        if procedure.page.key != shown:
            shown = procedure.page.key
            if seen is not None:
                seen(procedure.page)
        if not step(procedure, rig, values):
            time.sleep(_PAUSE_S)
    return procedure.result
