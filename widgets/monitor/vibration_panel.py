"""The panel of vibration: the spectrogram of the chosen tile over time, or its levels over frequency."""

import math

from PySide6.QtCore import Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import QSizePolicy, QStackedWidget, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.panels import ColourBar, tool_button, with_header
from underfoot.widgets.monitor.force_history import HISTORY_S
from underfoot.widgets.monitor.force_panel import MAX_DURATION_S
from underfoot.widgets.monitor.level_plot import LevelPlot, whole_parts
from underfoot.widgets.monitor.running_spectrum import SHOWN_DB
from underfoot.widgets.monitor.spectrogram_plot import SpectrogramPlot
from underfoot.widgets.monitor.tile_levels import TileLevels
from underfoot.widgets.monitor.vibration_history import VibrationHistory


class VibrationPanel(QWidget):
    """Keeps the vibration of all tiles, commanded and measured, and shows that of one."""

    levels_chosen = Signal(bool)
    """Levels are shown, and no times; or the spectrogram, with them."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.spectrogram = SpectrogramPlot()
        self.levels = LevelPlot()
        self._views = QStackedWidget()
        self._views.addWidget(self.spectrogram)
        self._views.addWidget(self.levels)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(with_header(self._head(), self._views, parent=self))

    def start_again(self, tiles: int, rate_hz: float) -> None:
        """Keep nothing: another session begins, on a floor of so many tiles."""
        self._rate_hz = rate_hz
        self.history = VibrationHistory(tiles, rate_hz, MAX_DURATION_S, HISTORY_S)
        self.tile_levels = TileLevels(tiles, rate_hz)

    def choose_tile(self, tile: str, row: int) -> None:
        """Show this tile, the `row`-th of the floor."""
        self.history.choose(row)
        self.tile_levels.choose(row)
        self._tile_label.setText(f"tile {tile}")

    def set_level(self, db: float) -> None:
        """Set the output level, at which the spectrogram's colours end."""
        top_db = min(0.0, 10.0 * math.ceil(db / 10.0))
        self.spectrogram.set_top(top_db)
        self.level_key.set_range(top_db - SHOWN_DB, top_db)

    def draw(self, end_s: float) -> None:
        """Draw the spectrogram of the seconds before a time."""
        self.spectrogram.show_spectrum(self.history.spectrum, end_s * self._rate_hz, self._rate_hz)

    def show_levels(self) -> None:
        """Show the levels of the chosen tile, if visible."""
        if not self.levels.isVisible():
            return
        response, text = self.tile_levels.levels()
        self.levels.show_response(response)
        self._levels_line.setText(whole_parts(text))

    def _choose_view(self, levels: bool) -> None:
        """Show levels over frequency, or the spectrogram over time."""
        self._views.setCurrentWidget(self.levels if levels else self.spectrogram)
        for widget in (self._felt_key, self.level_key):
            widget.setVisible(not levels)
        self._levels_line.setVisible(levels)
        self.levels_chosen.emit(levels)
        self.show_levels()

    def _head(self) -> list[QWidget | None]:
        self._tile_label = theme.label("", "muted")
        self.level_key = ColourBar()
        self._felt_key = ElidedLabel("small")
        self._felt_key.set_full_text("dashed lines: what the sole of the foot feels, 40 Hz to 1 kHz")
        self._levels_line = theme.paragraph("", "small")  # there is room for two lines
        policy = QSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        policy.setHorizontalStretch(100)
        self._levels_line.setSizePolicy(policy)
        self._levels_line.hide()
        tip = "Levels in third octaves: commanded, measured by the accelerometer, and the threshold of the sole (L)"
        levels_button = tool_button("", "Levels", tip, checkable=True)
        levels_button.toggled.connect(self._choose_view)
        QShortcut("L", self, levels_button.click)
        title = theme.label("Vibration", "title")
        key: list[QWidget | None] = [self._levels_line, None, self._felt_key, self.level_key]
        return [title, self._tile_label, *key, levels_button]
