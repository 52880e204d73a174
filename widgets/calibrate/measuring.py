"""Runs a procedure on a rig in a separate thread; the window receives snapshots."""

import queue
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from underfoot.calibration.procedure import Page, PageProgress, Procedure, step
from underfoot.calibration.result import Inconclusive, Result
from underfoot.calibration.rig import STOPPED, PressRequest, Readings, Rig, Sound
from underfoot.drawing import Drawing
from underfoot.errors import BadMeasurement, DeviceError, UnderfootError

MakeProcedure = Callable[[], tuple[Procedure, Rig]]

_SNAPSHOT_S, _DRAW_S = 0.033, 0.25
"""Intervals in seconds between snapshots, and between those with new drawings."""
_IDLE_READ_S, _NO_READINGS_S = 0.02, 0.005
_MAX_PAUSE_S = 0.25


@dataclass(frozen=True)
class Pace:
    """Speed of an automatic run on the simulator: a page is shown for at least `page_s`, and one second takes `speed`
    seconds of simulated time; 0 for as fast as possible.
    """

    page_s: float = 0.25
    speed: float = 20.0


_UNFINISHED = "the calibration was not finished"


@dataclass(frozen=True)
class Snapshot:
    """State of a procedure. `is_waiting` is true while it waits for the user; `is_automatic` while it runs without.
    `rejection` is the reason for which the page's measurement was rejected, in one line; `inconclusive` has the raw
    data so far, then, and on each page of a measurement by hand.
    """

    page: Page
    live: PageProgress
    drawings: tuple[Drawing, ...]
    result: Result | None
    is_waiting: bool = True
    is_automatic: bool = False
    rejection: str = ""
    inconclusive: Result | None = None


class Measurement(QObject):
    """Creates a procedure and its rig, and runs them until `stop`, without blocking.

    On a simulator a page's press or sound begins on request, or automatically. `by_hand` is for hardware: readings are
    then taken as long as a page wants a press, because a person decides when to press.
    """

    changed = Signal()
    """There is a new `snapshot`."""
    failed = Signal(str)
    """The measurement cannot begin or continue; carries the reason in one line."""
    ended = Signal()
    """The rig is released; the last signal."""

    def __init__(self, make: MakeProcedure, *, by_hand: bool, pace: Pace, parent: QObject) -> None:
        super().__init__(parent)
        self.by_hand = by_hand
        self.snapshot: Snapshot | None = None
        self._make, self._pace = make, pace
        self._worker: _Worker | None = None
        self._orders: queue.SimpleQueue[_Order] = queue.SimpleQueue()
        self._is_acknowledged = threading.Event()
        self._is_acknowledged.set()
        self._began_s = time.perf_counter()
        self._thread = threading.Thread(target=self._run, name="calibrate")

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def proceed(self, values: Mapping[str, Any]) -> None:
        """Do what Continue means on the page of `snapshot`: submit the answer, begin the press, play the sound."""
        page = self.snapshot.page if self.snapshot is not None else None
        self._allow_sound()
        self._orders.put(lambda worker: worker.proceed(values, page))

    def run_automatically(self, on: bool, values: Mapping[str, Any] | None = None) -> None:
        """Run automatically on a simulator, with `values` as the answer to the present page; or pause."""
        if on:
            self._allow_sound()
        self._orders.put(lambda worker: worker.set_automatic(on, values or {}))

    def skip(self) -> None:
        """Skip the measurement of the page; its sound stops."""
        self._silence_rig()
        self._orders.put(lambda worker: worker.change_page(worker.procedure.skip))

    def back(self) -> None:
        """Return to the previous page; the sound of this one stops, and does not lead to the next one first."""
        self._silence_rig()
        self._orders.put(lambda worker: worker.change_page(worker.procedure.back))

    def _allow_sound(self) -> None:
        """Allow sound at once, not by a queued call, so that a panic after the click takes precedence."""
        if self._worker is not None:
            self._worker.rig.allow()

    def silence(self) -> None:
        """Stop the automatic run and the sound (panic)."""
        self.run_automatically(False)
        self._silence_rig()

    def _silence_rig(self) -> None:
        if self._worker is not None:
            self._worker.rig.silence()

    def stop(self) -> None:
        """Release the tile as soon as the present computation is complete; `ended` follows."""
        self._silence_rig()
        self._orders.put(None)

    def join(self) -> None:
        """Wait for the thread to end."""
        if self._thread.ident is not None:
            self._thread.join()

    def acknowledge(self) -> None:
        """Acknowledge the snapshot: a newer one may be signalled."""
        self._is_acknowledged.set()

    @property
    def busy_s(self) -> float:
        """Seconds for which one operation has been running; 0 for none."""
        since = self._began_s if self._worker is None else self._worker.busy_since
        return time.perf_counter() - since if since else 0.0

    def _run(self) -> None:
        try:
            self._worker = worker = _Worker(*self._make(), self._orders, self._send, self._pace, self.by_hand)
            try:
                worker.run()
            finally:
                worker.rig.close()
        except Exception as error:
            self.failed.emit(str(error) if self._worker is None else f"The measurement ended: {error}")
            if not isinstance(error, UnderfootError):
                raise
        finally:
            self._began_s = 0.0
            self.ended.emit()

    def _send(self, snapshot: Snapshot) -> None:
        self.snapshot = snapshot
        if self._is_acknowledged.is_set():
            self._is_acknowledged.clear()
            self.changed.emit()


class _Worker:
    """The thread's side: executes orders, performs the page's requests, and sends snapshots."""

    def __init__(
        self,
        procedure: Procedure,
        rig: Rig,
        orders: "queue.SimpleQueue[_Order]",
        send_snapshot: Callable[[Snapshot], None],
        pace: Pace,
        by_hand: bool,
    ) -> None:
        self.procedure, self.rig = procedure, WatchedRig(rig)
        self._orders, self._send_snapshot, self._pace, self._by_hand = orders, send_snapshot, pace, by_hand
        self._is_requested = self._is_automatic = self._is_inconclusive = False
        self._rejection = self._silence = ""
        self._inconclusive: Result | None = None
        self._values: Mapping[str, Any] = {}
        self._snapshot: Snapshot | None = None
        self._sent_s = self._drawn_s = self._page_began_s = self._pause_until_s = self.busy_since = time.perf_counter()

    def run(self) -> None:
        """Run until an order to stop."""
        self._send(whole=True)
        while True:
            pause_s = self._pause_s()
            try:
                order = self._next_order(pause_s)
            except queue.Empty:
                self._advance()
                continue
            if order is None:
                self.busy_since = 0.0
                return
            order(self)

    # --- orders ---

    def proceed(self, values: Mapping[str, Any], page_shown: Page | None) -> None:
        page = self.procedure.page
        is_shown = page_shown is not None and (page_shown.key, page_shown.questions) == (page.key, page.questions)
        if page.last or self._is_requested or not is_shown:
            return  # a second click, meant for an earlier page
        self._rejection = ""
        if page.questions or (page.press is None and page.sound is None):
            self._run_checked(lambda: self.procedure.answer(values))
            self._is_requested = page.press is not None and self.procedure.page.key == page.key and not self._rejection
        else:
            self._is_requested = True
        self._pause_until_s = 0.0
        self._send(whole=True)

    def set_automatic(self, on: bool, values: Mapping[str, Any]) -> None:
        self._is_automatic, self._is_requested = on and not self._by_hand, False
        self._rejection = "" if on else self._rejection
        self._values, self._page_began_s = values, 0.0 if values else self._page_began_s
        self._send(whole=True)

    def change_page(self, turn_page: Callable[[], None]) -> None:
        self._is_requested, self._rejection = False, ""
        self.rig.press(None)  # an earlier page begins with nothing on the tile
        self._run_checked(turn_page)
        self._send(whole=True)

    # --- steps ---

    def _next_order(self, pause_s: float | None) -> "_Order":
        """Return the next order, if one arrives within `pause_s`."""
        self.busy_since = 0.0
        order = self._orders.get(timeout=pause_s) if pause_s != 0.0 else self._orders.get_nowait()
        self.busy_since = time.perf_counter()
        return order

    def _pause_s(self) -> float | None:
        """Return the time to wait for an order before the page's next request, in seconds; None if there is none."""
        if not self._has_work():
            return _IDLE_READ_S if self._by_hand and not self.procedure.page.last else None
        begins_s = (
            self._pause_until_s if self._is_requested else self._page_began_s + self._pace.page_s * self._is_automatic
        )
        return max(begins_s - time.perf_counter(), 0.0)

    def _has_work(self) -> bool:
        """Return whether there is work without an order."""
        page = self.procedure.page
        takes_press = self._by_hand and page.wants_press and not self._is_inconclusive
        return not page.last and (self._is_requested or self._is_automatic or takes_press)

    def _advance(self) -> None:
        """Perform the page's request once."""
        self.busy_since = time.perf_counter()
        if not self._has_work():
            self._discard()
            return
        if not self._is_requested:
            self._is_requested = True
            self._send(whole=True)
        before_s = self.rig.newest_s
        self._run_checked(self._step)
        if self._is_automatic and self._pace.speed > 0.0:
            passed_s = max(self.rig.newest_s - before_s, 0.0)
            self._pause_until_s = time.perf_counter() + min(passed_s / self._pace.speed, _MAX_PAUSE_S)

    def _discard(self) -> None:
        """Discard readings between pages; what was measured outlives a line that is gone, until it is back."""
        try:
            is_back = bool(self.rig.read().time_s.size and self._silence)
        except UnderfootError as error:
            if str(error) != self._rejection:
                self._rejection = self._silence = str(error)
                self._send(whole=True)
            return
        if is_back:
            self._end_silence()

    def _end_silence(self) -> None:
        """Forget what was said of a line that is back."""
        self._rejection = "" if self._rejection == self._silence else self._rejection
        self._silence = ""
        self._send(whole=True)

    def _step(self) -> None:
        if not step(self.procedure, self.rig, self._values):
            self._pause_until_s = time.perf_counter() + _NO_READINGS_S
        elif self._silence:
            self._end_silence()

    def _run_checked(self, action: Callable[[], None]) -> None:
        """Do something that may be refused, and send the result."""
        before, rejection = self.procedure.page, ""
        try:
            action()
        except UnderfootError as error:
            rejection, self._is_requested, self._is_automatic = str(error), False, False
            self._silence = rejection if isinstance(error, DeviceError) else ""
            self.rig.press(None)  # the page begins again, and a load that stays on would not rise
            # Measured again without end, the last page would lead to the same: it waits for Continue.
            self._is_inconclusive = isinstance(error, Inconclusive)
        page = self.procedure.page
        is_new = (page.key, page.questions) != (before.key, before.questions)
        if page.key != before.key:
            self._is_requested, self._page_began_s = False, time.perf_counter()
            self._is_automatic = self._is_automatic and not page.last
        if is_new:
            self._values = {}
            self._is_inconclusive = self._is_inconclusive and bool(rejection)
        is_news = bool(rejection) and rejection != self._rejection
        if is_news:
            self._inconclusive = self.procedure.without_conclusion(rejection)
        elif is_new:
            keeps = self._by_hand and not page.last
            self._inconclusive = self.procedure.without_conclusion(_UNFINISHED) if keeps else None
        self._rejection = rejection or ("" if is_new else self._rejection)
        self._send(whole=is_new or is_news)

    def _send(self, *, whole: bool) -> None:
        """Send a new snapshot if one is due; at once if the `whole` has changed."""
        now_s, old, procedure = time.perf_counter(), self._snapshot, self.procedure
        if not whole and now_s - self._sent_s < _SNAPSHOT_S:
            return
        if whole or old is None or now_s - self._drawn_s >= _DRAW_S:
            drawings, self._drawn_s = procedure.drawings, now_s
        else:
            drawings = old.drawings
        is_waiting = not self._has_work()
        self._snapshot = Snapshot(
            procedure.page,
            procedure.progress,
            drawings,
            procedure.result,
            is_waiting,
            self._is_automatic,
            self._rejection,
            self._inconclusive,
        )
        self._sent_s = now_s
        self._send_snapshot(self._snapshot)


_Order = Callable[[_Worker], None] | None
"""An order of the window to the thread; None ends it."""


class WatchedRig:
    """A rig that notes the time of its newest reading. Once silenced it plays nothing until `allow`."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._is_silenced = False
        self.newest_s = 0.0

    def press(self, press: PressRequest | None) -> None:
        self._rig.press(press)

    def read(self) -> Readings:
        readings = self._rig.read()
        if readings.time_s.size:
            self.newest_s = float(readings.time_s[-1])
        return readings

    def play(self, sound: Sound) -> NDArray[np.float64]:
        recorded = None if self._is_silenced else self._rig.play(sound)
        if recorded is None or self._is_silenced:
            raise BadMeasurement(STOPPED)
        return recorded

    def allow(self) -> None:
        """Allow sound again, at the user's request."""
        self._is_silenced = False

    def silence(self) -> None:
        """Stop playback, from any thread, if the rig supports it; a sound about to start does not start."""
        self._is_silenced = True
        silence = getattr(self._rig, "silence", None)
        if silence is not None:
            silence()

    def close(self) -> None:
        self._rig.close()
