"""A tile from above, to scale: its sensors, the positions of a series, and where to press."""

import math
from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from underfoot import quantities
from underfoot.calibration.rig import PressRequest
from underfoot.floor.layout import Tile, default_floor
from underfoot.quantities import quantity
from underfoot.widgets import theme

Places = Sequence[tuple[float, float]]

FEET = {"standing": 0.0, "corner": 0.75}
"""Position of a foot for the loads of a sound, as a share of the way from the centre to the first sensor."""
FOOT_M = (0.09, 0.26)
_MARGIN_PX = 24
_NEAR_M = 1e-6


class TilePicture(QWidget):
    """Shows where to press, or the load on the tile during a sound."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Where on the tile")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._tile = default_floor().tiles[0]
        self._press: PressRequest | None = None
        self._places: Places = ()
        self._ready = 0.0
        self._load = ""

    def set_tile(self, tile: Tile) -> None:
        """Set the tile that is measured."""
        self._tile = tile
        self.update()

    def show_press(self, press: PressRequest | None, places: Places) -> None:
        """Show where to press, if anywhere, among these positions of a series."""
        self._press, self._places = press, places
        self.setAccessibleDescription(press_text(press) if press is not None else "")
        self.update()

    def show_load(self, load: str) -> None:
        """Show the load during a sound: "none", "standing" or "corner"."""
        self._load = load
        self.update()

    def show_ready(self, share: float) -> None:
        """Show the share that is done, 0 to 1."""
        if share != self._ready:
            self._ready = share
            self.update()

    def sizeHint(self) -> QSize:
        return QSize(320, 176)  # it grows where there is room; in a low window a page that scrolls gives no less

    def minimumSizeHint(self) -> QSize:
        return QSize(160, 128)

    # --- geometry ---

    def area(self) -> QRectF:
        """Return the tile's rectangle in the widget's pixels."""
        width_m, height_m = self._tile.size_m
        room = QRectF(self.rect()).adjusted(_MARGIN_PX, _MARGIN_PX, -_MARGIN_PX, -_MARGIN_PX)
        scale = max(min(room.width() / width_m, room.height() / height_m), 1.0)
        middle, size = room.center(), (width_m * scale, height_m * scale)
        return QRectF(middle.x() - size[0] / 2, middle.y() - size[1] / 2, *size)

    def place(self, at_m: tuple[float, float]) -> QPointF:
        """Convert a position in the tile's frame, y upwards, to the widget's pixels."""
        area = self.area()
        scale = area.width() / self._tile.size_m[0]
        return area.center() + QPointF(at_m[0] * scale, -at_m[1] * scale)

    # --- paint ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QPen(QColor(theme.FAINT), 1.0))
        painter.setBrush(QColor(theme.RAISED))
        painter.drawRoundedRect(self.area(), 4, 4)
        self._paint_size(painter)
        self._paint_sensors(painter)
        self._paint_places(painter)
        if self._load in FEET:
            self._paint_foot(painter, FEET[self._load])
        if self._press is not None and (self._press.force_n > 0.0 or _lets_go(self._press)):
            self._paint_press(painter, self._press)

    def _paint_size(self, painter: QPainter) -> None:
        area, (width_m, height_m) = self.area(), self._tile.size_m
        painter.setPen(QColor(theme.MUTED))
        below = QRectF(area.left(), area.bottom() + 4, area.width(), 16)
        painter.drawText(below, Qt.AlignmentFlag.AlignCenter, quantity(width_m, "m"))
        painter.save()
        painter.translate(area.left() - 20, area.bottom())
        painter.rotate(-90)
        painter.drawText(QRectF(0, 0, area.height(), 16), Qt.AlignmentFlag.AlignCenter, f"{quantity(height_m, 'm')}")
        painter.restore()

    def _paint_sensors(self, painter: QPainter) -> None:
        wanted = None if self._press is None else self._press.sensor
        for number, at_m in enumerate(self._tile.sensors_m):
            here = self.place(at_m)
            colour = theme.TEXT if number == wanted else theme.MUTED
            painter.setPen(QPen(QColor(colour), 1.0))
            painter.setBrush(QColor(theme.PANEL))
            painter.drawRoundedRect(QRectF(here.x() - 9, here.y() - 9, 18, 18), 3, 3)
            painter.drawText(QRectF(here.x() - 9, here.y() - 9, 18, 18), Qt.AlignmentFlag.AlignCenter, f"{number + 1}")

    def _paint_places(self, painter: QPainter) -> None:
        """Paint the positions; completed ones are filled."""
        now = place_number(self._places, self._press)
        for number, at_m in enumerate(self._places):
            taken = now is not None and number < now
            painter.setPen(QPen(QColor(theme.CONTACT if taken else theme.FAINT), 1.0))
            painter.setBrush(QColor(theme.CONTACT) if taken else Qt.BrushStyle.NoBrush)
            painter.drawEllipse(self.place(at_m), 2.5, 2.5)

    def _paint_foot(self, painter: QPainter, share: float) -> None:
        """Paint the outline of a sole, `share` of the way from the tile's centre to its first sensor."""
        area, here = self.area(), self.place((share * self._tile.sensors_m[0][0], share * self._tile.sensors_m[0][1]))
        scale = area.width() / self._tile.size_m[0]
        foot = QRectF(0.0, 0.0, FOOT_M[0] * scale, min(FOOT_M[1] * scale, area.height()))
        foot.moveCenter(here)
        foot.moveTop(min(max(foot.top(), area.top()), area.bottom() - foot.height()))
        sole = QColor(theme.FORCE)
        sole.setAlphaF(0.2)  # keeps the sensor beneath visible
        painter.setPen(QPen(QColor(theme.FORCE), 1.5))
        painter.setBrush(sole)
        painter.drawPath(_sole(foot))

    def _paint_press(self, painter: QPainter, press: PressRequest) -> None:
        here, amber = self.place(press.at_m), QColor(theme.FORCE)
        ring = QRectF(here.x() - 16, here.y() - 16, 32, 32)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.mixed(theme.FORCE, theme.RAISED, 0.35)), 3.0))
        painter.drawEllipse(ring)
        painter.setPen(QPen(amber, 3.0, c=Qt.PenCapStyle.FlatCap))
        painter.drawArc(ring, 90 * 16, -round(360 * 16 * min(max(self._ready, 0.0), 1.0)))
        painter.setPen(QPen(amber, 1.5))
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)) if press.sensor is None else ():
            painter.drawLine(here + QPointF(x, y) * 4, here + QPointF(x, y) * 11)
        if press.footstep:
            return  # as heavy as the person is
        painter.setPen(QColor(theme.TEXT))
        text, area = quantity(press.force_n, "N"), self.area()
        above = here.y() - 36 > area.top()
        box = QRectF(here.x() - 48, here.y() - 36 if above else here.y() + 20, 96, 16)
        box.moveLeft(min(max(box.left(), area.left()), area.right() - box.width()))
        width = painter.fontMetrics().horizontalAdvance(text) + 8
        back = QRectF(0, 0, width, 16)
        back.moveCenter(box.center())
        painter.fillRect(back, QColor(theme.mixed(theme.FORCE, theme.GROUND, 0.2)))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)


def _sole(box: QRectF) -> QPainterPath:
    """Return the outline of a left sole in a box, toes up."""
    outline = QPainterPath()
    begin, *curves = [QPointF(box.left() + x * box.width(), box.top() + y * box.height()) for x, y in _SOLE]
    outline.moveTo(begin)
    for first, second, end in zip(*[iter(curves)] * 3, strict=True):
        outline.cubicTo(first, second, end)
    outline.closeSubpath()
    return outline


_SOLE = (
    (0.62, 0.0), (0.95, 0.0), (1.0, 0.14), (1.0, 0.27), (1.0, 0.42), (0.84, 0.52), (0.84, 0.68), (0.84, 0.8),
    (0.88, 1.0), (0.56, 1.0), (0.24, 1.0), (0.2, 0.85), (0.17, 0.68), (0.14, 0.5), (0.0, 0.42), (0.0, 0.24),
    (0.0, 0.1), (0.25, 0.0), (0.62, 0.0),
)  # fmt: skip
"""Corners and handles of Bezier curves around a sole, as shares of its box."""


def place_number(places: Places, press: PressRequest | None) -> int | None:
    """Return the index in `places` of a press; None if it is at none of them."""
    if press is None:
        return None
    return next((i for i, at_m in enumerate(places) if math.dist(at_m, press.at_m) < _NEAR_M), None)


def press_text(press: PressRequest) -> str:
    """Describe a press.

    >>> press_text(PressRequest((0.1, -0.02), 400.0, sensor=3)), press_text(PressRequest((0.0, 0.0), 0.0))
    ('Press 400 N over sensor 4', 'Stand clear of the tile')
    >>> press_text(PressRequest((0.1, -0.02), 400.0))
    'Press 400 N at x 100 mm, y −20 mm from the middle'
    >>> press_text(PressRequest((0.1, -0.02), 0.0, 0.0, sensor=3))
    'Let go slowly over sensor 4'
    """
    if press.footstep:
        return "Step on the plate and off again"
    if _lets_go(press):
        return f"Let go slowly over sensor {(press.sensor or 0) + 1}"
    if press.force_n <= 0.0:
        return "Stand clear of the tile"
    if press.sensor is not None:
        return f"Press {quantity(press.force_n, 'N')} over sensor {press.sensor + 1}"
    x, y = (quantity(round(1e4 * part) / 1e4, "m", 4) if part else "0 mm" for part in press.at_m)
    return f"Press {quantity(press.force_n, 'N')} at x {x}, y {y} from the middle"


def _lets_go(press: PressRequest) -> bool:
    """Return whether a load over a sensor is let go of; an empty tile is read for a while."""
    return press.sensor is not None and press.force_n <= 0.0 and press.hold_s == 0.0


def tile_text(tile: Tile) -> str:
    """Describe a tile.

    >>> tile_text(default_floor().tiles[0])
    't1 · 305 × 305 mm'
    """
    width, height = (quantities.number(1e3 * side, 4) for side in tile.size_m)
    return f"{tile.id} · {width} × {height} mm"
