"""The plot widget of the window: shows a `Drawing`, and updates it as often as the screen can."""

import math

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QMetaMethod, QSize, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QMouseEvent, QPainter, QPaintEvent, QPixmap, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from underfoot.drawing import Drawing, spoken
from underfoot.drawing.layout import Frame, Margins, content_of, frame_of, is_cut_off, pixel_centre
from underfoot.drawing.shapes import Polyline
from underfoot.widgets import theme
from underfoot.widgets.pictures import blank_picture
from underfoot.widgets.plots import saving
from underfoot.widgets.plots.painting import paint, rectangle, width_px

FrameKey = tuple[object, ...]
"""What determines the frame of a plot; a plot with the same look keeps its frame."""


class Plot(QWidget):
    """Shows one drawing: with title, legend and labels, or compact in given margins.

    Everything around the data is painted once and cached until its look changes, so an update of a live plot costs
    only its data. That requires fixed ranges in a live drawing.
    """

    hovered = Signal(float)
    """Position of the mouse on the x axis; NaN outside it, and when the mouse has left."""
    wheeled = Signal(float)
    """The wheel was turned over the plot: a share of its width, negative towards its left end."""

    def __init__(self, name: str = "", margins: Margins | None = None) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setMinimumSize(64, 48)
        self.drawing = Drawing("", "", "")
        self._margins = margins
        self._pointer = math.nan
        self._frame: Frame | None = None
        self._frame_key: FrameKey = ()
        self._picture = QPixmap()

    def show_drawing(self, drawing: Drawing) -> None:
        """Show another drawing."""
        self.drawing = drawing
        if self._margins is None:
            self.setAccessibleName(spoken(drawing))
        key = _frame_key_of(drawing)
        if key is None or key != self._frame_key:
            self._frame = None
        self._frame_key = key or ()
        self.update()

    def set_margins(self, margins: Margins) -> None:
        """Set the margins around the axes of a compact plot."""
        if margins != self._margins:
            self._margins, self._frame = margins, None
            self.update()

    def point_at(self, x: float) -> None:
        """Mark a value of the x axis with a line; NaN removes it."""
        self._pointer = x
        self.update()

    @property
    def frame(self) -> Frame:
        """The axes, in the widget's pixels, and what is around them."""
        if self._frame is None:
            self._frame = frame_of(self.drawing, self.width(), self.height(), width_px, self._margins)
            self._picture = QPixmap()
        return self._frame

    @property
    def ranges(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the axes, in their units."""
        x, y = self.frame.x, self.frame.y
        return x.low, x.high, y.low, y.high

    def place(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert points [n, 2] from axis units to the widget's pixels."""
        return np.column_stack([self.frame.x.place(points[:, 0]), self.frame.y.place(points[:, 1])])

    def update_colours(self) -> None:
        """Repaint the cached frame after a change of colours."""
        self._frame = None

    def sizeHint(self) -> QSize:
        return QSize(400, 240)

    # --- Qt ---

    def resizeEvent(self, event: QEvent) -> None:
        self._frame = None

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        area = self.frame.area
        across = event.position().x()
        self.hovered.emit(self.frame.x.value(across) if area.left <= across <= area.right else math.nan)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.isSignalConnected(QMetaMethod.fromSignal(self.wheeled)):
            self.wheeled.emit(-(event.angleDelta().y() or -event.angleDelta().x()) / 600.0)
            event.accept()
        else:
            event.ignore()  # what lies around it may scroll

    def leaveEvent(self, event: QEvent) -> None:
        self.hovered.emit(math.nan)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        saving.show_menu(self, self.drawing, event)

    def paintEvent(self, event: QPaintEvent) -> None:
        frame = self.frame
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._painted(frame))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if is_cut_off(self.drawing):
            painter.setClipRect(rectangle(frame.area))
        for shape in content_of(self.drawing, frame, width_px):
            paint(painter, shape)
        if math.isfinite(self._pointer):
            at = pixel_centre(float(frame.x.place(self._pointer)))
            paint(painter, Polyline(np.array([[at, frame.area.top], [at, frame.area.bottom]]), "muted"))

    def _painted(self, frame: Frame) -> QPixmap:
        """Return the frame as a pixmap."""
        ratio = self.devicePixelRatioF()
        if self._picture.isNull() or self._picture.devicePixelRatio() != ratio:
            self._picture = blank_picture(self.size(), ratio, QColor(theme.GROUND))
            painter = QPainter(self._picture)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            for shape in frame.shapes:
                paint(painter, shape)
            painter.end()
        return self._picture


def _frame_key_of(drawing: Drawing) -> FrameKey | None:
    """Return what the frame depends on; None if it depends on the data."""
    given = [drawing.x_range, drawing.y_range] + ([drawing.right_range] if drawing.right else [])
    if None in given:
        return None
    legend = tuple(
        (series.name, series.style, series.colour, series.right)
        for series in drawing.series
        if series.has_key or series.right
    )
    axes = (drawing.x, drawing.y, drawing.right, drawing.x_log, drawing.y_log, drawing.equal)
    return (drawing.title, *axes, *given, *legend)
