"""Editor of a rhythm on its bar of 24 steps: notes are added, moved and resized by mouse or keys."""

import math
from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QMenu, QToolButton

from underfoot.models.signals.rhythm import RHYTHMS, STEPS, Rhythm
from underfoot.parameters import Parameter, Rows
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import ParameterEditor
from underfoot.widgets.controls.handle_pad import HandlePad
from underfoot.widgets.pictures import paint_focus, paint_ground

Note = tuple[float, float, float]
"""Step, length in steps, amplitude 0 to 1."""
MIN_AMPLITUDE = 0.05
AMPLITUDE_STEP = 0.05
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


class RhythmBar(HandlePad):
    """24 steps from left to right; a note's height is its amplitude.

    Mouse: a click on an empty step adds a note; dragging moves it, its right edge changes its length, up and down its
    amplitude; a right click deletes it. Keys as of every pad; Shift with Left and Right changes a note's length.
    """

    HEIGHT_PX = 104
    HEAD_PX, FOOT_PX = 1.0, 17.0

    def __init__(self) -> None:
        super().__init__()
        self._notes: list[Note] = []
        self._drags_edge = False
        self._drag_start = QPointF()
        self._note_before: Note = (0.0, 1.0, 1.0)  # as the drag began
        self.setMouseTracking(True)
        self.setAccessibleName("Rhythm")

    def notes(self) -> list[Note]:
        """Return the notes in order of their steps."""
        return list(self._notes)

    def set_notes(self, notes: Sequence[Sequence[float]]) -> None:
        """Show these notes, without emitting `changed`."""
        self._notes = [(float(n[0]), float(n[1]), float(n[2])) for n in notes]
        self.chosen = min(self.chosen, len(self._notes) - 1)
        self.update()

    # --- as a pad ---

    def handles(self) -> Sequence[QPointF]:
        return [self._note_rect(note).center() for note in self._notes]

    def nudge(self, index: int, steps_right: float, steps_up: float) -> None:
        """Move a note, or change its amplitude; the fine steps across, of Shift, change its length."""
        step, length, amplitude = self._notes[index]
        across = math.copysign(math.ceil(abs(steps_right)), steps_right)
        is_fine = abs(steps_right) < 1.0
        new = (step, length + across, amplitude) if is_fine else (step + across, length, amplitude)
        self._replace(index, new, steps_up)

    def turn_wheel(self, index: int, steps: float) -> None:
        """Change a note's amplitude."""
        self._replace(index, self._notes[index], steps)

    def add(self, place: QPointF | None) -> None:
        """Add a note at `place`, or in the first gap, and select it."""
        taken = {s for step, length, _ in self._notes for s in range(int(step), int(step + length))}
        free = next((s for s in range(STEPS) if s not in taken), None) if place is None else self._step_at(place)
        if free is not None:
            new = (float(free), 1.0, 0.6 if place is None else self._amplitude_at(place))
            self._set_notes(placed([*self._notes, new], len(self._notes), new), new)

    def remove(self, index: int) -> None:
        """Remove a note."""
        del self._notes[index]
        self.emit_changed()

    def _replace(self, index: int, note: Note, steps_up: float) -> None:
        """Set a note, so many steps of amplitude louder."""
        step, length, amplitude = note
        new = (step, length, round(min(max(amplitude + AMPLITUDE_STEP * steps_up, MIN_AMPLITUDE), 1.0), 3))
        self._set_notes(placed(self._notes, index, new), new)

    # --- where things are ---

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
        self.chosen = self._note_at(place)
        if event.button() == Qt.MouseButton.RightButton and self.chosen >= 0:
            self._remove_chosen()
        elif event.button() == Qt.MouseButton.LeftButton:
            is_new = self.chosen < 0
            self.begin_edit("press")
            if is_new:
                self.add(place)
            self._dragged = self.chosen >= 0
            if self._dragged:
                self._drags_edge = is_new or self._on_edge(place, self.chosen)
                self._note_before = self._notes[self.chosen]
            self._drag_start = place
        self.update()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.mousePressEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place = event.position()
        if not self._dragged or self.chosen < 0:
            over = self._note_at(place)
            edge = over >= 0 and self._on_edge(place, over)
            self.setCursor(Qt.CursorShape.SizeHorCursor if edge else Qt.CursorShape.ArrowCursor)
            return
        step_px = self.area().width() / STEPS
        by = round((place.x() - self._drag_start.x()) / step_px)
        rise = (self._drag_start.y() - place.y()) / self.area().height()
        step, length, amplitude = self._note_before
        if self._drags_edge:
            new = (step, max(length + by, 1.0), amplitude)
        else:
            up = rise if abs(place.y() - self._drag_start.y()) > 3 else 0.0
            new = (step + by, length, round(min(max(amplitude + up, MIN_AMPLITUDE), 1.0), 2))
        self._set_notes(placed(self._notes, self.chosen, new), new)

    def _set_notes(self, notes: list[Note] | None, chosen: Note) -> None:
        if notes is None or notes == self._notes:
            return
        self._notes = notes
        self.chosen = next((i for i, note in enumerate(notes) if note[0] == chosen[0]), -1)
        self.emit_changed()

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
            chosen = i == self.chosen and self.hasFocus()
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
        self.bar = RhythmBar()
        self._place_control(self.bar)
        self.bar.setToolTip(
            "Click: add a note. Drag a note: move it or change its amplitude. Drag its right edge: change its length.\n"
            "Right click: delete a note. Keys: N and P select a note, arrows move it or change its amplitude,\n"
            "Shift+Left and Shift+Right change its length, Enter adds a note, Delete deletes the selected one."
        )
        self.bar.edit_began.connect(self.edit_began)
        self.bar.changed.connect(lambda: self._commit(self.bar.notes()))
        self.set_value(parameter.default)

    def choose(self, rhythm: Rhythm) -> None:
        """Use the notes of this rhythm, as a change by the user."""
        self.edit_began.emit()
        self._commit([(note.step, note.length, note.amplitude) for note in rhythm.notes])
        self._show()
        self.rhythm_chosen.emit(rhythm)

    def _show(self) -> None:
        self.bar.set_notes(self._value)
