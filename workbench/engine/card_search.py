"""Search for sound cards in separate processes: PortAudio lists devices once while a stream is open, and takes as long
as its slowest server; what it does not give back, it gives back as the process ends.
"""

import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from underfoot.devices.sound import Card, devices, drop_library_messages, listed_name
from underfoot.engine.child_process import ChildProcess

RETRY_S = 2.0
"""Time in seconds until a missing card is looked for, and the least time between two looks."""
_LOOK_S, _MOST_S = 0.02, 20.0
"""Time between two questions whether a look is over, and the longest that it may take."""
_MOST_RETRY_S = 30.0  # each look takes the processor for some tenths of a second


def run(connection: Connection, look: Callable[..., object], *given: object) -> None:
    """Send what `look(*given)` returns; the main function of the process."""
    drop_library_messages()
    connection.send(look(*given))


class CardSearch:
    """Lists the present sound cards, including ones plugged in since the program started; playback continues."""

    def __init__(self) -> None:
        self._is_given_up = False

    def find(self) -> list[Card]:
        """Wait for the list; empty if the search takes too long or another thread gave it up."""
        look = _Look(devices)
        while not (look.poll() or self._is_given_up):
            time.sleep(_LOOK_S)
        look.end()
        return look.found or []

    def give_up(self) -> None:
        """Make `find` return at once."""
        self._is_given_up = True


class CardWatch:
    """Looks for sound cards while some are missing, at first soon, then ever more rarely."""

    def __init__(self) -> None:
        self._look: _Look | None = None
        self._due_s, self._retry_s = 0.0, 0.0

    @property
    def pid(self) -> int | None:
        """Number of the process that looks, while one does."""
        return self._look.pid if self._look is not None else None

    def poll(self, names: tuple[str, ...]) -> dict[str, str] | None:
        """Look for these cards, none if nothing is missing; return the full names of those that are there, by name,
        after each look. Does not wait.
        """
        now_s = time.perf_counter()
        if not names:
            self.close()
            self._retry_s = 0.0
        elif self._retry_s == 0.0:
            self._put_off(RETRY_S)
        elif self._look is None and now_s >= self._due_s:
            self._look = _Look(_there, names)
        if self._look is None or not self._look.poll():
            return None
        found: dict[str, str] | None = self._look.found
        self.close()
        self._put_off(min(2.0 * self._retry_s, _MOST_RETRY_S))
        return found

    def close(self) -> None:
        """End a look."""
        if self._look is not None:
            self._look.end()
            self._look = None

    def _put_off(self, seconds: float) -> None:
        self._due_s, self._retry_s = time.perf_counter() + seconds, seconds


class _Look:
    """A process that looks once."""

    def __init__(self, look: Callable[..., object], *given: object) -> None:
        self._process = ChildProcess("card search", __name__, look, *given)
        self._end_s = time.perf_counter() + _MOST_S
        self.found: Any = None
        """What it found; None until then, and where it found out nothing."""

    @property
    def pid(self) -> int:
        return self._process.pid

    def poll(self) -> bool:
        """Return whether it is over."""
        is_over = not self._process.is_alive or time.perf_counter() > self._end_s  # first: what it sent is there then
        if found := self._process.receive():
            self.found = found[0]
        return is_over or bool(found)

    def end(self) -> None:
        self._process.kill()
        self._process.end(0.0)


def _there(names: tuple[str, ...]) -> dict[str, str]:
    return {name: full for name in names if (full := listed_name(name))}
