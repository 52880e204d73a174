"""Editor of a rhythm on its bar of 24 steps: notes are added, moved and resized by mouse or keys."""

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QMenu, QSizePolicy, QToolButton, QWidget

from underfoot.models.signals.rhythm import RHYTHMS, STEPS, Rhythm
from underfoot.parameters import Parameter, Rows
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import ParameterEditor
from underfoot.widgets.pictures import paint_focus, paint_ground

Note = tuple[float, float, float]
"""Step, length in steps, amplitude 0 to 1."""
MIN_AMPLITUDE = 0.05
_EDGE_PX = 4.0


def is_rhythm(parameter: Parameter) -> bool:
    """Return whether a parameter's rows are notes of a bar."""
    return isinstance(parameter, Rows) and [name for name, _, _ in parameter.columns] == ["step", "length", "amplitude"]


def placed(notes: Sequence[Note], index: int, note: Note) -> list[Note] | None:
    """Return the notes in order with note `index` replaced; None if it would overlap another or leave the bar.

    >>> placed([(0, 4, 1.0), (6, 2, 0.5)], 0, (0, 6, 1.0))
    [(0, 6, 1.0), (6, 2, 0.5)]
    >>> placed([(0, 4, 1.0), (6, 2, 0.5)], 0, (0, 7, 1.0)) is None
    True
    """
    step, length, amplitude = note
    if step < 0 or length < 1 or step + length > STEPS:
        return None
    others = [other for i, other in enumerate(notes) if i != index]
    if any(step < other[0] + other[1] and other[0] < step + length for other in others):
        return None
    return sorted([*others, (step, length, min(max(amplitude, MIN_AMPLITUDE), 1.0))])


class RhythmBar(QWidget):
    """24 steps from left to right; a note's height is its amplitude.

    Mouse: a click on an empty step adds a note; dragging moves it, its right edge changes its length, up and down its
    amplitude; a right click deletes it. Keys: N and P select a note, arrows move it or change its amplitude, Shift with
    arrows changes its length, Enter adds one in the first gap, Delete deletes it.
    """

    changed = Signal(object)
    """The notes, after every change by the user."""
    edit_began = Signal()
    """A change begins, to which the `changed` that follow belong."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._notes: list[Note] = []
        self._chosen = -1
        self._drag = ""
        self._drag_start = QPointF()
        self._note_before: Note = (0.0, 1.0, 1.0)  # as the drag began
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Rhythm")

    def notes(self) -> list[Note]:
        """Return the notes in order of their steps."""
        return list(self._notes)

    def set_notes(self, notes: Sequence[Sequence[float]]) -> None:
        """Show these notes, without emitting `changed`."""
        self._notes = [(float(n[0]), float(n[1]), float(n[2])) for n in notes]
        self._chosen = min(self._chosen, len(self._notes) - 1)
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(240, 104)

    def minimumSizeHint(self) -> QSize:
        return QSize(192, 104)

    # --- where things are ---

    def area(self) -> QRectF:
        """Return the rectangle of the steps, in pixels."""
        return QRectF(self.rect()).adjusted(1.0, 1.0, -1.0, -17.0)

    def _note_rect(self, note: Note) -> QRectF:
        bar = self.area()
        step_px = bar.width() / STEPS
        height = note[2] * bar.height()
        return QRectF(bar.x() + note[0] * step_px + 0.5, bar.bottom() - height, note[1] * step_px - 1.0, height)

    def _step_at(self, place: QPointF) -> int:
        bar = self.area()
        return min(max(int((place.x() - bar.x()) / bar.width() * STEPS), 0), STEPS - 1)

    def _note_at(self, place: QPointF) -> int:
        """Return the index of the note in this column, with some tolerance at its right edge; -1 if there is none."""
        at = (place.x() - self.area().x()) / self.area().width() * STEPS
        over = next((i for i, (step, length, _) in enumerate(self._notes) if step <= at < step + length), -1)
        if over >= 0:
            return over
        return next((i for i in range(len(self._notes)) if self._on_edge(place, i)), -1)

    def _on_edge(self, place: QPointF, index: int) -> bool:
        return abs(place.x() - self._note_rect(self._notes[index]).right()) <= _EDGE_PX

    def _amplitude_at(self, place: QPointF) -> float:
        bar = self.area()
        return round(min(max((bar.bottom() - place.y()) / bar.height(), MIN_AMPLITUDE), 1.0), 2)

    # --- mouse ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        place = event.position()
        found = self._note_at(place)
        self.edit_began.emit()
        if event.button() == Qt.MouseButton.RightButton:
            self._chosen = found
            self._remove()
        elif event.button() == Qt.MouseButton.LeftButton:
            if found < 0:
                new = (float(self._step_at(place)), 1.0, self._amplitude_at(place))
                self._set_notes(placed([*self._notes, new], len(self._notes), new), new)
                self._drag = "length"
            else:
                self._chosen = found
                self._drag = "length" if self._on_edge(place, found) else "body"
            if self._chosen >= 0:
                self._note_before = self._notes[self._chosen]
            self._drag_start = place
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place = event.position()
        if not event.buttons() & Qt.MouseButton.LeftButton or self._chosen < 0 or not self._drag:
            over = self._note_at(place)
            edge = over >= 0 and self._on_edge(place, over)
            self.setCursor(Qt.CursorShape.SizeHorCursor if edge else Qt.CursorShape.ArrowCursor)
            return
        step_px = self.area().width() / STEPS
        by = round((place.x() - self._drag_start.x()) / step_px)
        rise = (self._drag_start.y() - place.y()) / self.area().height()
        step, length, amplitude = self._note_before
        if self._drag == "length":
            new = (step, max(length + by, 1.0), amplitude)
        else:
            up = rise if abs(place.y() - self._drag_start.y()) > 3 else 0.0
            new = (step + by, length, round(min(max(amplitude + up, MIN_AMPLITUDE), 1.0), 2))
        self._set_notes(placed(self._notes, self._chosen, new), new)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._drag = ""

    # --- keys ---

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        moves = {
            Qt.Key.Key_Left: (-1, 0, 0.0),
            Qt.Key.Key_Right: (1, 0, 0.0),
            Qt.Key.Key_Up: (0, 0, 0.05),
            Qt.Key.Key_Down: (0, 0, -0.05),
        }
        if key in (Qt.Key.Key_N, Qt.Key.Key_P) and self._notes:
            first = 0 if key == Qt.Key.Key_N else len(self._notes) - 1
            by = 1 if key == Qt.Key.Key_N else -1
            self._chosen = (self._chosen + by) % len(self._notes) if self._chosen >= 0 else first
        elif key in moves and 0 <= self._chosen < len(self._notes):
            by, longer, louder = moves[Qt.Key(key)]
            if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
                by, longer = 0, by
            step, length, amplitude = self._notes[self._chosen]
            new = (step + by, length + longer, round(min(max(amplitude + louder, MIN_AMPLITUDE), 1.0), 2))
            self._set_notes(placed(self._notes, self._chosen, new), new)
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._add_in_gap()
        elif key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.edit_began.emit()
            self._remove()
        else:
            super().keyPressEvent(event)
        self.update()

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.edit_began.emit()
        self.update()

    def _add_in_gap(self) -> None:
        taken = {s for step, length, _ in self._notes for s in range(int(step), int(step + length))}
        free = next((s for s in range(STEPS) if s not in taken), None)
        if free is not None:
            self.edit_began.emit()
            new = (float(free), 1.0, 0.6)
            self._set_notes(placed([*self._notes, new], len(self._notes), new), new)

    def _remove(self) -> None:
        if 0 <= self._chosen < len(self._notes):
            del self._notes[self._chosen]
            self._chosen = min(self._chosen, len(self._notes) - 1)
            self.changed.emit(self.notes())

    def _set_notes(self, notes: list[Note] | None, chosen: Note) -> None:
        if notes is None or notes == self._notes:
            return
        self._notes = notes
        self._chosen = next((i for i, note in enumerate(notes) if note[0] == chosen[0]), -1)
        self.changed.emit(self.notes())
        self.update()

    # --- drawing ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        bar = self.area()
        paint_ground(painter, bar)
        step_px = bar.width() / STEPS
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        for step in range(1, STEPS):
            painter.setPen(QPen(QColor(theme.LINE if step % 6 else theme.FAINT), 1.0))
            x = round(bar.x() + step * step_px)
            painter.drawLine(x, int(bar.top()) + 1, x, int(bar.bottom()) - 1)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        for i, note in enumerate(self._notes):
            chosen = i == self._chosen and self.hasFocus()
            painter.setPen(QPen(QColor(theme.TEXT), 1.5) if chosen else Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.mixed(theme.EVENTS, theme.RAISED, 0.75)))
            painter.drawRoundedRect(self._note_rect(note), 2.0, 2.0)
        if self.hasFocus():
            paint_focus(painter, bar)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QColor(theme.MUTED))
        for step in range(0, STEPS, 6):
            place = QRectF(bar.x() + step * step_px, bar.bottom() + 2.0, 6 * step_px, 14.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, str(step + 1))


class RhythmEditor(ParameterEditor):
    """The control of a rhythm's notes, with a menu of the rhythms R1 to R8."""

    rhythm_chosen = Signal(object)
    """The `Rhythm` whose notes were taken from the menu: its bar and repeats are others' to set."""

    def __init__(self, parameter: Rows) -> None:
        super().__init__(parameter)
        self.rhythms = QToolButton(self)
        self.rhythms.setText("R1 to R8 ▾")
        self.rhythms.setProperty("role", "flat")
        self.rhythms.setToolTip("A rhythm of the study of tactons: its notes, bar and repeats")
        self.rhythms.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self.rhythms)
        for rhythm in RHYTHMS:
            notes, repeats = counted(len(rhythm.notes), "note"), counted(rhythm.repeats, "time")
            text = f"{rhythm.name}: {notes}, {1e3 * rhythm.bar_s:.0f} ms, {repeats}"
            menu.addAction(text).triggered.connect(lambda _=False, rhythm=rhythm: self.choose(rhythm))
        self.rhythms.setMenu(menu)
        self.grid.addWidget(self.rhythms, 0, 2, Qt.AlignmentFlag.AlignRight)
        self.bar = RhythmBar(self)
        self._place_control(self.bar)
        self.bar.setToolTip(
            "Click: add a note. Drag a note: move it or change its amplitude. Drag its right edge: change its length.\n"
            "Right click: delete a note. Keys: N and P select a note, arrows move it or change its amplitude,\n"
            "Shift+arrows change its length, Enter adds a note, Delete deletes the selected one."
        )
        self.bar.edit_began.connect(self.edit_began)
        self.bar.changed.connect(self._commit)
        self.set_value(parameter.default)

    def choose(self, rhythm: Rhythm) -> None:
        """Use the notes of this rhythm, as a change by the user."""
        self.edit_began.emit()
        self._commit([(note.step, note.length, note.amplitude) for note in rhythm.notes])
        self._show()
        self.rhythm_chosen.emit(rhythm)

    def _show(self) -> None:
        self.bar.set_notes(self._value)
