"""The spectrogram of one tile's vibration, computed column by column."""

import numpy as np
from numpy.typing import NDArray

LOW_HZ, HIGH_HZ = 20.0, 2000.0
FLOOR_DB = -140.0
"""Lowest level, that of silence: below the colours at the lowest output level."""
SHOWN_DB = 70.0
"""Range of levels that the colours span."""
ROWS = 192
COLUMN_S = 0.01
WINDOW_S = 0.08
"""Length of the Hann window: its resolution of 12.5 Hz separates both pulses of a step and modes."""

_SLAB = 96
"""Columns computed at once, within one frame of the display."""


class RunningSpectrum:
    """Levels over log frequency, uint8 from `FLOOR_DB` to 0 dB of a full-scale sine, a column every `COLUMN_S`.

    Column k is the window around frame k times `hop`, so the result does not depend on how samples are split into
    calls.

    >>> spectrum = RunningSpectrum(48000, seconds=1.0)
    >>> spectrum.feed(0, np.sin(2 * np.pi * 250 / 48000 * np.arange(48000)).astype(np.float32))
    >>> spectrum.levels().shape, bool(spectrum.levels()[:, 50].max() > 250)
    ((192, 100), True)
    """

    def __init__(self, rate_hz: float, seconds: float) -> None:
        self.hop = round(rate_hz * COLUMN_S)
        self._size = 2 * round(rate_hz * WINDOW_S / 2)
        self.columns = round(seconds / COLUMN_S)
        self._window = np.hanning(self._size + 1)[:-1].astype(np.float32)
        at = np.geomspace(LOW_HZ, HIGH_HZ, ROWS) * self._size / rate_hz
        self._below = at.astype(np.intp)
        self._share = (at - self._below).astype(np.float32)
        half_row = (HIGH_HZ / LOW_HZ) ** (0.5 / (ROWS - 1))
        self._taken = int(at[-1] * half_row) + 2
        starts = np.ceil(at / half_row).astype(np.intp)
        self._wide = np.flatnonzero(np.diff(starts, append=self._taken) > 0)
        self._starts = starts[self._wide]
        self._scale = 2.0 / float(self._window.sum())
        self.clear()

    def clear(self) -> None:
        """Clear the picture."""
        self._samples = np.zeros(0, np.float32)
        self._first = -1
        self._column = 0
        # A new array takes memory only where it is written.
        self._picture = np.zeros((2 * self.columns, ROWS), np.uint8)

    @property
    def end_frame(self) -> float:
        """Session frame at the right edge of the picture."""
        return (self._column - 0.5) * self.hop

    def feed(self, first: int, samples: NDArray[np.float32]) -> None:
        """Add samples (n,) from session frame `first` on. A gap before them stays dark."""
        end = self._first + len(self._samples)
        if self._first < 0 or first != end:
            self._skip_to(first)
            self._samples = samples
        else:
            self._samples = np.concatenate([self._samples, samples])
        self._make()

    def levels(self) -> NDArray[np.uint8]:
        """Return the picture, uint8 [ROWS, columns], lowest frequency first; a view."""
        begin = self._column % self.columns
        return self._picture[begin : begin + self.columns].T

    def part(self, begin: float, end: float) -> tuple[NDArray[np.uint8], float, float]:
        """Return the columns between two session frames, as in `levels`, and the frames at their edges."""
        oldest = self._column - self.columns
        first = min(max(int(begin // self.hop), oldest), self._column)
        behind = min(max(int(-(-end // self.hop)) + 1, first), self._column)
        edges = (first - 0.5) * self.hop, (behind - 0.5) * self.hop
        return self.levels()[:, first - oldest : behind - oldest], *edges

    def _skip_to(self, first: int) -> None:
        """Continue at frame `first`; the columns between are dark."""
        half = self._size // 2
        column = -(-(first + half) // self.hop)
        dark = max(self._column, column - self.columns)
        self._put(dark, np.zeros((max(column - dark, 0), ROWS), np.uint8))
        self._column, self._first = column, first

    def _make(self) -> None:
        half = self._size // 2
        last = (self._first + len(self._samples) - half) // self.hop
        while self._column <= last:
            count = min(last - self._column + 1, _SLAB)
            begin = self._column * self.hop - half - self._first
            pieces = np.lib.stride_tricks.sliding_window_view(self._samples, self._size)[begin :: self.hop][:count]
            spectrum = np.abs(np.fft.rfft(pieces * self._window, axis=1)[:, : self._taken]).astype(np.float32)
            below = spectrum[:, self._below]
            size = below + self._share * (spectrum[:, self._below + 1] - below)
            # High rows span several bins: the largest counts, lest a tone fall between two rows.
            inside = np.maximum.reduceat(spectrum, self._starts, axis=1)
            size[:, self._wide] = np.maximum(size[:, self._wide], inside)
            db = 20.0 * np.log10(np.maximum(size * self._scale, 1e-9))
            self._put(self._column, np.clip(255.0 * (1.0 - db / FLOOR_DB), 0.0, 255.0).astype(np.uint8))
            self._column += count
        spare = self._column * self.hop - half - self._first
        if spare > 0:
            self._samples = self._samples[spare:]
            self._first += spare

    def _put(self, column: int, levels: NDArray[np.uint8]) -> None:
        """Write columns twice, one picture apart, so that the latest are always contiguous."""
        at = np.arange(column, column + len(levels)) % self.columns
        self._picture[at] = levels
        self._picture[at + self.columns] = levels
