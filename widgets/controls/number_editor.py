"""The control of a number: a slider, and a field that is typed into."""

import math

from PySide6.QtCore import QPoint, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtWidgets import QToolButton, QWidget

from underfoot.errors import BadValue
from underfoot.parameters import Count, Number
from underfoot.quantities import INVERTED, gain, parse_gain, parse_quantity, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import ElidedButton, Field, ParameterEditor, help_text
from underfoot.widgets.controls.slider import Slider

EXACT = 9
"""Significant digits in a field while it is being edited."""

WIDEST = 100_000_000
"""A whole number from a wider range than this is only typed: no slider could aim at one."""


WIDEST_EVEN = 100_000.0
"""So is a number whose control would be spaced evenly over more than this."""


class NumberEditor(ParameterEditor):
    """A slider, and a field that takes a number with or without its unit. Whole numbers too."""

    disconnect_wanted = Signal()
    """The wire that drives the value is to go."""

    drive_wanted = Signal(QPoint)
    """A menu of what may drive the value is wanted, at this place of the screen."""

    def __init__(self, parameter: Number | Count, parent: QWidget | None = None) -> None:
        super().__init__(parameter, parent)
        self._is_whole = isinstance(parameter, Count)
        self._unit = parameter.unit
        self._is_gain = isinstance(parameter, Number) and parameter.scale == "gain"
        self.field = Field(self)
        self.field.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.field.setAccessibleName(f"{parameter.label}, typed")
        self.field.setToolTip(help_text(parameter))
        self.field.setMinimumWidth(64)
        self.slider = Slider(self)
        self.driver = ElidedButton(self)
        self.driver.clicked.connect(self.disconnect_wanted)
        self.driver.hide()
        self.grid.addWidget(self.field, 0, 2)
        self.grid.addWidget(self.driver, 0, 1, 1, 2)
        self._put(self.slider)
        self.slider.setVisible(not self._is_too_wide(parameter))
        self.inverts = QToolButton(self)
        self.inverts.setVisible(self._is_gain and parameter.low < 0.0)
        if self._is_gain and parameter.low < 0.0:
            self._offer_inversion()
        elif parameter.low < 0.0 < parameter.high:
            self.slider.set_zero(self._place(0.0))
        self.may_be_driven = isinstance(parameter, Number) and bool(parameter.wire)
        if self.may_be_driven:
            self.field.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)  # the row has one
            self.label.setToolTip(f"{help_text(parameter)}\nRight-click: drive it with a signal")
        self.slider.grasped.connect(self.began)
        self.slider.moved.connect(self._slid)
        self.field.entered.connect(lambda: self._show(EXACT))
        self.field.left.connect(self._left)
        self.field.given.connect(self._typed)
        self.set_value(parameter.default)

    def _offer_inversion(self) -> None:
        """A button beside the slider for the sign: the slider sets a size, and no drag passes through silence."""
        self.inverts.setText(INVERTED)
        self.inverts.setCheckable(True)
        self.inverts.setProperty("role", "chip")
        self.inverts.setAccessibleName(f"{self.parameter.label}, inverted")
        self.inverts.setToolTip("Inverted: what comes in is turned round")
        self.inverts.clicked.connect(self._invert)
        self.grid.addWidget(self.field, 0, 2, 1, 2)
        self.grid.addWidget(self.inverts, 1, 3)

    def _invert(self, on: bool) -> None:
        self.began.emit()
        self._give(math.copysign(self._value, -1.0 if on else 1.0))
        self._rewrite()

    def set_driven(self, by: str, colour: str = "", reach: tuple[float, float] | None = None) -> None:
        """Show that a wire gives the value, and from where to where it goes if that is known.

        An empty `by` takes that back.
        """
        self.slider.setEnabled(not by)
        self.inverts.setEnabled(not by)
        self.slider.set_accent(colour or theme.VIBRATION)
        self.field.setVisible(not by)
        self.driver.setVisible(bool(by))
        self.back.setVisible(not by and self._value != self.parameter.default)
        words, ends = f"driven by {by}", ""
        if by and reach is not None:
            parameter = self.parameter
            assert isinstance(parameter, Number)
            low, high = (min(max(end, parameter.low), parameter.high) for end in reach)
            ends = self._way(*((low, high) if parameter.wire == "span" else reach))
            words = f"{by}: {ends}"
            places = sorted((self._place(low), self._place(high)))
            self.slider.set_band((0.0 if self._is_gain and low < 0.0 < high else places[0], places[1]))
        else:
            self.slider.set_band(None)
        self.driver.set_full_text(words, "  ×")
        self.driver.setToolTip(
            f"Driven by {by}{', ' if ends else ''}{ends}. Click to disconnect the wire; right-click for others."
        )
        self.driver.setStyleSheet(f"color: {colour}; text-align: right;")

    def _way(self, low: float, high: float) -> str:
        """A range in words: as one value where nothing moves."""
        ends = [gain(end) if self._is_gain else quantity(end, self._unit) for end in (low, high)]
        if ends[0] == ends[1]:
            return ends[0]
        if not self._is_gain and ends[0].partition(" ")[2] == ends[1].partition(" ")[2]:
            ends[0] = ends[0].partition(" ")[0]
        return " to ".join(ends)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if self.may_be_driven:
            self.drive_wanted.emit(event.globalPos())
            event.accept()
        else:
            super().contextMenuEvent(event)

    def _show(self, digits: int = 4) -> None:
        if digits == EXACT or not self.field.hasFocus():
            with QSignalBlocker(self.field):
                self.field.setText(self._in_words(max(digits, 9) if self._is_whole else digits))
            self.field.complain("")
            self.field.setToolTip(help_text(self.parameter))
        self.slider.set_place(self._place(self._value))
        self.inverts.setChecked(math.copysign(1.0, self._value) < 0.0)

    def _left(self) -> None:
        self._show()

    def _slid(self, place: float) -> None:
        value = self._rounded(place)
        self._give(-value if self.inverts.isChecked() else value)
        self._rewrite()

    def _rewrite(self) -> None:
        """Show in the field what another control has set, also while the field has the focus."""
        with QSignalBlocker(self.field):
            self.field.setText(self._in_words(4))

    def _in_words(self, digits: int) -> str:
        return gain(self._value, digits) if self._is_gain else quantity(self._value, self._unit, digits)

    def _typed(self, text: str) -> None:
        try:
            value = parse_gain(text) if self._is_gain else parse_quantity(text, self._unit)
            self.began.emit()
            self._give(round(value, 12) if self._is_whole else value)
        except BadValue as error:
            self.field.complain(str(error).removeprefix(f"{self.parameter.name} is "))
            return
        self._show(EXACT)

    def _place(self, value: float) -> float:
        parameter = self.parameter
        if isinstance(parameter, Number):
            return parameter.position(value)
        assert isinstance(parameter, Count)
        if self._is_wide(parameter):
            return math.log1p(value - parameter.low) / math.log1p(parameter.high - parameter.low)
        return (value - parameter.low) / max(parameter.high - parameter.low, 1)

    def _rounded(self, place: float) -> float | int:
        """The value at a slider's place, to the three digits that a slider can aim at."""
        parameter = self.parameter
        if isinstance(parameter, Number):
            value = parameter.value(place)
            if place in (0.0, 1.0) or value == 0.0:
                return value
            if parameter.scale == "gain":
                tenths = round(200.0 * math.log10(value)) / 10.0  # a hand aims at tenths of a decibel
                return min(10.0 ** (tenths / 20.0), parameter.high)
            step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
            if parameter.scale == "linear":
                step = max(step, 10.0 ** math.floor(math.log10((parameter.high - parameter.low) / 1000)))
            decimals = max(-round(math.log10(step)), 0)
            return min(max(round(round(value / step) * step, decimals), parameter.low), parameter.high)
        assert isinstance(parameter, Count)
        if self._is_wide(parameter):
            return parameter.low + round(math.expm1(place * math.log1p(parameter.high - parameter.low)))
        return round(parameter.low + place * (parameter.high - parameter.low))

    @staticmethod
    def _is_too_wide(parameter: Number | Count) -> bool:
        """Whether no slider could aim at a value that is meant."""
        span = parameter.high - parameter.low
        if isinstance(parameter, Count):
            return span > WIDEST
        return parameter.scale == "linear" and span > WIDEST_EVEN

    @staticmethod
    def _is_wide(parameter: Count) -> bool:
        """Whether a whole number spans so much that equal steps would make the low end unreachable."""
        return parameter.high - parameter.low > 500
