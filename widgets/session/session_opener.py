"""Opening and closing of sessions in threads: loading kernels and ending processes takes longer than a frame."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

if TYPE_CHECKING:
    from underfoot.engine.session import Session


class SessionOpener(QObject):
    """Opens or closes one session at a time, because two may use the same sound card."""

    opened = Signal(object)
    """The `Session`, which is starting."""
    failed = Signal(str)
    """Why the target cannot be used."""
    noted = Signal(str)
    """What kept the recording of a session that was closed from being whole."""
    recording_file_changed = Signal(object)
    """`RecordingFile`, of the recording that the end of its session has ended."""
    closed = Signal()
    """The session passed to `end` is closed, and its devices are free."""

    def __init__(self, registry: Registry, engine: ChildProcess | None, parent: QObject) -> None:
        """Create the opener; `engine` is a process started for the first session."""
        super().__init__(parent)
        self._registry, self._engine = registry, engine
        self._thread: threading.Thread | None = None
        self._undelivered: Session | None = None
        self.opened.connect(self._note_delivery)

    @property
    def is_busy(self) -> bool:
        """Whether a session is being opened or closed."""
        return self._thread is not None and self._thread.is_alive()

    def open(self, target: Target, patch: Patch, folder: Path | None, prepare: Callable[["Session"], object]) -> None:
        """Create a session, call `prepare` with it in the thread, and start it; `opened` or `failed` follows."""
        engine, self._engine = self._engine, None

        def make() -> None:
            from underfoot.engine.session import Session

            try:
                self._undelivered = session = Session(target, patch, self._registry, folder, engine)
            except UnderfootError as error:
                self.failed.emit(str(error))
                return
            prepare(session)
            session.start()
            self.opened.emit(session)

        self._run(make, "open session")

    def end(self, session: "Session") -> None:
        """Close a session; `closed` follows."""

        def close() -> None:
            for line in session.close():
                self.noted.emit(line)
            for file in session.recording_files():
                self.recording_file_changed.emit(file)
            self.closed.emit()

        self._run(close, "close session")

    def close(self) -> None:
        """Wait for the thread; close a session that was opened but not delivered, and an engine that was not used."""
        if self._thread is not None:
            self._thread.join()
        if self._undelivered is not None:
            self._undelivered.close()
        if self._engine is not None:
            self._engine.end(0.0)

    def _note_delivery(self) -> None:
        self._undelivered = None

    def _run(self, work: Callable[[], None], name: str) -> None:
        self._thread = threading.Thread(target=work, name=name)
        self._thread.start()
