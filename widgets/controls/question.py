"""A question before something is replaced or deleted."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox, QWidget


def ask(parent: QWidget, title: str, text: str, yes: str, then: Callable[[], object], no: str = "Cancel") -> None:
    """Ask, without waiting: the button `yes` calls `then`; `no`, Return and Escape change nothing."""
    box = QMessageBox(parent)
    box.setWindowTitle(title)
    box.setTextFormat(Qt.TextFormat.PlainText)  # names may have signs that would be markup
    box.setText(text)
    box.setStandardButtons(QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel)
    box.setDefaultButton(QMessageBox.StandardButton.Cancel)
    box.button(QMessageBox.StandardButton.Yes).setText(yes)
    box.button(QMessageBox.StandardButton.Cancel).setText(no)
    box.accepted.connect(lambda: then())
    box.finished.connect(box.deleteLater)
    box.open()
