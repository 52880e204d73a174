"""Nodes that are dragged from the list and dropped on the canvas, also on a wire, and files that nodes read."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QMimeData, QPointF, QRectF
from PySide6.QtGui import QDragEnterEvent, QDragLeaveEvent, QDragMoveEvent, QDropEvent

from underfoot.errors import BadValue
from underfoot.patch.file_paths import named_from
from underfoot.widgets.controls.local_files import local_files
from underfoot.widgets.design.grouping_view import GroupingView
from underfoot.widgets.design.items import WireItem
from underfoot.widgets.design.node_list import MIME
from underfoot.widgets.design.patch_editing import name_of_file, readers

DROP_REACH = 10.0
"""A node dropped within this distance of a wire, in pixels of the scene, is inserted into it."""


class NodeDropView(GroupingView):
    """Takes nodes, and files that nodes read, that are dropped on it. Other files are left to the window."""

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if self._is_taken(event.mimeData()):
            event.acceptProposedAction()

    def _is_taken(self, data: QMimeData) -> bool:
        return data.hasFormat(MIME) or self._are_read(local_files(data))

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        if self._is_taken(event.mimeData()):
            event.acceptProposedAction()
            wire = self._wire_at_drop(event)
            place = self.mapToScene(event.position().toPoint())
            self.patch_scene.highlight(wire, None if wire else self.patch_scene.frame_around(place))

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        self.patch_scene.highlight()

    def dropEvent(self, event: QDropEvent) -> None:
        type, files = _dropped(event), local_files(event.mimeData())
        wire, place = self._wire_at_drop(event), self.mapToScene(event.position().toPoint())
        self.patch_scene.highlight()
        if type in self.registry:
            self.add(type, place, into=wire.wire if wire else None)
        elif self._are_read(files) and not self._gave(files, place):
            self.add_readers(files, place)
        event.acceptProposedAction()
        self.setFocus()

    def _gave(self, files: Sequence[Path], place: QPointF) -> bool:
        """Give a single file to the node at a place, if that reads such files; return whether it does."""
        node = self.patch_scene.node_at(place)
        name = dict(readers(self.registry, files[0])).get(node.node.type) if node and len(files) == 1 else None
        if node is None or name is None:
            return False
        file = named_from(self.folder, files[0])
        try:
            after = self.document.patch.set(node.node.id, name, file, self.registry)
            if node.node.label == name_of_file(Path(node.node.parameters.get(name, ""))):  # given by that file, or none
                after = after.name(node.node.id, name_of_file(files[0]))
        except BadValue as error:
            self.show_message(str(error))
        else:
            self.document.edit(after, f"Set {name.replace('_', ' ')}")
        return True

    def _wire_at_drop(self, event: QDropEvent) -> WireItem | None:
        type, place = _dropped(event), self.mapToScene(event.position().toPoint())
        if type not in self.registry or self.patch_scene.node_at(place) is not None:
            return None
        return self.patch_scene.wire_for(
            type, QRectF(place.x() - DROP_REACH, place.y() - DROP_REACH, 2 * DROP_REACH, 2 * DROP_REACH)
        )


def _dropped(event: QDropEvent) -> str:
    return bytes(event.mimeData().data(MIME).data()).decode(errors="replace")
