"""The vibration of one tile as a spectrogram of the seconds before now."""

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import HeatMap, Range
from underfoot.drawing.layout import Margins
from underfoot.widgets.monitor.running_spectrum import FLOOR_DB, HIGH_HZ, LOW_HZ, SHOWN_DB, RunningSpectrum
from underfoot.widgets.plots.plot import Plot
from underfoot.widgets.plots.spectrogram import spectrogram


class SpectrogramPlot(Plot):
    """A running spectrum over the seconds before now."""

    def __init__(self) -> None:
        super().__init__("Vibration spectrogram", Margins())
        self._levels: NDArray[np.uint8] | None = None
        self._times_s: Range = (0.0, 0.0)
        self._is_silent = False
        self._seconds, self._top_db = 8.0, 0.0
        self._show()

    def set_duration(self, seconds: float) -> None:
        """Show this many seconds before now."""
        self._seconds = seconds
        self._show()

    def set_top(self, top_db: float) -> None:
        """Set the highest level of the colours, in dB re a full-scale sine."""
        self._top_db = top_db
        self._show()

    def show_spectrum(self, spectrum: RunningSpectrum, now_frame: float, rate_hz: float) -> None:
        """Draw `spectrum` so that `now_frame` is at the right edge; silence after silence looks the same."""
        levels, begin, end = spectrum.part(now_frame - self._seconds * rate_hz, now_frame)
        self._levels = levels if levels.shape[1] else None
        self._times_s = ((begin - now_frame) / rate_hz, (end - now_frame) / rate_hz)
        was_silent = self._is_silent
        self._is_silent = not levels.size or bool(levels.max() <= self._colours()[0])
        if not (self._is_silent and was_silent):
            self._show()

    def _colours(self) -> Range:
        """Return the level up to which colours are those of the background, and the highest one."""
        low, high = (255.0 * (1.0 - db / FLOOR_DB) for db in (self._top_db - SHOWN_DB, self._top_db))
        return low, high

    def _show(self) -> None:
        low, high = self._colours()
        frequencies = (LOW_HZ, HIGH_HZ)
        heat = None if self._levels is None else HeatMap(self._levels, self._times_s, frequencies, low, high)
        self.show_drawing(spectrogram(heat, "time, s", (-self._seconds, 0.0), frequencies))
