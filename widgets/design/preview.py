"""The preview: the response of the selected node to one step, as waveform, spectrogram and spectrum."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QSizePolicy,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.drawing import HeatMap, Range
from underfoot.engine.reports import Distributions, Preview
from underfoot.floor.layout import Tile
from underfoot.models.sole import band_levels
from underfoot.patch.node import NodeType, Port
from underfoot.quantities import counted, pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.design import preview_drawings
from underfoot.widgets.design.analysis import HEARD_HZ, Scale, quantised_levels, spectrogram_db, spectrum_db
from underfoot.widgets.design.distribution_view import LATE_AFTER_MS, DistributionView
from underfoot.widgets.design.preview_drawings import FREQUENCIES, NO_FREQUENCIES, NO_TIMES, TIMES
from underfoot.widgets.design.preview_signal import (
    SHORTEST_MS,
    PreviewSignal,
    event_rows,
    scrolled_view,
    signal_of,
    summary_text,
    zoomed_view,
)
from underfoot.widgets.design.tile_pad import TilePad
from underfoot.widgets.plots.zoom_plot import ZoomPlot

RANGES_DB = (60, 90, 120)
SIDE_PX, LEAST_SIDE_PX = 176, 112
"""The column of the tile and the spectrum; in a narrow panel it is a quarter, but not less than the second."""
NARROW_PX, LOW_PX = 680, 240
"""Sizes below which the name precedes the figures, and the spectrogram has no text."""
SILENT_DB = -120.0
"""Signals up to this level are drawn on an axis that ends at 0 dB."""


class PreviewPanel(QWidget):
    """Shows one output of one node. It requests nothing: `expect` announces a preview, and `show_preview` shows it."""

    struck = Signal(str, float)
    pressed = Signal(str, float, float, float)
    distributions_requested = Signal()
    """The person wants to see the distributions of the node, which come with the next preview."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._ports: dict[str, Port] = {}
        self._preview: Preview | None = None
        self._other: tuple[Preview, str, Port] | None = None
        self._other_slot, self._shows_other = "B", True
        self._full_signal: PreviewSignal | None = None
        self._signal: PreviewSignal | None = None
        self._view_ms: Range | None = None
        self._levels = self._line = np.zeros((0, 0), np.float32)
        self._is_late = self._is_heard = False
        self.node = self._why_silent = ""
        self.title = ElidedLabel("title")
        self.short_title = theme.label("", "heading")
        self.note = ElidedLabel("small")
        self.output = QComboBox(self)
        self.output.setAccessibleName("Output")
        self.output.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.output.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.output.hide()
        self.range = QComboBox(self)
        self.range.addItems([f"{db} dB" for db in RANGES_DB])
        self.range.setCurrentIndex(0)
        self.range.setAccessibleName("Range of levels")
        self.range.setToolTip("Levels that the colours span, below the largest")
        self.log = self._toggle("log f", "Frequencies on a logarithmic axis")
        self.shows = {
            name: self._toggle(name, f"Show the {name.lower()}") for name in ("Waveform", "Spectrogram", "Spectrum")
        }
        self.distributions = self._toggle(
            "Distributions", "The distributions that the node draws from, instead of what it does in a step"
        )
        self.distributions.setChecked(False)
        self.distributions.hide()
        self.distribution_view = DistributionView()
        self.distribution_view.setContentsMargins(8, 0, 8, 8)
        self.tiles = QComboBox(self)
        self.tiles.setAccessibleName("Tile")
        self.tiles.hide()
        self.pad = TilePad(self)
        self.waveform = ZoomPlot("Waveform", TIMES)
        self.spectrogram = ZoomPlot("Spectrogram", TIMES)
        self.spectrum = ZoomPlot("Spectrum", NO_FREQUENCIES)
        self.spectrum.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self._lay_out()
        self._late = QTimer(self, singleShot=True, interval=LATE_AFTER_MS)
        self._late.timeout.connect(self._show_late)
        self._connect()
        self._arrange_plots()
        self.clear()

    def _connect(self) -> None:
        self.output.activated.connect(self._draw)
        self.range.activated.connect(self._draw)
        self.log.toggled.connect(self._draw)
        for button in self.shows.values():
            button.toggled.connect(self._arrange_plots)
        self.distributions.toggled.connect(self._choose_page)
        self.tiles.currentTextChanged.connect(self.pad.set_tile)
        self.pad.struck.connect(self.struck)
        self.pad.pressed.connect(self.pressed)
        for plot in (self.waveform, self.spectrogram):
            plot.zoom_requested.connect(self._zoom)
            plot.move_requested.connect(self._move)
            plot.range_requested.connect(self._zoom_to)
            plot.full_range_requested.connect(lambda: self._set_view(None))
        self.waveform.pointed.connect(self._point_at_time)
        self.spectrogram.pointed.connect(self._point_at_level)
        self.spectrum.pointed.connect(self._point_at_spectrum)

    def _toggle(self, text: str, tip: str) -> QToolButton:
        button = QToolButton(self)
        button.setText(text)
        button.setCheckable(True)
        button.setChecked(True)
        button.setProperty("role", "chip")
        button.setToolTip(tip)
        return button

    def _lay_out(self) -> None:
        head = self._head = QHBoxLayout()
        head.setContentsMargins(16, 8, 8, 0)
        head.setSpacing(4)
        for box in (self.output, self.range, self.tiles):
            box.setProperty("role", "chip")
        head.addWidget(self.title, 1)
        in_line = (self.output, self.distributions, *self.shows.values(), self.log, self.range, self.tiles)
        for widget in in_line:
            head.addWidget(widget)
        self._plots = QGridLayout()
        self._plots.setContentsMargins(8, 0, 8, 8)
        self._plots.setSpacing(0)
        self._plots.addWidget(self.waveform, 0, 0)
        self._plots.addWidget(self.spectrogram, 1, 0)
        self._plots.addWidget(self.pad, 0, 1)
        self._plots.addWidget(self.spectrum, 1, 1)
        self._plots.setColumnStretch(0, 1)
        self._plots.setRowStretch(0, 2)
        self._plots.setRowStretch(1, 3)
        self._step_page = QWidget(self)
        self._step_page.setLayout(self._plots)
        self._pages = QStackedWidget(self)
        self._pages.addWidget(self._step_page)
        self._pages.addWidget(self.distribution_view)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(head)
        told = self._told = QHBoxLayout()
        told.setContentsMargins(16, 0, 8, 2)
        told.setSpacing(theme.GRID)
        told.addWidget(self.short_title)
        told.addWidget(self.note, 1)
        column.addLayout(told)
        column.addWidget(self._pages, 1)
        for one, following in pairwise((*in_line, self.waveform, self.spectrogram, self.pad)):
            QWidget.setTabOrder(one, following)

    # --- display ---

    def clear(self) -> None:
        """Show nothing, without a node."""
        self.node, self._ports, self._preview, self._is_late = "", {}, None, False
        self._name("Preview")
        self.note.set_full_text("select a node")
        self.output.hide()
        self.distributions.hide()
        self._choose_page()
        self._late.stop()
        self._other = self._view_ms = None
        self._draw()

    def expect(self, node: str, type: NodeType, why_silent: str = "", is_heard: bool = False, label: str = "") -> None:
        """Announce a preview of this node, called `label`; the current one stays visible for a short time.

        With `is_heard`, for a node that is heard and not felt, the frequency range is the audible one.
        """
        self._late.start()
        if self.wants_distributions:
            self.distribution_view.expect()
        self._why_silent, self._is_heard = why_silent, is_heard
        self._name(label or type.label)
        if node == self.node and list(self._ports) == [port.name for port in type.outputs]:
            return
        self.node = node
        self._ports = {port.name: port for port in type.outputs}
        self._preview = self._other = self._view_ms = None
        self._is_late = False
        self.note.set_full_text("")
        self.distributions.setVisible(type.distributions is not None)
        self._choose_page()
        self.output.clear()
        self.output.addItems(list(self._ports))
        self.output.setVisible(len(self._ports) > 1)
        self._draw()

    def _name(self, name: str) -> None:
        is_narrow = self.width() < NARROW_PX
        self.short_title.setText(name)
        self.short_title.setVisible(is_narrow)
        line = self._told if is_narrow else self._head
        if line.indexOf(self.output) < 0:
            line.insertWidget(1, self.output)
        self.title.set_full_text("" if is_narrow else name)

    def show_preview(self, preview: Preview) -> None:
        """Show a preview."""
        self._late.stop()
        self._is_late, self._preview = False, preview
        self._draw()

    def show_other(self, preview: Preview, node: str, port: Port, slot: str) -> None:
        """Draw the output of the other slot's corresponding node over this one's."""
        self._other, self._other_slot = (preview, node, port), slot
        self._draw()

    def forget_other(self) -> None:
        """Remove the other slot's output, until a new one comes."""
        if self._other is not None:
            self._other = None
            self._draw()

    def set_overlay(self, on: bool) -> None:
        """Set whether the other slot's output is drawn."""
        self._shows_other = on
        self._draw()

    @property
    def wants_distributions(self) -> bool:
        """Whether the distributions of the node are visible."""
        return self.distributions.isChecked() and not self.distributions.isHidden()

    def show_distributions(self, distributions: Distributions) -> None:
        """Show the requested distributions."""
        self.distribution_view.show_distributions(distributions)

    def _choose_page(self) -> None:
        """Show the page of the step's response, or of the distributions."""
        wanted = self.wants_distributions
        self._pages.setCurrentWidget(self.distribution_view if wanted else self._step_page)
        for widget in (*self.shows.values(), self.log, self.range):
            widget.setEnabled(not wanted)
        self.note.setVisible(not wanted)  # it describes the step
        if wanted:
            self.distribution_view.wait()
            self.distributions_requested.emit()

    def set_tiles(self, tiles: Sequence[Tile]) -> None:
        """Set the tiles that can be struck and pressed."""
        self.pad.set_tiles(tiles)
        now = self.pad.tile.id
        self.tiles.blockSignals(True)
        self.tiles.clear()
        self.tiles.addItems([tile.id for tile in tiles])
        self.tiles.setCurrentText(now)
        self.tiles.blockSignals(False)
        self.tiles.setVisible(len(tiles) > 1)

    @property
    def port(self) -> Port | None:
        """The output shown; None if there is none."""
        return self._ports.get(self.output.currentText())

    def _arrange_plots(self) -> None:
        on = {name: button.isChecked() for name, button in self.shows.items()}
        self.waveform.setVisible(on["Waveform"])
        self.spectrogram.setVisible(on["Spectrogram"])
        self.spectrum.setVisible(on["Spectrum"])
        self.spectrum.set_margins(NO_FREQUENCIES if on["Spectrogram"] else FREQUENCIES)
        self._arranged_for = (self._side_px, self._is_small)
        self._plots.setColumnMinimumWidth(1, self._side_px)
        self.pad.set_small(self._is_small)
        below = on["Spectrogram"] or on["Spectrum"]
        self.waveform.set_margins(NO_TIMES if on["Spectrogram"] else TIMES)
        self._plots.setRowStretch(0, 2 if on["Waveform"] or not below else 0)
        self._plots.setRowStretch(1, 3 if below else 0)
        alone = on["Spectrum"] and not on["Spectrogram"]
        self.spectrum.setMaximumWidth(1_000_000 if alone else self._side_px)
        self._plots.addWidget(self.spectrum, 1, 0 if alone else 1, 1, 2 if alone else 1)
        self._draw()

    @property
    def _is_small(self) -> bool:
        """Whether the spectrogram is too small for text."""
        return self.width() < NARROW_PX or self.height() < LOW_PX

    @property
    def _side_px(self) -> int:
        return SIDE_PX if self.width() >= NARROW_PX else max(self.width() // 4, LEAST_SIDE_PX)

    # --- drawing ---

    def _draw(self) -> None:
        port, preview = self.port, self._preview
        self._full_signal = self._signal = None
        if port is None or preview is None or preview.error:
            self.waveform.show_drawing(preview_drawings.no_waveform("being made…" if self._is_late else ""))
            self._show_no_levels()
            if preview is not None and preview.error:
                self.note.set_full_text(preview.error)
            elif self.node and port is None:
                self.note.set_full_text("it has no output to be seen")
            return
        self._full_signal = PreviewSignal.of(preview, self.node, port)
        if self._view_ms is not None and self._view_ms[1] > self._full_signal.end_ms:
            self._view_ms = None
        self._signal = self._full_signal.cut(self._view_ms)
        if port.kind == "event":
            self._draw_events(preview, port, self._signal)
        else:
            self._draw_signal(port, self._signal, self._other_now())

    def _other_now(self) -> PreviewSignal | None:
        """Return the visible part of the other slot's signal."""
        other = self._other
        if other is None or not self._shows_other or other[0].error or other[2].kind == "event":
            return None
        return PreviewSignal.of(*other).cut(self._view_ms)

    def _draw_events(self, preview: Preview, port: Port, now: PreviewSignal) -> None:
        rows = event_rows(signal_of(preview.events, self.node, port.name))
        times_ms = rows[:, 0] * (1e3 / now.rate_hz)
        self.waveform.show_drawing(preview_drawings.events(times_ms, rows[:, 1], now, self._why_silent))
        self._show_no_levels("events have no spectrum", now.view_ms)
        came = port.name in preview.events or f"{self.node}.{port.name}" in preview.events
        count = counted(len(rows), "event")
        self.note.set_full_text(count if came else "the preview holds no events")

    def _draw_signal(self, port: Port, now: PreviewSignal, other: PreviewSignal | None) -> None:
        self.waveform.show_drawing(preview_drawings.waveform(now, other, self._why_silent, self._other_slot))
        self._show_note(now, other)
        range_db = float(RANGES_DB[self.range.currentIndex()])
        scale, rate = self._scale, now.rate_hz
        if self.shows["Spectrogram"].isChecked():
            self._levels = spectrogram_db(now.values, rate, scale)
            shown = quantised_levels(self._levels, top_level(self._levels), range_db)
            heat = HeatMap(shown, now.view_ms, scale.range_hz)
            caption = not self._is_small
            self.spectrogram.show_drawing(preview_drawings.levels_over_time(heat, scale, caption=caption))
        if self.shows["Spectrum"].isChecked():
            self._line = line = spectrum_db(now.values, rate, scale)
            beside = spectrum_db(other.values, rate, scale) if other is not None else None
            top = top_level(line if beside is None else np.concatenate((line, beside)))
            drawing = preview_drawings.spectrum(line, beside, scale, (top - range_db, top))
            more = "the colours are the spectrogram's"
            if now.measured is not None:
                bands = band_levels(now.values, rate), band_levels(now.measured, rate)
                theirs = band_levels(other.values, rate) if other is not None else None
                drawing = preview_drawings.sensation(*bands, theirs, scale, range_db)
                more = "filled: commanded; pink: measured on the tile; dashed: threshold in a hard shoe"
            if other is not None:
                more += "; violet: the other slot"
            self.spectrum.show_drawing(drawing)
            reference = f"1 {pretty_unit(port.unit)}" if port.unit else "1"
            self.spectrum.setToolTip(f"Amplitude in dB re {reference}; {more}")

    def _show_no_levels(self, why: str = "", view_ms: Range | None = None) -> None:
        self._levels = self._line = np.zeros((0, 0), np.float32)
        drawing = preview_drawings.levels_over_time(None, self._scale, view_ms, why, caption=not self._is_small)
        self.spectrogram.show_drawing(drawing)
        self.spectrum.show_drawing(preview_drawings.no_spectrum(self._scale))

    @property
    def _scale(self) -> Scale:
        log = self.log.isChecked()
        rate_hz = self._preview.rate_hz if self._preview is not None else 2.0 * HEARD_HZ
        return Scale.of_sound(log, rate_hz) if self._is_heard else Scale(log)

    def _show_late(self) -> None:
        """Replace the outdated preview by a message when the new one takes long."""
        self._is_late, self._preview = True, None
        self._draw()
        self.note.set_full_text("being made…")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._name(self.short_title.text())
        if self._arranged_for != (self._side_px, self._is_small):
            self._arrange_plots()

    # --- zoom and cursor ---

    def _zoom(self, factor: float, about_ms: float) -> None:
        if self._full_signal is not None:
            self._set_view(zoomed_view(self._view_ms, self._full_signal.end_ms, factor, about_ms))

    def _move(self, share: float) -> None:
        if self._full_signal is not None and self._view_ms is not None:
            by_ms = share * (self._view_ms[1] - self._view_ms[0])
            self._set_view(scrolled_view(self._view_ms, self._full_signal.end_ms, by_ms))

    def _zoom_to(self, low_ms: float, high_ms: float) -> None:
        if self._full_signal is not None:
            middle, width = 0.5 * (low_ms + high_ms), max(high_ms - low_ms, SHORTEST_MS)
            view = max(middle - width / 2, 0.0), min(middle + width / 2, self._full_signal.end_ms)
            self._set_view(view if view[1] - view[0] >= SHORTEST_MS / 2 else None)

    def _set_view(self, view_ms: Range | None) -> None:
        """Show this time range, or all; levels and spectrum are computed over it."""
        if view_ms != self._view_ms:
            self._view_ms = view_ms
            self._draw()

    def _point_at_time(self, time_ms: float, level: float) -> None:
        """Show the values at the mouse position in the waveform."""
        self._draw_pointer(time_ms)
        if self._signal is None or not self._signal.values.size:
            return
        told = "" if math.isnan(time_ms) else self._signal.text_at(time_ms)
        if told:
            self.note.set_full_text(told)
        else:
            self._show_note(self._signal, self._other_now())

    def _point_at_level(self, time_ms: float, frequency_hz: float) -> None:
        """Show the level at the mouse position in the spectrogram."""
        self._draw_pointer(time_ms)
        now, levels = self._signal, self._levels
        if now is None or not levels.size or math.isnan(time_ms):
            self._point_at_time(math.nan, math.nan)
            return
        column = int((time_ms - now.begin_ms) / (now.end_ms - now.begin_ms) * levels.shape[1])
        at = levels[self._row(frequency_hz, len(levels)), min(max(column, 0), levels.shape[1] - 1)]
        self.note.set_full_text(f"{time_ms:.1f} ms, {quantity(frequency_hz, 'Hz')}: {quantity(float(at), 'dB')}")

    def _point_at_spectrum(self, level_db: float, frequency_hz: float) -> None:
        """Show the level of the frequency at the mouse position in the spectrum."""
        if self._signal is None or not self._line.size or math.isnan(frequency_hz):
            self._point_at_time(math.nan, math.nan)
            return
        at = self._line[self._row(frequency_hz, self._line.size)]
        text = f"{quantity(frequency_hz, 'Hz')}: {quantity(float(at), 'dB')}"
        amplitude = quantity(10.0 ** (float(at) / 20.0), self._signal.unit)
        self.note.set_full_text(f"{text} ({amplitude})")

    def _row(self, frequency_hz: float, rows: int) -> int:
        return int(np.abs(np.log(self._scale.rows_hz(rows) / frequency_hz)).argmin())

    def _draw_pointer(self, time_ms: float) -> None:
        for plot in (self.waveform, self.spectrogram):
            plot.point_at(time_ms)

    def _show_note(self, now: PreviewSignal, other: PreviewSignal | None) -> None:
        text = summary_text(now, other, self._other_slot)
        if self._view_ms is not None:
            text = f"{self._view_ms[0]:.0f} to {self._view_ms[1]:.0f} ms: {text}"
        self.note.set_full_text(text)


def top_level(levels_db: NDArray[np.float32]) -> float:
    """Return the upper end of the colour scale: the largest level, rounded up to 10 dB; 0 dB for silence.

    >>> top_level(np.array([-33.0, -71.0], np.float32)), top_level(np.array([-180.0], np.float32))
    (-30.0, 0.0)
    """
    top = 10.0 * math.ceil(float(levels_db.max()) / 10.0)
    return top if top > SILENT_DB else 0.0
