"""Escape closes something open, or else is panic: how a widget with something open claims the key."""

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent


def is_escape_override(event: QEvent) -> bool:
    """Return whether an event asks a widget if it uses Escape, before the window does.

    A widget that accepts such an event closes something. Shift+Escape is never asked for: that is always panic.
    """
    if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
        return False
    return event.key() == Qt.Key.Key_Escape and not event.modifiers() & Qt.KeyboardModifier.ShiftModifier
