"""Setting the width of a note by its right edge."""

from msgspec.structs import replace
from PySide6.QtCore import QPointF, Qt

from underfoot.patch.groups import NARROWEST, WIDEST
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import NoteItem
from underfoot.widgets.design.patch_editing import snapped
from underfoot.widgets.design.scene import PatchScene


class NoteWidth:
    """One drag of a note's edge, from the press to the release. It selects as a press on a node does."""

    button = Qt.MouseButton.LeftButton

    def __init__(self, scene: PatchScene, item: NoteItem, place: QPointF, *, extends: bool) -> None:
        """`extends`: the note is added to what is selected, or taken from it."""
        self._scene, self._item, self._before, self._start = scene, item, item.note, place
        if extends:
            item.setSelected(not item.isSelected())
        else:
            scene.select([item.note.id])

    def move(self, place: QPointF) -> None:
        """Follow the mouse, by steps of the grid."""
        by, _ = snapped(place.x() - self._start.x(), 0.0)
        width = min(max(self._before.width + by, NARROWEST), WIDEST)
        self._item.set_note(replace(self._before, width=width))
        self._scene.adjust_group_frames()

    def end(self) -> tuple[Patch, str] | None:
        """Give the note back its width, and return the patch with the new one."""
        after = self._item.note
        self._item.set_note(self._before)
        self._scene.adjust_group_frames()
        return self._scene.patch.with_item(after), "Set the width of a note"
