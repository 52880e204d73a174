"""A wizard without a screen: what it wants next, what it has taken, and what came of it.

A `Procedure` stands on one `Page` at a time. A page says what to do and where, asks for values, and takes what a
`Bench` brings: readings under a press, or what an accelerometer heard of a sound played. The window shows the pages and
a command runs through them (`run`), on a tile or on the simulator: neither knows what is measured, and no procedure
knows who presses. Nothing is changed but by saving the `Result`.
"""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing
from underfoot.errors import UnderfootError
from underfoot.floor.profile import Profile
from underfoot.parameters import Parameter


class Refused(UnderfootError):
    """A measurement that cannot be right: the reason, in one line. The page is as it was; it can be taken again."""


@dataclass(frozen=True)
class Press:
    """Where and how hard to press: `at_m` in the tile's frame, newtons; 0 N is to stand clear.

    `sensor` (0 to 3) is set where the load goes over one sensor. `hold_s` is how long the load is to rest.
    """

    at_m: tuple[float, float]
    force_n: float
    hold_s: float = 0.5
    sensor: int | None = None


@dataclass(frozen=True)
class Sound:
    """What to play through the shaker: full scale, shape (frames,), with the load that stands on the tile."""

    signal: NDArray[np.float64]
    rate_hz: int
    load: str


@dataclass(frozen=True)
class Page:
    """One step: `title`, what to `do` in a sentence or two, and what it takes.

    `asks` are values to give (`Procedure.answer`), each with its default; `press` is what to press while readings come
    in; `sound` is what to play. A page with none of the three is only read, and answered with nothing. A page with
    `asks` and `press` wants its answer first (a known weight, typed in); once given, the same key comes again without
    `asks`. `places_m`, shape (n, 2) as tuples, are all the places of a series of presses, to be drawn on the tile.
    `may_skip` says that `Procedure.skip` leaves this page's measurement out. `share` is how much of the whole is done,
    0 to 1; `last` marks the page of the result.
    """

    key: str
    title: str
    do: str
    asks: tuple[Parameter, ...] = ()
    press: Press | None = None
    sound: Sound | None = None
    places_m: tuple[tuple[float, float], ...] = ()
    may_skip: bool = False
    share: float = 0.0
    last: bool = False


@dataclass(frozen=True)
class Readings:
    """What came in: `time_s` (n,), `values` (n, 4) in the sensors' units, and `force_n` (n,) of the reference or None.

    n may be 0. Lost samples are left out: `time_s` jumps.
    """

    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    force_n: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Live:
    """What a page shows while readings come in: `hint` says what is missing, `ready` how much is there, 0 to 1."""

    hint: str = ""
    ready: float = 0.0
    quantities: tuple[tuple[str, float, str], ...] = ()
    """Name, value, unit: the live reading, how much of the range is covered, and so on."""


@dataclass(frozen=True)
class Result:
    """What came of it: `quantities` (name, value, unit), a `verdict` in plain words, drawings, and the raw data.

    `good` says whether the verdict allows it to be used. `raw` are tables: name, the header of a CSV, and its rows
    (numbers; a column `tile` of the header is not among them). `before` and `after` of a correction are among the
    quantities and drawings.
    """

    kind: str
    title: str
    quantities: tuple[tuple[str, float, str], ...]
    verdict: str
    good: bool
    warnings: tuple[str, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    raw: tuple[tuple[str, str, NDArray[np.float64]], ...] = ()
    apply: Callable[[Profile], Profile] = field(default=lambda profile: profile, repr=False)
    """The profile with this result in it; what it had before is kept in its history."""

    @property
    def figures(self) -> dict[str, float]:
        """The quantities by name."""
        return {name: value for name, value, _ in self.quantities}


class Procedure(Protocol):
    """A state machine that says what it wants, takes it, and ends in a result."""

    kind: str
    title: str

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

    def answer(self, values: Mapping[str, Any]) -> None:
        """Give what the page asks for and go on (to the page's press, where it has one).

        What is not among `values` has its default; `BadValue` or `Refused` leave everything as it was.
        """
        ...

    def feed(self, readings: Readings) -> None:
        """Take readings as they come; goes on by itself when the page has what it needs. May raise `Refused`."""
        ...

    def hear(self, recorded: NDArray[np.float64]) -> None:
        """Take what was recorded of the page's sound, from its first frame on; goes on. May raise `Refused`."""
        ...

    def skip(self) -> None:
        """Leave out what the page measures and go on; `BadValue` where the page does not allow it."""
        ...

    def back(self) -> None:
        """Return to the page before, and forget what was taken from there on; on the first page nothing happens."""
        ...


class Bench(Protocol):
    """The tile that is measured, and whoever presses it: the simulator, or hardware and a person."""

    def press(self, press: Press | None) -> None:
        """What the page asks for. A simulator does it; on hardware a person reads the page."""
        ...

    def read(self) -> Readings:
        """What came in since the last call; never waits."""
        ...

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play through the shaker, past the limiter; the accelerometer's signal, from the sound's first frame on."""
        ...

    def close(self) -> None:
        """Let the tile go."""
        ...


def ask(name: str, parameter: Parameter) -> Parameter:
    """A parameter that a page asks for under `name`; its label comes of the name where it has none.

    >>> from underfoot.parameters import Number
    >>> ask("load_n", Number(100.0, 1.0, 2000.0, unit="N")).label
    'Load n'
    """
    parameter.__set_name__(Page, name)
    return parameter


def step(procedure: Procedure, bench: Bench, values: Mapping[str, Any] | None = None) -> bool:
    """Do what the page wants, once: answer it with `values` or its defaults, feed it what came in, or play its sound.

    Whether there was anything to do it with: False where no readings have come in since the last step.
    """
    page = procedure.page
    if page.press is not None and not page.asks:
        bench.press(page.press)
        readings = bench.read()
        procedure.feed(readings)
        return readings.time_s.size > 0
    if page.sound is not None:
        procedure.hear(bench.play(page.sound))
    elif not page.last:
        given = values or {}
        procedure.answer({ask.name: given.get(ask.name, ask.default) for ask in page.asks})
    return True


def run(
    procedure: Procedure,
    bench: Bench,
    values: Mapping[str, Any] | None = None,
    seen: Callable[[Page], None] | None = None,
) -> Result:
    """Run a procedure to its end; `values` answer the pages that ask, by name, and defaults the rest.

    `seen` is called with every page once. Raises what the procedure refuses.
    """
    shown = ""
    while procedure.result is None:
        if procedure.page.key != shown:
            shown = procedure.page.key
            if seen is not None:
                seen(procedure.page)
        if not step(procedure, bench, values):
            time.sleep(_PAUSE_S)
    return procedure.result


_PAUSE_S = 0.005
"""How long to leave the processor alone when a link has nothing new."""
