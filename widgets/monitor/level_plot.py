"""Levels of a tile over frequency: commanded, measured, and the threshold of the sole."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, Series
from underfoot.floor.tile_response import TileResponse
from underfoot.models.sole import BAND_HZ, felt, felt_in_words, stiffness_in_words, threshold_m_s2, windowed_peak
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
            Series("felt, small probe, barefoot", _BANDS, _db(threshold_m_s2(_BANDS)), "line", "faint"),
        ]
        if response is not None:
            commanded_db, measured_db = _db(response.commanded), _db(response.measured)
            gain = np.clip(response.transfer_db, *GAIN_DB)
            lines += [
                Series("commanded", _BANDS, np.maximum(commanded_db, RANGE_DB[0])),
                Series("measured", _BANDS, np.maximum(measured_db, RANGE_DB[0]), colour="measured"),
                Series("gain", _BANDS, gain, "dots", "events", right=True),
            ]
        self.show_drawing(
            Drawing(
                "",
                "frequency, Hz",
                "third octaves, dB re 1 m/s^2",
                tuple(lines),
                x_log=True,
                x_range=(BAND_HZ[0], BAND_HZ[-1]),
                y_range=RANGE_DB,
                right="gain, dB",
                right_range=GAIN_DB,
                note="" if response is not None else "nothing is measured here",
            )
        )


def summary_text(
    commanded: NDArray[np.floating], measured: NDArray[np.floating], rate_hz: float, unexplained: float
) -> str:
    """Return one line with both levels (n,), m/s^2, and the sensation level of the measured one.

    >>> tone = 0.3 * np.sin(2 * np.pi * 300 / 48000 * np.arange(48000))
    >>> peaks, *sensation = summary_text(tone, tone, 48000.0, 0.0).split("; ")
    >>> peaks
    'commanded 0.3 m/s², measured 0.3 (+0.0 dB, 0 % unexplained)'
    >>> sensation
    ['1 dB under threshold, noticed by 43 %', '90 N/mm feel like 73 N/mm']
    """
    commanded_peak, measured_peak = windowed_peak(commanded, rate_hz), windowed_peak(measured, rate_hz)
    if measured_peak < 1e-4 and commanded_peak < 1e-4:
        return "silent"
    text = f"commanded {quantity(commanded_peak, 'm/s^2')}, measured {measured_peak:.2g}"
    if commanded_peak > 1e-4 and measured_peak > 1e-4:
        text += (
            f" ({20.0 * math.log10(measured_peak / commanded_peak):+.1f} dB, {100.0 * unexplained:.0f} % unexplained)"
        )
    parts = text, felt_in_words(felt(measured, rate_hz)), stiffness_in_words(measured_peak)
    return "; ".join(filter(None, parts)).replace("-", "−")


def whole_parts(text: str) -> str:
    """Return a summary that wraps only between its parts.

    >>> whole_parts("1 dB over threshold; not covered").split(" ")
    ['1\\xa0dB\\xa0over\\xa0threshold;', 'not\\xa0covered']
    """
    return text.replace(" ", "\u00a0").replace(";\u00a0", "; ").replace("/", "/\u2060")  # N/mm is one word, too


def _db(amplitude_m_s2: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(20.0 * np.log10(np.maximum(amplitude_m_s2, 1e-9)))
