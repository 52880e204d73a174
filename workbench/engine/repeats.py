"""Again and again: a session's patch from its start, each time at a frame that is known beforehand."""

from typing import Protocol

from underfoot.clock import SPAN
from underfoot.engine.commands import CancelStart, Command, Start
from underfoot.engine.reports import CommandApplied

LEAD_S = 0.3
"""How long before its frame a start is sent to the engine, which builds the program meanwhile."""
SHORTEST_S = 0.1


class Starts(Protocol):
    """What of a session starts are sent through."""

    def restart(self, tile: str, from_frame: int = 0) -> bool:
        """Play the patch from its start; whether it can, now."""
        ...

    def send(self, command: Command) -> None:
        """Send a command to the engine."""
        ...


class Repeats:
    """Starts that follow one another in whole periods of the engine's frame clock, whatever the window does.

    A start that is late, because its patch had to be compiled, is followed by one that is in time again.
    """

    def __init__(self, session: Starts, rate_hz: float) -> None:
        self._session, self._rate_hz = session, rate_hz
        self._tile = ""
        self._period = 0
        self._origin: int | None = None  # the frame of a start from which periods are counted
        self._has_begun = False
        self._asked = -1

    @property
    def are_on(self) -> bool:
        """Whether it plays again and again."""
        return bool(self._tile)

    def begin(self, tile: str, period_s: float) -> None:
        """Start on a tile now, and in every period from then on; a period that goes on with a start begins with it."""
        self._tile, self._origin = tile, None
        self.set_period(period_s)
        self._has_begun = self._session.restart(tile)

    def set_period(self, period_s: float) -> None:
        """Seconds from start to start, to the next span of frames: from the next start on."""
        self._period = round(max(period_s, SHORTEST_S) * self._rate_hz / SPAN) * SPAN

    def end(self) -> None:
        """No more; one that was sent already does not begin."""
        if self.are_on:
            self._tile = ""
            self._session.send(CancelStart())

    def ask_again(self) -> None:
        """The start that was sent is of a patch that plays no more."""
        self._asked = -1

    def hear(self, message: object) -> None:
        """Learn from a report when a start took place."""
        match message:
            case CommandApplied(frame, Start(from_frame=asked)):
                # One that was late counts as if it had been in time.
                self._origin = asked or frame

    def poll(self, now: int) -> None:
        """Send the next start, where it is near; the engine is at frame `now`."""
        origin = self._origin
        if not self._has_begun and self.are_on:
            self._has_begun = self._session.restart(self._tile)
        if origin is None or not self.are_on:
            return
        due = origin + self._period * max((now - origin) // self._period + 1, 1)
        if due != self._asked and due - now <= LEAD_S * self._rate_hz and self._session.restart(self._tile, due):
            self._asked = due
