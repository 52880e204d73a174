"""Surveys the open recording in a process, and collects the results."""

from pathlib import Path

from PySide6.QtCore import QObject, Signal

from underfoot.engine.survey_process import Progress
from underfoot.records.survey import Survey
from underfoot.widgets.polled_process import PolledProcess


class Surveyor(QObject):
    """Surveys one recording at a time, in a process."""

    progressed = Signal(object)
    """`Progress`."""
    found = Signal(object)
    """Carries the `Survey` so far."""
    failed = Signal(str)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._process = PolledProcess("survey", self, "underfoot.engine.survey_process")
        self._process.received.connect(self._take)
        self._process.ended.connect(self._end)
        self._survey = Survey()
        self._is_closed = False

    @property
    def is_busy(self) -> bool:
        """Whether a recording is being surveyed."""
        return self._process.is_running

    def begin(self, path: Path) -> None:
        """Survey this recording instead of the previous one; do nothing after `close`."""
        self.stop()
        if self._is_closed:
            return
        self._survey = Survey()
        self._process.begin(str(path))

    def stop(self) -> None:
        """Stop the survey; its results are kept."""
        self._process.stop()  # safe to kill: files are moved into place, and tables are resumed

    def close(self) -> None:
        """Stop for good: a recording that was being opened may still be reported."""
        self._is_closed = True
        self.stop()

    def _take(self, messages: list[object]) -> None:
        news = False
        for message in messages:
            match message:
                case Survey():
                    self._survey.contacts += message.contacts
                    self._survey.steps += message.steps
                    self._survey.balance += message.balance
                    self._survey.until_s, self._survey.whole = message.until_s, message.whole
                    news = True
                case Progress():
                    self.progressed.emit(message)
                case str():
                    self.failed.emit(message)
        if news:
            self.found.emit(self._survey)
        if self._survey.whole:
            self.stop()
            self._end("")

    def _end(self, how: str) -> None:
        if how:
            self.failed.emit("The search for footsteps ended before it was done; open the recording again.")
        self.progressed.emit(Progress("", 1.0))
