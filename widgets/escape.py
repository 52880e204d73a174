"""Escape closes something open, or else is panic: how a widget with something open claims the key."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent


def claims_escape(event: QEvent, has_open: Callable[[], object] = lambda: True) -> bool:
    """Accept an event that asks a widget if it uses Escape, before the window does; return whether it was accepted.

    It is if the widget `has_open` what Escape closes. Shift+Escape is never asked for: that is always panic.
    """
    if event.type() != QEvent.Type.ShortcutOverride or not isinstance(event, QKeyEvent):
        return False
    is_escape = event.key() == Qt.Key.Key_Escape and not event.modifiers() & Qt.KeyboardModifier.ShiftModifier
    if not (is_escape and has_open()):
        return False
    event.accept()
    return True
