"""Where on the canvas something goes, so that it lies over nothing, and what makes room for it; and how it is tidied
up.
"""

import math
from collections.abc import Collection, Mapping, Sequence

from PySide6.QtCore import QRectF

from underfoot.patch.groups import chain
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire, downstream
from underfoot.widgets import theme
from underfoot.widgets.design.group_items import FRAME_PAD
from underfoot.widgets.design.node_geometry import TITLE
from underfoot.widgets.design.patch_editing import Place, snapped
from underfoot.widgets.design.placing import (
    GAP_BESIDE,
    Box,
    behind,
    framed_places,
    nearest,
    outermost,
    pushed,
    shift_to_free_place,
)
from underfoot.widgets.design.scene import PatchScene, box_of

_Frames = Mapping[str, tuple[Box, set[str]]]
"""The place of each frame, and what is drawn in it; the outer ones first."""
_Notes = Mapping[tuple[str, ...], str]
"""Notes that go with a node, those in a frame as one, and that node."""


def shift_clear(
    scene: PatchScene, boxes: Sequence[Box], group: str, without: Sequence[str] = (), avoided: Sequence[Box] = ()
) -> Place:
    """Return the shift to where neither items but these nor frames are, but those of this group and around it; if there
    is room, also to where those need not grow over what is not in them, and out of what is `avoided`.
    """
    around, avoided = chain(scene.patch.groups, group), [*avoided]
    for frame in (frame for id, frame in scene.group_frames.items() if id in around):
        inside = {scene.group_view.shown_as[member] for member in frame.shown_group.members}
        strangers = scene.boxes(without={*without, *inside})
        beside = [box for box in strangers if not frame.frame_rect().intersects(QRectF(*box))]
        avoided += [behind(box_of(frame.frame_rect()), box, TITLE) for box in beside]
    return shift_to_free_place(boxes, scene.boxes(without=without) + scene.frame_boxes(without=around), avoided)


def with_room(scene: PatchScene, patch: Patch, id: str, wire: Wire, group: str) -> Patch:
    """Return the patch with a node, in this group, where nothing else is: in the wire, whose end and all that follows
    move right if they must, or else beside.
    """
    there, frames = scene.boxes_by_id(without=[id]), _frames(scene, without=id)
    ((x, y, width, height),) = scene.boxes_in(patch, [id], with_frames=False)
    dx, dy = shift_clear(scene, [(x, y, width, height)], group, [id])
    source, target = scene.group_view.ends(wire)
    if not (dx or dy) or source not in there or target not in there:
        return patch.move({id: (x + dx, y + dy)})
    taken = {**there, **{one: box for one, (box, _) in frames.items()}}
    border = outermost(frames, target, source)
    (left, _, wide, _), (right, *_) = taken[outermost(frames, source, target)], taken[border]
    if left + wide > right:  # the wire runs backwards
        return patch.move({id: (x + dx, y + dy)})
    begin = max(min(x, right - GAP_BESIDE - width), left + wide + GAP_BESIDE)
    by = math.ceil(max(begin + width + GAP_BESIDE - right, 0.0) / theme.GRID) * theme.GRID
    moving = _following(scene, there, frames, (target, border), by) if by else set[str]()
    patch = patch.move({one: (there[one][0] + by, there[one][1]) for one in moving})
    moving |= {one for one, (_, inside) in frames.items() if inside <= moving}
    boxes = {one: (box[0] + by * (one in moving), *box[1:]) for one, box in taken.items()}
    around = chain(patch.groups, group)
    dx, dy = shift_to_free_place([(begin, y, width, height)], [box for one, box in boxes.items() if one not in around])
    return patch.move({id: (begin + dx, y + dy)})


def _frames(scene: PatchScene, without: str) -> _Frames:
    """Return the frames with what is drawn in them but one item."""
    shown = scene.group_view.shown_as
    return {
        group.id: (
            box_of(scene.group_frames[group.id].frame_rect()),
            {shown[member] for member in group.members} - {without},
        )
        for group in scene.group_view.opened
    }


def _following(
    scene: PatchScene, boxes: Mapping[str, Box], frames: _Frames, ends: tuple[str, str], by: float
) -> set[str]:
    """Return which of these boxes move `by` to the right with a node, and with the frame at which its wire ends: those
    that it feeds, further right, what is then in the way, and the notes in frames that move.
    """
    id, border = ends
    fed = downstream((scene.group_view.ends(wire) for wire in scene.patch.wires), [id])
    first = [one for one in fed & boxes.keys() if boxes[one][0] >= boxes[id][0]]
    moving = pushed(boxes, frames, [*first, border], by)
    return moving.union(*scene.frames_of(moving).values()) & boxes.keys()


def tidied(scene: PatchScene, nodes: Collection[str]) -> Patch:
    """Return the patch with these nodes and sub-patches in layers along the signal flow. Their top left corner stays,
    and what is in a frame stays together, with its notes; other notes go with the node that they are nearest to.
    """
    frames = scene.frames_of(nodes)
    wanted = {*nodes}.union(*frames.values())
    items = {id: item for id, item in scene.movable().items() if id in wanted}
    wires = map(scene.group_view.ends, scene.patch.wires)
    sizes = {id: item.size for id, item in items.items()}
    places = framed_places(sizes, wires, frames, (FRAME_PAD, FRAME_PAD + TITLE))
    left = min(item.pos().x() for item in items.values()) - min(x for x, _ in places.values())
    top = min(item.pos().y() for item in items.values()) - min(y for _, y in places.values())
    boxes = [(left + x, top + y, *sizes[id]) for id, (x, y) in places.items()]
    notes = _notes_beside(scene, items)
    dx, dy = shift_to_free_place(boxes, scene.boxes(without={*items, *(note for whole in notes for note in whole)}))
    moved = {id: snapped(left + x + dx, top + y + dy) for id, (x, y) in places.items()}
    return _with_notes(scene, moved, notes)


def _notes_beside(scene: PatchScene, items: Collection[str]) -> _Notes:
    """Return the notes that are not among these items but nearest to one."""
    boxes, notes = scene.boxes_by_id(), scene.notes
    others = {id: box for id, box in boxes.items() if id not in notes}
    frames = [group.members for group in scene.group_view.opened if notes.keys() >= {*group.members}]
    found = dict[tuple[str, ...], str]()
    for note in (note for note in notes if note not in items):
        whole = next((members for members in frames if note in members), (note,))
        found.setdefault(whole, nearest(boxes[note], others))
    return {whole: id for whole, id in found.items() if id in items}


def _with_notes(scene: PatchScene, moved: Mapping[str, Place], notes: _Notes) -> Patch:
    """Return the patch with items moved, and these notes to their items as before, or where there is room near."""
    patch, boxes = scene.patch.move(moved), scene.boxes_by_id()
    others = boxes.keys() - {note for whole in notes for note in whole}
    taken = scene.boxes_in(patch, scene.members(others), with_frames=True)
    for whole, id in notes.items():
        x, y = (now - was for now, was in zip(moved[id], boxes[id][:2], strict=True))
        beside = [(left + x, top + y, wide, high) for left, top, wide, high in (boxes[note] for note in whole)]
        dx, dy = shift_to_free_place(beside, taken)
        places = [(left + dx, top + dy, wide, high) for left, top, wide, high in beside]
        taken += places
        patch = patch.move({note: place[:2] for note, place in zip(whole, places, strict=True)})
    return patch
