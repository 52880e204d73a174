"""The canvas: where a patch is wired by hand. It turns what mouse and keys do into edits of the document."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QDragEnterEvent,
    QDragLeaveEvent,
    QDragMoveEvent,
    QDropEvent,
    QKeyEvent,
    QMouseEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QGraphicsItem, QWidget
from shiboken6 import isValid

from underfoot.patch.groups import COLOURS
from underfoot.patch.node import Registry
from underfoot.patch.patch import Wire
from underfoot.widgets.design.actions import Chosen, connect_menu, context_menu, make_actions
from underfoot.widgets.design.blocks import BlockItem, item_rect
from underfoot.widgets.design.connecting import WireDrag
from underfoot.widgets.design.driving import Driving
from underfoot.widgets.design.editing import snapped
from underfoot.widgets.design.edits import EditableView
from underfoot.widgets.design.items import LEGIBLE, NodeItem, WireItem
from underfoot.widgets.design.node_list import MIME, NO_NODE, NodeSearch
from underfoot.widgets.design.rewiring import port_of, types_for_wire, types_that_fit
from underfoot.widgets.design.shape import TITLE
from underfoot.widgets.design.undo import Document
from underfoot.widgets.escape import asks_for_escape

STEP = 1.2
"""The factor of one step of zoom."""

AIM = 10.0
"""Pixels of the scene around the mouse in which a wire is meant, when a node is dropped."""

_ARROWS = {Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, -1), Qt.Key.Key_Down: (0, 1)}


class Wanted(NamedTuple):
    """What is done with the node that is chosen in the list."""

    at: QPointF
    held: tuple[str, str] | None = None
    """The port that holds a wire, and its side: the node is connected to it."""
    old: Wire | None = None
    """The wire that was pulled off."""
    into: Wire | None = None
    """The wire that the node is put into."""
    replaces: bool = False
    """It takes the place of the selected node."""


class Canvas(EditableView):
    """Shows the document's patch and edits it."""

    play_wanted = Signal()
    """Space was pressed: what plays is to stop, or the other way round."""
    audition_wanted = Signal(str)
    """The node whose button to be heard alone was pressed."""

    def __init__(self, document: Document, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(document, registry, parent)
        self._wire: WireDrag | None = None
        self._hanging: WireDrag | None = None
        self._pan: QPoint | None = None
        self._frame: tuple[QPointF, list[tuple[QGraphicsItem, QPointF]]] | None = None
        self._space = ""
        self._wanted = Wanted(QPointF())
        self.search = NodeSearch(registry, self)
        self.driving = Driving(document, self.patch_scene, self)
        self.actions_by_name = make_actions(self, self._handlers())
        self.addActions(list(self.actions_by_name.values()))
        self.search.chosen.connect(self._take)
        self.search.closed.connect(self._close_search)
        self.patch_scene.selectionChanged.connect(self._selection_changed)

    def _handlers(self) -> dict[str, Callable[[], object]]:
        """What each action does."""
        return {
            "add": self.open_search,
            "note": lambda: self.add_note(self.mapToScene(self._mouse())),
            "rename": self.rename,
            "replace": self.open_replacements,
            "group": self.group,
            "ungroup": self.ungroup,
            "collapse": self.collapse,
            "enter": self.enter,
            "leave": self.leave,
            "tidy": self.tidy,
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
            **{f"colour {name}": partial(self.paint_group, name) for name in COLOURS},
        }

    # --- lists and menus ---

    def open_search(self, place: QPoint | None = None) -> None:
        """Ask for a node to be added here: a place of the view, or where the mouse is. On a wire it is put in there."""
        place = place or self._mouse()
        at = self.mapToScene(place)
        wire = self.patch_scene.wire_at(at) if self.patch_scene.node_at(at) is None else None
        if wire is not None and wire.wire in self.patch_scene.wires:
            self.patch_scene.offer(wire)
            allowed = types_for_wire(self.document.patch, self.registry, wire.wire)
            self._open_list(place, Wanted(at, into=wire.wire), allowed, hint="Insert a node")
        else:
            self._open_list(place, Wanted(at), None)

    def open_replacements(self) -> None:
        """Ask for the type of node that the selected one is to be changed into."""
        ids = self.patch_scene.selected()
        if len(ids) != 1 or ids[0] not in self.patch_scene.nodes:
            self.say("Select the one node that is to be replaced")
            return
        item = self.patch_scene.nodes[ids[0]]
        others = [type for type in self.registry if type != item.node.type]
        self._open_list(self.mapFromScene(item.pos()), Wanted(item.pos(), replaces=True), others, hint="Replace by")

    def _open_list(
        self, place: QPoint, wanted: Wanted, allowed: list[str] | None, first: str = "", hint: str = "Add a node"
    ) -> None:
        self._wanted = wanted
        self.search.open(place.x(), place.y(), allowed, first, hint)

    def _take(self, type: str) -> None:
        """What was chosen in the list."""
        wanted = self._wanted
        if type == NO_NODE and wanted.old is not None:
            self.document.edit(self.document.patch.disconnect([wanted.old]), "Disconnect")
        elif wanted.replaces:
            self.replace(type)
        elif type != NO_NODE:
            self.add(type, wanted.at, wanted.held, wanted.old, wanted.into)

    def _close_search(self) -> None:
        if self._hanging is not None:
            self._hanging.end()
            self._hanging = None
        self.patch_scene.offer(None)
        self.setFocus()

    def open_connect_menu(self) -> None:
        """Offer, beside the selected node, every input that its outputs may go to."""
        ids = self.selected_ids()
        if len(ids) != 1 or ids[0] not in self.patch_scene.nodes:
            self.say("Select the one node whose output is to be connected")
            return
        menu = connect_menu(self, self.document.patch, self.registry, ids[0], self.connect_ports)
        corner = self.patch_scene.nodes[ids[0]].sceneBoundingRect().topRight()
        menu.popup(self.viewport().mapToGlobal(self.mapFromScene(corner)))

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        place, scene = self.mapToScene(event.pos()), self.patch_scene
        item = scene.node_at(place) or scene.note_at(place)
        frame = scene.frame_at(place) if item is None else None
        if item is not None and not item.isSelected():
            scene.select([id for id, other in scene.movable().items() if other is item])
        elif frame is not None:
            scene.select({scene.level.stands[member] for member in frame.group_now.members})
        chosen = scene.selected()
        is_node = len(chosen) == 1 and chosen[0] in scene.nodes
        is_group = any(id in scene.blocks for id in chosen) or bool(self._one_frame())
        what = Chosen(len(chosen), is_node, is_group, bool(scene.chosen_wires()), bool(self.inside))
        menu = context_menu(self, self.actions_by_name, partial(self.open_search, event.pos()), what)
        if is_node:
            self.driving.offer(menu, scene.nodes[chosen[0]], place)
        menu.popup(event.globalPos())

    def _mouse(self) -> QPoint:
        """Where the mouse is in the view; the middle where it is elsewhere."""
        mouse = self.viewport().mapFromGlobal(self.cursor().pos())
        return mouse if self.viewport().rect().contains(mouse) else self.viewport().rect().center()

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
        frame = self.patch_scene.frame_at(place)
        if frame is not None and node is None and self.patch_scene.note_at(place) is None:
            self._take_frame(place, frame.group_now.members)
            return
        wire = None if node else self.patch_scene.wire_at(place)
        self.patch_scene.choose(wire)
        super().mousePressEvent(event)

    def _take_frame(self, place: QPointF, members: tuple[str, ...]) -> None:
        """A group is taken by its title: what is in it is selected, and follows the mouse."""
        scene = self.patch_scene
        seen = {scene.level.stands[member] for member in members}
        scene.select(seen)
        self._frame = (place, [(item, item.pos()) for id, item in scene.movable().items() if id in seen])

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place = self.mapToScene(event.position().toPoint())
        if self._pan is not None:
            by = event.position().toPoint() - self._pan
            self._pan = event.position().toPoint()
            self.pan(-by.x(), -by.y())
        elif self._wire is not None:
            self._wire.move(place)
            if self._wire.reason != self.said:
                self.say(self._wire.reason)
        elif self._frame is not None:
            start, items = self._frame
            by_px = QPointF(*snapped(place.x() - start.x(), place.y() - start.y()))
            for item, at in items:
                item.setPos(at + by_px)
            self.patch_scene.adjust_frames()
        else:
            super().mouseMoveEvent(event)
            if self.patch_scene.mouseGrabberItem() is not None:
                self.patch_scene.adjust_frames()
                self.patch_scene.offer(self._wire_under_dragged())

    def _wire_under_dragged(self) -> WireItem | None:
        """The wire that the one dragged node, which has none of its own, would be put into."""
        item = self.patch_scene.mouseGrabberItem()
        if not isinstance(item, NodeItem) or isinstance(item, BlockItem) or item.wires:
            return None
        if len(self.patch_scene.selectedItems()) != 1:
            return None
        return self.patch_scene.wire_for(item.node.type, item_rect(item))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._pan is not None:
            self._pan = None
            self.viewport().unsetCursor()
            return
        if self._wire is not None:
            self._let_go(event.position().toPoint())
            return
        wire = self._wire_under_dragged()
        super().mouseReleaseEvent(event)
        self._frame = None
        self.patch_scene.offer(None)
        places = self.patch_scene.places()
        if places:
            patch = self.document.patch.move(places)
            if wire is not None and len(places) == 1:
                self.insert(patch, next(iter(places)), wire.wire)
            else:
                self.document.edit(patch, f"Move {self._words(self.patch_scene.members(places))}")

    def _let_go(self, at: QPoint) -> None:
        """The wire in the hand is released: on a port, in the open, or nowhere."""
        drag, self._wire = self._wire, None
        assert drag is not None
        result, place = drag.result(self.document.patch), self.mapToScene(at)
        if result is None and drag.is_loose(place):
            # It hangs from its port until something is chosen; the list closed without a choice, all is as it was.
            self._hanging = drag
            end, side = drag.end_name, drag.placed.side
            fitting = types_that_fit(self.registry, port_of(self.document.patch, self.registry, end, side), side)
            first = "Remove the wire" if drag.old else ""
            self._open_list(at, Wanted(place, (end, side), drag.old), fitting, first, "Connect to a new node")
            return
        drag.end()
        if result is not None:
            self.document.edit(*result)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        place, scene = self.mapToScene(event.position().toPoint()), self.patch_scene
        node, note = scene.node_at(place, 6.0), scene.note_at(place)
        frame = scene.frame_at(place)
        if event.button() != Qt.MouseButton.LeftButton:
            super().mouseDoubleClickEvent(event)
        elif isinstance(node, BlockItem) and not self._on_title(node, place):
            self.look_into(node.node.id)
        elif node is not None and self._on_title(node, place):
            self.edit_title(node.node.id)
        elif node is not None:
            super().mouseDoubleClickEvent(event)
        elif note is not None:
            self.edit_note(note.note.id)
        elif frame is not None:
            self.edit_title(frame.group_now.id)
        else:
            self.open_search(event.position().toPoint())

    @staticmethod
    def _on_title(node: NodeItem, place: QPointF) -> bool:
        return QRectF(node.pos().x(), node.pos().y(), node.shape_now.width, TITLE).contains(place)

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.zoom(STEP ** (event.angleDelta().y() / 120.0), event.position().toPoint())
        event.accept()

    # --- drops from the palette ---

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()
            self.patch_scene.offer(self._wire_at_drop(event))

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        self.patch_scene.offer(None)

    def dropEvent(self, event: QDropEvent) -> None:
        type = _dropped(event)
        wire = self._wire_at_drop(event)
        self.patch_scene.offer(None)
        if type in self.registry:
            event.acceptProposedAction()
            self.add(type, self.mapToScene(event.position().toPoint()), into=wire.wire if wire else None)
            self.setFocus()

    def _wire_at_drop(self, event: QDropEvent) -> WireItem | None:
        type, place = _dropped(event), self.mapToScene(event.position().toPoint())
        if type not in self.registry or self.patch_scene.node_at(place) is not None:
            return None
        return self.patch_scene.wire_for(type, QRectF(place.x() - AIM, place.y() - AIM, 2 * AIM, 2 * AIM))

    # --- keys ---

    def event(self, event: QEvent) -> bool:
        # Escape belongs to the canvas while there is something to be put back on it.
        if asks_for_escape(event) and self._has_open():
            event.accept()
            return True
        return super().event(event)

    def _has_open(self) -> bool:
        """Whether something is in the hand, or opened for a moment."""
        nodes = self.patch_scene.nodes.values()
        return self._wire is not None or self._is_dragging() or any(node.opened for node in nodes)

    def _is_dragging(self) -> bool:
        return self._frame is not None or (
            self.patch_scene.mouseGrabberItem() is not None and bool(self.patch_scene.places())
        )

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space:
            # Held, it lets the left button move the view; let go again, it is what Space is everywhere.
            if not event.isAutoRepeat():
                self._space = "down"
        elif event.key() == Qt.Key.Key_Escape:
            self._escape()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.enter()
        elif event.key() in _ARROWS:
            dx, dy = _ARROWS[Qt.Key(event.key())]
            if self.patch_scene.selected():
                far = 4 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1
                self.nudge(dx * far, dy * far)
            else:
                self.pan(64 * dx, 64 * dy)
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            if self._space == "down":
                self.play_wanted.emit()
            self._space = ""
        else:
            super().keyReleaseEvent(event)

    def _escape(self) -> None:
        self.say("")
        if self._wire is not None:
            self._wire.end()
            self._wire = None
        elif self._is_dragging():
            self._put_back()
        elif any(node.opened for node in self.patch_scene.nodes.values()):
            for node in self.patch_scene.nodes.values():
                node.set_ports(node.driven, False)
        else:
            self.patch_scene.choose(None)
            self.patch_scene.select([])

    def _put_back(self) -> None:
        """What is being dragged goes back to where it was."""
        self._frame = None
        grabber = self.patch_scene.mouseGrabberItem()
        if grabber is not None:
            grabber.ungrabMouse()
        self.patch_scene.offer(None)
        for item in self.patch_scene.blocks_and_nodes():
            item.setPos(*item.node.at)
        for note in self.patch_scene.notes.values():
            note.setPos(*note.note.at)
        self.patch_scene.adjust_frames()

    def step_selection(self, by: int) -> None:
        """Select the next thing in the order of the patch, and bring it into view."""
        ids = list(self.patch_scene.movable())
        if ids:
            now = self.patch_scene.selected()
            at = ids.index(now[-1]) + by if now else (0 if by > 0 else -1)
            self.patch_scene.select([ids[at % len(ids)]])
            self.bring(self.patch_scene.selected())

    def _selection_changed(self) -> None:
        if not all(map(isValid, self.patch_scene.movable().values())):
            return  # the scene is being taken down, and says so once more
        ids = self.selected_ids()
        self._nudges += 1
        for id, node in self.patch_scene.nodes.items():
            if node.opened and id not in ids:
                node.set_ports(node.driven, False)
        self.map.update()
        self.selected.emit(ids)


def _dropped(event: QDropEvent) -> str:
    return bytes(event.mimeData().data(MIME).data()).decode(errors="replace")
