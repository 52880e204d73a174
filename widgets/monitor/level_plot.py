"""What a tile is asked, what it does and what is felt of it, over frequency."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, Series
from underfoot.floor.tile_response import TileResponse
from underfoot.models.sole import BAND_HZ, felt, stiffness_in_words, threshold_m_s2, windowed_peak
from underfoot.quantities import quantity
from underfoot.widgets.plots.plot import Plot

RANGE_DB = (-60.0, 30.0)
GAIN_DB = (-30.0, 30.0)
_BANDS = np.array(BAND_HZ)


class LevelPlot(Plot):
    """Levels in third octaves, commanded and measured, over the thresholds of the sole; and the gain between."""

    def __init__(self) -> None:
        super().__init__()
        self.show_response(None)

    def show_response(self, response: TileResponse | None) -> None:
        """Show this; nothing but the thresholds where nothing was measured."""
        lines = [
            Series("felt, hard shoe", _BANDS, _db(threshold_m_s2(_BANDS, "shoe")), "dashed", "muted"),
            Series("felt, small probe, barefoot", _BANDS, _db(threshold_m_s2(_BANDS)), "dashed", "faint"),
        ]
        if response is not None:
            asked, done = _db(response.commanded), _db(response.measured)
            gain = np.clip(response.transfer_db, *GAIN_DB)
            lines += [
                Series("commanded", _BANDS, np.maximum(asked, RANGE_DB[0])),
                Series("measured", _BANDS, np.maximum(done, RANGE_DB[0]), colour="contact"),
                Series("gain", _BANDS, gain, "dots", "events", right=True),
            ]
        self.show_drawing(
            Drawing(
                "",
                "frequency, Hz",
                "third octaves, dB of 1 m/s^2",
                tuple(lines),
                x_log=True,
                x_range=(BAND_HZ[0], BAND_HZ[-1]),
                y_range=RANGE_DB,
                right="gain, dB",
                right_range=GAIN_DB,
                note="" if response is not None else "nothing is measured here",
            )
        )


def in_words(
    commanded: NDArray[np.floating], measured: NDArray[np.floating], rate_hz: float, unexplained: float
) -> str:
    """The levels of both (n,), m/s^2, and what is felt of what was measured, in a line.

    >>> tone = 0.3 * np.sin(2 * np.pi * 300 / 48000 * np.arange(48000))
    >>> in_words(tone, tone, 48000.0, 0.0)
    'asked 0.3 m/s², done 0.3 (+0.0 dB, 0 % unexplained); 1 dB under threshold, noticed by 43 %; 90 N/mm feel like 73'
    """
    asked, done = windowed_peak(commanded, rate_hz), windowed_peak(measured, rate_hz)
    if done < 1e-4 and asked < 1e-4:
        return "silent"
    words = f"asked {quantity(asked, 'm/s^2')}, done {done:.2g}"
    if asked > 1e-4 and done > 1e-4:
        words += f" ({20.0 * math.log10(done / asked):+.1f} dB, {100.0 * unexplained:.0f} % unexplained)"
    found = felt(measured, rate_hz)
    level_db = found.level_db["shoe"]
    if math.isfinite(level_db):
        side = "over" if level_db >= 0.0 else "under"
        words += f"; {abs(level_db):.0f} dB {side} threshold, noticed by {100.0 * found.noticed:.0f} %"
    return f"{words}; {stiffness_in_words(done)}".replace("-", "−")


def _db(amplitude_m_s2: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(20.0 * np.log10(np.maximum(amplitude_m_s2, 1e-9)))
