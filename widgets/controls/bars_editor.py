"""A list of numbers as bars, such as amplitudes of harmonics or values of a sequence."""

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QMouseEvent, QPainter

from underfoot.parameters import Numbers
from underfoot.quantities import counted, number
from underfoot.widgets import theme
from underfoot.widgets.controls.handle_pad import HandlePad
from underfoot.widgets.controls.parameter_editor import NumbersEditor


class Bars(HandlePad):
    """A bar for each number. A drag across draws several bars; the scale adapts when the mouse is released."""

    HEIGHT_PX = 120

    def __init__(self, parameter: Numbers) -> None:
        super().__init__()
        self._parameter = parameter
        self._values: list[float] = []
        self._low, self._high = 0.0, 1.0
        self.setAccessibleName(f"{parameter.label} as bars")

    def values(self) -> list[float]:
        return list(self._values)

    def set_values(self, values: Sequence[float]) -> None:
        """Show these numbers, without emitting a change."""
        self._values = list(values)
        self.chosen = min(self.chosen, len(self._values) - 1)
        self._fit()
        self.update()

    def _fit(self) -> None:
        """Fit the ends of the scale: at least 0 to 1, with a margin above the values, within the allowed range."""
        if not self.is_dragged:
            self._high = min(max(1.0, 1.25 * max(self._values, default=0.0)), self._parameter.high)
            self._low = max(min(0.0, 1.25 * min(self._values, default=0.0)), self._parameter.low)

    def _scaled(self) -> QRectF:
        """Return the rectangle from the lowest to the highest value; half a handle fits above it."""
        return self.area().adjusted(0.0, 6.0, 0.0, 0.0)

    def _y(self, value: float) -> float:
        area = self._scaled()
        return area.bottom() - (value - self._low) / (self._high - self._low) * area.height()

    def _bar(self, index: int) -> QRectF:
        area = self.area()
        width = area.width() / max(len(self._values), 1)
        top, foot = sorted((self._y(self._values[index]), self._y(0.0)))
        return QRectF(area.x() + index * width + 1.0, top, width - 2.0, max(foot - top, 1.0))

    def handles(self) -> list[QPointF]:
        return [QPointF(self._bar(i).center().x(), self._y(v)) for i, v in enumerate(self._values)]

    def _handle_at(self, place: QPointF) -> int:
        """Return the index of the bar in this column, at any distance from its top."""
        area = self.area()
        at = int((place.x() - area.x()) / area.width() * len(self._values))
        return at if self._values and area.adjusted(0, -4, 0, 4).contains(place) and at < len(self._values) else -1

    def mousePressEvent(self, event: QMouseEvent) -> None:
        super().mousePressEvent(event)
        self.mouseMoveEvent(event)  # a click sets the bar's value

    def _let_go(self) -> None:
        super()._let_go()
        self._fit()

    def drag(self, index: int, place: QPointF) -> None:
        area = self._scaled()
        at = min(max(int((place.x() - area.x()) / area.width() * len(self._values)), 0), len(self._values) - 1)
        self.chosen = at
        share = min(max((area.bottom() - place.y()) / area.height(), 0.0), 1.0)
        value = round(self._low + share * (self._high - self._low), 2)
        self._set(at, value)

    def begin_edit(self, edit_name: str) -> None:
        super().begin_edit("drag" if edit_name.startswith("drag") else edit_name)  # a drag over bars is one edit

    def nudge(self, index: int, across: float, up: float) -> None:
        if across:
            self.chosen = min(max(index + (1 if across > 0 else -1), 0), len(self._values) - 1)
        else:
            self._set(index, round(self._values[index] + 0.05 * up, 3))

    def turn_wheel(self, index: int, steps: float) -> None:
        self.nudge(index, 0.0, steps)

    def add(self, place: QPointF | None) -> None:
        if len(self._values) < self._parameter.most:
            self._values.append(self._values[-1] if self._values else 0.5)
            self.chosen = len(self._values) - 1
            self._fit()
            self.emit_changed()

    def remove(self, index: int) -> None:
        if len(self._values) > self._parameter.least:
            del self._values[index]
            self._fit()
            self.emit_changed()

    def _set(self, index: int, value: float) -> None:
        value = min(max(value, self._parameter.low), self._parameter.high)
        if value != self._values[index]:
            self._values[index] = value
            self._fit()
            self.emit_changed()

    def caption(self) -> str:
        if 0 <= self.chosen < len(self._values):
            return f"{self.chosen + 1} of {len(self._values)}: {number(self._values[self.chosen])}"
        return f"{counted(len(self._values), 'bar')}; Enter adds, Delete removes"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        count = len(self._values)
        for i in range(count):
            colour = theme.mixed(theme.VIBRATION, theme.RAISED, 0.9 if i == self.chosen else 0.5)
            painter.fillRect(self._bar(i), QColor(colour))
        painter.setPen(QColor(theme.MUTED))
        painter.setFont(theme.font(theme.SMALL_PX))
        every = max(-(-count // 8), 1)
        for i in range(0, count, every):
            painter.drawText(QPointF(self._bar(i).center().x() - 3.0, area.bottom() + 12.0), str(i + 1))


class BarsEditor(NumbersEditor):
    """Bars above a text field with the same numbers."""

    def __init__(self, parameter: Numbers) -> None:
        self.bars = Bars(parameter)
        super().__init__(parameter)
        self.bars.setParent(self)
        self.bars.setToolTip(
            "Drag: set bars, over several at once. Keys: arrows choose and change (with Shift finely),\n"
            "Enter adds a bar, Delete removes one. The numbers are below."
        )
        self.grid.addWidget(self.bars, 1, 0, 1, 3)
        self.grid.addWidget(self.field, 2, 0, 1, 3)
        self.bars.edit_began.connect(self.edit_began)
        self.bars.changed.connect(self._drawn)

    def _drawn(self) -> None:
        self._commit(self.bars.values())
        super()._show()

    def _show(self) -> None:
        super()._show()
        self.bars.set_values(self._value)

    def _typed(self, text: str) -> None:
        super()._typed(text)
        self.bars.set_values(self._value)
