"""The Monitor workspace: floor, forces, vibration and footsteps of the running session, live."""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import (
    QComboBox,
    QLabel,
    QScrollBar,
    QSizePolicy,
    QSplitter,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.engine.commands import Mark, PressTile, Start, Tare, Walk
from underfoot.engine.reports import CommandApplied
from underfoot.engine.target import Target
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.panels import ColourBar, column, tool_button, with_header
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.floor_map import DEFAULT_PRESS_N, FloorMap
from underfoot.widgets.monitor.force_history import HISTORY_S, ForceHistory
from underfoot.widgets.monitor.force_plot import CORNERS, ForcePlot
from underfoot.widgets.monitor.level_plot import LevelPlot, whole_parts
from underfoot.widgets.monitor.running_spectrum import SHOWN_DB
from underfoot.widgets.monitor.spectrogram_plot import SpectrogramPlot
from underfoot.widgets.monitor.step_panel import StepPanel
from underfoot.widgets.monitor.tile_levels import TileLevels
from underfoot.widgets.monitor.vibration_history import VibrationHistory
from underfoot.widgets.session.footstep_tracker import ForceUpdate
from underfoot.widgets.workspace import Workspace, WorkspaceContext

MAX_DURATION_S = 10.0
DURATIONS_S = (5.0, 10.0)
PRESSES_N = (50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)
SHORTCUTS = (
    ("Select the next tile, with the focus on the floor", "Arrows"),
    ("Pause or resume the display", "P"),
    ("Mark this moment, in the recording, too", "M"),
    ("Levels or spectrogram of the vibration", "L"),
    ("Back, on, and to now, in the last ten minutes", "Shift+Left, wheel; Shift+Right; Shift+End"),
    ("Copy footsteps, with the focus on the table", "Ctrl+C"),
)

_FORCE_HZ = 2000.0
"""Force samples per second that fit; a faster stream shows less than `MAX_DURATION_S`."""

_MAP_TICKS = 2
_READOUT_TICKS = 6
"""Ticks between two drawings of the floor, which does not scroll, and between two updates of numbers, to be
readable."""


class MonitorWorkspace(Workspace):
    """Shows what the session's bridge emits, and emits commands for the engine."""

    commanded = Signal(object)
    """A `Command` for the engine."""
    active_changed = Signal(bool)
    """Whether the workspace is on the screen."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.map = FloorMap()
        self.force = ForcePlot()
        self.spectrogram = SpectrogramPlot()
        self.levels = LevelPlot()
        self.steps = StepPanel()
        self.table = self.steps.table
        self._onsets: deque[tuple[str, float]] = deque(maxlen=256)
        self._marks: deque[tuple[float, str]] = deque(maxlen=256)
        self._duration_s = DURATIONS_S[0]
        self._ticks = 0
        self._latest: ForceUpdate | None = None
        self._paused_s = self._hover_s = math.nan
        self._back_to_s = math.nan
        """The time at the right edge after scrolling back; NaN while live."""
        self._build()
        self.map.tile_chosen.connect(self._show_tile)
        self.map.tile_clicked.connect(lambda: self.following.setChecked(False))
        self.map.pressed.connect(self._press)
        self.steps.notified.connect(self.notified)
        self.steps.cleared.connect(lambda: self._onsets.clear())
        for plot in (self.force, self.spectrogram):
            plot.hovered.connect(self._hover)
            plot.wheeled.connect(self._scroll)
        self.set_duration(self._duration_s)
        self.set_level(0.0)
        self.setFocusProxy(self.map)

    # --- workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        controller, bridge = context.controller, context.controller.bridge
        self.set_level(context.settings.level_db)
        controller.level_changed.connect(self.set_level)
        controller.opened.connect(self._set_target)
        self._set_target(controller.target)
        self.steps.folder = context.folder / "footsteps"
        bridge.forces_tracked.connect(self.add_forces)
        bridge.floor_silent.connect(self.empty_floor)
        bridge.vibration_read.connect(self.add_vibration)
        bridge.response_read.connect(self.add_response)
        bridge.steps_found.connect(self.add_steps)
        bridge.marked.connect(self.add_mark)
        bridge.reported.connect(self._show_starts)
        bridge.ticked.connect(self.draw)
        self.commanded.connect(controller.send)
        self.active_changed.connect(bridge.want_vibration)

    def shortcuts(self) -> Keys:
        return SHORTCUTS

    def close_down(self) -> None:
        """Store the table of unsaved footsteps."""
        self.steps.start_new_table()

    def set_active(self, active: bool) -> None:
        """Read vibration from the session only while this workspace is shown."""
        self.active_changed.emit(active)

    # --- data ---

    def _set_target(self, target: Target) -> None:
        self.set_session(target.floor, target.rate, target.kind == "simulator")

    def set_session(self, floor: Floor, rate_hz: float, simulated: bool) -> None:
        """Start again with this floor; `rate_hz` is session frames per second."""
        count = len(floor.tiles)
        self._floor, self._rate_hz = floor, rate_hz
        self.force_history = ForceHistory(count, MAX_DURATION_S, _FORCE_HZ)
        self.vibration = VibrationHistory(count, rate_hz, MAX_DURATION_S, HISTORY_S)
        self.tile_levels = TileLevels(count, rate_hz)
        self._onsets.clear()
        self._marks.clear()
        self._now_frame = 0.0
        self._row = 0
        self._latest = None
        self._newest_contact = 0
        self.map.can_press = simulated
        self.map.set_floor(floor)
        self.steps.start_new_table()
        for widget in (self.walker, self.press_n, self._press_label):
            widget.setVisible(simulated)
        self.walker.setChecked(simulated)
        self.resume()
        self.draw()

    def set_duration(self, seconds: float) -> None:
        """Show this many seconds before now."""
        self._duration_s = seconds
        self.force.set_duration(seconds)
        self.spectrogram.set_duration(seconds)
        for span_s, button in self.span_buttons.items():
            button.setChecked(span_s == seconds)

    def set_level(self, db: float) -> None:
        """Set the output level, at which the spectrogram's colours end."""
        top_db = min(0.0, 10.0 * math.ceil(db / 10.0))
        self.spectrogram.set_top(top_db)
        self.level_key.set_range(top_db - SHOWN_DB, top_db)

    def add_forces(self, update: ForceUpdate) -> None:
        """Add force samples and contacts."""
        self.force_history.append(update.time_s, update.force_n)
        self._latest = update
        for rows in update.contact_rows:
            self.map.add_trails(rows)
        if self.following.isChecked():
            self._show_latest(update)
        self._now_frame = max(self._now_frame, float(update.time_s[-1]) * self._rate_hz)

    def empty_floor(self, silent: bool) -> None:
        """Remove all contacts when the floor stops sending."""
        self._latest = self._latest.emptied() if silent and self._latest is not None else self._latest

    def add_vibration(self, first: int, samples: NDArray[np.float32]) -> None:
        """Add vibration of all tiles (n, tiles) from session frame `first` on."""
        self.vibration.append(first, samples)
        self._now_frame = max(self._now_frame, float(self.vibration.end))

    def add_response(self, first: int, commanded: NDArray[np.float32], measured: NDArray[np.float32]) -> None:
        """Add commanded and measured acceleration of all tiles, (n, tiles) each, m/s^2, from session frame `first`
        on."""
        self.tile_levels.feed(commanded, measured)

    def add_steps(self, steps: list[Step]) -> None:
        """Add footsteps."""
        self.steps.add(steps)
        self._onsets.extend((step.tile, step.start_s) for step in steps)

    def add_mark(self, text: str, at_s: float) -> None:
        """Add a mark from any source."""
        self._marks.append((at_s, text))

    def _show_starts(self, reports: list[object]) -> None:
        """Show the tile on which a preview's step began: the floor's forces do not have it."""
        for report in reports:
            if isinstance(report, CommandApplied) and isinstance(report.command, Start):
                self.map.show_step(report.command.tile)

    def draw(self) -> None:
        """Draw the present state, unless hidden or paused."""
        if not self.isVisible() or self.window().isMinimized():
            return
        self._show_bar()
        if self.is_paused:
            return
        self.vibration.catch_up()
        self._draw_plots()
        now_s = self._now_frame / self._rate_hz
        if self._latest is not None:
            self.map.set_loads(self._latest.load_n, self._latest.untared)
            self.map.set_contacts(self._latest.contacts, now_s)
        if self._ticks % _MAP_TICKS == 0:
            self.map.set_vibration(self.vibration.peaks)
            self.map.set_deviating(self.tile_levels.deviating())
            self.map.update()
        if self._ticks % _READOUT_TICKS == 0:
            self._show_readouts()
            self._show_levels()
        self._ticks += 1

    def _draw_plots(self) -> None:
        """Draw force and spectrogram of the seconds before the shown time."""
        end_s = self.shown_s
        times, forces = self.force_history.samples_before(end_s, self._duration_s, self._row)
        if len(times):
            onsets_s = [start_s for tile, start_s in self._onsets if tile == self.map.chosen_tile()]
            self.force.show_forces(times, forces, end_s, np.array(onsets_s), self._marks)
        else:
            self.force.clear_forces()
        self.spectrogram.show_spectrum(self.vibration.spectrum, end_s * self._rate_hz, self._rate_hz)

    @property
    def shown_s(self) -> float:
        """The time at the right edge of the plots."""
        for held_s in (self._back_to_s, self._paused_s):
            if math.isfinite(held_s):
                return held_s
        return self._now_frame / self._rate_hz

    def scroll_to(self, end_s: float) -> None:
        """Show the seconds before a time in the last ten minutes, while new data is kept. The present time: live
        again."""
        now_s = self._now_frame / self._rate_hz
        first_s = max(self.force_history.first_s, now_s - HISTORY_S)
        if not first_s < now_s or end_s >= now_s - 0.05:
            self._back_to_s = math.nan
        else:
            self._back_to_s = max(end_s, min(first_s + self._duration_s, now_s))
        self._draw_plots()
        self._show_bar()
        self._show_readouts()

    def _scroll(self, share: float) -> None:
        self.scroll_to(self.shown_s + share * self._duration_s)

    def _show_bar(self) -> None:
        """Set the scroll bar to the range of known times, in tenths of a second."""
        now_s = self._now_frame / self._rate_hz
        first_s = max(self.force_history.first_s, now_s - HISTORY_S)
        first_s = first_s + self._duration_s if math.isfinite(first_s) else now_s
        self.back.blockSignals(True)
        self.back.setRange(min(round(10.0 * first_s), round(10.0 * now_s)), round(10.0 * now_s))
        self.back.setPageStep(round(10.0 * self._duration_s))
        self.back.setValue(round(10.0 * self.shown_s))
        self.back.blockSignals(False)

    # --- actions ---

    @property
    def is_paused(self) -> bool:
        """Whether the display is paused; data is still kept."""
        return not math.isnan(self._paused_s)

    def pause(self) -> None:
        """Pause the display."""
        self._paused_s = self._now_frame / self._rate_hz
        self.pausing.setChecked(True)
        self.pausing.setIcon(theme.icon("play"))

    def resume(self) -> None:
        """Show live data again."""
        self._paused_s = self._back_to_s = math.nan
        self.pausing.setChecked(False)
        self.pausing.setIcon(theme.icon("pause"))

    def _toggle_pause(self, paused: bool) -> None:
        if paused:
            self.pause()
        else:
            self.resume()

    def _show_tile(self, tile: str) -> None:
        self._row = self._floor.index(tile)
        self.vibration.choose(self._row)
        for label in (self._tile, self._vibration_tile):
            label.setText(f"tile {tile}")
        self.resume()

    def _show_latest(self, update: ForceUpdate) -> None:
        """Select the tile of the newest contact."""
        newest = max(update.contacts, key=lambda contact: contact.id, default=None)
        if newest is not None and newest.id > self._newest_contact:
            self._newest_contact = newest.id
            self.map.choose_tile(self._floor.ids[max(newest.tiles, key=lambda tile: update.load_n[tile])])

    def _press(self, tile: str, x_m: float, y_m: float, force_n: float) -> None:
        self.commanded.emit(PressTile(tile, x_m, y_m, force_n))

    def _hover(self, at_s: float) -> None:
        self._hover_s = at_s
        for plot in (self.force, self.spectrogram):
            plot.point_at(at_s)
        self._show_readouts()

    # --- readouts ---

    def _show_readouts(self) -> None:
        """Show the force of each corner and their sum, at the mouse or else at the shown time."""
        times, forces = self.force_history.samples_before(self.shown_s, self._duration_s, self._row)
        values = np.full(5, math.nan)
        if len(times):
            hovered_s = self.shown_s + self._hover_s
            at = len(times) - 1 if math.isnan(self._hover_s) else int(np.searchsorted(times, hovered_s))
            if at < len(times):
                values[1:] = forces[at]
                values[0] = values[1:].sum()
        ago_s = self._now_frame / self._rate_hz - self._back_to_s
        when = f"{ago_s:.0f} s ago" if math.isfinite(ago_s) else "now"
        if math.isfinite(self._hover_s):
            when = f"at {number(self._hover_s)} s"
        self._when.setText(when)
        for label, value in zip(self.readouts, values, strict=True):
            label.setText(f"{round(value)} N".replace("-", "−") if math.isfinite(value) else "– N")

    def _show_levels(self) -> None:
        """Show the levels of the chosen tile, if visible."""
        if not self.levels.isVisible():
            return
        response, text = self.tile_levels.of(self._row)
        self.levels.show_response(response)
        self._levels_line.setText(whole_parts(text))

    def _choose_view(self, levels: bool) -> None:
        """Show levels over frequency, or the spectrogram over time."""
        self.vibration_views.setCurrentWidget(self.levels if levels else self.spectrogram)
        for widget in (self._felt_key, self.level_key):
            widget.setVisible(not levels)
        self._levels_line.setVisible(levels)
        self._show_levels()

    # --- layout ---

    def _build(self) -> None:
        plots = QSplitter(Qt.Orientation.Vertical)
        plots.setObjectName("monitor plots")
        plots.addWidget(
            with_header(self._force_head(), self.force, ((self.following,), self.readouts[1:], (self._when,)))
        )
        self.vibration_views = QStackedWidget()
        self.vibration_views.addWidget(self.spectrogram)
        self.vibration_views.addWidget(self.levels)
        plots.addWidget(with_header(self._vibration_head(), self.vibration_views))
        plots.setSizes([240, 272])
        self.back = QScrollBar(Qt.Orientation.Horizontal)
        self.back.setAccessibleName("Back through the last ten minutes")
        self.back.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.back.valueChanged.connect(lambda tenths: self.scroll_to(0.1 * tenths))
        for keys, do in (
            ("Shift+Left", lambda: self._scroll(-0.5)),
            ("Shift+Right", lambda: self._scroll(0.5)),
            ("Shift+End", lambda: self.scroll_to(math.inf)),
            ("M", lambda: self.commanded.emit(Mark())),
        ):
            QShortcut(keys, self, do)
        across = QSplitter(Qt.Orientation.Horizontal)
        across.setObjectName("monitor across")
        across.addWidget(with_header(self._floor_head(), self.map, ((self.walker, self.tare), (self._press_label,))))
        across.addWidget(column(plots, self.back, body=plots))
        across.setStretchFactor(0, 5)
        across.setStretchFactor(1, 11)
        across.setSizes([400, 880])
        down = QSplitter(Qt.Orientation.Vertical)
        down.setObjectName("monitor down")
        down.addWidget(across)
        down.addWidget(self.steps)
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
        self.walker = tool_button("walk", "Walker", "Let the simulated person walk over the floor", checkable=True)
        self.walker.clicked.connect(lambda on: self.commanded.emit(Walk(on)))
        self._press_label = theme.label("Press", "muted")
        self.press_n = QComboBox()
        self.press_n.setAccessibleName("Force of a press with the mouse")
        self.press_n.setToolTip("Force with which the mouse presses a simulated tile")
        for force_n in PRESSES_N:
            self.press_n.addItem(f"{force_n:.0f} N", force_n)
        self.press_n.setCurrentIndex(PRESSES_N.index(DEFAULT_PRESS_N))
        self.press_n.currentIndexChanged.connect(lambda at: self.map.set_press(PRESSES_N[at]))
        self.tare = tool_button("balance", "Tare", "Take the present reading of every unloaded tile as zero")
        self.tare.clicked.connect(lambda: self.commanded.emit(Tare()))
        return [theme.label("Floor", "title"), None, self._press_label, self.press_n, self.walker, self.tare]

    def _force_head(self) -> list[QWidget | None]:
        self._tile = theme.label("", "muted")
        self._when = theme.label("now", "small")
        self.readouts: list[QLabel] = []
        legend: list[QWidget | None] = []
        for name, colour in zip(("sum", "1", "2", "3", "4"), ("force", *CORNERS), strict=True):
            key = theme.label(f'<span style="color:{theme.PALETTE[colour]}">■</span> {name}', "small")
            figure = theme.label("– N", "small")
            figure.setFixedWidth(figure.fontMetrics().horizontalAdvance("−0000 N") - theme.GRID)
            self.readouts.append(figure)
            legend += [key, figure]
        self.following = tool_button("crosshairs", "Follow", "Select the tile of each new footstep", checkable=True)
        self.pausing = tool_button("pause", "", "Pause the display (P)", checkable=True)
        self.pausing.clicked.connect(self._toggle_pause)
        self.span_buttons: dict[float, QToolButton] = {}
        for span_s in DURATIONS_S:
            button = tool_button("", f"{span_s:.0f} s", f"Show the last {span_s:.0f} seconds", checkable=True)
            button.clicked.connect(lambda _, span_s=span_s: self.set_duration(span_s))
            self.span_buttons[span_s] = button
        QShortcut("P", self, self.pausing.click)
        title = theme.label("Force", "title")
        spans = self.span_buttons.values()
        return [title, self._tile, None, self._when, *legend, self.following, *spans, self.pausing]

    def _vibration_head(self) -> list[QWidget | None]:
        self._vibration_tile = theme.label("", "muted")
        self.level_key = ColourBar()
        self._felt_key = ElidedLabel("small")
        self._felt_key.set_full_text("dashed lines: what the sole of the foot feels, 40 Hz to 1 kHz")
        self._levels_line = theme.label("", "small")
        self._levels_line.setWordWrap(True)  # there is room for two lines
        policy = QSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Ignored)
        policy.setHorizontalStretch(100)
        self._levels_line.setSizePolicy(policy)
        self._levels_line.hide()
        tip = "Levels in third octaves: commanded, measured by the accelerometer, and the threshold of the sole (L)"
        self.show_levels = tool_button("", "Levels", tip, checkable=True)
        self.show_levels.toggled.connect(self._choose_view)
        QShortcut("L", self, self.show_levels.click)
        title = theme.label("Vibration", "title")
        key: list[QWidget | None] = [self._levels_line, None, self._felt_key, self.level_key]
        return [title, self._vibration_tile, *key, self.show_levels]
