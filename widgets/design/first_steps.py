"""The first three steps, on the canvas itself: play, press the tile, drag a number."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QToolButton, QVBoxLayout, QWidget

from underfoot.widgets import theme

STEPS = {
    "play": "Press Space: a simulated person walks over the floor, and each step sounds.",
    "press": "Click on the tile at the lower right to strike it; drag on it to press it.",
    "turn": "Select a node, and drag one of its numbers at the right: it is heard at once.",
}
"""What is to be done, in this order; each ticks itself off when it was done."""
ALL_DONE_TEXT = "That is all of it: force in, vibration out. Presets are behind Ctrl+P, every key behind F1."
_WIDTH = 312


class FirstSteps(QFrame):
    """Lies at the lower left of the canvas while it is `is_wanted`. `closed` when the person has put it away."""

    closed = Signal()

    def __init__(self, canvas: QWidget, is_wanted: Callable[[], bool]) -> None:
        super().__init__(canvas)
        self._canvas, self._is_wanted = canvas, is_wanted
        self._done: set[str] = set()
        self.setObjectName("steps")
        self.setStyleSheet(
            f"#steps {{ background: {theme.PANEL}; border: 1px solid {theme.LINE}; border-radius: 6px; }}"
        )
        self.setFixedWidth(_WIDTH)
        self.close_button = QToolButton(self)
        self.close_button.setText("×")
        self.close_button.setAccessibleName("Close the first steps")
        self.close_button.setToolTip("Do not show this again")
        theme.set_role(self.close_button, "flat")
        self.close_button.clicked.connect(self._dismiss)
        head = QHBoxLayout()
        head.addWidget(theme.label("First steps", "title"))
        head.addStretch(1)
        head.addWidget(self.close_button)
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 8, 8, 12)
        column.setSpacing(6)
        column.addLayout(head)
        self._lines = {}
        for name, text in STEPS.items():
            line = self._lines[name] = theme.label(f"○  {text}")
            line.setWordWrap(True)
            column.addWidget(line)
        self._all_done = theme.label(ALL_DONE_TEXT, "good")
        self._all_done.setWordWrap(True)
        self._all_done.hide()
        column.addWidget(self._all_done)
        self.hide()
        canvas.installEventFilter(self)

    @property
    def remaining(self) -> list[str]:
        """The steps that were not done yet."""
        return [name for name in STEPS if name not in self._done]

    def mark_done(self, step: str) -> None:
        """One of `STEPS` was done."""
        if step in self._done:
            return
        self._done.add(step)
        self._lines[step].setText(f"●  {STEPS[step]}")
        theme.set_role(self._lines[step], "muted")
        self._all_done.setVisible(not self.remaining)
        self._move_to_corner()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._move_to_corner()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize:
            self._move_to_corner()
        elif event.type() == QEvent.Type.Show:
            self.setVisible(self._is_wanted())
        return False

    def _move_to_corner(self) -> None:
        height = self.heightForWidth(_WIDTH)
        self.setFixedHeight(height)
        self.move(16, self._canvas.height() - height - 16)
        self.raise_()

    def _dismiss(self) -> None:
        self.hide()
        self.closed.emit()
