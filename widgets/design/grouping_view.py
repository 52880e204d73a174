"""Commands of the canvas on groups: frames and sub-patches. Each is one undo step."""

from collections.abc import Sequence

from msgspec.structs import replace
from PySide6.QtCore import QPointF, QRectF

from underfoot.errors import BadValue
from underfoot.patch.grouping import grouped, put_into, taken_out, ungrouped
from underfoot.patch.groups import Group, SplitGroup, chain
from underfoot.patch.patch import Patch
from underfoot.widgets.design.editable_view import EditableView
from underfoot.widgets.design.group_items import FRAME_PAD, item_rect
from underfoot.widgets.design.group_view import description_of_group
from underfoot.widgets.design.making_room import shift_clear
from underfoot.widgets.design.node_geometry import node_geometry
from underfoot.widgets.design.patch_editing import Place, snapped
from underfoot.widgets.design.placing import GAP_BESIDE, shift_to_free_place
from underfoot.widgets.design.scene import box_of


class GroupingView(EditableView):
    """Groups what it shows, by commands."""

    def group(self) -> None:
        """Put the selected items into a group, and ask for its title."""
        members = self._members_for("group")
        if not members:
            return
        try:
            after = grouped(self.document.patch, members, within=self.inside)
        except SplitGroup as error:
            cut = next(group for group in self.document.patch.groups if group.id in error.ids)
            self.show_message(f"It would hold a part of the group “{cut.title or 'Group'}”; take all of it, or nothing")
            return
        new = next(iter({g.id for g in after.groups} - {g.id for g in self.document.patch.groups}))
        step = f"make {new}"
        self.document.edit(after, f"Group {self._count_text(members)}", step)
        self._name_strangers(new)
        self.edit_title(new, step)

    def _name_strangers(self, group: str) -> None:
        """Say what lies within a new frame, but is not in its group: it does not move with it."""
        scene = self.patch_scene
        frame, inside = scene.group_frames[group], set(self.document.patch.group(group).members)
        within = [id for id, item in scene.movable().items() if frame.frame_rect().intersects(item_rect(item))]
        strangers = [id for id in scene.members(within) if id not in inside]
        if strangers:
            lie, them = ("lies", "it") if len(strangers) == 1 else ("lie", "them")
            names = self._count_text(strangers)
            remedy = f"drag {them} out, or put {them} in by the context menu"
            self.show_message(f"{names} {lie} in the frame but not in its group: {remedy}", alarm=False)

    def ungroup(self) -> None:
        """Remove the group around the selection, or dissolve the selected collapsed group."""
        gone = self._chosen_groups()
        if not gone:
            self.show_message("Select a group")
            return
        members, after = self._members(), ungrouped(self.document.patch, gone)
        if gone[0] in self.patch_scene.group_nodes:
            after = self._opened_clear(after, gone)
        self.document.edit(after, "Ungroup")
        self.patch_scene.select({self.patch_scene.group_view.shown_as[id] for id in members})

    def take_out(self) -> None:
        """Take what is selected out of its innermost frame, and beside it if it lies within."""
        patch, leaving, scene = self.document.patch, list[str](), self.patch_scene
        for shown in scene.selected():
            if frame := self._frame_of([shown]):
                members = scene.members([shown])
                patch = taken_out(patch, members, frame)
                leaving += members
        if not leaving:
            self.show_message("Select what is in a frame")
            return
        items = {id: scene.movable()[id] for id in dict.fromkeys(scene.group_view.shown_as[id] for id in leaving)}
        left = {group.id for group in patch.groups if not set(leaving) <= set(group.members)}
        frames = [frame.rect_without(items.values()) for id, frame in scene.group_frames.items() if id in left]
        if any(item_rect(item).intersects(frame) for item in items.values() for frame in frames):
            patch = self._moved_clear(patch, list(items), frames)
        self.document.edit(patch, f"Take {self._count_text(leaving)} out of the group")
        self.ensure_visible(list(items))

    def joinable_groups(self) -> list[Group]:
        """Return the groups with a frame that not all of the selection is in."""
        members = set(self._members())
        return [group for group in self.patch_scene.group_view.opened if not members <= set(group.members)]

    def join(self, group: Group) -> None:
        """Put what is selected into a group, and below its frame's contents if it does not lie within."""
        patch, scene, frame = self.document.patch, self.patch_scene, self.patch_scene.group_frames[group.id]
        coming = [id for id in scene.selected() if not set(scene.members([id])) <= set(group.members)]
        items, members = [scene.movable()[id] for id in coming], scene.members(coming)
        patch = put_into(patch, members, group.id)
        rect = frame.rect_without(items)
        if not all(rect.contains(item_rect(item)) for item in items):
            corner = QPointF(min(item.pos().x() for item in items), min(item.pos().y() for item in items))
            by = snapped(rect.x() + FRAME_PAD - corner.x(), rect.bottom() - corner.y())
            around = chain(patch.groups, group.id)
            frames = [frame.rect_without(items) for id, frame in scene.group_frames.items() if id not in around]
            patch = self._moved_clear(patch, coming, frames, by)
        self.document.edit(patch, f"Move {self._count_text(members)} into {group.title or 'the group'}")
        self.ensure_visible(coming)

    def _moved_clear(self, patch: Patch, ids: Sequence[str], frames: Sequence[QRectF], by: Place = (0.0, 0.0)) -> Patch:
        """Return the patch with these items moved `by`, and on to where neither one of these frames nor an item is."""
        taken = [box_of(rect) for rect in frames if not rect.isNull()]
        items = {id: self.patch_scene.movable()[id] for id in ids}
        boxes = [(item.pos().x() + by[0], item.pos().y() + by[1], *item.size) for item in items.values()]
        dx, dy = shift_to_free_place(boxes, taken + self.patch_scene.boxes(without=ids))
        return patch.move({id: (x + dx, y + dy) for id, (x, y, *_) in zip(ids, boxes, strict=True)})

    def _frame_of(self, shown: Sequence[str]) -> str:
        """Return the innermost open group that all of these items are in; "" if there is none."""
        members = set(self.patch_scene.members(shown))
        around = [group.id for group in self.patch_scene.group_view.opened if members and members <= set(group.members)]
        return around[-1] if around else ""

    def _chosen_groups(self) -> list[str]:
        """Return the selected sub-patches, else the open group around the selection."""
        chosen = self.patch_scene.selected()
        frame = self._frame_around(chosen) or self._frame_of(chosen)
        return [id for id in chosen if id in self.patch_scene.group_nodes] or ([frame] if frame else [])

    def collapse(self) -> None:
        """Collapse the selection to one node, with a port for each wire across its border, and ask for its name if it
        has none; expand selected collapsed groups, unless they are all of a frame.
        """
        chosen = self.patch_scene.selected()
        blocks = [id for id in chosen if id in self.patch_scene.group_nodes]
        patch, id = self.document.patch, self._frame_around(chosen)
        if blocks and len(blocks) == len(chosen) and not id:
            members = self._members()
            for id in blocks:
                patch = patch.with_item(replace(patch.group(id), collapsed=False))
            self.document.edit(self._opened_clear(patch, blocks), "Open a sub-patch")
            self.patch_scene.select({self.patch_scene.group_view.shown_as[id] for id in members})
            return
        try:
            if not id:
                patch = grouped(patch, self._members(), within=self.inside)
                id = next(iter({g.id for g in patch.groups} - {g.id for g in self.document.patch.groups}))
        except BadValue:
            self.show_message("Select what to collapse: whole groups, or nodes of one group")
            return
        patch = patch.with_item(replace(patch.group(id), collapsed=True))
        shape = node_geometry(description_of_group(patch, self.registry, patch.group(id)))
        middle = self.patch_scene.extent(chosen).center()
        x, y = snapped(middle.x() - shape.width / 2, middle.y() - shape.height / 2)
        room = (x - GAP_BESIDE, y, shape.width + 2 * GAP_BESIDE, shape.height)
        dx, dy = shift_to_free_place([room], self.patch_scene.boxes(without=chosen))
        after, step = patch.with_item(replace(patch.group(id), at=(x + dx, y + dy))), f"collapse {id}"
        self.document.edit(after.check(self.registry), f"Collapse {self._count_text(patch.group(id).members)}", step)
        self.patch_scene.select([id])
        self.ensure_visible([id])
        if not patch.group(id).title:
            self.edit_title(id, step)

    def _opened_clear(self, patch: Patch, blocks: Sequence[str]) -> Patch:
        """Return the patch, in which these sub-patches are open; if what is in them would cover what has been put there
        meanwhile, it is moved to a free place.
        """
        scene, members = self.patch_scene, self.patch_scene.members(blocks)
        there = [QRectF(*box) for box in scene.boxes(without=blocks)]
        coming = [QRectF(*box) for box in scene.boxes_in(patch, members, with_frames=False)]
        if not any(rect.intersects(other) for rect in coming for other in there):
            return patch
        boxes = scene.boxes_in(patch, members, with_frames=True)
        dx, dy = shift_clear(self.patch_scene, boxes, self._frame_of(blocks) or self.inside, blocks)
        groups = [group for group in patch.groups if {*group.members} <= {*members}]
        moved = [*(one for one in patch.canvas_items() if one.id in {*members}), *groups]
        return patch.move({one.id: (one.at[0] + dx, one.at[1] + dy) for one in moved})

    def paint_group(self, colour: str) -> None:
        """Set the colour of the selected sub-patches, else of the group around the selection."""
        patch = self.document.patch
        for id in self._chosen_groups():
            patch = patch.with_item(replace(patch.group(id), colour=colour))
        self.document.edit(patch, "Colour a group")

    def enter(self) -> None:
        """Open the selected sub-patch."""
        chosen = self.patch_scene.selected()
        if len(chosen) == 1 and chosen[0] in self.patch_scene.group_nodes:
            self.open_group(chosen[0])
