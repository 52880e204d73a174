"""The file of a window's settings, which follows them while the window is open."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from underfoot.errors import UnderfootError
from underfoot.widgets.session.settings import Settings

LOOK_MS = 2000
"""Interval between checks for changes: the most that is lost if the window is killed."""


class SettingsFile(QObject):
    """Loads the `settings` in `folder`, and writes them after changes; `notify` receives errors."""

    def __init__(self, folder: Path, notify: Callable[[str], None], parent: QObject) -> None:
        super().__init__(parent)
        self.settings = Settings.load(folder)
        self._folder, self._notify = folder, notify
        self._written = self.settings.encoded()
        self._writer = ThreadPoolExecutor(1, "settings")
        self._timer = QTimer(self)
        self._timer.setInterval(LOOK_MS)
        self._timer.timeout.connect(self._write_changes)
        self._timer.start()

    def save(self) -> None:
        """Write the settings now."""
        self._written = self.settings.encoded()
        try:
            self._writer.submit(Settings.write, self._written, self._folder).result()
        except (UnderfootError, OSError) as error:
            self._notify(str(error))

    def close(self) -> None:
        """Write the settings, the last time."""
        self._timer.stop()
        self.save()
        self._writer.shutdown()

    def _write_changes(self) -> None:
        """Write changes, in a thread because disks can be slow; an error is reported when the window closes."""
        if self._written != (encoded := self.settings.encoded()):
            self._written = encoded
            self._writer.submit(Settings.write, encoded, self._folder)
