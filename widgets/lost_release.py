"""How a widget that holds something with the mouse learns that the release of the button will not come."""

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication


def is_release_lost(event: QEvent) -> bool:
    """Return whether the release of a button goes elsewhere by this event of a widget, or went before it: the widget is
    hidden, or a dialog or a menu opens, which takes the mouse.
    """
    if event.type() == QEvent.Type.Leave:
        return QApplication.activePopupWidget() is not None
    if event.type() == QEvent.Type.MouseMove:
        return isinstance(event, QMouseEvent) and event.buttons() == Qt.MouseButton.NoButton
    return event.type() in (QEvent.Type.Hide, QEvent.Type.WindowBlocked)
