"""The file of a window's settings, which follows them while the window is open."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from PySide6.QtCore import QLockFile, QObject, QTimer

from underfoot.errors import UnderfootError
from underfoot.widgets.session.settings import Settings, file_in

LOOK_MS = 2000
"""Interval between checks for changes: the most that is lost if the window is killed."""
LOCK_MS = 5000
"""Longest wait for other windows that write; each takes milliseconds, and one that hangs must not hold the others."""
UNREADABLE = "unreadable-settings.json"
"""Name under which a file that cannot be read is kept beside the new one."""


class SettingsFile(QObject):
    """Loads the `settings` in `folder`, and writes their changes; what other windows change there stays.

    `notify` receives errors; `refused` has a line for each setting that could not be read, or for the whole file.
    """

    def __init__(self, folder: Path, notify: Callable[[str], None], parent: QObject) -> None:
        super().__init__(parent)
        found, why = Settings.read(folder)
        kept = "" if found else f"; the first settings are used, and it is kept as {UNREADABLE}"
        self.refused = [f"{line}{kept}" for line in why]
        self.settings = found or Settings()
        self._folder, self._notify = folder, notify
        self._last_written = self.settings.copy()
        self._writing: Future[None] | None = None
        self._writer = ThreadPoolExecutor(1, "settings")
        self._timer = QTimer(self, interval=LOOK_MS)
        self._timer.timeout.connect(self._write_changes)
        self._timer.start()

    def save(self) -> None:
        """Write the settings now."""
        try:
            self._writer.submit(self._write, self.settings.copy()).result()
        except (UnderfootError, OSError) as error:
            self._notify(str(error))

    def close(self) -> None:
        """Write the settings, the last time."""
        self._timer.stop()
        self.save()
        self._writer.shutdown()

    def _write_changes(self) -> None:
        """Write changes, in a thread because disks can be slow, and again after an error, as of a disk that was full.

        An error is reported when the window closes.
        """
        if self._last_written != self.settings and (self._writing is None or self._writing.done()):
            self._writing = self._writer.submit(self._write, self.settings.copy())

    def _write(self, settings: Settings) -> None:
        """Write what has changed since the last time; all of it where the file is gone, or cannot be
        read: a person may have edited it. Runs in the thread.

        Under a lock: a window that reads before another has written, and writes after it, takes back what it wrote.
        """
        lock = QLockFile(str(self._folder / "settings.lock"))
        lock.tryLock(LOCK_MS)
        try:
            there, why = Settings.read(self._folder)
            if there is None and why and file_in(self._folder).is_file():
                file_in(self._folder).replace(self._folder / UNREADABLE)
            made = settings if there is None else settings.added_to(there, self._last_written)
            made.save(self._folder)
        finally:
            lock.unlock()
        self._last_written = settings
