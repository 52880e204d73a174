"""A thread that reads a transport, parses samples, and reopens the transport when it is gone."""

import math
import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Collection
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.unread import why_unread
from underfoot.devices.recurrence import LAST, Recurrence
from underfoot.devices.transport import Transport, asked
from underfoot.errors import DeviceError, TakenAway

RETRY_S, MOST_RETRY_S = 0.1, 1.0
"""Seconds until a transport that is gone is opened again: at first, for a loose plug, and at most, for one that stays
away."""
MOST_WAIT_S, HELD_S = 30.0, 10.0
"""Most seconds until a hub is taken again that another program had first, and how long one has a hub to be the first:
otherwise the two would take it from each other, each time for a moment, without end."""
SILENT_S = 0.5
"""Seconds without data after which a transport is reported as silent."""
_BATCH_S = 0.0005  # data of this time is read at once: a thread that wakes for every byte delays all others
_MANY_BYTES, _EXAMINED_BYTES = 512, 4096
_MOST_TAKEN = 10  # as often in a row a hub is taken from who had it first, until the other one is the first
_ALIKE = 3  # connections of the same length in a row, which a hub ends by itself: who takes it away waits ever longer
_NO_FRAME = "but no frame"
_OTHER_FIRST = f"it is tried ever more rarely, down to every {MOST_WAIT_S:g} s: end the other program, or this one"


def retry_s(failures: int, *, is_second: bool = False) -> float:
    """Return the time until the next attempt to open a transport, where as many in a row have failed.

    >>> [retry_s(failures) for failures in (1, 2, 3, 4, 5, 1_000_000)]
    [0.1, 0.2, 0.4, 0.8, 1.0, 1.0]
    >>> [retry_s(failures, is_second=True) for failures in (1, 5, 9, 1_000_000)]
    [0.1, 1.6, 25.6, 30.0]
    """
    return float(min(RETRY_S * 2.0 ** min(failures - 1, 10), MOST_WAIT_S if is_second else MOST_RETRY_S))


def _are_alike(lives_s: Collection[float]) -> bool:
    """Return whether the latest connections lasted equally long, and for more than a moment."""
    return len(lives_s) == _ALIKE and MOST_RETRY_S < max(lives_s) < 1.2 * min(lives_s)


class TransportReader:
    """Reads `transport` in a thread of its own from `start` to `close`, and reopens it after failures.

    `on_samples` is called in that thread with the samples, as from `Parser.feed`, valid until it returns, and their
    arrival time by `time.perf_counter`. `notices` are lines for the user; `trouble` is the one that holds now, "" while
    frames come; `parser` tells of the frames so far.
    """

    def __init__(self, transport: Transport, on_samples: Callable[[NDArray[np.void], float], None]) -> None:
        self.transport = transport
        self.notices: deque[str] = deque(maxlen=100)
        self.trouble = ""
        self.parser = Parser()
        self.parser.feed(b"")  # loads the kernel in advance
        self._on_samples = on_samples
        self._silence, self._rubbish, self._losses = Recurrence(), Recurrence(), Recurrence()
        self._port_losses = defaultdict[str, Recurrence](Recurrence)  # by line: one plug may be loose
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reads {transport.name}", daemon=True)
        self.is_open = self._is_missed = self._is_loss_told = False

    def start(self) -> None:
        """Start reading; returns at once, also without a device."""
        self._thread.start()

    def close(self) -> None:
        """Stop reading, and close the transport."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def take_notices(self) -> list[str]:
        """Return the notices since the last call, one line each."""
        taken = []
        while self.notices:
            taken.append(self.notices.popleft())
        return taken

    def foreign_sender_line(self, tile: int) -> str:
        """Return a line if a tile's frames also come from an address that it does not belong to."""
        if not self.parser.is_contested(tile):
            return ""
        own, other = (self.transport.sender_name(number) for number in self.parser.senders_of(tile))
        return f"frames of tile {tile} come from {other} too, and are left out: the tile belongs to {own}"

    def _run(self) -> None:
        failures, opened_s, is_first, lives_s = 0, -math.inf, False, deque[float](maxlen=_ALIKE)
        while not self._stop.is_set():
            is_taken = False
            try:
                asked(self.transport, self.transport.open)
                opened_s = time.perf_counter()
                self.parser.resync()
                asked(self.transport, self._read)
            except DeviceError as error:
                lasted_s = 0.0 if self._is_missed else time.perf_counter() - opened_s
                lives_s.append(lasted_s)
                is_ended = isinstance(error, TakenAway) and _are_alike(lives_s)
                is_taken = isinstance(error, TakenAway) and not is_ended
                if lasted_s > (HELD_S if is_taken else MOST_RETRY_S):  # not of a hub that sends each client away
                    failures = 0
                is_first = lasted_s > HELD_S or (is_first and failures < _MOST_TAKEN)
                if not self._is_missed:
                    is_told = is_taken and not is_first and failures
                    why = f"{error}, or each is after {lasted_s:.1f} s" if is_ended else error
                    self._tell_loss(f"{why}; {_OTHER_FIRST if is_told else 'waiting for it'}")
                self._is_missed = True
                failures += 1
            self.is_open = False
            with suppress(DeviceError):
                asked(self.transport, self.transport.close)
            attempts = 1 if is_taken and is_first else failures  # who had it first takes it back at once
            self._stop.wait(retry_s(attempts, is_second=is_taken and not is_first))

    def _read(self) -> None:
        """Read until told to stop; `DeviceError` when the transport is gone."""
        heard_s, unread, first, is_told = time.perf_counter() + self.transport.boot_s, 0, b"", False
        valid = self.parser.counts.valid
        while not self._stop.is_set():
            data, now_s = self.transport.read(), time.perf_counter()
            samples = self.parser.feed(data, self.transport.senders, now_s)
            for line in self.transport.lost:
                self._say(self._port_losses[line], line, now_s)
            if self._is_missed:  # what opens, but cannot be read, is not back
                if self._is_loss_told:
                    self.notices.append(f"{self.transport.name} is back")
                self._is_missed, self.trouble = False, ""
            self.is_open = True
            before, valid = valid, self.parser.counts.valid
            if valid > before:
                if is_told:
                    self.notices.append(f"{self.transport.name} sends again")
                heard_s, unread, first, is_told, self.trouble = now_s, 0, b"", False, ""
                self._on_samples(samples, now_s)
            else:
                unread += len(data)
                first += bytes(data[: _EXAMINED_BYTES - len(first)])
            is_news = not is_told or (unread >= _MANY_BYTES and _NO_FRAME not in self.trouble)
            if now_s - heard_s > SILENT_S and is_news:
                is_told |= self._tell_silence(now_s, unread, first)
            self._stop.wait(_BATCH_S)  # after nothing, too: a plug-in's `read` may return it at once

    def _tell_loss(self, line: str) -> None:
        """Tell that the transport is gone, not each time: two programs that take a hub from each other never end."""
        self.trouble = line
        self._is_loss_told = self._say(self._losses, line, time.perf_counter())

    def _tell_silence(self, now_s: float, unread: int, first: bytes) -> bool:
        """Tell that no frame comes, of `unread` bytes that begin with `first`; return whether that was said.

        The silence of boards that sleep, and what a loose wire damages, is not said each time, but is trouble while it
        lasts.
        """
        is_rubbish = unread >= _MANY_BYTES
        recurrence = self._rubbish if is_rubbish else self._silence
        if not is_rubbish:
            self.trouble = f"{self.transport.name}: nothing comes"
        elif _NO_FRAME not in self.trouble:
            why = why_unread(first, self.transport.doubt)
            self.trouble = f"{self.transport.name}: {unread} bytes came, {_NO_FRAME}: {why}"
        return self._say(recurrence, self.trouble, now_s)

    def _say(self, recurrence: Recurrence, line: str, now_s: float) -> bool:
        """Say a line, unless its like was said often enough; return whether it was said."""
        is_said = recurrence.says(now_s)
        if is_said:
            self.notices.append(line + (f"; {LAST}" if recurrence.is_last else ""))
        return is_said
