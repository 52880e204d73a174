"""Recording of the window's session to files in the documents' folder."""

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from underfoot.engine.reports import RecordingFile
from underfoot.errors import UnderfootError
from underfoot.files import remove_file
from underfoot.records.recording_format import name_now
from underfoot.widgets.controls.file_dialog import documents_folder

if TYPE_CHECKING:
    from underfoot.engine.session import Session


class SessionRecording(QObject):
    """Begins and ends recordings of the present session, and knows which files are not whole yet."""

    notified = Signal(str)
    """A line for the user."""
    changed = Signal(object)
    """The `Path` of the recording, or None."""
    file_changed = Signal(object)
    """The `Path` of a recording whose file is there now, or has been closed."""

    def __init__(self, session: "Callable[[], Session | None]", parent: QObject) -> None:
        super().__init__(parent)
        self._session = session
        self._written: set[Path] = set()
        self.begun: Path | None = None
        """The recording that was begun last, which nobody has looked at yet."""

    @property
    def is_on(self) -> bool:
        """Whether the session is being recorded."""
        session = self._session()
        return session is not None and session.recording is not None

    def record(self, on: bool) -> None:
        """Begin a recording in the documents' folder, or end the present one."""
        session = self._session()
        if session is None:
            self.notified.emit("Nothing is recorded yet: the engine is starting.")
            self.changed.emit(None)
            return
        path = session.recording
        if on and path is None:
            try:
                session.record(path := _reserved_recording())
            except (UnderfootError, OSError) as error:
                from underfoot.records.recording_writer import keeps_name

                if path is not None and keeps_name(path):
                    remove_file(path)
                self.notified.emit(f"The recording could not be started: {error}")
            else:
                self._written.add(path)
                self.notified.emit(f"Recording to {path}")
        elif not on and path is not None:
            session.end_recording()
            if not session.played_s:
                self._written.discard(path)
                self.notified.emit("Nothing was recorded: the engine has not started.")
        self.changed.emit(session.recording)

    def is_written(self, path: Path) -> bool:
        """Return whether this file is recorded to, or was and is not closed yet."""
        return path in self._written

    def take_file(self, file: RecordingFile) -> None:
        """Say that a recording was saved once its file is whole: one that was short begins after its end.

        One that could not be continued is cut before it is ended.
        """
        if file.state == "begun" and file.path in self._written:
            self.begun = file.path
        elif file.path in self._written:
            self._written.discard(file.path)
            if file.state == "whole":
                saved = f"The recording was saved as {file.path}"
                empty = "Nothing was recorded: the recording ended before its first sample."
                self.notified.emit(saved if file.path.exists() else empty)
        if file.state == "cut" and not self.is_on:
            self.changed.emit(None)
        self.file_changed.emit(file.path)


def _reserved_recording() -> Path:
    """Return an empty new file named by the time; it has a number, too, if that was taken in this second.

    What another window records in this second may not be there yet, but its empty file is.
    """
    folder = documents_folder()
    folder.mkdir(parents=True, exist_ok=True)
    name = name_now()
    paths = (folder / f"{name}{'' if k == 1 else f' {k}'}.underfoot" for k in count(1))
    return next(path for path in paths if _reserves(path))


def _reserves(path: Path) -> bool:
    """Make an empty file; return whether nobody else had. Where none can be made, the recorder says why."""
    try:
        path.touch(exist_ok=False)
    except OSError as error:
        return not isinstance(error, FileExistsError)
    return True
