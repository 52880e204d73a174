"""Follows a recording while it is being written, by this window or another program: new parts are read periodically."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.widgets.recordings.reader import OpenedRecording, RecordingReader
from underfoot.widgets.session.controller import SessionController

POLL_MS = 1000
"""A recorder writes twenty times meanwhile: what has not grown is whole."""


class RecordingFollower(QObject):
    """Requests reads from the reader for as long as the open file grows."""

    to_show = Signal(object)
    """The `Path` of a recording: the open one, which is whole now, or on request the one that was begun last."""

    def __init__(self, reader: RecordingReader, parent: QObject) -> None:
        super().__init__(parent)
        self._controller: SessionController | None = None
        self._path: Path | None = None
        self._begun: Path | None = None
        self.grows = False
        """Whether the open recording is being written."""
        self._timer = QTimer(self, interval=POLL_MS, singleShot=True)
        self._timer.timeout.connect(reader.read_new)
        reader.extended.connect(self._go_on)
        reader.unchanged.connect(self._end)

    def attach(self, controller: SessionController) -> None:
        """Follow the recordings of this controller."""
        self._controller = controller
        controller.recording_file_changed.connect(self._note)

    def is_written(self, path: Path) -> bool:
        """Return whether the session is recording to this file, or is still closing it."""
        return self._controller is not None and self._controller.is_written(path)

    def follow(self, path: Path) -> None:
        """Follow this file, which has been opened."""
        self._path, self._begun, self.grows = path, None, self.is_written(path)
        self._timer.start()

    def show_begun(self) -> None:
        """Have the recording shown that was begun since one was opened, if any."""
        if self._begun is not None:
            self.to_show.emit(self._begun)

    def _go_on(self, opened: OpenedRecording) -> None:
        if opened.path == self._path:
            self.grows = True
            self._timer.start()

    def _end(self, path: Path) -> None:
        """Have a recording that has grown shown as a whole, unless the session still writes it."""
        if path == self._path and self.is_written(path):
            self._timer.start()
        elif path == self._path and self.grows:
            self.to_show.emit(path)

    def _note(self, path: Path) -> None:
        if self.is_written(path):
            self._begun = path
