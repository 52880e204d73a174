"""The buttons that play a recording: what is played, through which patch, once or over and over."""

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QComboBox, QToolButton

from underfoot.widgets import theme
from underfoot.widgets.controls.panels import tool_button
from underfoot.widgets.recordings.player import RecordingPlayer
from underfoot.widgets.recordings.timeline import Axis
from underfoot.widgets.workspace import WorkspaceContext


class Playback(QObject):
    """Plays what is selected on `axis`, and shows there where it is; it needs a session (`attach`)."""

    notified = Signal(str)

    def __init__(self, axis: Axis, parent: QObject) -> None:
        super().__init__(parent)
        self._axis = axis
        self.player: RecordingPlayer | None = None
        self.patch = QComboBox()
        self.patch.setAccessibleName("Patch to play through")
        self.patch.setToolTip("What recorded forces are played through; without a recorded patch, the one in Design")
        self.patch.addItems(["Recorded patch", "Patch in Design"])
        self.button: QToolButton = tool_button("play", "Play", "Play the stretch, or from the cursor on (P or Space)")
        self.button.clicked.connect(self.play_or_stop)
        self.looping = tool_button("", "Loop", "Play the stretch over and over (L)", checkable=True)
        self.looping.toggled.connect(self._set_loops)

    def attach(self, context: WorkspaceContext) -> None:
        """Play on the window's session."""
        self.player = RecordingPlayer(context.registry, context.controller, context.open_patch, context.listening)
        self.player.loops = self.looping.isChecked()
        self.player.moved.connect(self._show_time)
        self.player.notified.connect(self.notified)

    def play_or_stop(self) -> None:
        """Play the selected range, or from the cursor on; stop if playing."""
        content, axis = self._axis.content, self._axis
        if self.player is None or content is None:
            return
        if self.player.is_playing:
            self.player.stop()
        else:
            begin_s, end_s = axis.selection or (axis.cursor_s, axis.length_s)
            if end_s - begin_s < 0.05:
                begin_s = 0.0
            self.player.play(content.opened, begin_s, end_s, recorded_patch=self.patch.currentIndex() == 0)
        self._show_button()

    def stop(self) -> None:
        """Stop if playing."""
        if self.player is not None and self.player.is_playing:
            self.player.stop()

    def _show_time(self, time_s: float) -> None:
        self._axis.set_playing(time_s)
        self._show_button()

    def _show_button(self) -> None:
        playing = self.player is not None and self.player.is_playing
        self.button.setIcon(theme.icon("stop" if playing else "play"))
        self.button.setText("Stop" if playing else "Play")

    def _set_loops(self, on: bool) -> None:
        if self.player is not None:
            self.player.loops = on
