"""The participant's window, in large type, on the second screen or the projector."""

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QLayout, QSizePolicy, QVBoxLayout, QWidget

from underfoot.experiments.questions import asked
from underfoot.phrases import Phrase
from underfoot.studies.page_words import hint_of, questions_of, text_of, title_of
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner
from underfoot.studies.target import FEET_APART_M, FOOT_M, SELECTED_M, FloorTarget, StandingPlace
from underfoot.widgets import theme
from underfoot.widgets.controls.announcing import announce
from underfoot.widgets.controls.full_screen import FullScreenWindow
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.scrolled import Scrolled
from underfoot.widgets.experiment.answer_form import AnswerForm, PageButton, is_held
from underfoot.widgets.experiment.foot_view import FootFieldsView

TITLE_PX, TEXT_PX, CLOCK_PX = 40, 26, 96
WIDTH_PX = 960
SPACE_STEPS = "Space steps on the simulated floor."
_MARGIN_M = 0.05
_NOTCH = 120
"""By how much Qt says that a wheel with notches is turned."""


class ParticipantWindow(FullScreenWindow):
    """Shows a runner's page. Space or Return begins and continues, numbers and arrows answer, Escape stops.

    For a stimulus that can be repeated, Space plays it and Return submits the answer. Buttons do the same without a
    keyboard.
    """

    answered = Signal(dict)
    stepped = Signal(int, bool)
    continue_requested = Signal()
    """Begin a presentation, or continue."""
    stop_requested = Signal()

    def __init__(self, stand: StandingPlace) -> None:
        """Create the window; `stand` is the participant's position in target selection."""
        super().__init__()
        self.setWindowTitle("Study – Underfoot")
        self.setAccessibleName("Study, for the participant")
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.shown = ("", "")
        """Page, with its interval, and phase that are on the screen."""
        self._usual_hint = ""
        """What the page says below its questions, unless an answer was refused."""
        self._plays_again = False
        self._turned = 0
        """By how much the wheel has been turned since the last step."""
        self._stand = stand
        self.target: FloorTarget | None = None
        """The button to be pressed, on a projected floor."""
        self._selected: FloorTarget | None = None
        self._on_floor = False
        self.title, self.text, self.clock, self.hint = (theme.label() for _ in range(4))
        self.form, self.foot = AnswerForm(TEXT_PX), FootFieldsView()
        self.again, self.go = PageButton(), PageButton()
        for button in (self.again, self.go):
            button.setFont(theme.font(TEXT_PX))
            least_px = button.fontMetrics().height() + 2  # or the theme's, in which the words are cut
            button.setStyleSheet(f"padding: 12px 32px; min-height: {least_px}px")
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # after a click, keys answer on the page
        self.again.clicked.connect(self.continue_requested)
        self.go.clicked.connect(self._go_on)
        held = QWidget()
        self.scrolled = Scrolled(held)
        """What is to be read and answered; what follows it stays in sight."""
        column, above = QVBoxLayout(self), QVBoxLayout(held)
        column.setAlignment(Qt.AlignmentFlag.AlignCenter)
        column.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)  # a projector may be narrower than a page
        above.setContentsMargins(0, 0, 0, 0)
        for layout in (column, above):
            layout.setSpacing(3 * theme.GRID)
        for label, size in ((self.title, TITLE_PX), (self.text, TEXT_PX), (self.clock, CLOCK_PX), (self.hint, TEXT_PX)):
            label.setFont(theme.font(size, bold=label is self.title))
            label.setWordWrap(True)
            label.setAlignment(Qt.AlignmentFlag.AlignCenter)
        for part in (self.title, self.text, self.clock, self.form, self.foot):
            part.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
            above.addWidget(part)
        column.addWidget(self.scrolled, 0, Qt.AlignmentFlag.AlignHCenter)
        for below in (self.again, self.go, self.hint):
            below.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
            column.addWidget(below, 0, Qt.AlignmentFlag.AlignHCenter)
        self.form.answered.connect(self.answered)
        self.form.stepped.connect(self.stepped)
        self.form.refused.connect(self._show_refused)

    def show_runner(self, runner: Runner) -> None:
        """Show the state of a runner."""
        page, phase, say = runner.page, runner.phase, runner.language.say
        key = (f"{page.key} {runner.interval}", str(phase))
        self._show_floor(runner)
        self.form.show_adjusting(runner.adjusting)
        self.title.setText(title_of(runner))
        self.title.setVisible(bool(self.title.text()) and not self._on_floor)
        if key != self.shown:
            self.shown = key
            asking = phase in (Phase.PAGE, Phase.ANSWERING)
            self.text.setText(text_of(runner) if runner.foot is None else say(asked(runner.foot.question)))
            asks = questions_of(runner) if asking else ()
            self.text.setVisible(bool(self.text.text() or not asks) and not self._on_floor)  # questions have its room
            self.form.show_questions(asks, runner.language)
            QWidget.setTabOrder(self.previousInFocusChain() or self, self.again)  # questions, made anew, come before
            QWidget.setTabOrder(self.again, self.go)
            self.form.setVisible(bool(asks) and runner.foot is None)  # keys answer all the same
            (self.form.first or self).setFocus()
            self.scrolled.verticalScrollBar().setValue(0)
            self._usual_hint = say(_hint(runner, self.form))
            self.hint.setText(self._usual_hint)
            text = _continue_text(runner, self.form)
            self.go.setText(say(text))
            self.go.setVisible(bool(text))
            self._say_page()
        self._plays_again = phase is Phase.ANSWERING and runner.may_play
        self.again.setText(say("Play the other one" if _has_standard(runner) else "Play it again"))
        self.again.setVisible(self._plays_again)
        self.foot.show_answers(runner.foot, runner.language)
        if phase is not Phase.STOPPED and (hint := hint_of(runner, SPACE_STEPS)):
            self.hint.setText(hint)
        counts = phase is Phase.PAUSE or (page.kind == "learn" and phase is Phase.PAGE and page.seconds > 0.0)
        left = round(runner.seconds_left)
        self.clock.setText(f"{left // 60}:{left % 60:02d}" if counts else "")
        self.clock.setVisible(counts)

    def _say_page(self) -> None:
        """Have a screen reader say the new page; it says questions where the focus is."""
        shown = (label.text() for label in (self.title, self.text, self.hint) if not label.isHidden())
        text = " ".join(words for words in shown if words)
        self.setAccessibleName(text)
        announce(self, text)

    @property
    def px_per_m(self) -> float:
        """Pixels per metre, from the screen's reported size; smaller if not all buttons would fit."""
        return min(self.screen_px_per_m, self.height() / (self._stand.reach_m + FOOT_M[1] + 2.0 * _MARGIN_M))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if is_held(event):
            return
        match event.key():
            case Qt.Key.Key_Escape:
                self.stop_requested.emit()
            case Qt.Key.Key_Space if self._plays_again:
                self.continue_requested.emit()
            case Qt.Key.Key_Return | Qt.Key.Key_Enter | Qt.Key.Key_Space:
                if not self.form.press_focused(self):
                    self._go_on()
            case key:
                if self.form.handle_key(int(key), event.text()):
                    self._show_focused()
                elif not self.scrolled.scroll_by(event):
                    super().keyPressEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Move what is adjusted by small steps; else scroll, also where the mouse is beside what is scrolled."""
        if not self.form.is_adjusted:
            self.scrolled.scroll_by(event)
            return
        self._turned += event.angleDelta().y()
        steps = int(self._turned / _NOTCH)  # a touchpad turns by less than a notch at a time
        self._turned -= steps * _NOTCH
        for _ in range(abs(steps)):
            self.form.step(1 if steps > 0 else -1, is_fine=True)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        width = min(WIDTH_PX, self.width() - 6 * theme.GRID)
        self.hint.setFixedWidth(width)
        self.scrolled.setFixedWidth(width + self.scrolled.verticalScrollBar().sizeHint().width())

    def _show_refused(self, words: str) -> None:
        self.hint.setText(words or self._usual_hint)
        self._show_focused()

    def _show_focused(self) -> None:
        """Scroll to what has the focus."""
        field = self.form.focusWidget()
        if field is not None:
            self.scrolled.show_whole(field)

    def _go_on(self) -> None:
        if self.form.needs_submit:
            self.form.submit()
        else:
            self.continue_requested.emit()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor("black" if self._on_floor else theme.GROUND))  # projectors light the floor
        if not self._on_floor:
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor("white"))
        for side in (-0.5, 0.5):
            painter.drawRect(self._foot(side * FEET_APART_M))
        if self._selected is not None:
            self._draw_disc(painter, self._selected, SELECTED_M)
        if self.target is not None:
            painter.setBrush(QColor(theme.colours("dark")["force"]))
            self._draw_disc(painter, self.target, self.target.width_m)

    def place(self, x_m: float, y_m: float) -> QPointF:
        """Return a point of the floor's frame in pixels; the point between the toes is at the lower middle."""
        toes = QPointF(0.5 * self.width(), self.height() - (FOOT_M[1] + _MARGIN_M) * self.px_per_m)
        x0_m, y0_m = self._stand.origin_m
        return toes + QPointF(x_m - x0_m, y0_m - y_m) * self.px_per_m

    def _foot(self, aside_m: float) -> QRectF:
        """Return the outline of a foot, `aside_m` from the middle."""
        x_m, y_m = self._stand.origin_m
        width_m, length_m = FOOT_M
        left = x_m + aside_m - 0.5 * width_m
        return QRectF(self.place(left, y_m), self.place(left + width_m, y_m - length_m))

    def _draw_disc(self, painter: QPainter, target: FloorTarget, width_m: float) -> None:
        radius = 0.5 * width_m * self.px_per_m
        painter.drawEllipse(self.place(target.x_m, target.y_m), radius, radius)

    def _show_floor(self, runner: Runner) -> None:
        """During target selection, show only the buttons and the feet; show text only if there is a question."""
        trial = runner.page.trial
        shown = trial is not None and not trial.intervals and runner.phase in (Phase.WAITING, Phase.PRESENTING)
        drawn = (runner.target, runner.selected, shown)
        if drawn != (self.target, self._selected, self._on_floor):
            self.update()  # at each tick this would be half of the window's load
        self.hint.setVisible(not shown)
        self.target, self._selected, self._on_floor = drawn


def _continue_text(runner: Runner, form: AnswerForm) -> str:
    """Return the text of the button that continues, in English; "" if the page has no such button."""
    page, phase = runner.page, runner.phase
    if phase is Phase.READY and page.start == "key":
        return "Feel it"
    goes_on = phase is Phase.PAGE and (not page.questions or form.needs_submit)
    return "Go on" if goes_on or (phase is Phase.ANSWERING and form.needs_submit) else ""


def _has_standard(runner: Runner) -> bool:
    """Return whether what is moved now can be compared with a standard."""
    return runner.adjusting is not None and runner.adjusting.standard is not None


def _hint(runner: Runner, form: AnswerForm) -> str:
    """Return what the page says below its questions, in English."""
    page = runner.page
    match runner.phase:
        case Phase.READY if page.start == "key":
            return "Press Space, or click."
        case Phase.ANSWERING if runner.adjusting is not None:
            again = "Space plays the other one." if _has_standard(runner) else "Space plays it again."
            return Phrase("{hint} {again}", hint=form.hint_text, again=again)
        case Phase.ANSWERING if runner.may_play:
            key = with_native_keys("Ctrl+Space") if form.fields else "Space"  # in a text field, Space is a character
            left = Phrase("{key} plays it again ({count} left).", key=key, count=page.plays - runner.plays)
            return Phrase("{hint} {again}", hint=form.hint_text, again=left)
        case Phase.ANSWERING:
            return form.hint_text
        case Phase.PAGE if page.kind == "learn" and form.has_long_numbers:
            return "Type a number and press Return to feel it. Return alone ends the learning."
        case Phase.PAGE if page.kind == "learn":
            return "Press a number to feel it. Return ends the learning."
        case Phase.PAGE:
            return form.hint_text
        case Phase.PAUSE:
            return "It goes on by itself."
        case Phase.STOPPED:
            return "Please speak to the experimenter."
    return ""
