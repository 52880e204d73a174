"""What widgets that paint themselves share: a picture that is kept, the ground of controls, and the frame of focus."""

import math

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPixmap

from underfoot.widgets import theme

_ROUND_PX = 3.0


def blank_picture(size: QSize, pixel_ratio: float, colour: QColor | Qt.GlobalColor) -> QPixmap:
    """Return a picture of this size and colour, with `pixel_ratio` pixels of the screen per unit of length."""
    picture = QPixmap(math.ceil(pixel_ratio * size.width()), math.ceil(pixel_ratio * size.height()))
    picture.setDevicePixelRatio(pixel_ratio)
    picture.fill(colour)
    return picture


def paint_ground(painter: QPainter, area: QRectF) -> None:
    """Paint the ground of a picture that is a control."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(theme.RAISED))
    painter.drawRoundedRect(area, _ROUND_PX, _ROUND_PX)


def paint_focus(painter: QPainter, area: QRectF) -> None:
    """Paint the frame of a picture that has the focus."""
    painter.setPen(QPen(QColor(theme.VIBRATION), 1.0))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRoundedRect(area, _ROUND_PX, _ROUND_PX)
