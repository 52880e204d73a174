"""Contacts and footsteps in the force samples of a running session."""

import threading
import time
from collections import deque
from functools import cache

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.engine.rings import load_reading
from underfoot.floor import contacts, loss_concealment
from underfoot.floor.contacts import ContactRows, ContactTracker, OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.floor.loss_concealment import LossConcealment
from underfoot.floor.walks import WalkTracker

CHUNK = 4096
"""Tiles times samples tracked at once: 2 ms."""
CHUNKS_PER_TICK, SHARE_PER_TICK = 4, 4
"""So many chunks, or the fourth part of what waits if that is more; the rest waits for the next tick. By number, not by
time: where other programs take the processor, time is up after one, and what waits would never be caught up with.
"""

_YIELD_S = 0.6
"""Delay of the thread before it imports Numba, which holds the interpreter again and again: until the first preview is
drawn, or the window stands still for up to 90 ms at its first sound."""


class ForceUpdate(Struct, frozen=True):
    """The force samples of one tick.

    `time_s` (n,) is since the start of the session, `force_n` (n, tiles, 4) is tared. The tiles' loads, the untared
    tiles, and the contacts are those at the last sample. `contact_rows` are the contacts' positions; they follow the
    samples with a short delay.
    """

    time_s: NDArray[np.float64]
    force_n: NDArray[np.float64]
    load_n: NDArray[np.float64]
    untared: NDArray[np.bool_]
    contacts: tuple[OngoingContact, ...]
    contact_rows: tuple[ContactRows, ...]

    def emptied(self) -> "ForceUpdate":
        """Return the same with nobody on the floor any more."""
        return replace(self, load_n=np.zeros_like(self.load_n), contacts=())


class FootstepTracker:
    """Tracks contacts and counts footsteps. Samples wait until its kernels are loaded.

    `rate_hz` are session frames a second, `force_hz` force samples a second.
    """

    def __init__(self, floor: Floor, rate_hz: float, force_hz: float) -> None:
        self.floor, self.rate_hz, self.force_hz = floor, rate_hz, force_hz
        self._length = max(64, CHUNK // len(floor.tiles))
        self._pending: deque[tuple[NDArray[np.float64], NDArray[np.float64]]] = deque()
        self._tracking: tuple[ContactTracker, LossConcealment] | None = None
        self._counter = WalkTracker(floor)
        self._loaded = threading.Event()

    def load_kernels(self) -> None:
        """Load the kernels in a thread, preferably after another process has compiled them."""
        self._loaded = _load_kernels()

    @property
    def is_ready(self) -> bool:
        """Whether the kernels are loaded."""
        return self._loaded.is_set()

    def wait_for_kernels(self, timeout_s: float) -> bool:
        """Wait until the kernels are loaded; return whether they were in time."""
        self.load_kernels()
        return self._loaded.wait(timeout_s)

    def add(self, frames: NDArray[np.float64], force_n: NDArray[np.float64]) -> None:
        """Queue samples at these session frames, shapes (n,) and (n, tiles, 4)."""
        for begin in range(0, len(frames), self._length):
            chunk = slice(begin, begin + self._length)
            self._pending.append((frames[chunk] / self.rate_hz, force_n[chunk]))

    def track(self, most: int = CHUNKS_PER_TICK) -> tuple[ForceUpdate | None, list[Step]]:
        """Track queued samples, `most` chunks or a share of all; return them, if any, and new footsteps."""
        tracking = self._ready_tracking()
        if tracking is None:
            return None, []
        tracker, concealment = tracking
        done: list[tuple[NDArray[np.float64], NDArray[np.float64], ContactRows]] = []
        steps: list[Step] = []
        most = max(most, len(self._pending) // SHARE_PER_TICK)
        while self._pending and len(done) < most:
            time_s, force_n = self._pending.popleft()
            tracked = concealment.follow(time_s, force_n)
            steps += self._counter.feed(tracked.finished, float(time_s[-1]))
            done.append((time_s, force_n, tracked.rows))
        if not done:
            return None, steps
        times = np.concatenate([time_s for time_s, _, _ in done])
        force_n = np.concatenate([force_n for _, force_n, _ in done]) - tracker.baseline_n
        rows = tuple(rows for _, _, rows in done if len(rows))
        ongoing = tuple(
            replace(contact, person=self._counter.person_at(contact.start_s, (contact.x_m, contact.y_m)))
            for contact in tracker.ongoing()
        )
        return ForceUpdate(times, force_n, tracker.loads_n, tracker.untared, ongoing, rows), steps

    def finish(self) -> list[Step]:
        """Return the footsteps that are complete only when no more samples follow."""
        return self._counter.finish()

    def tare(self) -> None:
        """Take the present forces of all unloaded tiles as their zero."""
        if self._tracking is not None:
            self._tracking[0].tare()

    def _ready_tracking(self) -> tuple[ContactTracker, LossConcealment] | None:
        """Return the tracker, and the concealment of lost samples before it, created once their kernels are loaded."""
        if self._tracking is None and self.is_ready:
            tracker = ContactTracker(self.floor, self.force_hz)
            self._tracking = tracker, LossConcealment(tracker, self._length)
        return self._tracking


def load_tracking() -> None:
    """Load the kernels of tracking and of reading rings: a second with Numba, and longer if they must be compiled."""
    contacts.load_kernels()
    loss_concealment.load_kernels()
    load_reading()


@cache
def _load_kernels() -> threading.Event:
    """Do so once, in a thread. Set when done."""
    loaded = threading.Event()

    def load() -> None:
        time.sleep(_YIELD_S)
        load_tracking()
        loaded.set()

    threading.Thread(target=load, name="load-kernels", daemon=True).start()
    return loaded
