"""Spectrum and spectrogram of a preview, at the resolution of the screen. numpy only."""

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.drawing import Range
from underfoot.drawing.axes import scaled

LOWEST_HZ, HIGHEST_HZ = 20.0, 2000.0
HEARD_HZ = 20_000.0
"""Upper frequency limit of pictures of audio signals."""
WINDOW_S = 0.04
"""A compromise: 25 Hz apart, and two clicks 40 ms apart are two."""
COLUMNS, ROWS, LINE_ROWS = 360, 160, 320
"""Least number of columns of a long spectrogram, its rows, and the rows of a spectrum."""
_AT_ONCE = 8
"""Windows that are transformed at once: their spectra stay in the processor's cache."""
FLOOR_DB = -200.0


class Scale(Struct, frozen=True):
    """The frequency range of a picture, on a linear or logarithmic axis."""

    log: bool = True
    low_hz: float = LOWEST_HZ
    high_hz: float = HIGHEST_HZ
    is_felt: bool = True
    """Whether the frequency band that the sole is sensitive to is marked."""

    @staticmethod
    def of_sound(log: bool, rate_hz: float) -> "Scale":
        """Return the audible range, up to the Nyquist frequency.

        >>> [Scale.of_sound(log=True, rate_hz=rate_hz).range_hz for rate_hz in (48000.0, 16000.0)]
        [(20.0, 20000.0), (20.0, 8000.0)]
        """
        return Scale(log, high_hz=min(HEARD_HZ, rate_hz / 2), is_felt=False)

    @property
    def range_hz(self) -> Range:
        """The ends of the axis, in Hz."""
        return self.low_hz, self.high_hz

    def rows_hz(self, rows: int) -> NDArray[np.float64]:
        """Return the centres of `rows` rows along the axis, in Hz.

        >>> Scale(low_hz=1.0, high_hz=100.0).rows_hz(1)
        array([10.])
        """
        return self._at((np.arange(rows) + 0.5) / rows)

    def starts_hz(self, rows: int) -> NDArray[np.float64]:
        """Return the lower edges of `rows` rows, in Hz."""
        return self._at(np.arange(rows) / rows)

    def _at(self, shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the frequencies at shares of the axis' length, in Hz."""
        low, high = scaled(self.range_hz, log=self.log)
        places = low + shares * (high - low)
        return 10.0**places if self.log else places


def spectrogram_db(signal: ArrayLike, rate_hz: float, scale: Scale) -> NDArray[np.float32]:
    """Return levels in dB re amplitude 1, float32 [ROWS, columns], lowest frequency first.

    Hann windows of 40 ms, zero-padded to four times their length; a sine of amplitude 1 gives 0 dB.

    >>> time_s = np.arange(9600) / 48000
    >>> picture = spectrogram_db(np.sin(2 * np.pi * 250.0 * time_s), 48000.0, Scale())
    >>> middle = picture[:, picture.shape[1] // 2]
    >>> bool(abs(middle.max()) < 0.1), bool(abs(Scale().rows_hz(ROWS)[middle.argmax()] - 250.0) < 10.0)
    (True, True)
    """
    signal = np.asarray(signal, np.float32)
    length = max(int(WINDOW_S * rate_hz), 16)
    if signal.size < 2:
        return np.full((ROWS, 1), FLOOR_DB, np.float32)
    every = _decimation_factor(scale, rate_hz)
    frames = signal.size // every
    # Mirrored at its ends, because truncation would add a click at the beginning and end.
    padded = _decimated(np.pad(signal, (length // 2, length), mode="symmetric"), every)
    rate_hz, length = rate_hz / every, length // every
    windows = np.lib.stride_tricks.sliding_window_view(padded, length)[: max(frames, 1) : max(frames // COLUMNS, 1)]
    hann = np.hanning(length).astype(np.float32)
    hann *= 2.0 / hann.sum()
    size = 1 << (4 * length - 1).bit_length()
    bins, top_bin = _bins(scale, ROWS, size / rate_hz), _top_bin(scale, size / rate_hz)
    place = scale.rows_hz(ROWS) * size / rate_hz
    below = np.clip(place.astype(int), 0, min(top_bin, size // 2 + 1) - 2)
    share = (place - below).astype(np.float32)
    picked = np.empty((len(windows), ROWS), np.float32)
    for at in range(0, len(windows), _AT_ONCE):
        spectra = np.abs(np.fft.rfft(windows[at : at + _AT_ONCE] * hann, size, axis=1)[:, :top_bin])
        between = spectra[:, below] * (1 - share) + spectra[:, below + 1] * share
        # A row can span several bins of the spectrum; its level is the largest of them.
        picked[at : at + _AT_ONCE] = np.maximum(between, np.maximum.reduceat(spectra, bins, axis=1))
    return _db(picked.T)


def spectrum_db(signal: ArrayLike, rate_hz: float, scale: Scale) -> NDArray[np.float32]:
    """Return the largest amplitude in each row's band over the whole signal, in dB re 1: float32 [LINE_ROWS]."""
    signal = np.asarray(signal, np.float64)
    if signal.size < 2:
        return np.full(LINE_ROWS, FLOOR_DB, np.float32)
    every = _decimation_factor(scale, rate_hz)
    signal, rate_hz = _decimated(signal, every), rate_hz / every
    hann = np.hanning(signal.size)
    size = 1 << (2 * signal.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(signal * hann, size))[: _top_bin(scale, size / rate_hz)] * (2.0 / hann.sum())
    return _db(np.maximum.reduceat(spectrum, _bins(scale, LINE_ROWS, size / rate_hz)))


def quantised_levels(db: NDArray[np.float32], top_db: float, range_db: float) -> NDArray[np.uint8]:
    """Return levels as indices into a table of 256 colours, the last at `top_db`."""
    return np.clip((db - (top_db - range_db)) * (255.0 / range_db), 0.0, 255.0).astype(np.uint8)


def peak_and_rms(signal: ArrayLike) -> tuple[float, float]:
    """Return the largest magnitude, and the root mean square."""
    signal = np.asarray(signal, np.float64)
    if signal.size == 0:
        return 0.0, 0.0
    return float(np.abs(signal).max()), float(np.sqrt(np.mean(signal**2)))


def _bins(scale: Scale, rows: int, per_hz: float) -> NDArray[np.int64]:
    """Return the first bin of the spectrum in each row."""
    return (scale.starts_hz(rows) * per_hz).astype(np.int64)


def _top_bin(scale: Scale, per_hz: float) -> int:
    """Return the number of bins up to the upper end of the scale."""
    return int(scale.high_hz * per_hz) + 2


def _decimation_factor(scale: Scale, rate_hz: float) -> int:
    """Return the decimation factor that leaves the Nyquist frequency at twice the scale's upper end, at least 1."""
    return max(int(rate_hz / (scale.high_hz * 4.0)), 1)


def _decimated(signal: NDArray[np.floating], every: int) -> NDArray[np.floating]:
    """Return every `every`-th sample after a low-pass (a Hann-windowed sinc) that passes the shown band."""
    if every == 1:
        return signal
    taps = np.arange(-8 * every, 8 * every + 1)
    kernel = np.sinc(taps / every) * np.hanning(taps.size)
    kernel = (kernel / kernel.sum()).astype(signal.dtype)
    # By FFT, because a direct convolution takes twenty times as long.
    size = 1 << (signal.size + taps.size - 1).bit_length()
    smooth = np.fft.irfft(np.fft.rfft(signal, size) * np.fft.rfft(kernel, size), size)
    return smooth[8 * every : 8 * every + signal.size : every].astype(signal.dtype)


def _db(amplitude: NDArray[np.floating]) -> NDArray[np.float32]:
    return (20.0 * np.log10(np.maximum(np.nan_to_num(amplitude), 1e-10))).astype(np.float32)
