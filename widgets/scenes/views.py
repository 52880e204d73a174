"""Views of a scene: in the workspace, fitted to its pane, and on a projector, at true scale."""

import time
from collections import deque
from collections.abc import Callable

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal, SignalInstance
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPolygonF, QTransform
from PySide6.QtWidgets import QSizePolicy

from underfoot.floor.layout import Floor
from underfoot.scenes.scene import Scene
from underfoot.widgets import theme
from underfoot.widgets.controls.true_scale import Placement, TrueScaleWindow
from underfoot.widgets.floor_map import fitted
from underfoot.widgets.pressed_floor import PressedFloor
from underfoot.widgets.scenes.painting import paint_shapes

KEPT = 500
ON_BLACK = "dark"
"""The palette of what is drawn beside a scene, whose ground is black whatever the window has."""
HINT_S = 6.0
"""Time for which the projector's keys are shown after it was opened or adjusted."""


class PaintTimes:
    """Rate of paintings, and their delay after contacts began."""

    def __init__(self) -> None:
        self.display_latency_s: deque[float] = deque(maxlen=KEPT)
        """From a contact's onset until a picture with it was painted, by the session's clock."""
        self.clock: Callable[[], float] = lambda: 0.0
        """Seconds of the session."""
        self._ends_s: deque[float] = deque(maxlen=240)
        self._onsets_s: list[float] = []

    def add_onset(self, onset_s: float) -> None:
        """Note a contact that the next picture shows, by its beginning."""
        self._onsets_s.append(onset_s)

    def add_picture(self) -> None:
        """Note a finished picture."""
        self._ends_s.append(time.perf_counter())
        if self._onsets_s:
            now_s = self.clock()
            self.display_latency_s.extend(now_s - onset_s for onset_s in self._onsets_s)
            self._onsets_s.clear()

    @property
    def pictures_per_s(self) -> float:
        """Number of pictures in the last second."""
        now = time.perf_counter()
        return float(sum(end > now - 1.0 for end in self._ends_s))


class SceneView(PressedFloor):
    """The floor fitted to the pane, with the scene that plays. On a simulated floor the mouse acts as a foot."""

    failed = Signal(object)
    """The exception that the scene's picture raised."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Scene on the floor")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.times = PaintTimes()
        self._scene: Scene | None = None

    def show_floor(self, floor: Floor | None) -> None:
        """Show this floor, without a scene."""
        self._floor, self._pressed_tile = floor, ""
        self.update()

    def show_scene(self, scene: Scene | None) -> None:
        """Show a scene, or None."""
        self._scene = scene
        self.update()

    def to_screen(self) -> QTransform:
        assert self._floor is not None
        area = QRectF(self.rect()).adjusted(*[2.0 * theme.GRID] * 2, *[-2.0 * theme.GRID] * 2)
        return fitted(self._floor, area)

    def minimumSizeHint(self) -> QSize:
        return QSize(16 * theme.GRID, 30 * theme.GRID)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black"))
        if self._floor is None:
            return
        to_pixels = self.to_screen()
        painter.setPen(QPen(QColor(theme.colours(ON_BLACK)["line"]), 1.0))
        for tile in self._floor.tiles:
            painter.drawPolygon(to_pixels.map(QPolygonF([QPointF(x, y) for x, y in tile.corners_m().tolist()])))
        if self._scene is not None:
            _paint_scene(self._scene, painter, to_pixels, self.failed)
            painter.end()
            self.times.add_picture()

    # --- a foot made with the mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._press(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pressed_tile:
            self._press(event.position())


class SceneProjection(TrueScaleWindow):
    """A scene on a whole screen, at true scale; centred on the floor, and adjusted by keys."""

    failed = Signal(object)
    """The exception that the scene's picture raised."""

    def __init__(self, scene: Scene, placement: Placement) -> None:
        super().__init__(placement)
        self.setWindowTitle(f"{scene.title} on the floor – Underfoot")
        self.setAccessibleName("Scene at true size")
        self.times = PaintTimes()
        self._scene = scene
        low, high = scene.floor.bounds_m()
        self._middle_m = (0.5 * (low + high)).tolist()
        self._hint_until = time.perf_counter() + HINT_S
        self.adjusted.connect(self._show_hint)

    def to_pixels(self) -> QTransform:
        """Return the transform from the floor's frame to the screen's pixels."""
        return super().to_pixels().translate(-self._middle_m[0], -self._middle_m[1])

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black"))
        _paint_scene(self._scene, painter, self.to_pixels(), self.failed)
        if time.perf_counter() < self._hint_until:
            self.paint_hint(painter, "this line goes by itself")
        painter.end()
        self.times.add_picture()

    def _show_hint(self) -> None:
        self._hint_until = time.perf_counter() + HINT_S


def _paint_scene(scene: Scene, painter: QPainter, to_pixels: QTransform, failed: SignalInstance) -> None:
    """Paint the picture of a scene. What it raises is emitted: out of a `paintEvent` it would end the program."""
    try:
        paint_shapes(painter, scene.shapes(), to_pixels)
    except Exception as error:
        failed.emit(error)
