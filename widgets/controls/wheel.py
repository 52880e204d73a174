"""Which widgets take the wheel: none on its way past, which would change what nobody clicked."""

from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QWidget


def takes_wheel(widget: QWidget, event: QWheelEvent) -> bool:
    """Return whether the wheel is meant for a widget, which then has the focus; otherwise what is around it scrolls."""
    if not widget.hasFocus():
        event.ignore()
    return widget.hasFocus()
