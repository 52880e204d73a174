"""Dragging the frame of a group by its title."""

from PySide6.QtCore import QPointF, Qt

from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import GroupFrameItem
from underfoot.widgets.design.patch_editing import snapped
from underfoot.widgets.design.scene import PatchScene


class FrameDrag:
    """One drag of a frame, from the press on its title to the release. It selects as a press on a node does, and what
    is selected follows the mouse.
    """

    button = Qt.MouseButton.LeftButton

    def __init__(self, scene: PatchScene, frame: GroupFrameItem, place: QPointF, *, extends: bool) -> None:
        """`extends`: the frame is added to what is selected, or taken from it."""
        self._scene, self._start, self._extends = scene, place, extends
        self._inside = {scene.group_view.shown_as[member] for member in frame.shown_group.members}
        before = set(scene.selected())
        if not self._inside <= before:
            scene.select(before | self._inside if extends else self._inside)
        elif extends:
            scene.select(before - self._inside)
        else:
            scene.choose(None)
        self._items = [(item, item.pos()) for item in scene.movable().values() if item.isSelected()]

    def move(self, place: QPointF) -> None:
        """Follow the mouse, on the grid."""
        by = QPointF(*snapped(place.x() - self._start.x(), place.y() - self._start.y()))
        for item, at in self._items:
            item.setPos(at + by)
        self._scene.adjust_group_frames()

    def end(self) -> tuple[Patch, str] | None:
        """Select the frame alone if it was pressed and not moved. What has moved is where the canvas finds it."""
        if not self._extends and not self._scene.places():
            self._scene.select(self._inside)
        return None
