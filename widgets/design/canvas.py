"""The canvas: where a patch is wired by hand. It turns what mouse and keys do into edits of the document."""

from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QDragEnterEvent,
    QDragMoveEvent,
    QDropEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QApplication, QFrame, QGraphicsView, QWidget

from underfoot.errors import BadFile
from underfoot.patch.node import Registry
from underfoot.widgets import theme
from underfoot.widgets.design.actions import connect_menu, context_menu, make_actions
from underfoot.widgets.design.connecting import WireDrag
from underfoot.widgets.design.driving import Driving
from underfoot.widgets.design.editing import aligned, copied, joined, pasted, refusal, snapped
from underfoot.widgets.design.items import LEGIBLE, NodeItem
from underfoot.widgets.design.message import Message
from underfoot.widgets.design.minimap import MiniMap
from underfoot.widgets.design.node_list import MIME, NodeSearch
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.shape import TITLE
from underfoot.widgets.design.undo import Document

CLOSEST, FARTHEST = 2.5, 0.1
STEP = 1.2
"""The factor of one step of zoom."""


class Canvas(QGraphicsView):
    """Shows the document's patch and edits it."""

    selected = Signal(list)
    """The ids of the selected nodes."""

    refused = Signal(str)
    """Why a wire was not made, or a paste not taken: what the canvas also shows itself."""

    audition_wanted = Signal(str)
    """The node whose button to be heard alone was pressed."""

    view_moved = Signal()
    """Another part of the patch, or another zoom, is seen."""

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
        self._wire: WireDrag | None = None
        self._pan: QPoint | None = None
        self._space = ""
        self._new_at = QPointF()
        self._new_wire: tuple[str, str] | None = None
        self._nudges = 0
        self._keeps_all = False
        self.search = NodeSearch(registry, self)
        self.map = MiniMap(self.patch_scene, self)
        self.driving = Driving(document, self.patch_scene, self)
        self._message = Message(self)
        self.actions_by_name = make_actions(self, self._handlers())
        self.addActions(list(self.actions_by_name.values()))
        self.search.chosen.connect(lambda type: self.add(type, self._new_at))
        self.search.closed.connect(self._close_search)
        self.map.wanted.connect(self._look_at)
        self.patch_scene.selectionChanged.connect(self._selection_changed)
        document.changed.connect(self._show)
        self._show()

    def _handlers(self) -> dict[str, Callable[[], object]]:
        """What each action does."""
        return {
            "cut": self.cut,
            "copy": self.copy,
            "paste": self.paste,
            "duplicate": self.duplicate,
            "delete": self.delete,
            "select all": self.select_all,
            "next": lambda: self.step_selection(1),
            "previous": lambda: self.step_selection(-1),
            "connect": self.open_connect_menu,
            "frame": self.frame,
            "frame all": lambda: self.frame(everything=True),
            "zoom in": lambda: self.zoom(STEP),
            "zoom out": lambda: self.zoom(1.0 / STEP),
            "actual size": lambda: self.zoom_to(1.0),
            **{
                f"align {side}": partial(self.align, side)
                for side in ("left", "right", "top", "bottom", "across", "down")
            },
        }

    # --- edits ---

    def add(self, type: str, place: QPointF | None = None) -> None:
        """Add a node with its title under `place`, or in the middle of what is seen, and select it."""
        if place is None:
            place = self._free_place()
        after = self.document.patch.add(type, self.registry, snapped(place.x() - 16.0, place.y() - TITLE / 2))
        id = after.nodes[-1].id
        if self._new_wire is not None:
            after = joined(after, self.registry, id, *self._new_wire)
        self.document.edit(after, f"Add {self.registry[type].label}")
        self.patch_scene.select([id])

    def delete(self) -> None:
        """Take away the selected nodes and the chosen wire."""
        patch = self.document.patch.disconnect(self.patch_scene.chosen_wires())
        self.document.edit(patch.remove(self.selected_ids()), "Delete")

    def copy(self) -> None:
        """Put the selected nodes, with the wires between them, on the clipboard."""
        if self.selected_ids():
            QApplication.clipboard().setText(copied(self.document.patch, self.selected_ids()))

    def cut(self) -> None:
        """Copy the selected nodes and take them away."""
        if self.selected_ids():
            self.copy()
            self.document.edit(self.document.patch.remove(self.selected_ids()), "Cut")

    def paste(self) -> None:
        """Add the nodes that the clipboard's text describes, under the mouse where it is over the canvas."""
        mouse = self.viewport().mapFromGlobal(self.cursor().pos())
        over = self.viewport().rect().contains(mouse) and self.viewport().underMouse()
        place = self.mapToScene(mouse)
        self._paste(QApplication.clipboard().text(), (place.x(), place.y()) if over else None, "Paste")

    def duplicate(self) -> None:
        """Add the selected nodes once more, beside themselves."""
        if self.selected_ids():
            self._paste(copied(self.document.patch, self.selected_ids()), None, "Duplicate")

    def _paste(self, text: str, at: tuple[float, float] | None, what: str) -> None:
        try:
            after, ids = pasted(self.document.patch, text, self.registry, at)
        except BadFile as error:
            self.say(str(error))
            return
        self.document.edit(after, what)
        self.patch_scene.select(ids)

    def connect_ports(self, source: str, target: str) -> None:
        """Connect two ports by a wire, or say why that cannot be."""
        reason = refusal(self.document.patch, self.registry, source, target)
        if reason:
            self.say(reason)
        else:
            self.document.edit(self.document.patch.connect(source, target, self.registry), "Connect")

    def align(self, side: str) -> None:
        """Bring the selected nodes in line: "left", "right", "top", "bottom", or spread them "across" or "down"."""
        after = aligned(self.document.patch, self.selected_ids(), side, self.patch_scene.sizes())
        self.document.edit(after, "Align")

    def nudge(self, dx: int, dy: int) -> None:
        """Move the selected nodes by steps of the grid; steps in a row are one step of undo."""
        ids = set(self.selected_ids())
        places = {
            n.id: (n.at[0] + dx * theme.GRID, n.at[1] + dy * theme.GRID)
            for n in self.document.patch.nodes
            if n.id in ids
        }
        self.document.edit(self.document.patch.move(places), "Move", f"nudge {sorted(ids)} {self._nudges}")

    def select_all(self) -> None:
        """Select every node."""
        self.patch_scene.select(self.patch_scene.nodes)

    def selected_ids(self) -> list[str]:
        """The selected nodes, in the order of the patch."""
        return self.patch_scene.selected_ids()

    # --- the view ---

    def zoom(self, factor: float, about: QPoint | None = None) -> None:
        """Zoom by a factor; what is at this place of the view, or in its middle, stays there."""
        self._keeps_all = False
        about = about or self.viewport().rect().center()
        held = self.mapToScene(about)
        now = self.transform().m11()
        factor = min(max(now * factor, FARTHEST), CLOSEST) / now
        self.scale(factor, factor)
        slipped = self.mapToScene(about) - held
        self.translate(slipped.x(), slipped.y())
        self._moved()

    def zoom_to(self, scale: float) -> None:
        """Zoom so that a node is drawn at `scale` times its size."""
        self.zoom(scale / self.transform().m11())

    def frame(self, everything: bool = False) -> None:
        """Bring the selected nodes, or all, into view, never larger than actual size.

        Once all are in view they stay so, whatever size the window takes, until the view is moved.
        """
        self._keeps_all = everything
        extent = self.patch_scene.extent(() if everything else self.selected_ids())
        if extent.isNull():
            self.resetTransform()
            self.centerOn(0.0, 0.0)
        else:
            extent = extent.adjusted(-32, -32, 32, 32)
            room = self.viewport().rect()
            scale = min(room.width() / extent.width(), room.height() / extent.height(), 1.0)
            self.resetTransform()
            self.scale(max(scale, FARTHEST), max(scale, FARTHEST))
            self.centerOn(extent.center())
        self._moved()

    def open_search(self, place: QPoint | None = None, wire: tuple[str, str] | None = None) -> None:
        """Ask for a node to be added here: a place of the view, or its middle.

        `wire` is the port, and its side ("in" or "out"), that the new node is to be connected to.
        """
        if place is None:
            mouse = self.viewport().mapFromGlobal(self.cursor().pos())
            place = mouse if self.viewport().rect().contains(mouse) else self.viewport().rect().center()
        self._new_at = self.mapToScene(place)
        self._new_wire = wire
        self.search.open(place.x(), place.y())

    def open_connect_menu(self) -> None:
        """Offer, beside the selected node, every input that its outputs may go to."""
        ids = self.selected_ids()
        if len(ids) != 1:
            self.say("Select the one node whose output is to be connected")
            return
        menu = connect_menu(self, self.document.patch, self.registry, ids[0], self.connect_ports)
        corner = self.patch_scene.nodes[ids[0]].sceneBoundingRect().topRight()
        menu.popup(self.viewport().mapToGlobal(self.mapFromScene(corner)))

    def _close_search(self) -> None:
        self._new_wire = None
        self.setFocus()

    def say(self, text: str, alarm: bool = True) -> None:
        """Show a line over the canvas for a few seconds; an empty one clears it."""
        self._message.show_text(text, alarm)
        if text and alarm:
            self.refused.emit(text)

    @property
    def said(self) -> str:
        """The line that is shown now."""
        return self._message.shown

    # --- mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        place = self.mapToScene(event.position().toPoint())
        button = event.button()
        self._nudges += 1
        if button == Qt.MouseButton.MiddleButton or (button == Qt.MouseButton.LeftButton and self._space):
            self._pan = event.position().toPoint()
            self._space = "used" if self._space else ""
            self.viewport().setCursor(Qt.CursorShape.ClosedHandCursor)
            return
        if button != Qt.MouseButton.LeftButton:
            return
        found = self.patch_scene.port_at(place)
        if found is not None:
            self.say("")
            self._wire = WireDrag(self.patch_scene, *found)
            self._wire.move(place)
            return
        node = self.patch_scene.node_at(place, 6.0)
        if node is not None and node.more_at(place):
            node.set_ports(node.driven, True)
            return
        if node is not None and self.transform().m11() >= LEGIBLE and node.button_at(place):
            self.audition_wanted.emit(node.node.id)
            return
        wire = None if node else self.patch_scene.wire_at(place)
        self.patch_scene.choose(wire)
        super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pan is not None:
            self._keeps_all = False
            by = event.position().toPoint() - self._pan
            self._pan = event.position().toPoint()
            self.horizontalScrollBar().setValue(self.horizontalScrollBar().value() - by.x())
            self.verticalScrollBar().setValue(self.verticalScrollBar().value() - by.y())
            self._moved()
        elif self._wire is not None:
            self._wire.move(self.mapToScene(event.position().toPoint()))
            if self._wire.reason != self.said:
                self.say(self._wire.reason)
        else:
            super().mouseMoveEvent(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._pan is not None:
            self._pan = None
            self.viewport().unsetCursor()
            return
        if self._wire is not None:
            drag, self._wire = self._wire, None
            result = drag.result(self.document.patch)
            drag.end()
            if result is not None:
                self.document.edit(*result)
            elif drag.is_loose(self.mapToScene(event.position().toPoint())):
                self.open_search(event.position().toPoint(), (drag.end_name, drag.placed.side))
            return
        super().mouseReleaseEvent(event)
        places = self.patch_scene.places()
        if places:
            self.document.edit(self.document.patch.move(places), "Move")

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        place = self.mapToScene(event.position().toPoint())
        if event.button() == Qt.MouseButton.LeftButton and self.patch_scene.node_at(place, 6.0) is None:
            self.open_search(event.position().toPoint())
        else:
            super().mouseDoubleClickEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.zoom(STEP ** (event.angleDelta().y() / 120.0), event.position().toPoint())
        event.accept()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        node = self.patch_scene.node_at(self.mapToScene(event.pos()))
        if isinstance(node, NodeItem) and not node.isSelected():
            self.patch_scene.select([node.node.id])
        self._new_at = self.mapToScene(event.pos())
        wire_chosen = bool(self.patch_scene.chosen_wires())
        search = partial(self.open_search, event.pos())
        menu = context_menu(self, self.actions_by_name, search, len(self.selected_ids()), wire_chosen)
        if node is not None and len(self.selected_ids()) == 1:
            self.driving.offer(menu, node, self._new_at)
        menu.popup(event.globalPos())

    # --- drops from the palette ---

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        type = bytes(event.mimeData().data(MIME).data()).decode()
        if type in self.registry:
            event.acceptProposedAction()
            self.add(type, self.mapToScene(event.position().toPoint()))
            self.setFocus()

    # --- keys ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        arrows = {Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, -1), Qt.Key.Key_Down: (0, 1)}
        if event.key() == Qt.Key.Key_Space:
            if not event.isAutoRepeat():
                self._space = "down"
        elif event.key() == Qt.Key.Key_Escape:
            self._escape()
        elif event.key() in arrows:
            dx, dy = arrows[Qt.Key(event.key())]
            if self.selected_ids():
                far = 4 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1
                self.nudge(dx * far, dy * far)
            else:
                self.horizontalScrollBar().setValue(self.horizontalScrollBar().value() + 64 * dx)
                self.verticalScrollBar().setValue(self.verticalScrollBar().value() + 64 * dy)
                self._moved()
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            if self._space == "down":
                self.open_search()
            self._space = ""
        else:
            super().keyReleaseEvent(event)

    def _escape(self) -> None:
        self.say("")
        if self._wire is not None:
            self._wire.end()
            self._wire = None
        elif any(node.opened for node in self.patch_scene.nodes.values()):
            for node in self.patch_scene.nodes.values():
                node.set_ports(node.driven, False)
        else:
            self.patch_scene.choose(None)
            self.patch_scene.select([])

    def step_selection(self, by: int) -> None:
        """Select the next node in the order of the patch, and bring it into view."""
        ids = list(self.patch_scene.nodes)
        if ids:
            now = self.selected_ids()
            at = ids.index(now[-1]) + by if now else (0 if by > 0 else -1)
            self.patch_scene.select([ids[at % len(ids)]])
            self.ensureVisible(self.patch_scene.extent(self.selected_ids()), 32, 32)
            self._moved()

    # --- inside ---

    def _show(self) -> None:
        self._keeps_all = False
        self.patch_scene.show(self.document.patch)
        self._moved()

    def _selection_changed(self) -> None:
        ids = self.selected_ids()
        self._nudges += 1
        for id, node in self.patch_scene.nodes.items():
            if node.opened and id not in ids:
                node.set_ports(node.driven, False)
        self.map.update()
        self.selected.emit(ids)

    def _free_place(self) -> QPointF:
        """The middle of the view, or a little beside a node that is there already."""
        place = self.mapToScene(self.viewport().rect().center()) - QPointF(64.0, 40.0)
        taken = {node.at for node in self.document.patch.nodes}
        while snapped(place.x() - 16.0, place.y() - TITLE / 2) in taken:
            place += QPointF(32.0, 32.0)
        return place

    def _look_at(self, place: QPointF) -> None:
        self._keeps_all = False
        self.centerOn(place)
        self._moved()

    def _moved(self) -> None:
        seen = self.mapToScene(self.viewport().rect()).boundingRect()
        self.map.follow(seen)
        self.view_moved.emit()

    def visible_ids(self) -> Sequence[str]:
        """Nodes that are in view and large enough to be read."""
        if self.transform().m11() < 0.45:
            return ()
        seen = self.mapToScene(self.viewport().rect()).boundingRect()
        return [id for id, item in self.patch_scene.nodes.items() if seen.intersects(item.sceneBoundingRect())]

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.map.move(self.width() - self.map.width() - 8, self.height() - self.map.height() - 8)
        if self._keeps_all:
            self.frame(everything=True)
        self._moved()

    def drawForeground(self, painter: QPainter, rect: QRectF | QRect) -> None:
        if self.document.patch.nodes:
            return
        painter.resetTransform()
        painter.setFont(theme.font())
        painter.setPen(QColor(theme.MUTED))
        painter.drawText(
            self.viewport().rect(),
            Qt.AlignmentFlag.AlignCenter,
            "Double-click, or press Space, to add a node\nor drag one here from the list",
        )
