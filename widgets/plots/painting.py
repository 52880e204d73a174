"""Painting of a plot's shapes by Qt."""

from functools import lru_cache

import numpy as np
import shiboken6
from numpy.typing import NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetricsF, QImage, QLinearGradient, QPainter, QPen, QPolygonF

from underfoot.drawing.look import AREA_OPACITY, BACKDROP_OPACITY, DASH_PX, DOT_PX, heat_colours, heat_table
from underfoot.drawing.shapes import Area, Backdrop, Box, Dots, HeatArea, HeatImage, Polyline, Segments, Shape, Text
from underfoot.widgets import theme

_HEAT_STOPS = 17


def paint(painter: QPainter, shape: Shape) -> None:
    """Paint one shape. Lines are one pixel wide: Qt draws wider ones a hundred times slower."""
    match shape:
        case Polyline():
            painter.setPen(_pen(theme.PALETTE[shape.colour], shape.dashed))
            painter.drawPolyline(polygon(shape.points))
        case Segments():
            painter.setPen(_pen(theme.PALETTE[shape.colour], shape.dashed))
            painter.drawLines([QLineF(*begin, *end) for begin, end in shape.ends.tolist()])
        case Dots():
            painter.setPen(QPen(QColor(theme.PALETTE[shape.colour]), DOT_PX, c=Qt.PenCapStyle.RoundCap))
            painter.drawPoints(polygon(shape.points))
        case Area():
            inside = QColor(theme.PALETTE[shape.colour])
            inside.setAlphaF(AREA_OPACITY)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(inside)
            painter.drawPolygon(polygon(shape.points))
        case HeatArea():
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(_heat_brush(shape.left, shape.right, theme.NAME))
            painter.drawPolygon(polygon(shape.points))
        case HeatImage():
            _paint_heat(painter, shape)
        case Backdrop():
            ground = QColor(theme.GROUND)
            ground.setAlphaF(BACKDROP_OPACITY)
            painter.fillRect(rectangle(shape.box), ground)
        case Text():
            _paint_text(painter, shape)


def width_px(text: str, size_px: int, *, bold: bool = False) -> float:
    """Return the width of a text in the font of the window."""
    return _metrics(size_px, bold).horizontalAdvance(text)


def rectangle(box: Box) -> QRectF:
    """Convert a box to a Qt rectangle."""
    return QRectF(box.left, box.top, box.width, box.height)


def polygon(points: NDArray[np.float64]) -> QPolygonF:
    """Convert points [n, 2] to a Qt polygon in one copy."""
    made = QPolygonF()
    made.resize(len(points))
    if len(points):
        memory = shiboken6.VoidPtr(made.data(), 16 * len(points), True)  # type: ignore[call-arg, arg-type]
        np.frombuffer(memory, np.float64).reshape(-1, 2)[:] = points  # type: ignore[call-overload]
    return made


@lru_cache(maxsize=8)
def _metrics(size_px: int, bold: bool) -> QFontMetricsF:
    return QFontMetricsF(theme.font(size_px, bold))


@lru_cache(maxsize=64)
def _pen(colour: str, dashed: bool) -> QPen:
    pen = QPen(QColor(colour), 1.0)
    if dashed:
        pen.setDashPattern(DASH_PX)
    return pen


@lru_cache(maxsize=8)
def _heat_brush(left: float, right: float, colours: str) -> QBrush:
    gradient = QLinearGradient(QPointF(left, 0.0), QPointF(right, 0.0))
    table = heat_table(colours)
    for share in np.linspace(0.0, 1.0, _HEAT_STOPS).tolist():
        gradient.setColorAt(share, QColor(*table[round(255 * share)].tolist()))
    return QBrush(gradient)


@lru_cache(maxsize=8)
def _heat_pixels(low: float, high: float, colours: str) -> NDArray[np.uint32]:
    """Return the pixel of each level. A lookup here costs less than in Qt while it scales the image."""
    return np.array([QColor(*row).rgba() for row in heat_colours(low, high, colours).tolist()], np.uint32)


def _paint_heat(painter: QPainter, shape: HeatImage) -> None:
    pixels = _heat_pixels(shape.low, shape.high, theme.NAME).take(shape.levels[::-1], mode="clip")  # no test per pixel
    rows, columns = pixels.shape
    image = QImage(pixels.data, columns, rows, 4 * columns, QImage.Format.Format_ARGB32_Premultiplied)
    painter.drawImage(rectangle(shape.box), image)


def _paint_text(painter: QPainter, shape: Text) -> None:
    painter.setFont(theme.font(shape.size_px, shape.bold))
    painter.setPen(QColor(theme.PALETTE[shape.colour]))
    share = {"start": 0.0, "middle": 0.5, "end": 1.0}[shape.anchor]
    left_px = shape.x - share * width_px(shape.text, shape.size_px, bold=shape.bold)
    painter.drawText(QPointF(left_px, shape.y), shape.text)
