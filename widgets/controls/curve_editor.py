"""Editor of a piecewise linear curve with points to drag."""

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QColor, QPainter, QPen

from underfoot.parameters import Parameter, Rows
from underfoot.quantities import counted, number
from underfoot.widgets import theme
from underfoot.widgets.controls.handle_pad import HandlePad
from underfoot.widgets.controls.list_editors import RowsEditor

Point = tuple[float, float]


def is_curve(parameter: Parameter) -> bool:
    """Return whether a parameter's rows are points of a curve: a position and a value."""
    return isinstance(parameter, Rows) and [n.split()[-1] for n, _, _ in parameter.columns] == ["%", "value"]


class Curve(HandlePad):
    """Points from left to right with linear segments between, constant before the first and after the last."""

    def __init__(self, parameter: Rows) -> None:
        super().__init__()
        (_, self._left, self._right), (_, self._low, self._high) = parameter.columns
        self._max_rows = parameter.most
        self._points: list[Point] = []
        self.setAccessibleName(f"{parameter.label} as a picture")

    def points(self) -> list[Point]:
        return list(self._points)

    def set_points(self, points: Sequence[Sequence[float]]) -> None:
        """Show these points, without emitting a change."""
        self._points = [(float(x), float(y)) for x, y in points]
        self.chosen = min(self.chosen, len(self._points) - 1)
        self.update()

    def place(self, point: Point) -> QPointF:
        """Return the position of a point in the picture, in pixels."""
        area = self.area()
        across = (point[0] - self._left) / (self._right - self._left)
        up = (point[1] - self._low) / (self._high - self._low)
        return QPointF(area.x() + across * area.width(), area.bottom() - up * area.height())

    def handles(self) -> list[QPointF]:
        return [self.place(point) for point in self._points]

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
        x, y = self._points[index]
        step = 0.01 * (self._right - self._left), 0.05 * (self._high - self._low)
        self._set(index, (round(x + across * step[0], 3), round(y + up * step[1], 4)))

    def add(self, place: QPointF | None) -> None:
        if len(self._points) >= self._max_rows:
            return
        if place is None:
            place = self.area().center()
        new = self._value_at(place)
        self._points = sorted([*self._points, new])
        self.chosen = self._points.index(new)
        self.emit_changed()

    def remove(self, index: int) -> None:
        del self._points[index]
        self.emit_changed()

    def _set(self, index: int, point: Point) -> None:
        """Set a point, limited to the range between its neighbours."""
        x, y = self._clamped(point)
        if index > 0:
            x = max(x, self._points[index - 1][0])
        if index + 1 < len(self._points):
            x = min(x, self._points[index + 1][0])
        if (x, y) != self._points[index]:
            self._points[index] = (x, y)
            self.emit_changed()

    def caption(self) -> str:
        if 0 <= self.chosen < len(self._points):
            x, y = self._points[self.chosen]
            return f"{number(y)} at {number(x)} %"
        return f"{counted(len(self._points), 'point')}; double-click adds one"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            x = self._left + share * (self._right - self._left)
            self.draw_axis_line(painter, area.x() + share * area.width(), f"{x:g}" + (" %" if share == 1.0 else ""))
        places = self.handles()
        if places:
            line = [QPointF(area.left(), places[0].y()), *places, QPointF(area.right(), places[-1].y())]
            painter.setPen(QPen(QColor(theme.VIBRATION), 1.5))
            painter.drawPolyline(line)


class CurveEditor(RowsEditor):
    """The curve above the table of its points."""

    TABLE_ROW = 2

    def __init__(self, parameter: Rows) -> None:
        self.curve = Curve(parameter)
        super().__init__(parameter)
        self.curve.setParent(self)
        self.curve.setToolTip(
            "Drag a point. Double-click: add one. Right click: remove it.\n"
            "Keys: N and P choose, arrows move (with Shift finely), Enter adds, Delete takes away."
        )
        self.grid.addWidget(self.curve, 1, 0, 1, 3)
        self.curve.edit_began.connect(self.edit_began)
        self.curve.changed.connect(self._drawn)

    def _drawn(self) -> None:
        self._commit(self.curve.points())
        super()._show()

    def _show(self) -> None:
        super()._show()
        self.curve.set_points(sorted(self._value))
