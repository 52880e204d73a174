"""Conversion of a session's reports to Qt signals, sixty times a second, in batches."""

import math
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from underfoot.engine.commands import Mark
from underfoot.engine.reports import (
    NOTHING,
    CommandApplied,
    Compiling,
    Costs,
    Fault,
    Notice,
    OutputChanged,
    PatchRefused,
    ProcessDied,
    RecordingFile,
    Started,
)
from underfoot.files import cache_refusal
from underfoot.floor.contacts import SILENT_S
from underfoot.floor.layout import Floor
from underfoot.widgets.session.footstep_tracker import FootstepTracker

if TYPE_CHECKING:
    from underfoot.engine.session import Session

TICK_MS = 16
HEALTH_TICKS = 6


class Bridge(QObject):
    """Polls a session and emits its reports. Vibration is read only while it is wanted."""

    started = Signal(object)
    """`Started`: the engine is running."""
    notified = Signal(str)
    """A line for the user."""
    output_changed = Signal(object)
    """`OutputChanged`: a sound card went away or came back; its line is emitted by `notified`, too."""
    compile_progressed = Signal(int, int)
    """Kernels ready, of how many."""
    costs_measured = Signal(object)
    """`Costs`, twice a second."""
    faulted = Signal(object)
    """`Fault`: a node produced a value that is not finite."""
    health_reported = Signal(object)
    """`Health`, ten times a second."""
    forces_tracked = Signal(object)
    """`ForceUpdate`, once per tick with force samples."""
    floor_silent = Signal(bool)
    """Whether the floor is silent, for `SILENT_S` of the session: its line is gone, or nothing sends; or the engine is
    given up. One that stands still does not make it so."""
    vibration_read = Signal(object, object)  # Qt's int has 32 bits, which are 12 hours of frames
    """First session frame, and samples (n, tiles), relative to full scale."""
    response_read = Signal(object, object, object)
    """First session frame; commanded and measured acceleration, (n, tiles) each, m/s^2."""
    steps_found = Signal(list)
    """New footsteps."""
    marked = Signal(str, float)
    """Text of a mark, and its time in seconds of the session."""
    recording_file_changed = Signal(object)
    """`RecordingFile`."""
    reported = Signal(list)
    """All reports of the session in a tick, unchanged."""
    ticked = Signal()
    """All signals of a tick have been emitted: widgets may redraw."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.wants_vibration = False
        """Whether `vibration_read` and `response_read` are emitted."""
        self._session: Session | None = None
        self._tracker: FootstepTracker | None = None
        self._ticks = 0
        self._heard_s, self._is_silent, self._rate_hz = math.inf, False, 1.0
        self.engine_failure = ""
        """Why no engine plays any more, until the session is detached; "" while one does."""
        self._notices: set[str] = set()
        self._timer = QTimer(self, timerType=Qt.TimerType.PreciseTimer, interval=TICK_MS)
        self._timer.timeout.connect(self.tick)

    def attach(self, session: "Session", floor: Floor, rate_hz: float) -> None:
        """Poll this session from now on, with `rate_hz` frames per second."""
        self._session, self._rate_hz, self._heard_s = session, rate_hz, math.inf
        self._tracker = FootstepTracker(floor, rate_hz, session.force_rate_hz)
        self._notices.clear()
        self._timer.start()

    def detach(self) -> None:
        """Stop polling."""
        self._timer.stop()
        self._session = self._tracker = None
        self.engine_failure = ""
        self._show_silence(False)

    def wait_for_kernels(self, timeout_s: float) -> bool:
        """Wait until the tracking kernels are loaded; return whether they were in time."""
        return self._tracker is not None and self._tracker.wait_for_kernels(timeout_s)

    def tare(self) -> None:
        """Take the present forces as zero for display; the engine has its own `Tare`."""
        if self._tracker is not None:
            self._tracker.tare()

    def tick(self) -> None:
        """Read the session, and emit signals."""
        session, tracker = self._session, self._tracker
        if session is None or tracker is None:
            return
        reports = session.poll()
        for report in reports:
            self._emit(report)
        if reports:
            self.reported.emit(reports)
        if self._session is not session:
            return
        if tracker.is_ready:
            self._read(session, tracker)
        if self._ticks % HEALTH_TICKS == 0:
            self.health_reported.emit(session.health)
        self._ticks += 1
        self.ticked.emit()

    def _read(self, session: "Session", tracker: FootstepTracker) -> None:
        """Read new data from the rings, which hold several seconds."""
        if self.engine_failure:  # the feet of its last samples would stand there for good
            self._show_silence(True)
            return
        now_s = session.played_s  # before the samples, which are there until then
        frames, force_n = session.force.read()
        self._heard_s = float(frames[-1]) / self._rate_hz if len(frames) else min(self._heard_s, now_s)
        self._show_silence(now_s - self._heard_s > SILENT_S)
        tracker.add(frames, force_n)
        update, steps = tracker.track()
        if update is not None:
            self.forces_tracked.emit(update)
        if steps:
            self.steps_found.emit(steps)
        if self.wants_vibration:
            first, samples = session.vibration.read()
            if len(samples):
                self.vibration_read.emit(first, samples)
            first, commanded, measured = session.response.read()
            if len(measured):
                self.response_read.emit(first, commanded, measured)

    def _show_silence(self, is_silent: bool) -> None:
        if is_silent != self._is_silent:
            self._is_silent = is_silent
            self.floor_silent.emit(is_silent)

    def _emit(self, report: object) -> None:
        match report:
            case Started():
                if self._tracker is not None:
                    self._tracker.load_kernels()  # now in the cache
                self.started.emit(report)  # its notice stays at the right: as a message it hid the one before
            case Compiling(ready, total):
                self.compile_progressed.emit(ready, total)
                if ready == total:
                    refusal = cache_refusal()
                    self._notify_once(f"{refusal[:1].upper()}{refusal[1:]}")
            case CommandApplied(frame, Mark() as mark) if self._session is not None:
                rate_hz = self._session.target.rate
                self.marked.emit(mark.text, mark.frame(frame, rate_hz) / rate_hz)
            case RecordingFile():
                self.recording_file_changed.emit(report)
            case Costs():
                self.costs_measured.emit(report)
            case Notice(text):
                if isinstance(report, OutputChanged):
                    if report.where == NOTHING:
                        self.engine_failure = report.silence
                    self.output_changed.emit(report)
                    text = f"{text}."
                if isinstance(report, OutputChanged | PatchRefused):  # others may begin with the name of a tile
                    text = f"{text[:1].upper()}{text[1:]}"
                if text:
                    self.notified.emit(text)
            case ProcessDied(process, reason, is_restarted=True):
                self.notified.emit(
                    f"The {process} stopped ({reason}) and was started again; the patch goes on playing."
                )
            case Fault(node, tile) if self._session is not None:
                self.faulted.emit(report)
                name = self._session.patch.names().get(node, node)
                self._notify_once(f"{name} produced a value that is not finite on tile {tile}; its output is silenced.")

    def _notify_once(self, text: str) -> None:
        if text and text not in self._notices:
            self._notices.add(text)
            self.notified.emit(text)
