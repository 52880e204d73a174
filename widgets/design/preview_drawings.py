"""The drawings of the preview: waveform or events, spectrogram, and the spectrum beside it. Times are in ms."""

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, HeatMap, Range, ReferenceLine, Series
from underfoot.drawing.axes import round_top
from underfoot.drawing.layout import AXIS_PX, Margins
from underfoot.models.sole import BAND_HZ, threshold_m_s2
from underfoot.widgets.design.analysis import Scale
from underfoot.widgets.design.preview_signal import PreviewSignal
from underfoot.widgets.plots.spectrogram import FELT, FELT_HZ, spectrogram

FORCE_AXIS_PX = 52
_LEFT_PX = AXIS_PX + 8
"""Room for "20 000 Hz"."""
TIMES = Margins(_LEFT_PX, top=4.0, right=FORCE_AXIS_PX)
NO_TIMES = Margins(_LEFT_PX, top=4.0, right=FORCE_AXIS_PX, bottom=8.0)
"""Waveform and spectrogram above one another have one time axis, whether or not it is written under the first."""
FREQUENCIES = Margins(_LEFT_PX, 4.0, 8.0)
NO_FREQUENCIES = Margins(8.0, 4.0, 8.0)
"""A spectrum alone, and one beside the spectrogram, where the frequencies are written already."""

_TIME = "time, ms"
_NO_TIME_MS = (0.0, 900.0)
SILENT = 1e-9
"""Smaller signals are drawn as silence, on an axis up to 1."""
_HEADROOM = 0.06
"""Margin of the vertical axis beyond the largest values, as a share of them."""
_CAPTION = (FELT[0], ReferenceLine("y", FELT_HZ[1], dashed=True, name="felt by the sole: 40 to 1\u202f000 Hz"))


def waveform(
    now: PreviewSignal, other: PreviewSignal | None = None, why_silent: str = "", other_slot: str = "B"
) -> Drawing:
    """Return a drawing of a signal over time, with the force on the right axis, unless the signal is a force itself.

    The tile's response is drawn behind it, and the `other` slot's signal in violet, each with its name. `why_silent` is
    shown for a silent signal.
    """
    name = "commanded" if now.measured is not None else "this slot" if other is not None else ""
    drawn = [(name, now.values, "force" if now.is_force else "vibration")]
    if now.measured is not None:
        drawn.append(("measured", now.measured, "measured"))
    if other is not None:
        drawn.append((f"slot {other_slot}", other.values, "events"))
    low = min(float(values.min(initial=0.0)) for _, values, _ in drawn)
    high = max(float(values.max(initial=0.0)) for _, values, _ in drawn)
    largest = max(-low, high)
    top = round_top(largest) if largest > SILENT else 1.0
    bottom = -top if low < -SILENT else 0.0
    lines = [
        Series(name, _times_ms(now, values.size), values, colour=colour) for name, values, colour in reversed(drawn)
    ]
    label = f"signal, {now.unit}" if now.unit else "signal"
    view = (now.begin_ms, max(now.end_ms, other.end_ms if other is not None else 0.0, now.begin_ms + 1.0))
    note = "" if largest > SILENT else why_silent or "silent in this step"
    return _over_time(lines, label, (bottom, top), np.zeros(0) if now.is_force else now.force_n, now, view, note)


def events(
    times_ms: NDArray[np.float64], strengths: NDArray[np.float64], now: PreviewSignal, why_silent: str = ""
) -> Drawing:
    """Return a drawing of events as lines, whose length is their strength, with the force behind them."""
    top = round_top(float(strengths.max(initial=0.0)) or 1.0)
    line = Series("", times_ms, strengths, "stems", "events")
    note = "" if times_ms.size else why_silent or "no events in this step"
    return _over_time([line], "strength", (0.0, top), now.force_n, now, now.view_ms, note)


def no_waveform(note: str) -> Drawing:
    """Return empty axes of a waveform; `note` is the reason."""
    nothing = PreviewSignal(np.zeros(0), np.zeros(0), 1.0)
    line = Series("", np.zeros(0), np.zeros(0))
    return _over_time([line], "signal", (-1.0, 1.0), np.zeros(0), nothing, _NO_TIME_MS, note)


def levels_over_time(
    heat: HeatMap | None, scale: Scale, view_ms: Range | None = None, note: str = "", *, caption: bool
) -> Drawing:
    """Return the spectrogram. Without `heat`, return its empty axes with `note` as the reason.

    `caption` adds labels to the dashed lines of the sensation band. Audio signals have no such lines.
    """
    view = heat.x if heat is not None else view_ms or _NO_TIME_MS
    lines = () if not scale.is_felt else _CAPTION if caption and not note else FELT
    return spectrogram(heat, _TIME, view, scale.range_hz, scale.log, lines, note)


def spectrum(
    levels_db: NDArray[np.float32], other_db: NDArray[np.float32] | None, scale: Scale, range_db: Range
) -> Drawing:
    """Return a drawing of levels, one per row from the lowest frequency up, with the other slot's levels.

    It is filled with the colours of the spectrogram, and so serves as its colour scale.
    """
    bottom = range_db[0]
    rows_hz = scale.rows_hz(levels_db.size)
    lines = [Series("", np.maximum(levels_db.astype(np.float64), bottom), rows_hz, "heat", "muted")]
    if other_db is not None:
        lines.append(Series("other", np.maximum(other_db.astype(np.float64), bottom), rows_hz, colour="events"))
    return _levels_along(lines, scale, range_db)


def sensation(
    commanded_m_s2: NDArray[np.float64],
    measured_m_s2: NDArray[np.float64],
    other_m_s2: NDArray[np.float64] | None,
    scale: Scale,
    range_db: float,
) -> Drawing:
    """Return a drawing of the tile's commanded and measured levels in `sole.BAND_HZ`, with the threshold of the sole in
    a hard shoe, and the other slot's commanded levels.
    """
    bands_hz = np.array(BAND_HZ)
    commanded, measured, threshold = (
        20.0 * np.log10(np.maximum(levels, 1e-9))
        for levels in (commanded_m_s2, measured_m_s2, threshold_m_s2(bands_hz, "shoe"))
    )
    top = 10.0 * np.ceil(max(float(commanded.max()), float(measured.max()), float(threshold.min())) / 10.0)
    bottom = top - range_db
    lines = [
        Series("commanded", np.maximum(commanded, bottom), bands_hz, "heat", "muted"),
        Series("measured", np.maximum(measured, bottom), bands_hz, colour="measured"),
        Series("felt, hard shoe", np.clip(threshold, bottom, top), bands_hz, "dashed", "muted"),
    ]
    if other_m_s2 is not None:
        other = np.clip(20.0 * np.log10(np.maximum(other_m_s2, 1e-9)), bottom, top)
        lines.append(Series("other", other, bands_hz, colour="events"))
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
        lines=FELT if scale.is_felt else (),
    )


def no_spectrum(scale: Scale) -> Drawing:
    """Return empty axes of a spectrum."""
    return spectrum(np.zeros(0, np.float32), None, scale, (-60.0, 0.0))


def _over_time(
    lines: list[Series],
    label: str,
    ends: Range,
    force_n: NDArray[np.float64],
    now: PreviewSignal,
    view_ms: Range,
    note: str,
) -> Drawing:
    largest_n = float(force_n.max(initial=0.0))
    full_n = round_top(largest_n)
    if largest_n > 0.0:
        lines = [Series("force", _times_ms(now, force_n.size), force_n, colour="force", right=True), *lines]
    room = _HEADROOM * (ends[1] - ends[0])
    return Drawing(
        "Waveform",
        _TIME,
        label,
        tuple(lines),
        x_range=view_ms,
        y_range=(ends[0] - room, ends[1] + room),
        right="force, N" if largest_n > 0.0 else "",
        right_range=(-_HEADROOM * full_n, (1.0 + _HEADROOM) * full_n),
        note=note,
    )


def _times_ms(now: PreviewSignal, frames: int) -> NDArray[np.float64]:
    return now.begin_ms + np.arange(frames, dtype=np.float64) * (1e3 / now.rate_hz)
