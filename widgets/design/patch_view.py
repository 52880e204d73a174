"""The view of a patch: its visible part, zoom, and open group."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, QRectF, Qt, Signal
from PySide6.QtGui import QMouseEvent, QNativeGestureEvent, QPainter, QResizeEvent, QTransform, QWheelEvent
from PySide6.QtWidgets import QFrame, QGraphicsView, QWidget

from underfoot.patch.groups import chain, innermost
from underfoot.patch.node import Registry
from underfoot.widgets import theme
from underfoot.widgets.design.breadcrumbs import Breadcrumbs
from underfoot.widgets.design.items import MIN_LEGIBLE_SCALE
from underfoot.widgets.design.message import Message
from underfoot.widgets.design.minimap import MiniMap
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.undo import Document

ZOOM_STEP = 1.2
"""The factor of one step of zoom."""

MAX_ZOOM, MIN_ZOOM = 2.5, 0.1
MIN_FIT_ZOOM = 0.75
"""A patch that is opened is not made smaller than this to fit: its text would be too small to be read."""
HINT = "Double-click, or press /, to add a node\nor drag one here from the list"


class PatchView(QGraphicsView):
    """Shows the document's patch, or the content of one of its groups."""

    refused = Signal(str)
    """Carries the reason why a wire or a paste was refused, which the canvas shows as well."""

    view_moved = Signal()
    """The visible part of the patch, or its zoom, has changed."""

    def __init__(self, document: Document, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.document = document
        self.registry = registry
        self.patch_scene = PatchScene(registry)
        self.setScene(self.patch_scene)
        self.setRenderHint(QPainter.RenderHint.Antialiasing)
        self.setViewportUpdateMode(QGraphicsView.ViewportUpdateMode.MinimalViewportUpdate)
        self.setOptimizationFlag(QGraphicsView.OptimizationFlag.DontSavePainterState)
        self.setTransformationAnchor(QGraphicsView.ViewportAnchor.NoAnchor)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setDragMode(QGraphicsView.DragMode.RubberBandDrag)
        self.setAcceptDrops(True)
        self.setAccessibleName("Canvas")
        self.setMinimumSize(240, 160)
        self._selected_before: list[str] = []
        self.brought: list[str] = []
        """What the last edit, undo or redo has brought onto the canvas, unless it was another patch."""
        self._keeps_fitting = False
        self._views_around: dict[str, tuple[QTransform, QPointF] | None] = {}
        """Zoom and centre of the levels around the open group; None where the whole was fitted."""
        self.map = MiniMap(self.patch_scene, self)
        self.breadcrumbs = Breadcrumbs(self)
        self.hint = theme.label(HINT, "muted")
        self.hint.setParent(self)
        self.hint.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.hint.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._message = Message(self)
        self.map.place_requested.connect(self._centre_on)
        self.breadcrumbs.group_requested.connect(self.open_group)
        document.changed.connect(lambda: self._show_level(self.inside))
        self._show_level("")

    # --- selecting ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.end_band()  # a menu may have taken its release: Qt would select by it what is dragged now
        self._selected_before = self.patch_scene.selected()
        super().mousePressEvent(_extending(event))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        super().mouseMoveEvent(_extending(event))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        super().mouseReleaseEvent(_extending(event))

    @property
    def has_band(self) -> bool:
        """Whether a rubber band is being dragged."""
        return not self.rubberBandRect().isNull()

    def end_band(self) -> None:
        """End a rubber band without effect, also one not yet drawn: select what was selected before it."""
        is_drawn = self.has_band
        self.setDragMode(QGraphicsView.DragMode.NoDrag)
        self.setDragMode(QGraphicsView.DragMode.RubberBandDrag)
        if is_drawn:
            self.patch_scene.select(self._selected_before)

    # --- which part ---

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom with a wheel, or move the view sideways if it is tilted or Shift is held; two fingers on a touchpad move
        the view, and zoom with Control.
        """
        by, moved = event.angleDelta(), event.pixelDelta()
        is_sideways = by.y() == 0 or event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if event.phase() == Qt.ScrollPhase.NoScrollPhase and is_sideways:
            self.pan(-(by.x() + by.y()) // 2, 0)
        elif event.phase() == Qt.ScrollPhase.NoScrollPhase or event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.zoom(ZOOM_STEP ** (by.y() / 120.0), event.position().toPoint())
        elif moved.isNull():
            self.pan(-by.x() // 2, -by.y() // 2)
        else:
            self.pan(-moved.x(), -moved.y())
        event.accept()

    def viewportEvent(self, event: QEvent) -> bool:
        if isinstance(event, QNativeGestureEvent) and event.gestureType() == Qt.NativeGestureType.ZoomNativeGesture:
            self.zoom(max(1.0 + event.value(), 0.5), event.position().toPoint())
            return True
        return super().viewportEvent(event)

    def zoom(self, factor: float, about: QPoint | None = None) -> None:
        """Zoom by a factor around a position of the view, or its centre."""
        self._keeps_fitting = False
        about = about or self.viewport().rect().center()
        held = self.mapToScene(about)
        now = self.transform().m11()
        factor = min(max(now * factor, MIN_ZOOM), MAX_ZOOM) / now
        self.scale(factor, factor)
        slipped = self.mapToScene(about) - held
        self.translate(slipped.x(), slipped.y())
        self._moved()

    def zoom_to(self, scale: float) -> None:
        """Zoom so that a node is drawn at `scale` times its size."""
        self.zoom(scale / self.transform().m11())

    def fit_view(self, *, all_nodes: bool = False) -> None:
        """Show the selected items, or all, at actual size or smaller."""
        self._keeps_fitting = False
        self._fit(self.patch_scene.extent(() if all_nodes else self.patch_scene.selected()), MIN_ZOOM)

    def fit_new_patch(self) -> None:
        """Show the whole patch, or its leftmost node and what is beside it if the whole would be too small to read.
        This fit is repeated on resize until the view is moved. The map goes to the lower corner where it covers less.
        """
        self._fit(self.patch_scene.extent(), MIN_FIT_ZOOM)
        self._keeps_fitting = True
        left, right = (QPoint(x, self.map.y()) for x in (8, self.width() - self.map.width() - 8))
        self.map.move(min(right, left, key=lambda corner: len(self.items(QRect(corner, self.map.size())))))

    def _fit(self, extent: QRectF, min_zoom: float) -> None:
        self.resetTransform()
        if extent.isNull():
            self.centerOn(0.0, 0.0)
        else:
            extent = extent.adjusted(-32, -32, 32, 32)
            covered = 0 if self.breadcrumbs.isHidden() else self.breadcrumbs.geometry().bottom()
            room = self.viewport().rect().adjusted(0, covered, 0, 0)
            scale = max(min(room.width() / extent.width(), room.height() / extent.height(), 1.0), min_zoom)
            self.scale(scale, scale)
            width, height = room.width() / scale, room.height() / scale
            middle = extent.center()
            if extent.width() > width:
                middle.setX(extent.left() + width / 2)
            if extent.height() > height:
                first = min(self.patch_scene.movable().values(), key=lambda item: (item.pos().x(), item.pos().y()))
                lowest = extent.bottom() - height / 2
                middle.setY(min(max(first.sceneBoundingRect().center().y(), extent.top() + height / 2), lowest))
            self.centerOn(middle - QPointF(0.0, covered / 2 / scale))
        self._moved()

    def fit_if_lost(self) -> None:
        """Show the whole patch if no node's centre is visible."""
        seen = self.mapToScene(self.viewport().rect()).boundingRect()
        nodes = list(self.patch_scene.nodes_and_group_nodes())
        if nodes and not any(seen.contains(item.sceneBoundingRect().center()) for item in nodes):
            self.fit_new_patch()

    def pan(self, dx_px: int, dy_px: int) -> None:
        """Pan the view by screen pixels."""
        self._keeps_fitting = False
        self.horizontalScrollBar().setValue(self.horizontalScrollBar().value() + dx_px)
        self.verticalScrollBar().setValue(self.verticalScrollBar().value() + dy_px)
        self._moved()

    def ensure_visible(self, ids: Sequence[str]) -> None:
        """Pan the view as little as possible to show these items, not behind the mini-map."""
        extent = self.patch_scene.extent(ids)
        self.ensureVisible(extent, 32, 32)
        self._moved()
        covered = self.mapFromScene(extent).boundingRect().intersected(self.map.geometry())
        if not self.map.isHidden() and not covered.isEmpty():
            self.pan(0, covered.height() + 8)

    def _centre_on(self, place: QPointF) -> None:
        self._keeps_fitting = False
        self.centerOn(place)
        self._moved()

    def visible_ids(self) -> Sequence[str]:
        """Return the nodes that are visible and large enough to read."""
        if self.transform().m11() < MIN_LEGIBLE_SCALE:
            return ()
        seen = self.mapToScene(self.viewport().rect()).boundingRect()
        return [id for id, item in self.patch_scene.nodes.items() if seen.intersects(item.sceneBoundingRect())]

    # --- which level ---

    def open_group(self, group: str) -> None:
        """Show the content of a group, "" for the whole patch. If it encloses the one that was open, select that, and
        show what was in view before.
        """
        left = self.inside
        is_fitted, centre = self._keeps_fitting, self.mapToScene(self.viewport().rect().center())
        self._show_level(group)
        levels = self._levels_to(left)
        below = levels[levels.index(group) + 1 :] if group in levels else levels if not group else []
        self.patch_scene.select(below[:1])
        if not below:
            self._views_around[left] = None if is_fitted else (self.transform(), centre)
        view = self._views_around.get(group) if below else None
        if view is None:
            self.fit_new_patch()
        else:
            self.setTransform(view[0])
            self._centre_on(view[1])
        self.setFocus()

    def show_item(self, id: str) -> None:
        """Show and select a node, note or group, in the sub-patch that it is in."""
        groups = self.document.patch.groups
        of_group = chain(groups, id) if id in {group.id for group in groups} else []
        around = of_group[:-1] or chain(groups, innermost(groups).get(id, ""))
        collapsed = {group.id for group in groups if group.collapsed}
        level = next((one for one in reversed(around) if one in collapsed), "")
        if level != self.inside:
            self.open_group(level)
        members = self.document.patch.group(id).members if of_group else (id,)
        shown = list(dict.fromkeys(self.patch_scene.group_view.shown_as[member] for member in members))
        self.patch_scene.select(shown)
        if self.transform().m11() < MIN_LEGIBLE_SCALE:
            self.fit_view()  # of a patch seen from afar, a frame of one pixel would be all
        else:
            self.ensure_visible(shown)

    def leave_group(self) -> None:
        """Show the sub-patch that encloses the open one, or the whole patch."""
        levels = self._levels_to(self.inside)
        if levels:
            self.open_group(levels[-2] if len(levels) > 1 else "")

    def _levels_to(self, group: str) -> list[str]:
        """Return a group and the sub-patches around it, the outermost first. A frame around it is no level of its own:
        it is shown with what lies beside it.
        """
        collapsed = {one.id for one in self.document.patch.groups if one.collapsed}
        return [id for id in chain(self.document.patch.groups, group) if id in collapsed or id == group]

    @property
    def inside(self) -> str:
        """The open group; "" for the whole patch."""
        return self.patch_scene.inside

    def _show_level(self, group: str) -> None:
        """Show the content of a group of the patch as it is now; if that is gone, all."""
        self._keeps_fitting = False
        self.show_message("")  # it was about the patch before
        patch = self.document.patch
        names = {group.id: group.title or "Sub-patch" for group in patch.groups}
        before, is_another = self.patch_scene.movable(), patch.title != self.patch_scene.patch.title
        self.patch_scene.show(patch, group if group in names else "")
        self.brought = [] if is_another else [id for id in self.patch_scene.movable() if id not in before]
        self.breadcrumbs.show_path([(id, names[id]) for id in self._levels_to(self.inside)])
        self.hint.setVisible(not patch.nodes and not patch.notes)
        self._moved()

    def update_colours(self) -> None:
        """Redraw the patch in the current colours."""
        self.patch_scene.update_colours()

    # --- what it says ---

    def show_message(self, text: str, *, alarm: bool = True) -> None:
        """Show a line over the canvas for a few seconds; "" clears it."""
        self._message.show_text(text, alarm=alarm)
        if text and alarm:
            self.refused.emit(text)

    @property
    def message(self) -> str:
        """The visible line."""
        return self._message.visible_text

    # --- Qt ---

    def _moved(self) -> None:
        seen = self.mapToScene(self.viewport().rect()).boundingRect()
        self.map.follow(seen)
        self.view_moved.emit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.map.fit_size(self.width(), self.height())
        self.breadcrumbs.fit()
        self.hint.setGeometry(self.rect())
        if self._keeps_fitting:
            self.fit_new_patch()
        self._moved()


def _extending(event: QMouseEvent) -> QMouseEvent:
    """Return the event with Control where Shift is held: both extend a selection, as other editors do."""
    if not event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
        return event
    held = event.modifiers() | Qt.KeyboardModifier.ControlModifier
    places = event.position(), event.scenePosition(), event.globalPosition()
    return QMouseEvent(event.type(), *places, event.button(), event.buttons(), held)
