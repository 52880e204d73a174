"""The preview: what the selected node does in one step, as waveform, spectrogram and spectrum."""

import math
from collections.abc import Mapping, Sequence
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer, Signal
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

from underfoot.drawing import HeatMap
from underfoot.engine.reports import MEASURED, Laws, Preview
from underfoot.floor.layout import Tile
from underfoot.models.sole import band_levels, felt
from underfoot.patch.node import NodeType, Port
from underfoot.quantities import pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.design import preview_drawings
from underfoot.widgets.design.analysis import Scale, peak_and_rms, shown_levels, spectrogram_db, spectrum_db
from underfoot.widgets.design.preview_drawings import FREQUENCIES, NO_FREQUENCIES, NO_TIMES, TIMES
from underfoot.widgets.design.tile_pad import TilePad
from underfoot.widgets.plots.plot import Plot

RANGES_DB = (60, 90, 120)
SIDE_PX = 176
"""The column of the tile and the spectrum."""
LAWS = 3
"""How many laws of a node are drawn."""
LATE_MS = 400
"""A preview that takes longer says that it is being made."""

Array = NDArray[np.float64]


class PreviewPanel(QWidget):
    """Shows one output of one node. It asks for nothing: `expect` tells it what will come, `show_preview` brings it."""

    struck = Signal(str, float)
    pressed = Signal(str, float, float, float)
    laws_wanted = Signal()
    """The person wants to see the laws of the node, which come with the next preview."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._ports: dict[str, Port] = {}
        self._preview: Preview | None = None
        self._values = np.zeros(0)
        self._felt = ""
        self._kept: tuple[Array, float] | None = None
        self.node = ""
        self.title = theme.label("", "title")
        self.note = theme.label("", "small")
        self.note.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.output = QComboBox(self)
        self.output.setAccessibleName("Output")
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
        self.compare = self._toggle("Compare", "Keep what is shown now, and hold what comes against it")
        self.compare.setChecked(False)
        self.laws = self._toggle(
            "Laws", "The distributions that the node draws from, instead of what it does in a step"
        )
        self.laws.setChecked(False)
        self.laws.hide()
        self.tiles = QComboBox(self)
        self.tiles.setAccessibleName("Tile")
        self.tiles.hide()
        self.pad = TilePad(self)
        self.waveform = Plot("Waveform", TIMES)
        self.spectrogram = Plot("Spectrogram", TIMES)
        self.spectrum = Plot("Spectrum", NO_FREQUENCIES)
        self._lay_out()
        self._late = QTimer(self, singleShot=True, interval=LATE_MS)
        self._late.timeout.connect(lambda: self.note.setText("being made…"))
        self.output.activated.connect(self._draw)
        self.range.activated.connect(self._draw)
        self.log.toggled.connect(self._draw)
        self.compare.toggled.connect(self._keep)
        for button in self.shows.values():
            button.toggled.connect(self._arrange)
        self.laws.toggled.connect(self._choose_page)
        self.tiles.currentTextChanged.connect(self.pad.set_tile)
        self.pad.struck.connect(self.struck)
        self.pad.pressed.connect(self.pressed)
        for plot in (self.waveform, self.spectrogram):
            plot.hovered.connect(self._point)
        self._arrange()
        self.clear()

    def _toggle(self, text: str, tip: str) -> QToolButton:
        button = QToolButton(self)
        button.setText(text)
        button.setCheckable(True)
        button.setChecked(True)
        button.setProperty("role", "chip")
        button.setToolTip(tip)
        return button

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        head.setContentsMargins(16, 8, 8, 0)
        head.setSpacing(4)
        for box in (self.output, self.range, self.tiles):
            box.setProperty("role", "chip")
        head.addWidget(self.title)
        head.addSpacing(8)
        head.addWidget(self.note, 1)
        for widget in (self.output, self.laws, *self.shows.values(), self.compare, self.log, self.range, self.tiles):
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
        self._plots.setColumnMinimumWidth(1, SIDE_PX)
        self._step_page, self._law_page = QWidget(self), QWidget(self)
        self._step_page.setLayout(self._plots)
        self.law_plots = [Plot(f"Law {k + 1}") for k in range(LAWS)]
        row = QHBoxLayout(self._law_page)
        row.setContentsMargins(8, 0, 8, 8)
        for plot in self.law_plots:
            row.addWidget(plot)
        self._pages = QStackedWidget(self)
        self._pages.addWidget(self._step_page)
        self._pages.addWidget(self._law_page)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(head)
        column.addWidget(self._pages, 1)

    # --- what it shows ---

    def clear(self) -> None:
        """Show nothing: no node is meant."""
        self.node, self._ports, self._preview = "", {}, None
        self.title.setText("Preview")
        self.note.setText("select a node")
        self.output.hide()
        self._late.stop()
        self._draw()

    def expect(self, node: str, type: NodeType) -> None:
        """A preview of this node will come; what is shown of it now stays until then."""
        self._late.start()
        if node == self.node and list(self._ports) == [port.name for port in type.outputs]:
            return
        self.node = node
        self._ports = {port.name: port for port in type.outputs}
        self._preview = None
        self.title.setText(type.label)
        self.note.setText("")
        self.laws.setVisible(type.laws is not None)
        self._choose_page()
        self.output.clear()
        self.output.addItems(list(self._ports))
        self.output.setVisible(len(self._ports) > 1)
        self._draw()

    def show_preview(self, preview: Preview) -> None:
        """Show what came."""
        self._late.stop()
        self._preview = preview
        self._draw()

    @property
    def wants_laws(self) -> bool:
        """Whether the laws of the node are to be seen."""
        return self.laws.isChecked() and not self.laws.isHidden()

    def show_laws(self, laws: Laws) -> None:
        """Show what came of the laws that were asked for."""
        for plot, drawing in zip_longest(self.law_plots, laws.drawings):
            plot.setVisible(drawing is not None)
            if drawing is not None:
                plot.show_drawing(drawing)
        if laws.error:
            self.note.setText(laws.error)

    def _choose_page(self) -> None:
        """What the node does in a step, or its laws."""
        wanted = self.wants_laws
        self._pages.setCurrentWidget(self._law_page if wanted else self._step_page)
        for widget in (*self.shows.values(), self.compare, self.log, self.range):
            widget.setEnabled(not wanted)
        if wanted:
            self.laws_wanted.emit()

    def set_tiles(self, tiles: Sequence[Tile]) -> None:
        """The tiles that can be struck and pressed."""
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
        """The output that is shown."""
        return self._ports.get(self.output.currentText())

    def _arrange(self) -> None:
        on = {name: button.isChecked() for name, button in self.shows.items()}
        self.waveform.setVisible(on["Waveform"])
        self.spectrogram.setVisible(on["Spectrogram"])
        self.spectrum.setVisible(on["Spectrum"])
        self.spectrum.set_margins(NO_FREQUENCIES if on["Spectrogram"] else FREQUENCIES)
        below = on["Spectrogram"] or on["Spectrum"]
        self.waveform.set_margins(NO_TIMES if on["Spectrogram"] else TIMES)
        self._plots.setRowStretch(0, 2 if on["Waveform"] or not below else 0)
        self._plots.setRowStretch(1, 3 if below else 0)
        alone = on["Spectrum"] and not on["Spectrogram"]
        self.spectrum.setMaximumWidth(1_000_000 if alone else SIDE_PX)
        self._plots.addWidget(self.spectrum, 1, 0 if alone else 1, 1, 2 if alone else 1)
        self._draw()

    def _draw(self) -> None:
        port, preview = self.port, self._preview
        self._values = np.zeros(0)
        self._felt = ""
        if port is None or preview is None or preview.error:
            self.waveform.show_drawing(preview_drawings.no_waveform())
            self._show_no_levels()
            if preview is not None and preview.error:
                self.note.setText(preview.error)
            elif self.node and port is None:
                self.note.setText("it has no output to be seen")
        elif port.kind == "event":
            self._draw_events(preview, port)
        else:
            self._draw_signal(preview, port)

    def _draw_events(self, preview: Preview, port: Port) -> None:
        rate = preview.rate_hz
        force = summed(preview.force_n)
        rows = event_rows(pick(preview.events, self.node, port.name))
        times_s, strengths = rows[:, 0] / rate, rows[:, 1]
        self.waveform.show_drawing(preview_drawings.events(times_s, strengths, force, rate, force.size / rate))
        self._show_no_levels("events have no spectrum")
        came = port.name in preview.events or f"{self.node}.{port.name}" in preview.events
        count = f"{len(rows)} event{'' if len(rows) == 1 else 's'}"
        self.note.setText(count if came else "the preview holds no events")

    def _draw_signal(self, preview: Preview, port: Port) -> None:
        rate = preview.rate_hz
        force = summed(preview.force_n)
        self._values = values = np.nan_to_num(np.asarray(pick(preview.signals, self.node, port.name), np.float64))
        seconds = max(force.size, values.size) / rate
        is_force = theme.signal_colour(port.kind, port.unit) == theme.FORCE
        done_by_tile = preview.signals.get(MEASURED)
        measured = None if done_by_tile is None else np.nan_to_num(done_by_tile.astype(np.float64))
        self.waveform.show_drawing(
            preview_drawings.waveform(values, port.unit, force, rate, seconds, is_force, measured),
        )
        self._felt = "" if measured is None else f"\n{felt_in_words(measured, rate)}"
        self._tell(values, port)
        range_db = float(RANGES_DB[self.range.currentIndex()])
        scale = self._scale
        if self.shows["Spectrogram"].isChecked():
            levels = spectrogram_db(values, rate, scale)
            shown = shown_levels(levels, top_of(levels), range_db)
            heat = HeatMap(shown, (0.0, 1e3 * seconds), scale.range_hz)
            self.spectrogram.show_drawing(preview_drawings.levels_over_time(heat, scale, seconds))
        if self.shows["Spectrum"].isChecked():
            line = spectrum_db(values, rate, scale)
            kept = spectrum_db(*self._kept, scale) if self._kept else None
            ends = (top_of(line) - range_db, top_of(line))
            drawing, more = preview_drawings.spectrum(line, kept, scale, ends), "the colours are the spectrogram's"
            if measured is not None:
                bands = (band_levels(values, rate), band_levels(measured, rate))
                drawing = preview_drawings.sensation(*bands, scale, range_db)
                more = (
                    "filled: what is asked of the tile; green: what it does; dashed: felt from here on in a hard shoe"
                )
            self.spectrum.show_drawing(drawing)
            reference = f"1 {pretty_unit(port.unit)}" if port.unit else "1"
            self.spectrum.setToolTip(f"Amplitude in dB of {reference}; {more}")

    def _show_no_levels(self, why: str = "") -> None:
        self.spectrogram.show_drawing(preview_drawings.levels_over_time(None, self._scale, note=why))
        self.spectrum.show_drawing(preview_drawings.no_spectrum(self._scale))

    @property
    def _scale(self) -> Scale:
        return Scale(self.log.isChecked())

    def _point(self, time_ms: float) -> None:
        """Tell the values under the mouse."""
        self.waveform.point_at(time_ms)
        self.spectrogram.point_at(time_ms)
        preview, port = self._preview, self.port
        if preview is None or port is None or not self._values.size:
            return
        if math.isnan(time_ms):
            self._tell(self._values, port)
            return
        i = min(max(round(1e-3 * time_ms * preview.rate_hz), 0), self._values.size - 1)
        force = summed(preview.force_n)
        text = f"{time_ms:.0f} ms: {quantity(float(self._values[i]), port.unit)}"
        measured = preview.signals.get(MEASURED)
        if measured is not None and i < measured.size:
            text += f", the tile {quantity(float(measured[i]), 'm/s^2')}"
        self.note.setText(text + (f", {quantity(float(force[i]), 'N')}" if i < force.size else ""))

    def _tell(self, values: Array, port: Port) -> None:
        peak, rms = peak_and_rms(values)
        text = f"peak {quantity(peak, port.unit)}, RMS {quantity(rms, port.unit)}"
        if self._kept:
            before = peak_and_rms(self._kept[0])[1]
            if before > 0.0 and rms > 0.0:
                text += f" ({20.0 * math.log10(rms / before):+.1f} dB)".replace("-", "−")
        text += self._felt
        self.note.setText(text)
        self.note.setToolTip(text)

    def _keep(self, on: bool) -> None:
        """Hold what is shown now, or let it go."""
        shown = self._values.size > 0 and self._preview is not None
        self._kept = (self._values, self._preview.rate_hz) if on and shown and self._preview else None
        self._draw()


def felt_in_words(measured_m_s2: Array, rate_hz: float) -> str:
    """The peak of what the tile does, and what a sole in a hard shoe feels of it.

    >>> felt_in_words(0.46 * np.sin(2 * np.pi * 250 / 48000 * np.arange(48000)), 48000.0)
    'tile 0.46 m/s², 8 dB over threshold, noticed by 100 %'
    """
    found = felt(measured_m_s2, rate_hz)
    db = found.level_db["shoe"]
    peak = quantity(float(np.abs(measured_m_s2).max(initial=0.0)), "m/s^2")
    if not math.isfinite(db):
        return f"tile {peak}"
    side = "over" if db >= 0.0 else "under"
    chance = f"noticed by {100.0 * found.noticed:.0f} %"
    return f"tile {peak}, {abs(db):.0f} dB {side} threshold, {chance}"


def top_of(levels_db: NDArray[np.float32]) -> float:
    """The level at which the colours end: the largest, rounded up to 10 dB.

    >>> top_of(np.array([-33.0, -71.0], np.float32))
    -30.0
    """
    return max(10.0 * math.ceil(float(levels_db.max()) / 10.0), -120.0)


def pick(values: Mapping[str, NDArray[np.floating]], node: str, port: str) -> NDArray[np.floating]:
    """What a preview holds of an output, under its own name or behind its node's."""
    found = values.get(f"{node}.{port}")
    return found if found is not None else values.get(port, np.zeros(0))


def summed(force_n: NDArray[np.floating]) -> Array:
    """The force on the tile, whether the four corners came or their sum."""
    total_n = np.asarray(force_n, np.float64)
    return total_n.sum(axis=1) if total_n.ndim == 2 else total_n


def event_rows(events: NDArray[np.floating]) -> Array:
    """Events as rows of frame, strength and duration."""
    return np.asarray(events, np.float64).reshape(-1, 3)
