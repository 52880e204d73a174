"""The modes of an object as a spectrum: a drag sets frequency and gain, the wheel sets the decay."""

import math
from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPen

from underfoot.parameters import Parameter, Rows
from underfoot.quantities import counted, number, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.rows_pad import RowsPad, RowsPadEditor

Mode = tuple[float, ...]
"""Frequency (Hz), decay (1/s), then an amplitude, or modal mass (kg) and shape."""
LOWEST_HZ, DEFAULT_HIGH_HZ, HIGHEST_HZ = 20.0, 4000.0, 20_000.0
"""The ends of the frequency axis; its upper end is the highest only if a mode lies above the default."""
MIN_DB, MAX_DB = -40.0, 20.0
FREQUENCY, DECAY = 0, 1
_SEMITONE, _DECAY_STEP = 2.0 ** (1.0 / 12.0), 1.1


def is_modes(parameter: Parameter) -> bool:
    """Return whether a parameter's rows are modes."""
    return isinstance(parameter, Rows) and [n for n, _, _ in parameter.columns[:2]] == ["frequency Hz", "decay 1/s"]


def gain_db(mode: Mode) -> float:
    """Return the gain of a mode in dB re 1: its amplitude, or its squared mode shape over modal mass.

    >>> gain_db((180.0, 90.0, -10.0)), round(gain_db((92.0, 22.0, 0.5, 1.0)), 2)
    (20.0, 6.02)
    """
    size = abs(mode[2]) if len(mode) == 3 else mode[3] ** 2 / mode[2]
    return 20.0 * math.log10(max(size, 1e-9))


def with_gain(mode: Mode, db: float) -> Mode:
    """Return the mode with another gain, by its amplitude, or by its mode shape at the struck point.

    >>> with_gain((180.0, 90.0, -1.0), -20.0)
    (180.0, 90.0, -0.1)
    """
    size = 10.0 ** (db / 20.0)
    value = size if len(mode) == 3 else math.sqrt(size * mode[2])
    return (*mode[:-1], float(f"{math.copysign(value, mode[-1]):.4g}"))


class ModesSpectrum(RowsPad):
    """Frequency from left to right, gain upwards; a mode with a wider peak decays faster."""

    HEIGHT_PX = 152

    def __init__(self, parameter: Rows) -> None:
        super().__init__(parameter)
        self._extent = math.log(DEFAULT_HIGH_HZ / LOWEST_HZ)
        self.setAccessibleName("Modes as a spectrum")

    def set_rows(self, rows: Sequence[Mode]) -> None:
        super().set_rows(rows)
        if not self.is_dragged:
            beyond = any(mode[FREQUENCY] > DEFAULT_HIGH_HZ for mode in self._rows)
            self._extent = math.log(HIGHEST_HZ / LOWEST_HZ if beyond else DEFAULT_HIGH_HZ / LOWEST_HZ)

    def place(self, frequency_hz: float, db: float) -> QPointF:
        """Return the position of a mode in the picture, in pixels."""
        area = self.area()
        across = math.log(frequency_hz / LOWEST_HZ) / self._extent
        up = (db - MIN_DB) / (MAX_DB - MIN_DB)
        return QPointF(
            area.x() + min(max(across, 0.0), 1.0) * area.width(),
            area.bottom() - min(max(up, 0.0), 1.0) * area.height(),
        )

    def handles(self) -> list[QPointF]:
        return [self.place(mode[FREQUENCY], gain_db(mode)) for mode in self._rows]

    def _value_at(self, place: QPointF) -> tuple[float, float]:
        """Return frequency in Hz and gain in dB at a position."""
        area = self.area()
        across = min(max((place.x() - area.x()) / area.width(), 0.0), 1.0)
        up = min(max((area.bottom() - place.y()) / area.height(), 0.0), 1.0)
        frequency_hz = LOWEST_HZ * math.exp(across * self._extent)
        return float(f"{frequency_hz:.3g}"), round(MIN_DB + up * (MAX_DB - MIN_DB), 1)

    def drag(self, index: int, place: QPointF) -> None:
        frequency_hz, db = self._value_at(place)
        self._set(index, with_gain((frequency_hz, *self._rows[index][1:]), db))

    def nudge(self, index: int, across: float, up: float) -> None:
        mode = self._rows[index]
        frequency_hz = float(f"{mode[FREQUENCY] * _SEMITONE**across:.5g}")
        mode = (frequency_hz, *mode[1:])
        self._set(index, with_gain(mode, gain_db(mode) + up) if up else mode)

    def turn_wheel(self, index: int, steps: float) -> None:
        mode = self._rows[index]
        self._set(index, (mode[FREQUENCY], float(f"{mode[DECAY] * _DECAY_STEP**steps:.4g}"), *mode[2:]))

    def add(self, place: QPointF | None) -> None:
        if len(self._rows) >= self._max_rows:
            return
        if place is None:
            last = max((mode[FREQUENCY] for mode in self._rows), default=100.0)
            place = self.place(min(1.5 * last, HIGHEST_HZ), 0.0)
        frequency_hz, db = self._value_at(place)
        like = min(self._rows, key=lambda m: abs(math.log(m[FREQUENCY] / frequency_hz)), default=None)
        rest = like[1:] if like else (50.0, *(1.0 for _ in self._columns[2:]))
        self._rows.append(self._clamped(with_gain((frequency_hz, *rest), db)))
        self.chosen = len(self._rows) - 1
        self.emit_changed()

    def _clamped(self, mode: Mode) -> Mode:
        return tuple(min(max(v, low), high) for v, (_, low, high) in zip(mode, self._columns, strict=True))

    def _set(self, index: int, mode: Mode) -> None:
        self.replace(index, self._clamped(mode))

    def caption(self) -> str:
        if not 0 <= self.chosen < len(self._rows):
            return f"{counted(len(self._rows), 'mode')}; double-click adds one"
        mode = self._rows[self.chosen]
        ring = quantity(math.log(1e3) / mode[DECAY], "s")
        strength = number(round(gain_db(mode), 1))
        return f"{quantity(mode[FREQUENCY], 'Hz')}, {strength} dB, {number(mode[DECAY])}/s: 60 dB in {ring}"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        last_hz = round(LOWEST_HZ * math.exp(self._extent))
        for frequency_hz in (20, 50, 100, 200, 500, 1000, 2000, 4000, 10_000, 20_000):
            named = {20: "20", 100: "100", 500: "500", last_hz: quantity(last_hz, "Hz")}
            if frequency_hz <= last_hz:
                self.draw_axis_line(painter, self.place(frequency_hz, 0.0).x(), named.get(frequency_hz, ""))
        painter.setFont(theme.font(theme.SMALL_PX))
        for db in (-20, 0):
            y = self.place(100.0, db).y()
            painter.setPen(QPen(QColor(theme.LINE), 1.0))
            painter.drawLine(QPointF(area.left(), y), QPointF(area.right(), y))
            painter.setPen(QColor(theme.MUTED))
            painter.drawText(QPointF(area.left() + 3.0, y - 2.0), f"{number(db)} dB")
        for i, mode in enumerate(self._rows):
            self._paint_peak(painter, mode, i == self.chosen)

    def _paint_peak(self, painter: QPainter, mode: Mode, is_chosen: bool) -> None:
        """Paint a peak below the handle, whose base is the half-power bandwidth of the resonance."""
        top = self.place(mode[FREQUENCY], gain_db(mode))
        half = mode[DECAY] / (2.0 * math.pi)
        left = self.place(max(mode[FREQUENCY] - half, LOWEST_HZ), MIN_DB)
        right = self.place(mode[FREQUENCY] + half, MIN_DB)
        colour = QColor(theme.mixed(theme.VIBRATION, theme.RAISED, 0.8 if is_chosen else 0.45))
        painter.setPen(QPen(colour, 1.5))
        painter.setBrush(QColor(theme.mixed(theme.VIBRATION, theme.RAISED, 0.3)))
        painter.drawPolygon([left, top, right])


class ModesEditor(RowsPadEditor):
    """The spectrum above the table of the same modes."""

    def __init__(self, parameter: Rows) -> None:
        tip = (
            "Drag a partial: frequency and gain. Wheel: decay. Double-click: add one. Right click: remove it.\n"
            "Keys: N and P choose, arrows move (with Shift finely), Page Up and Down change the decay,\n"
            "Enter adds, Delete takes away. The numbers are below."
        )
        super().__init__(parameter, ModesSpectrum(parameter), tip)
