"""A window that fills a screen with the floor at its true size: for a projector above it."""

import math

from PySide6.QtCore import QPointF, Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeyEvent, QScreen
from PySide6.QtWidgets import QWidget

from underfoot import quantities
from underfoot.quantities import quantity

SCALE_STEP, FINE_STEP = 1.01, 1.001
MOVE_M, FINE_M = 0.005, 0.001
MIN_SCALE, MAX_SCALE = 0.05, 20.0
_DIRECTIONS = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, 1),
    Qt.Key.Key_Down: (0, -1),
}
_DEFAULT_PX_PER_M = 96.0 / 0.0254


class TrueScaleWindow(QWidget):
    """Plus and minus scale what is shown, arrow keys move it, with Ctrl finer; 0 resets, Escape closes."""

    adjusted = Signal(float, float, float)
    """The scale, and where the middle is, in metres right of and above the screen's."""
    closed = Signal()

    def __init__(self, scale: float = 1.0, at_m: tuple[float, float] = (0.0, 0.0)) -> None:
        super().__init__(None, Qt.WindowType.Window)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setCursor(Qt.CursorShape.BlankCursor)
        self.scale, self.at_m = min(max(scale, MIN_SCALE), MAX_SCALE), at_m

    def show_on(self, screen: QScreen) -> None:
        """Fill this screen."""
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()

    @property
    def px_per_m(self) -> float:
        """Pixels a metre of the floor, from the size that the screen says it has, and the scale."""
        screen = self.screen()
        per_m = 1e3 * screen.geometry().width() / screen.physicalSize().width() if screen.physicalSize().width() else 0
        return (per_m if math.isfinite(per_m) and per_m > 0 else _DEFAULT_PX_PER_M) * self.scale

    def place(self, at_m: tuple[float, float]) -> QPointF:
        """A place around what is in the middle, y upwards, in the view's pixels."""
        middle = QPointF(self.width() / 2, self.height() / 2)
        x, y = (part + moved for part, moved in zip(at_m, self.at_m, strict=True))
        return middle + QPointF(x, -y) * self.px_per_m

    def hint(self, more: str) -> str:
        """How it is scaled and moved, and the keys for that; `more` are keys besides."""
        right, up = (quantity(part, "m") if part else "0 mm" for part in self.at_m)
        return (
            f"Scale {quantities.number(100 * self.scale, 4)} %  (+ and −; with Ctrl finer)      "
            f"Moved {right} right, {up} up  (arrows)      0: reset      {more}      Esc: close"
        )

    def keyPressEvent(self, event: QKeyEvent) -> None:
        fine = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        step = FINE_STEP if fine else SCALE_STEP
        match event.key():
            case Qt.Key.Key_Escape:
                self.close()
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal:
                self._adjust(self.scale * step, self.at_m)
            case Qt.Key.Key_Minus:
                self._adjust(self.scale / step, self.at_m)
            case Qt.Key.Key_0:
                self._adjust(1.0, (0.0, 0.0))
            case Qt.Key.Key_Left | Qt.Key.Key_Right | Qt.Key.Key_Up | Qt.Key.Key_Down:
                move = FINE_M if fine else MOVE_M
                right, up = _DIRECTIONS[Qt.Key(event.key())]
                self._adjust(self.scale, (self.at_m[0] + right * move, self.at_m[1] + up * move))
            case _:
                super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        self.closed.emit()

    def _adjust(self, scale: float, at_m: tuple[float, float]) -> None:
        self.scale, self.at_m = min(max(scale, MIN_SCALE), MAX_SCALE), at_m
        self.adjusted.emit(self.scale, *self.at_m)
        self.update()
