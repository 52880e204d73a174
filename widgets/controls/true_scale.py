"""A full-screen window with the floor at true scale, for a projector above it."""

import math

from msgspec import Struct
from msgspec.structs import replace
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QTransform

from underfoot import quantities
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.arrow_keys import ARROWS
from underfoot.widgets.controls.full_screen import FullScreenWindow
from underfoot.widgets.controls.key_names import with_native_keys

SCALE_STEP, FINE_STEP = 1.01, 1.001
MOVE_M, FINE_M = 0.005, 0.001
TURN_DEG, FINE_DEG = 1.0, 0.1
MIN_SCALE, MAX_SCALE = 0.05, 20.0
_TURNS = {Qt.Key.Key_Comma: 1, Qt.Key.Key_Period: -1}
SHORTCUT = ("On the floor: scale, move, turn, reset, close; finer with Ctrl", "+ −, arrows, comma and period, 0, Esc")
"""What the list of keys says of these."""


class Placement(Struct, frozen=True):
    """The placement of a picture on the screen: scale, offset from the screen's centre in metres (right and up),
    rotation to the left in degrees.

    >>> Placement(scale=100.0).limited().scale, Placement(turn_deg=181.0).limited().turn_deg
    (20.0, -179.0)
    """

    scale: float = 1.0
    at_m: tuple[float, float] = (0.0, 0.0)
    turn_deg: float = 0.0

    def limited(self) -> "Placement":
        """Return the placement with the scale limited to its range, and the rotation to half a turn."""
        scale, turn_deg = min(max(self.scale, MIN_SCALE), MAX_SCALE), math.remainder(self.turn_deg, 360.0)
        return replace(self, scale=scale, turn_deg=round(turn_deg, 3))


class TrueScaleWindow(FullScreenWindow):
    """A window at true scale. Plus and minus scale, arrows move, comma and period rotate; Ctrl makes steps finer; 0
    resets, Escape closes.
    """

    adjusted = Signal(object)
    """The new `Placement`."""

    def __init__(self, placement: Placement) -> None:
        super().__init__()
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setCursor(Qt.CursorShape.BlankCursor)
        self.placement = placement.limited()

    @property
    def px_per_m(self) -> float:
        """Pixels per metre of the floor, from the screen's reported size and the scale."""
        return self.screen_px_per_m * self.placement.scale

    def to_pixels(self) -> QTransform:
        """Return the transform from metres about the centre, y upwards, to pixels of the view."""
        moved = QTransform.fromTranslate(self.width() / 2, self.height() / 2).scale(self.px_per_m, -self.px_per_m)
        return moved.translate(*self.placement.at_m).rotate(self.placement.turn_deg)

    def place(self, at_m: tuple[float, float]) -> QPointF:
        """Return a point, in metres about the centre with y upwards, in pixels of the view."""
        return self.to_pixels().map(QPointF(*at_m))

    def paint_hint(self, painter: QPainter, more: str) -> None:
        """Paint scale, offset and rotation with their keys at the lower edge, in as many lines as the screen needs.

        `more` are further keys. The ground is black, whatever the window has.
        """
        flags = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignBottom | Qt.TextFlag.TextWordWrap
        area = QRectF(self.rect()).adjusted(theme.GRID, 0, -theme.GRID, -theme.GRID)
        painter.setFont(theme.font())
        top = painter.boundingRect(area, flags, self._hint(more)).top() - theme.GRID
        painter.fillRect(QRectF(0.0, top, self.width(), self.height() - top), QColor("black"))
        painter.setPen(QColor(theme.colours("dark")["muted"]))
        painter.drawText(area, flags, self._hint(more))

    def _hint(self, more: str) -> str:
        """Return the parts of the hint, each of which stays in one line."""
        right, up = (quantity(part, "m") if part else "0 mm" for part in self.placement.at_m)
        parts = (
            f"Scale {quantities.number(100 * self.placement.scale, 4)} %  (+ and −; with Ctrl finer)",
            f"Moved {right} right, {up} up  (arrows)",
            f"Turned {quantities.number(self.placement.turn_deg, 4)}°  (, and .)",
            "0: reset",
            more,
            "Esc: close",
        )
        return with_native_keys("      ".join(part.replace(" ", "\u00a0") for part in parts))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        fine = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        step = FINE_STEP if fine else SCALE_STEP
        now = self.placement
        match event.key():
            case Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal:
                self._adjust(replace(now, scale=now.scale * step))
            case Qt.Key.Key_Minus:
                self._adjust(replace(now, scale=now.scale / step))
            case Qt.Key.Key_0:
                self._adjust(Placement())
            case key if key in ARROWS:
                move = FINE_M if fine else MOVE_M
                right, up = ARROWS[Qt.Key(key)]
                self._adjust(replace(now, at_m=(now.at_m[0] + right * move, now.at_m[1] + up * move)))
            case Qt.Key.Key_Comma | Qt.Key.Key_Period:
                turn_deg = _TURNS[Qt.Key(event.key())] * (FINE_DEG if fine else TURN_DEG)
                self._adjust(replace(now, turn_deg=now.turn_deg + turn_deg))
            case _:
                super().keyPressEvent(event)

    def _adjust(self, placement: Placement) -> None:
        self.placement = placement.limited()
        self.adjusted.emit(self.placement)
        self.update()
