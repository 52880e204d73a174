"""Pictures that are painted once and kept."""

import math

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QColor, QPixmap


def blank_picture(size: QSize, pixel_ratio: float, colour: QColor | Qt.GlobalColor) -> QPixmap:
    """Return a picture of this size and colour, with `pixel_ratio` pixels of the screen per unit of length."""
    picture = QPixmap(math.ceil(pixel_ratio * size.width()), math.ceil(pixel_ratio * size.height()))
    picture.setDevicePixelRatio(pixel_ratio)
    picture.fill(colour)
    return picture
