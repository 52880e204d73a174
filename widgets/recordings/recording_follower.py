"""Follows a recording while it is being written: new parts of an open one are read periodically."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.widgets.recordings.reader import RecordingReader
from underfoot.widgets.session.controller import SessionController

POLL_MS = 1000


class RecordingFollower(QObject):
    """Requests reads from the reader while the session records to the open file."""

    to_show = Signal(object)
    """The `Path` of a recording: the open one, which is whole now, or on request the one that was begun last."""

    def __init__(self, reader: RecordingReader, parent: QObject) -> None:
        super().__init__(parent)
        self._reader = reader
        self._controller: SessionController | None = None
        self._path: Path | None = None
        self._begun: Path | None = None
        self._timer = QTimer(self, interval=POLL_MS)
        self._timer.timeout.connect(self._poll)

    def attach(self, controller: SessionController) -> None:
        """Follow the recordings of this controller."""
        self._controller = controller
        controller.recording_file_changed.connect(self._note)

    def is_written(self, path: Path) -> bool:
        """Return whether the session is recording to this file, or is still closing it."""
        return self._controller is not None and self._controller.is_written(path)

    def follow(self, path: Path) -> None:
        """Follow this file, which has been opened."""
        self._path, self._begun = path if self.is_written(path) else None, None
        if self._path is not None:
            self._timer.start()
        else:
            self._timer.stop()

    def show_begun(self) -> None:
        """Have the recording shown that was begun since one was opened, if any."""
        if self._begun is not None:
            self.to_show.emit(self._begun)

    def _poll(self) -> None:
        path = self._path
        if path is not None and self.is_written(path):
            self._reader.read_new()

    def _note(self, path: Path) -> None:
        if self.is_written(path):
            self._begun = path
        elif path == self._path:
            self.follow(path)
            self.to_show.emit(path)
