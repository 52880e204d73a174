"""Cutting wires by a stroke of the mouse across them."""

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QColor, QPainterPath, QPen

from underfoot.patch.patch import Patch
from underfoot.widgets import theme
from underfoot.widgets.design.patch_editing import disconnection
from underfoot.widgets.design.scene import PatchScene


class WireCut:
    """One stroke, from the press to the release; the wires that it has crossed are lit."""

    button = Qt.MouseButton.RightButton

    def __init__(self, scene: PatchScene, place: QPointF) -> None:
        self._scene, self._path = scene, QPainterPath(place)
        scene.choose(None)
        pen = QPen(QColor(theme.ALARM), 1.5, Qt.PenStyle.DashLine)
        pen.setCosmetic(True)
        self._line = scene.addPath(self._path, pen)
        self._line.setZValue(3.0)

    def move(self, place: QPointF) -> None:
        """Follow the mouse."""
        stretch = QPainterPath(self._path.currentPosition())
        stretch.lineTo(place)
        self._path.lineTo(place)
        self._line.setPath(self._path)
        for wire in self._scene.wires.values():
            if not wire.chosen and wire.shape().intersects(stretch):
                wire.set_chosen(True)

    def end(self) -> tuple[Patch, str] | None:
        """Take the stroke away, and return the patch without the wires that it has crossed."""
        crossed = self._scene.chosen_wires()
        self._scene.removeItem(self._line)
        self._scene.choose(None)
        return self._scene.patch.disconnect(crossed), disconnection(len(crossed))
