"""The preview: what the selected node does in one step, as waveform, spectrogram and spectrum."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QHBoxLayout, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from underfoot.engine.reports import Preview
from underfoot.floor.layout import Tile
from underfoot.patch.node import NodeType, Port
from underfoot.widgets import theme
from underfoot.widgets.design.analysis import Scale, peak_and_rms, shown_levels, spectrogram_db, spectrum_db
from underfoot.widgets.design.preview_plots import SpectrogramPlot, SpectrumPlot, WaveformPlot
from underfoot.widgets.design.tile_pad import TilePad
from underfoot.widgets.quantities import quantity

RANGES_DB = (60, 90, 120)
SIDE_PX = 176
"""The column of the tile and the spectrum."""
LATE_MS = 400
"""A preview that takes longer says that it is being made."""


class PreviewPanel(QWidget):
    """Shows one output of one node. It asks for nothing: `expect` tells it what will come, `show_preview` brings it."""

    struck = Signal(str, float)
    pressed = Signal(str, float, float, float)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._ports: dict[str, Port] = {}
        self._preview: Preview | None = None
        self._values = np.zeros(0)
        self._kept: tuple[np.ndarray, float] | None = None
        self.node = ""
        self.title = theme.label("", "title")
        self.note = theme.label("", "muted")
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
        self.tiles = QComboBox(self)
        self.tiles.setAccessibleName("Tile")
        self.tiles.hide()
        self.pad = TilePad(self)
        self.waveform, self.spectrogram, self.spectrum = WaveformPlot(), SpectrogramPlot(), SpectrumPlot()
        self._lay_out()
        self._late = QTimer(self, singleShot=True, interval=LATE_MS)
        self._late.timeout.connect(lambda: self.note.setText("being made…"))
        self.output.activated.connect(self._draw)
        self.range.activated.connect(self._draw)
        self.log.toggled.connect(self._draw)
        self.compare.toggled.connect(self._keep)
        for button in self.shows.values():
            button.toggled.connect(self._arrange)
        self.tiles.currentTextChanged.connect(self.pad.set_tile)
        self.pad.struck.connect(self.struck)
        self.pad.pressed.connect(self.pressed)
        for plot in (self.waveform, self.spectrogram):
            plot.hovered.connect(self._point)
        self._arrange()
        self.clear()

    def _toggle(self, text: str, help: str) -> QToolButton:
        button = QToolButton(self)
        button.setText(text)
        button.setCheckable(True)
        button.setChecked(True)
        button.setProperty("role", "chip")
        button.setToolTip(help)
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
        for widget in (self.output, *self.shows.values(), self.compare, self.log, self.range, self.tiles):
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
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(head)
        column.addLayout(self._plots, 1)

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
        self.output.clear()
        self.output.addItems(list(self._ports))
        self.output.setVisible(len(self._ports) > 1)
        self._draw()

    def show_preview(self, preview: Preview) -> None:
        """Show what came."""
        self._late.stop()
        self._preview = preview
        self._draw()

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
        self.spectrum.show_frequencies(not on["Spectrogram"])
        below = on["Spectrogram"] or on["Spectrum"]
        self.waveform.show_times(not on["Spectrogram"])
        self._plots.setRowStretch(0, 2 if on["Waveform"] or not below else 0)
        self._plots.setRowStretch(1, 3 if below else 0)
        alone = on["Spectrum"] and not on["Spectrogram"]
        self.spectrum.setMaximumWidth(1_000_000 if alone else SIDE_PX)
        self._plots.addWidget(self.spectrum, 1, 0 if alone else 1, 1, 2 if alone else 1)
        self._draw()

    def _draw(self) -> None:
        port, preview = self.port, self._preview
        if port is None or preview is None or preview.error:
            self._values = np.zeros(0)
            for plot in (self.waveform, self.spectrogram, self.spectrum):
                plot.clear_data()
            if preview is not None and preview.error:
                self.note.setText(preview.error)
            elif self.node and port is None:
                self.note.setText("it has no output to be seen")
            return
        rate = preview.rate_hz
        force = summed(preview.force_n)
        seconds = force.size / rate
        if port.kind == "event":
            self._values = np.zeros(0)
            events = event_rows(pick(preview.events, self.node, port.name))
            self.waveform.show_events(events[:, 0] / rate, events[:, 1], force, seconds)
            self.spectrogram.clear_data("events have no spectrum")
            self.spectrum.clear_data()
            came = port.name in preview.events or f"{self.node}.{port.name}" in preview.events
            count = f"{len(events)} event{'' if len(events) == 1 else 's'}"
            self.note.setText(count if came else "the preview holds no events")
            return
        values = np.nan_to_num(np.asarray(pick(preview.signals, self.node, port.name), np.float64))
        self._values = values
        seconds = max(seconds, values.size / rate)
        colour = theme.signal_colour(port.kind, port.unit)
        self.waveform.show_signal(values, rate, port.unit, colour, force, seconds)
        self._tell(values, port)
        scale = Scale(self.log.isChecked())
        range_db = float(RANGES_DB[self.range.currentIndex()])
        if self.shows["Spectrogram"].isChecked():
            levels = spectrogram_db(values, rate, scale)
            top = max(10.0 * math.ceil(float(levels.max()) / 10.0), -120.0)
            self.spectrogram.show_levels(shown_levels(levels, top, range_db), scale, seconds)
        if self.shows["Spectrum"].isChecked():
            line = spectrum_db(values, rate, scale)
            kept = spectrum_db(*self._kept, scale) if self._kept else None
            top = max(10.0 * math.ceil(float(line.max()) / 10.0), -120.0)
            self.spectrum.show_line(line, kept, scale, top, range_db, port.unit)

    def _point(self, time_s: float) -> None:
        """Tell the values under the mouse."""
        self.waveform.point_at(time_s)
        self.spectrogram.point_at(time_s)
        preview, port = self._preview, self.port
        if preview is None or port is None or not self._values.size:
            return
        if math.isnan(time_s):
            self._tell(self._values, port)
            return
        i = min(max(round(time_s * preview.rate_hz), 0), self._values.size - 1)
        force = summed(preview.force_n)
        text = f"{time_s * 1000:.0f} ms: {quantity(float(self._values[i]), port.unit)}"
        self.note.setText(text + (f", {quantity(float(force[i]), 'N')}" if i < force.size else ""))

    def _tell(self, values: np.ndarray, port: Port) -> None:
        peak, rms = peak_and_rms(values)
        text = f"peak {quantity(peak, port.unit)}, RMS {quantity(rms, port.unit)}"
        if self._kept:
            before = peak_and_rms(self._kept[0])[1]
            if before > 0.0 and rms > 0.0:
                text += f" ({20.0 * math.log10(rms / before):+.1f} dB)".replace("-", "−")
        self.note.setText(text)
        self.note.setToolTip(text)

    def _keep(self, on: bool) -> None:
        """Hold what is shown now, or let it go."""
        shown = self._values.size > 0 and self._preview is not None
        self._kept = (self._values, self._preview.rate_hz) if on and shown and self._preview else None
        self._draw()


def pick(values: Mapping[str, np.ndarray], node: str, port: str) -> np.ndarray:
    """What a preview holds of an output, under its own name or behind its node's."""
    found = values.get(f"{node}.{port}")
    return found if found is not None else values.get(port, np.zeros(0))


def summed(force_n: np.ndarray) -> np.ndarray:
    """The force on the tile, whether the four corners came or their sum."""
    force_n = np.asarray(force_n, np.float64)
    return force_n.sum(axis=1) if force_n.ndim == 2 else force_n


def event_rows(events: np.ndarray) -> np.ndarray:
    """Events as rows of frame, strength and duration."""
    return np.asarray(events, np.float64).reshape(-1, 3)
