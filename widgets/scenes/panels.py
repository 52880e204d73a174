"""The list of scenes, and the panel with a scene's parameters and state."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from underfoot.quantities import counted
from underfoot.scenes.scene import Scene
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import ParameterEditor
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.controls.scrolled import scroll_area
from underfoot.widgets.controls.tab_order import set_tab_order, tab_stops

LIST_PX, SIDE_PX, PICTURE_PX = 24 * theme.GRID, 38 * theme.GRID, 18 * theme.GRID
MAX_LOG_LINES = 200
"""Most lines of the log on the screen."""


class SceneList(QWidget):
    """The scenes with their pictures; one is chosen."""

    chosen = Signal(str)

    def __init__(self, kinds: Iterable[type[Scene]]) -> None:
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedWidth(LIST_PX)
        self.list = QListWidget()
        self.list.setAccessibleName("Scenes")
        self.list.setViewMode(QListWidget.ViewMode.IconMode)
        self.list.setMovement(QListWidget.Movement.Static)
        self.list.setFlow(QListWidget.Flow.TopToBottom)
        self.list.setWrapping(False)
        self.list.setIconSize(QSize(PICTURE_PX, PICTURE_PX))
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        for kind in kinds:
            item = QListWidgetItem(kind.title)
            item.setData(Qt.ItemDataRole.UserRole, kind.name)
            item.setSizeHint(QSize(LIST_PX - 4 * theme.GRID, PICTURE_PX + 3 * theme.GRID))
            path = kind.picture()
            if path is not None:
                item.setIcon(_untinted(QPixmap(str(path))))
            self.list.addItem(item)
        column = QVBoxLayout(self)
        column.addWidget(theme.label("SCENES", "heading"))
        column.addWidget(self.list, 1)
        self.list.currentItemChanged.connect(self._choose)
        self.setFocusProxy(self.list)

    def _choose(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.chosen.emit(item.data(Qt.ItemDataRole.UserRole))


class ScenePanel(QWidget):
    """Description and parameters of a scene, start and stop, the projector's screen, and latencies."""

    start_requested = Signal()
    stop_requested = Signal()
    project_requested = Signal()
    walker_requested = Signal(bool)
    changed = Signal(str, object)
    """A parameter and its value."""

    def __init__(self) -> None:
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedWidth(SIDE_PX)
        self.title, self.about = theme.label("", "title"), theme.paragraph("", "muted")
        self.state, self.speed = theme.paragraph(), theme.paragraph("", "small")
        self.start = QPushButton("Start")
        self.start.setProperty("role", "primary")
        self.screen_choice = QComboBox()
        self.screen_choice.setAccessibleName("Screen of the projector")
        self.screen_choice.setToolTip("The screen that is the projector")
        self.project = QPushButton("Show on the floor…")
        self.project.setToolTip("Fill this screen with the scene that plays, at its true size, for a projector")
        self.walker = QCheckBox("A simulated walker walks")
        self.editors: dict[str, ParameterEditor] = {}
        self.parameters = scroll_area()
        self.parameters.setFrameShape(QFrame.Shape.NoFrame)
        self.parameters.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.log = QPlainTextEdit()
        self.log.setReadOnly(True)
        self.log.setMaximumBlockCount(MAX_LOG_LINES)
        self.log.setAccessibleName("What happened")
        self.log.setPlaceholderText("What happens in the scene is listed here while it runs.")
        self.parameters.setMinimumHeight(6 * theme.GRID)  # of one
        self.log.setMinimumHeight(5 * theme.GRID)
        for part in (self.parameters, self.log):  # they scroll; without this a low window would scroll the picture, too
            part.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self._lay_out()
        self.start.clicked.connect(self._start_or_stop)
        self.project.clicked.connect(self.project_requested)
        self.walker.clicked.connect(self.walker_requested)
        self.is_playing = False

    def show_kind(self, kind: type[Scene], values: dict[str, Any]) -> None:
        """Show a scene, with the values of its parameters; what another did goes."""
        self.speed.clear()
        self.log.clear()
        self.title.setText(kind.title)
        self.about.setText(kind.doc)
        self.about.setMinimumHeight(self.about.heightForWidth(SIDE_PX - 4 * theme.GRID))  # or a low window cuts it
        page = QWidget()
        page.setProperty("role", "panel")
        column = QVBoxLayout(page)
        column.setContentsMargins(0, 0, theme.GRID, 0)
        column.setSpacing(theme.GRID)
        self.editors = {}
        for name, parameter in kind.parameters.items():
            editor = self.editors[name] = editor_for(parameter)
            editor.set_value(values[name])
            editor.value_changed.connect(lambda value, name=name: self.changed.emit(name, value))
            column.addWidget(editor)
        column.addStretch()
        self.parameters.setWidget(page)
        set_tab_order([self.walker, *tab_stops(self.editors.values()), self.log])

    def show_playing(self, playing: bool, why_not: str) -> None:
        """Show whether a scene plays or, if none can, the reason."""
        self.is_playing = playing
        self.start.setText("Stop" if playing else "Start")
        self.start.setEnabled(playing or not why_not)
        self.start.setToolTip("" if playing else why_not)
        if not playing and self.project.hasFocus():
            self.start.setFocus()  # a disabled button would hand the focus to the walker's box
        self.project.setEnabled(playing)
        if why_not or not playing:
            self.state.setText(why_not)
            self.speed.clear()

    def show_screens(self, names: Sequence[str]) -> None:
        """Offer these screens; of several, the last is the projector's by default."""
        if [self.screen_choice.itemText(k) for k in range(self.screen_choice.count())] != list(names):
            self.screen_choice.clear()
            self.screen_choice.addItems(list(names))
            self.screen_choice.setCurrentIndex(len(names) - 1)

    def show_speed(self, per_s: float, cue_s: Sequence[float], shown_s: Sequence[float]) -> None:
        """Show pictures per second, and latencies of strikes and pictures."""
        parts = [f"{counted(round(per_s), 'picture')} a second"]
        for name, values in (("felt", cue_s), ("seen", shown_s)):
            if len(values):
                half, most = 1e3 * np.percentile(values, (50, 95))
                parts.append(f"{name} after {half:.0f} ms (95 %: {most:.0f} ms)")
        self.speed.setText("  ·  ".join(parts))

    def add_line(self, text: str) -> None:
        """Append a line to the log."""
        self.log.appendPlainText(text)

    def _start_or_stop(self) -> None:
        (self.stop_requested if self.is_playing else self.start_requested).emit()

    def _lay_out(self) -> None:
        screen = QHBoxLayout()
        screen.addWidget(self.screen_choice, 1)
        screen.addWidget(self.project)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.MARGINS)
        column.setSpacing(theme.GRID)
        above: tuple[QWidget, ...] = (self.title, self.about, self.start)
        below: tuple[QWidget, ...] = (self.walker, self.state, self.speed)
        for part in above:
            column.addWidget(part)
        column.addLayout(screen)
        for part in below:
            column.addWidget(part)
        column.addWidget(theme.label("PARAMETERS", "heading"))
        column.addWidget(self.parameters, 2)
        column.addWidget(theme.label("WHAT HAPPENED", "heading"))
        column.addWidget(self.log, 1)


def _untinted(picture: QPixmap) -> QIcon:
    """Return an icon that keeps its colours in a chosen row."""
    icon = QIcon(picture)
    icon.addPixmap(picture, QIcon.Mode.Selected)
    return icon
