"""The control of a number: a slider and a text field."""

import math
import re

from PySide6.QtCore import QPoint, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtWidgets import QToolButton

from underfoot.errors import BadValue
from underfoot.number_parsing import parse_gain, parse_quantity
from underfoot.parameters import Count, Number
from underfoot.quantities import INVERTED, gain, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import ElidedButton, Field, ParameterEditor, allowed_gain, help_text, value_text
from underfoot.widgets.controls.slider import Slider

EXACT_DIGITS = 9
"""Significant digits in a field while it is being edited."""

MAX_SLIDER_COUNT = 100_000_000
"""A whole number from a wider range than this is only typed: no slider could aim at one."""


MAX_LINEAR_SPAN = 100_000.0
"""So is a number whose control would be spaced evenly over more than this."""

_FACTOR = re.compile(r"\s*[*/]\s*[\d.,]+\s*")
"""What changes the number that is there, in place of giving one. Of several numbers that differ, none is there."""

STOP_DB = 1.0
"""Half-width of the stop at 0 dB, which a gain's slider has for a mouse and not for keys."""


class NumberEditor(ParameterEditor):
    """A slider, and a field for a number with or without unit; also for integers."""

    disconnect_requested = Signal()
    """The wire that drives the value is to go."""

    drive_requested = Signal(QPoint)
    """A menu of what may drive the value is wanted, at this place of the screen."""

    def __init__(self, parameter: Number | Count) -> None:
        super().__init__(parameter)
        self._is_integer = isinstance(parameter, Count)
        self._unit = parameter.unit
        self._is_gain = isinstance(parameter, Number) and parameter.scale == "gain"
        self.field = Field(self)
        self.field.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.field.setAccessibleName(f"{parameter.label}, typed")
        self.field.setToolTip(help_text(parameter))
        self.field.setMinimumWidth(64)
        self.slider = Slider(self)
        self.driver = ElidedButton(self)
        self.driver.clicked.connect(self.disconnect_requested)
        self.driver.hide()
        self.grid.addWidget(self.field, 0, 2)
        self.grid.addWidget(self.driver, 0, 1, 1, 2)
        self._place_control(self.slider)
        self.slider.setToolTip(f"{help_text(parameter)}\nDouble-click for {value_text(parameter, parameter.initial)}")
        self.slider.setVisible(not self._exceeds_slider(parameter))
        self.inverted = QToolButton(self)
        self.inverted.setVisible(self._is_gain and parameter.low < 0.0)
        if self._is_gain and parameter.low < 0.0:
            self._add_inversion()
        elif parameter.low < 0.0 < parameter.high:
            self.slider.set_zero(self._position(0.0))
        self.can_be_driven = False
        self.slider.edit_began.connect(self.edit_began)
        self.slider.moved.connect(self._slider_moved)
        self.slider.reset_requested.connect(self._set_to_default)
        self.field.focus_gained.connect(lambda: self._show(EXACT_DIGITS))
        self.field.focus_lost.connect(self._show)
        self.field.committed.connect(self._typed)
        self.field.stepped.connect(self._step)
        self.slider.sliderReleased.connect(self.let_go)
        self.field.let_go.connect(self.let_go)
        self.set_value(parameter.initial)

    @property
    def is_held(self) -> bool:
        return self.slider.isSliderDown() or self.field.is_held

    def offer_driving(self) -> None:
        """Ask for the menu of what may drive the value on a right click, if a wire can."""
        self.can_be_driven = isinstance(self.parameter, Number) and bool(self.parameter.wire)
        if self.can_be_driven:
            self.field.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)  # the row has a label
            self.label.setToolTip(f"{help_text(self.parameter)}\nRight-click: drive it with a signal")

    def _add_inversion(self) -> None:
        """Add a button for the sign: the slider sets the magnitude, so a drag cannot cross zero."""
        self.inverted.setText(INVERTED)
        self.inverted.setCheckable(True)
        self.inverted.setProperty("role", "chip")
        self.inverted.setAccessibleName(f"{self.parameter.label}, inverted")
        self.inverted.setToolTip("Inverted: the sign of the input is reversed")
        self.inverted.clicked.connect(self._invert)
        self.grid.addWidget(self.field, 0, 2, 1, 2)
        self.grid.addWidget(self.inverted, 1, 3)

    def _invert(self, on: bool) -> None:
        self.edit_began.emit()
        self._commit(math.copysign(self._value, -1.0 if on else 1.0))
        self._rewrite()

    def set_driven(self, by: str, colour: str = "", signal_range: tuple[float, float] | None = None) -> None:
        """Show that a wire drives the value, with its range if known.

        An empty `by` ends that.
        """
        self.slider.setEnabled(not by)
        self.inverted.setEnabled(not by)
        self.slider.set_accent(colour or theme.VIBRATION)
        self.field.setVisible(not by)
        self.driver.setVisible(bool(by))
        self.reset_button.setVisible(not by and self._value != self.parameter.initial)
        name, ends = f"driven by {by}", ""
        if by and signal_range is not None:
            parameter = self.parameter
            assert isinstance(parameter, Number)
            low, high = (min(max(end, parameter.low), parameter.high) for end in signal_range)
            ends = self._range_text(*((low, high) if parameter.wire == "span" else signal_range))
            name = by
            places = sorted((self._position(low), self._position(high)))
            self.slider.set_range_shown((0.0 if self._is_gain and low < 0.0 < high else places[0], places[1]))
        else:
            self.slider.set_range_shown(None)
        self.driver.set_full_text(name, "  ×", f": {ends}" if ends else "")
        self.driver.setToolTip(
            f"Driven by {by}{', ' if ends else ''}{ends}. Click to disconnect the wire; right-click for others."
        )
        self.driver.setStyleSheet(f"color: {colour}; text-align: right;")

    def _range_text(self, low: float, high: float) -> str:
        """Return a range as text; as one value if its ends are equal."""
        ends = [gain(end) if self._is_gain else quantity(end, self._unit) for end in (low, high)]
        if ends[0] == ends[1]:
            return ends[0]
        if ends[0].partition(" ")[2] == ends[1].partition(" ")[2]:
            ends[0] = ends[0].partition(" ")[0]
        return " to ".join(ends)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if self.can_be_driven:
            self.drive_requested.emit(event.globalPos())
            event.accept()
        else:
            super().contextMenuEvent(event)

    def _show(self, digits: int = 4) -> None:
        if digits == EXACT_DIGITS or not self.field.hasFocus():
            with QSignalBlocker(self.field):
                self.field.setText(self._value_text(max(digits, 9) if self._is_integer else digits))
            self.field.show_error("")
            self.field.setToolTip(help_text(self.parameter))
        elif self.field.is_untouched:  # an undo, say
            self.field.show_text(self._value_text(EXACT_DIGITS))
        self.slider.set_position(self._position(self._value))
        self._say_value()
        self.inverted.setChecked(math.copysign(1.0, self._value) < 0.0)

    def _say_value(self) -> None:
        """Tell a screen reader the value with its unit: of the slider itself it has thousandths of the way."""
        self.slider.setAccessibleDescription(self._value_text(4))

    def _slider_moved(self, position: float) -> None:
        value = self._rounded_value(position)
        is_stepped = self._is_integer and not self.slider.isSliderDown()  # by a key or the wheel
        if is_stepped and value == self._value:  # the next count is further away than a step of the slider
            value += 1 if position > self._position(value) else -1
        self._commit(-value if self.inverted.isChecked() else value)
        if is_stepped:
            self.slider.set_position(self._position(self._value))
        self._rewrite()

    def _rewrite(self) -> None:
        """Show the value set by another control, even if the field has the focus."""
        with QSignalBlocker(self.field):
            self.field.show_text(self._value_text(4))
        self.field.show_error("")
        self._say_value()

    def _step(self, way: int, is_fine: bool, is_first: bool) -> None:
        """Move the value from what is typed by a step of its slider. Without a slider, a whole number, such as a seed,
        goes to the next, and another one by its second digit, or if fine by its third.
        """
        self.field.commit()
        if self.field.property("role") == "bad":
            return
        if is_first:
            self.edit_began.emit()
        if self.slider.isVisible():
            self.slider.step(way, is_fine=is_fine)
            return
        step, parameter = 1.0, self.parameter
        assert isinstance(parameter, Number | Count)
        if not self._is_integer:
            step = 10.0 ** (math.floor(math.log10(abs(self._value) or 1.0)) - (2 if is_fine else 1))
        moved = self._value + way * step
        moved = round(moved) if self._is_integer else float(f"{moved:.{EXACT_DIGITS}g}")
        self._commit(min(max(moved, parameter.low), parameter.high))
        self._rewrite()

    def _value_text(self, digits: int) -> str:
        return gain(self._value, digits) if self._is_gain else quantity(self._value, self._unit, digits)

    def _typed(self, text: str) -> None:
        try:
            value = self._parsed(text)
            self._require_allowed_gain(value)
            self.edit_began.emit()
            self._commit(round(value, 12) if self._is_integer else value)
        except BadValue as error:
            self.field.show_error(self._refusal(error))
            return
        self._show(EXACT_DIGITS)

    def _require_allowed_gain(self, value: float) -> None:
        """Raise `BadValue` for a factor out of range, in decibels, as the field shows it; others raise it in units."""
        parameter = self.parameter
        if isinstance(parameter, Number) and self._is_gain and not parameter.low <= value <= parameter.high:
            raise BadValue(f"{gain(value, EXACT_DIGITS)}; allowed: {allowed_gain(parameter)}")

    def _parsed(self, text: str) -> float:
        parameter = self.parameter
        if _FACTOR.fullmatch(text) and not self._mixed:
            return self._value * parse_quantity(f"1{text}")
        follows = isinstance(parameter, Number) and bool(parameter.unit_of) and not self._unit
        if self._is_gain or (follows and text.lower().endswith("db")):
            return parse_gain(text)
        try:
            return parse_quantity(text, self._unit)
        except BadValue as error:
            if not follows:
                raise
            raise BadValue(f"{error}; a wire gives it the unit of what it drives") from None

    def _position(self, value: float) -> float:
        parameter = self.parameter
        if isinstance(parameter, Number):
            return parameter.position(value)
        assert isinstance(parameter, Count)
        if self._is_log_scaled(parameter):
            return math.log1p(value - parameter.low) / math.log1p(parameter.high - parameter.low)
        return (value - parameter.low) / max(parameter.high - parameter.low, 1)

    def _rounded_value(self, position: float) -> float | int:
        """Return the value at a slider's position, rounded to three digits, the slider's resolution."""
        parameter = self.parameter
        if isinstance(parameter, Number):
            value = parameter.value(position)
            if position in (0.0, 1.0) or value == 0.0:
                return value
            if parameter.scale == "gain":
                tenths = round(200.0 * math.log10(value)) / 10.0  # a slider's resolution is a tenth of a decibel
                is_stopped = self.slider.isSliderDown() and abs(tenths) < STOP_DB
                return 1.0 if is_stopped else min(10.0 ** (tenths / 20.0), parameter.high)
            step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
            if parameter.scale == "linear":
                step = max(step, 10.0 ** math.floor(math.log10((parameter.high - parameter.low) / 1000)))
            decimals = max(-round(math.log10(step)), 0)
            return min(max(round(round(value / step) * step, decimals), parameter.low), parameter.high)
        assert isinstance(parameter, Count)
        if self._is_log_scaled(parameter):
            return parameter.low + round(math.expm1(position * math.log1p(parameter.high - parameter.low)))
        return round(parameter.low + position * (parameter.high - parameter.low))

    @staticmethod
    def _exceeds_slider(parameter: Number | Count) -> bool:
        """Return whether a slider is too coarse for the parameter's range."""
        span = parameter.high - parameter.low
        if isinstance(parameter, Count):
            return span > MAX_SLIDER_COUNT
        return parameter.scale == "linear" and span > MAX_LINEAR_SPAN

    @staticmethod
    def _is_log_scaled(parameter: Count) -> bool:
        """Return whether an integer's range is so large that a linear slider could not reach its low end."""
        return parameter.high - parameter.low > 500
