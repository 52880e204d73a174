"""A text field over the item that it names, on the canvas or in a list; it closes after editing."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QRect, Qt, QTimer
from PySide6.QtGui import QFocusEvent, QKeyEvent
from PySide6.QtWidgets import QPlainTextEdit, QWidget

from underfoot.widgets import theme
from underfoot.widgets.escape import claims_escape

HEIGHT, MIN_WIDTH, MAX_WIDTH, NOTE_HEIGHT = 30, 160, 360, 96


class InlineEdit(QPlainTextEdit):
    """Enter (Ctrl+Enter for several lines) or a click elsewhere commits the text; Escape cancels."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._parent_widget = parent
        self._on_done: Callable[[str], object] | None = None
        self._is_line = True
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setStyleSheet(f"QPlainTextEdit {{ border: 1px solid {theme.VIBRATION}; padding: 2px 4px; }}")
        self.setTabChangesFocus(True)
        self.setAccessibleName("Name or note")
        self.hide()

    def open(self, over: QRect, text: str, on_done: Callable[[str], object], *, one_line: bool = True) -> None:
        """Open over a rectangle of the parent; `on_done` receives the text if it is committed.

        If it returns False, the text is not allowed, and stays there to be changed.
        """
        self._on_done, self._is_line = on_done, one_line
        self.put_over(over)
        wrap = QPlainTextEdit.LineWrapMode
        self.setLineWrapMode(wrap.NoWrap if one_line else wrap.WidgetWidth)
        self.setPlainText(text)
        self.selectAll()
        self.show()
        self.raise_()
        self.setFocus()

    def put_over(self, over: QRect) -> None:
        """Move it over a rectangle of the parent, or as near as it is inside of the parent."""
        min_height = HEIGHT if self._is_line else NOTE_HEIGHT
        room = self._parent_widget.rect()
        width = min(max(over.width(), MIN_WIDTH), MAX_WIDTH if self._is_line else room.width(), room.width() - 8)
        size = QRect(over.x(), over.y(), width, max(0 if self._is_line else over.height(), min_height))
        size.moveLeft(max(min(size.x(), room.width() - size.width() - 4), 4))
        size.moveTop(max(min(size.y(), room.height() - size.height() - 4), 4))
        self.setGeometry(size)

    def finish(self, commit: bool) -> None:
        """Close the field, and commit or discard the text."""
        on_done, self._on_done = self._on_done, None
        if on_done is None:
            return
        had_focus = self.hasFocus()
        text = " ".join(self.toPlainText().split()) if self._is_line else self.toPlainText().strip()
        if commit and on_done(text) is False and self.isVisible():
            self._on_done = on_done
            if not had_focus:
                QTimer.singleShot(0, self.setFocus)  # once the click elsewhere is done
            return
        self.hide()
        if had_focus:
            self._parent_widget.setFocus()

    def event(self, event: QEvent) -> bool:
        # Escape goes to the field, not to a shortcut of the window.
        return claims_escape(event) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        if event.key() == Qt.Key.Key_Escape:
            self.finish(commit=False)
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and (self._is_line or control):
            self.finish(commit=True)
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in (Qt.FocusReason.PopupFocusReason, Qt.FocusReason.ActiveWindowFocusReason):
            self.finish(commit=True)
