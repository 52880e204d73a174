"""The three drawings of the preview: waveform or events, spectrogram, and spectrum beside it. Times are in ms."""

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, HeatMap, Range, ReferenceLine, Series
from underfoot.drawing.axes import round_top
from underfoot.drawing.layout import AXIS_PX, Margins
from underfoot.models.sole import BAND_HZ, threshold_m_s2
from underfoot.widgets.design.analysis import Scale
from underfoot.widgets.plots.spectrogram import FELT, FELT_HZ, spectrogram

FORCE_AXIS_PX = 52
TIMES = Margins(top=4.0, right=FORCE_AXIS_PX)
NO_TIMES = Margins(top=4.0, right=FORCE_AXIS_PX, bottom=8.0)
"""Waveform and spectrogram above one another have one time axis, whether or not it is written under the first."""
FREQUENCIES = Margins(AXIS_PX, 4.0, 8.0)
NO_FREQUENCIES = Margins(8.0, 4.0, 8.0)
"""A spectrum alone, and one beside the spectrogram, where the frequencies are written already."""

_TIME = "time, ms"
_ROOM = 0.06
"""What the vertical axis shows beyond its largest values, as a share of them."""
_CAPTION = (FELT[0], ReferenceLine("y", FELT_HZ[1], dashed=True, name="felt by the sole: 40 to 1\u202f000 Hz"))


def waveform(
    values: NDArray[np.float64],
    unit: str,
    force_n: NDArray[np.float64],
    rate_hz: float,
    seconds: float,
    is_force: bool = False,
    measured: NDArray[np.float64] | None = None,
) -> Drawing:
    """A signal [n] over time; the force [m] behind it, on the right axis, unless the signal is a force itself.

    `measured` is drawn behind it: what the tile does of it.
    """
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    if measured is not None:
        low, high = min(low, float(measured.min(initial=0.0))), max(high, float(measured.max(initial=0.0)))
    top = round_top(max(-low, high, 1e-9))
    bottom = -top if low < 0.0 else 0.0
    colour = "force" if is_force else "vibration"
    times_ms = np.arange(values.size, dtype=np.float64) * (1e3 / rate_hz)
    lines = [Series("", times_ms, values, colour=colour)]
    if measured is not None:
        lines.insert(0, Series("", times_ms[: measured.size], measured, colour="contact"))
    label = f"signal, {unit}" if unit else "signal"
    return _over_time(lines, label, (bottom, top), np.zeros(0) if is_force else force_n, rate_hz, seconds)


def events(
    times_s: NDArray[np.float64],
    strengths: NDArray[np.float64],
    force_n: NDArray[np.float64],
    rate_hz: float,
    seconds: float,
) -> Drawing:
    """Events as lines as long as they are strong, and the force behind them."""
    top = round_top(float(strengths.max(initial=0.0)) or 1.0)
    line = Series("", 1e3 * times_s, strengths, "stems", "events")
    note = "" if times_s.size else "no events in this step"
    return _over_time([line], "strength", (0.0, top), force_n, rate_hz, seconds, note)


def no_waveform() -> Drawing:
    """The axes of a waveform that is not there."""
    return _over_time([Series("", np.zeros(0), np.zeros(0))], "signal", (-1.0, 1.0), np.zeros(0), 1.0, 0.9)


def levels_over_time(heat: HeatMap | None, scale: Scale, seconds: float = 0.9, note: str = "") -> Drawing:
    """The spectrogram; `note` says why there is no `heat`."""
    return spectrogram(heat, _TIME, _times(seconds), scale.range_hz, scale.log, _CAPTION, note)


def spectrum(
    levels_db: NDArray[np.float32], kept_db: NDArray[np.float32] | None, scale: Scale, range_db: Range
) -> Drawing:
    """Levels along, one a row from the lowest frequency upwards, filled with the colours of the spectrogram, so that
    they are their key; and those that were kept to be compared with."""
    bottom = range_db[0]
    rows_hz = scale.rows_hz(levels_db.size)
    lines = [Series("", np.maximum(levels_db.astype(np.float64), bottom), rows_hz, "heat", "muted")]
    if kept_db is not None:
        lines.append(Series("kept", np.maximum(kept_db.astype(np.float64), bottom), rows_hz, colour="force"))
    return _levels_along(lines, scale, range_db)


def sensation(
    commanded_m_s2: NDArray[np.float64], measured_m_s2: NDArray[np.float64], scale: Scale, range_db: float
) -> Drawing:
    """What a tile is asked and does, as levels of `sole.BAND_HZ`, and from where a sole in a hard shoe feels it."""
    bands_hz = np.array(BAND_HZ)
    commanded, measured, threshold = (
        20.0 * np.log10(np.maximum(levels, 1e-9))
        for levels in (commanded_m_s2, measured_m_s2, threshold_m_s2(bands_hz, "shoe"))
    )
    top = 10.0 * np.ceil(max(float(commanded.max()), float(measured.max()), float(threshold.min())) / 10.0)
    bottom = top - range_db
    lines = [
        Series("", np.maximum(commanded, bottom), bands_hz, "heat", "muted"),
        Series("measured", np.maximum(measured, bottom), bands_hz, colour="contact"),
        Series("felt, hard shoe", np.clip(threshold, bottom, top), bands_hz, "dashed", "muted"),
    ]
    return _levels_along(lines, scale, (bottom, top))


def _levels_along(lines: list[Series], scale: Scale, range_db: Range) -> Drawing:
    return Drawing(
        "Spectrum",
        "level, dB",
        "frequency, Hz",
        tuple(lines),
        y_log=scale.log,
        x_range=range_db,
        y_range=scale.range_hz,
        lines=FELT,
    )


def no_spectrum(scale: Scale) -> Drawing:
    """The axes of a spectrum that is not there."""
    return spectrum(np.zeros(0, np.float32), None, scale, (-60.0, 0.0))


def _over_time(
    lines: list[Series],
    label: str,
    ends: Range,
    force_n: NDArray[np.float64],
    rate_hz: float,
    seconds: float,
    note: str = "",
) -> Drawing:
    largest_n = float(force_n.max(initial=0.0))
    full_n = round_top(largest_n)
    if largest_n > 0.0:
        times = np.arange(force_n.size, dtype=np.float64) * (1e3 / rate_hz)
        lines = [Series("force", times, force_n, colour="force", right=True), *lines]
    room = _ROOM * (ends[1] - ends[0])
    return Drawing(
        "Waveform",
        _TIME,
        label,
        tuple(lines),
        x_range=_times(seconds),
        y_range=(ends[0] - room, ends[1] + room),
        right="force, N" if largest_n > 0.0 else "",
        right_range=(-_ROOM * full_n, (1.0 + _ROOM) * full_n),
        note=note,
    )


def _times(seconds: float) -> Range:
    return 0.0, max(1e3 * seconds, 1.0)
