"""Files dropped on the window, opened by suffix."""

from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QWidget

Handlers = Mapping[str, Callable[[Path], object]]
"""Functions that open a file, by its suffix with the dot, in lower case."""


class DroppedFiles(QObject):
    """Accepts the first file dropped on `window` that has a handler; the cursor shows that others are rejected.

    `handlers` is called when something is dragged here, so that nothing is imported before.
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
