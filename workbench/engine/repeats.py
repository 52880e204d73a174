"""Repeated starts of a session's patch, each at a frame fixed in advance."""

from collections.abc import Callable

from underfoot.clock import SPAN
from underfoot.engine.commands import CancelStart, Command, Start
from underfoot.engine.reports import CommandApplied

LEAD_S = 0.3
"""Lead in seconds with which a start is sent, so that the engine can build the program in time."""
SHORTEST_S = 0.1
"""Shortest time in seconds between starts."""


class Repeats:
    """Starts at whole periods of the engine's frame clock, independent of the window's timing.

    After a start that is late because its patch had to be compiled, the next one is on time again. `start` is given
    tile and frame, 0 for now, and returns whether the patch can be started; `send` sends the engine a command.
    """

    def __init__(self, start: Callable[[str, int], bool], send: Callable[[Command], None], rate_hz: float) -> None:
        self._start, self._send, self._rate_hz = start, send, rate_hz
        self._tile = ""
        self._period = 0
        self._origin: int | None = None  # frame of the start from which periods are counted
        self._has_begun = False
        self._sent_for = -1

    @property
    def are_on(self) -> bool:
        """Whether repeats are on."""
        return bool(self._tile)

    def begin(self, tile: str, period_s: float) -> None:
        """Start on a tile now, and every period from then on; any other start restarts the period."""
        self._tile, self._origin = tile, None
        self.set_period(period_s)
        self._has_begun = self._start(tile, 0)

    def set_period(self, period_s: float) -> None:
        """Set the seconds between starts, rounded to spans; takes effect with the next start."""
        self._period = round(max(period_s, SHORTEST_S) * self._rate_hz / SPAN) * SPAN

    def end(self) -> None:
        """Stop repeating; a start already sent is cancelled."""
        if self.are_on:
            self._tile = ""
            self._send(CancelStart())

    def resend(self) -> None:
        """Send the next start again, because the patch of the one that was sent has been replaced."""
        self._sent_for = -1

    def take_report(self, message: object) -> None:
        """Note from a report when a start took place."""
        match message:
            case CommandApplied(frame, Start(from_frame=from_frame)):
                # Count a late start as if it had been on time.
                self._origin = from_frame or frame

    def poll(self, now: int) -> None:
        """Send the next start if it is due soon; the engine is at frame `now`."""
        origin = self._origin
        if not self._has_begun and self.are_on:
            self._has_begun = self._start(self._tile, 0)
        if origin is None or not self.are_on:
            return
        due = origin + self._period * max((now - origin) // self._period + 1, 1)
        if due != self._sent_for and due - now <= LEAD_S * self._rate_hz and self._start(self._tile, due):
            self._sent_for = due
