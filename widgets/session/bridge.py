"""Conversion of a session's reports to Qt signals, sixty times a second, in batches."""

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from underfoot.engine.commands import Mark
from underfoot.engine.reports import (
    CommandApplied,
    Compiling,
    Costs,
    Distributions,
    ErrorCurveDrawn,
    Fault,
    Notice,
    Outlines,
    Preview,
    ProcessDied,
    Started,
)
from underfoot.engine.session import Session
from underfoot.floor.layout import Floor
from underfoot.widgets.session.footstep_tracker import FootstepTracker

TICK_MS = 16
HEALTH_TICKS = 6
TRACKING_BUDGET_S = 0.006
"""Seconds per tick available to footstep tracking; the rest waits for the next tick."""


class Bridge(QObject):
    """Polls a session and emits its reports. Vibration is read only while it is wanted."""

    started = Signal(object)
    """`Started`: the engine is running."""
    noticed = Signal(str)
    """A line for the user."""
    compiling = Signal(int, int)
    """Kernels ready, of how many."""
    costs = Signal(object)
    """`Costs`, twice a second."""
    faulted = Signal(object)
    """`Fault`: a node produced a value that is not finite."""
    previewed = Signal(object)
    """`Preview`, as requested."""
    outlined = Signal(object)
    """`Outlines`, as requested."""
    lawful = Signal(object)
    """`Distributions` of the node that was previewed."""
    errors_measured = Signal(object)
    """`ErrorCurveDrawn`, as far as the curve is known."""
    health = Signal(object)
    """`Health`, ten times a second."""
    forces = Signal(object)
    """`ForceUpdate`, once per tick with force samples."""
    vibrated = Signal(int, object)
    """First session frame, and samples (n, tiles), relative to full scale."""
    measured = Signal(int, object, object)
    """First session frame; commanded and measured acceleration, (n, tiles) each, m/s^2."""
    stepped = Signal(list)
    """New footsteps."""
    marked = Signal(str, float)
    """Text of a mark, and its time in seconds of the session."""
    reported = Signal(list)
    """All reports of the session in a tick, unchanged."""
    ticked = Signal()
    """All signals of a tick have been emitted: widgets may redraw."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.wants_vibration = False
        self._session: Session | None = None
        self._tracker: FootstepTracker | None = None
        self._ticks = 0
        self._said: set[str] = set()
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self.tick)

    def follow(self, session: Session, floor: Floor, rate_hz: float) -> None:
        """Poll this session from now on, with `rate_hz` frames per second."""
        self._session = session
        self._tracker = FootstepTracker(floor, rate_hz, session.force_rate_hz)
        self._said.clear()
        self._timer.start()

    def leave(self) -> None:
        """Stop polling."""
        self._timer.stop()
        self._session = self._tracker = None

    def want_vibration(self, wanted: bool) -> None:
        """Set whether `vibrated` and `measured` are emitted."""
        self.wants_vibration = wanted

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
            self.health.emit(session.health)
        self._ticks += 1
        self.ticked.emit()

    def _read(self, session: Session, tracker: FootstepTracker) -> None:
        """Read what is new in the rings, which hold it for seconds."""
        tracker.take(*session.force.read())
        update, steps = tracker.track(TRACKING_BUDGET_S)
        if update is not None:
            self.forces.emit(update)
        if steps:
            self.stepped.emit(steps)
        if self.wants_vibration:
            first, samples = session.vibration.read()
            if len(samples):
                self.vibrated.emit(first, samples)
            first, asked, done = session.response.read()
            if len(done):
                self.measured.emit(first, asked, done)

    def _emit(self, report: object) -> None:
        match report:
            case Started():
                if self._tracker is not None:
                    self._tracker.load_kernels()  # in the cache by now
                self.started.emit(report)
                self._say_once(report.notice)
            case Compiling(ready, total):
                self.compiling.emit(ready, total)
            case CommandApplied(frame, Mark() as mark) if self._session is not None:
                rate_hz = self._session.target.rate
                self.marked.emit(mark.text, mark.frame(frame, rate_hz) / rate_hz)
            case Costs():
                self.costs.emit(report)
            case Preview():
                self.previewed.emit(report)
            case Outlines():
                self.outlined.emit(report)
            case Distributions():
                self.lawful.emit(report)
            case ErrorCurveDrawn():
                self.errors_measured.emit(report)
            case Notice(text):
                self._say_once(text)
            case ProcessDied(process, reason):
                self.noticed.emit(f"The {process} stopped ({reason}) and was started again; the patch goes on playing.")
            case Fault(node, tile):
                self.faulted.emit(report)
                self._say_once(f"{node} produced a value that is not finite on tile {tile}; its output is silenced.")

    def _say_once(self, text: str) -> None:
        if text and text not in self._said:
            self._said.add(text)
            self.noticed.emit(text)
