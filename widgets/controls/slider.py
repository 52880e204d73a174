"""A thin slider that moves to a click, and is filled from its zero."""

from PySide6.QtCore import QEvent, QRectF, QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QSlider, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.wheel import takes_wheel
from underfoot.widgets.lost_release import is_release_lost

STEPS = 1000
KNOB_PX = 5.0
FINE = 0.1
"""The part of the mouse's way that the knob goes while Shift is held."""


class Slider(QSlider):
    """A position from 0 to 1. `moved` follows every change by the user; `edit_began` precedes a drag or a key press.

    With Shift both are finer.
    """

    moved = Signal(float)
    edit_began = Signal()
    reset_requested = Signal()
    """By a double-click, whose first press has moved the slider, so that both are one edit."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(Qt.Orientation.Horizontal, parent)
        self.setRange(0, STEPS)
        self.setSingleStep(10)
        self.setPageStep(100)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.is_scale = False
        """Whether all of it is a scale to answer on, so that its ends are to be seen."""
        self._zero = 0.0
        self._position = 0.0
        self._accent = theme.VIBRATION
        self._range_shown: tuple[float, float] | None = None
        self._held_x = self._held_at = 0.0
        self._is_set = True
        self.valueChanged.connect(self._changed)

    def position(self) -> float:
        return self._position

    def set_position(self, position: float) -> None:
        """Set the position, without emitting a change."""
        self._is_set = True
        self._position = min(max(position, 0.0), 1.0)
        with QSignalBlocker(self):
            self.setValue(round(self._position * STEPS))
        self.update()

    def set_zero(self, zero: float) -> None:
        """Set the position from which the slider is filled."""
        self._zero = min(max(zero, 0.0), 1.0)

    def set_accent(self, colour: str) -> None:
        self._accent = colour
        self.update()

    def update_colours(self) -> None:
        """Update the fill to the current colours."""
        self._accent = theme.current_colour(self._accent)

    def set_range_shown(self, band: tuple[float, float] | None) -> None:
        """Show a range in which a signal moves the value, instead of one position."""
        if band != self._range_shown:
            self._range_shown = band
            self.update()

    @property
    def is_set(self) -> bool:
        """Whether it shows a position."""
        return self._is_set

    def clear(self) -> None:
        """Show no position until the user moves the slider."""
        self._is_set = False
        self.update()

    def _changed(self, value: int) -> None:
        self._is_set, self._position = True, value / STEPS
        self.moved.emit(self._position)

    def sizeHint(self) -> QSize:
        return QSize(120, 16)

    def minimumSizeHint(self) -> QSize:
        return QSize(48, 16)

    def step(self, way: int, *, is_fine: bool) -> None:
        """Move by a hundredth of the way, 1 up or -1 down, or if fine by a thousandth, as a change by the user."""
        self.setSingleStep(1 if is_fine else 10)
        self.setValue(self.value() + way * self.singleStep())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.edit_began.emit()
            self.setSliderDown(True)
            self._held_x, self._held_at = event.position().x(), self._position
            self._go(event)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if self.is_scale or event.button() != Qt.MouseButton.LeftButton:
            self.mousePressEvent(event)  # an answer has no default
        else:
            self.reset_requested.emit()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self.isSliderDown():
            self._go(event)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self.setSliderDown(False)
        self.update()

    def event(self, event: QEvent) -> bool:
        if is_release_lost(event):
            self.setSliderDown(False)
        return super().event(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if takes_wheel(self, event):
            super().wheelEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        fine = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        self.setSingleStep(1 if fine else 10)
        if not event.isAutoRepeat():
            self.edit_began.emit()
        super().keyPressEvent(event)

    def _go(self, event: QMouseEvent) -> None:
        x, room = event.position().x(), self.width() - 2 * KNOB_PX
        is_fine = self._is_set and event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        place = self._held_at + FINE * (x - self._held_x) / room if is_fine else (x - KNOB_PX) / room
        self._held_x, self._held_at = x, min(max(place, 0.0), 1.0)
        value = round(self._held_at * STEPS)
        if not self._is_set and value == self.value():
            self._changed(value)  # Qt reports only changed values
        self.setValue(value)
        event.accept()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        middle, room = self.height() / 2, self.width() - 2 * KNOB_PX
        painter.setBrush(QColor(theme.FAINT if self.is_scale else theme.RAISED))
        painter.drawRoundedRect(QRectF(0.0, middle - 2, self.width(), 4.0), 2.0, 2.0)
        if not self._is_set:
            return
        x, zero = KNOB_PX + self._position * room, KNOB_PX + self._zero * room
        left = 0.0 if self._zero == 0.0 else min(x, zero)
        accent = self._accent if self.isEnabled() else theme.mixed(self._accent, theme.PANEL, 0.5)
        painter.setBrush(QColor(accent))
        if self._range_shown is not None:
            low, high = (KNOB_PX + min(max(position, 0.0), 1.0) * room for position in self._range_shown)
            painter.setBrush(QColor(self._accent))
            painter.drawRoundedRect(QRectF(low - 2, middle - 3, high - low + 4, 6.0), 3.0, 3.0)
            return
        painter.drawRoundedRect(QRectF(left, middle - 2, max(x, zero) - left, 4.0), 2.0, 2.0)
        if not self.isEnabled():
            return
        painter.setBrush(QColor(theme.TEXT))
        painter.setPen(QPen(QColor(accent), 2.0) if self.hasFocus() else QPen(QColor(theme.PANEL), 1.0))
        painter.drawEllipse(QRectF(x - KNOB_PX, middle - KNOB_PX, 2 * KNOB_PX, 2 * KNOB_PX))
