"""The canvas, on which a patch is edited by mouse and keys. It turns events into edits of the document."""

from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QAction, QContextMenuEvent, QFocusEvent, QHideEvent, QKeyEvent, QKeySequence, QMouseEvent
from PySide6.QtWidgets import QWidget
from shiboken6 import isValid

from underfoot.patch.grouping import put_into
from underfoot.patch.groups import COLOURS
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire
from underfoot.widgets.controls.arrow_keys import ARROWS
from underfoot.widgets.controls.menu import Shortcut, add_action
from underfoot.widgets.design.asking_view import AskingView
from underfoot.widgets.design.connecting import WireDrag
from underfoot.widgets.design.context_menu import Selection, context_menu
from underfoot.widgets.design.edge_scrolling import EdgeScrolling
from underfoot.widgets.design.frame_drag import FrameDrag
from underfoot.widgets.design.group_items import GroupFrameItem, GroupNodeItem, NoteItem, item_rect
from underfoot.widgets.design.items import MIN_LEGIBLE_SCALE, NodeItem, WireItem
from underfoot.widgets.design.node_geometry import PAD, TITLE
from underfoot.widgets.design.note_width import NoteWidth
from underfoot.widgets.design.patch_view import ZOOM_STEP
from underfoot.widgets.design.rewiring import sum_of
from underfoot.widgets.design.spoken_selection import spoken_selection
from underfoot.widgets.design.stepping import Stepping
from underfoot.widgets.design.undo import Document
from underfoot.widgets.design.wire_cut import WireCut
from underfoot.widgets.escape import claims_escape

_CONTROL = Qt.KeyboardModifier.ControlModifier
_EXTENDING = Qt.KeyboardModifier.ShiftModifier | _CONTROL
_COPYING = Qt.KeyboardModifier.AltModifier
_NO_KEYS = Qt.KeyboardModifier.NoModifier
_VIEW_ACTIONS = ("frame", "frame all", "zoom in", "zoom out", "actual size")
"""Actions that only move the view, also during a drag."""


class Canvas(AskingView):
    """Shows the document's patch, and edits it."""

    play_requested = Signal()
    """Space was pressed: stop if playing, else play."""
    audition_requested = Signal(str)
    """A node whose button was pressed, to play it alone."""

    # Of the class: the patch is shown before a canvas is made.
    _pressed_at = QPointF()
    _drag: WireDrag | FrameDrag | NoteWidth | WireCut | None = None
    _cuts = False

    def __init__(self, document: Document, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(document, registry, parent)
        self._pan: QPoint | None = None
        self._space_state = ""
        self._stepping = Stepping(self)
        self.edge_scrolling = EdgeScrolling(self, self._is_held)
        self.actions_by_name = self._make_actions()
        self.patch_scene.selectionChanged.connect(self._selection_changed)

    def _make_actions(self) -> dict[str, QAction]:
        """Return the actions of the canvas by name; their keys work while it has the focus."""
        key, step, align = QKeySequence.StandardKey, self._stepping.step, "Ctrl+Shift+"
        actions: Sequence[tuple[str, str, Shortcut, Callable[[], object]]] = (
            ("add", "Add a node…", ("/", "Insert"), self.open_search),
            ("note", "Add a note", "T", lambda: self.add_note(self.mapToScene(self._mouse_position()))),
            ("rename", "Rename…", "F2", self.rename),
            ("replace", "Replace by…", "R", self.open_replacements),
            ("group", "Group", "Ctrl+G", self.group),
            ("ungroup", "Ungroup", "Ctrl+Shift+G", self.ungroup),
            ("take out", "Take out of the group", "Shift+G", self.take_out),
            ("collapse", "Collapse to a sub-patch, or open it", "Ctrl+E", self.collapse),
            ("enter", "Look into the sub-patch", (), self.enter),
            ("leave", "Back out of the sub-patch", ("U", "Alt+Up"), self.leave_group),
            ("tidy", "Tidy up", "Ctrl+L", self.tidy),
            ("cut", "Cut", key.Cut, self.cut),
            ("copy", "Copy", key.Copy, self.copy),
            ("paste", "Paste", key.Paste, self.paste),
            ("duplicate", "Duplicate", "Ctrl+D", self.duplicate),
            ("duplicate fed", "Duplicate with input wires", "Ctrl+Shift+D", partial(self.duplicate, with_inputs=True)),
            ("delete", "Delete", ("Delete", "Backspace"), self.delete),
            ("select all", "Select all", key.SelectAll, self.select_all),
            ("find", "Find…", key.Find, lambda: self.item_search.ask()),
            ("next", "Next node", "N", partial(step, 1)),
            ("previous", "Previous node", "Shift+N", partial(step, -1)),
            ("keep", "Keep selected, and go on to another", "K", self._stepping.keep),
            ("connect", "Connect…", "C", self.open_connections),
            ("frame", "Fit selection to view", "F", self.fit_view),
            ("frame all", "Fit all to view", "Home", partial(self.fit_view, all_nodes=True)),
            ("zoom in", "Zoom in", ("+", "="), partial(self.zoom, ZOOM_STEP)),
            ("zoom out", "Zoom out", "-", partial(self.zoom, 1.0 / ZOOM_STEP)),
            ("actual size", "Actual size", "0", partial(self.zoom_to, 1.0)),
            ("align left", "Left edges in line", f"{align}Left", partial(self.align, "left")),
            ("align right", "Right edges in line", f"{align}Right", partial(self.align, "right")),
            ("align top", "Top edges in line", f"{align}Up", partial(self.align, "top")),
            ("align bottom", "Bottom edges in line", f"{align}Down", partial(self.align, "bottom")),
            ("align across", "Equal horizontal gaps", f"{align}H", partial(self.align, "across")),
            ("align down", "Equal vertical gaps", f"{align}V", partial(self.align, "down")),
            *((f"colour {name}", name.capitalize(), (), partial(self.paint_group, name)) for name in COLOURS),
        )
        return {name: add_action(self, text, keys, partial(self._act, name, do)) for name, text, keys, do in actions}

    def _act(self, name: str, do: Callable[[], object]) -> None:
        """Do what a key or a menu asks for. What is held is let go first: it is not where it is, and may go."""
        if name not in _VIEW_ACTIONS and self._is_held():
            self._cancel_drag()
        do()

    # --- menu ---

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if event.reason() == QContextMenuEvent.Reason.Mouse and self._cuts:
            return  # Control may be up: Windows asks for the menu as the button is
        if self._is_held():
            self._cancel_drag()  # a menu would take the release of the left button
            return
        place, scene = self.mapToScene(event.pos()), self.patch_scene
        if event.reason() == QContextMenuEvent.Reason.Keyboard and (asked := scene.selected()):
            # The key's own place is the middle of the view, whatever lies there.
            self.ensure_visible(asked)
            item: NodeItem | NoteItem | None = (first := scene.movable()[asked[0]])
            place = first.pos() + QPointF(PAD, TITLE / 2)
        else:
            item = scene.node_at(place) or scene.note_at(place)
        at = self.mapFromScene(place)
        frame = scene.group_frame_at(place) if item is None else None
        if item is not None and not item.isSelected():
            scene.select([id for id, other in scene.movable().items() if other is item])
        elif frame is not None:
            scene.select({scene.group_view.shown_as[member] for member in frame.shown_group.members})
        elif item is None and (wire := scene.wire_at(place)) is not None and not wire.chosen:
            scene.select(())
            scene.choose(wire)
        chosen = scene.selected()
        is_node = len(chosen) == 1 and chosen[0] in scene.nodes
        is_framed = any(self._frame_of([id]) for id in chosen)
        is_group = any(id in scene.group_nodes for id in chosen) or bool(self._frame_of(chosen))
        is_sub_patch = len(chosen) == 1 and chosen[0] in scene.group_nodes
        kinds = is_node, is_group, is_framed, is_sub_patch, self.joinable_groups()
        what = Selection(len(chosen), *kinds, bool(scene.chosen_wires()), bool(self.inside))
        here: dict[str, Callable[[], object]] = {
            "add": partial(self.open_search, at),
            "note": partial(self.add_note, place),
            "paste": partial(self.paste, place),
            "rename": partial(self.edit_title, frame.shown_group.id) if frame else self.rename,
        }
        menu = context_menu(self, self.actions_by_name, here, self.join, what)
        if is_node:
            self.driver_menus.add_menu(menu, scene.nodes[chosen[0]], place)
        menu.open_once(self.viewport().mapToGlobal(at))

    # --- mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        button = event.button()
        self._nudges += 1
        self._pan = None  # the release of the middle button may have gone elsewhere
        self._cuts = button == Qt.MouseButton.RightButton and bool(event.modifiers() & _CONTROL)
        if button == Qt.MouseButton.MiddleButton or (button == Qt.MouseButton.LeftButton and self._space_state):
            self._pan = event.position().toPoint()
            self._space_state = "used" if self._space_state else ""
            self.viewport().setCursor(Qt.CursorShape.ClosedHandCursor)
        elif button == Qt.MouseButton.LeftButton and not isinstance(self._drag, WireCut):
            self._press(event)
        elif self._cuts and not self._is_held():
            self._drag = WireCut(self.patch_scene, self.mapToScene(event.position().toPoint()))

    def _press(self, event: QMouseEvent) -> None:
        """Begin to drag the wire of a port, or a frame, or use the button of a node; all else is Qt's."""
        if self._is_held():
            self._cancel_drag()  # its release went elsewhere
        scene, place = self.patch_scene, self.mapToScene(event.position().toPoint())
        self._pressed_at = place
        port, node = scene.port_at(place), scene.node_at(place, 6.0)
        note = scene.note_at(place) if node is None else None
        frame = scene.group_frame_at(place) if node is None and note is None else None
        if port is not None:
            self.show_message("")
            self._drag = WireDrag(scene, *port)
            self._drag.move(place)
        elif node is not None and node.more_at(place):
            node.set_ports(node.driven, shows_all=True)
        elif node is not None and self.transform().m11() >= MIN_LEGIBLE_SCALE and node.button_at(place):
            self.audition_requested.emit(node.node.id)
        elif frame is not None:
            self._drag = FrameDrag(scene, frame, place, extends=bool(event.modifiers() & _EXTENDING))
        elif note is not None and note.edge_at(place):
            self._drag = NoteWidth(scene, note, place, extends=bool(event.modifiers() & _EXTENDING))
        else:
            wire, extends = None if node else scene.wire_at(place), bool(event.modifiers() & _EXTENDING)
            if wire is not None or not extends:
                scene.choose(wire, extends=extends)
            super().mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place = self.mapToScene(event.position().toPoint())
        button = Qt.MouseButton.LeftButton if self._drag is None else self._drag.button
        if self._is_held() and not event.buttons() & button:
            self._cancel_drag()  # a dialog or another window took the release
        if self._pan is not None and not event.buttons():
            self._pan = None
            self.viewport().unsetCursor()
        if self._pan is not None:
            by = event.position().toPoint() - self._pan
            self._pan = event.position().toPoint()
            self.pan(-by.x(), -by.y())
        elif self._drag is not None:
            self._drag.move(place)
            self._show_whether_copied(event)
            if isinstance(self._drag, WireDrag) and self._drag.reason != self.message:
                self.show_message(self._drag.reason)
        else:
            super().mouseMoveEvent(event)
            if self.patch_scene.mouseGrabberItem() is not None:
                self.patch_scene.adjust_group_frames()
                wire = None if event.modifiers() & _COPYING else self._wire_under_dragged()
                self.patch_scene.highlight(wire, self._frame_entered(place))
                self._show_whether_copied(event)

    def _show_whether_copied(self, event: QMouseEvent) -> None:
        """Show by the mouse whether what is dragged stays, and a copy of it goes where it is let go."""
        if event.modifiers() & _COPYING and self.patch_scene.places():
            self.viewport().setCursor(Qt.CursorShape.DragCopyCursor)
        elif self.viewport().cursor().shape() == Qt.CursorShape.DragCopyCursor:
            self.viewport().unsetCursor()

    def _wire_under_dragged(self) -> WireItem | None:
        """Return the wire into which the dragged node would be inserted; only a single unwired node can be."""
        item = self.patch_scene.mouseGrabberItem()
        if not isinstance(item, NodeItem) or isinstance(item, GroupNodeItem) or item.wires:
            return None
        if len(self.patch_scene.selectedItems()) != 1:
            return None
        return self.patch_scene.wire_for(item.node.type, item_rect(item))

    def _frame_entered(self, place: QPointF) -> GroupFrameItem | None:
        """Return the frame of the group into which something is dragged; whole frames stay as they are."""
        scene = self.patch_scene
        moved = set(scene.members(scene.places()))
        opened = (group for group in scene.group_view.opened if moved >= set(group.members))
        if not moved or any(opened):
            return None
        frame = scene.frame_around(place, without=moved)
        return None if frame is None or frame.frame_rect().contains(self._pressed_at) else frame

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        at = event.position().toPoint()
        if self._pan is not None:
            self._pan = None
            self.viewport().unsetCursor()
            if not self._is_held():
                return
        if self._drag is not None and event.button() == self._drag.button:
            drag, self._drag = self._drag, None
            if isinstance(drag, WireDrag):
                self._drop_wire(drag, event)
            elif (edit := drag.end()) is not None:
                self.document.edit(*edit)
            self._drop_items(None, None, event)
        elif event.button() != Qt.MouseButton.LeftButton:
            return
        else:
            wire, frame = self._wire_under_dragged(), self._frame_entered(self.mapToScene(at))
            super().mouseReleaseEvent(event)
            self.patch_scene.highlight()
            self._drop_items(wire, frame, event)
        self.viewport().unsetCursor()

    def _drop_items(self, wire: WireItem | None, frame: GroupFrameItem | None, event: QMouseEvent) -> None:
        """Edit the places of what was dragged, if anything was; it goes into this wire, or into this frame's group. If
        it is copied, it stays where it was.
        """
        places = self.patch_scene.places()
        if not places:
            return
        members = self.patch_scene.members(places)
        if event.modifiers() & _COPYING:
            self._put_back()
            id, (x, y) = next(iter(places.items()))
            was = self.patch_scene.movable()[id].pos()
            place, into = self.mapToScene(event.position().toPoint()), frame.shown_group.id if frame else ""
            self.copy_moved(members, (x - was.x(), y - was.y()), place, into)
            return
        patch, what = self.document.patch.move(places), f"Move {self._count_text(members)}"
        if frame is not None:
            group = frame.shown_group
            patch, what = put_into(patch, members, group.id), f"{what} into {group.title or 'the group'}"
        if wire is not None and len(places) == 1:
            self.insert(patch, next(iter(places)), wire.wire)
        else:
            self.document.edit(patch, what)

    def _drop_wire(self, drag: WireDrag, event: QMouseEvent) -> None:
        """End the drag of a wire on a port, on the empty canvas, or elsewhere; a wire that was clicked beside a port is
        selected.
        """
        at, scene = event.position().toPoint(), self.patch_scene
        result, place = drag.result(self.document.patch), self.mapToScene(at)
        if result is None and drag.is_loose(place):
            self.search.ask_for_end(at, place, (drag.end_name, drag.placed.side), drag)
            return
        drag.end()
        adds = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if place == self._pressed_at and (clicked := scene.wire_at(place)) is not None:
            extends = bool(event.modifiers() & _EXTENDING)
            if not extends:
                scene.select(())
            scene.choose(clicked, extends=extends)
        elif (wire := drag.wire()) is not None and (result is not None or (drag.is_mapped and adds)):
            self._connect_by(drag, result, wire, adds=adds)

    def _connect_by(self, drag: WireDrag, result: Patch | None, wire: Wire, *, adds: bool) -> None:
        """Edit the patch to the result of a drag, or without one by a Map. If the input has a wire, that gives way,
        unless the drag `adds`.
        """
        if result is None:
            self.connect_by_map(*wire, drag.old)
        elif adds and drag.displaced(self.document.patch) and sum_of(self.registry, drag.placed.port.kind):
            self.add_up(*wire, drag.old)
        else:
            self._connect(result, *wire)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        place, scene = self.mapToScene(event.position().toPoint()), self.patch_scene
        node, note = scene.node_at(place, 6.0), scene.note_at(place)
        frame = scene.group_frame_at(place)
        if event.button() != Qt.MouseButton.LeftButton:
            super().mouseDoubleClickEvent(event)
        elif isinstance(node, GroupNodeItem) and not self._on_title(node, place):
            self.open_group(node.node.id)
        elif node is not None and self._on_title(node, place):
            self.edit_title(node.node.id)
        elif node is not None:
            super().mouseDoubleClickEvent(event)
        elif note is not None:
            self.edit_note(note.note.id)
        elif frame is not None:
            self.edit_title(frame.shown_group.id)
        else:
            self.open_search(event.position().toPoint())

    @staticmethod
    def _on_title(node: NodeItem, place: QPointF) -> bool:
        return QRectF(node.pos().x(), node.pos().y(), node.geometry.width, TITLE).contains(place)

    # --- keys ---

    def event(self, event: QEvent) -> bool:
        # Escape goes to the canvas while it has something to cancel.
        return claims_escape(event, self._has_open) or super().event(event)

    def _has_open(self) -> bool:
        """Return whether a drag, an editor or a list is active."""
        return self._is_dragging() or any(node.shows_all_ports for node in self.patch_scene.nodes.values())

    def _is_held(self) -> bool:
        """Return whether a button holds something, moved or not."""
        return self._is_dragging() or self.patch_scene.mouseGrabberItem() is not None

    def _is_dragging(self) -> bool:
        """Return whether a wire, a frame, an edge, a rubber band, a node or note is dragged, or wires are being cut."""
        dragged = any((self._drag, self.has_band))
        return dragged or (self.patch_scene.mouseGrabberItem() is not None and bool(self.patch_scene.places()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space:
            # While Space is held, the left button pans the view; a single press acts as everywhere else.
            if not event.isAutoRepeat():
                self._space_state = "down"
        elif event.key() == Qt.Key.Key_Escape:
            self._escape()
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.enter()
        elif event.key() in ARROWS:
            right, up = ARROWS[Qt.Key(event.key())]
            if self.patch_scene.selected():
                steps = 4 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1
                self._act("nudge", partial(self.nudge, right * steps, -up * steps))
            else:
                self.pan(64 * right, -64 * up)
        else:
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            if self._space_state == "down":
                self.play_requested.emit()
            self._space_state = ""
        else:
            super().keyReleaseEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._space_state = ""  # it may come up elsewhere

    def _escape(self) -> None:
        self.show_message("")
        if self._is_dragging():
            self._cancel_drag()
        elif any(node.shows_all_ports for node in self.patch_scene.nodes.values()):
            self.patch_scene.close_ports()
        else:
            self.patch_scene.select([])

    def _cancel_drag(self) -> None:
        """Cancel the drag, and restore the previous positions, selection and view."""
        self.end_band()
        if self._drag is not None:
            self._drag.end()
            self._drag = None
        if self.patch_scene.mouseGrabberItem() is not None:
            # As if the button came up: else Qt moves the next node from where this one was.
            at, none = QPointF(self.viewport().mapFromGlobal(self.cursor().pos())), Qt.MouseButton.NoButton
            up = QMouseEvent(QEvent.Type.MouseButtonRelease, at, at, Qt.MouseButton.LeftButton, none, _NO_KEYS)
            chosen = self.patch_scene.selected()
            super().mouseReleaseEvent(up)
            if self.patch_scene.selected() != chosen:  # it was no click, which would select one of several
                self.patch_scene.select(chosen)
        self.patch_scene.highlight()
        self.viewport().unsetCursor()
        self._put_back()
        self.edge_scrolling.undo()

    def _put_back(self) -> None:
        """Put what is dragged back to where the patch has it."""
        for item in self.patch_scene.nodes_and_group_nodes():
            item.setPos(*item.node.at)
        for note in self.patch_scene.notes.values():
            note.setPos(*note.note.at)
        self.patch_scene.adjust_group_frames()

    def _show_level(self, group: str) -> None:
        if self._is_held():
            self._cancel_drag()  # by a key the patch is edited meanwhile, and what is held may be gone
        super()._show_level(group)
        self.setAccessibleDescription(spoken_selection(self.patch_scene))  # a selected node may be named, or wired

    def hideEvent(self, event: QHideEvent) -> None:
        self._cancel_drag()
        super().hideEvent(event)

    def _selection_changed(self) -> None:
        if not all(map(isValid, self.patch_scene.movable().values())):
            return  # a last signal while the scene is being deleted
        ids = self.selected_ids()
        self._nudges += 1
        self._stepping.forget()
        self.patch_scene.close_ports(without=ids)
        self.map.update()
        self.setAccessibleDescription(spoken_selection(self.patch_scene))
        self.selected.emit(ids)
