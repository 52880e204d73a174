"""Follows a recording while it is being written, by this window or another program: new parts are read periodically."""

from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.widgets.recordings.reader import RecordingReader
from underfoot.widgets.session.session_recording import SessionRecording

POLL_MS = 1000
"""A recorder writes twenty times meanwhile: what has not grown has ended, or its writer waits for a disk."""


class RecordingFollower(QObject):
    """Requests reads of the open file from the reader, and tells when it grows no more."""

    ended = Signal()
    """The open recording has grown, and does no more; it may go on later."""
    to_show = Signal(object)
    """The `Path` of the recording that was begun last, on request."""

    def __init__(self, reader: RecordingReader, parent: QObject) -> None:
        super().__init__(parent)
        self._recording: SessionRecording | None = None
        self._path: Path | None = None
        self.grows = False
        """Whether the open recording is being written."""
        self._timer = QTimer(self, interval=POLL_MS, singleShot=True)
        self._timer.timeout.connect(reader.read_new)
        reader.extended.connect(self._go_on)
        reader.unchanged.connect(self._note_unchanged)
        reader.failed.connect(lambda _: self._timer.start())  # a disk, or who holds the file, may be slow once

    def attach(self, recording: SessionRecording) -> None:
        """Follow the recordings of the window's session."""
        self._recording = recording

    def is_written(self, path: Path) -> bool:
        """Return whether the session is recording to this file, or is still closing it."""
        return self._recording is not None and self._recording.is_written(path)

    def follow(self, path: Path) -> None:
        """Follow this file, which has been opened."""
        self._path, self.grows = path, self.is_written(path)
        if self._recording is not None:
            self._recording.begun = None
        self._timer.start()

    def show_begun(self) -> None:
        """Have the recording shown that was begun since one was opened, if any."""
        if self._recording is not None and self._recording.begun is not None:
            self.to_show.emit(self._recording.begun)

    def _go_on(self) -> None:
        self.grows = True
        self._timer.start()

    def _note_unchanged(self) -> None:
        self._timer.start()
        if self.grows and self._path is not None and not self.is_written(self._path):
            self.grows = False
            self.ended.emit()
