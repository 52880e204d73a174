"""Editor of a piecewise linear curve with points to drag."""

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPen

from underfoot.parameters import Parameter, Rows
from underfoot.quantities import counted, number
from underfoot.widgets import theme
from underfoot.widgets.controls.rows_pad import Row, RowsPad, RowsPadEditor

Point = tuple[float, float]


def is_curve(parameter: Parameter) -> bool:
    """Return whether a parameter's rows are points of a curve: a position and a value."""
    return isinstance(parameter, Rows) and [n.split()[-1] for n, _, _ in parameter.columns] == ["%", "value"]


class Curve(RowsPad):
    """Points from left to right with linear segments between, constant before the first and after the last."""

    def __init__(self, parameter: Rows) -> None:
        super().__init__(parameter)
        (_, self._left, self._right), (_, self._low, self._high) = parameter.columns
        self.setAccessibleName(f"{parameter.label} as a picture")

    def set_rows(self, rows: Sequence[Row]) -> None:
        super().set_rows(sorted(rows))

    def place(self, point: Row) -> QPointF:
        """Return the position of a point in the picture, in pixels."""
        area = self.area()
        across = (point[0] - self._left) / (self._right - self._left)
        up = (point[1] - self._low) / (self._high - self._low)
        return QPointF(area.x() + across * area.width(), area.bottom() - up * area.height())

    def handles(self) -> list[QPointF]:
        return [self.place(point) for point in self._rows]

    def _value_at(self, place: QPointF) -> Point:
        area = self.area()
        across = self._left + (place.x() - area.x()) / area.width() * (self._right - self._left)
        up = self._low + (area.bottom() - place.y()) / area.height() * (self._high - self._low)
        return self._clamped((round(across), round(up, 2)))

    def _clamped(self, point: Point) -> Point:
        return min(max(point[0], self._left), self._right), min(max(point[1], self._low), self._high)

    def drag(self, index: int, place: QPointF) -> None:
        self._set(index, self._value_at(place))

    def nudge(self, index: int, across: float, up: float) -> None:
        x, y = self._rows[index]
        step = 0.01 * (self._right - self._left), 0.05 * (self._high - self._low)
        self._set(index, (round(x + across * step[0], 3), round(y + up * step[1], 4)))

    def add(self, place: QPointF | None) -> None:
        if len(self._rows) >= self._max_rows:
            return
        if place is None:
            place = self.area().center()
        new = self._value_at(place)
        self._rows = sorted([*self._rows, new])
        self.chosen = self._rows.index(new)
        self.emit_changed()

    def _set(self, index: int, point: Point) -> None:
        """Set a point, limited to the range between its neighbours."""
        x, y = self._clamped(point)
        if index > 0:
            x = max(x, self._rows[index - 1][0])
        if index + 1 < len(self._rows):
            x = min(x, self._rows[index + 1][0])
        self.replace(index, (x, y))

    def caption(self) -> str:
        if 0 <= self.chosen < len(self._rows):
            x, y = self._rows[self.chosen]
            return f"{number(y)} at {number(x)} %"
        return f"{counted(len(self._rows), 'point')}; double-click adds one"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            x = self._left + share * (self._right - self._left)
            self.draw_axis_line(painter, area.x() + share * area.width(), f"{x:g}" + (" %" if share == 1.0 else ""))
        places = self.handles()
        if places:
            line = [QPointF(area.left(), places[0].y()), *places, QPointF(area.right(), places[-1].y())]
            painter.setPen(QPen(QColor(theme.VIBRATION), 1.5))
            painter.drawPolyline(line)


class CurveEditor(RowsPadEditor):
    """The curve above the table of its points."""

    def __init__(self, parameter: Rows) -> None:
        tip = (
            "Drag a point. Double-click: add one. Right click: remove it.\n"
            "Keys: N and P choose, arrows move (with Shift finely), Enter adds, Delete takes away."
        )
        super().__init__(parameter, Curve(parameter), tip)
