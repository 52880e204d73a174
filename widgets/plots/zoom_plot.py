"""A plot whose x axis is zoomed by wheel, by dragging over a range, and by keys. Its owner handles the requests."""

import math

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QWheelEvent

from underfoot.drawing.layout import Margins
from underfoot.widgets import theme
from underfoot.widgets.lost_release import is_release_lost
from underfoot.widgets.plots.plot import Plot

ZOOM_STEP = 1.25
"""Zoom factor of one step of the wheel or a key."""
_MIN_DRAG_PX = 6.0


class ZoomPlot(Plot):
    """Emits the position of the mouse, and the range of the x axis that the user wants to see."""

    pointed = Signal(float, float)
    """Position of the mouse on the x and the y axis; NaN outside them, and when it has left."""
    zoom_requested = Signal(float, float)
    """Zoom factor, and the fixed point on the x axis."""
    move_requested = Signal(float)
    """Shift to the right, as a share of the visible range."""
    range_requested = Signal(float, float)
    """Ends of the range that was dragged over."""
    full_range_requested = Signal()

    _drag_start: float | None = None  # of the class: events come before a plot is made

    def __init__(self, name: str, margins: Margins) -> None:
        super().__init__(name, margins)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._drag_end = 0.0

    # --- mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._is_inside(event.position()):
            self._drag_start = self._drag_end = event.position().x()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        super().mouseMoveEvent(event)
        at, frame = event.position(), self.frame
        inside = self._is_inside(at)
        self.pointed.emit(frame.x.value(at.x()) if inside else math.nan, frame.y.value(at.y()) if inside else math.nan)
        if self._drag_start is not None:
            self._drag_end = min(max(at.x(), frame.area.left), frame.area.right)
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or self._drag_start is None:
            return
        start, self._drag_start = self._drag_start, None
        self.update()
        if abs(self._drag_end - start) >= _MIN_DRAG_PX:
            self.range_requested.emit(*sorted(self.frame.x.value(px) for px in (start, self._drag_end)))

    def event(self, event: QEvent) -> bool:
        if self._drag_start is not None and is_release_lost(event):
            self._drag_start = None
            self.update()
        return super().event(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.full_range_requested.emit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        steps = event.angleDelta()
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier or steps.x():
            self.move_requested.emit(-0.1 * (steps.x() or steps.y()) / 120.0)
        else:
            self.zoom_requested.emit(ZOOM_STEP ** (steps.y() / 120.0), self.frame.x.value(event.position().x()))
        event.accept()

    def leaveEvent(self, event: object) -> None:
        super().leaveEvent(event)  # type: ignore[arg-type]
        self.pointed.emit(math.nan, math.nan)

    # --- keys ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        middle = 0.5 * (self.frame.x.low + self.frame.x.high)
        match event.key():
            case Qt.Key.Key_Plus | Qt.Key.Key_Equal:
                self.zoom_requested.emit(ZOOM_STEP, middle)
            case Qt.Key.Key_Minus:
                self.zoom_requested.emit(1.0 / ZOOM_STEP, middle)
            case Qt.Key.Key_Left:
                self.move_requested.emit(-0.1)
            case Qt.Key.Key_Right:
                self.move_requested.emit(0.1)
            case Qt.Key.Key_0 | Qt.Key.Key_Home:
                self.full_range_requested.emit()
            case _:
                super().keyPressEvent(event)

    # --- painting ---

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        painter = QPainter(self)
        if self._drag_start is not None:
            area = self.frame.area
            colour = QColor(theme.VIBRATION)
            colour.setAlpha(48)
            left, right = sorted((self._drag_start, self._drag_end))
            painter.fillRect(QRectF(left, area.top, right - left, area.bottom - area.top), colour)
        if self.hasFocus():
            painter.setPen(QColor(theme.VIBRATION))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 4.0, 4.0)

    def _is_inside(self, at: QPointF) -> bool:
        area = self.frame.area
        return area.left <= at.x() <= area.right and area.top <= at.y() <= area.bottom
