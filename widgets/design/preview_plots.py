"""The plots of the preview: one output over a step as waveform, spectrogram and spectrum, zoomed by the mouse."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QComboBox, QGridLayout, QWidget

from underfoot.drawing import HeatMap, Range
from underfoot.kernels import Floats
from underfoot.models.sole import band_levels
from underfoot.quantities import pretty_unit, quantity
from underfoot.widgets.controls.panels import chip
from underfoot.widgets.design import preview_drawings
from underfoot.widgets.design.analysis import HEARD_HZ, Scale, quantised_levels, spectrogram_db, spectrum_db
from underfoot.widgets.design.preview_drawings import FREQUENCIES, NO_FREQUENCIES, NO_TIMES, TIMES
from underfoot.widgets.design.preview_signal import (
    SHORTEST_MS,
    PreviewSignal,
    scrolled_view,
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


class PreviewPlots(QWidget):
    """Draws a signal or events, with the tile's `pad` beside them. The buttons in `controls` choose what is drawn."""

    noted = Signal(str)
    """Figures of what is drawn, or those at the mouse."""

    def __init__(self, pad: TilePad) -> None:
        super().__init__()
        self.is_heard = False
        """Whether the output is heard and not felt: then the frequency range is the audible one."""
        self._whole: PreviewSignal | None = None
        self._signal: PreviewSignal | None = None
        self._events: Floats | None = None
        self._whole_other: PreviewSignal | None = None
        self._other_slot = self._why_silent = self._why_nothing = ""
        self._view_ms: Range | None = None
        self._levels = self._line = np.zeros((0, 0), np.float32)
        self._undrawn: list[Callable[[PreviewSignal, PreviewSignal | None], None]] = []
        self._next = QTimer(self, singleShot=True, interval=0)
        self._next.timeout.connect(self._draw_next)
        self._pad, self._side_px, self._is_small = pad, SIDE_PX, True
        self.range = QComboBox()
        self.range.addItems([f"{db} dB" for db in RANGES_DB])
        self.range.setCurrentIndex(0)
        self.range.setProperty("role", "chip")
        self.range.setAccessibleName("Range of levels")
        self.range.setToolTip("Levels that the colours span, below the largest")
        self.log = chip("log f", "Frequencies on a logarithmic axis", checked=True)
        self.shows = {
            name: chip(name, f"Show the {name.lower()}", checked=True)
            for name in ("Waveform", "Spectrogram", "Spectrum")
        }
        self.controls = (*self.shows.values(), self.log, self.range)
        self.waveform = ZoomPlot("Waveform", TIMES)
        self.spectrogram = ZoomPlot("Spectrogram", TIMES)
        self.spectrum = ZoomPlot("Spectrum", NO_FREQUENCIES)
        self.spectrum.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        grid = self._grid = QGridLayout(self)
        grid.setContentsMargins(8, 0, 8, 8)
        grid.setSpacing(0)
        grid.addWidget(self.waveform, 0, 0)
        grid.addWidget(self.spectrogram, 1, 0)
        grid.addWidget(pad, 0, 1)
        grid.addWidget(self.spectrum, 1, 1)
        grid.setColumnStretch(0, 1)
        self._connect()
        self._arrange()

    def _connect(self) -> None:
        self.range.activated.connect(self._draw)
        self.log.toggled.connect(self._draw)
        for button in self.shows.values():
            button.toggled.connect(self._arrange)
        for plot in (self.waveform, self.spectrogram):
            plot.zoom_requested.connect(self._zoom)
            plot.move_requested.connect(self._move)
            plot.range_requested.connect(self._zoom_to)
            plot.full_range_requested.connect(partial(self._set_view, None))
        self.waveform.pointed.connect(self._point_at_time)
        self.spectrogram.pointed.connect(self._point_at_level)
        self.spectrum.pointed.connect(self._point_at_spectrum)

    # --- what is drawn ---

    def show_nothing(self, why: str) -> None:
        """Draw empty axes, and why they are empty."""
        self._whole, self._why_nothing = None, why
        self._draw()

    def show_signal(self, signal: PreviewSignal, other: PreviewSignal | None, other_slot: str, why_silent: str) -> None:
        """Draw a signal, and another slot's over it; `why_silent` is shown where the signal is zero."""
        self._whole, self._events, self._why_silent = signal, None, why_silent
        self._whole_other, self._other_slot = other, other_slot
        self._draw()

    def show_events(self, signal: PreviewSignal, events: Floats, why_silent: str) -> None:
        """Draw events, as rows of frame, strength and duration, over the force of `signal`."""
        self._whole, self._events, self._why_silent = signal, events, why_silent
        self._draw()

    def zoom_out(self) -> None:
        """Draw all of what is shown next, not the stretch that was zoomed to."""
        self._view_ms = None

    def arrange_for(self, width_px: int, height_px: int) -> None:
        """Arrange the plots for a panel of this size."""
        side_px = SIDE_PX if width_px >= NARROW_PX else max(width_px // 4, LEAST_SIDE_PX)
        is_small = width_px < NARROW_PX or height_px < LOW_PX
        if (side_px, is_small) != (self._side_px, self._is_small):
            self._side_px, self._is_small = side_px, is_small
            self._arrange()

    def _arrange(self) -> None:
        on = {name: button.isChecked() for name, button in self.shows.items()}
        self.waveform.setVisible(on["Waveform"])
        self.spectrogram.setVisible(on["Spectrogram"])
        self.spectrum.setVisible(on["Spectrum"])
        self.spectrum.set_margins(NO_FREQUENCIES if on["Spectrogram"] else FREQUENCIES)
        self._grid.setColumnMinimumWidth(1, self._side_px)
        self._pad.set_small(self._is_small)
        below = on["Spectrogram"] or on["Spectrum"]
        self.waveform.set_margins(NO_TIMES if on["Spectrogram"] else TIMES)
        self._grid.setRowStretch(0, 2 if on["Waveform"] or not below else 0)
        self._grid.setRowStretch(1, 3 if below else 0)
        alone = on["Spectrum"] and not on["Spectrogram"]
        self.spectrum.setMaximumWidth(1_000_000 if alone else self._side_px)
        self._grid.addWidget(self.spectrum, 1, 0 if alone else 1, 1, 2 if alone else 1)
        self._draw()

    # --- drawing ---

    @property
    def is_drawn(self) -> bool:
        """Whether all plots show the signal: levels follow the waveform, one plot per pass of the event loop."""
        return not self._undrawn

    def _draw(self) -> None:
        self._undrawn.clear()
        if self._whole is None:
            self._signal = None
            self.waveform.show_drawing(preview_drawings.no_waveform(self._why_nothing))
            self._show_no_levels()
            return
        if self._view_ms is not None and self._view_ms[1] > self._whole.end_ms:
            self._view_ms = None
        self._signal = self._whole.cut(self._view_ms)
        if self._events is not None:
            self._draw_events(self._signal, self._events)
        else:
            self._draw_signal(self._signal, self._other)

    @property
    def _other(self) -> PreviewSignal | None:
        """The visible part of the other slot's signal."""
        return None if self._whole_other is None else self._whole_other.cut(self._view_ms)

    def _draw_events(self, now: PreviewSignal, rows: Floats) -> None:
        times_ms = rows[:, 0] * (1e3 / now.rate_hz)
        self.waveform.show_drawing(preview_drawings.events(times_ms, rows[:, 1], now, self._why_silent))
        self._show_no_levels("no spectrum", now.view_ms)

    def _draw_signal(self, now: PreviewSignal, other: PreviewSignal | None) -> None:
        self.waveform.show_drawing(preview_drawings.waveform(now, other, self._why_silent, self._other_slot))
        self._note_summary(now, other)
        # Each takes some milliseconds, at first more: at once they would block the window.
        self._undrawn = [
            draw
            for name, draw in (("Spectrogram", self._draw_spectrogram), ("Spectrum", self._draw_spectrum))
            if self.shows[name].isChecked()
        ]
        self._next.start()

    def _draw_next(self) -> None:
        if self._undrawn and self._signal is not None:
            self._undrawn.pop(0)(self._signal, self._other)
            self._next.start()

    def _draw_spectrogram(self, now: PreviewSignal, _: PreviewSignal | None) -> None:
        self._levels = spectrogram_db(now.values, now.rate_hz, self._scale)
        shown = quantised_levels(self._levels, top_level(self._levels), self._range_db)
        heat = HeatMap(shown, now.view_ms, self._scale.range_hz)
        caption = not self._is_small
        self.spectrogram.show_drawing(preview_drawings.levels_over_time(heat, self._scale, caption=caption))

    def _draw_spectrum(self, now: PreviewSignal, other: PreviewSignal | None) -> None:
        scale, rate, range_db = self._scale, now.rate_hz, self._range_db
        self._line = line = spectrum_db(now.values, rate, scale)
        beside = spectrum_db(other.values, rate, scale) if other is not None else None
        top = top_level(line if beside is None else np.concatenate((line, beside)))
        drawing = preview_drawings.spectrum(line, beside, scale, (top - range_db, top))
        more = "the colours are the spectrogram's"
        if now.measured is not None:
            bands = band_levels(now.values, rate), band_levels(now.measured, rate)
            theirs = band_levels(other.values, rate) if other is not None else None
            drawing = preview_drawings.sensation(*bands, theirs, scale, range_db)
            more = "filled: commanded; red: measured on the tile; dashed: threshold in a hard shoe"
        if other is not None:
            more += "; violet: the other slot"
        self.spectrum.show_drawing(drawing)
        reference = f"1 {pretty_unit(now.unit)}" if now.unit else "1"
        self.spectrum.setToolTip(f"Amplitude in dB re {reference}; {more}")

    @property
    def _range_db(self) -> float:
        return float(RANGES_DB[self.range.currentIndex()])

    def _show_no_levels(self, why: str = "", view_ms: Range | None = None) -> None:
        self._levels = self._line = np.zeros((0, 0), np.float32)
        drawing = preview_drawings.levels_over_time(None, self._scale, view_ms, why, caption=not self._is_small)
        self.spectrogram.show_drawing(drawing)
        self.spectrum.show_drawing(preview_drawings.no_spectrum(self._scale))

    @property
    def _scale(self) -> Scale:
        log = self.log.isChecked()
        rate_hz = self._whole.rate_hz if self._whole is not None else 2.0 * HEARD_HZ
        return Scale.of_sound(log, rate_hz) if self.is_heard else Scale(log)

    # --- zoom ---

    def _zoom(self, factor: float, about_ms: float) -> None:
        if self._whole is not None:
            self._set_view(zoomed_view(self._view_ms, self._whole.end_ms, factor, about_ms))

    def _move(self, share: float) -> None:
        if self._whole is not None and self._view_ms is not None:
            by_ms = share * (self._view_ms[1] - self._view_ms[0])
            self._set_view(scrolled_view(self._view_ms, self._whole.end_ms, by_ms))

    def _zoom_to(self, low_ms: float, high_ms: float) -> None:
        if self._whole is not None:
            middle, width = 0.5 * (low_ms + high_ms), max(high_ms - low_ms, SHORTEST_MS)
            view = max(middle - width / 2, 0.0), min(middle + width / 2, self._whole.end_ms)
            self._set_view(view if view[1] - view[0] >= SHORTEST_MS / 2 else None)

    def _set_view(self, view_ms: Range | None) -> None:
        """Show this time range, or all; levels and spectrum are computed over it."""
        if view_ms != self._view_ms:
            self._view_ms = view_ms
            self._draw()
            while self._undrawn:  # both time axes move together under the hand
                self._draw_next()

    # --- the mouse ---

    def _point_at_time(self, time_ms: float, level: float) -> None:
        """Note the values at the mouse position in the waveform."""
        self._draw_pointer(time_ms)
        if self._signal is None or not self._signal.values.size:
            return
        text = "" if math.isnan(time_ms) else self._signal.text_at(time_ms)
        if text:
            self.noted.emit(text)
        else:
            self._note_summary(self._signal, self._other)

    def _point_at_level(self, time_ms: float, frequency_hz: float) -> None:
        """Note the level at the mouse position in the spectrogram."""
        self._draw_pointer(time_ms)
        now, levels = self._signal, self._levels
        if now is None or not levels.size or math.isnan(time_ms):
            self._point_at_time(math.nan, math.nan)
            return
        column = int((time_ms - now.begin_ms) / (now.end_ms - now.begin_ms) * levels.shape[1])
        at = levels[self._row(frequency_hz, len(levels)), min(max(column, 0), levels.shape[1] - 1)]
        self.noted.emit(f"{time_ms:.1f} ms, {quantity(frequency_hz, 'Hz')}: {quantity(float(at), 'dB')}")

    def _point_at_spectrum(self, level_db: float, frequency_hz: float) -> None:
        """Note the level of the frequency at the mouse position in the spectrum."""
        if self._signal is None or not self._line.size or math.isnan(frequency_hz):
            self._point_at_time(math.nan, math.nan)
            return
        at = self._line[self._row(frequency_hz, self._line.size)]
        text = f"{quantity(frequency_hz, 'Hz')}: {quantity(float(at), 'dB')}"
        amplitude = quantity(10.0 ** (float(at) / 20.0), self._signal.unit)
        self.noted.emit(f"{text} ({amplitude})")

    def _row(self, frequency_hz: float, rows: int) -> int:
        return int(np.abs(np.log(self._scale.rows_hz(rows) / frequency_hz)).argmin())

    def _draw_pointer(self, time_ms: float) -> None:
        for plot in (self.waveform, self.spectrogram):
            plot.point_at(time_ms)

    def _note_summary(self, now: PreviewSignal, other: PreviewSignal | None) -> None:
        text = summary_text(now, other, self._other_slot)
        if self._view_ms is not None:
            text = f"{self._view_ms[0]:.0f} to {self._view_ms[1]:.0f} ms: {text}"
        self.noted.emit(text)


def top_level(levels_db: NDArray[np.float32]) -> float:
    """Return the upper end of the colour scale: the largest level, rounded up to 10 dB; 0 dB for silence.

    >>> top_level(np.array([-33.0, -71.0], np.float32)), top_level(np.array([-180.0], np.float32))
    (-30.0, 0.0)
    """
    top = 10.0 * math.ceil(float(levels_db.max()) / 10.0)
    return top if top > SILENT_DB else 0.0
