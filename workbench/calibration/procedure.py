"""A calibration without a screen: a state machine of pages, each with what it asks for and what it takes.

A `Procedure` stands on one `Page` at a time. A page says what to do and where, asks for values, and takes what a `Rig`
brings: readings under a press, or what an accelerometer recorded of a sound. The window shows the pages and a command
runs through them (`run`), on hardware or on the simulator: neither knows what is measured, and no procedure knows who
presses. Nothing is changed but by saving the `Result`.
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
from underfoot.parameters import Parameter

Answers = Mapping[str, Any]
"""What pages ask for, by name; each value is checked by its parameter."""


@dataclass(frozen=True)
class Page:
    """One step: `title`, the `instruction` in a sentence or two, and what it takes.

    `asks` are values to give (`Procedure.answer`), each with its default; `press` is what to press while readings come
    in; `sound` is what to play. A page with none of the three is only read, and answered with nothing. A page with
    `asks` and `press` wants its answer first (a known weight, typed in); once given, the same key comes again without
    `asks`. `places_m`, shape (n, 2) as tuples, are all the places of a series of presses, to be drawn on the tile.
    `may_skip` says that `Procedure.skip` leaves this page's measurement out. `share` is how much of the whole is done,
    0 to 1; `last` marks the page of the result.
    """

    key: str
    title: str
    instruction: str
    asks: tuple[Parameter, ...] = ()
    press: PressRequest | None = None
    sound: Sound | None = None
    places_m: tuple[tuple[float, float], ...] = ()
    may_skip: bool = False
    share: float = 0.0
    last: bool = False


@dataclass(frozen=True)
class Live:
    """What a page shows while readings come in: `hint` says what is missing, `ready` how much is there, 0 to 1."""

    hint: str = ""
    ready: float = 0.0
    quantities: tuple[tuple[str, float, str], ...] = ()
    """Name, value, unit: the live reading, how much of the range is covered, and so on."""


class Procedure(Protocol):
    """A state machine that says what it wants, takes it, and ends in a result."""

    @property
    def page(self) -> Page:
        """What is wanted now."""
        ...

    @property
    def live(self) -> Live:
        """How far the page's measurement is."""
        ...

    @property
    def drawings(self) -> tuple[Drawing, ...]:
        """What was taken so far."""
        ...

    @property
    def result(self) -> Result | None:
        """What came of it; None before the last page."""
        ...

    def answer(self, values: Answers) -> None:
        """Give what the page asks for and go on (to the page's press, where it has one).

        What is not among `values` has its default; `BadValue` or `BadMeasurement` leave everything as it was.
        """
        ...

    def feed(self, readings: Readings) -> None:
        """Take readings as they come; goes on by itself when the page has what it needs. May raise `BadMeasurement`."""
        ...

    def hear(self, recorded: NDArray[np.float64]) -> None:
        """Take what was recorded of the page's sound, from its first frame on; goes on. May raise `BadMeasurement`."""
        ...

    def skip(self) -> None:
        """Leave out what the page measures and go on; `BadValue` where the page does not allow it."""
        ...

    def back(self) -> None:
        """Return to the page before, and forget what was taken from there on; on the first page nothing happens."""
        ...


def ask(name: str, parameter: Parameter) -> Parameter:
    """A parameter that a page asks for under `name`; its label comes of the name where it has none.

    >>> from underfoot.parameters import Number
    >>> ask("load_n", Number(100.0, 1.0, 2000.0, unit="N")).label
    'Load n'
    """
    parameter.__set_name__(Page, name)
    return parameter


def step(procedure: Procedure, rig: Rig, values: Answers | None = None) -> bool:
    """Do what the page wants, once: answer it with `values` or its defaults, feed it what came in, or play its sound.

    Whether there was anything to do it with: False where no readings have come in since the last step.
    """
    page = procedure.page
    if page.press is not None and not page.asks:
        rig.press(page.press)
        readings = rig.read()
        procedure.feed(readings)
        return readings.time_s.size > 0
    if page.sound is not None:
        procedure.hear(rig.play(page.sound))
    elif not page.last:
        given = values or {}
        procedure.answer({ask.name: given.get(ask.name, ask.default) for ask in page.asks})
    return True


def run(
    procedure: Procedure,
    rig: Rig,
    values: Answers | None = None,
    seen: Callable[[Page], None] | None = None,
    skip_optional: bool = False,
) -> Result:
    """Run a procedure to its end; `values` answer the pages that ask, by name, and defaults the rest.

    `seen` is called with every page once. `skip_optional` leaves out what may be skipped. Raises what the procedure
    raises; it can then be run on from the page that it stands on.
    """
    shown = ""
    while procedure.result is None:
        if skip_optional and procedure.page.may_skip:
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
"""How long to leave the processor alone when a rig has nothing new."""
