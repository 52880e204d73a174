"""A small picture with handles to drag or move by keys, the base class of editors of modes, bars and curves."""

import math
from collections.abc import Callable, Sequence
from functools import partial

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.arrow_keys import ARROWS
from underfoot.widgets.lost_release import is_release_lost
from underfoot.widgets.pictures import paint_focus, paint_ground

NEAR_PX = 9.0
"""Distance from a handle within which the mouse hits it, in pixels."""
_STEPS = {Qt.Key.Key_N: 1, Qt.Key.Key_P: -1}
_TURNS = {Qt.Key.Key_PageUp: 1.0, Qt.Key.Key_PageDown: -1.0}


class HandlePad(QWidget):
    """Handles on a picture. Subclasses define their meaning and drawing.

    Mouse: a drag moves a handle, a double click adds one, the wheel changes the selected one, a right click removes
    one. Keys: N and P select, arrows move (with Shift in fine steps), Page Up and Down act as the wheel, Enter adds,
    Delete removes.
    """

    edit_began = Signal()
    """A new change begins: those that follow belong to it."""
    changed = Signal()
    """A person has changed something."""

    HEIGHT_PX = 128
    HEAD_PX, FOOT_PX = 17.0, 15.0
    """Room for words above the picture, and for the axis below."""

    def __init__(self) -> None:
        super().__init__()
        self.chosen = -1
        self._dragged = False
        self._edit_name = ""
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    # --- overridden by subclasses ---

    def handles(self) -> Sequence[QPointF]:
        """Return the positions of the handles, in pixels."""
        raise AssertionError(f"{type(self).__name__} has no handles")

    def drag(self, index: int, place: QPointF) -> None:
        """Move a handle to a position."""

    def nudge(self, index: int, steps_right: float, steps_up: float) -> None:
        """Take a handle some steps across and up: 1 for an arrow key, 0.1 with Shift."""

    def turn_wheel(self, index: int, steps: float) -> None:
        """Change a handle by wheel steps."""

    def add(self, place: QPointF | None) -> None:
        """Add a handle at `place`, or in a free place, and select it."""

    def remove(self, index: int) -> None:
        """Remove a handle."""

    def caption(self) -> str:
        """Return the text above the picture."""
        return ""

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        """Paint everything except frame, text and handles."""

    # --- used by subclasses ---

    @property
    def is_dragged(self) -> bool:
        """Whether a handle is being dragged; the axes must not change during a drag."""
        return self._dragged

    def area(self) -> QRectF:
        """Return the picture's rectangle, in pixels."""
        return QRectF(self.rect()).adjusted(1.0, self.HEAD_PX, -1.0, -self.FOOT_PX)

    def begin_edit(self, edit_name: str) -> None:
        """Begin a change; consecutive changes with the same name are one undo step."""
        if edit_name != self._edit_name:
            self._edit_name = edit_name
            self.edit_began.emit()

    def emit_changed(self) -> None:
        """Emit `changed` after a change."""
        self.changed.emit()
        self.update()

    def draw_axis_line(self, painter: QPainter, x: float, text: str) -> None:
        """Draw a line at `x` of the horizontal axis, with its label."""
        area = self.area()
        painter.setPen(QPen(QColor(theme.LINE), 1.0))
        painter.drawLine(QPointF(round(x) + 0.5, area.top()), QPointF(round(x) + 0.5, area.bottom()))
        painter.setPen(QColor(theme.MUTED))
        painter.setFont(theme.font(theme.SMALL_PX))
        width = painter.fontMetrics().horizontalAdvance(text) + 2.0
        left = min(max(x - 0.5 * width, area.left()), area.right() - width)
        painter.drawText(QRectF(left, area.bottom() + 1.0, width, 14.0), Qt.AlignmentFlag.AlignCenter, text)

    def sizeHint(self) -> QSize:
        return QSize(240, self.HEIGHT_PX)

    def minimumSizeHint(self) -> QSize:
        return QSize(192, self.HEIGHT_PX)

    # --- mouse ---

    def _handle_at(self, place: QPointF) -> int:
        """Return the index of the nearest handle within reach; -1 if there is none."""
        distances = [(QPointF(place - at).manhattanLength(), i) for i, at in enumerate(self.handles())]
        distance, nearest = min(distances, default=(math.inf, -1))
        return nearest if distance <= NEAR_PX else -1

    def mousePressEvent(self, event: QMouseEvent) -> None:
        found = self._handle_at(event.position())
        self._edit_name = ""
        self.chosen = found
        if found >= 0 and event.button() == Qt.MouseButton.RightButton:
            self._remove_chosen()
        elif found >= 0 and event.button() == Qt.MouseButton.LeftButton:
            self._dragged = True
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragged and 0 <= self.chosen < len(self.handles()):
            self.begin_edit(f"drag {self.chosen}")
            self.drag(self.chosen, event.position())
            self.update()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._let_go()

    def event(self, event: QEvent) -> bool:
        if self.is_dragged and is_release_lost(event):
            self._let_go()
        return super().event(event)

    def _let_go(self) -> None:
        self._dragged = False
        self._edit_name = ""
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self._handle_at(event.position()) < 0:
            self._edit_alone("add", partial(self.add, event.position()))

    def wheelEvent(self, event: QWheelEvent) -> None:
        # Scrolling the inspector with the wheel must not change values.
        if self.hasFocus() and 0 <= self.chosen < len(self.handles()):
            self.begin_edit(f"turn {self.chosen}")
            self.turn_wheel(self.chosen, event.angleDelta().y() / 120.0)
            event.accept()
        else:
            event.ignore()

    # --- keys ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, count = Qt.Key(event.key()), len(self.handles())
        is_chosen = 0 <= self.chosen < count
        step = 0.1 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1.0
        if key in _STEPS and count:
            first = 0 if _STEPS[key] > 0 else count - 1
            self.chosen = (self.chosen + _STEPS[key]) % count if is_chosen else first
        elif key in ARROWS and is_chosen:
            self.begin_edit(f"nudge {self.chosen}")
            across, up = ARROWS[key]
            self.nudge(self.chosen, step * across, step * up)
        elif key in _TURNS and is_chosen:
            self.begin_edit(f"turn {self.chosen}")
            self.turn_wheel(self.chosen, step * _TURNS[key])
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._edit_alone("add", partial(self.add, None))
        elif key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and is_chosen:
            self._remove_chosen()
        else:
            super().keyPressEvent(event)
        self.update()

    def _edit_alone(self, edit_name: str, edit: Callable[[], None]) -> None:
        """Do a change that is an undo step of its own, also beside others with its name."""
        self._edit_name = ""
        self.begin_edit(edit_name)
        edit()
        self._edit_name = ""

    def _remove_chosen(self) -> None:
        self._edit_alone("remove", partial(self.remove, self.chosen))
        self.chosen = min(self.chosen, len(self.handles()) - 1)
        self.update()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._edit_name = ""
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._edit_name = ""
        self.update()

    # --- drawing ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        area = self.area()
        paint_ground(painter, area)
        self.paint_picture(painter, area)
        for i, place in enumerate(self.handles()):
            is_chosen = i == self.chosen
            painter.setPen(QPen(QColor(theme.GROUND), 1.5))
            painter.setBrush(QColor(theme.TEXT if is_chosen else theme.VIBRATION))
            painter.drawEllipse(place, 4.5 if is_chosen else 3.5, 4.5 if is_chosen else 3.5)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QColor(theme.TEXT if 0 <= self.chosen < len(self.handles()) else theme.MUTED))
        line = QRectF(0.0, 0.0, self.width(), self.HEAD_PX - 1.0)
        text = painter.fontMetrics().elidedText(self.caption(), Qt.TextElideMode.ElideRight, self.width())
        painter.drawText(line, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, text)
        if self.hasFocus():
            paint_focus(painter, area)
