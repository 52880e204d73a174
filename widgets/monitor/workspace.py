"""The Monitor workspace: floor, forces, vibration and footsteps of the running session, live."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QShortcut
from PySide6.QtWidgets import QVBoxLayout, QWidget

from underfoot.engine.commands import Mark, Start
from underfoot.engine.reports import CommandApplied, SensorFaults
from underfoot.engine.target import Target
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.widgets import theme
from underfoot.widgets.controls.panels import column, splitter
from underfoot.widgets.controls.scrolled import scrolling
from underfoot.widgets.monitor.floor_panel import FloorPanel
from underfoot.widgets.monitor.force_panel import DURATIONS_S, ForcePanel
from underfoot.widgets.monitor.shown_time import ShownTime, TimeBar
from underfoot.widgets.monitor.step_panel import StepPanel
from underfoot.widgets.monitor.vibration_panel import VibrationPanel
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.footstep_tracker import ForceUpdate
from underfoot.widgets.workspace import Workspace, WorkspaceContext

SHORTCUTS = (
    ("Select the next tile, with the focus on the floor", "Arrows"),
    ("Pause or resume the display", "P"),
    ("Mark this moment, in the recording, too", "M"),
    ("Levels or spectrogram of the vibration", "L"),
    ("Back, on, and to now, in the last ten minutes", "Shift+Left, wheel; Shift+Right; Shift+End"),
    ("Copy footsteps, with the focus on the table", "Ctrl+C"),
)

_LOST_S = 2.0
"""Time of which the share of lost samples is shown."""
_MAP_TICKS = 2
_READOUT_TICKS = 6
"""Ticks between two drawings of the floor, which does not scroll, and between two updates of numbers, to be readable,
and of what is scrolled back, where only a late footstep or mark may come."""


class MonitorWorkspace(Workspace):
    """Shows what the session's bridge emits, and emits commands for the engine."""

    shortcuts = SHORTCUTS
    commanded = Signal(object)
    """A `Command` for the engine."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        theme.fill(self, "ground")
        self.time = ShownTime(DURATIONS_S[0])
        self._controller: SessionController | None = None
        self._ticks = 0
        self._latest: ForceUpdate | None = None
        self._hover_s = math.nan
        self.make(self._parts())

    def _parts(self) -> Iterator[None]:
        self.floor, self.force = FloorPanel(self), ForcePanel(self)
        self.map = self.floor.map
        yield
        self.vibration = VibrationPanel(self)
        self.steps = StepPanel()
        self.time_bar = TimeBar()
        yield
        self._build()
        yield
        self._connect()
        self.set_duration(self.time.duration_s)
        self.vibration.set_level(0.0)
        self.focused_first = self.map

    # --- workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        controller, bridge = context.controller, context.controller.bridge
        self._controller = controller
        self.vibration.set_level(context.settings.level_db)
        controller.level_changed.connect(self.vibration.set_level)
        controller.opened.connect(self._set_target)
        self._set_target(controller.target)
        self.steps.folder = context.folder / "footsteps"
        bridge.forces_tracked.connect(self.add_forces)
        bridge.floor_silent.connect(self.empty_floor)
        bridge.vibration_read.connect(self.add_vibration)
        bridge.response_read.connect(self.add_response)
        bridge.steps_found.connect(self.add_steps)
        bridge.marked.connect(self.force.add_mark)
        bridge.reported.connect(self._take_reports)
        bridge.ticked.connect(self.draw)
        self.commanded.connect(controller.send)

    def close_down(self) -> None:
        """Store the table of unsaved footsteps; only a failure is said, or it would seem that they were lost."""
        self.steps.keep()

    def set_active(self, active: bool) -> None:
        """Read vibration from the session only while this workspace is shown, and show whether the walker walks."""
        if self._controller is None:
            return
        self._controller.bridge.wants_vibration = active
        if active and self._controller.session is not None:  # Scenes and studies send the walker away, too
            self.floor.walker.setChecked(self._controller.session.target.walker)

    # --- data ---

    def _set_target(self, target: Target) -> None:
        self.set_session(target.floor, target.rate, is_simulated=target.kind == "simulator")

    def set_session(self, floor: Floor, rate_hz: float, *, is_simulated: bool) -> None:
        """Start again with this floor; `rate_hz` is session frames per second."""
        count = len(floor.tiles)
        self._floor, self._rate_hz = floor, rate_hz
        self.time.start_again()
        self.force.start_again(count)
        self.vibration.start_again(count, rate_hz)
        self._latest = None
        self._newest_contact = 0
        self.floor.set_floor(floor, is_simulated=is_simulated)
        self.steps.start_new_table()
        self.resume()
        self.draw()

    def add_forces(self, update: ForceUpdate) -> None:
        """Add force samples and contacts."""
        self.force.history.append(update.time_s, update.force_n)
        self._latest = update
        for rows in update.contact_rows:
            self.map.add_trails(rows)
        if self.force.following.isChecked():
            self._show_latest(update)
        self.time.advance_to(float(update.time_s[-1]))
        self.time.kept_from_s = self.force.history.first_s

    def empty_floor(self, silent: bool) -> None:
        """Remove all contacts when the floor stops sending."""
        self._latest = self._latest.emptied() if silent and self._latest is not None else self._latest

    def add_vibration(self, first: int, samples: NDArray[np.float32]) -> None:
        """Add vibration of all tiles (n, tiles) from session frame `first` on."""
        self.vibration.history.append(first, samples)
        self.time.advance_to(self.vibration.history.end / self._rate_hz)

    def add_response(self, first: int, commanded: NDArray[np.float32], measured: NDArray[np.float32]) -> None:
        """Add commanded and measured acceleration of all tiles, (n, tiles) each, m/s^2, from session frame `first`
        on."""
        self.vibration.tile_levels.feed(commanded, measured)

    def add_steps(self, steps: list[Step]) -> None:
        """Add footsteps."""
        self.steps.add(steps)
        self.force.add_steps(steps)

    def _take_reports(self, reports: list[object]) -> None:
        """Show faulty sensors, and the tile on which a preview's step began: the floor's forces do not have it."""
        for report in reports:
            if isinstance(report, CommandApplied) and isinstance(report.command, Start):
                self.map.show_step(report.command.tile)
            elif isinstance(report, SensorFaults):
                self.map.set_faults(report.faults)

    # --- drawing ---

    def draw(self) -> None:
        """Draw the present state, unless hidden or paused."""
        if not self.isVisible() or self.window().isMinimized():
            return
        self.time_bar.show_time(self.time)
        if self.time.is_paused:
            return
        self.vibration.history.catch_up()
        if math.isnan(self.time.ago_s) or self._ticks % _READOUT_TICKS == 0:
            self._draw_plots()
        if self._latest is not None:
            self.map.set_loads(self._latest.load_n, self._latest.untared)
            self.map.set_contacts(self._latest.contacts, self.time.now_s)
        if self._ticks % _MAP_TICKS == 0:
            self.map.set_vibration(self.vibration.history.peaks)
            self.map.set_deviating(self.vibration.tile_levels.deviating())
            self.map.draw_changes()
        if self._ticks % _READOUT_TICKS == 1:  # not in a frame of the map, the longest
            self._show_readouts()
            self.vibration.show_levels()
            self.map.set_lost(self.force.history.missing_before(self.time.now_s, _LOST_S))
        self._ticks += 1

    def _draw_plots(self) -> None:
        """Draw force and spectrogram of the seconds before the shown time."""
        self.force.draw(self.time)
        self.vibration.draw(self.time.end_s)

    def _show_readouts(self) -> None:
        self.force.show_readouts(self.time, self._hover_s)

    # --- the time and the tile that are shown ---

    def set_duration(self, seconds: float) -> None:
        """Show this many seconds before now."""
        self.time.duration_s = seconds
        self.force.set_duration(seconds)
        self.vibration.spectrogram.set_duration(seconds)

    def scroll_to(self, end_s: float) -> None:
        """Show the seconds before a time in the last ten minutes, while new data is kept. The present time: live
        again."""
        self.time.scroll_to(end_s)
        self._draw_plots()
        self.time_bar.show_time(self.time)
        self._show_readouts()

    def _scroll(self, share: float) -> None:
        self.scroll_to(self.time.end_s + share * self.time.duration_s)

    def pause(self) -> None:
        """Pause the display."""
        self.time.pause()
        self.force.set_paused(True)
        self._show_readouts()

    def resume(self) -> None:
        """Show live data again."""
        self.time.resume()
        self.force.set_paused(False)

    def _hover(self, at_s: float) -> None:
        self._hover_s = at_s
        for plot in (self.force.plot, self.vibration.spectrogram):
            plot.point_at(at_s)
        self._show_readouts()

    def _show_tile(self, tile: str) -> None:
        row = self._floor.index(tile)
        self.force.choose_tile(tile, row)
        self.vibration.choose_tile(tile, row)
        self.resume()

    def _show_latest(self, update: ForceUpdate) -> None:
        """Select the tile of the newest contact."""
        newest = max(update.contacts, key=lambda contact: contact.id, default=None)
        if newest is not None and newest.id > self._newest_contact:
            self._newest_contact = newest.id
            self.map.choose_tile(self._floor.ids[max(newest.tiles, key=lambda tile: update.load_n[tile])])

    # --- layout ---

    def _connect(self) -> None:
        self.map.tile_chosen.connect(self._show_tile)
        self.map.tile_clicked.connect(lambda: self.force.following.setChecked(False))
        self.floor.commanded.connect(self.commanded)
        self.force.duration_chosen.connect(self.set_duration)
        self.force.pause_toggled.connect(lambda paused: self.pause() if paused else self.resume())
        self.vibration.levels_chosen.connect(self.force.plot.write_times)
        self.steps.notified.connect(self.notified)
        self.steps.cleared.connect(self.force.clear_steps)
        for plot in (self.force.plot, self.vibration.spectrogram):
            plot.hovered.connect(self._hover)
            plot.wheeled.connect(self._scroll)
        self.time_bar.valueChanged.connect(lambda tenths: self.scroll_to(0.1 * tenths))
        for keys, do in (
            ("Shift+Left", lambda: self._scroll(-0.5)),
            ("Shift+Right", lambda: self._scroll(0.5)),
            ("Shift+End", lambda: self.scroll_to(math.inf)),
            ("M", lambda: self.commanded.emit(Mark())),
        ):
            QShortcut(keys, self, do)

    def _build(self) -> None:
        # From the outside in: a widget that gets another parent has the style of all within it looked up again.
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        down = splitter("monitor down", Qt.Orientation.Vertical)
        down.setMinimumSize(96 * theme.GRID, 52 * theme.GRID)
        layout.addWidget(scrolling(down))
        across = splitter("monitor across", Qt.Orientation.Horizontal)
        down.addWidget(across)
        plots = splitter("monitor plots", Qt.Orientation.Vertical)
        across.addWidget(self.floor)
        column(plots, self.time_bar, body=plots, parent=across)
        across.setStretchFactor(0, 5)
        across.setStretchFactor(1, 11)
        across.setSizes([400, 880])
        plots.addWidget(self.force)
        plots.addWidget(self.vibration)
        plots.setSizes([240, 272])
        down.addWidget(self.steps)
        down.setStretchFactor(0, 5)
        down.setStretchFactor(1, 2)
        down.setSizes([512, 216])
