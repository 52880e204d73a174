"""Import and export of the open patch, from the menu and for files dropped on the window."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QMainWindow, QMessageBox

from underfoot.errors import UnderfootError
from underfoot.widgets.dialogs.file_question import FileQuestion
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.dropped_files import Handlers
from underfoot.widgets.session.open_patch import OpenPatch

if TYPE_CHECKING:
    from underfoot.exchange.format import Imported


class Exchange(QObject):
    """Reads files of other programs in a thread, and opens the resulting patch; shows the export dialog.

    The formats are imported on first use, since they load the renderer.
    """

    _came = Signal(object)

    def __init__(
        self,
        window: QMainWindow,
        open_patch: OpenPatch,
        controller: SessionController,
        files: FileQuestion,
        say: Callable[[str], object],
    ) -> None:
        super().__init__(window)
        self._window, self._open_patch, self._controller = window, open_patch, controller
        self._files, self._say = files, say
        self._reader = ThreadPoolExecutor(1, "import")
        self._came.connect(self._show, Qt.ConnectionType.QueuedConnection)

    def ask(self) -> None:
        """Ask for a file, and import it once the present patch is safe."""
        from underfoot.exchange.formats import READ

        every = " ".join(sorted({f"*{suffix}" for one in READ for suffix in one.suffixes}))
        each = [f"{one.label} ({' '.join(f'*{suffix}' for suffix in one.suffixes)})" for one in READ]
        filter = ";;".join([f"All that can be imported ({every})", *each])
        self._open_patch.when_safe(lambda: self._files.ask("Import", filter, self._read))

    def open(self, path: Path) -> None:
        """Import a file once the present patch is safe."""
        self._open_patch.when_safe(lambda: self._read(path))

    def handlers(self) -> Handlers:
        """Return the functions for dropped files. JSON is a patch, unless its content identifies another program."""
        from underfoot.exchange.formats import READ

        def open_json(path: Path) -> None:
            (self.open if any(one.matches(path) for one in READ) else self._open_patch.open)(path)

        return {suffix: self.open for one in READ for suffix in one.suffixes} | {".json": open_json}

    def export(self) -> None:
        """Show the formats, and export the patch in one of them."""
        from underfoot.exchange.format import Export
        from underfoot.widgets.dialogs.export_dialog import ExportDialog

        def what(walks: bool) -> Export:
            target = self._controller.target
            profiles = Path(target.profiles) if target.profiles else None
            floor = target.floor if walks else None
            return Export(self._open_patch.patch, self._open_patch.folder, floor=floor, profiles=profiles)

        ExportDialog(what, self._open_patch.name, self._files, self._window).open()

    def close(self) -> None:
        """Stop, when the window closes."""
        self._reader.shutdown(wait=False, cancel_futures=True)

    def _read(self, path: Path) -> None:
        from underfoot.exchange.format import read_foreign_patch
        from underfoot.exchange.formats import to_read

        self._say(f"Importing {path.name}…")
        self._reader.submit(lambda: read_foreign_patch(to_read(path), path)).add_done_callback(
            lambda future: self._came.emit((path, _answer(future)))
        )

    def _show(self, came: "tuple[Path, Imported | UnderfootError]") -> None:
        path, answer = came
        if isinstance(answer, UnderfootError):
            self._say(str(answer))
            return
        self._open_patch.take_over(answer.patch)
        self._say(f"Imported {path.name}: it plays at each footfall")
        if answer.losses:
            box = QMessageBox(self._window)
            box.setWindowTitle("Import")
            box.setText(f"What of {path.name} is not in the patch:")
            box.setInformativeText("\n".join(f"• {line}" for line in _short(answer.losses)))
            box.finished.connect(box.deleteLater)
            box.open()


def _answer(future: "Future[Imported]") -> "Imported | UnderfootError":
    """Return the result of reading; unexpected errors are raised again."""
    error = future.exception()
    if isinstance(error, UnderfootError):
        return error
    return future.result()


def _short(lines: tuple[str, ...], most: int = 12) -> list[str]:
    """Return at most this many lines, and the number of the others."""
    return [*lines[:most], *([f"and {len(lines) - most} more"] if len(lines) > most else [])]
