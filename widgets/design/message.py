"""A message over the canvas that disappears when it can have been read."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QLabel, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.announcing import announce

VISIBLE_MS, READING_MS = 5000, 60
"""How long a line stays: what it takes to notice and read a short one; more by the sign (1000 a minute) a long one."""


class Message(QLabel):
    """A message at the bottom centre of its parent."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._parent_widget = parent
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.hide()
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self.hide)

    def show_text(self, text: str, *, alarm: bool) -> None:
        """Show a line, in red or green; "" hides it."""
        self.setVisible(bool(text))
        if not text:
            return
        accent, ground = (theme.ALARM, "alarming") if alarm else (theme.CONTACT, "assuring")
        self.setStyleSheet(
            f"background: {theme.PALETTE[ground]}; color: {theme.TEXT};"
            f"border: 1px solid {accent}; border-radius: 4px; padding: 6px 10px;"
        )
        self.setText(text)
        announce(self, text)
        self.setFixedWidth(min(self._parent_widget.width() - 32, self.fontMetrics().horizontalAdvance(text) + 32))
        self.adjustSize()
        self.move((self._parent_widget.width() - self.width()) // 2, self._parent_widget.height() - self.height() - 16)
        self.raise_()
        self._timer.start(max(VISIBLE_MS, READING_MS * len(text)))

    @property
    def visible_text(self) -> str:
        """The visible text."""
        return "" if self.isHidden() else self.text()
