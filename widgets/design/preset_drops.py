"""Drag and drop of presets from their list."""

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, QMimeData, QObject
from PySide6.QtGui import QDropEvent
from PySide6.QtWidgets import QWidget

MIME = "application/x-underfoot-preset"
_DRAGS = (QEvent.Type.DragEnter, QEvent.Type.DragMove, QEvent.Type.Drop)


def dragged(path: Path) -> QMimeData:
    """Return the drag data of a preset.

    >>> dragged(Path("ice.json")).data(MIME).data()
    b'ice.json'
    """
    data = QMimeData()
    data.setData(MIME, str(path).encode())
    return data


class PresetDrops(QObject):
    """Lets widgets accept dropped presets."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._takers: dict[QObject, Callable[[Path], object]] = {}

    def accept_on(self, widget: QWidget, take: Callable[[Path], object]) -> None:
        """Pass a preset that is dropped on this widget to `take`."""
        self._takers[widget] = take
        widget.setAcceptDrops(True)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in _DRAGS and isinstance(event, QDropEvent) and event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()
            if event.type() == QEvent.Type.Drop:
                self._takers[watched](Path(bytes(event.mimeData().data(MIME).data()).decode()))
            return True
        return super().eventFilter(watched, event)
