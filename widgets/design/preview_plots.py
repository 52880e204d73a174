"""The three plots of the preview, drawn from arrays."""

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QBrush, QColor, QLinearGradient, QPainterPath
from PySide6.QtWidgets import QGraphicsPathItem

from underfoot.quantities import number, pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.design.analysis import FELT_HZ, Scale
from underfoot.widgets.plots import AXIS_PX, HeatItem, Plot, round_top, thinned

FORCE_AXIS_PX = 44
COLUMNS = 700


class PreviewPlot(Plot):
    """A plot of the preview: a word in its middle where there is nothing to draw."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.setMinimumSize(64, 48)
        self._empty = pg.TextItem("", color=theme.MUTED, anchor=(0.5, 0.5))
        self._empty.setFont(theme.font())
        self.addItem(self._empty, ignoreBounds=True)
        item = self.getPlotItem()
        item.setContentsMargins(0, 4, 0, 0)

    def _say(self, text: str) -> None:
        (left, right), (bottom, top) = self.box.viewRange()
        self._empty.setPos((left + right) / 2, (bottom + top) / 2)
        self._empty.setText(text)

    def _right_axis(self) -> pg.AxisItem:
        item = self.getPlotItem()
        item.showAxis("right")
        axis = item.getAxis("right")
        axis.setPen(pg.mkPen(theme.LINE, width=1))
        axis.setTextPen(theme.FORCE)
        axis.setStyle(tickFont=theme.font(theme.SMALL_PX), tickLength=0, tickTextOffset=6, hideOverlappingLabels=False)
        axis.setWidth(FORCE_AXIS_PX)
        axis.setTicks([[]])
        return axis

    def _caption(self, colour: str, anchor: tuple[float, float]) -> pg.TextItem:
        text = pg.TextItem("", color=colour, anchor=anchor, fill=pg.mkBrush(18, 21, 26, 150))
        text.setFont(theme.font(theme.SMALL_PX))
        self.addItem(text, ignoreBounds=True)
        return text


class WaveformPlot(PreviewPlot):
    """A signal, or events as lines, over time; the force behind it, on the right axis."""

    def __init__(self) -> None:
        super().__init__("Waveform")
        self._force_axis = self._right_axis()
        self._force = self.add_curve(theme.FORCE, z=1.0)
        self._curve = self.add_curve(theme.VIBRATION, z=0.0)
        self._pointer = self.add_line(theme.MUTED)
        self._unit = self._caption(theme.MUTED, (0.0, 0.0))
        self._times = True
        self.clear_data()

    def clear_data(self, why: str = "") -> None:
        self._curve.setData([], [])
        self._force.setData([], [])
        self._force_axis.setTicks([[]])
        self._unit.setText("")
        self._set_times(0.9)
        self.set_axis("left", -1.0, 1.0, [(0.0, "0")])
        self._say(why)

    def show_times(self, on: bool) -> None:
        """Whether the time axis is written here."""
        self._times = on
        self.getPlotItem().getAxis("bottom").setHeight(20 if on else 6)
        self.getPlotItem().getAxis("bottom").setStyle(showValues=on)

    def show_signal(
        self, values: NDArray[np.float64], rate_hz: float, unit: str, colour: str, force_n: NDArray, seconds: float
    ) -> None:
        self._say("")
        self._set_times(seconds)
        low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
        top = round_top(max(-low, high, 1e-9))
        bottom = -top if low < 0.0 else 0.0
        self._set_values(bottom, top, unit)
        time_s = np.arange(values.size) / rate_hz
        x, y = thinned(time_s, values[:, None], max(seconds, 1e-3) / COLUMNS)
        self._curve.setPen(pg.mkPen(colour, width=1))
        self._curve.setData(x, y[:, 0], connect="all")
        self._show_force(force_n, rate_hz, bottom, top, colour == theme.FORCE)

    def show_events(
        self, times_s: NDArray[np.float64], strengths: NDArray[np.float64], force_n: NDArray, seconds: float
    ) -> None:
        self._say("" if times_s.size else "no events in this step")
        self._set_times(seconds)
        top = round_top(float(strengths.max(initial=0.0)) or 1.0)
        self._set_values(0.0, top, "")
        x = np.repeat(times_s, 2)
        y = np.zeros(2 * times_s.size)
        y[1::2] = strengths
        self._curve.setPen(pg.mkPen(theme.EVENTS, width=1))
        self._curve.setData(x, y, connect="pairs")
        self._show_force(force_n, force_n.size / seconds if seconds else 1.0, 0.0, top, False)

    def point_at(self, time_s: float) -> None:
        self._pointer.place_x(time_s)

    def _set_times(self, seconds: float) -> None:
        self.set_axis("bottom", 0.0, max(seconds, 1e-3), _time_ticks(seconds))

    def _set_values(self, bottom: float, top: float, unit: str) -> None:
        places = (bottom, 0.0) if bottom < 0 else (0.0, top / 2)
        ticks = [
            *((v, number(v)) for v in places),
            (top, f"{number(top)} {pretty_unit(unit)}"),
        ]
        room = 0.06 * (top - bottom)
        self.set_axis("left", bottom - room, top + room, ticks)

    def _show_force(self, force_n: NDArray, rate_hz: float, bottom: float, top: float, is_force: bool) -> None:
        largest = float(force_n.max(initial=0.0))
        if largest <= 0.0 or is_force:
            self._force.setData([], [])
            self._force_axis.setTicks([[]])
            return
        full = round_top(largest)
        full = full * 0.8 if largest <= full * 0.8 else full
        time_s = np.arange(force_n.size) / rate_hz
        x, y = thinned(time_s, force_n[:, None], force_n.size / rate_hz / COLUMNS)
        self._force.setData(x, bottom + y[:, 0] / full * (top - bottom), connect="all")
        self._force_axis.setTicks([[(bottom + s * (top - bottom), quantity(s * full, "N")) for s in (0.0, 0.5, 1.0)]])


class SpectrogramPlot(PreviewPlot):
    """Levels over time and frequency, with the felt band between two lines."""

    def __init__(self) -> None:
        super().__init__("Spectrogram")
        self._right_axis()
        self._heat = HeatItem()
        self.addItem(self._heat, ignoreBounds=True)
        self._felt = self.add_line(theme.MUTED, dashed=True)
        self._pointer = self.add_line(theme.MUTED)
        self._felt_text = self._caption(theme.MUTED, (1.0, 0.0))
        self._set_scale(Scale(), 0.9)

    def clear_data(self, why: str = "") -> None:
        self._heat.setVisible(False)
        self._say(why)

    def show_levels(self, levels: NDArray[np.uint8], scale: Scale, seconds: float) -> None:
        self._say("")
        self._set_scale(scale, seconds)
        low, high = scale.span
        self._heat.set_levels(levels, QRectF(0.0, low, seconds, high - low))
        self._heat.setVisible(True)

    def point_at(self, time_s: float) -> None:
        self._pointer.place_x(time_s)

    def _set_scale(self, scale: Scale, seconds: float) -> None:
        self.set_axis("bottom", 0.0, max(seconds, 1e-3), _time_ticks(seconds))
        low, high = scale.span
        texts = [(at, f"{text} Hz" if text in ("20", "0") else text) for at, text in scale.ticks()]
        self.set_axis("left", low, high, texts)
        felt = [scale.place(hz) for hz in FELT_HZ]
        self._felt.place_y(*felt)
        self._felt_text.setText("felt by the sole: 40 to 1 000 Hz")
        self._felt_text.setPos(max(seconds, 1e-3), felt[1])


class SpectrumPlot(PreviewPlot):
    """Levels along, frequency upwards, beside the spectrogram; filled with its colours, so that it is their key."""

    def __init__(self) -> None:
        super().__init__("Spectrum")
        self._curve = QGraphicsPathItem()
        pen = pg.mkPen(theme.mixed(theme.TEXT, theme.GROUND, 0.5), width=1)
        self._curve.setPen(pen)
        self.addItem(self._curve, ignoreBounds=True)
        self._kept = QGraphicsPathItem()
        self._kept.setPen(pg.mkPen(theme.FORCE, width=1))
        self.addItem(self._kept, ignoreBounds=True)
        self._felt = self.add_line(theme.MUTED, dashed=True)
        self.show_frequencies(False)
        self._set_scale(Scale(), 0.0, 60.0, "")

    def clear_data(self, why: str = "") -> None:
        self._curve.setPath(QPainterPath())
        self._kept.setPath(QPainterPath())
        self._say(why)

    def show_frequencies(self, on: bool) -> None:
        """Whether the frequency axis is written here."""
        axis = self.getPlotItem().getAxis("left")
        axis.setStyle(showValues=on)
        axis.setWidth(AXIS_PX if on else 8)

    def show_line(
        self,
        levels_db: NDArray[np.float32],
        kept_db: NDArray[np.float32] | None,
        scale: Scale,
        top_db: float,
        range_db: float,
        unit: str,
    ) -> None:
        """Levels, one a row from the lowest frequency, and those that were kept to be compared with."""
        self._say("")
        self._set_scale(scale, top_db, range_db, unit)
        low, high = scale.span
        bottom = top_db - range_db
        places = low + (np.arange(levels_db.size) + 0.5) / levels_db.size * (high - low)
        x = np.concatenate([[bottom], np.maximum(levels_db, bottom), [bottom]])
        y = np.concatenate([[low], places, [high]])
        gradient = QLinearGradient(QPointF(bottom, 0.0), QPointF(top_db, 0.0))
        table = theme.heat_table()
        for i in range(0, 256, 15):
            gradient.setColorAt(i / 255.0, QColor(*(int(c) for c in table[i][:3])))
        self._curve.setBrush(QBrush(gradient))
        self._curve.setPath(pg.arrayToQPath(x, y))
        kept = QPainterPath() if kept_db is None else pg.arrayToQPath(np.maximum(kept_db, bottom), places)
        self._kept.setPath(kept)

    def _set_scale(self, scale: Scale, top_db: float, range_db: float, unit: str) -> None:
        low, high = scale.span
        self.set_axis("left", low, high, scale.ticks())
        step = range_db / 3.0
        ticks = [(top_db - i * step, f"{number(top_db - i * step)} dB") for i in (1, 2)]
        self.set_axis("bottom", top_db - range_db, top_db, ticks)
        self._felt.place_y(*(scale.place(hz) for hz in FELT_HZ))
        reference = f"1 {pretty_unit(unit)}" if unit else "1"
        self.setToolTip(f"Amplitude in dB of {reference}; the colours are those of the spectrogram")


def _time_ticks(seconds: float) -> list[tuple[float, str]]:
    """Some nine places in time, the last of them with the unit; none so near the end that its text would be cut."""
    step = next(step for step in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 1e9) if seconds / step <= 10.0)
    places = [i * step for i in range(11) if i * step <= 0.97 * seconds]
    return [(at, f"{at * 1000:g}{' ms' if at == places[-1] else ''}") for at in places]
