"""The plot of a `Drawing`: lines, dots and arrows between round ticks.

It is painted by hand: a plot of the kind that moves costs most of a frame to make, and a result has a dozen of these.
"""

import math

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from underfoot.drawing import COLOURS, Drawing, Series
from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.plots import AXIS_PX, thinned

DOT_PX = 4

_NEAR_TICK = 0.4
"""An axis ends at a tick that is no further beyond what is drawn than this share of a step."""
_MOST_POINTS = 4000
_BINS = 700
_TICK_PX = (96, 48)
"""About how far ticks are apart, across and up."""
_BELOW_PX = 20

Ticks = list[tuple[float, str]]


class DrawingPlot(QWidget):
    """Shows one drawing. Its ranges end at round ticks."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumHeight(96)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.ranges = (0.0, 1.0, 0.0, 1.0)
        """Left, right, bottom and top of the axes; powers of ten on a logarithmic one."""
        self.drawing: Drawing | None = None
        self._points: list[NDArray[np.float64]] = []
        self._across: Ticks = []
        self._up: Ticks = []
        self._paths: list[QPainterPath | QPolygonF] | None = None

    def show_drawing(self, drawing: Drawing) -> None:
        """Draw this one instead of what was there."""
        self.drawing = drawing
        self._points = [in_axes(one, drawing) for one in drawing.series]
        self.setAccessibleName(f"{drawing.title}: {drawing.y} over {drawing.x}")
        self._fit()

    @property
    def area(self) -> QRectF:
        """Where the axes are, in the widget's pixels."""
        return QRectF(self.rect()).adjusted(AXIS_PX, theme.GRID, -2 * theme.GRID, -_BELOW_PX)

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 2) of the axes in the widget's pixels."""
        (left, right, bottom, top), area = self.ranges, self.area
        scale = (area.width() / (right - left), -area.height() / (top - bottom))
        return np.asarray((area.left(), area.bottom())) + (points - (left, bottom)) * scale

    def sizeHint(self) -> QSize:
        return QSize(400, 240)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Ranges and ticks for what is drawn, in the room that there is."""
        area, drawing = self.area, self.drawing
        if drawing is None or area.width() < 1.0 or area.height() < 1.0:
            return
        points = np.concatenate([np.zeros((0, 2)), *(part[_finite(part)] for part in self._points)])
        (left, right), (bottom, top) = _span(points[:, 0]), _span(points[:, 1])
        if drawing.equal and not (drawing.x_log or drawing.y_log):
            metre = max((right - left) / area.width(), (top - bottom) / area.height())
            left, right = _widened(left, right, metre * area.width())
            bottom, top = _widened(bottom, top, metre * area.height())
        axes = []
        for low, high, log, room in (
            (left, right, drawing.x_log, area.width() / _TICK_PX[0]),
            (bottom, top, drawing.y_log, area.height() / _TICK_PX[1]),
        ):
            ticks = log_ticks(low, high, room) if log else linear_ticks(low, high, room)
            if not drawing.equal:
                low, high = _rounded(low, high, ticks)
            axes.append((low, high, [tick for tick in ticks if low <= tick[0] <= high]))
        (left, right, self._across), (bottom, top, self._up) = axes
        self.ranges = (left, right, bottom, top)
        self._paths = None
        self.update()

    # --- paint ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(theme.GROUND))
        if self.drawing is None:
            return
        self._paint_axes(painter)
        if self._paths is None:
            self._paths = [self._made(*both) for both in zip(self.drawing.series, self._points, strict=True)]
        painter.setClipRect(self.area.adjusted(-DOT_PX, -DOT_PX, DOT_PX, DOT_PX))
        for one, points, path in zip(self.drawing.series, self._points, self._paths, strict=True):
            painter.setRenderHint(QPainter.RenderHint.Antialiasing, one.style != "line" or len(one.x) < _BINS)
            if isinstance(path, QPolygonF):
                _paint_dots(painter, path, COLOURS[one.colour])
                continue
            painter.setPen(_pen(COLOURS[one.colour], dashed=one.style == "dashed"))
            painter.drawPath(path)
            if one.style == "arrows":
                _paint_dots(painter, self._dots(points[len(one.x) :]), COLOURS[one.colour])

    def _paint_axes(self, painter: QPainter) -> None:
        area, faint = self.area, QColor(theme.mixed(theme.LINE, theme.GROUND, 0.6))
        painter.setFont(theme.font(theme.SMALL_PX))
        across = self.place(np.array([(at, self.ranges[2]) for at, _ in self._across]).reshape(-1, 2))[:, 0]
        up = self.place(np.array([(self.ranges[0], at) for at, _ in self._up]).reshape(-1, 2))[:, 1]
        painter.setPen(QPen(faint, 1.0))
        painter.drawLines([QLineF(round(x), area.top(), round(x), area.bottom()) for x in across])
        painter.drawLines([QLineF(area.left(), round(y), area.right(), round(y)) for y in up])
        painter.setPen(QPen(QColor(theme.LINE), 1.0))
        painter.drawLine(area.bottomLeft(), area.bottomRight())
        painter.drawLine(area.topLeft(), area.bottomLeft())
        painter.setPen(QColor(theme.MUTED))
        middle = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
        for x, (_, text) in zip(across, self._across, strict=True):
            width = painter.fontMetrics().horizontalAdvance(text) + 2
            left = min(max(x - width / 2, 0.0), self.width() - width)
            painter.drawText(QRectF(left, area.bottom() + 4, width, _BELOW_PX), middle, text)
        beside = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for y, (_, text) in zip(up, self._up, strict=True):
            painter.drawText(QRectF(0.0, y - 8, AXIS_PX - 6, 16), beside, text)

    def _made(self, one: Series, points: NDArray[np.float64]) -> QPainterPath | QPolygonF:
        """What is painted of a set of points: dots, a line, or the shafts of arrows."""
        if one.style == "dots":
            return self._dots(points)
        if one.style == "arrows":
            count = len(one.x)
            both = np.stack([points[:count], points[count:]], axis=1)
            both = both[np.isfinite(both).all(axis=(1, 2))].reshape(-1, 2)
            shafts = QPainterPath()
            for begin, end in self.place(both).reshape(-1, 2, 2):
                shafts.moveTo(*begin)
                shafts.lineTo(*end)
            return shafts
        x, y = points.T
        finite = _finite(points)
        if len(x) > _MOST_POINTS and finite.all() and (np.diff(x) > 0.0).all():
            x, thin = thinned(x, y[:, None], (x[-1] - x[0]) / _BINS)
            points = np.column_stack([x, thin[:, 0]])
            finite = _finite(points)
        placed = self.place(np.where(finite[:, None], points, np.nan))
        return pg.arrayToQPath(*placed.T, connect="finite")

    def _dots(self, points: NDArray[np.float64]) -> QPolygonF:
        """One dot a pixel, however many readings lie there."""
        placed = self.place(points[_finite(points)])
        cells = np.round(placed).astype(np.int64)
        _, kept = np.unique(cells[:, 0] * (1 << 20) + cells[:, 1], return_index=True)
        return pg.functions.arrayToQPolygonF(*placed[kept].T)


def linear_ticks(low: float, high: float, room: float) -> Ticks:
    """Ticks at about `room` round places, the outermost not inside `low` to `high`.

    >>> linear_ticks(0.3, 41.0, 5.0)
    [(0.0, '0'), (10.0, '10'), (20.0, '20'), (30.0, '30'), (40.0, '40'), (50.0, '50')]
    """
    raw = (high - low) / max(room, 2.0)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= raw * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-6), math.ceil(high / step - 1e-6)
    return [(k * step, number(k * step, 4)) for k in range(first, last + 1)]


def log_ticks(low: float, high: float, room: float) -> Ticks:
    """Ticks of a logarithmic axis from 10^`low` to 10^`high`, the outermost not inside.

    >>> log_ticks(0.0, 2.0, 3.0), [text for _, text in log_ticks(1.7, 2.9, 6.0)]
    ([(0.0, '1'), (1.0, '10'), (2.0, '100')], ['50', '100', '200', '500', '1\\u202f000'])
    """
    decades = range(math.floor(low) - 1, math.ceil(high) + 2)
    steps: tuple[int, ...] = (1, 2, 5) if (high - low) * 3 <= room * 1.2 else (1,)
    every = [math.log10(k) + decade for decade in decades for k in steps]
    first = max((i for i, at in enumerate(every) if at <= low + 1e-6), default=0)
    last = min((i for i, at in enumerate(every) if at >= high - 1e-6), default=len(every) - 1)
    skip = max(1, round((last - first) / max(room, 2.0)))
    return [(at, number(10.0**at, 4)) for at in every[first : last + skip : skip]]


def in_axes(one: Series, drawing: Drawing) -> NDArray[np.float64]:
    """The points of a set as they are drawn, ends of arrows after the others; what a logarithm cannot show is NaN."""
    points = np.column_stack([one.x, one.y])
    if one.to is not None:
        points = np.concatenate([points, one.to])
    for column, log in enumerate((drawing.x_log, drawing.y_log)):
        if log:
            positive = np.where(points[:, column] > 0.0, points[:, column], np.nan)
            points[:, column] = np.log10(positive)
    return points


def _finite(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(points).all(axis=1))


def _span(values: NDArray[np.float64]) -> tuple[float, float]:
    if not values.size:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        room = 0.5 * abs(low) or 0.5
        return low - room, high + room
    return low, high


def _widened(low: float, high: float, length: float) -> tuple[float, float]:
    middle, half = (low + high) / 2.0, 0.53 * length
    return middle - half, middle + half


def _rounded(low: float, high: float, ticks: Ticks) -> tuple[float, float]:
    """The range with its ends at the outermost ticks, or a little beyond what is drawn where those are far."""
    room, near = 0.04 * (high - low), _NEAR_TICK * (ticks[-1][0] - ticks[0][0]) / max(len(ticks) - 1, 1)
    first, last = ticks[0][0], ticks[-1][0]
    return (first if low - first <= near else low - room), (last if last - high <= near else high + room)


def _paint_dots(painter: QPainter, dots: QPolygonF, colour: str) -> None:
    painter.setPen(QPen(QColor(colour), DOT_PX, c=Qt.PenCapStyle.RoundCap))
    painter.drawPoints(dots)


def _pen(colour: str, *, dashed: bool = False) -> QPen:
    pen = QPen(QColor(colour), 1.0)
    if dashed:
        pen.setDashPattern([6.0, 4.0])
    return pen
