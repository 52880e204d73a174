"""The Monitor workspace: floor, forces, vibration and footsteps of the running session, live."""

import math
from collections import deque
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import (
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QSplitter,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.engine.commands import Command, PressTile, Tare, Walk
from underfoot.errors import UnderfootError
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.widgets import theme
from underfoot.widgets.monitor.floor_map import PRESS_N, FloorMap
from underfoot.widgets.monitor.force_plot import CORNERS, ForcePlot
from underfoot.widgets.monitor.spectrogram import SHOWN_DB, RunningSpectrum, SpectrogramPlot
from underfoot.widgets.monitor.step_table import StepTable, WholeRows
from underfoot.widgets.plots import History, Line
from underfoot.widgets.quantities import number
from underfoot.widgets.session.bridge import Forces

LONGEST_S = 10.0
SPANS_S = (5.0, 10.0)
PRESSES_N = (50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)
_FORCE_HZ = 2000.0
"""Force samples a second for which there is room; a faster stream shows less than `LONGEST_S`."""

_KEPT_TILES = 16
"""The vibration of so many tiles is kept, to be shown at once when another one is chosen: 4 MB each."""

_CATCH_UP_S = 0.5
"""Seconds of kept vibration that are analysed in a frame's time."""

_FALL_S = 0.15
"""In which time a tile's bar of vibration falls to a third."""

_MAP_TICKS = 2
_FIGURE_TICKS = 6
"""The floor is drawn every so many ticks, for it does not scroll; numbers change slower, so that one can read them."""


class MonitorWorkspace(QWidget):
    """Shows what the bridge tells it, and asks the engine for what hands do here."""

    commanded = Signal(object)
    """A `Command` for the engine."""
    noticed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.map = FloorMap()
        self.force = ForcePlot()
        self.spectrogram = SpectrogramPlot()
        self.table = StepTable()
        self._folder = Path.home()
        self._span_s = SPANS_S[0]
        self._ticks = 0
        self._paused_s = math.nan
        self._hover_s = math.nan
        self._hover_lines: list[Line] = [plot.add_line(theme.FAINT) for plot in (self.force, self.spectrogram)]
        self._build()
        self.map.chosen.connect(self._choose)
        self.map.touched.connect(lambda: self.following.setChecked(False))
        self.map.pressed.connect(self._press)
        for plot in (self.force, self.spectrogram):
            plot.hovered.connect(self._hover)
        self.set_span(self._span_s)
        self.set_level(0.0)
        self.setFocusProxy(self.map)

    # --- what it shows ---

    def set_session(self, floor: Floor, rate_hz: float, simulated: bool) -> None:
        """Begin anew with this floor; `rate_hz` are session frames a second."""
        count = len(floor.tiles)
        self._floor, self._rate_hz = floor, rate_hz
        self._times = History(int(LONGEST_S * _FORCE_HZ))
        self._forces = History(int(LONGEST_S * _FORCE_HZ), count, 4, dtype=np.float32)
        self._spectrum = RunningSpectrum(rate_hz, LONGEST_S)
        self._vibration = History(int(LONGEST_S * rate_hz) if count <= _KEPT_TILES else 0, count, dtype=np.float32)
        self._vibration_end = self._spectrum_end = 0
        self._onsets: deque[tuple[str, float]] = deque(maxlen=256)
        self._now_frame = 0.0
        self._row = 0
        self._peak = np.zeros(count)
        self._latest: Forces | None = None
        self._newest = 0
        self.map.can_press = simulated
        self.map.set_floor(floor)
        self.table.steps.clear()
        self._count_steps()
        for widget in (self.walker, self.press_n, self._press_label):
            widget.setVisible(simulated)
        self.walker.setChecked(simulated)
        self.resume()
        self.draw()

    def set_span(self, seconds: float) -> None:
        """Show so many seconds before now."""
        self._span_s = seconds
        step = 1.0 if seconds <= 5.0 else 2.0
        ticks = [(-step * i, f"{number(-step * i)} s") for i in range(int(seconds / step) + 1)]
        self.force.set_span(seconds, ticks)
        self.spectrogram.set_span(seconds, ticks)
        for span_s, button in self._spans.items():
            button.setChecked(span_s == seconds)

    def set_level(self, db: float) -> None:
        """The output level: the spectrogram's colours end at it."""
        top_db = min(0.0, 10.0 * math.ceil(db / 10.0))
        self.spectrogram.set_top(top_db)
        self._levels.set_range(top_db - SHOWN_DB, top_db)

    def take_forces(self, forces: Forces) -> None:
        """Force samples, and what stands on the floor."""
        self._times.append(forces.time_s)
        self._forces.append(forces.force_n)
        self._latest = forces
        for rows in forces.ways:
            self.map.add_ways(rows)
        if self.following.isChecked():
            self._follow(forces)
        self._now_frame = max(self._now_frame, float(forces.time_s[-1]) * self._rate_hz)

    def take_vibration(self, first: int, samples: NDArray[np.float32]) -> None:
        """Vibration of all tiles (n, tiles) from session frame `first` on."""
        if first != self._vibration_end:
            self._vibration.clear()
        is_short = len(samples) <= _CATCH_UP_S * self._rate_hz or not self._vibration.capacity
        if self._spectrum_end == self._vibration_end and is_short:
            self._spectrum.feed(first, samples[:, self._row])
            self._spectrum_end = first + len(samples)
        self._vibration.append(samples)
        self._vibration_end = first + len(samples)
        fallen = self._peak * math.exp(-len(samples) / (_FALL_S * self._rate_hz))
        self._peak = np.maximum(np.maximum(samples.max(axis=0), -samples.min(axis=0)), fallen)
        self._now_frame = max(self._now_frame, float(self._vibration_end))

    def take_steps(self, steps: list[Step]) -> None:
        """Footsteps that happened."""
        self.table.steps.add(steps)
        self._onsets.extend((step.tile, step.start_s) for step in steps)
        self._count_steps()

    def draw(self) -> None:
        """Draw the present, unless it cannot be seen or is paused."""
        if not self.isVisible() or self.window().isMinimized() or self.is_paused:
            return
        self._catch_up()
        now_s = self._now_frame / self._rate_hz
        times, forces = self._times.latest(), self._forces.latest()[:, self._row]
        if len(times):
            onsets_s = [start_s for tile, start_s in self._onsets if tile == self.map.choice()]
            self.force.show_forces(times, forces, now_s, np.array(onsets_s))
        else:
            self.force.clear_forces()
        self.spectrogram.show_spectrum(self._spectrum, self._now_frame, self._rate_hz)
        if self._latest is not None:
            self.map.set_loads(self._latest.load_n, self._latest.untared)
            self.map.set_contacts(self._latest.contacts, now_s)
        if self._ticks % _MAP_TICKS == 0:
            self.map.set_vibration(self._peak)
            self.map.update()
        if self._ticks % _FIGURE_TICKS == 0:
            self._show_figures()
        self._ticks += 1

    def _catch_up(self) -> None:
        """Go on with the spectrum of a tile that was chosen just now, from what is known of its vibration."""
        known = self._vibration.latest()
        behind = min(self._vibration_end - self._spectrum_end, len(known))
        if behind > 0:
            first = self._vibration_end - behind
            count = min(behind, int(_CATCH_UP_S * self._rate_hz))
            at = len(known) - behind
            self._spectrum.feed(first, known[at : at + count, self._row])
            self._spectrum_end = first + count
        else:
            self._spectrum_end = self._vibration_end

    # --- what hands do ---

    @property
    def is_paused(self) -> bool:
        """Whether the picture stands still. Nothing is lost meanwhile."""
        return not math.isnan(self._paused_s)

    def pause(self) -> None:
        """Let the picture stand still."""
        self._paused_s = self._now_frame / self._rate_hz
        self.pausing.setChecked(True)
        self.pausing.setIcon(theme.icon("play"))

    def resume(self) -> None:
        """Go on with the present."""
        self._paused_s = math.nan
        self.pausing.setChecked(False)
        self.pausing.setIcon(theme.icon("pause"))

    def _toggle_pause(self, paused: bool) -> None:
        if paused:
            self.pause()
        else:
            self.resume()

    def _choose(self, tile: str) -> None:
        self._row = self._floor.index(tile)
        self._spectrum.clear()
        self._spectrum_end = self._vibration_end - len(self._vibration.latest())
        for label in (self._tile, self._vibration_tile):
            label.setText(f"tile {tile}")
        self.resume()

    def _follow(self, forces: Forces) -> None:
        """Choose the tile of the newest foot."""
        newest = max(forces.contacts, key=lambda contact: contact.id, default=None)
        if newest is not None and newest.id > self._newest:
            self._newest = newest.id
            self.map.set_choice(self._floor.ids[max(newest.tiles, key=lambda tile: forces.load_n[tile])])

    def _press(self, tile: str, x_m: float, y_m: float, force_n: float) -> None:
        self._send(PressTile(tile, x_m, y_m, force_n))

    def _send(self, command: Command) -> None:
        self.commanded.emit(command)

    def _hover(self, at_s: float) -> None:
        self._hover_s = at_s
        for line in self._hover_lines:
            line.place_x(at_s)
        self._show_figures()

    def _export(self) -> None:
        dialog = QFileDialog(self, "Export footsteps", str(self._folder / "steps.csv"), "CSV table (*.csv)")
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix("csv")
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(self.export)
        dialog.open()

    def export(self, path: str) -> None:
        """Write the footsteps as CSV; a file that cannot be written is said, and nothing else happens."""
        try:
            self.table.export(Path(path))
        except UnderfootError as error:
            self.noticed.emit(str(error))
            return
        self._folder = Path(path).parent
        self.noticed.emit(f"{self.table.steps.rowCount()} footsteps are in {path}.")

    def _clear(self) -> None:
        self.table.steps.clear()
        self._onsets.clear()
        self._count_steps()

    # --- figures ---

    def _show_figures(self) -> None:
        """Force of each corner and their sum, under the mouse or else now."""
        times, forces = self._times.latest(), self._forces.latest()
        values = np.full(5, math.nan)
        if len(times):
            end_s = self._paused_s if self.is_paused else self._now_frame / self._rate_hz
            at = len(times) - 1 if math.isnan(self._hover_s) else int(np.searchsorted(times, end_s + self._hover_s))
            if at < len(times):
                values[1:] = forces[at, self._row]
                values[0] = values[1:].sum()
        when = "now" if math.isnan(self._hover_s) else f"at {number(self._hover_s)} s"
        self._when.setText(when)
        for label, value in zip(self._figures, values, strict=True):
            label.setText(f"{round(value)} N".replace("-", "−") if math.isfinite(value) else "– N")

    def _count_steps(self) -> None:
        steps = self.table.steps.steps
        self._steps.setText(f"{len(steps)}" if steps else "none yet")
        paces = [step.cadence_per_min for step in steps[-8:] if math.isfinite(step.cadence_per_min)]
        self._cadence.setText(f"{np.mean(paces):.0f} steps a minute" if paces else "")
        self.exporting.setEnabled(bool(steps))
        self.clearing.setEnabled(bool(steps))

    # --- layout ---

    def _build(self) -> None:
        plots = QSplitter(Qt.Orientation.Vertical)
        plots.addWidget(_titled(self._force_head(), self.force))
        plots.addWidget(_titled(self._vibration_head(), self.spectrogram))
        plots.setSizes([240, 272])
        across = QSplitter(Qt.Orientation.Horizontal)
        across.addWidget(_titled(self._floor_head(), self.map))
        across.addWidget(plots)
        across.setStretchFactor(0, 5)
        across.setStretchFactor(1, 11)
        across.setSizes([400, 880])
        down = QSplitter(Qt.Orientation.Vertical)
        down.addWidget(across)
        down.addWidget(_titled(self._table_head(), WholeRows(self.table)))
        down.setStretchFactor(0, 5)
        down.setStretchFactor(1, 2)
        down.setSizes([512, 216])
        for splitter in (plots, across, down):
            splitter.setHandleWidth(1)
            splitter.setChildrenCollapsible(False)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(down)

    def _floor_head(self) -> list[QWidget | None]:
        self.walker = _button("walk", "Walker", "Let the simulated walker walk", checkable=True)
        self.walker.clicked.connect(lambda on: self._send(Walk(on)))
        self._press_label = theme.label("Press", "muted")
        self.press_n = QComboBox()
        self.press_n.setAccessibleName("Force of a press with the mouse")
        self.press_n.setToolTip("How hard the mouse presses on a simulated tile")
        for force_n in PRESSES_N:
            self.press_n.addItem(f"{force_n:.0f} N", force_n)
        self.press_n.setCurrentIndex(PRESSES_N.index(PRESS_N))
        self.press_n.currentIndexChanged.connect(lambda at: self.map.set_press(PRESSES_N[at]))
        self.tare = _button("scale-balance", "Tare", "What every tile reads now counts as nothing")
        self.tare.clicked.connect(lambda: self._send(Tare()))
        return [theme.label("Floor", "title"), None, self._press_label, self.press_n, self.walker, self.tare]

    def _force_head(self) -> list[QWidget | None]:
        self._tile = theme.label("", "muted")
        self._when = theme.label("now", "small")
        self._figures = []
        legend: list[QWidget | None] = []
        for name, colour in zip(("sum", "1", "2", "3", "4"), (theme.FORCE, *CORNERS), strict=True):
            key = theme.label(f'<span style="color:{colour}">■</span> {name}', "small")
            figure = theme.label("– N", "small")
            figure.setFixedWidth(figure.fontMetrics().horizontalAdvance("−0000 N") - theme.GRID)
            self._figures.append(figure)
            legend += [key, figure]
        self.following = _button("crosshairs-gps", "Follow", "Choose the tile of every new foot", checkable=True)
        self.pausing = _button("pause", "", "Let the picture stand still (P)", checkable=True)
        self.pausing.clicked.connect(self._toggle_pause)
        self._spans = {}
        for span_s in SPANS_S:
            button = _button("", f"{span_s:.0f} s", f"Show the last {span_s:.0f} seconds", checkable=True)
            button.clicked.connect(lambda _, span_s=span_s: self.set_span(span_s))
            self._spans[span_s] = button
        QShortcut("P", self, self.pausing.click)
        title = theme.label("Force", "title")
        return [title, self._tile, None, self._when, *legend, self.following, *self._spans.values(), self.pausing]

    def _vibration_head(self) -> list[QWidget | None]:
        self._vibration_tile = theme.label("", "muted")
        self._levels = _LevelKey()
        return [
            theme.label("Vibration", "title"),
            self._vibration_tile,
            None,
            theme.label("between the dashed lines the sole feels it: 40 Hz to 1 kHz", "small"),
            self._levels,
        ]

    def _table_head(self) -> list[QWidget | None]:
        self._steps = theme.label("", "muted")
        self._cadence = theme.label("", "muted")
        self.exporting = _button("export", "Export…", "Write the footsteps as a CSV table")
        self.exporting.clicked.connect(self._export)
        self.clearing = _button("broom", "Clear", "Empty the table")
        self.clearing.clicked.connect(self._clear)
        title = theme.label("Footsteps", "title")
        return [title, self._steps, self._cadence, None, self.clearing, self.exporting]


class _LevelKey(QWidget):
    """The colours of the spectrogram and what they stand for."""

    def __init__(self) -> None:
        super().__init__()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(theme.GRID, 0, 0, 0)
        layout.setSpacing(theme.GRID // 2)
        bar = QLabel()
        stops = ", ".join(
            f"stop:{i / 8} rgb({r}, {g}, {b})"
            for i, (r, g, b, _) in enumerate(theme.heat_table()[np.linspace(0, 255, 9).astype(int)])
        )
        bar.setStyleSheet(f"background: qlineargradient(x1:0, y1:0, x2:1, y2:0, {stops})")
        bar.setFixedSize(8 * theme.GRID, theme.GRID)
        self._low, self._high = theme.label("", "small"), theme.label("", "small")
        for widget in (self._low, bar, self._high):
            layout.addWidget(widget)

    def set_range(self, low_db: float, high_db: float) -> None:
        self._low.setText(number(low_db))
        self._high.setText(f"{number(high_db)} dB of full scale")


def _titled(head: list[QWidget | None], body: QWidget) -> QWidget:
    """`body` under a line of widgets; None is a stretch."""
    panel = QWidget()
    panel.setMinimumSize(240, 120)
    line = QHBoxLayout()
    line.setContentsMargins(2 * theme.GRID, theme.GRID // 2, theme.GRID, 0)
    line.setSpacing(theme.GRID)
    for widget in head:
        if widget is None:
            line.addStretch(1)
        else:
            line.addWidget(widget)
    top = QWidget()
    top.setLayout(line)
    top.setFixedHeight(4 * theme.GRID + 4)
    layout = QVBoxLayout(panel)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    layout.addWidget(top)
    body.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
    layout.addWidget(body)
    return panel


def _button(icon: str, text: str, tip: str, *, checkable: bool = False) -> QToolButton:
    button = QToolButton()
    button.setProperty("role", "tab" if checkable else "flat")
    button.setText(text)
    button.setToolTip(tip)
    button.setAccessibleName(text or tip)
    button.setCheckable(checkable)
    if icon:
        button.setIcon(theme.icon(icon))
    button.setToolButtonStyle(
        Qt.ToolButtonStyle.ToolButtonTextBesideIcon if icon and text else
        Qt.ToolButtonStyle.ToolButtonIconOnly if icon else Qt.ToolButtonStyle.ToolButtonTextOnly
    )  # fmt: skip
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button
