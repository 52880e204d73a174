"""A tile at its true size for a projector above the floor: dark, with a mark where to press now."""

import math

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QCloseEvent, QColor, QKeyEvent, QPainter, QPaintEvent, QPen, QScreen
from PySide6.QtWidgets import QWidget

from underfoot import quantities
from underfoot.calibration.procedure import Page
from underfoot.floor.layout import Tile
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.calibrate.tile_picture import place_number

SCALE_STEP, FINE_STEP = 1.01, 1.001
MOVE_M, FINE_M = 0.005, 0.001
RULE_M = 0.1
LEAST, MOST = 0.05, 20.0
_DIRECTIONS = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, 1),
    Qt.Key.Key_Down: (0, -1),
}
_DIM = "#4a5462"


class FloorProjection(QWidget):
    """A window that fills a screen. Plus and minus scale it, arrow keys move it, Return continues, Escape closes it.

    Panic is Escape in the main window only: who stands on the floor with a keyboard wants to leave this view.
    """

    adjusted = Signal(float, float, float)
    """The scale, and where the tile's middle is, in metres right of and above the screen's."""
    go_wanted = Signal()
    closed = Signal()

    def __init__(self, tile: Tile, scale: float = 1.0, at_m: tuple[float, float] = (0.0, 0.0)) -> None:
        super().__init__(None, Qt.WindowType.Window)
        self.setWindowTitle(f"Tile {tile.id} on the floor – Underfoot")
        self.setAccessibleName("Tile at its true size")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setCursor(Qt.CursorShape.BlankCursor)
        self._tile, self.page, self._ready = tile, Page("", "", ""), 0.0
        self.scale, self.at_m = min(max(scale, LEAST), MOST), at_m

    def show_on(self, screen: QScreen) -> None:
        """Fill this screen."""
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()

    def show_page(self, page: Page, ready: float) -> None:
        """Mark the page's press, of which `ready` has come."""
        self.page, self._ready = page, ready
        self.update()

    @property
    def px_per_m(self) -> float:
        """Pixels a metre of the floor, from the size that the screen says it has, and the scale."""
        screen = self.screen()
        per_m = 1e3 * screen.geometry().width() / screen.physicalSize().width() if screen.physicalSize().width() else 0
        return (per_m if math.isfinite(per_m) and per_m > 0 else _USUAL_PX_PER_M) * self.scale

    def place(self, at_m: tuple[float, float]) -> QPointF:
        """A place of the tile's frame, y upwards, in the view's pixels."""
        middle = QPointF(self.width() / 2, self.height() / 2)
        x, y = (part + moved for part, moved in zip(at_m, self.at_m, strict=True))
        return middle + QPointF(x, -y) * self.px_per_m

    def keyPressEvent(self, event: QKeyEvent) -> None:
        fine = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        step = FINE_STEP if fine else SCALE_STEP
        match event.key():
            case Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_Return | Qt.Key.Key_Enter:
                self.go_wanted.emit()
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal:
                self._adjust(self.scale * step, self.at_m)
            case Qt.Key.Key_Minus:
                self._adjust(self.scale / step, self.at_m)
            case Qt.Key.Key_0:
                self._adjust(1.0, (0.0, 0.0))
            case Qt.Key.Key_Left | Qt.Key.Key_Right | Qt.Key.Key_Up | Qt.Key.Key_Down:
                move = FINE_M if fine else MOVE_M
                right, up = _DIRECTIONS[Qt.Key(event.key())]
                self._adjust(self.scale, (self.at_m[0] + right * move, self.at_m[1] + up * move))
            case _:
                super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        self.closed.emit()

    def _adjust(self, scale: float, at_m: tuple[float, float]) -> None:
        self.scale, self.at_m = min(max(scale, LEAST), MOST), at_m
        self.adjusted.emit(self.scale, *self.at_m)
        self.update()

    # --- paint ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black"))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        width_m, height_m = self._tile.size_m
        corner = self.place((-width_m / 2, height_m / 2))
        painter.setPen(QPen(QColor(_DIM), 1.0))
        area = QRectF(corner, self.place((width_m / 2, -height_m / 2)))
        painter.drawRect(area)
        for at_m in self._tile.sensors_m:
            painter.drawEllipse(self.place(at_m), 4, 4)
        self._paint_places(painter)
        self._paint_press(painter)
        self._paint_rule(painter, area)
        self._paint_words(painter)

    def _paint_places(self, painter: QPainter) -> None:
        now = place_number(self.page.places_m, self.page.press)
        for number, at_m in enumerate(self.page.places_m):
            taken = now is not None and number < now
            painter.setPen(QPen(QColor(theme.mixed(theme.CONTACT, "#000000", 0.5) if taken else _DIM), 1.5))
            painter.drawEllipse(self.place(at_m), 3, 3)

    def _paint_press(self, painter: QPainter) -> None:
        press = self.page.press
        if press is None or press.force_n <= 0.0:
            return
        here, radius = self.place(press.at_m), max(0.012 * self.px_per_m, 16.0)
        ring = QRectF(here.x() - radius, here.y() - radius, 2 * radius, 2 * radius)
        painter.setPen(QPen(QColor(theme.mixed(theme.FORCE, "#000000", 0.4)), 4.0))
        painter.drawEllipse(ring)
        painter.setPen(QPen(QColor(theme.FORCE), 4.0, c=Qt.PenCapStyle.FlatCap))
        painter.drawArc(ring, 90 * 16, -round(360 * 16 * min(max(self._ready, 0.0), 1.0)))
        painter.setPen(QPen(QColor(theme.FORCE), 2.0))
        for way in (QPointF(1, 0), QPointF(-1, 0), QPointF(0, 1), QPointF(0, -1)):
            painter.drawLine(here + way * 3, here + way * 1.6 * radius)
        painter.setFont(theme.font(24, bold=True))
        beside = here + QPointF(1.2 * radius, -1.2 * radius)
        painter.drawText(beside, quantity(press.force_n, "N"))

    def _paint_rule(self, painter: QPainter, area: QRectF) -> None:
        """A length to hold a ruler against."""
        left = QPointF(
            max(area.left(), 2.0 * theme.GRID), min(area.bottom() + 3 * theme.GRID, self.height() - 6 * theme.GRID)
        )
        right = left + QPointF(RULE_M * self.px_per_m, 0.0)
        painter.setPen(QPen(QColor(theme.MUTED), 1.0))
        painter.drawLine(left, right)
        for end in (left, right):
            painter.drawLine(end + QPointF(0, -6), end + QPointF(0, 6))
        painter.setFont(theme.font(theme.TEXT_PX))
        painter.drawText(right + QPointF(theme.GRID, 5), f"{quantity(RULE_M, 'm')} on a ruler")

    def _paint_words(self, painter: QPainter) -> None:
        right, up = (quantity(part, "m") if part else "0 mm" for part in self.at_m)
        words = (
            f"Scale {quantities.number(100 * self.scale, 4)} %  (+ and −; with Ctrl finer)      "
            f"Moved {right} right, {up} up  (arrows)      0: reset      Return: continue      Esc: close"
        )
        line = QRectF(0, self.height() - 4 * theme.GRID, self.width(), 4 * theme.GRID)
        painter.fillRect(line, QColor("black"))
        painter.setPen(QColor(theme.MUTED))
        painter.drawText(line, Qt.AlignmentFlag.AlignCenter, words)


_USUAL_PX_PER_M = 96.0 / 0.0254
