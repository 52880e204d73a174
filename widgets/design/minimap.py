"""The mini-map of a large patch, with the visible part."""

from PySide6.QtCore import QPointF, QRectF, QSize, QSizeF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from underfoot.widgets import theme
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.pictures import blank_picture

_LEAST_NODE_PX, _LEAST_VIEW_PX = 2.0, 5.0
_EDGE_PX = 4
"""Room around what is on the map."""


class MiniMap(QWidget):
    """`place_requested` carries the scene position on which to centre the view."""

    place_requested = Signal(QPointF)

    def __init__(self, scene: PatchScene, parent: QWidget) -> None:
        super().__init__(parent)
        self._scene = scene
        self._view = QRectF()
        self._extent = QRectF()
        self._picture = QPixmap()
        self._drawn: tuple[object, ...] = ()
        """The key of the cached picture of the nodes."""
        scene.selectionChanged.connect(self.update_colours)
        self.setToolTip("Overview of the patch; drag to move the view")
        self.hide()

    def fit_size(self, width: int, height: int) -> None:
        """Place the map in the lower right corner of a canvas of this size, with most of the canvas free."""
        map_width = round(min(max(0.22 * min(width, 1.5 * height), 88), 176))
        map_height = round(0.64 * map_width)
        self.setGeometry(width - map_width - 8, height - map_height - 8, map_width, map_height)

    def follow(self, view: QRectF) -> None:
        """Set the visible part of the scene. The map is shown unless that is the whole scene."""
        self._extent = self._scene.extent()
        self._view = view
        self.setVisible(len(self._scene.movable()) > 1 and not view.contains(self._extent))
        self.update()

    def _scale(self) -> tuple[float, QPointF]:
        whole = self._extent.united(self._view) if self._view.width() < 4 * self._extent.width() else self._extent
        room = self.size() - QSize(2 * _EDGE_PX, 2 * _EDGE_PX)
        scale = min(room.width() / max(whole.width(), 1.0), room.height() / max(whole.height(), 1.0))
        return scale, whole.center()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        inside = self.rect().adjusted(1, 1, -1, -1)
        painter.fillRect(self.rect(), QColor(theme.LINE))  # not a line, which is cut at scales like 1.25
        painter.fillRect(inside, QColor(theme.PANEL))
        painter.setClipRect(inside)
        painter.drawPixmap(0, 0, self._nodes())
        painter.setPen(QPen(QColor(theme.MUTED), 1))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(self._on_map(self._view, _LEAST_VIEW_PX))

    def _on_map(self, area: QRectF, least_px: float) -> QRectF:
        """Return where a part of the scene is on the map, at least so large: less than a pixel would not be drawn."""
        scale, middle = self._scale()
        size = (area.size() * scale).expandedTo(QSizeF(least_px, least_px))
        at = (area.center() - middle) * scale + QRectF(self.rect()).center()
        return QRectF(at - QPointF(size.width() / 2, size.height() / 2), size)

    def _nodes(self) -> QPixmap:
        """Return the picture of the nodes, redrawn only after a change of nodes or scale."""
        key = (self._scale(), self._scene.patch, self._scene.inside, self.size(), self.devicePixelRatioF())
        if key != self._drawn:
            self._drawn = key
            self._picture = blank_picture(self.size(), self.devicePixelRatioF(), Qt.GlobalColor.transparent)
            painter = QPainter(self._picture)
            painter.setPen(Qt.PenStyle.NoPen)
            for item in self._scene.nodes_and_group_nodes():
                share = 0.9 if item.isSelected() else 0.45
                painter.setBrush(QColor(theme.mixed(item.description.colour, theme.PANEL, share)))
                painter.drawRect(self._on_map(item.geometry.rect.translated(item.pos()), _LEAST_NODE_PX))
            painter.end()
        return self._picture

    def update_colours(self) -> None:
        """Redraw the nodes in the current colours."""
        self._drawn = ()
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._go(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._go(event)

    def _go(self, event: QMouseEvent) -> None:
        scale, middle = self._scale()
        away = event.position() - QPointF(self.width() / 2, self.height() / 2)
        self.place_requested.emit(middle + away / scale)
        event.accept()
