"""A floor from above, on which the mouse can act as a foot."""

from PySide6.QtCore import QEvent, QPointF, Signal
from PySide6.QtGui import QMouseEvent, QTransform
from PySide6.QtWidgets import QWidget

from underfoot.floor.layout import Floor, Tile
from underfoot.widgets.lost_release import is_release_lost

DEFAULT_PRESS_N = 400.0
"""Default force of a press with the mouse."""


class PressedFloor(QWidget):
    """Base of views of a floor. A press stays on the tile under the mouse until the button is released, or its release
    would not come here: the view is hidden, or a dialog or a menu opens.
    """

    pressed = Signal(str, float, float, float)
    """Tile, x and y in metres of its frame, force in newtons; 0 ends the press."""

    def __init__(self) -> None:
        super().__init__()
        self.can_press = False
        self._press_n = DEFAULT_PRESS_N
        self._floor: Floor | None = None
        self._pressed_tile = ""

    def to_screen(self) -> QTransform:
        """Return the transform from the floor's frame, whose y axis points away from the viewer, to pixels."""
        raise AssertionError(f"{type(self).__name__} shows no floor")

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._end_press()

    def event(self, event: QEvent) -> bool:
        if is_release_lost(event):
            self._end_press()
        return super().event(event)

    def _place_at(self, place: QPointF) -> tuple[Tile | None, tuple[float, float]]:
        """Return the tile at a point of the widget, if there is one, and the place in the floor's frame."""
        if self._floor is None:
            return None, (0.0, 0.0)
        back, _ = self.to_screen().inverted()
        at = back.map(place).toTuple()
        return self._floor.tile_at(at), at

    def _press(self, place: QPointF) -> None:
        """Press the tile at a point of the widget, and no other any more; if there is none, none."""
        tile, at = self._place_at(place)
        if tile is None or tile.id != self._pressed_tile:
            self._end_press()
        if tile is not None and self.can_press:
            self._pressed_tile = tile.id
            x, y = tile.to_tile(at)
            self.pressed.emit(tile.id, float(x), float(y), self._press_n)

    def _end_press(self) -> None:
        if self._pressed_tile:
            tile, self._pressed_tile = self._pressed_tile, ""
            self.pressed.emit(tile, 0.0, 0.0, 0.0)
