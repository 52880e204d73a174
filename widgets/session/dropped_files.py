"""Files that are dropped on the window or pasted, opened by the format that they name, or by suffix."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QWidget

from underfoot.documents import document_format
from underfoot.errors import UnderfootError
from underfoot.widgets.controls.local_files import local_files

Handlers = Mapping[str, Callable[[Path], object]]
"""Functions that open a file, by the format of its document, or its suffix with the dot, in lower case."""


class DroppedFiles(QObject):
    """Opens the first file dropped on `window` that has a handler, and reports others as not opened. The cursor shows
    when no file has a handler.

    `handlers` is called when something is dragged here, so that nothing is imported before.
    """

    def __init__(
        self,
        window: QWidget,
        handlers: Callable[[], Handlers],
        notify: Callable[[str], object],
        refuse: Callable[[Path, str], object],
    ) -> None:
        """`notify` shows a line; `refuse` shows why a file cannot be read."""
        super().__init__(window)
        self._handlers, self._notify, self._refuse = handlers, notify, refuse
        window.setAcceptDrops(True)
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QDragEnterEvent) and event.type() == QEvent.Type.DragEnter:
            if self._known(local_files(event.mimeData())):
                event.acceptProposedAction()
            return True
        if isinstance(event, QDropEvent) and event.type() == QEvent.Type.Drop:
            paths = local_files(event.mimeData())
            if self._known(paths):
                event.acceptProposedAction()
                self.open(paths)
            return True
        return super().eventFilter(watched, event)

    def open(self, paths: Sequence[Path]) -> None:
        """Open the first of these that can be opened; report in the status line those that cannot."""
        known = self._known(paths)
        if not known:
            self._notify(f"{paths[0].name} cannot be opened here")
            return
        path, open_file = known[0]
        try:
            open_file(path)
        except UnderfootError as error:
            self._refuse(path, str(error))
        if len(paths) > 1:
            self._notify(f"One file at a time: {path.name} is taken, {len(paths) - 1} more not")

    def _known(self, paths: Sequence[Path]) -> list[tuple[Path, Callable[[Path], object]]]:
        """Return the files that can be opened, each with what opens it."""
        handlers = self._handlers() if paths else {}
        return [(path, handlers[kind]) for path in paths if (kind := _kind(path, handlers)) in handlers]


def _kind(path: Path, handlers: Handlers) -> str:
    """Return what a file is opened by: its suffix or, of JSON and unknown ones, the format that is named in it."""
    suffix = path.suffix.lower()
    if suffix != ".json" and suffix in handlers:
        return suffix
    named = document_format(path)
    return named if named in handlers else suffix
