"""Nodes that are dragged from the list and dropped on the canvas, also on a wire."""

from PySide6.QtCore import QRectF
from PySide6.QtGui import QDragEnterEvent, QDragLeaveEvent, QDragMoveEvent, QDropEvent

from underfoot.widgets.design.grouping_view import GroupingView
from underfoot.widgets.design.items import WireItem
from underfoot.widgets.design.node_list import MIME

DROP_REACH = 10.0
"""A node dropped within this distance of a wire, in pixels of the scene, is inserted into it."""


class NodeDropView(GroupingView):
    """Takes nodes that are dropped on it."""

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            event.acceptProposedAction()
            wire = self._wire_at_drop(event)
            place = self.mapToScene(event.position().toPoint())
            self.patch_scene.highlight(wire, None if wire else self.patch_scene.frame_around(place))

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        self.patch_scene.highlight()

    def dropEvent(self, event: QDropEvent) -> None:
        type = _dropped(event)
        wire = self._wire_at_drop(event)
        self.patch_scene.highlight()
        if type in self.registry:
            event.acceptProposedAction()
            self.add(type, self.mapToScene(event.position().toPoint()), into=wire.wire if wire else None)
            self.setFocus()

    def _wire_at_drop(self, event: QDropEvent) -> WireItem | None:
        type, place = _dropped(event), self.mapToScene(event.position().toPoint())
        if type not in self.registry or self.patch_scene.node_at(place) is not None:
            return None
        return self.patch_scene.wire_for(
            type, QRectF(place.x() - DROP_REACH, place.y() - DROP_REACH, 2 * DROP_REACH, 2 * DROP_REACH)
        )


def _dropped(event: QDropEvent) -> str:
    return bytes(event.mimeData().data(MIME).data()).decode(errors="replace")
