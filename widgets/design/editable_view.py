"""Editing commands of the canvas, except for dragging; each is one undo step."""

from collections.abc import Callable, Collection, Sequence
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import QPointF, QRect, QRectF, Signal
from PySide6.QtWidgets import QApplication, QWidget

from underfoot.errors import BadFile, BadValue
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.grouping import put_into, ungrouped
from underfoot.patch.groups import Note, chain
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire, node_id
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.inline_edit import InlineEdit
from underfoot.widgets.controls.local_files import local_files
from underfoot.widgets.design.making_room import shift_clear, tidied, with_room
from underfoot.widgets.design.node_geometry import FIRST_PORT, TITLE, description_of, node_geometry
from underfoot.widgets.design.patch_editing import (
    Place,
    aligned,
    disconnection,
    name_of_file,
    pasted,
    port_of,
    readers,
    refusal,
    snapped,
    unit_hint,
    wire_at,
    with_names,
)
from underfoot.widgets.design.patch_view import PatchView
from underfoot.widgets.design.placing import GAP_BESIDE, Box, backwards
from underfoot.widgets.design.rewiring import (
    connected,
    fed_alike,
    inserted,
    removed_and_bridged,
    replaced,
    sum_of,
    waiting_hint,
    wired,
)
from underfoot.widgets.design.undo import Document

NOTE_ROOM = 200.0, 96.0
"""Width and height of the place that a new note takes."""


class EditableView(PatchView):
    """Edits the patch that it shows, by commands. `GroupingView` has those on groups."""

    selected = Signal(list)
    """The ids of the selected nodes."""
    files_pasted = Signal(list)
    """Paths of the files on the clipboard, to be opened."""

    def __init__(self, document: Document, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(document, registry, parent)
        self._nudges = 0
        self.folder: Path | None = None
        """The patch's folder, to which its files are relative."""
        self.inline = InlineEdit(self)
        self._written_on = QRectF()
        self.view_moved.connect(lambda: self.inline.put_over(self._over(self._written_on)))
        document.changed.connect(lambda: self.inline.finish(commit=False))  # what it names may be gone, or another's

    def selected_ids(self) -> list[str]:
        """Return the selected nodes, including those in collapsed groups, in the order of the patch."""
        return self.patch_scene.selected_ids()

    def select_all(self) -> None:
        """Select everything."""
        self.patch_scene.select(self.patch_scene.movable())

    def _members(self) -> list[str]:
        """Return the selected nodes and notes, including those in collapsed groups."""
        return self.patch_scene.members(self.patch_scene.selected())

    def _members_for(self, what: str) -> list[str]:
        """Return the selected nodes and notes; without any, ask for some to `what`, such as "copy"."""
        members = self._members()
        if not members:
            self.show_message(f"Select what to {what}")
        return members

    # --- adding ---

    def add(
        self,
        type: str,
        place: QPointF | None = None,
        from_port: tuple[str, str] | None = None,
        old_wire: Wire | None = None,
        into: Wire | None = None,
    ) -> None:
        """Add a node with its title under `place`, or in the centre of the view, and select it.

        `from_port` (name, and "in" or "out") is connected to the node, instead of `old_wire`: its first port on that
        side is at `place`. `into` is a wire into which the node is inserted.
        """
        scene, place = self.patch_scene, self._middle() if place is None else place
        patch = self.document.patch.disconnect([old_wire]) if old_wire else self.document.patch
        around = self._group_of(into) if into else self._group_at(place)
        side = from_port[1] if from_port else ""
        box = self._box_at(type, place, side)
        dx, dy = (0.0, 0.0) if into else shift_clear(scene, [box], around, avoided=backwards(box, side))
        after = patch.add(type, self.registry, (box[0] + dx, box[1] + dy), **self.registry[type].initial)
        id = after.nodes[-1].id
        after = put_into(after, [id], around) if around else after
        if into is not None:
            after = inserted(with_room(scene, after, id, into, around), self.registry, id, into)
        if from_port is not None:
            after = connected(after, self.registry, id, *from_port)
        word = "Insert" if into and into not in after.wires else "Add"
        self.document.edit(after, f"{word} {self.registry[type].label}")
        scene.select([id])
        self.ensure_visible([id])

    def _box_at(self, type: str, place: QPointF, side: str) -> Box:
        """Return the box of a new node with its title at a place, or a port, for a wire from `side` of another node."""
        shape = node_geometry(description_of(self.registry[type]))
        left, top = {"": (16.0, TITLE / 2), "out": (0.0, FIRST_PORT), "in": (shape.width, FIRST_PORT)}[side]
        return *snapped(place.x() - left, place.y() - top), shape.width, shape.height

    def _middle(self) -> QPointF:
        """Return the place of a node in the centre of the view."""
        return self.mapToScene(self.viewport().rect().center()) - QPointF(48.0, 28.0)

    def _group_at(self, place: QPointF) -> str:
        """Return the group whose frame is around a place, or else the open one."""
        frame = self.patch_scene.frame_around(place)
        return frame.shown_group.id if frame else self.inside

    def _group_of(self, wire: Wire) -> str:
        """Return the innermost group that contains both ends of a wire; of one that leaves the open sub-patch, that."""
        nodes, groups = {node_id(end) for end in wire}, self.document.patch.groups
        around = [group.id for group in groups if nodes <= set(group.members)]
        return around[-1] if around and self.inside in ("", *chain(groups, around[-1])) else self.inside

    def insert(self, patch: Patch, id: str, wire: Wire) -> None:
        """Insert a node of this patch into a wire, after it was dropped there."""
        around = self._group_of(wire)
        if around and not any(id in group.members for group in patch.groups):
            patch = put_into(patch, [id], around)
        patch = with_room(self.patch_scene, patch, id, wire, around)
        after = inserted(patch, self.registry, id, wire)
        self.document.edit(after, f"Insert {self._name(id)}")
        self.show_message(waiting_hint(patch, after, self.registry, id), alarm=False)

    def replace(self, type: str) -> None:
        """Replace the selected node by one of another type; compatible wires and parameters are kept."""
        ids = self.selected_ids()
        if len(ids) == 1:
            before = self._name(ids[0])
            after, id, lost = replaced(self.document.patch, self.registry, ids[0], type)
            self.document.edit(after, f"Replace {before} by {self.registry[type].label}")
            self.patch_scene.select([id])
            if lost:
                self.show_message(f"{counted(lost, 'wire')} did not fit {self.registry[type].label}; undo restores all")

    def add_note(self, place: QPointF) -> None:
        """Ask for the text of a note, and add it; without a text there is none."""
        around, (x, y) = self._group_at(place), snapped(place.x(), place.y())
        dx, dy = shift_clear(self.patch_scene, [(x, y, *NOTE_ROOM)], around)
        note = Note(self.document.patch.free_id("note"), "", (x + dx, y + dy))

        def add(text: str) -> bool:
            if not text:
                return True
            patch = self.document.patch
            after = replace(patch, notes=(*patch.notes, replace(note, text=text)))
            if not self._edit_text(put_into(after, [note.id], around) if around else after, "Add a note"):
                return False
            self.patch_scene.select([note.id])
            return True

        self._open_field(QRectF(*note.at, *NOTE_ROOM), "", add, one_line=False)

    # --- clipboard ---

    def delete(self) -> None:
        """Delete the selected items and the selected wire; wires through a deleted node are bridged."""
        wires = self.patch_scene.chosen_wires()
        if wires or self._members_for("delete"):
            self._remove_selected(self.document.patch.disconnect(wires), "Delete", disconnection(len(wires)))

    def cut_wire(self, wire: Wire) -> None:
        """Remove this wire, and nothing else."""
        self.document.edit(self.document.patch.disconnect([wire]), disconnection(1))

    def copy(self) -> None:
        """Copy the selected items, with the wires between them, to the clipboard."""
        members = self._members_for("copy")
        if members:
            QApplication.clipboard().setText(self._copied(members))

    def cut(self) -> None:
        """Copy the selected items, and delete them."""
        if self._members_for("cut"):
            self.copy()
            self._remove_selected(self.document.patch, "Cut", "Cut")

    def _remove_selected(self, patch: Patch, word: str, otherwise: str) -> None:
        gone = self._members()
        text = f"{word} {self._count_text(gone)}" if gone else otherwise
        self.document.edit(removed_and_bridged(patch, self.registry, gone), text)

    def paste(self, place: QPointF | None = None) -> None:
        """Add the items on the clipboard at a place, or else under a mouse over the canvas; of copied files, nodes that
        read them, or else open them.
        """
        files = local_files(QApplication.clipboard().mimeData())
        mouse = self.viewport().mapFromGlobal(self.cursor().pos())
        if place is None and self.viewport().rect().contains(mouse) and self.viewport().underMouse():
            place = self.mapToScene(mouse)
        if self._are_read(files):
            self.add_readers(files, place or self._middle())
        elif files:
            self.files_pasted.emit(files)
        else:
            group = self._group_at(place) if place is not None else self.inside
            self._paste(QApplication.clipboard().text(), place, "Paste", group)

    def _are_read(self, files: Sequence[Path]) -> bool:
        """Return whether these are files, and a node reads each."""
        return bool(files) and all(any(readers(self.registry, path)) for path in files)

    def add_readers(self, files: Sequence[Path], place: QPointF) -> None:
        """Add the nodes that read these files, with their names, below each other, the first at a place."""
        made, y = Patch(), 0.0
        try:
            for path in files:
                type, name = next(readers(self.registry, path))
                values = {**self.registry[type].initial, name: path.as_posix()}
                made = made.add(type, self.registry, snapped(0.0, y), **values)
                made = made.name(made.nodes[-1].id, name_of_file(path))
                y += node_geometry(description_of(self.registry[type])).height + GAP_BESIDE
        except BadValue as error:
            self.show_message(str(error))
        else:
            self._paste(made.dumps().decode(), place, "Add", self._group_at(place))

    def duplicate(self, *, with_inputs: bool = False) -> None:
        """Add a copy of the selected items beside them, in the group of which they are a part; `with_inputs`, it is fed
        from outside as they are.
        """
        members = self._members_for("duplicate")
        if members:
            fed = members if with_inputs else ()
            self._paste(self._copied(members), None, "Duplicate", self._groups_around(members)[-1], fed)

    def copy_moved(self, members: Sequence[str], by: Place, place: QPointF, into: str) -> None:
        """Add a copy of these nodes and notes, moved `by` and let go at `place`, to a group, or to the innermost of
        those of which they are a part whose frame is there.
        """
        boxes = self.patch_scene.boxes_in(self.document.patch, members, with_frames=True)
        corner = QPointF(min(box[0] for box in boxes), min(box[1] for box in boxes))
        frames = self.patch_scene.group_frames
        left = {id for id, frame in frames.items() if not frame.frame_rect().contains(place)}
        around = [id for id in self._groups_around(members) if id not in left]
        self._paste(self._copied(members), corner + QPointF(*by), "Duplicate", into or around[-1])

    def _groups_around(self, members: Sequence[str]) -> list[str]:
        """Return the open sub-patch, and the frames in it of which these are a part, the outer ones first."""
        groups = self.patch_scene.group_view.opened
        return [self.inside, *(group.id for group in groups if set(members) < set(group.members))]

    def _copied(self, members: Sequence[str]) -> str:
        """Return these items as text, without the sub-patch that is open, also if they are all of it. Their files have
        absolute paths: it may be pasted into a patch of another folder.
        """
        patch = with_files_kept(self.document.patch, self.registry, self.folder, None)
        return ungrouped(patch, chain(patch.groups, self.inside)).part(members).dumps().decode()

    def put_in(self, patch: Patch, title: str) -> None:
        """Add all of another patch, called `title`, in the centre of the view."""
        place = self._middle()
        self._paste(patch.dumps().decode(), place, f"Insert {title}:", self._group_at(place))

    def _paste(self, text: str, at: QPointF | None, what: str, group: str, fed: Collection[str] = ()) -> None:
        """Add the items in a text, at a place if one is given, to a group; copies of `fed` are fed as those are."""
        patch = self.document.patch
        try:
            after, ids = pasted(patch, text, self.registry, self.folder)
        except BadFile as error:
            self.show_message(str(error))
            return
        after = put_into(after, ids, group) if group else after
        if fed:  # copies are in the order of their originals
            originals = [node.id for node in patch.nodes if node.id in fed]
            after = fed_alike(after, self.registry, dict(zip(originals, ids[: len(originals)], strict=True)))
        boxes, x, y = self.patch_scene.boxes_in(after, ids, with_frames=True), 0.0, 0.0
        if at is not None:
            x, y = snapped(at.x() - min(box[0] for box in boxes), at.y() - min(box[1] for box in boxes))
        there = [(left + x, top + y, width, height) for left, top, width, height in boxes]
        dx, dy = shift_clear(self.patch_scene, there, group)
        new = {*ids, *(group.id for group in after.groups[len(patch.groups) :])}
        moved = [one for one in (*after.canvas_items(), *after.groups) if one.id in new]
        after = after.move({one.id: (one.at[0] + x + dx, one.at[1] + y + dy) for one in moved})
        self.document.edit(after, f"{what} {self._count_text(ids, after)}")
        self.patch_scene.select({self.patch_scene.group_view.shown_as[id] for id in ids})
        self.ensure_visible(self.patch_scene.selected())

    # --- wires and places ---

    def connect_ports(self, source: str, target: str) -> None:
        """Connect two ports by a wire, or show why that is not allowed."""
        if reason := refusal(self.document.patch, self.registry, source, target):
            self.show_message(reason)
        else:
            self._connect(wired(self.document.patch, self.registry, source, target), source, target)

    def _connect(self, after: Patch, source: str, target: str) -> None:
        """Set the patch, which has this wire now, and say what that brings if it may not be what is wanted."""
        before = self.document.patch
        self.document.edit(after, "Connect")
        adding = sum_of(self.registry, port_of(after, self.registry, source, "out").kind)
        gave_way = self._gave_way(before, target, adding)
        hint = unit_hint(after, self.registry, source, target)
        hint = hint or waiting_hint(before, after, self.registry, node_id(target))
        self.show_message(gave_way or hint, alarm=bool(gave_way))

    def _gave_way(self, before: Patch, target: str, adding: str = "") -> str:
        """Return what to say of the wire that an input had before, and how a node of type `adding` would keep it; "" if
        it had none, or has it still.
        """
        old = wire_at(before, target)
        if old is None or old in self.document.patch.wires:
            return ""
        way = f" With Shift, or by C, {self.registry[adding].label} adds both." if adding else ""
        return f"The wire from {with_names(before, self.registry, old[0])} gave way: an input takes one.{way}"

    def align(self, side: str) -> None:
        """Align the selected items: "left", "right", "top", "bottom", or distribute them "across" or "down"."""
        scene = self.patch_scene
        places = {id: (item.pos().x(), item.pos().y()) for id, item in scene.movable().items() if item.isSelected()}
        if len(places) < 2:
            self.show_message("Select several nodes to align")
            return
        moved = aligned(places, side, scene.sizes())
        self.document.edit(self.document.patch.move(moved), f"Align {counted(len(places), 'node')}")

    def nudge(self, dx: int, dy: int) -> None:
        """Move the selected items by steps of the grid, in view; consecutive steps are one undo step."""
        chosen = self.patch_scene.selected()
        there = self.patch_scene.movable()
        x, y = dx * theme.GRID, dy * theme.GRID
        places = {id: (there[id].pos().x() + x, there[id].pos().y() + y) for id in chosen}
        text = f"Move {self._count_text(self._members())}"
        self.document.edit(self.document.patch.move(places), text, f"nudge {sorted(chosen)} {self._nudges}")
        self.ensure_visible(chosen)

    def tidy(self) -> None:
        """Arrange the selected items, or all, in layers along the signal flow."""
        scene, movable = self.patch_scene, self.patch_scene.movable()
        chosen = scene.selected() if len(scene.selected()) > 1 else movable
        nodes = [id for id in movable if id in set(chosen) and id not in scene.notes]
        if len(nodes) > 1:
            self.document.edit(tidied(scene, nodes), f"Tidy up {counted(len(nodes), 'node')}")

    # --- names ---

    def rename(self) -> None:
        """Edit the name of the selected node or group, or the text of the note."""
        chosen = self.patch_scene.selected()
        frame = self._frame_around(chosen)
        if frame:
            self.edit_title(frame)
        elif len(chosen) == 1 and chosen[0] in self.patch_scene.notes:
            self.edit_note(chosen[0])
        elif len(chosen) == 1:
            self.edit_title(chosen[0])
        else:
            self.show_message("Select one node, group or note to rename")

    def _frame_around(self, chosen: Sequence[str]) -> str:
        """Return the open group that has exactly these members, if several items are selected."""
        members = set(self.patch_scene.members(chosen))
        frames = (group.id for group in self.patch_scene.group_view.opened if set(group.members) == members)
        return next(frames, "") if len(chosen) > 1 else ""

    def edit_title(self, id: str, step: str = "") -> None:
        """Open a field for the name of a node or group, which is one undo step with the edit `step` that made it."""
        patch, scene = self.document.patch, self.patch_scene
        if id in scene.group_frames:
            place = scene.group_frames[id].title_rect()
        else:
            item = scene.nodes.get(id) or scene.group_nodes[id]
            place = QRectF(item.pos().x(), item.pos().y(), item.geometry.width, TITLE)
        now = self._name(id) if id in scene.nodes else patch.group(id).title
        self._open_field(place, now, lambda text: self._set_title(id, text, step), one_line=True)

    def _set_title(self, id: str, text: str, step: str) -> bool:
        """Name a node or group; return whether the name is allowed."""
        patch = self.document.patch
        if any(group.id == id for group in patch.groups):
            return self._edit_text(patch.with_item(replace(patch.group(id), title=text)), "Rename a group", step)
        own = self.registry[patch.node(id).type].label
        named = replace(patch.node(id), label="" if text == own else text)
        return self._edit_text(patch.with_item(named), f"Rename {self._name(id)}")

    def edit_note(self, id: str) -> None:
        """Open a field for the text of a note."""
        item = self.patch_scene.notes[id]

        def set_text(text: str) -> bool:
            return self._edit_text(self.document.patch.with_item(replace(item.note, text=text)), "Edit a note")

        self._open_field(item.sceneBoundingRect(), item.note.text, set_text, one_line=False)

    def _open_field(self, place: QRectF, text: str, on_done: Callable[[str], bool], *, one_line: bool) -> None:
        """Open a field over a place of the scene, which stays there when the view moves."""
        self._written_on = place
        self.inline.open(self._over(place), text, on_done, one_line=one_line)

    def _over(self, place: QRectF) -> QRect:
        """Return a place of the scene in the view."""
        return self.mapFromScene(place).boundingRect()

    def _edit_text(self, after: Patch, what: str, step: str = "") -> bool:
        """Set the patch after a name or a text was typed; return whether that is allowed, and show why not."""
        try:
            self.document.edit(after.check(self.registry), what, step)
        except BadValue as error:
            self.show_message(str(error).partition(" is ")[2])  # its place in the file would mean nothing
            return False
        return True

    # --- texts ---

    def _name(self, id: str) -> str:
        return self.document.patch.node(id).name_in(self.registry)

    def _count_text(self, ids: Sequence[str], patch: Patch | None = None) -> str:
        """Return the name of a single node, or the numbers of nodes and notes, for the name of an undo step."""
        patch, wanted = patch or self.document.patch, set(ids)
        nodes = [node for node in patch.nodes if node.id in wanted]
        notes = sum(note.id in wanted for note in patch.notes)
        words = [counted(notes, "note")] if notes else []
        if len(nodes) == 1:
            words.insert(0, nodes[0].name_in(self.registry))
        elif nodes:
            words.insert(0, counted(len(nodes), "node"))
        return " and ".join(words)
