"""The latest vibration of all tiles: the spectrogram of the chosen tile, and a decaying peak of each."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.widgets.monitor.running_spectrum import RunningSpectrum
from underfoot.widgets.plots.history import History

MOST_TILES = 16
"""Largest floor whose vibration is kept, so that a newly chosen tile is shown at once: 4 MB per tile."""

_CATCH_UP_S = 0.5
"""Seconds of vibration that are analysed within one frame of the display."""

_DECAY_S = 0.15
"""Time constant of the peaks."""


class VibrationHistory:
    """Vibration of `tiles` tiles in the last `kept_s` seconds, and the spectrogram of one in the last `spectrum_s`.

    >>> history = VibrationHistory(2, 48_000.0, kept_s=2.0, spectrum_s=4.0)
    >>> tone = np.sin(2 * np.pi * 250 / 48_000 * np.arange(24_000)).astype(np.float32)
    >>> history.append(0, np.column_stack([0.0 * tone, tone]))
    >>> history.choose(1)
    >>> history.catch_up()
    >>> bool(history.spectrum.levels().max() > 250), history.peaks.round(1)
    (True, array([0., 1.]))
    """

    def __init__(self, tiles: int, rate_hz: float, kept_s: float, spectrum_s: float) -> None:
        self._rate_hz = rate_hz
        self._row = 0
        self._samples = History(np.float32, int(kept_s * rate_hz) if tiles <= MOST_TILES else 0, tiles)
        self.spectrum = RunningSpectrum(rate_hz, spectrum_s)
        self.peaks = np.zeros(tiles)
        """Largest magnitude of each tile, which decays."""
        self.end = 0
        """Session frame after the last sample."""
        self._spectrum_end = 0

    def append(self, first: int, samples: NDArray[np.float32]) -> None:
        """Add vibration of all tiles (n, tiles) from session frame `first` on."""
        if first != self.end:
            self._samples.clear()
        is_short = len(samples) <= _CATCH_UP_S * self._rate_hz or not self._samples.capacity
        if self._spectrum_end == self.end and is_short:
            self.spectrum.feed(first, samples[:, self._row])
            self._spectrum_end = first + len(samples)
        self._samples.append(samples)
        self.end = first + len(samples)
        decayed = self.peaks * math.exp(-len(samples) / (_DECAY_S * self._rate_hz))
        self.peaks = np.maximum(np.maximum(samples.max(axis=0), -samples.min(axis=0)), decayed)

    def choose(self, row: int) -> None:
        """Begin the spectrogram of another tile, which `catch_up` fills."""
        self._row = row
        self.spectrum.clear()
        self._spectrum_end = self.end - len(self._samples.latest())

    def catch_up(self) -> None:
        """Analyse the next part of a newly chosen tile's vibration."""
        known = self._samples.latest()
        behind = min(self.end - self._spectrum_end, len(known))
        if behind > 0:
            first = self.end - behind
            count = min(behind, int(_CATCH_UP_S * self._rate_hz))
            at = len(known) - behind
            self.spectrum.feed(first, known[at : at + count, self._row])
            self._spectrum_end = first + count
        else:
            self._spectrum_end = self.end
