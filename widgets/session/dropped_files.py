"""Files that are dropped on the window: each suffix has what opens it."""

from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QWidget

Handlers = Mapping[str, Callable[[Path], object]]
"""What opens a file, by its suffix with the dot, in small letters."""


class DroppedFiles(QObject):
    """Takes the first file that is dropped on `window` and has a handler; others are not taken, as the cursor shows.

    `handlers` is asked when something is dragged here, so that nothing is imported before.
    """

    def __init__(self, window: QWidget, handlers: Callable[[], Handlers]) -> None:
        super().__init__(window)
        self._handlers = handlers
        window.setAcceptDrops(True)
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QDragEnterEvent) and event.type() == QEvent.Type.DragEnter:
            if self._first(event) is not None:
                event.acceptProposedAction()
            return True
        if isinstance(event, QDropEvent) and event.type() == QEvent.Type.Drop:
            path = self._first(event)
            if path is not None:
                event.acceptProposedAction()
                self._handlers()[path.suffix.lower()](path)
            return True
        return super().eventFilter(watched, event)

    def _first(self, event: QDropEvent) -> Path | None:
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        return next((path for path in paths if path.suffix.lower() in self._handlers()), None)
