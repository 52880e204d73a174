"""The copy of an unsaved study, which outlives its window and a crash."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from underfoot.errors import UnderfootError
from underfoot.files import make_folder, read_file
from underfoot.widgets.session.autosave import AUTOSAVE_MS, CopyWriter, WorkSlot


class DraftCopy(QObject):
    """Copies what is unsaved of a study into the window's slot beside the user's protocols."""

    def __init__(
        self, folder: Path, unsaved: Callable[[], str], notify: Callable[[str], object], parent: QObject
    ) -> None:
        """`unsaved` returns what is to be kept, "" for nothing; `notify` takes a line for the user, in any thread."""
        super().__init__(parent)
        self._folder, self._unsaved, self._notify = folder, unsaved, notify
        self._slot: WorkSlot | None = None
        self._timer = QTimer(self, singleShot=True, interval=AUTOSAVE_MS)
        self._timer.timeout.connect(self.update)
        self._writer = CopyWriter(notify, self._timer)
        self.update_soon = self._timer.start

    def update(self) -> None:
        """Write the copy in a thread, or remove it if all is saved."""
        self._timer.stop()
        self._writer.submit(self._keep, self._unsaved())

    def is_kept(self) -> bool:
        """Write the copy, and return whether nothing is lost; show errors."""
        self._timer.stop()
        try:
            self._writer.submit(self._keep, self._unsaved()).result()
        except (UnderfootError, OSError) as error:
            self._notify(str(error))
            return False
        return True

    def found(self) -> str:
        """Return what a window left that was closed or crashed; "" for nothing. `UnderfootError` if it is no text."""
        if not self._folder.is_dir():
            return ""
        slot = self._slot = self._slot or WorkSlot(self._folder, "unsaved", ".draft")
        return read_file(slot.path).decode(errors="replace") if slot.is_own and slot.path.is_file() else ""

    def put_aside(self) -> None:
        """Move what was found, and cannot be read, where no copy replaces it; tell where."""
        assert self._slot is not None
        try:
            self._notify(self._slot.keep_unreadable())
        except UnderfootError as error:
            self._notify(str(error))

    def close(self) -> None:
        """Write what was not copied yet; the copy stays for the next window."""
        self.is_kept()
        self._writer.close()
        if self._slot is not None:
            self._slot.close()

    def _keep(self, unsaved: str) -> None:
        if unsaved:
            self._slot = self._slot or WorkSlot(make_folder(self._folder), "unsaved", ".draft")
            self._slot.write_bytes(unsaved.encode())
        elif self._slot is not None:
            self._slot.remove()
