"""Painting of a scene's shapes by Qt."""

import math
from collections.abc import Iterable
from functools import singledispatch

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen, QPolygonF, QTransform

from underfoot.scenes.shapes import Disc, Lines, Polygon, Shape, Text
from underfoot.widgets import theme

CAPITAL_SHARE = 0.72
"""Height of capitals, as a share of the font size."""


def paint_shapes(painter: QPainter, shapes: Iterable[Shape], to_pixels: QTransform) -> None:
    """Paint shapes; `to_pixels` converts from the floor's frame, y upwards, to the painter's pixels."""
    painter.save()
    try:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setTransform(to_pixels, True)
        for shape in shapes:
            painter.setOpacity(shape.opacity)
            _paint(shape, painter)
    finally:
        painter.restore()


@singledispatch
def _paint(shape: Shape, painter: QPainter) -> None:
    """Paint one shape, in metres."""
    raise AssertionError(f"no way to paint {type(shape).__name__}")


@_paint.register
def _(shape: Lines, painter: QPainter) -> None:
    # In pixels: lines that the painter itself has to scale cost it seven times as much.
    to_pixels = painter.transform()
    ends = shape.ends_m @ np.array([[to_pixels.m11(), to_pixels.m12()], [to_pixels.m21(), to_pixels.m22()]])
    ends += (to_pixels.dx(), to_pixels.dy())
    width_px = shape.width_m * math.hypot(to_pixels.m11(), to_pixels.m12())
    painter.resetTransform()
    painter.setPen(QPen(QColor(shape.colour), max(width_px, 1.0), c=Qt.PenCapStyle.SquareCap))
    painter.drawLines([QLineF(*line) for line in ends.reshape(-1, 4).tolist()])
    painter.setTransform(to_pixels)


@_paint.register
def _(shape: Disc, painter: QPainter) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(shape.colour))
    middle = QPointF(shape.x_m, shape.y_m)
    if shape.rim_m <= 0.0:
        painter.drawEllipse(middle, shape.radius_m, shape.radius_m)
        return
    ring = QPainterPath()
    for radius in (shape.radius_m, max(shape.radius_m - shape.rim_m, 0.0)):
        ring.addEllipse(middle, radius, radius)
    painter.drawPath(ring)


@_paint.register
def _(shape: Polygon, painter: QPainter) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(shape.colour))
    painter.drawPolygon(QPolygonF([QPointF(x, y) for x, y in shape.points_m.tolist()]))


@_paint.register
def _(shape: Text, painter: QPainter) -> None:
    size_px = 64
    painter.save()
    painter.translate(shape.x_m, shape.y_m)
    painter.scale(shape.height_m / (CAPITAL_SHARE * size_px), -shape.height_m / (CAPITAL_SHARE * size_px))
    painter.setFont(theme.font(size_px))
    painter.setPen(QColor(shape.colour))
    width_px = 2.0 * size_px * (len(shape.text) + 1)
    painter.drawText(
        QRectF(-0.5 * width_px, -size_px, width_px, 2.0 * size_px), Qt.AlignmentFlag.AlignCenter, shape.text
    )
    painter.restore()
