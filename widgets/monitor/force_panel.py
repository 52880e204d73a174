"""The panel of forces: the curves of the chosen tile over time, and their values at one time."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget

from underfoot.drawing.look import CORNERS
from underfoot.floor.footsteps import Step
from underfoot.quantities import fixed, number
from underfoot.widgets import theme
from underfoot.widgets.controls.panels import one_of_several, tool_button, with_header
from underfoot.widgets.monitor.force_history import ForceHistory
from underfoot.widgets.monitor.force_plot import ForcePlot
from underfoot.widgets.monitor.shown_time import ShownTime

MAX_DURATION_S = 10.0
DURATIONS_S = (5.0, 10.0)

_FORCE_HZ = 2000.0
"""Force samples per second that fit; a faster stream shows less than `MAX_DURATION_S`."""


class ForcePanel(QWidget):
    """Keeps the forces of all tiles, and shows those of one, with onsets of footsteps and marks."""

    duration_chosen = Signal(float)
    """Seconds to be shown."""
    pause_toggled = Signal(bool)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.plot = ForcePlot()
        self._onsets: deque[tuple[str, float]] = deque(maxlen=256)
        self._marks: deque[tuple[float, str]] = deque(maxlen=256)
        self._tile, self._row = "", 0
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        head = self._head()
        layout.addWidget(with_header(head, self.plot, ((self.following,), self.readouts[1:], (self.when,)), self))

    def start_again(self, tiles: int) -> None:
        """Keep nothing: another session begins, on a floor of so many tiles."""
        self.history = ForceHistory(tiles, MAX_DURATION_S, _FORCE_HZ)
        self._row = 0
        self._onsets.clear()
        self._marks.clear()

    def choose_tile(self, tile: str, row: int) -> None:
        """Show this tile, the `row`-th of the floor."""
        self._tile, self._row = tile, row
        self._tile_label.setText(f"tile {tile}")

    def set_duration(self, seconds: float) -> None:
        """Show this many seconds."""
        self.plot.set_duration(seconds)
        for span_s, button in self.span_buttons.items():
            button.setChecked(span_s == seconds)

    def set_paused(self, paused: bool) -> None:
        """Show whether the display is paused."""
        self.pausing.setChecked(paused)
        self.pausing.setIcon(theme.icon("play" if paused else "pause"))

    def add_steps(self, steps: Sequence[Step]) -> None:
        """Add onsets of footsteps."""
        self._onsets.extend((step.tile, step.start_s) for step in steps)

    def clear_steps(self) -> None:
        """Remove the onsets."""
        self._onsets.clear()

    def add_mark(self, text: str, at_s: float) -> None:
        """Add a mark."""
        self._marks.append((at_s, text))

    def draw(self, time: ShownTime) -> None:
        """Draw the forces of the seconds before the shown time."""
        times, forces = self.history.samples_before(time.end_s, time.duration_s, self._row)
        if len(times):
            onsets_s = [start_s for tile, start_s in self._onsets if tile == self._tile]
            self.plot.show_forces(times, forces, time.end_s, np.array(onsets_s), self._marks)
        elif self.plot.has_forces:  # a floor that sends nothing has nothing new
            self.plot.clear_forces()

    def show_readouts(self, time: ShownTime, hover_s: float) -> None:
        """Show the force of each corner and their sum, at the mouse (`hover_s` is not NaN) or at the shown time."""
        times, forces = self.history.samples_before(time.end_s, time.duration_s, self._row)
        values = np.full(5, math.nan)
        if len(times):
            at = len(times) - 1 if math.isnan(hover_s) else int(np.searchsorted(times, time.end_s + hover_s))
            if at < len(times):
                values[1:] = forces[at]
                values[0] = values[1:].sum()
        when = "paused" if time.is_paused else "now"
        if math.isfinite(time.ago_s):
            when = f"{time.ago_s:.0f} s ago"
        if math.isfinite(hover_s):
            when = f"at {number(hover_s)} s"
        self.when.setText(when)
        for label, value in zip(self.readouts, values, strict=True):
            label.setText(f"{fixed(value)} N" if math.isfinite(value) else "– N")

    def _head(self) -> list[QWidget | None]:
        self._tile_label = theme.label("", "muted")
        self.when = theme.label("now", "small")
        self.readouts: list[QLabel] = []
        legend: list[QWidget | None] = []
        for name, colour in zip(("sum", "1", "2", "3", "4"), ("force", *CORNERS), strict=True):
            key = theme.label(f'{name} <span style="color:{theme.PALETTE[colour]}">■</span>', "small")
            key.setTextFormat(Qt.TextFormat.RichText)
            figure = theme.label("– N", "small")
            figure.setFixedWidth(figure.fontMetrics().horizontalAdvance(f"{fixed(-8888)} N") - theme.GRID)
            self.readouts.append(figure)
            legend += [key, figure]
        self.following = tool_button("crosshairs", "Follow", "Select the tile of each new footstep", checkable=True)
        self.pausing = tool_button("pause", "", "Pause the display (P)", checkable=True)
        self.pausing.clicked.connect(self.pause_toggled)
        self.span_buttons: dict[float, QPushButton] = {}
        for span_s in DURATIONS_S:
            button = one_of_several(f"{span_s:.0f} s", f"Show the last {span_s:.0f} seconds")
            button.clicked.connect(lambda _, span_s=span_s: self.duration_chosen.emit(span_s))
            self.span_buttons[span_s] = button
        QShortcut("P", self, self.pausing.click)
        title = theme.label("Force", "title")
        spans = self.span_buttons.values()
        return [title, self._tile_label, None, self.when, *legend, self.following, *spans, self.pausing]
