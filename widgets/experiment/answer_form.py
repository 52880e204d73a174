"""The participant's answer form: large buttons, a wide slider, a line of text, and keys for all of them."""

from collections.abc import Sequence
from functools import reduce
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFont, QKeyEvent, QMouseEvent, QResizeEvent, QTextLayout, QTextOption
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import BadValue
from underfoot.experiments.questions import (
    Adjusted,
    FreeNumber,
    Scale,
    asked,
    keys_of,
    needs_answer,
    typed_answer,
    unanswered,
    unmoved,
)
from underfoot.parameters import Choice, Count, Number, Parameter
from underfoot.phrases import ENGLISH, Language, Phrase
from underfoot.quantities import quantity
from underfoot.studies.adjusting import Adjusting
from underfoot.widgets import theme
from underfoot.widgets.controls.menu import literal
from underfoot.widgets.controls.slider import Slider

TEXT_PX, BUTTON_LINES, ROW_LINES = 20, 2.6, 1.6
"""Size of text; heights, in its lines, of buttons that answer the page, and of those in a row of several questions, of
which four are then in sight in a window of 700 pixels.
"""
MAX_BUTTONS = 12
"""Integer questions with up to this many values have buttons; others have a text field."""
_KEY_STEP = 0.02
_STEPS = (("Much less", -1, False), ("Less", -1, True), ("More", 1, True), ("Much more", 1, False))
"""Buttons of what is moved while it is felt: their words, the way, and whether it is a small step."""
_ARROWS = {
    Qt.Key.Key_Down.value: (-1, False),
    Qt.Key.Key_Left.value: (-1, True),
    Qt.Key.Key_Right.value: (1, True),
    Qt.Key.Key_Up.value: (1, False),
}
_SHORT = 20
"""Letters of an answer that is named beside its key."""
_SIDES = (Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight)


def is_held(event: QKeyEvent) -> bool:
    """Return whether a key is repeated that answers or goes on: held down, it would do so for one page after another.

    Arrows and page keys, which type nothing, move and scroll as long as they are held.
    """
    return event.isAutoRepeat() and bool(event.text())


class PageButton(QPushButton):
    """A button that answers a page, or goes on from it; the second click of a double-click would be the next page's."""

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        event.accept()


class AnswerForm(QWidget):
    """Displays questions. A single choice with few options is answered by its buttons, other questions by `give`."""

    answered = Signal(dict)
    stepped = Signal(int, bool)
    """What is felt is to be moved by a step: 1 up or -1 down, and whether it is a small one."""
    refused = Signal(str)
    """The reason for which the answers are invalid; "" once the question that it names has an answer."""

    def __init__(self, text_px: int = TEXT_PX) -> None:
        super().__init__()
        self._text_px = text_px
        self._layout = QVBoxLayout(self)
        self._layout.setSpacing(2 * theme.GRID)
        self._questions: tuple[Parameter, ...] = ()
        self._language = ENGLISH
        self.buttons: list[QPushButton] = []
        self.fields: dict[str, QLineEdit] = {}
        self.sliders: dict[str, Slider] = {}
        self._chosen: dict[str, Any] = {}
        self._keys: tuple[str, ...] = ()
        """The number that is typed for each button, if a button answers the page."""
        self._meanings: tuple[str, ...] = ()
        """These numbers in words: with what they mean, where that is not read on the buttons."""
        self._rows: dict[str, tuple[tuple[str, ...], list[QPushButton]]] = {}
        """The numbers that are typed, and the buttons, of each question on a page of several."""
        self._typed = ""
        self._was_moved = False
        """Whether what is felt has been moved, here or elsewhere, so that it is an answer."""
        self._refused: Parameter | None = None
        """The question whose answer was missing or wrong when the page was submitted."""

    @property
    def is_answered_by_button(self) -> bool:
        """Whether one button press answers the page."""
        return len(self._questions) == 1 and bool(self.buttons)

    @property
    def needs_submit(self) -> bool:
        """Whether the page needs a separate submission of the answers, as after a number that has two digits."""
        return bool(self._questions) and (not self.is_answered_by_button or bool(self._typed))

    @property
    def has_long_numbers(self) -> bool:
        """Whether the number of a button has two digits, so that Return follows what is typed."""
        return any(len(key) > 1 for key in self._keys)

    @property
    def hint_text(self) -> str:
        """An instruction in one sentence, in English."""
        if self.is_answered_by_button:
            first, last = int(self._keys[0]), int(self._keys[-1])
            if [int(key) for key in self._keys] == list(range(first, last + 1)) and len(self._keys) > 2:
                words = "Press a number from {first} to {last}, or click."
                if self.has_long_numbers:
                    words = "Type a number from {first} to {last} and press Return, or click."
                return Phrase(words, first=first, last=last)
            which = reduce(lambda one, other: Phrase("{one} or {other}", one=one, other=other), self._meanings)
            words = "Type {which} and press Return, or click." if self.has_long_numbers else "Press {which}, or click."
            return Phrase(words, which=which)
        if self.is_adjusted:
            return "Left and Right move it a little, Up and Down far. Press Return when it is right."
        if len(self.sliders) == 1:
            return "Press Left and Right, or click on the line; then press Return."
        if any(_are_digits(keys) for keys, _ in self._rows.values()):
            return "Numbers choose and go on to the next question, as Tab does. Press Return at the end, or click."
        return "Press Return to go on, or click."

    @property
    def is_adjusted(self) -> bool:
        """Whether the page is answered by moving what is felt."""
        return any(isinstance(question, Adjusted) for question in self._questions)

    @property
    def first(self) -> QWidget | None:
        """What has the focus at first; None where keys answer without one."""
        return None if self.is_answered_by_button else next(iter(self._controls()), None)

    def _controls(self) -> list[QWidget]:
        """Return what has the focus in each question, in order; of buttons the first."""
        of_rows = {name: buttons[0] for name, (_, buttons) in self._rows.items()}
        known: dict[str, QWidget] = {**self.fields, **of_rows}
        return [known[question.name] for question in self._questions if question.name in known]

    def show_questions(self, questions: Sequence[Parameter], language: Language = ENGLISH) -> None:
        """Replace the current questions by these, in a language."""
        while self._layout.count():
            item = self._layout.takeAt(0)
            widget = item.widget() if item is not None else None
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self._questions, self._language = tuple(questions), language
        self.buttons, self.fields, self.sliders, self._chosen = [], {}, {}, {}
        self._keys, self._typed, self._rows, self._refused = (), "", {}, None
        for question in self._questions:
            self._layout.addWidget(self._question_widget(question))

    def submit(self) -> None:
        """Submit the chosen and typed answers."""
        if self._typed:
            self.buttons[self._keys.index(self._typed)].click()
            return
        values = {}
        for question in self._questions:
            try:
                values[question.name] = self._answer_to(question)
            except BadValue as error:
                self._refused = question
                self._focus_on(question)
                self.refused.emit(self._language.say(*error.args))
                return
        self.answered.emit(values)

    def _edited(self) -> None:
        """Take back what was refused once it has an answer: it is asked for no more."""
        if self._refused is None:
            return
        try:
            self._answer_to(self._refused)
        except BadValue:
            return
        self._refused = None
        self.refused.emit("")

    def _focus_on(self, question: Parameter) -> None:
        field = self.fields.get(question.name)
        if field is not None:
            field.setFocus()
            field.selectAll()
        elif question.name in self._rows:
            self._rows[question.name][1][0].setFocus()

    def press_focused(self, page: QWidget) -> bool:
        """Press the button of a page that has the focus, as Space does, and return whether one has.

        An answer is not pressed where the page is submitted: Return does that.
        """
        button = page.focusWidget()
        if not isinstance(button, QPushButton) or (self.needs_submit and self.isAncestorOf(button)):
            return False
        button.click()
        return True

    def handle_key(self, key: int, text: str) -> bool:
        """Handle a key, and return whether it had an effect: digits choose, arrows move the only slider.

        On a page of several questions digits choose where the focus is, which then goes to the next question.
        """
        if self.is_answered_by_button and text and any(text in key for key in self._keys):
            self._type_number(text)
            return True
        for keys, buttons in self._rows.values():
            if text in keys and _are_digits(keys) and self.focusWidget() in buttons:
                buttons[keys.index(text)].click()
                controls = self._controls()
                following = controls[controls.index(buttons[0]) + 1 :]
                (following[0] if following else buttons[keys.index(text)]).setFocus()
                return True
        if self.is_adjusted and key in _ARROWS:
            self.step(*_ARROWS[key])
            return True
        step = {Qt.Key.Key_Left.value: -_KEY_STEP, Qt.Key.Key_Right.value: _KEY_STEP}.get(key)
        if step is not None and len(self.sliders) == 1:
            slider = next(iter(self.sliders.values()))
            slider.set_position(slider.position() + step)
            slider.moved.emit(slider.position())
            return True
        return False

    def step(self, way: int, is_fine: bool) -> None:
        """Have what is felt moved by a step."""
        self.stepped.emit(way, is_fine)

    def show_adjusting(self, adjusting: Adjusting | None) -> None:
        """Take what is moved as an answer once it was, by whoever sees this page."""
        was_moved = adjusting is not None and adjusting.changes > 0
        if was_moved != self._was_moved:
            self._was_moved = was_moved
            self._edited()

    def _type_number(self, digit: str) -> None:
        """Press the button with this number; if numbers have two digits, mark the one typed so far, for Return."""
        typed = self._typed + digit if self._typed + digit in self._keys else digit
        self._typed = typed if typed in self._keys else ""
        if not self.has_long_numbers:
            self.submit()
            return
        for key, button in zip(self._keys, self.buttons, strict=True):
            button.setChecked(key == self._typed)

    def _answer_to(self, question: Parameter) -> object:
        """Return the answer to a question; if it is missing or wrong, raise `BadValue`."""
        field = self.fields.get(question.name)
        if field is None:
            if isinstance(question, Adjusted):
                if not self._was_moved:
                    raise unmoved(question)
                return question.default  # in its place the study takes what it was moved to
            if question.name not in self._chosen and question.name in self.sliders:
                raise BadValue(Phrase("Move the slider to answer: {question}", question=asked(question)))
            if question.name not in self._chosen and needs_answer(question):
                raise unanswered(question)
            return self._chosen.get(question.name, question.default)
        text = field.text().strip()
        if not text and needs_answer(question):
            raise unanswered(question)
        return typed_answer(question, text, self._language)

    def _asked(self, question: Parameter) -> str:
        """Return what a participant reads, and hears from a screen reader, of a question."""
        return self._language.say(asked(question))

    def _question_widget(self, question: Parameter) -> QWidget:
        box = QWidget()
        column = QVBoxLayout(box)
        column.setContentsMargins(0, 0, 0, 0)
        words = theme.paragraph(self._asked(question))
        words.setFont(theme.font(self._text_px))
        words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        column.addWidget(words)
        column.addWidget(self._make_control(question))
        return box

    def _make_control(self, question: Parameter) -> QWidget:
        if isinstance(question, Choice):
            return self._make_buttons(question, list(question.options))
        if isinstance(question, Count) and question.high - question.low < MAX_BUTTONS:
            return self._make_buttons(question, list(range(question.low, question.high + 1)))
        if isinstance(question, Adjusted):
            return self._make_steps(question)
        if isinstance(question, Number) and not isinstance(question, FreeNumber) and len(self._questions) == 1:
            return self._make_slider(question)
        field = QLineEdit()
        field.setFont(theme.font(self._text_px))
        field.setAccessibleName(self._asked(question))
        field.setPlaceholderText("" if question.kind == "text" else self._language.say(question.allowed))
        field.textEdited.connect(self._edited)
        self.fields[question.name] = field
        return field

    def _make_buttons(self, question: Parameter, options: Sequence[Any]) -> QWidget:
        row_buttons: list[QPushButton] = []
        words = tuple(self._language.say(str(option)) for option in options)
        keys = keys_of(words)
        self._keys = keys if len(self._questions) == 1 else ()
        is_read = all(map(str.startswith, words, keys))
        are_short = max(map(len, words)) <= _SHORT
        self._meanings = tuple(
            Phrase("{key} for {word}", key=key, word=word) if are_short and not is_read else key
            for key, word in zip(keys, words, strict=True)
        )
        if len(self._questions) > 1:
            self._rows[question.name] = (keys, row_buttons)
        is_numbered = len(keys) > 2 and not is_read
        height_px = round((BUTTON_LINES if len(self._questions) == 1 else ROW_LINES) * self._text_px)
        for key, word, option in zip(keys, words, options, strict=True):
            button = PageButton(literal(f"{key}  {word}" if is_numbered else word))
            button.setAccessibleDescription(self._asked(question))  # a number alone is no answer to hear
            button.setFont(theme.font(self._text_px))
            button.setStyleSheet(f"min-height: {height_px}px")  # over the theme's
            button.setCheckable(len(self._questions) > 1 or self.has_long_numbers)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # where it is gone, the focus would go to another
            button.clicked.connect(
                lambda _=False, value=option, b=button: self._choose(question, value, row_buttons, b)
            )
            row_buttons.append(button)
        self.buttons += row_buttons
        return _ButtonRows(row_buttons)

    def _choose(
        self, question: Parameter, value: object, row_buttons: Sequence[QPushButton], pressed: QPushButton
    ) -> None:
        self._chosen[question.name] = value
        for button in row_buttons:
            button.setChecked(button is pressed)
        if self.is_answered_by_button:
            self._typed = ""
            self.submit()
        else:
            self._edited()

    def _make_steps(self, question: Adjusted) -> QWidget:
        """Return buttons that move what is felt; a slider would show where it stands."""
        buttons = []
        for words, way, is_fine in _STEPS:
            button = QPushButton(self._language.say(words))
            button.setAccessibleDescription(self._asked(question))
            button.setFont(theme.font(self._text_px))
            button.setStyleSheet(f"min-height: {round(BUTTON_LINES * self._text_px)}px")
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.setAutoRepeat(True)
            button.clicked.connect(lambda _=False, way=way, is_fine=is_fine: self.step(way, is_fine))
            buttons.append(button)
        return _ButtonRows(buttons)

    def _make_slider(self, question: Number) -> QWidget:
        box = QWidget()
        column = QVBoxLayout(box)
        slider, value = Slider(), QLabel()
        below = QHBoxLayout()
        for end, side in zip(question.ends if isinstance(question, Scale) else (), _SIDES, strict=False):
            words = theme.paragraph(self._language.say(end), "muted")
            words.setFont(theme.font(self._text_px))
            words.setAlignment(side)
            below.addWidget(words, 1)
        slider.is_scale = True
        slider.setAccessibleName(self._asked(question))
        slider.setMinimumSize(480, 4 * theme.GRID)
        value.setAlignment(Qt.AlignmentFlag.AlignCenter)
        value.setFont(theme.font(self._text_px))

        def show_value(found: float) -> None:
            self._chosen[question.name] = found
            value.setText(self._language.number(quantity(round(found, 2), question.unit)) if question.unit else "")
            slider.setAccessibleDescription(value.text())  # of the slider itself a reader has thousandths of the way

        def moved(place: float) -> None:
            found = float(f"{question.value(place):.12g}")  # keys add up to -0.7999999999999972
            show_value(found)
            self._edited()

        slider.set_position(question.position(question.default))
        slider.clear()  # a default is not an answer
        slider.moved.connect(moved)
        self.sliders[question.name] = slider
        column.addWidget(slider)
        column.addLayout(below)
        value.setVisible(bool(question.unit))
        column.addWidget(value)
        return box


def _are_digits(keys: Sequence[str]) -> bool:
    """Return whether one key chooses."""
    return all(len(key) == 1 for key in keys)


class _ButtonRows(QWidget):
    """Buttons in as few rows as lets all of their words be read; a button that is too narrow has several lines."""

    def __init__(self, buttons: Sequence[QPushButton]) -> None:
        super().__init__()
        self._buttons = [(button, button.text(), button.sizeHint().width()) for button in buttons]
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        for button in buttons:
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)  # its words follow its width
        self._lay_out(self.maximumWidth())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._lay_out(self.width())
        self._grid.activate()

    def _lay_out(self, width_px: int) -> None:
        widest = max(width for _, _, width in self._buttons)
        most = min(max(width_px // (widest + theme.GRID), 1), len(self._buttons))
        columns = -(-len(self._buttons) // -(-len(self._buttons) // most))
        for index, (button, text, width) in enumerate(self._buttons):
            frame_px = width - button.fontMetrics().size(Qt.TextFlag.TextShowMnemonic, text).width()
            button.setText(_in_lines(text, button.font(), width_px - frame_px) if width > width_px else text)
            self._grid.addWidget(button, index // columns, index % columns)
        for column in range(len(self._buttons)):
            self._grid.setColumnStretch(column, int(column < columns))


def _in_lines(text: str, font: QFont, width_px: int) -> str:
    """Return a text in lines of at most this width, which end between words where that is possible."""
    found, wrap = [], QTextOption()
    wrap.setWrapMode(QTextOption.WrapMode.WrapAtWordBoundaryOrAnywhere)
    for paragraph in text.splitlines():
        layout = QTextLayout(paragraph, font)
        layout.setTextOption(wrap)
        layout.beginLayout()
        units = paragraph.encode("utf-16-le")  # which Qt counts
        while (line := layout.createLine()).isValid():
            line.setLineWidth(width_px)
            first = 2 * line.textStart()
            found.append(units[first : first + 2 * line.textLength()].decode("utf-16-le").rstrip())
        layout.endLayout()
    return "\n".join(found)
