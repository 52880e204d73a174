"""Messages and questions in a box over the window."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QInputDialog, QLabel, QMessageBox, QWidget

from underfoot.errors import UnderfootError


def message_box(parent: QWidget | None, title: str, text: str, more: str = "") -> QMessageBox:
    """Return a box, not yet open, that shows a text, and `more` in smaller letters, as they are: names may have signs
    that would be markup.
    """
    box = QMessageBox(parent)
    box.setWindowTitle(title)
    box.setTextFormat(Qt.TextFormat.PlainText)
    box.setText(text)
    if more:
        box.setInformativeText(more)
        label = box.findChild(QLabel, "qt_msgbox_informativelabel")
        assert label is not None
        label.setTextFormat(Qt.TextFormat.PlainText)
    box.finished.connect(box.deleteLater)
    return box


def ask(parent: QWidget, title: str, text: str, yes: str, then: Callable[[], object], no: str = "Cancel") -> None:
    """Ask before something is replaced or deleted, without waiting.

    The button `yes` calls `then`; `no`, Return and Escape change nothing.
    """
    box = message_box(parent, title, text)
    box.setStandardButtons(QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(QMessageBox.StandardButton.Cancel)
    box.button(QMessageBox.StandardButton.Yes).setText(yes)
    box.button(QMessageBox.StandardButton.Cancel).setText(no)
    box.accepted.connect(lambda: then())
    box.open()


def ask_text(parent: QWidget, title: str, question: str, take: Callable[[str], object], text: str = "") -> None:
    """Ask for a line of text, without waiting; `take` is called with it, and Escape changes nothing.

    Where `take` raises an `UnderfootError`, that is said below the question, and what was typed can be mended.
    """
    dialog = _TextDialog(parent, question, take)
    dialog.setWindowTitle(title)
    dialog.setTextValue(text)
    dialog.finished.connect(dialog.deleteLater)
    dialog.open()


class _TextDialog(QInputDialog):
    def __init__(self, parent: QWidget, question: str, take: Callable[[str], object]) -> None:
        super().__init__(parent)
        self._question, self._take = question, take
        self.setLabelText(question)

    def accept(self) -> None:
        try:
            self._take(self.textValue())
        except UnderfootError as error:
            self.setLabelText(f"{self._question}\n\n{error}.")
        else:
            super().accept()
