"""The time axis of a recording: scrolling, zooming, scrubbing and selection with mouse and keys."""

import math
from bisect import bisect_left
from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QPoint, QPointF, QRectF, QSignalBlocker, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
    QShortcut,
    QWheelEvent,
)
from PySide6.QtWidgets import QScrollBar, QSizePolicy, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.pictures import blank_picture, paint_focus
from underfoot.widgets.recordings.tracks import GUTTER_PX, RULER_PX, RecordingContent, TimelineView, TrackPainter

MIN_VIEW_S = 0.01
"""The shortest visible range."""
ZOOM = 1.6
"""The zoom factor of a key or a button."""
_SHARED_KEYS = (
    *(Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Minus, Qt.Key.Key_0, Qt.Key.Key_Backspace),
    *(Qt.Key.Key_BracketLeft, Qt.Key.Key_BracketRight, Qt.Key.Key_Comma, Qt.Key.Key_Period),
)
"""Keys that a table would take for a search."""
_SCROLL_STEPS = 10_000
"""Values of the scroll bar over a whole recording."""


class Axis(QWidget):
    """The picture of a recording over time, with its cursor and a selected range."""

    cursor_moved = Signal(float)
    """Seconds of the recording."""
    view_changed = Signal()
    selected = Signal()
    """The selected time range has changed."""
    step_chosen = Signal(int)
    """The number of a step in the list."""
    tile_chosen = Signal(int)
    """A row of the floor."""
    menu_requested = Signal(QPoint)
    """A menu for the time of the cursor is wanted, at this place of the screen."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Time axis of the recording")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(320, 240)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setMouseTracking(True)
        self.content: RecordingContent | None = None
        self.view = TimelineView()
        self.cursor_s = 0.0
        self.selection: tuple[float, float] | None = None
        self.playing_s = math.nan
        self.note = ""
        self._picture: QPixmap | None = None
        self._drag = ""
        self._from_s = self._from_x = 0.0

    # --- display ---

    def show_content(self, content: RecordingContent | None, note: str = "") -> None:
        """Show another recording, from its beginning to its end; `note` says why there is none."""
        self.content, self.note = content, note
        self.cursor_s, self.selection, self.playing_s = 0.0, None, math.nan
        self.view = TimelineView(0.0, max(self.length_s, MIN_VIEW_S))
        self.redraw()
        self.view_changed.emit()
        self.selected.emit()

    def update_colours(self) -> None:
        """Repaint in the current colours."""
        self._picture = None

    def redraw(self) -> None:
        """Repaint after the recording has grown."""
        self._picture = None
        self.update()

    @property
    def length_s(self) -> float:
        """Seconds of the recording."""
        return self.content.opened.length_s if self.content is not None else 1.0

    @property
    def seconds_per_px(self) -> float:
        """Seconds per pixel."""
        return (self.view.end_s - self.view.begin_s) / max(self.width() - GUTTER_PX, 1)

    def set_view(self, begin_s: float, end_s: float) -> None:
        """Show this time range in seconds, limited to the recording."""
        whole_s = max(self.length_s, MIN_VIEW_S)
        span_s = min(max(end_s - begin_s, MIN_VIEW_S), whole_s)
        begin_s = min(max(begin_s, 0.0), whole_s - span_s)
        if (begin_s, begin_s + span_s) != (self.view.begin_s, self.view.end_s):
            self.view.begin_s, self.view.end_s = begin_s, begin_s + span_s
            self.redraw()
            self.view_changed.emit()

    def zoom(self, factor: float, about_s: float | None = None) -> None:
        """Zoom by `factor` about a time in seconds, or the cursor."""
        view = self.view
        at = about_s if about_s is not None else self.cursor_s
        if not view.begin_s <= at <= view.end_s:
            at = 0.5 * (view.begin_s + view.end_s)
        self.set_view(at - (at - view.begin_s) / factor, at + (view.end_s - at) / factor)

    def show_all(self) -> None:
        """Show the whole recording."""
        self.set_view(0.0, self.length_s)

    def scroll(self, share: float) -> None:  # type: ignore[override]
        """Scroll by a share of the visible range."""
        span_s = self.view.end_s - self.view.begin_s
        self.set_view(self.view.begin_s + share * span_s, self.view.end_s + share * span_s)

    def set_cursor(self, time_s: float, *, follow: bool = True) -> None:
        """Set the cursor, and with `follow` scroll to it."""
        self.cursor_s = min(max(time_s, 0.0), self.length_s)
        span_s = self.view.end_s - self.view.begin_s
        if follow and not self.view.begin_s <= self.cursor_s <= self.view.end_s:
            self.set_view(self.cursor_s - 0.1 * span_s, self.cursor_s + 0.9 * span_s)
        self.cursor_moved.emit(self.cursor_s)
        self.update()

    def set_playing(self, time_s: float) -> None:
        """Show the playback position; NaN for none. The view follows it if it was visible."""
        view, before_s, self.playing_s = self.view, self.playing_s, time_s
        if view.begin_s <= before_s <= view.end_s and (time_s < view.begin_s or time_s > view.end_s):
            self.set_view(time_s, time_s + view.end_s - view.begin_s)
        self.update()

    def select(self, begin_s: float, end_s: float) -> None:
        """Select a time range; a range of at most one pixel clears the selection."""
        begin_s, end_s = max(min(begin_s, end_s), 0.0), min(max(begin_s, end_s), self.length_s)
        self.selection = (begin_s, end_s) if end_s - begin_s > self.seconds_per_px else None
        self.selected.emit()
        self.update()

    def choose_step(self, number: int) -> None:
        """Select a step, and scroll to it."""
        self.view.step = number
        if self.content is not None and number >= 0:
            step = self.content.steps[number].step
            begin_s, end_s = step.start_s, step.end_s
            if begin_s < self.view.begin_s or end_s > self.view.end_s:
                span_s = max(self.view.end_s - self.view.begin_s, 1.5 * (end_s - begin_s))
                self.set_view(begin_s - 0.3 * span_s, begin_s + 0.7 * span_s)
        self.redraw()

    def choose_tile(self, tile: int) -> None:
        """Show the vibration of a tile, by its row of the floor."""
        if tile != self.view.tile:
            self.view.tile = tile
            self.redraw()
            self.view_changed.emit()

    # --- positions ---

    def time_at(self, x: float) -> float:
        """Return the time at the pixel `x`, in seconds."""
        tracks = self.painter()
        share = (x - tracks.left) / (tracks.right - tracks.left)
        return self.view.begin_s + share * (self.view.end_s - self.view.begin_s)

    def painter(self) -> TrackPainter:
        """Return what paints the tracks as they are shown, and knows where everything lies."""
        assert self.content is not None
        return TrackPainter(self.content, self.view, self.width(), self.height())

    # --- mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if self.content is None:
            return
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        at = event.position()
        self._from_s, self._from_x = self.time_at(at.x()), at.x()
        if event.button() == Qt.MouseButton.MiddleButton:
            self._drag = "scroll"
        elif event.button() == Qt.MouseButton.LeftButton:
            in_ruler = at.y() < RULER_PX or bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            self._drag = "select" if in_ruler else "scrub"
            if self._drag == "scrub" and self._choose_at(at):
                self._drag = ""  # set the cursor to the step's beginning
            elif self._drag == "scrub":
                self.set_cursor(self._from_s, follow=False)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if not event.buttons():
            self._drag = ""  # a dialog took the release
        if self.content is None or not self._drag:
            return
        now_s = self.time_at(event.position().x())
        if self._drag == "scroll":
            self.set_view(self.view.begin_s + self._from_s - now_s, self.view.end_s + self._from_s - now_s)
        elif self._drag == "select":
            self.select(self._from_s, now_s)
        else:
            self.set_cursor(now_s)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._drag == "select" and abs(event.position().x() - self._from_x) < 3.0:
            self.select(0.0, 0.0)
            self.set_cursor(self._from_s, follow=False)
        self._drag = ""

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Zoom to the contact under the mouse."""
        for contact, bar in self.painter().bars() if self.content is not None else ():
            if bar.adjusted(-2, 0, 2, 0).contains(event.position()):
                length_s = contact.end_s - contact.start_s
                self.set_view(contact.start_s - 0.25 * length_s, contact.end_s + 0.25 * length_s)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Ask for a menu, with the cursor where the mouse was pressed."""
        if self.content is not None and not self._drag:
            if event.reason() == QContextMenuEvent.Reason.Mouse:
                self.set_cursor(self.time_at(event.pos().x()), follow=False)
            self.menu_requested.emit(event.globalPos())

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.content is None:
            return
        across, down = event.angleDelta().x(), event.angleDelta().y()
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier or abs(across) > abs(down):
            self.scroll(-(across or down) / 1200.0)
        else:
            self.zoom(ZOOM ** (down / 120.0), self.time_at(event.position().x()))
        event.accept()

    def _choose_at(self, at: QPointF) -> bool:
        """Select the step or the tile under the mouse; return whether there was a step."""
        tracks = self.painter()
        assert self.content is not None
        tiles = tracks.tracks["tiles"]
        if tiles.top <= at.y() < tiles.bottom and at.x() >= tracks.left:
            count = len(self.content.opened.floor.tiles)
            self.tile_chosen.emit(int((at.y() - tiles.top) / (tiles.bottom - tiles.top) * count))
        for contact, bar in tracks.bars():
            if bar.adjusted(-2, 0, 2, 0).contains(at) and contact.id in self.content.number_of:
                self.step_chosen.emit(self.content.number_of[contact.id])
                return True
        return False

    # --- keys ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        is_fine = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if not self.handle_key(Qt.Key(event.key()), is_fine=is_fine):
            super().keyPressEvent(event)

    def forward_keys_of(self, widget: QWidget) -> None:
        """Handle characters that are typed while `widget` has the focus."""
        for key in _SHARED_KEYS:
            QShortcut(key, widget, partial(self.handle_key, key)).setContext(
                Qt.ShortcutContext.WidgetWithChildrenShortcut
            )

    def handle_key(self, key: Qt.Key, *, is_fine: bool = False) -> bool:
        """Handle a key; return whether it had an effect."""
        step_s = 0.001 if is_fine else 5.0 * self.seconds_per_px
        acts: dict[Qt.Key, Callable[[], None]] = {
            Qt.Key.Key_Left: lambda: self.set_cursor(self.cursor_s - step_s),
            Qt.Key.Key_Right: lambda: self.set_cursor(self.cursor_s + step_s),
            Qt.Key.Key_Home: lambda: self.set_cursor(0.0),
            Qt.Key.Key_End: lambda: self.set_cursor(self.length_s),
            Qt.Key.Key_PageUp: lambda: self.scroll(-0.8),
            Qt.Key.Key_PageDown: lambda: self.scroll(0.8),
            Qt.Key.Key_Plus: lambda: self.zoom(ZOOM),
            Qt.Key.Key_Equal: lambda: self.zoom(ZOOM),
            Qt.Key.Key_Minus: lambda: self.zoom(1.0 / ZOOM),
            Qt.Key.Key_0: self.show_all,
            Qt.Key.Key_BracketLeft: lambda: self.select(self.cursor_s, (self.selection or (0.0, self.length_s))[1]),
            Qt.Key.Key_BracketRight: lambda: self.select((self.selection or (0.0, 0.0))[0], self.cursor_s),
            Qt.Key.Key_Backspace: lambda: self.select(0.0, 0.0),
            Qt.Key.Key_Comma: lambda: self._next_step(-1),
            Qt.Key.Key_Period: lambda: self._next_step(1),
        }
        act = acts.get(key)
        if act is None or self.content is None:
            return False
        act()
        return True

    def _next_step(self, direction: int) -> None:
        """Select the step after the selected one (`direction` 1) or before it (-1). If the cursor is not at the
        selected step, start from the cursor. Steps that do not match the filters are skipped.
        """
        if self.content is None or not self.content.visible_steps:
            return
        numbers = sorted(self.content.visible_steps, key=self._start_s)
        if self.view.step in numbers and self._start_s(self.view.step) == self.cursor_s:
            place = numbers.index(self.view.step)
        else:
            place = bisect_left(numbers, self.cursor_s, key=self._start_s) - (direction > 0)
        self.step_chosen.emit(numbers[min(max(place + direction, 0), len(numbers) - 1)])

    def _start_s(self, number: int) -> float:
        assert self.content is not None
        return self.content.steps[number].step.start_s

    # --- paint ---

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._picture = None
        self.view_changed.emit()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        if self.content is None:
            painter.fillRect(self.rect(), QColor(theme.GROUND))
            painter.setPen(QColor(theme.MUTED))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, self.note)
        else:
            self._paint_tracks(painter, self.painter())
        if self.hasFocus():
            painter.setClipping(False)
            paint_focus(painter, QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def _paint_tracks(self, painter: QPainter, tracks: TrackPainter) -> None:
        if self._picture is None:
            self._picture = self._painted(tracks)
        painter.drawPixmap(0, 0, self._picture)
        top, bottom = tracks.tracks["force"].top, tracks.tracks["measured"].bottom
        clip = QRectF(tracks.left - 1.0, 0.0, tracks.right - tracks.left + 2.0, self.height())
        painter.setClipRect(clip)
        if self.selection is not None:
            left, right = (tracks.x(time_s) for time_s in self.selection)
            shade = QColor(theme.TEXT)
            shade.setAlphaF(0.10)
            painter.fillRect(QRectF(left, RULER_PX - 8.0, right - left, bottom - RULER_PX + 8.0), shade)
            painter.setPen(QPen(QColor(theme.MUTED), 1.0))
            for x in (left, right):
                painter.drawLine(QPointF(x, RULER_PX - 8.0), QPointF(x, bottom))
        x = tracks.x(self.cursor_s)
        painter.setPen(QPen(QColor(theme.TEXT), 1.0))
        painter.drawLine(QPointF(x, top - 8.0), QPointF(x, bottom))
        if math.isfinite(self.playing_s):
            x = tracks.x(self.playing_s)
            painter.setPen(QPen(QColor(theme.VIBRATION), 2.0))
            painter.drawLine(QPointF(x, top - 8.0), QPointF(x, bottom))

    def _painted(self, tracks: TrackPainter) -> QPixmap:
        picture = blank_picture(self.size(), self.devicePixelRatioF(), QColor(theme.GROUND))
        painter = QPainter(picture)
        tracks.paint(painter)
        painter.end()
        return picture


class Timeline(QWidget):
    """The axis with a scroll bar."""

    def __init__(self) -> None:
        super().__init__()
        self.axis = Axis()
        self.bar = QScrollBar(Qt.Orientation.Horizontal)
        self.bar.setAccessibleName("Scroll through the recording")
        self.bar.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.axis, 1)
        layout.addWidget(self.bar)
        self.setFocusProxy(self.axis)
        self.axis.view_changed.connect(self._show_view)
        self.bar.valueChanged.connect(self._scroll)

    def _show_view(self) -> None:
        view, whole_s = self.axis.view, max(self.axis.length_s, MIN_VIEW_S)
        seen = round(_SCROLL_STEPS * (view.end_s - view.begin_s) / whole_s)
        with QSignalBlocker(self.bar):
            self.bar.setRange(0, max(_SCROLL_STEPS - seen, 0))
            self.bar.setPageStep(max(seen, 1))
            self.bar.setValue(round(_SCROLL_STEPS * view.begin_s / whole_s))
        self.bar.setVisible(seen < _SCROLL_STEPS)

    def _scroll(self, value: int) -> None:
        view = self.axis.view
        begin_s = value / _SCROLL_STEPS * self.axis.length_s
        self.axis.set_view(begin_s, begin_s + view.end_s - view.begin_s)
