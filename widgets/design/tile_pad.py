"""A picture of a tile from above: a click strikes it, a drag presses it."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, QSize, Qt, QTimerEvent, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from underfoot.floor.layout import Tile, default_floor
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.lost_release import is_release_lost

FULL_SCALE_N = 800.0
"""The force of a drag by the length of the tile's side: about a person's weight."""
CLICK_PX = 4.0
LEAST_PX, SMALL_PX = 96, 72
"""A small tile has its name only."""


class TilePad(QWidget):
    """A drag presses the tile at its start; the force increases with the drag's length."""

    struck = Signal(str, float)
    """Tile and strength."""

    pressed = Signal(str, float, float, float)
    """Tile, place in the tile's frame in metres, force in newtons; 0 ends the press."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._tiles: tuple[Tile, ...] = (default_floor().tiles[0],)
        self._index = 0
        self._began: QPointF | None = None
        self._mouse = QPointF()
        self._force_n = 0.0
        self._flash = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName("Tile")
        self.setToolTip(
            "Click: strike the tile.\nDrag: press it; a longer drag presses harder.\nSpace: strike its middle."
        )
        self.set_small(False)

    def set_small(self, small: bool) -> None:
        """Set whether space is short; the tile is then smaller, without text."""
        self._is_small = small
        side = SMALL_PX if small else LEAST_PX
        self.setMinimumSize(side, side)
        self.update()

    @property
    def tile(self) -> Tile:
        """The tile shown."""
        return self._tiles[self._index]

    def set_tiles(self, tiles: Sequence[Tile]) -> None:
        """Set the available tiles; the current one is kept if it is among them."""
        ids = [tile.id for tile in tiles]
        self._index = ids.index(self.tile.id) if self.tile.id in ids else 0
        self._tiles = tuple(tiles)
        self.update()

    def set_tile(self, id: str) -> None:
        """Show this tile."""
        self._end_press()
        self._index = next((i for i, tile in enumerate(self._tiles) if tile.id == id), 0)
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(160, 112)

    # --- mouse and keys ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._area().contains(event.position()):
            self._began = self._mouse = event.position()
            self._force_n = 0.0

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._began is None:
            return
        self._mouse = event.position()
        length_px = QLineF(self._began, self._mouse).length()
        if length_px > CLICK_PX or self._force_n > 0:
            self._force_n = min(max(length_px - CLICK_PX, 0.0) / self._area().height(), 1.0) * FULL_SCALE_N
            self.pressed.emit(self.tile.id, *self._place(self._began), max(self._force_n, 1.0))
        self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or self._began is None:
            return
        if self._force_n == 0.0:
            self._strike()
        self._end_press()

    def event(self, event: QEvent) -> bool:
        if is_release_lost(event):
            self._end_press()
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            self._strike()
        elif event.key() == Qt.Key.Key_Escape:
            self._end_press()
        else:
            super().keyPressEvent(event)

    def _strike(self) -> None:
        self._flash = True
        self.update()
        self.startTimer(120)
        self.struck.emit(self.tile.id, 1.0)

    def timerEvent(self, event: QTimerEvent) -> None:
        self.killTimer(event.timerId())
        self._flash = False
        self.update()

    def _end_press(self) -> None:
        if self._began is not None and self._force_n > 0.0:
            self.pressed.emit(self.tile.id, *self._place(self._began), 0.0)
        self._began, self._force_n = None, 0.0
        self.update()

    # --- positions ---

    def _area(self) -> QRectF:
        width_m, height_m = self.tile.size_m
        room = QRectF(self.rect()).adjusted(8, 8, -8, -8)
        scale = min(room.width() / width_m, room.height() / height_m)
        size = (width_m * scale, height_m * scale)
        return QRectF(room.center().x() - size[0] / 2, room.center().y() - size[1] / 2, *size)

    def _place(self, mouse: QPointF) -> tuple[float, float]:
        """Return a position of the widget in the tile's frame, in metres, y upwards."""
        area, (width_m, height_m) = self._area(), self.tile.size_m
        x = (mouse.x() - area.center().x()) / area.width() * width_m
        y = (area.center().y() - mouse.y()) / area.height() * height_m
        return min(max(x, -width_m / 2), width_m / 2), min(max(y, -height_m / 2), height_m / 2)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        area = self._area()
        share = min(self._force_n / FULL_SCALE_N, 1.0)
        load = theme.mixed(theme.FORCE, theme.RAISED, 0.35 * share)
        border = theme.VIBRATION if self._flash or self.hasFocus() else theme.FAINT
        painter.setPen(QPen(QColor(border), 1.5))
        painter.setBrush(QColor(theme.mixed(theme.VIBRATION, theme.RAISED, 0.35) if self._flash else load))
        painter.drawRoundedRect(area, 4, 4)
        width_m, height_m = self.tile.size_m
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.MUTED))
        for x, y in self.tile.sensors_m:
            at = QPointF(
                area.center().x() + x / width_m * area.width(), area.center().y() - y / height_m * area.height()
            )
            painter.drawEllipse(at, 2.5, 2.5)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QColor(theme.TEXT if self._flash else theme.MUTED))
        if self._began is None:
            metrics, room = painter.fontMetrics(), area.adjusted(4, 0, -4, 0).toRect()
            name = metrics.elidedText(self.tile.id, Qt.TextElideMode.ElideMiddle, room.width())
            text = f"{name}\nclick strikes\ndrag presses"
            # A force plate can be narrower than the words, which the tooltip has, too.
            fits = room.contains(metrics.boundingRect(room, Qt.AlignmentFlag.AlignCenter, text))
            painter.drawText(area, Qt.AlignmentFlag.AlignCenter, text if fits and not self._is_small else name)
        elif self._force_n > 0.0:
            radius = 6.0 + 18.0 * share
            painter.setPen(QPen(QColor(theme.FORCE), 1.5))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(self._began, radius, radius)
            painter.drawLine(self._began, self._mouse)
            below = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom
            painter.setPen(QColor(theme.TEXT))
            painter.drawText(area.adjusted(0, 0, 0, -6), below, quantity(self._force_n, "N", 2))
