"""A tile at its true size for a projector above the floor: dark, with a mark where to press."""

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QPen, QPolygonF

from underfoot.calibration.procedure import Page
from underfoot.drawing import look
from underfoot.floor.layout import Tile
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.calibrate.tile_picture import place_number
from underfoot.widgets.controls.true_scale import Placement, TrueScaleWindow

RULE_M = 0.1
_LIT = look.palette("dark")
"""The dark palette, whatever the window's colours: the floor is lit in a dark room."""
_DIM = "#4a5462"


class FloorProjection(TrueScaleWindow):
    """A full-screen window, scaled, moved and turned by keys. Return continues, Escape closes it.

    Escape means panic in the main window only: here, a person on the floor uses it to leave the view.
    """

    continue_requested = Signal()

    def __init__(self, tile: Tile, placement: Placement) -> None:
        super().__init__(placement)
        self.setWindowTitle(f"Tile {tile.id} on the floor – Underfoot")
        self.setAccessibleName("Tile at its true size")
        self._tile, self.page, self._ready = tile, Page("", "", ""), 0.0

    def show_page(self, page: Page, ready: float) -> None:
        """Mark the page's press, of which the share `ready` is done."""
        self.page, self._ready = page, ready
        self.update()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.continue_requested.emit()
        else:
            super().keyPressEvent(event)

    # --- paint ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black"))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        width_m, height_m = self._tile.size_m
        painter.setPen(QPen(QColor(_DIM), 1.0))
        plate = QRectF(-width_m / 2, -height_m / 2, width_m, height_m)
        outline = self.to_pixels().map(QPolygonF(plate))
        painter.drawPolygon(outline)
        for at_m in self._tile.sensors_m:
            painter.drawEllipse(self.place(at_m), 4, 4)
        self._paint_places(painter)
        self._paint_press(painter)
        self._paint_rule(painter, outline.boundingRect())
        self.paint_hint(painter, "Return: continue")

    def _paint_places(self, painter: QPainter) -> None:
        now = place_number(self.page.places_m, self.page.press)
        for number, at_m in enumerate(self.page.places_m):
            taken = now is not None and number < now
            painter.setPen(QPen(QColor(theme.mixed(_LIT["contact"], "#000000", 0.5) if taken else _DIM), 1.5))
            painter.drawEllipse(self.place(at_m), 3, 3)

    def _paint_press(self, painter: QPainter) -> None:
        press = self.page.press
        if press is None or press.force_n <= 0.0:
            return
        here, radius = self.place(press.at_m), max(0.012 * self.px_per_m, 16.0)
        ring = QRectF(here.x() - radius, here.y() - radius, 2 * radius, 2 * radius)
        painter.setPen(QPen(QColor(theme.mixed(_LIT["force"], "#000000", 0.4)), 4.0))
        painter.drawEllipse(ring)
        painter.setPen(QPen(QColor(_LIT["force"]), 4.0, c=Qt.PenCapStyle.FlatCap))
        painter.drawArc(ring, 90 * 16, -round(360 * 16 * min(max(self._ready, 0.0), 1.0)))
        painter.setPen(QPen(QColor(_LIT["force"]), 2.0))
        for way in (QPointF(1, 0), QPointF(-1, 0), QPointF(0, 1), QPointF(0, -1)):
            painter.drawLine(here + way * 3, here + way * 1.6 * radius)
        painter.setFont(theme.font(24, bold=True))
        beside = here + QPointF(1.2 * radius, -1.2 * radius)
        painter.drawText(beside, quantity(press.force_n, "N"))

    def _paint_rule(self, painter: QPainter, area: QRectF) -> None:
        """Paint a length to check with a ruler."""
        left = QPointF(
            max(area.left(), 2.0 * theme.GRID), min(area.bottom() + 3 * theme.GRID, self.height() - 8 * theme.GRID)
        )
        right = left + QPointF(RULE_M * self.px_per_m, 0.0)
        painter.setPen(QPen(QColor(_LIT["muted"]), 1.0))
        painter.drawLine(left, right)
        for end in (left, right):
            painter.drawLine(end + QPointF(0, -6), end + QPointF(0, 6))
        painter.setFont(theme.font(theme.TEXT_PX))
        painter.drawText(right + QPointF(theme.GRID, 5), f"{quantity(RULE_M, 'm')} on a ruler")
