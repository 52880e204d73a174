"""Where what the engine reports becomes Qt signals: sixty times a second, in batches, and nowhere else."""

import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, QTimer, Signal

from underfoot.engine.reports import Compiling, Costs, Fault, Notice, Preview, ProcessDied, Started
from underfoot.floor.contacts import ContactRows, ContactTracker, Present
from underfoot.floor.footsteps import Step, StepCounter
from underfoot.floor.layout import Floor, default_floor

TICK_MS = 16
HEALTH_TICKS = 6
BUDGET_S = 0.006
"""What following feet may take of a tick; the rest waits for the next."""

_CHUNK = 4096
"""Tiles times samples that are followed in one go: 2 ms."""


@dataclass(frozen=True)
class Forces:
    """The force samples of a tick: `time_s` (n,) since the start of the session and tared `force_n` (n, tiles, 4); as
    they stand at the last of them, the load on each tile, which tiles are untared, and the contacts; and where
    contacts went, which is told a little later."""

    time_s: NDArray[np.float64]
    force_n: NDArray[np.float64]
    load_n: NDArray[np.float64]
    untared: NDArray[np.bool_]
    contacts: tuple[Present, ...]
    ways: tuple[ContactRows, ...]


class Bridge(QObject):
    """Polls a session and says what it found. What nobody sees is not read: see `wants_vibration`."""

    started = Signal(object)
    """`Started`: the engine runs."""
    noticed = Signal(str)
    """A line for the person."""
    compiling = Signal(int, int)
    """Kernels ready, of how many."""
    costs = Signal(object)
    faulted = Signal(object)
    previewed = Signal(object)
    health = Signal(object)
    forces = Signal(object)
    """`Forces`, once a tick in which there were any."""
    vibrated = Signal(int, object)
    """First session frame and samples (n, tiles), of full scale."""
    stepped = Signal(list)
    """Footsteps that are known since the last time."""
    ticked = Signal()
    """All of a tick has been told: now it may be drawn."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.wants_vibration = False
        self._session: Any = None
        self._feet: Feet | None = None
        self._ticks = 0
        self._said: set[str] = set()
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self.tick)

    def follow(self, session: Any, floor: Floor, rate_hz: float) -> None:
        """Poll this session from now on, whose frames are `rate_hz` a second."""
        self._session = session
        self._feet = Feet(floor, rate_hz, session.force_rate_hz)
        self._said.clear()
        self._timer.start()

    def leave(self) -> None:
        """Let go of the session."""
        self._timer.stop()
        self._session = self._feet = None

    def tare(self) -> None:
        """What every tile reads now counts as nothing, here; the engine has its own `Tare`."""
        if self._feet is not None:
            self._feet.tare()

    def tick(self) -> None:
        """Take what there is from the session."""
        session, feet = self._session, self._feet
        if session is None or feet is None:
            return
        for report in session.poll():
            self._tell(report)
        if self._session is not session:
            return
        feet.take(*session.force.read())
        followed, steps = feet.follow(BUDGET_S)
        if followed is not None:
            self.forces.emit(followed)
        if steps:
            self.stepped.emit(steps)
        if self.wants_vibration:
            first, samples = session.vibration.read()
            if len(samples):
                self.vibrated.emit(first, samples)
        if self._ticks % HEALTH_TICKS == 0:
            self.health.emit(session.health)
        self._ticks += 1
        self.ticked.emit()

    def _tell(self, report: object) -> None:
        match report:
            case Started():
                self.started.emit(report)
                self._say_once(report.notice)
            case Compiling(ready, total):
                self.compiling.emit(ready, total)
            case Costs():
                self.costs.emit(report)
            case Preview():
                self.previewed.emit(report)
            case Notice(text):
                self._say_once(text)
            case ProcessDied(process, reason):
                self.noticed.emit(f"The {process} stopped ({reason}) and was started again; the patch plays on.")
            case Fault(node, tile):
                self.faulted.emit(report)
                self._say_once(f"{node} made a value that is not a number on tile {tile}; it was silenced.")

    def _say_once(self, text: str) -> None:
        if text and text not in self._said:
            self._said.add(text)
            self.noticed.emit(text)


@dataclass
class Feet:
    """Contacts and footsteps in a stream of forces. Kernels are loaded in a thread, so that nobody waits for them."""

    floor: Floor
    rate_hz: float
    """Session frames a second."""
    force_hz: float
    """Force samples a second."""
    _waiting: deque[tuple[NDArray, NDArray]] = field(default_factory=deque)
    _tracker: ContactTracker | None = None

    def __post_init__(self) -> None:
        self._counter = StepCounter(self.floor)
        _load_kernels()

    def take(self, frames: NDArray[np.float64], force_n: NDArray[np.float64]) -> None:
        """Samples at these session frames, shapes (n,) and (n, tiles, 4); they are followed later."""
        length = max(64, _CHUNK // len(self.floor.tiles))
        for begin in range(0, len(frames), length):
            chunk = slice(begin, begin + length)
            self._waiting.append((frames[chunk] / self.rate_hz, force_n[chunk]))

    def follow(self, budget_s: float) -> tuple[Forces | None, list[Step]]:
        """Follow what waits, for about `budget_s`: the forces of that stretch, if there were any, and new footsteps."""
        if not self._is_ready():
            return None, []
        assert self._tracker is not None
        until = time.perf_counter() + budget_s
        done, steps = [], []
        while self._waiting:
            time_s, force_n = self._waiting.popleft()
            followed = self._tracker.feed(time_s, force_n)
            steps += self._counter.feed(followed.finished, float(time_s[-1]))
            done.append((time_s, force_n, followed.rows))
            if time.perf_counter() > until:
                break
        if not done:
            return None, steps
        tracker = self._tracker
        times = np.concatenate([time_s for time_s, _, _ in done])
        force_n = np.concatenate([force_n for _, force_n, _ in done]) - tracker.baseline_n
        ways = tuple(rows for _, _, rows in done if len(rows))
        return Forces(times, force_n, tracker.loads_n, tracker.untared, tracker.present(), ways), steps

    def tare(self) -> None:
        if self._tracker is not None:
            self._tracker.tare()

    def _is_ready(self) -> bool:
        """Whether there is a tracker: it needs its kernels."""
        if self._tracker is None and _kernels_loaded.is_set():
            self._tracker = ContactTracker(self.floor, self.force_hz)
        return self._tracker is not None


_kernels_loaded = threading.Event()
_loading = threading.Lock()


def _load_kernels() -> None:
    """Load the kernels that follow feet, once, in a thread: it takes 0.2 s, or seconds where they must be compiled."""

    def load() -> None:
        with _loading:
            if not _kernels_loaded.is_set():
                tracker = ContactTracker(default_floor(1, 2), 1000.0)
                force_n = np.zeros((400, 2, 4))
                force_n[200:300] = 50.0
                tracker.feed(np.arange(400) / 1000.0, force_n)
                tracker.tare()
                _kernels_loaded.set()

    if not _kernels_loaded.is_set():
        threading.Thread(target=load, name="load-kernels", daemon=True).start()
