"""The path of the open group above the canvas, for leaving a sub-patch."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.menu import literal


class Breadcrumbs(QFrame):
    """Shown while a group is open. `group_requested` carries the group's id, "" for the whole patch."""

    group_requested = Signal(str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._view = parent
        self.buttons: list[QPushButton] = []
        self._parts: list[QPushButton | QLabel] = []
        self._path: list[tuple[str, str]] = []
        self.setObjectName("crumbs")
        self.setStyleSheet(
            f"#crumbs {{ background: {theme.PANEL}; border: 1px solid {theme.LINE}; border-radius: 6px; }}"
        )
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(4, 2, 4, 2)
        self._row.setSpacing(0)
        self.move(8, 8)
        self.hide()

    def show_path(self, path: Sequence[tuple[str, str]]) -> None:
        """Show ids and names of the open groups, outermost first; hide if there are none."""
        if path == self._path:
            return
        self._path = list(path)
        for old in self._parts:
            old.hide()
            self._row.removeWidget(old)
            old.deleteLater()
        self.buttons, self._parts = [], []
        steps = [("", "Patch"), *path]
        for i, (id, name) in enumerate(steps):
            if i:
                self._parts.append(theme.label("›", "muted"))
            button = QPushButton(literal(name))
            button.setProperty("role", "tab")
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
            button.setEnabled(i < len(steps) - 1)
            button.clicked.connect(lambda _=False, id=id: self.group_requested.emit(id))
            self.buttons.append(button)
            self._parts.append(button)
        for part in self._parts:
            self._row.addWidget(part)
        self.setVisible(bool(path))
        self.fit()
        self.raise_()

    def fit(self) -> None:
        """Take the width of the path; where the view is narrower, leave out the outermost groups."""
        for part in self._parts:
            part.show()  # what is new in a row on the screen has no width before
        room = self._view.width() - 2 * self.x()
        gone = 0
        while self.sizeHint().width() > room and gone < len(self.buttons) - 2:
            gone += 1
            self._parts[2 * gone].hide()
            self._parts[2 * gone + 1].hide()
        for sign in self._parts[1:2]:
            sign.setText("› … ›" if gone else "›")
        self.adjustSize()
