"""The experimenter's page: participant, progress, stimulus; buttons to continue, pause, repeat, note and end."""

import time

import numpy as np
from PySide6.QtCore import Qt, Signal, SignalInstance
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLineEdit, QPushButton, QVBoxLayout, QWidget

from underfoot.experiments.duration import about
from underfoot.studies.empty_floor import empty_floor_text
from underfoot.studies.page_words import questions_of
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner
from underfoot.studies.simulated_foot import may_step
from underfoot.widgets import theme
from underfoot.widgets.controls.panels import progress_bar
from underfoot.widgets.experiment.answer_form import AnswerForm, PageButton, is_held
from underfoot.widgets.floor_map import FloorMap
from underfoot.widgets.plots.drawing_column import DrawingColumn

WHY_FIRST = "Type first why it is repeated, and press again."
_LIVE_S = 0.1
"""Display time of measured values, in seconds."""
_READOUT_TICKS = 6
"""Ticks between two updates of measured values, to be readable."""
_WORDS = {
    "consent": "the participant is asked to agree",
    "questions": "questions are answered",
    "read": "an instruction is read",
    "learn": "stimuli are tried",
    "level": "the level is set",
}
_USUAL_FOR_S = 120.0
"""Weight of the usual pace, as if it had been observed for this time."""


class _StopButton(PageButton):
    """Stops, or goes on; the second click of a double-click stops, too, and never goes on."""

    goes_on = False

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if not self.goes_on:
            self.mousePressEvent(event)


class ExperimenterView(QWidget):
    """Shows a runner to the experimenter, who has all actions of the participant, and can end a pause."""

    next_requested = Signal()
    end_pause_requested = Signal()
    """Emitted only by the button, because a key is hit accidentally too easily."""
    stop_requested = Signal()
    continue_requested = Signal()
    spoil_requested = Signal(str)
    repeat_requested = Signal(str)
    note_given = Signal(str)
    window_requested = Signal()
    leave_requested = Signal()
    answered = Signal(dict)
    stepped = Signal(int, bool)
    pressed = Signal(str, float, float, float)
    """A foot made with the mouse, on a simulated floor: tile, place in its frame, newtons."""

    def __init__(self) -> None:
        super().__init__()
        self.title, self.state = theme.paragraph("", "title"), theme.paragraph("", "muted")
        self.page, self.live, self.news = theme.paragraph(), theme.label("", "force"), theme.paragraph("", "alarm")
        self.progress = progress_bar("How much is done", theme.GRID)
        self.form = AnswerForm()
        self.next, self.pause, self.window_button, self.leave = (
            PageButton("Next"),
            _StopButton("Stop"),
            QPushButton("Participant's window"),
            QPushButton("End for now"),
        )
        self.next.setProperty("role", "primary")
        self.pause.setProperty("role", "alarm")
        self.note_field = QLineEdit()
        self.note_field.setPlaceholderText("A note, or a reason to repeat")
        self.note_field.setAccessibleName("Note or reason")
        self.note_button, self.spoil, self.repeat = (
            QPushButton("Keep note"),
            QPushButton("Present again"),
            QPushButton("Repeat the last"),
        )
        for button in (
            self.next,
            self.pause,
            self.window_button,
            self.leave,
            self.note_button,
            self.spoil,
            self.repeat,
        ):
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # Space must begin a trial after a click, not press again
        self.map, self.drawings = FloorMap(), DrawingColumn()
        self.map.setFocusProxy(self)  # after a step with the mouse, arrows and Return must answer
        self._began_s, self._shown_at, self._began_share = 0.0, 0.0, 0.0
        self._ticks = 0
        self._form_key = self._refusal = ""
        self._is_pause = False
        self._lay_out()
        self._connect()

    def begin(self, runner: Runner, name: str) -> None:
        """Show a new session of the study `name`; the mouse can step on a simulated floor."""
        target, protocol = runner.session.target, runner.protocol  # as the session was begun
        self.title.setText(f"{protocol.title or name}  ·  {runner.study.participant}")
        self.map.set_floor(target.floor)
        self.map.can_press = target.kind == "simulator"
        blind = "Double-blind: neither vibration nor answers are shown; Monitor shows what is played."
        drawn = "What the answers say is drawn here, after the first few."
        self.drawings.show_drawings((), blind if protocol.double_blind else drawn)
        self._began_s = self._shown_at = time.perf_counter()
        self._began_share, self._form_key, self._ticks = -1.0, "", 0

    def show_runner(self, runner: Runner) -> None:
        """Show the state of a runner."""
        page, phase = runner.page, runner.phase
        self._show_form(runner)
        self.form.show_adjusting(runner.adjusting)
        if self._began_share < 0.0:
            self._began_share = page.share
        self.progress.setValue(round(1000 * page.share))
        number = f"trial {page.trial.number} of block {page.trial.block}" if page.trial is not None else ""
        attempt = f"attempt {page.attempt}" if page.attempt > 1 else ""
        practice = "practice, not counted" if page.practice else ""
        share = f"{100 * page.share:.0f} %"
        self.page.setText(
            _joined(_stage_text(runner) or "The end: every answer is kept.", practice, number, attempt, share)
        )
        seconds = f"{runner.seconds_left:.0f} s" if runner.seconds_left > 0.0 else ""
        left = self._time_left_text(runner)
        is_over = phase is Phase.END
        says_itself = is_over or (phase is Phase.STOPPED and bool(runner.hint))
        now = _page_text(runner) if phase is Phase.PAGE else "" if says_itself else str(phase)
        self.state.setText(_joined(now, seconds, runner.hint, left))
        if self._ticks % _READOUT_TICKS == 0:
            self.live.setText(_level_text(runner))
        self._ticks += 1
        news = self._refusal or empty_floor_text(runner) or (runner.messages[-1] if runner.messages else "")
        self.news.setText(news)
        self.news.setVisible(bool(news))
        self.pause.goes_on = phase is Phase.STOPPED
        self.pause.setText("Go on" if self.pause.goes_on else "Stop")
        self.pause.setVisible(not is_over)
        self.leave.setVisible(not is_over)
        self._is_pause = phase is Phase.PAUSE
        self.next.setText("End the pause" if self._is_pause else "Back to the studies" if is_over else "Next")
        goes_on = phase is Phase.PAGE and not page.questions
        self.next.setEnabled(phase in (Phase.PAUSE, Phase.END) or runner.may_play or may_step(runner) or goes_on)
        self.spoil.setEnabled(page.trial is not None and runner.plays > 0)
        self.repeat.setEnabled(runner.is_prepared and runner.study.can_repeat)
        self.map.set_loads(runner.watch.loads_n, [False] * len(runner.watch.loads_n))
        self.map.set_contacts(runner.watch.contacts, runner.watch.now_s)
        self.map.update()

    def _time_left_text(self, runner: Runner) -> str:
        """Return the remaining time in words: the usual time at first, then weighted by the observed pace."""
        share, whole_s = runner.page.share, runner.study.usual_s
        if share >= 1.0:
            return ""
        now = time.perf_counter()
        if runner.phase is Phase.STOPPED:
            self._began_s += now - self._shown_at  # breaks are not part of the pace
        self._shown_at = now
        seen_s, usual_s = now - self._began_s, (share - self._began_share) * whole_s
        pace = (seen_s + _USUAL_FOR_S) / (usual_s + _USUAL_FOR_S)
        return f"{about(pace * (1.0 - share) * whole_s)} left"

    def _show_form(self, runner: Runner) -> None:
        page, phase = runner.page, runner.phase
        asking = phase in (Phase.PAGE, Phase.ANSWERING)
        key = f"{page.key} {asking}"
        if key != self._form_key:
            self._form_key, self._refusal = key, ""
            focus = QApplication.focusWidget()
            had_focus = focus is not None and self.form.isAncestorOf(focus)
            self.form.show_questions(questions_of(runner) if asking else ())
            if had_focus:
                self.setFocus()  # else the next button gets the focus

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.MARGINS)
        column.setSpacing(theme.GRID)
        for part in (self.title, self.progress, self.page, self.state, self.live, self.news):
            column.addWidget(part)
        column.addWidget(self._row(self.next, self.pause, self.window_button, self.leave))
        column.addWidget(self._row(self.note_field, self.note_button, self.spoil, self.repeat))
        column.addWidget(self.form)
        below = QHBoxLayout()
        below.addWidget(self.map, 1)
        below.addWidget(self.drawings, 1)
        column.addLayout(below, 1)

    def _row(self, *parts: QWidget) -> QWidget:
        line = QWidget()
        row = QHBoxLayout(line)
        row.setContentsMargins(0, 0, 0, 0)
        for part in parts:
            row.addWidget(part)
        if not any(isinstance(part, QLineEdit) for part in parts):
            row.addStretch(1)
        return line

    def _connect(self) -> None:
        self.next.clicked.connect(self._go_on)
        self.pause.clicked.connect(self._pause)
        self.window_button.clicked.connect(self.window_requested)
        self.leave.clicked.connect(self.leave_requested)
        self.note_button.clicked.connect(lambda: self._emit_with_note(self.note_given))
        self.note_field.returnPressed.connect(lambda: self._emit_with_note(self.note_given))
        self.spoil.clicked.connect(lambda: self._emit_with_note(self.spoil_requested, WHY_FIRST))
        self.repeat.clicked.connect(lambda: self._emit_with_note(self.repeat_requested, WHY_FIRST))
        self.form.answered.connect(self.answered)
        self.form.stepped.connect(self.stepped)
        self.form.refused.connect(self._show_refusal)
        self.map.pressed.connect(self.pressed)

    def _show_refusal(self, why: str) -> None:
        """Show why an answer is not taken, until the question has one, or the page is another."""
        self._refusal = why
        self.news.setText(why)
        self.news.setVisible(bool(why))

    def _go_on(self) -> None:
        (self.end_pause_requested if self._is_pause else self.next_requested).emit()

    def _pause(self) -> None:
        (self.continue_requested if self.pause.goes_on else self.stop_requested).emit()

    def _emit_with_note(self, signal: SignalInstance, missing: str = "") -> None:
        """Emit the typed note; if the field is empty, focus it, and say what is `missing`."""
        text = self.note_field.text().strip()
        self._refusal = "" if text else missing
        if not text:
            self.note_field.setFocus()
            return
        self.note_field.clear()
        signal.emit(text)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if is_held(event):
            return
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space):
            if self.focusWidget() is self.note_field:  # Return kept the note, and must not begin a trial, too
                if not self.note_field.text():
                    self.setFocus()
            elif self.form.press_focused(self):
                return
            elif self.form.needs_submit:
                self.form.submit()
            else:
                self.next_requested.emit()
        elif not self.form.handle_key(event.key(), event.text()):
            super().keyPressEvent(event)


def _page_text(runner: Runner) -> str:
    """Return what happens on a page, and once nothing is left to be answered that the session may be left."""
    if runner.study.has_all_answers:
        return "every answer is kept; what is left is read"
    return _WORDS.get(runner.page.kind, "")


def _stage_text(runner: Runner) -> str:
    """Return the stage by its title, and by its id where it has none, or not alone; "" at the end."""
    page, titles = runner.page, {stage.id: stage.title for stage in runner.protocol.stages}
    title = titles.get(page.stage, page.title)  # the questions about the participant are no stage of the protocol
    if not page.stage or not title:
        return page.stage
    return title if list(titles.values()).count(title) < 2 else f"{title} ({page.stage})"


def _level_text(runner: Runner) -> str:
    """Return the force on the floor, and, unless the study is double-blind, the commanded and measured vibration."""
    presenter = runner.presenter
    peak = runner.session.health.peak * float(presenter.full_scale.max())
    words = [f"{runner.watch.loads_n.sum():.0f} N on the floor"]
    if runner.protocol.double_blind:
        return words[0]
    words.append(f"{peak:.2f} m/s² commanded")
    end = presenter.end_frame
    _, measured = presenter.measured(end - round(_LIVE_S * runner.session.target.rate), end)
    if measured.size:
        words.append(f"{float(np.nanmax(np.abs(measured))):.2f} m/s² measured")
    return _joined(*words)


def _joined(*words: str) -> str:
    return "  ·  ".join(word for word in words if word)
