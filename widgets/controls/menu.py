"""Actions with their keys, a menu over a widget whose keys are letters, and names in menus."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QMenu, QWidget

Shortcut = QKeySequence.StandardKey | str | tuple[str, ...]


def literal(text: str) -> str:
    """Return a text for a menu or a button in which & is a sign: there, a single one would mark the next letter.

    >>> literal("Heel & toe")
    'Heel && toe'
    """
    return text.replace("&", "&&")


def add_action(
    owner: QWidget,
    text: str,
    keys: Shortcut,
    do: Callable[[], object],
    where: Qt.ShortcutContext = Qt.ShortcutContext.WidgetShortcut,
) -> QAction:
    """Add an action to a widget, and return it; by default its keys work while the widget has the focus."""
    action = QAction(text, owner)
    if isinstance(keys, QKeySequence.StandardKey):
        action.setShortcuts(keys)
    else:
        action.setShortcuts([QKeySequence(key) for key in ((keys,) if isinstance(keys, str) else keys)])
    action.setShortcutContext(where)
    action.triggered.connect(lambda _=False: do())
    owner.addAction(action)
    return action


class Menu(QMenu):
    """A menu that keeps typed letters to itself; Qt would hand them on to the shortcuts of the widget below."""

    def open_once(self, place: QPoint) -> None:
        """Open at a place of the screen; the menu is deleted when it closes."""
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.popup(place)

    def event(self, event: QEvent) -> bool:
        # Keys without text, such as F12, stay shortcuts.
        is_typed = isinstance(event, QKeyEvent) and event.text() != "" and event.text().isprintable()
        if is_typed and event.type() == QEvent.Type.ShortcutOverride:
            event.accept()
            return True
        return super().event(event)
