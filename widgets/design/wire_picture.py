"""All wires at rest as one item: painted once into a pixmap of the view, which is reused."""

from collections.abc import Mapping

from PySide6.QtCore import QPointF, QRect, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QPainter, QPainterPath, QPixmap, QRegion, QTransform
from PySide6.QtWidgets import QGraphicsItem, QStyleOptionGraphicsItem, QWidget

from underfoot.patch.wiring import Wire
from underfoot.widgets.design.items import WireItem

STILL_MS = 250
"""A wire that has not moved for so long is drawn into the picture."""
MAX_AREAS = 12
"""Number of changed wires above which everything is redrawn, which is faster than a region of many rectangles."""
EDGE_PX = 2
"""Margin for antialiasing around a wire's bounds, in pixels."""


class WirePicture(QGraphicsItem):
    """Paints the wires of a scene that do not move. Dragged or highlighted wires paint themselves."""

    def __init__(self, wires: Mapping[Wire, WireItem], area: QRectF) -> None:
        super().__init__()
        self._wires, self._area = wires, area
        self._moving: set[WireItem] = set()
        self._picture = QPixmap()
        self._transform = QTransform()
        self._changed: list[QRectF] = []
        self._still_timer = QTimer(interval=STILL_MS, singleShot=True)
        self._still_timer.timeout.connect(self.put_back_still)
        self.setZValue(-1.0)
        self.setAcceptedMouseButtons(Qt.MouseButton.NoButton)
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemUsesExtendedStyleOption)

    def take_out(self, wire: WireItem) -> None:
        """Exclude a wire that begins to move; it paints itself until it rests."""
        if wire not in self._moving:
            self._moving.add(wire)
            self.redraw(wire.boundingRect())
            wire.set_in_picture(False)
        self._still_timer.start()

    def put_back_still(self) -> None:
        """Include the wires that have come to rest."""
        for wire in self._moving:
            if wire.scene() is not None:
                wire.set_in_picture(True)
                self.redraw(wire.boundingRect())
        self._moving.clear()

    def redraw(self, area: QRectF) -> None:
        """Repaint a part of the scene."""
        if len(self._changed) <= MAX_AREAS:
            self._changed.append(area)
        self.update(area)

    def redraw_all(self) -> None:
        """Repaint everything."""
        self._picture = QPixmap()
        self.update()

    # --- Qt ---

    def boundingRect(self) -> QRectF:
        return self._area

    def shape(self) -> QPainterPath:
        """Return an empty path, because each wire handles mouse hits itself."""
        return QPainterPath()

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        seen = painter.worldTransform()
        if widget is None:
            self._draw(painter, [self._area])
            return
        self._draw_areas(self._stale_region(seen, widget.size(), widget.devicePixelRatioF()))
        ratio = widget.devicePixelRatioF()
        part = seen.mapRect(option.exposedRect).toAlignedRect() & widget.rect()
        painter.setWorldTransform(QTransform())
        painter.drawPixmap(QRectF(part), self._picture, QRectF(part.topLeft() * ratio, part.size() * ratio))

    def _stale_region(self, seen: QTransform, size: QSize, ratio: float) -> QRegion:
        """Return the outdated region of the pixmap, in the view's pixels; scrolled parts are moved within it."""
        all_of_it = QRect(0, 0, size.width(), size.height())
        is_same = self._picture.size() == size * ratio and self._picture.devicePixelRatio() == ratio
        before, self._transform = self._transform, seen
        aside = QPointF(seen.dx() - before.dx(), seen.dy() - before.dy()) * ratio
        by = aside.toPoint()
        is_moved_only = (before.m11(), before.m22()) == (seen.m11(), seen.m22()) and QPointF(by) == aside
        changed, self._changed = self._changed, []
        if not is_same or not is_moved_only or len(changed) > MAX_AREAS:
            if not is_same:
                self._picture = QPixmap(size * ratio)
                self._picture.setDevicePixelRatio(ratio)
            return QRegion(all_of_it)
        stale = QRegion()
        if not by.isNull():
            kept = QRect(all_of_it).translated((aside / ratio).toPoint())
            self._picture.scroll(by.x(), by.y(), QRect(self._picture.rect()))
            stale = QRegion(all_of_it) - QRegion(kept.adjusted(1, 1, -1, -1))
        for area in changed:
            stale += seen.mapRect(area).toAlignedRect().adjusted(-EDGE_PX, -EDGE_PX, EDGE_PX, EDGE_PX)
        return stale & all_of_it

    def _draw_areas(self, stale: QRegion) -> None:
        if stale.isEmpty():
            return
        parts: list[QRect] = list(stale)  # type: ignore[call-overload]
        is_all = parts[0].size() * self._picture.devicePixelRatio() == self._picture.size()
        if is_all:
            self._picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(self._picture)
        if not is_all:
            painter.setClipRegion(stale)
            painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_Clear)
            painter.fillRect(stale.boundingRect(), Qt.GlobalColor.transparent)
            painter.setCompositionMode(QPainter.CompositionMode.CompositionMode_SourceOver)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setWorldTransform(self._transform)
        back = self._transform.inverted()[0]
        self._draw(painter, [back.mapRect(QRectF(part)) for part in parts])
        painter.end()

    def _draw(self, painter: QPainter, areas: list[QRectF]) -> None:
        for wire in self._wires.values():
            if wire.is_in_picture and wire.isVisible() and any(map(wire.boundingRect().intersects, areas)):
                wire.paint_line(painter)
