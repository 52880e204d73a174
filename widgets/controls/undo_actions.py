"""Undo and redo of a document: two actions with their keys, which name the step they take back."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence, QUndoGroup, QUndoStack
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QWidget

from underfoot.widgets.controls.menu import Shortcut, add_action, literal


class UndoActions(QObject):
    """Actions `undo` and `redo` of a history, with their shortcuts in `owner` and in what is inside it."""

    used = Signal(str)
    """What was undone or redone, as "Undone: move 3 nodes"."""

    def __init__(self, history: QUndoGroup | QUndoStack, owner: QWidget) -> None:
        super().__init__(owner)
        self._history, self._owner = history, owner
        self.undo = self._action("Undo", "Ctrl+Z", self.take_back)
        self.redo = self._action("Redo", ("Ctrl+Shift+Z", "Ctrl+Y"), self.repeat)
        history.undoTextChanged.connect(lambda text: _name_step(self.undo, "Undo", text))
        history.redoTextChanged.connect(lambda text: _name_step(self.redo, "Redo", text))
        history.canUndoChanged.connect(self.undo.setEnabled)
        history.canRedoChanged.connect(self.redo.setEnabled)

    def take_back(self) -> None:
        """Undo the last edit, and say its name."""
        text = self._history.undoText()
        self._history.undo()
        self.used.emit(f"Undone: {_lower_first(text)}")

    def repeat(self) -> None:
        """Redo the last undone edit, and say its name."""
        text = self._history.redoText()
        self._history.redo()
        self.used.emit(f"Redone: {_lower_first(text)}")

    def _action(self, name: str, keys: Shortcut, do: Callable[[], None]) -> QAction:
        action = add_action(self._owner, name, keys, do, Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.setIconText(name)
        action.setEnabled(False)
        _name_step(action, name, "")
        return action


class DocumentLine(QLineEdit):
    """A line of text that is part of a document: undo is the document's, where there is one, else its own."""

    def event(self, event: QEvent) -> bool:
        return left_to_document(event) or super().event(event)


class DocumentText(QPlainTextEdit):
    """The same with several lines."""

    def event(self, event: QEvent) -> bool:
        return left_to_document(event) or super().event(event)


def left_to_document(event: QEvent) -> bool:
    """Refuse the keys of undo and redo before Qt asks for shortcuts, so that those of the document get them."""
    keys = (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo)
    is_asked = event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
    if is_asked and any(event.matches(key) for key in keys):  # type: ignore[attr-defined]
        event.ignore()
        return True
    return False


def _name_step(action: QAction, word: str, text: str) -> None:
    """Set an action's text to `word` and the name of its undo step."""
    words = f"{word}: {_lower_first(text)}" if text else word
    action.setText(literal(words))
    action.setToolTip(f"{words} ({action.shortcut().toString(QKeySequence.SequenceFormat.NativeText)})")


def _lower_first(text: str) -> str:
    """Return the name of a step with a lower-case first letter, to follow a colon.

    >>> _lower_first("Move 3 nodes")
    'move 3 nodes'
    """
    return text[:1].lower() + text[1:]
