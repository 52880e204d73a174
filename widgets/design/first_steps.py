"""The first three steps, above the canvas: play, press the tile, turn a number."""

from collections.abc import Callable

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QToolButton, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys

STEPS = {
    "play": "Press Space: a simulated person walks over the floor, and each step sounds.",
    "press": "Click on the tile at the lower right to strike it; drag on it to press it.",
    "turn": "Select a node, and drag the slider of a number at the right: it is heard at once.",
}
"""The steps in order; each ends when the user has done it."""
SILENT_TEXT = "No sound card plays, so that nothing sounds: choose one under Audio (Ctrl+,)."
"""What stands for the first step meanwhile; the next one that is left stands behind it."""
ALL_DONE_TEXT = "That is all of it: force in, vibration out. Presets are behind Ctrl+P, every key behind F1."


class FirstSteps(QFrame):
    """A strip with one step at a time, while it `is_wanted`. `done` is emitted after the last one, or on dismissal.

    It has its own row, because a card over the canvas hid nodes in a small window.
    """

    done = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.is_wanted: Callable[[], bool] = lambda: False
        self._done: set[str] = set()
        self._is_silent = False
        self.setObjectName("steps")
        self.setStyleSheet(f"#steps {{ background: {theme.PANEL}; border-bottom: 1px solid {theme.LINE}; }}")
        self.close_button = QToolButton()
        self.close_button.setText("×")
        self.close_button.setAccessibleName("Close the first steps")
        self.close_button.setToolTip("Do not show this again")
        theme.set_role(self.close_button, "flat")
        self.close_button.clicked.connect(self._dismiss)
        self._count = theme.label("", "heading")
        self.text = theme.paragraph()
        row = QHBoxLayout(self)
        row.setContentsMargins(2 * theme.GRID, 4, theme.GRID, 4)
        row.setSpacing(2 * theme.GRID)
        row.addWidget(self._count)
        row.addWidget(self.text, 1)
        row.addWidget(self.close_button, 0, Qt.AlignmentFlag.AlignTop)
        self._show_next()

    @property
    def remaining(self) -> list[str]:
        """The steps that are not done yet."""
        return [name for name in STEPS if name not in self._done]

    def mark_done(self, step: str) -> None:
        """Mark one of `STEPS` as done."""
        if step not in self._done:
            self._done.add(step)
            self._show_next()
            if not self.remaining:
                self.done.emit()

    def note_output(self, is_playing: bool, has_sound: bool) -> None:
        """Take the first step as done once something sounds; while no sound card plays, say so in its place."""
        self._is_silent = not has_sound
        self._show_next()
        if is_playing and has_sound:
            self.mark_done("play")

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not self.is_wanted():
            self.hide()

    def _show_next(self) -> None:
        left = self.remaining
        self._count.setText("FIRST STEPS  " + "".join("○" if name in left else "●" for name in STEPS))
        texts = [STEPS[name] for name in left] or [ALL_DONE_TEXT]
        if self._is_silent and "play" in left:
            texts = [f"{SILENT_TEXT} {''.join(texts[1:2])}".strip()]
        self.text.setText(with_native_keys(texts[0]))
        theme.set_role(self.text, "" if left else "good")

    def _dismiss(self) -> None:
        self.hide()
        self.done.emit()
