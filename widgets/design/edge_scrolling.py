"""Scrolling of a view while something is dragged to its edge."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, QPoint, Qt, QTimer
from PySide6.QtGui import QDragMoveEvent, QMouseEvent
from PySide6.QtWidgets import QApplication

from underfoot.widgets.design.node_list import MIME
from underfoot.widgets.design.patch_view import PatchView

EDGE_PX = 24
"""Distance from the edge at which the view begins to scroll."""

MAX_STEP_PX = 24
_INTERVAL_MS = 16
_SLOWNESS = 8
"""Pixels past the begin of the edge for one more pixel of a step."""


class EdgeScrolling(QObject):
    """Scrolls a view for as long as the left button holds something at its edge or beyond, the faster the further.

    A node that is dragged here from the list crosses an edge on its way. It scrolls only after it was further within.
    """

    def __init__(self, view: PatchView, is_held: Callable[[], bool]) -> None:
        super().__init__(view)
        self._view, self._is_held = view, is_held
        self._pressed_at = QPoint()
        self._scrolled = QPoint()
        """By how many pixels the drag has scrolled the view."""
        self._was_within = False
        self._move: QMouseEvent | QDragMoveEvent | None = None
        self._timer = QTimer(self, interval=_INTERVAL_MS)
        self._timer.timeout.connect(self._scroll)
        view.viewport().installEventFilter(self)

    @property
    def is_scrolling(self) -> bool:
        """Whether it scrolls now."""
        return self._timer.isActive()

    def undo(self) -> None:
        """Bring the view back to where it was before the drag."""
        self._timer.stop()
        if not self._scrolled.isNull():
            self._view.pan(-self._scrolled.x(), -self._scrolled.y())
        self._scrolled = QPoint()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QMouseEvent):
            self._follow(event)
        elif isinstance(event, QDragMoveEvent) and event.mimeData().hasFormat(MIME):
            self._follow_from_list(event)
        elif event.type() == QEvent.Type.DragLeave:
            self._timer.stop()  # it may come back, or be given up
        elif event.type() == QEvent.Type.Drop:
            self._timer.stop()
            self._scrolled = QPoint()
        return False

    def _follow(self, event: QMouseEvent) -> None:
        at = event.position().toPoint()
        if event.button() == Qt.MouseButton.LeftButton:  # it goes down or up
            self._pressed_at, self._scrolled = at, QPoint()
        is_drag = event.type() == QEvent.Type.MouseMove and event.buttons() == Qt.MouseButton.LeftButton
        has_moved = (at - self._pressed_at).manhattanLength() >= QApplication.startDragDistance()
        self._scroll_for(event.clone() if is_drag and (has_moved or self.is_scrolling) else None)

    def _follow_from_list(self, event: QDragMoveEvent) -> None:
        at = event.position().toPoint()
        if event.type() == QEvent.Type.DragEnter or self._step(at).isNull():
            self._was_within = event.type() != QEvent.Type.DragEnter
        how = event.possibleActions(), event.mimeData(), event.buttons(), event.modifiers()
        self._scroll_for(QDragMoveEvent(at, *how) if self._was_within else None)

    def _scroll_for(self, move: QMouseEvent | QDragMoveEvent | None) -> None:
        """Scroll from now on if this move is at the edge, and repeat it; else stop."""
        self._move = move
        if move is None or self._step(move.position().toPoint()).isNull():
            self._timer.stop()
        elif not self.is_scrolling:
            self._timer.start()

    def _step(self, at: QPoint) -> QPoint:
        """Return by how many pixels the view scrolls with the mouse here."""
        size = self._view.viewport().size()
        return QPoint(_step(at.x(), size.width()), _step(at.y(), size.height()))

    def _scroll(self) -> None:
        view, move = self._view, self._move
        is_interrupted = QApplication.activePopupWidget() or QApplication.activeModalWidget()  # which take the release
        if move is None or (isinstance(move, QMouseEvent) and (is_interrupted or not self._is_held())):
            self._timer.stop()
            return
        by = self._step(move.position().toPoint())
        self._scrolled += by
        view.pan(by.x(), by.y())
        QApplication.sendEvent(view.viewport(), move)  # what is dragged stays under the mouse


def _step(at: int, size: int) -> int:
    """Return the step along one axis of a view of this size."""
    past = min(at - EDGE_PX, 0) + max(at - (size - EDGE_PX), 0)
    return round(min(max(past / _SLOWNESS, -MAX_STEP_PX), MAX_STEP_PX))
