"""What a page asks, as a participant answers it: big buttons, a wide slider, a line of text; keys do the same."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QLineEdit, QPushButton, QVBoxLayout, QWidget

from underfoot.errors import BadValue
from underfoot.experiments.questions import OpenChoice, Scale, ask, needs_answer, typed_answer, unanswered
from underfoot.parameters import Choice, Count, Number, Parameter
from underfoot.quantities import quantity
from underfoot.studies.runner import Runner
from underfoot.widgets import theme
from underfoot.widgets.controls.slider import Slider

TEXT_PX, BUTTON_LINES = 20, 2.6
MOST_BUTTONS = 12
"""Whole numbers of up to so many are buttons; of more, a line."""
_STEP = 0.02
_SIDES = (Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight)


def asks_of(runner: Runner) -> tuple[Parameter, ...]:
    """What is answered on a runner's page: its questions, or, in learning, which stimulus is to be felt."""
    if runner.page.kind == "learn":
        return (ask("number", Count(1, 1, len(runner.study.learnable), doc="Which one do you want to feel?")),)
    return runner.page.questions


class AnswerForm(QWidget):
    """Shows what is asked. One question of a few choices is answered by its button; anything else by `give`."""

    answered = Signal(dict)
    changed = Signal(str, object)
    """A slider was moved: its name, and the value."""
    refused = Signal(str)
    """Why what was given cannot be."""

    def __init__(self, text_px: int = TEXT_PX) -> None:
        super().__init__()
        self._text_px = text_px
        self._layout = QVBoxLayout(self)
        self._layout.setSpacing(2 * theme.GRID)
        self._asks: tuple[Parameter, ...] = ()
        self.buttons: list[QPushButton] = []
        self.fields: dict[str, QLineEdit] = {}
        self.sliders: dict[str, Slider] = {}
        self._chosen: dict[str, Any] = {}

    @property
    def is_by_button(self) -> bool:
        """Whether one press of a button answers all."""
        return len(self._asks) == 1 and bool(self.buttons)

    @property
    def is_to_give(self) -> bool:
        """Whether something is asked that no single button answers."""
        return bool(self._asks) and not self.is_by_button

    @property
    def how(self) -> str:
        """What to do to answer, in a sentence."""
        if self.is_by_button:
            last = len(self.buttons)
            return f"Press a number from 1 to {last}, or click." if last > 2 else "Press 1 or 2, or click."
        if len(self.sliders) == 1:
            return "Left and Right move it. Return answers."
        return "Press Return to go on, or click."

    def show_asks(self, asks: Sequence[Parameter]) -> None:
        """Ask this now, in the place of what was asked before."""
        while self._layout.count():
            item = self._layout.takeAt(0)
            widget = item.widget() if item is not None else None
            if widget is not None:
                widget.hide()
                widget.deleteLater()
        self._asks = tuple(asks)
        self.buttons, self.fields, self.sliders, self._chosen = [], {}, {}, {}
        for one in self._asks:
            self._layout.addWidget(self._one(one))

    def give(self) -> None:
        """Answer with what is chosen and typed."""
        try:
            values = {one.name: self._given(one) for one in self._asks}
        except BadValue as error:
            self.refused.emit(str(error))
            return
        self.answered.emit(values)

    def key(self, key: int, text: str) -> bool:
        """What a key does: a number chooses, arrows move the only slider. Whether it did something."""
        if self.is_by_button and text.isdecimal() and 0 < int(text) <= len(self.buttons):
            self.buttons[int(text) - 1].click()
            return True
        way = {Qt.Key.Key_Left.value: -_STEP, Qt.Key.Key_Right.value: _STEP}.get(key)
        if way is not None and len(self.sliders) == 1:
            slider = next(iter(self.sliders.values()))
            slider.set_place(slider.place() + way)
            slider.moved.emit(slider.place())
            return True
        return False

    def _given(self, one: Parameter) -> Any:
        """What answers this; `BadValue`, with its line ready to be typed in, where nothing does."""
        field = self.fields.get(one.name)
        if field is None:
            if one.name not in self._chosen and needs_answer(one):
                raise unanswered(one)
            return self._chosen.get(one.name, one.default)
        text = field.text().strip()
        try:
            if not text and needs_answer(one):
                raise unanswered(one)
            return typed_answer(one, text)
        except BadValue:
            field.setFocus()
            field.selectAll()
            raise

    def _one(self, one: Parameter) -> QWidget:
        box = QWidget()
        column = QVBoxLayout(box)
        column.setContentsMargins(0, 0, 0, 0)
        words = theme.label(one.doc or one.label)
        words.setFont(theme.font(self._text_px))
        words.setWordWrap(True)
        words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        column.addWidget(words)
        column.addWidget(self._control(one))
        return box

    def _control(self, one: Parameter) -> QWidget:
        if isinstance(one, Choice):
            return self._choices(one, list(one.options))
        if isinstance(one, Count) and one.high - one.low < MOST_BUTTONS:
            return self._choices(one, list(range(one.low, one.high + 1)))
        if isinstance(one, Number) and len(self._asks) == 1:
            return self._slider(one)
        field = QLineEdit()
        field.setFont(theme.font(self._text_px))
        field.setAccessibleName(one.label)
        field.setPlaceholderText("" if one.kind == "text" else one.allowed)
        self.fields[one.name] = field
        return field

    def _choices(self, one: Parameter, options: Sequence[Any]) -> QWidget:
        line = QWidget()
        row = QHBoxLayout(line)
        row.setContentsMargins(0, 0, 0, 0)
        mine: list[QPushButton] = []
        is_numbered = len(self._asks) == 1 and len(options) > 2 and not isinstance(one, Count)
        for number, option in enumerate(options, 1):
            button = QPushButton(f"{number}  {option}" if is_numbered else str(option))  # its key
            button.setFont(theme.font(self._text_px))
            button.setStyleSheet(f"min-height: {round(BUTTON_LINES * self._text_px)}px")  # over the theme's
            button.setCheckable(len(self._asks) > 1)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # where it is gone, the focus would go to another
            button.clicked.connect(lambda _=False, value=option, b=button: self._choose(one, value, mine, b))
            button.setChecked(isinstance(one, OpenChoice) and option == one.default)
            mine.append(button)
            row.addWidget(button)
        self.buttons += mine
        return line

    def _choose(self, one: Parameter, value: Any, mine: Sequence[QPushButton], pressed: QPushButton) -> None:
        self._chosen[one.name] = value
        for button in mine:
            button.setChecked(button is pressed)
        if self.is_by_button:
            self.give()

    def _slider(self, one: Number) -> QWidget:
        box = QWidget()
        column = QVBoxLayout(box)
        slider, value = Slider(), QLabel()
        below = QHBoxLayout()
        for end, side in zip(one.ends if isinstance(one, Scale) else (), _SIDES, strict=False):
            words = theme.label(end, "muted")
            words.setFont(theme.font(self._text_px))
            below.addWidget(words, 1, side)
        slider.setAccessibleName(one.label)
        slider.setMinimumSize(480, 4 * theme.GRID)
        value.setAlignment(Qt.AlignmentFlag.AlignCenter)
        value.setFont(theme.font(self._text_px))

        def stands(found: float) -> None:
            self._chosen[one.name] = found
            value.setText(quantity(round(found, 2), one.unit) if one.unit else "")

        def moved(place: float) -> None:
            stands(one.value(place))
            self.changed.emit(one.name, one.value(place))

        slider.set_place(one.position(one.default))
        stands(one.default)
        slider.moved.connect(moved)
        self.sliders[one.name] = slider
        column.addWidget(slider)
        column.addLayout(below)
        value.setVisible(bool(one.unit))
        column.addWidget(value)
        return box
