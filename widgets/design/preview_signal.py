"""The visible range of a preview: its frames, and their description as text. numpy only."""

import math
from collections.abc import Mapping

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from underfoot.drawing import Range
from underfoot.engine.reports import MEASURED, Preview
from underfoot.kernels import Floats
from underfoot.models.sole import felt, felt_in_words, stiffness_in_words, windowed_peak
from underfoot.patch.node import Port
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.design.analysis import peak_and_rms
from underfoot.widgets.plots.spectrogram import FELT_HZ

SHORTEST_MS = 2.0
"""The shortest visible range."""


class PreviewSignal(Struct, frozen=True):
    """Frames of one output [n]; force on the tile [m]; the tile's response [n], if known; and the whole preview's
    margin below the limiter, in dB.
    """

    values: Floats
    force_n: Floats
    rate_hz: float
    unit: str = ""
    is_force: bool = False
    measured: Floats | None = None
    begin_ms: float = 0.0
    headroom_db: float | None = None

    @staticmethod
    def of(preview: Preview, node: str, port: Port) -> "PreviewSignal":
        """Return the whole signal of an output; values that are not finite become 0."""
        values = np.nan_to_num(np.asarray(signal_of(preview.signals, node, port.name), np.float64))
        done = preview.signals.get(MEASURED)
        measured = None if done is None else np.nan_to_num(done.astype(np.float64))
        is_force = port.kind != "event" and port.unit in theme.FORCE_UNITS
        force_n, headroom_db = total_force(preview.force_n), preview.headroom_db
        return PreviewSignal(values, force_n, preview.rate_hz, port.unit, is_force, measured, headroom_db=headroom_db)

    @property
    def end_ms(self) -> float:
        """The end of the signal, in ms of the preview."""
        return self.begin_ms + 1e3 * max(self.values.size, self.force_n.size) / self.rate_hz

    @property
    def view_ms(self) -> Range:
        """The time axis, from the signal's beginning to its end, with a positive length."""
        return self.begin_ms, max(self.end_ms, self.begin_ms + 1.0)

    def cut(self, view_ms: Range | None) -> "PreviewSignal":
        """Return the visible part of the signal.

        >>> whole = PreviewSignal(np.arange(96.0), np.zeros(96), 48000.0)
        >>> part = whole.cut((0.5, 1.0))
        >>> part.values.size, float(part.values[0]), part.begin_ms, part.end_ms
        (24, 24.0, 0.5, 1.0)
        """
        if view_ms is None:
            return self
        first, last = (round(1e-3 * ms * self.rate_hz) for ms in view_ms)
        measured = None if self.measured is None else self.measured[first:last]
        begin_ms = 1e3 * first / self.rate_hz
        return replace(
            self, values=self.values[first:last], force_n=self.force_n[first:last], measured=measured, begin_ms=begin_ms
        )

    def text_at(self, time_ms: float) -> str:
        """Return the values at `time_ms` with their units, and the level of an acceleration."""
        i = round(1e-3 * (time_ms - self.begin_ms) * self.rate_hz)
        if not 0 <= i < self.values.size:
            return ""
        value = float(self.values[i])
        text = f"{time_ms:.1f} ms: {quantity(value, self.unit)}"
        if value != 0.0:
            text += f" ({quantity(20.0 * math.log10(abs(value)), 'dB')})"
        if self.measured is not None and i < self.measured.size:
            text += f", the tile {quantity(float(self.measured[i]), 'm/s^2')}"
        return text + (f", {quantity(float(self.force_n[i]), 'N')}" if i < self.force_n.size else "")


def zoomed_view(view_ms: Range | None, whole_ms: float, factor: float, about_ms: float) -> Range | None:
    """Return the view narrowed by `factor` around `about_ms`; None for the whole.

    >>> zoomed_view(None, 900.0, 2.0, 300.0), zoomed_view((100.0, 200.0), 900.0, 0.1, 150.0)
    ((150.0, 600.0), None)
    """
    low, high = view_ms or (0.0, whole_ms)
    width = min(max((high - low) / factor, SHORTEST_MS), whole_ms)
    if width >= whole_ms:
        return None
    share = (about_ms - low) / (high - low)
    begin = min(max(about_ms - share * width, 0.0), whole_ms - width)
    return begin, begin + width


def scrolled_view(view_ms: Range | None, whole_ms: float, by_ms: float) -> Range | None:
    """Return the view scrolled by `by_ms`, at most to the end.

    >>> scrolled_view((100.0, 200.0), 250.0, 100.0), scrolled_view(None, 250.0, 10.0)
    ((150.0, 250.0), None)
    """
    if view_ms is None:
        return None
    low, high = view_ms
    begin = min(max(low + by_ms, 0.0), whole_ms - (high - low))
    return begin, begin + (high - low)


def felt_rms(signal: ArrayLike, rate_hz: float) -> float:
    """Return the RMS within the frequency band that the sole is sensitive to.

    >>> time_s = np.arange(48000) / 48000
    >>> [round(felt_rms(np.sin(2 * np.pi * f * time_s), 48000.0), 3) for f in (10.0, 250.0, 3000.0)]
    [0.0, 0.707, 0.0]
    """
    signal = np.asarray(signal, np.float64)
    if signal.size < 2:
        return 0.0
    power = np.abs(np.fft.rfft(signal)) ** 2
    frequencies = np.fft.rfftfreq(signal.size, 1.0 / rate_hz)
    inside = power[(frequencies >= FELT_HZ[0]) & (frequencies <= FELT_HZ[1])].sum()
    return math.sqrt(2.0 * float(inside)) / signal.size


def summary_text(now: PreviewSignal, other: PreviewSignal | None, other_slot: str) -> str:
    """Return peak and RMS, the level difference from another signal, and the sensation level, as text."""
    peak, rms = peak_and_rms(now.values)
    text = f"peak {quantity(peak, now.unit)}, RMS {quantity(rms, now.unit)}"
    if other is not None:
        text += f" ({difference_text(now, other, other_slot)})"
    if now.headroom_db is not None:  # before what is cut in a narrow window
        text += f", headroom {now.headroom_db:.0f} dB" if now.headroom_db >= 0.1 else ", limited at full level"
    if now.measured is not None:
        text += f"; {felt_text(now.measured, now.rate_hz)}"
    return text


def difference_text(now: PreviewSignal, other: PreviewSignal, other_slot: str) -> str:
    """Return the difference of two signals' RMS levels in dB, as text.

    >>> loud, soft, near = (PreviewSignal(np.full(8, level), np.zeros(8), 48000.0) for level in (2.0, 1.0, 0.999))
    >>> difference_text(soft, loud, "B"), difference_text(near, soft, "B")
    ('−6.0 dB re B', '+0.0 dB re B')
    """
    rms, before = peak_and_rms(now.values)[1], peak_and_rms(other.values)[1]
    if not (rms > 0.0 and before > 0.0):
        return f"{other_slot} is {'silent' if before == 0.0 else 'not'}"
    return f"{20.0 * math.log10(rms / before):+z.1f} dB re {other_slot}".replace("-", "−")


def felt_text(measured_m_s2: Floats, rate_hz: float) -> str:
    """Return the peak of the tile's response, and its level above the threshold of a sole in a hard shoe, as text.

    >>> felt_text(0.46 * np.sin(2 * np.pi * 250 / 48000 * np.arange(48000)), 48000.0)
    'tile 0.46 m/s², 8 dB over threshold, noticed by 100 %; 90 N/mm feel like 67 N/mm'
    """
    words = felt_in_words(felt(measured_m_s2, rate_hz))
    peak = quantity(float(np.abs(measured_m_s2).max(initial=0.0)), "m/s^2")
    if not words:
        return f"tile {peak}"
    return f"tile {peak}, {words}; {stiffness_in_words(windowed_peak(measured_m_s2, rate_hz))}"


def signal_of(values: Mapping[str, NDArray[np.floating]], node: str, port: str) -> NDArray[np.floating]:
    """Return the signal of an output in a preview, by its own name or its node's."""
    found = values.get(f"{node}.{port}")
    return found if found is not None else values.get(port, np.zeros(0))


def total_force(force_n: NDArray[np.floating]) -> Floats:
    """Return the total force on the tile in N, from corner forces or from their sum."""
    total_n = np.asarray(force_n, np.float64)
    return total_n.sum(axis=1) if total_n.ndim == 2 else total_n


def event_rows(events: NDArray[np.floating]) -> Floats:
    """Return events as rows of frame, strength and duration."""
    return np.asarray(events, np.float64).reshape(-1, 3)
