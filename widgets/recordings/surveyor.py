"""Surveys the open recording in a process, and collects the results."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.survey_process import Progress
from underfoot.records.survey import Survey

POLL_MS = 100


class Surveyor(QObject):
    """Surveys one recording at a time, in a process."""

    progressed = Signal(object)
    """`Progress`."""
    found = Signal(object)
    """Carries the `Survey` so far."""
    failed = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process: ChildProcess | None = None
        self._survey = Survey()
        self._is_closed = False
        self._timer = QTimer(self)
        self._timer.setInterval(POLL_MS)
        self._timer.timeout.connect(self._poll)

    @property
    def is_busy(self) -> bool:
        """Whether a recording is being surveyed."""
        return self._process is not None

    def begin(self, path: Path) -> None:
        """Survey this recording instead of the previous one; do nothing after `close`."""
        self.stop()
        if self._is_closed:
            return
        self._survey = Survey()
        self._process = ChildProcess("survey", "underfoot.engine.survey_process", str(path))
        self._timer.start()

    def stop(self) -> None:
        """Stop the survey; its results are kept."""
        self._timer.stop()
        process, self._process = self._process, None
        if process is not None:
            process.kill()  # safe to kill: files are moved into place, and tables are resumed
            process.end(0.0)

    def close(self) -> None:
        """Stop for good: a recording that was being opened may still be reported."""
        self._is_closed = True
        self.stop()

    def _poll(self) -> None:
        process = self._process
        if process is None:
            return
        is_over = not process.is_alive
        news = False
        for message in process.receive():
            match message:
                case Survey():
                    self._survey.contacts += message.contacts
                    self._survey.steps += message.steps
                    self._survey.until_s, self._survey.whole = message.until_s, message.whole
                    news = True
                case Progress():
                    self.progressed.emit(message)
                case str():
                    self.failed.emit(message)
        if news:
            self.found.emit(self._survey)
        if is_over and not self._survey.whole and process.has_failed:
            self.failed.emit("The search for footsteps ended before it was done; open the recording again.")
        if is_over or self._survey.whole:
            self.stop()
            self.progressed.emit(Progress("", 1.0))
