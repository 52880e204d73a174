"""What all wizards with presses have in common: steps one after another, what each has taken, and the way back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.procedures.procedure import Live, Page, Readings, Refused, Result
from underfoot.drawing import Drawing
from underfoot.errors import BadValue

PATIENCE_S = 120.0
"""A page whose readings bring nothing for this long is given up."""
EMPTY = Readings(np.empty(0), np.empty((0, 4)), None)


@dataclass(frozen=True)
class Step:
    """One page and how it takes its measurement.

    `take` looks at all readings since the page was opened; it returns what is still missing, or None when there is
    enough. It raises `Refused`.
    """

    page: Page
    take: Callable[[Readings], Live | None] | None = None
    tags: Mapping[str, Any] = field(default_factory=dict)


class Wizard:
    """Goes through steps. A subclass gives the first one, plans the rest from its answers, and makes the result."""

    kind = ""
    title = ""

    def __init__(self, first: Page) -> None:
        self._steps: list[Step] = [Step(first)]
        self._at = 0
        self._taken: dict[int, Readings] = {}
        self._skipped: set[int] = set()
        self._answers: dict[int, dict[str, Any]] = {}
        self._incoming = EMPTY
        self._live = Live()
        self._result: Result | None = None

    def plan(self, answers: dict[str, Any]) -> list[Step]:
        """The steps after the first page, whose checked answers these are; `Refused` where they make no sense."""
        raise AssertionError(f"{type(self).__name__} has no plan")

    def concluded(self) -> Result:
        """The result of all that was taken; `Refused` where nothing can come of it."""
        raise AssertionError(f"{type(self).__name__} comes to no conclusion")

    def accepted(self, answers: dict[str, Any]) -> None:
        """Look at the answers of a later page before they count; `Refused` where they cannot be right."""

    @property
    def page(self) -> Page:
        step = self._steps[self._at]
        asks = () if self._at in self._answers and step.take is not None else step.page.asks
        share = 1.0 if step.page.last else self._at / max(len(self._steps) - 1, 12)
        return replace(step.page, asks=asks, share=share)

    @property
    def live(self) -> Live:
        return self._live

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        return ()

    @property
    def result(self) -> Result | None:
        return self._result if self._steps[self._at].page.last else None

    def answer(self, values: Mapping[str, Any]) -> None:
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
            planned = self.plan(checked)
            self._steps = [
                self._steps[0],
                *planned,
                Step(Page("result", "Result", "Look at it, and save it.", last=True)),
            ]
        else:
            self.accepted(checked)
        self._answers[self._at] = checked
        if self._steps[self._at].take is None:
            self._go_on()

    def feed(self, readings: Readings) -> None:
        step = self._steps[self._at]
        if step.take is None or self.page.asks or readings.time_s.size == 0:
            return
        self._incoming = joined(self._incoming, readings)
        try:
            live = step.take(self._incoming)
            if live is not None and np.ptp(self._incoming.time_s) > PATIENCE_S:
                raise Refused(f"{step.page.title}: nothing came of {PATIENCE_S:.0f} s; {live.hint}")
            if live is not None:
                self._live = live
                return
            self._taken[self._at] = self._incoming
            self._go_on()
        except Refused:
            self._taken.pop(self._at, None)
            self._answers.pop(self._at, None)
            self._incoming, self._live = EMPTY, Live()
            raise

    def hear(self, recorded: NDArray[np.float64]) -> None:
        raise BadValue(f"{self.title} listens to no sound")

    def skip(self) -> None:
        """Leave out this page and those of the same sensor or place."""
        step = self._steps[self._at]
        if not step.page.may_skip:
            raise BadValue(f"{step.page.title} cannot be skipped")
        group = step.tags.get("group")
        for k in [k for k in self._taken if self._steps[k].tags.get("group") == group]:
            del self._taken[k]
        while self._steps[self._at].tags.get("group") == group:
            self._skipped.add(self._at)
            self._taken.pop(self._at, None)
            self._open(self._at + 1)
        self._conclude_if_last()

    def back(self) -> None:
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

    def taken(self) -> list[tuple[Step, Readings, dict[str, Any]]]:
        """What was taken so far, in order: the step, its readings and its answers."""
        return [(self._steps[k], self._taken[k], self._answers.get(k, {})) for k in sorted(self._taken)]

    def _open(self, at: int) -> None:
        self._at, self._incoming, self._live = at, EMPTY, Live()

    def _go_on(self) -> None:
        self._open(self._at + 1)
        self._conclude_if_last()

    def _conclude_if_last(self) -> None:
        if not self._steps[self._at].page.last:
            return
        try:
            self._result = self.concluded()
        except Refused:
            self._open(self._at - 1)
            raise


def joined(before: Readings, after: Readings) -> Readings:
    """Readings one after the other; a reference that one of them lacks is lacking."""
    if before.time_s.size == 0:
        return after
    force = None
    if before.force_n is not None and after.force_n is not None:
        force = np.concatenate([before.force_n, after.force_n])
    return Readings(np.concatenate([before.time_s, after.time_s]), np.concatenate([before.values, after.values]), force)


def last(readings: Readings, seconds: float) -> Readings | None:
    """The last `seconds` of readings, or None where there are not so many."""
    start = readings.time_s[-1] - seconds
    if readings.time_s[0] > start:
        return None
    k = int(np.searchsorted(readings.time_s, start))
    force = None if readings.force_n is None else readings.force_n[k:]
    return Readings(readings.time_s[k:], readings.values[k:], force)
