"""Plots that cost little: fixed ranges, thin pens, a grid drawn once, and curves thinned to what a screen can show."""

import math
from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from numpy.typing import ArrayLike, DTypeLike, NDArray
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsPathItem

from underfoot.widgets import theme

AXIS_PX = 56
"""Width of every vertical axis, so that plots above one another have one time axis."""

GAP_PERIODS = 1.5
"""A curve is broken where samples are further apart than this many of the usual distances."""


class History:
    """The latest rows of a stream, in order and in one piece, in memory taken once.

    >>> history = History(3, 2)
    >>> history.append([[1, 1], [2, 2]])
    >>> history.append([[3, 3], [4, 4]])
    >>> history.latest()[:, 0]
    array([2., 3., 4.])
    """

    def __init__(self, capacity: int, *shape: int, dtype: DTypeLike = np.float64) -> None:
        self.capacity = capacity
        self._rows = np.zeros((2 * capacity, *shape), dtype)
        self._end = 0

    def append(self, rows: ArrayLike) -> None:
        """Add rows; the oldest give way."""
        new = np.asarray(rows, self._rows.dtype)
        new = new[max(0, len(new) - self.capacity) :]
        if self._end + len(new) > len(self._rows):
            kept = self.latest()[max(0, len(self.latest()) + len(new) - self.capacity) :].copy()
            self._rows[: len(kept)] = kept
            self._end = len(kept)
        self._rows[self._end : self._end + len(new)] = new
        self._end += len(new)

    def latest(self) -> NDArray:
        """The latest rows, at most `capacity`, oldest first; a view that the next `append` may change."""
        return self._rows[max(0, self._end - self.capacity) : self._end]

    def clear(self) -> None:
        self._end = 0


def thinned(x: NDArray[np.float64], y: NDArray, step: float) -> tuple[NDArray[np.float64], NDArray]:
    """Curves `y` (n, curves) over ascending `x` (n,), with two points, least and largest, for each `step` of x.

    Steps begin at multiples of `step`, so that a curve which moves along does not flicker, and one that falls has its
    largest point first, so that slopes are not jagged. Where `x` has a gap there is a NaN. A curve of few points stays
    as it is.

    >>> thinned(np.arange(6.0), np.array([[0.0], [9], [1], [5], [7], [6]]), 3.0)[1].ravel()
    array([0., 9., 5., 7.])
    """
    if len(x) < 2:
        return x.copy(), y.copy()
    usual = float(np.median(np.diff(x[-64:])))
    after_gap = np.flatnonzero(np.diff(x) > GAP_PERIODS * usual) + 1
    if usual * 3.0 > step:
        thin_x, thin_y = x, y
    else:
        cell = np.floor(x / step)
        starts = np.flatnonzero(np.diff(cell, prepend=-np.inf))
        thin_y = np.empty((2 * len(starts), y.shape[1]), np.result_type(y, np.float32))
        least, largest = np.minimum.reduceat(y, starts, axis=0), np.maximum.reduceat(y, starts, axis=0)
        falls = y[np.append(starts[1:], len(y)) - 1] < y[starts]
        thin_y[0::2] = np.where(falls, largest, least)
        thin_y[1::2] = np.where(falls, least, largest)
        thin_x = np.repeat((cell[starts] + 0.25) * step, 2)
        thin_x[1::2] += 0.5 * step
        after_gap = 2 * np.searchsorted(starts, after_gap)
    if not len(after_gap):
        return thin_x.copy(), thin_y.copy()
    return np.insert(thin_x, after_gap, np.nan), np.insert(thin_y, after_gap, np.nan, axis=0)


def round_top(value: float) -> float:
    """The first of 1, 2 or 5 times a power of ten that is not below `value`: where an axis may end.

    >>> round_top(730.0), round_top(1200.0), round_top(0.0)
    (1000.0, 2000.0, 1.0)
    """
    if value <= 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next((step * power for step in (1.0, 2.0, 5.0) if value <= step * power * (1 + 1e-12)), 10.0 * power)


class Plot(pg.PlotWidget):
    """A plot without mouse, menu or automatic range. Its ticks are given; a line lies at each."""

    hovered = Signal(float)
    """Where the mouse is, along x; NaN when it has left."""

    def __init__(self, name: str) -> None:
        super().__init__(background=theme.GROUND)
        self.setAccessibleName(name)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setFrameShape(self.Shape.NoFrame)
        self.setMouseTracking(True)
        item = self.getPlotItem()
        item.setMenuEnabled(False)
        item.hideButtons()
        item.setContentsMargins(0, theme.GRID, 2 * theme.GRID, 0)
        box = item.getViewBox()
        box.setMouseEnabled(x=False, y=False)
        box.disableAutoRange()
        self.box = box
        for side in ("left", "bottom"):
            axis = item.getAxis(side)
            axis.setPen(pg.mkPen(theme.LINE, width=1))
            axis.setTextPen(theme.MUTED)
            axis.setStyle(
                tickFont=theme.font(theme.SMALL_PX), tickLength=0, tickTextOffset=6, hideOverlappingLabels=False
            )
        item.getAxis("left").setWidth(AXIS_PX)
        item.getAxis("bottom").setHeight(20)
        self._grid = QGraphicsPathItem()
        self._grid.setPen(_thin(theme.mixed(theme.LINE, theme.GROUND, 0.6)))
        self._grid.setZValue(-10)
        self._lines: dict[str, list[float]] = {"left": [], "bottom": []}
        self.addItem(self._grid, ignoreBounds=True)

    def set_axis(self, side: str, low: float, high: float, ticks: Sequence[tuple[float, str]]) -> None:
        """Range and ticks of the "left" or "bottom" axis."""
        axis = self.getPlotItem().getAxis(side)
        axis.setTicks([list(ticks)])
        if side == "left":
            self.box.setYRange(low, high, padding=0)
        else:
            self.box.setXRange(low, high, padding=0)
        self._lines[side] = [at for at, _ in ticks]
        (left, right), (bottom, top) = self.box.viewRange()
        path = QPainterPath()
        for y in self._lines["left"]:
            path.moveTo(left, y)
            path.lineTo(right, y)
        for x in self._lines["bottom"]:
            path.moveTo(x, bottom)
            path.lineTo(x, top)
        self._grid.setPath(path)

    def add_curve(self, colour: str, z: float = 0.0) -> pg.PlotCurveItem:
        """A curve with a pen one pixel wide; give it points with `setData(x, y, connect="finite")`."""
        curve = pg.PlotCurveItem(pen=pg.mkPen(colour, width=1), antialias=False, skipFiniteCheck=True)
        curve.setZValue(z)
        self.addItem(curve, ignoreBounds=True)
        return curve

    def add_line(self, colour: str, *, dashed: bool = False) -> "Line":
        """A line across the whole plot, hidden until it is placed."""
        line = Line(self, colour, dashed)
        self.addItem(line, ignoreBounds=True)
        return line

    def mouseMoveEvent(self, event) -> None:
        super().mouseMoveEvent(event)
        place = self.box.mapSceneToView(QPointF(event.position()))
        (left, right), _ = self.box.viewRange()
        self.hovered.emit(place.x() if left <= place.x() <= right else math.nan)

    def leaveEvent(self, event) -> None:
        super().leaveEvent(event)
        self.hovered.emit(math.nan)


class Line(QGraphicsPathItem):
    """A line, upright or level, across a plot."""

    def __init__(self, plot: Plot, colour: str, dashed: bool) -> None:
        super().__init__()
        self._plot = plot
        pen = _thin(colour)
        if dashed:
            pen.setDashPattern([4.0, 4.0])
        self.setPen(pen)
        self.hide()

    def place_x(self, *places: float) -> None:
        """Upright at these places; at none of them, or NaN, it is not there."""
        _, (bottom, top) = self._plot.box.viewRange()
        self._draw([((x, bottom), (x, top)) for x in places if math.isfinite(x)])

    def place_y(self, *places: float) -> None:
        """Level at these places."""
        (left, right), _ = self._plot.box.viewRange()
        self._draw([((left, y), (right, y)) for y in places if math.isfinite(y)])

    def _draw(self, pieces: Sequence[tuple[tuple[float, float], tuple[float, float]]]) -> None:
        path = QPainterPath()
        for begin, end in pieces:
            path.moveTo(*begin)
            path.lineTo(*end)
        self.setPath(path)
        self.setVisible(bool(pieces))


class HeatItem(pg.GraphicsObject):
    """A picture of uint8 levels in the colours of `theme.heat_table`; the grid shows through the lowest."""

    def __init__(self) -> None:
        super().__init__()
        self._image = QImage()
        self._area = QRectF()
        self._levels = np.zeros((0, 0), np.uint8)
        self.set_colours(0.0, 255.0)

    def set_colours(self, low: float, high: float) -> None:
        """Let the colours go from level `low` to level `high`."""
        places = np.clip((np.arange(256) - low) / (high - low), 0.0, 1.0)
        rows = theme.heat_table()[np.round(255 * places).astype(int)]
        self._colours = [
            QColor(*map(int, row)).rgba() if place > 0.0 else 0 for place, row in zip(places, rows, strict=True)
        ]
        if not self._image.isNull():
            self._image.setColorTable(self._colours)
            self.update()

    def set_levels(self, levels: NDArray[np.uint8], area: QRectF) -> None:
        """Show `levels` [rows, columns], the first row at the bottom, over `area` of the plot."""
        self._levels = np.ascontiguousarray(levels)
        height, width = levels.shape
        self._image = QImage(self._levels.data, width, height, width, QImage.Format.Format_Indexed8)
        self._image.setColorTable(self._colours)
        if area != self._area:
            self.prepareGeometryChange()
            self._area = area
        self.update()

    def boundingRect(self) -> QRectF:
        return self._area

    def paint(self, painter: QPainter, *_: object) -> None:
        if not self._image.isNull():
            painter.drawImage(self._area, self._image)


def _thin(colour: str) -> QPen:
    pen = QPen(QColor(colour))
    pen.setWidth(1)
    pen.setCosmetic(True)
    return pen
