"""The drawn patch: one item for each node and wire, of which only changed ones are updated."""

from collections.abc import Collection, Iterable, Mapping

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRect, QRectF, QSignalBlocker, Qt
from PySide6.QtGui import QColor, QPainter, QTransform
from PySide6.QtWidgets import QGraphicsScene

from underfoot.engine.reports import Costs
from underfoot.patch.groups import parents
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import Wire, node_id, port_name
from underfoot.widgets import theme
from underfoot.widgets.design.group_items import GroupFrameItem, GroupNodeItem, NoteItem, StubItem, framed, note_size
from underfoot.widgets.design.group_view import description_of_group, group_view_of, node_of_group
from underfoot.widgets.design.items import NodeItem, WireItem, bounds
from underfoot.widgets.design.node_geometry import (
    REACH,
    REACH_ON_SCREEN,
    NodeDescription,
    PlacedPort,
    description_of,
    display_name,
    node_geometry,
)
from underfoot.widgets.design.patch_editing import driven_parameters, drivers, port_of
from underfoot.widgets.design.placing import Box
from underfoot.widgets.design.rewiring import insertion_ports
from underfoot.widgets.design.wire_picture import WirePicture

SCENE_SIZE = 40_000.0
"""Pixels in each direction: large and fixed, so that the view never jumps when a node is added."""

MIN_CHANGE = 0.15
"""Smallest relative change of a node's cost that is displayed."""


class PatchScene(QGraphicsScene):
    """Shows a patch, and handles selection and dragging; the canvas handles everything else."""

    def __init__(self, registry: Registry) -> None:
        super().__init__(-SCENE_SIZE, -SCENE_SIZE, 2 * SCENE_SIZE, 2 * SCENE_SIZE)
        self.setItemIndexMethod(QGraphicsScene.ItemIndexMethod.BspTreeIndex)
        self.registry = registry
        self.patch = Patch()
        self.inside = ""
        self.group_view = group_view_of(self.patch)
        self.nodes: dict[str, NodeItem] = {}
        """Nodes that are seen at this level, by id."""
        self.group_nodes: dict[str, GroupNodeItem] = {}
        self.group_frames: dict[str, GroupFrameItem] = {}
        self.notes: dict[str, NoteItem] = {}
        self.wires: dict[Wire, WireItem] = {}
        self.wire_picture = WirePicture(self.wires, self.sceneRect())
        self.addItem(self.wire_picture)
        self._costs: dict[str, float] = {}
        self._highlighted: WireItem | None = None
        self._descriptions: dict[tuple[str, str], NodeDescription] = {}
        self._curves: dict[str, np.ndarray] = {}
        self._signal_ranges: Mapping[str, tuple[float, float]] = {}

    def show(self, patch: Patch, inside: str = "") -> None:
        """Show this patch, or the content of its group `inside`."""
        self.patch, self.inside = patch, inside
        self.group_view = group_view_of(patch, inside)
        before, self._highlighted = (self.selected(), self.chosen_wires()), None
        with QSignalBlocker(self):
            self._show_nodes()
            self._show_group_nodes()
            self._show_notes()
            self._show_wires()
            self._show_group_frames()
        if before != (self.selected(), self.chosen_wires()):
            self.selectionChanged.emit()

    def _show_nodes(self) -> None:
        shown_as = self.group_view.shown_as
        placed = {node.id: node for node in self.patch.nodes if shown_as.get(node.id) == node.id}
        for id in [i for i, item in self.nodes.items() if i not in placed or placed[i].type != item.node.type]:
            self.removeItem(self.nodes.pop(id))
        for id, node in placed.items():
            if id not in self.nodes:
                self.nodes[id] = NodeItem(node, self._description(node))
                self.addItem(self.nodes[id])
                self.nodes[id].set_curve(self._curves.get(id))
            elif self.nodes[id].node is not node:
                item = self.nodes[id]
                description = self._description(node)
                if item.description is not description:
                    item.set_description(description)
                is_marked_otherwise = item.node.marks != node.marks
                item.node = node
                item.setPos(*node.at)
                if is_marked_otherwise:
                    item.update()
        if list(self.nodes) != list(placed):
            self.nodes = {id: self.nodes[id] for id in placed}
        wired = drivers(self.patch)
        for id, item in self.nodes.items():
            driven = driven_parameters(self.registry, item.node.type, wired.get(id, ()))
            item.set_ports(driven, shows_all=item.shows_all_ports)

    def drawBackground(self, painter: QPainter, rect: QRectF | QRect) -> None:
        """Fill the ground. Words painted on it run in their own direction, as where they are typed."""
        painter.fillRect(rect, QColor(theme.GROUND))
        painter.setLayoutDirection(Qt.LayoutDirection.LayoutDirectionAuto)

    def update_colours(self) -> None:
        """Redraw everything in the current colours."""
        self._descriptions.clear()
        for item in self.nodes.values():
            item.set_description(self._description(item.node))
        for wire in self.wires.values():
            wire.colour = theme.current_colour(wire.colour)
        self._show_group_nodes()
        self.wire_picture.put_back_still()
        self.wire_picture.redraw_all()
        for drawn in self.items():
            drawn.update()

    def forget_descriptions(self) -> None:
        """Discard cached descriptions after a change of node types; the next patch redraws all nodes."""
        self._descriptions.clear()

    def _description(self, node: PlacedNode) -> NodeDescription:
        """Return a node's description; nodes of the same type and name share one object."""
        key = node.type, node.label
        if key not in self._descriptions:
            self._descriptions[key] = description_of(self.registry[node.type], node.label)
        return self._descriptions[key]

    def _show_group_nodes(self) -> None:
        wanted = {group.id: group for group in self.group_view.collapsed}
        for id in [id for id in self.group_nodes if id not in wanted]:
            self.removeItem(self.group_nodes.pop(id))
        for id, group in wanted.items():
            node, description = node_of_group(self.patch, group), description_of_group(self.patch, self.registry, group)
            if id in self.group_nodes:
                self.group_nodes[id].set_group(group, node, description)
            else:
                self.group_nodes[id] = GroupNodeItem(group, node, description)
                self.addItem(self.group_nodes[id])

    def _show_notes(self) -> None:
        wanted = {note.id: note for note in self.patch.notes if self.group_view.shown_as.get(note.id) == note.id}
        for id in [id for id in self.notes if id not in wanted]:
            self.removeItem(self.notes.pop(id))
        for id, note in wanted.items():
            if id not in self.notes:
                self.notes[id] = NoteItem(note)
                self.addItem(self.notes[id])
            elif self.notes[id].note is not note:
                self.notes[id].set_note(note)

    def _show_wires(self) -> None:
        wanted = {wire: ends for wire in self.patch.wires if any(ends := self.group_view.ends(wire))}
        for wire, item in list(self.wires.items()):
            source, target = wanted.get(wire, ("", ""))
            is_stub = isinstance(item, StubItem)  # its text also depends on other wires
            if (
                is_stub
                or wire not in wanted
                or item.source is not self._item(source)
                or item.target is not self._item(target)
            ):
                item.detach()
                self.wire_picture.redraw(item.boundingRect())
                self.removeItem(self.wires.pop(wire))
        for wire, ends in wanted.items():
            if wire not in self.wires:
                self._draw(wire, *ends)

    def _draw(self, wire: Wire, source: str, target: str) -> None:
        port = port_of(self.patch, self.registry, wire[0], "out")
        colour = theme.signal_colour(port.kind, port.unit)
        start, end = self._item(source), self._item(target)
        if start is not None and end is not None:
            self.wires[wire] = item = WireItem(wire, start, end, colour)
            item.set_in_picture(True)
            item.about_to_move = self.wire_picture.take_out
            self.wire_picture.redraw(item.boundingRect())
        else:
            inner, side = (start, "out") if start is not None else (end, "in")
            assert inner is not None
            self.wires[wire] = StubItem(wire, inner, side, colour, self._other_end_names(wire, side))
            other_end = wire[1 if side == "out" else 0]
            name = self.patch.node(node_id(other_end)).name_in(self.registry)
            self.wires[wire].outside = f"{name}: {display_name(port_name(other_end))}"
        self.wires[wire].unit, self.wires[wire].signal_range = port.unit, self._signal_ranges.get(wire[0])
        self.addItem(self.wires[wire])

    def _other_end_names(self, wire: Wire, side: str) -> str:
        """Return the names of the outside nodes at the other end of a wire, and of all others at the same port."""
        near, far = (0, 1) if side == "out" else (1, 0)
        ends = [other for other in self.patch.wires if other[near] == wire[near]]
        outside = [node_id(end[far]) for end in ends if not all(self.group_view.ends(end))]
        if wire != next(end for end in ends if not all(self.group_view.ends(end))):
            return ""
        nodes = map(self.patch.node, dict.fromkeys(outside))
        return ", ".join(node.name_in(self.registry) for node in nodes)

    def _show_group_frames(self) -> None:
        wanted = {group.id: group for group in self.group_view.opened}
        for id in [id for id in self.group_frames if id not in wanted]:
            self.removeItem(self.group_frames.pop(id))
        if not wanted:
            return
        above = parents(self.patch.groups)
        depths: dict[str, int] = {}
        for id, group in wanted.items():
            depths[id] = depths.get(above[id], -1) + 1
            if id not in self.group_frames:
                self.group_frames[id] = GroupFrameItem(group)
                self.addItem(self.group_frames[id])
        for id, group in reversed(wanted.items()):
            direct = {self.group_view.shown_as[member] for member in group.members}
            items = [item for id, item in self.movable().items() if id in direct]
            inner = [self.group_frames[other] for other in wanted if above[other] == id]
            self.group_frames[id].follow(group, [*items, *inner], depths[id])

    def _item(self, id: str) -> NodeItem | None:
        """Return the item of the visible node or collapsed group `id`; None if it is not visible."""
        return self.nodes.get(id) or self.group_nodes.get(id)

    def adjust_group_frames(self) -> None:
        """Update the frames of groups to dragged members."""
        for frame in reversed(self.group_frames.values()):
            frame.adjust()

    def close_ports(self, without: Collection[str] = ()) -> None:
        """Show only driven parameters as ports, except on these nodes; a frame that has grown around them shrinks."""
        opened = [node for id, node in self.nodes.items() if node.shows_all_ports and id not in without]
        for node in opened:
            node.set_ports(node.driven, shows_all=False)
        if opened:
            self.adjust_group_frames()

    # --- queries ---

    def nodes_and_group_nodes(self) -> list[NodeItem]:
        """Return all items to which wires can be connected."""
        return [*self.nodes.values(), *self.group_nodes.values()]

    def movable(self) -> dict[str, NodeItem | NoteItem]:
        """Return all items that can be dragged and selected, by id."""
        return {**self.nodes, **self.group_nodes, **self.notes}

    def selected(self) -> list[str]:
        """Return the ids of the selected nodes, collapsed groups and notes."""
        return [id for id, item in self.movable().items() if item.isSelected()]

    def selected_ids(self) -> list[str]:
        """Return the selected nodes, including those in selected groups, in the order of the patch."""
        chosen = {id for id, item in (*self.nodes.items(), *self.group_nodes.items()) if item.isSelected()}
        if not self.group_nodes:
            return [id for id in self.nodes if id in chosen]
        return [node.id for node in self.patch.nodes if self.group_view.shown_as.get(node.id) in chosen]

    def selected_sub_patches(self) -> list[GroupNodeItem]:
        """Return the selected sub-patches; none if something else is selected, too."""
        found = [self.group_nodes.get(id) for id in self.selected()]
        return [item for item in found if item is not None] if all(found) else []

    def members(self, ids: Iterable[str]) -> list[str]:
        """Return the nodes and notes in these items."""
        wanted = set(ids)
        return [id for id, shown in self.group_view.shown_as.items() if shown in wanted]

    def frames_of(self, nodes: Collection[str]) -> dict[str, list[str]]:
        """Return the open groups whose nodes and sub-patches are all among these, with what is in them, also notes; the
        outer ones first.
        """
        found = {}
        for group in self.group_view.opened:
            inside = dict.fromkeys(self.group_view.shown_as[id] for id in group.members)
            if (drawn := inside.keys() - self.notes.keys()) and drawn <= {*nodes}:
                found[group.id] = list(inside)
        return found

    def select(self, ids: Iterable[str]) -> None:
        """Select exactly these nodes, groups and notes, and no wire."""
        wanted = set(ids)
        with QSignalBlocker(self):
            self.choose(None)
            for id, item in self.movable().items():
                item.setSelected(id in wanted)
        self.selectionChanged.emit()

    def node_at(self, place: QPointF, reach: float = 0.0) -> NodeItem | None:
        """Return the topmost node at a position, or within `reach` of it."""
        area = QRectF(place.x() - reach, place.y() - reach, 2 * reach + 0.1, 2 * reach + 0.1)
        return next((item for item in self.items(area) if isinstance(item, NodeItem)), None)

    def note_at(self, place: QPointF) -> NoteItem | None:
        """Return the note at a position."""
        return next((item for item in self.items(place) if isinstance(item, NoteItem)), None)

    def group_frame_at(self, place: QPointF) -> GroupFrameItem | None:
        """Return the frame whose title is at a position without other items."""
        hits = [frame for frame in self.group_frames.values() if frame.title_rect().contains(place)]
        return max(hits, key=GroupFrameItem.zValue, default=None)

    def frame_around(self, place: QPointF, without: Collection[str] = ()) -> GroupFrameItem | None:
        """Return the innermost frame around a position, of a group that has none of `without`."""
        frames = [one for one in self.group_frames.values() if not set(without) & set(one.shown_group.members)]
        hits = [frame for frame in frames if frame.frame_rect().contains(place)]
        return max(hits, key=GroupFrameItem.zValue, default=None)

    @property
    def zoom(self) -> float:
        """The scale at which the scene is drawn."""
        return min((view.transform().m11() for view in self.views()), default=1.0)

    def port_at(self, place: QPointF, side: str = "") -> tuple[NodeItem, PlacedPort] | None:
        """Return the node and port at a mouse position: on a node one of its own, elsewhere the nearest within reach of
        the hand, whatever the zoom; of one `side` only, if that is given.
        """
        reach = max(REACH, REACH_ON_SCREEN / self.zoom)
        area = QRectF(place.x() - reach, place.y() - reach, 2 * reach, 2 * reach)
        over = self.node_at(place)
        nodes = [item for item in self.items(area) if isinstance(item, NodeItem)] if over is None else [over]
        hits = [(item, placed) for item in nodes if (placed := item.port_at(place, REACH_ON_SCREEN / self.zoom))]
        hits = [hit for hit in hits if side in ("", hit[1].side)]
        return min(hits, key=lambda hit: QLineF(place, hit[0].mapToScene(hit[1].at)).length(), default=None)

    def wire_at(self, place: QPointF) -> WireItem | None:
        """Return the wire at a position without nodes."""
        found = self.itemAt(place, QTransform())
        return found if isinstance(found, WireItem) else None

    def chosen_wires(self) -> list[Wire]:
        return [wire for wire, item in self.wires.items() if item.chosen]

    def choose(self, wire: WireItem | None, *, extends: bool = False) -> None:
        """Select this wire, and no other; `extends` adds it to those selected, or takes it from them."""
        before = self.chosen_wires()
        for item in self.wires.values():
            chosen = item.chosen != (item is wire) if extends else item is wire
            if item.chosen != chosen:
                item.set_chosen(chosen)
        if before != self.chosen_wires():
            self.selectionChanged.emit()

    def show_wire(self, wire: WireItem, *, shown: bool) -> None:
        """Hide a wire while it is dragged, or show it again."""
        wire.setVisible(shown)
        self.wire_picture.redraw(wire.boundingRect())

    def wire_for(self, type: str, area: QRectF) -> WireItem | None:
        """Return the wire through this rectangle into which `type` can be inserted; of several, the one nearest the
        centre.
        """
        fitting = [item for item in self.wires.values() if item.passes(area)]
        fitting = [item for item in fitting if insertion_ports(self.patch, self.registry, type, item.wire)]
        middle = QRectF(area.center().x() - 8, area.center().y() - 8, 16, 16)
        return next((item for item in fitting if item.passes(middle)), next(iter(fitting), None))

    def highlight(self, wire: WireItem | None = None, frame: GroupFrameItem | None = None) -> None:
        """Highlight the wire into which a node would be inserted, the frame into which things would be put, and no
        other.
        """
        if self._highlighted is not wire:
            for item in (self._highlighted, wire):
                if item is not None:
                    item.set_highlighted(item is wire)
            self._highlighted = wire
        for one in self.group_frames.values():
            one.set_entered(one is frame)

    def sizes(self) -> dict[str, tuple[float, float]]:
        return {id: item.size for id, item in self.movable().items()}

    def boxes_by_id(self, without: Iterable[str] = ()) -> dict[str, Box]:
        """Return the rectangles of all items except `without`."""
        left_out = set(without)
        return {
            id: (item.pos().x(), item.pos().y(), *item.size)
            for id, item in self.movable().items()
            if id not in left_out
        }

    def boxes(self, without: Iterable[str] = ()) -> list[Box]:
        """Return the same without the ids."""
        return [*self.boxes_by_id(without).values()]

    def frame_boxes(self, without: Collection[str]) -> list[Box]:
        """Return the rectangles of the frames of all groups but these."""
        return [box_of(frame.frame_rect()) for id, frame in self.group_frames.items() if id not in without]

    def boxes_in(self, patch: Patch, ids: Iterable[str], *, with_frames: bool) -> list[Box]:
        """Return the rectangles with which these nodes and notes of another patch would be drawn at this level; those
        in a sub-patch have one, and so has a frame of which they are all, if frames count.
        """
        view = group_view_of(patch, self.inside)
        shown, wired, rects = {view.shown_as[id] for id in ids}, drivers(patch), dict[str, QRectF]()
        for node in (node for node in patch.nodes if node.id in shown):
            driven = driven_parameters(self.registry, node.type, wired.get(node.id, ()))
            rects[node.id] = node_geometry(self._description(node), driven).rect.translated(*node.at)
        for group in (group for group in view.collapsed if group.id in shown):
            description = description_of_group(patch, self.registry, group)
            rects[group.id] = node_geometry(description).rect.translated(*group.at)
        rects |= {note.id: QRectF(*note.at, *note_size(note)) for note in patch.notes if note.id in shown}
        for group in reversed(view.opened if with_frames else ()):  # the inner ones first
            inside = {view.shown_as[id] for id in group.members}
            if inside <= shown:
                inside |= {one.id for one in view.opened if one.id in rects and {*one.members} <= {*group.members}}
                rects[group.id] = framed([rects[id] for id in inside])
        return [*map(box_of, rects.values())]

    def places(self) -> dict[str, tuple[float, float]]:
        """Return the new positions of dragged items, by id."""
        stood = {id: item.node.at for id, item in (*self.nodes.items(), *self.group_nodes.items())}
        stood |= {id: item.note.at for id, item in self.notes.items()}
        return {
            id: (item.pos().x(), item.pos().y())
            for id, item in self.movable().items()
            if (item.pos().x(), item.pos().y()) != stood[id]
        }

    def extent(self, ids: Iterable[str] = ()) -> QRectF:
        """Return the bounding rectangle of these items, or of all."""
        there = self.movable()
        chosen = [there[id] for id in ids if id in there]
        stubs = [item for item in self.wires.values() if isinstance(item, StubItem)]
        return bounds(chosen or [*there.values(), *self.group_frames.values(), *stubs])

    # --- reports of the engine ---

    def show_costs(self, costs: Costs | None) -> None:
        """Show each node's share of a block, and which nodes are asleep or unused; None if the engine is stopped."""
        share, awake, left_out = (costs.share, costs.awake, costs.left_out) if costs else ({}, {}, ())
        for id, item in self.nodes.items():
            if item.state == "fault":
                continue
            if id not in share:
                self._costs.pop(id, None)
                item.set_cost("", "unused" if id in left_out else "")
                continue
            # Fluctuating figures would redraw every node twice a second.
            before = self._costs.get(id, -1.0)
            if abs(share[id] - before) > MIN_CHANGE * before:
                self._costs[id] = share[id]
            item.set_cost(percent(self._costs[id]), "" if awake.get(id, 0) else "asleep")

    def show_fault(self, id: str | None) -> list[str]:
        """Mark a node that produced a value that is not finite; None clears all marks. Return the marked nodes."""
        for other, item in self.nodes.items():
            if other == id:
                item.set_cost("", "fault")
            elif id is None and item.state == "fault":
                item.set_cost("", "")
        return [other for other, item in self.nodes.items() if item.state == "fault"]

    def show_auditioned(self, id: str) -> None:
        """Mark the node that is played alone; "" for none."""
        for other, item in self.nodes.items():
            item.set_auditioned(other == id)

    def show_signal_ranges(self, signal_ranges: Mapping[str, tuple[float, float]]) -> None:
        """Set the ranges of outputs ("node.port") in their last preview, which wires tell."""
        self._signal_ranges = signal_ranges
        for wire, item in self.wires.items():
            item.signal_range = signal_ranges.get(wire[0])

    def show_curve(self, id: str, values: np.ndarray | None) -> None:
        """Set the small plot of a node; it is stored while the node is not visible."""
        if values is None:
            self._curves.pop(id, None)
        else:
            self._curves[id] = values
        if id in self.nodes and self.nodes[id].description.outputs:
            self.nodes[id].set_curve(values)

    def retain_curves(self, ids: Iterable[str]) -> None:
        """Discard the small plots of all other nodes."""
        for id in self._curves.keys() - ids:
            self.show_curve(id, None)


def box_of(rect: QRectF) -> Box:
    """Return a rectangle as what finds free places takes it."""
    return rect.x(), rect.y(), rect.width(), rect.height()


def percent(share: float) -> str:
    """Return a share of the block as text, short enough for a node's title.

    >>> percent(0.008), percent(0.00004), percent(0.123)
    ('0.8 %', '< 0.1 %', '12 %')
    """
    if share < 0.0005:
        return "< 0.1 %"
    return f"{100 * share:.1f} %" if share < 0.0995 else f"{100 * share:.0f} %"
