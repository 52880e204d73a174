"""Import and export of the open patch, from the menu and for files dropped on the window."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QMainWindow

from underfoot.errors import UnderfootError
from underfoot.quantities import first_of
from underfoot.widgets.controls.question import message_box
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.dropped_files import Handlers
from underfoot.widgets.session.open_patch import OpenPatch

if TYPE_CHECKING:
    from underfoot.exchange.format import Imported
    from underfoot.patch.patch import Patch

MOST_LINES = 12
"""Of what an import left out."""


class Exchange(QObject):
    """Reads files of other programs in a thread, and opens the resulting patch; shows the export dialog.

    The formats are imported on first use, since they load the renderer.
    """

    _imported = Signal(object)

    def __init__(
        self,
        window: QMainWindow,
        open_patch: OpenPatch,
        controller: SessionController,
        file_chooser: FileChooser,
        notify: Callable[[str], object],
    ) -> None:
        super().__init__(window)
        self._window, self._open_patch, self._controller = window, open_patch, controller
        self._file_chooser, self._notify = file_chooser, notify
        self._reader = ThreadPoolExecutor(1, "import")
        self._imported.connect(self._show, Qt.ConnectionType.QueuedConnection)

    def ask(self) -> None:
        """Ask for a file, and import it once the present patch is safe."""
        from underfoot.exchange.formats import READ

        all_suffixes = " ".join(sorted({f"*{suffix}" for one in READ for suffix in one.suffixes}))
        filters = [f"{one.label} ({' '.join(f'*{suffix}' for suffix in one.suffixes)})" for one in READ]
        filter = ";;".join([f"All that can be imported ({all_suffixes})", *filters])
        self._open_patch.ask_to_save(lambda: self._file_chooser.ask("Import", filter, self._read))

    def open(self, path: Path) -> None:
        """Import a file once the present patch is safe."""
        self._open_patch.ask_to_save(lambda: self._read(path))

    def handlers(self) -> Handlers:
        """Return the functions for dropped files. JSON is a patch, unless its content identifies another program."""
        from underfoot.exchange.formats import READ
        from underfoot.patch.patch import FORMAT

        def open_json(path: Path) -> None:
            (self.open if any(one.matches(path) for one in READ) else self._open_patch.open)(path)

        imports = {suffix: self.open for one in READ for suffix in one.suffixes}
        return imports | {".json": open_json, FORMAT: self._open_patch.open}

    def export(self) -> None:
        """Show the formats, and export the patch in one of them."""
        from underfoot.exchange.format import Export
        from underfoot.widgets.dialogs.export_dialog import ExportDialog

        def make_export(walks: bool) -> Export:
            target = self._controller.target
            profiles = Path(target.profiles) if target.profiles else None
            floor = target.floor if walks else None
            return Export(self._open_patch.patch, self._open_patch.folder, floor=floor, profiles=profiles)

        ExportDialog(make_export, self._open_patch.name, self._file_chooser, self._window).open()

    def close(self) -> None:
        """Stop, when the window closes."""
        self._reader.shutdown(wait=False, cancel_futures=True)

    def _read(self, path: Path) -> None:
        from underfoot.exchange.format import read_foreign_patch
        from underfoot.exchange.formats import to_read

        self._notify(f"Importing {path.name}…")
        asked_about = self._open_patch.patch
        self._reader.submit(lambda: read_foreign_patch(to_read(path), path)).add_done_callback(
            lambda future: self._imported.emit((path, asked_about, _result_of(future)))
        )

    def _show(self, result: "tuple[Path, Patch, Imported | UnderfootError]") -> None:
        path, asked_about, imported = result
        if isinstance(imported, UnderfootError):
            self._open_patch.not_read.emit(path, str(imported))
        elif self._open_patch.patch is asked_about:
            self._open(path, imported)
        else:  # edited while the file was read
            self._open_patch.ask_to_save(lambda: self._open(path, imported))

    def _open(self, path: Path, imported: "Imported") -> None:
        self._open_patch.open_untitled(imported.patch)
        self._notify(f"Imported {path.name}: it plays at each footfall")
        if imported.losses:
            losses = "\n".join(f"• {line}" for line in first_of(imported.losses, MOST_LINES))
            message_box(self._window, "Import", f"What of {path.name} is not in the patch:", losses).open()


def _result_of(future: "Future[Imported]") -> "Imported | UnderfootError":
    """Return the result of reading; unexpected errors are raised again."""
    error = future.exception()
    if isinstance(error, UnderfootError):
        return error
    return future.result()
