"""Whether a tile does what it is told: acceleration that was measured against what was commanded."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.models import sole

LEAST_M_S2 = 0.05
"""RMS below which a command is too weak to judge a tile by."""
FURTHEST_DB = 6.0
"""Largest deviation of the measured level from the commanded one, dB, of a tile that does what it is told."""
MEAN_S = 0.5
"""Time over which levels are taken."""
WINDOW_S = 0.1
"""Length of the windows whose spectra are averaged."""
_JUDGED_S = 1.0
"""Least time above `LEAST_M_S2` by which a tile is judged."""


@dataclass(frozen=True)
class TileResponse:
    """The response of a tile to a stretch of commands. Levels are m/s^2.

    `commanded` and `measured` (n,) are peak amplitudes in `sole.BAND_HZ`; `transfer_db` (n,) the gain from one to the
    other, NaN where too little was commanded. `unexplained` is the part of the measured RMS, 0 to 1, that no linear
    response explains: distortion, noise, and a load that changed.
    """

    commanded: NDArray[np.float64]
    measured: NDArray[np.float64]
    transfer_db: NDArray[np.float64]
    unexplained: float


def response_of(commanded_m_s2: ArrayLike, measured_m_s2: ArrayLike, rate_hz: float) -> TileResponse:
    """Return a tile's response to its command, both (n,): the mean over windows of 0.1 s that overlap by half.

    `BadValue` unless both are equally long, and at least two windows.

    >>> noise = np.random.default_rng(1).standard_normal(48000)
    >>> found = response_of(noise, 0.5 * noise, 48000.0)
    >>> bool(np.allclose(found.transfer_db, -6.02, atol=0.01)), round(found.unexplained, 3)
    (True, 0.0)
    """
    commanded, measured = np.asarray(commanded_m_s2, dtype=np.float64), np.asarray(measured_m_s2, dtype=np.float64)
    size = round(WINDOW_S * rate_hz)
    require(commanded.shape == measured.shape, "measured", measured.shape, f"the shape of commanded, {commanded.shape}")
    require(len(commanded) >= 2 * size, "commanded", len(commanded), f"at least {2 * size} samples")
    commanded_spectra, measured_spectra = (_spectra(signal, size) for signal in (commanded, measured))
    commanded_power = (np.abs(commanded_spectra) ** 2).sum(axis=0)
    measured_power = (np.abs(measured_spectra) ** 2).sum(axis=0)
    cross = (commanded_spectra.conj() * measured_spectra).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        explained = np.where(commanded_power > 0.0, np.abs(cross) ** 2 / commanded_power, 0.0)
    total = float(measured_power.sum())
    step_hz = rate_hz / size
    bands = np.array(sole.BAND_HZ)
    low, high = bands * 2.0 ** (-1 / 6) / step_hz, bands * 2.0 ** (1 / 6) / step_hz
    transfer = np.full(len(bands), math.nan)
    for k, (first, last) in enumerate(zip(np.floor(low).astype(int), np.ceil(high).astype(int), strict=True)):
        commanded_here = float(commanded_power[first : last + 1].sum())
        measured_here = float(measured_power[first : last + 1].sum())
        if commanded_here > 1e-6 * float(commanded_power.sum()) and measured_here > 0.0:
            transfer[k] = 10.0 * math.log10(measured_here / commanded_here)
    levels = [sole.band_levels(signal, rate_hz) for signal in (commanded, measured)]
    windows = len(measured_spectra)
    # A response fitted to n windows explains 1 / n of noise, too.
    unexplained = (1.0 - float(explained.sum()) / total) * windows / (windows - 1) if total > 0.0 else 0.0
    return TileResponse(levels[0], levels[1], transfer, math.sqrt(min(max(unexplained, 0.0), 1.0)))


class ResponseMonitor:
    """Running levels of all tiles, and which of them do not do what they are told.

    >>> watch = ResponseMonitor(2, 48000.0)
    >>> tone = np.sin(2 * np.pi * 200 / 48000 * np.arange(96000))
    >>> watch.feed(np.stack([tone, tone], axis=1), np.stack([tone, 0.1 * tone], axis=1))
    >>> watch.deviates().tolist()
    [False, True]
    """

    def __init__(self, tiles: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._squares = np.zeros((2, tiles))
        self._judged_s = np.zeros(tiles)

    def feed(self, commanded_m_s2: NDArray[np.floating], measured_m_s2: NDArray[np.floating]) -> None:
        """Take frames of both, (n, tiles)."""
        n = len(commanded_m_s2)
        if n == 0:
            return
        kept = math.exp(-n / (MEAN_S * self._rate_hz))
        now = [np.einsum("ij,ij->j", one, one) / n for one in (commanded_m_s2, measured_m_s2)]
        self._squares = kept * self._squares + (1.0 - kept) * np.array(now)
        loud = self._squares[0] > LEAST_M_S2**2
        self._judged_s = np.where(loud, self._judged_s + n / self._rate_hz, 0.0)

    def deviates(self) -> NDArray[np.bool_]:
        """Return for each tile whether its level has been further than `FURTHEST_DB` from the command."""
        commanded, measured = np.maximum(self._squares, 1e-12)
        far = np.abs(10.0 * np.log10(measured / commanded)) > FURTHEST_DB
        return far & (self._judged_s > _JUDGED_S)

    def rms(self, row: int) -> tuple[float, float]:
        """Return the commanded and the measured RMS of a tile, m/s^2."""
        commanded, measured = np.sqrt(self._squares[:, row])
        return float(commanded), float(measured)


class ResponseTotals:
    """What was commanded and measured of all tiles since the beginning.

    >>> from underfoot.floor.layout import default_floor
    >>> totals = ResponseTotals(1)
    >>> totals.feed(np.full((10, 1), 2.0), np.full((10, 1), 1.0))
    >>> list(totals.lines(default_floor(1, 1)))
    ['tile t1: asked 2 m/s^2 RMS, done 1 (-6.0 dB), peak 1 for 2']
    """

    def __init__(self, tiles: int) -> None:
        self._squares, self._peaks, self._frames = np.zeros((2, tiles)), np.zeros((2, tiles)), 0

    def feed(self, commanded_m_s2: NDArray[np.floating], measured_m_s2: NDArray[np.floating]) -> None:
        """Take frames of both, (n, tiles)."""
        self._frames += len(commanded_m_s2)
        for of, one in enumerate((commanded_m_s2, measured_m_s2)):
            self._squares[of] += np.einsum("ij,ij->j", one, one, dtype=np.float64)
            np.maximum(self._peaks[of], np.abs(one).max(axis=0, initial=0.0), out=self._peaks[of])

    def lines(self, floor: Floor) -> Iterator[str]:
        """Return one line for each tile that was driven, or that moved: one can be looked at before anything plays."""
        for tile, squares, (peak, reached) in zip(floor.tiles, self._squares.T, self._peaks.T, strict=True):
            commanded_rms, measured_rms = (math.sqrt(square / max(self._frames, 1)) for square in squares)
            if peak >= LEAST_M_S2:
                off_db = 20.0 * math.log10(max(measured_rms, 1e-9) / commanded_rms)
                levels = f"asked {commanded_rms:.3g} m/s^2 RMS, done {measured_rms:.3g} ({off_db:+.1f} dB)"
                yield f"tile {tile.id}: {levels}, peak {reached:.3g} for {peak:.3g}"
            elif reached >= LEAST_M_S2:
                yield f"tile {tile.id}: asked nothing, done {measured_rms:.3g} m/s^2 RMS, peak {reached:.3g}"


def _spectra(signal: NDArray[np.float64], size: int) -> NDArray[np.complex128]:
    pieces = np.lib.stride_tricks.sliding_window_view(signal, size)[:: size // 2]
    return np.fft.rfft(pieces * np.hanning(size + 1)[:-1], axis=1)
