"""Calibration procedures as state machines of pages, independent of any screen.

A `Procedure` is at one `Page` at a time. A page gives an instruction, asks for values, and takes data from a `Rig`:
readings under a press, or an accelerometer's recording of a sound. The window shows the pages and a command runs
through them (`run`), on hardware or on the simulator; neither knows what is measured, and no procedure knows who
presses. Nothing is changed except by saving the `Result`.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.result import Result
from underfoot.calibration.rig import PressRequest, Readings, Rig, Sound
from underfoot.drawing import Drawing
from underfoot.errors import DeviceError
from underfoot.parameters import Parameter

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


class Procedure(Protocol):
    """State machine that requests data, takes it, and ends with a result."""

    @property
    def page(self) -> Page:
        """Present page."""
        ...

    @property
    def progress(self) -> PageProgress:
        """Progress of the page's measurement."""
        ...

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """Drawings of the data so far."""
        ...

    @property
    def result(self) -> Result | None:
        """Result; None before the last page."""
        ...

    def without_conclusion(self, reason: str) -> Result | None:
        """Return the raw data so far, where `reason` keeps them from a result; None before there are any."""
        ...

    def answer(self, values: Answers) -> None:
        """Answer the page and go on (to the page's press, if it has one).

        Missing `values` have their defaults; `BadValue` or `BadMeasurement` leave everything unchanged.
        """
        ...

    def feed(self, readings: Readings) -> None:
        """Take readings as they arrive; goes on when the page has enough. May raise `BadMeasurement`."""
        ...

    def begin_again(self) -> None:
        """Discard what was read on this page."""
        ...

    def take_recording(self, recorded: NDArray[np.float64]) -> None:
        """Take the recording of the page's sound, from its first frame, and go on. May raise `BadMeasurement`."""
        ...

    def skip(self) -> None:
        """Skip the page's measurement and go on; `BadValue` if the page does not allow it."""
        ...

    def back(self) -> None:
        """Return to the previous page and discard the data taken since; no effect on the first page."""
        ...


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


_PAUSE_S = 0.005
"""Pause when a rig has no new data."""
