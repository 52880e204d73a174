"""Common parts of parameter editors: a label, a reset to the default, a text field, and help."""

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent, QResizeEvent
from PySide6.QtWidgets import (
    QApplication,
    QGridLayout,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QToolTip,
    QWidget,
)

from underfoot.errors import BadValue
from underfoot.parameters import Count, Number, Numbers, Parameter
from underfoot.quantities import gain, number, pretty_text, pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.choice_box import name_control
from underfoot.widgets.controls.menu import literal
from underfoot.widgets.controls.undo_actions import left_to_document
from underfoot.widgets.escape import claims_escape
from underfoot.widgets.lost_release import is_release_lost

STEP_PX = 4
"""How far a drag goes up for one step of a number."""


class ParameterEditor(QWidget):
    """A labelled control. `value_changed` follows every change by the user. `began` precedes a new series of changes,
    which an undo list stores as one.
    """

    can_reset = True
    """Whether the control has a button to reset to the default."""

    value_changed = Signal(object)
    edit_began = Signal()
    let_go = Signal()
    """A hand that held the control let it go."""
    refused = Signal(str)
    """Why a typed value was not taken, in a control that does not keep it to be corrected."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__()
        self.parameter = parameter
        self._value: Any = parameter.initial
        self._name, self._mixed, self._remark = parameter.label, "", ""
        self.label = theme.label(parameter.label, "muted")
        self.label.setToolTip(help_text(parameter))
        self.reset_button = QToolButton(self)
        self.reset_button.setText("↺")
        self.reset_button.setProperty("role", "flat")
        self.reset_button.setFixedSize(theme.HIT_PX, theme.HIT_PX)
        self.reset_button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.reset_button.setToolTip(f"Back to {value_text(parameter, parameter.initial)}")
        self.reset_button.setAccessibleName(self.reset_button.toolTip())
        self.reset_button.clicked.connect(self.reset)
        keep = self.reset_button.sizePolicy()
        keep.setRetainSizeWhenHidden(True)
        self.reset_button.setSizePolicy(keep)
        self.grid = QGridLayout(self)
        self.grid.setContentsMargins(0, 0, 0, 0)
        self.grid.setHorizontalSpacing(4)
        self.grid.setVerticalSpacing(0)
        self.grid.setColumnStretch(2, 1)
        self.grid.addWidget(self.label, 0, 0)
        self.grid.addWidget(self.reset_button, 0, 1)
        self.setToolTip(help_text(parameter))

    def value(self) -> Any:  # noqa: ANN401 - of the parameter's kind
        """Return the value, as checked by the parameter."""
        return self._value

    def set_value(self, value: object) -> None:
        """Show a value, without emitting a change."""
        self._value = self.parameter.check(value)
        self._show_reset()
        self._show()

    @property
    def is_held(self) -> bool:
        """Whether a hand drags the control."""
        return False

    def set_mixed(self, values: str, wired: str = "") -> None:
        """Show that the edited nodes have several values, or in how many a wire drives it, as texts; "" ends that."""
        remark = ", ".join(filter(None, (values, wired)))
        if (values, remark) != (self._mixed, self._remark):
            self._mixed, self._remark = values, remark
            self.set_name(self._name)
            theme.set_role(self.label, "force" if remark else "muted")
            self._show_reset()

    def set_name(self, name: str) -> None:
        """Show this name, in place of the parameter's own."""
        self._name = name
        self.label.setText(f"{name}: {self._remark}" if self._remark else name)

    def reset(self) -> None:
        """Reset to the default, as a change by the user."""
        self.edit_began.emit()
        self._set_to_default()

    def _set_to_default(self) -> None:
        self._commit(self.parameter.initial)
        self._show()

    def _show(self) -> None:
        """Show `_value` in the control; implemented by each kind of control."""
        raise AssertionError(f"{type(self).__name__} shows nothing")

    def _commit(self, value: object) -> None:
        """Commit a change by the user and emit it; raise `BadValue` if it is not allowed."""
        checked = self.parameter.check(value)
        if checked != self._value or self._mixed:
            self._value = checked
            self._show_reset()
            self.value_changed.emit(checked)

    def _refusal(self, error: BadValue) -> str:
        """Return why a value was not taken, without the parameter's name, which the label has."""
        return str(error).removeprefix(f"{self.parameter.name} is ")

    def _show_reset(self) -> None:
        differs = bool(self._mixed) or self._value != self.parameter.check(self.parameter.initial)
        self.reset_button.setVisible(self.can_reset and differs)

    def _place_control(self, widget: QWidget) -> None:
        """Place the control under the label, and say what it is."""
        widget.setToolTip(help_text(self.parameter))
        name_control(widget, self.parameter.label)
        self.grid.addWidget(widget, 1, 0, 1, 3)


class Field(QLineEdit):
    """A text field for a value: Enter or leaving commits, Escape restores the old value."""

    committed = Signal(str)
    focus_lost = Signal()
    refused = Signal(str)
    """Why the text is not allowed with which the field was left; the old value is shown again."""
    focus_gained = Signal()
    stepped = Signal(int, bool, bool)
    """A step, 1 up or -1 down, by an arrow key or a drag in a field of the role "value"; whether fine, by Shift;
    whether the first of several."""
    let_go = Signal()
    """The mouse, which may have dragged the number, was let go."""

    _text_before = ""  # of the class: events come before a field is made
    _dragged_from: QPoint | None = None
    _is_dragged = False

    def __init__(self, parent: QWidget | None = None, role: str = "value") -> None:
        """`role` is the field's look while its text is valid."""
        super().__init__(parent)
        self._role = role
        self.setProperty("role", role)
        self._offer_drag(True)
        self.textEdited.connect(lambda: self._offer_drag(False))
        self.returnPressed.connect(self._commit_text)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.focus_gained.emit()
        self._text_before = self.text()
        self._offer_drag(event.reason() == Qt.FocusReason.MouseFocusReason)
        self.selectAll()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        super().mousePressEvent(event)
        is_grabbed = self._selects_on_click and self._role == "value" and event.button() == Qt.MouseButton.LeftButton
        self._dragged_from, self._is_dragged = event.position().toPoint() if is_grabbed else None, False

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Step up and down by a drag that begins so in a number that is not being typed; others select text."""
        if self._dragged_from is None:
            super().mouseMoveEvent(event)
            return
        way = self._dragged_from - event.position().toPoint()
        if not self._is_dragged and way.manhattanLength() < QApplication.startDragDistance():
            return
        if not self._is_dragged and abs(way.y()) < abs(way.x()):
            self._dragged_from = None
            return
        steps = int(way.y() / STEP_PX)
        self._dragged_from -= QPoint(0, steps * STEP_PX)
        is_fine = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        for _ in range(abs(steps)):  # one by one: how far a number goes must not depend on how often the mouse is read
            self.stepped.emit(1 if steps > 0 else -1, is_fine, not self._is_dragged)
            self._is_dragged = True

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        super().mouseReleaseEvent(event)
        self._dragged_from = None
        if self._selects_on_click and self.property("role") == "value" and not self.hasSelectedText():
            self.selectAll()  # a click takes the selection away, and what is typed would go into the old number
        self._offer_drag(self._is_dragged)
        self.let_go.emit()

    @property
    def is_held(self) -> bool:
        """Whether the mouse holds the number, to drag it."""
        return self._dragged_from is not None

    def _offer_drag(self, on: bool) -> None:
        """Have the next click select all and the next drag move the number, or place the cursor and select text."""
        self._selects_on_click = on
        if self._role == "value":
            self.setCursor(Qt.CursorShape.SizeVerCursor if on else Qt.CursorShape.IBeamCursor)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() != Qt.FocusReason.PopupFocusReason:
            self._commit_text()
            self.setCursorPosition(0)
            self._offer_drag(True)
            reason = self.property("reason")
            self.focus_lost.emit()
            if reason and not self.property("reason"):
                self.refused.emit(reason)

    @property
    def is_untouched(self) -> bool:
        """Whether nothing was typed that is not committed."""
        return self.text() == self._text_before

    def event(self, event: QEvent) -> bool:
        if self.is_held and is_release_lost(event):
            self._dragged_from = None
            self.let_go.emit()
        if self.is_untouched and left_to_document(event):
            return True
        # During typing, Escape goes to the field, not to a shortcut of the window.
        return claims_escape(event, lambda: not self.is_untouched) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.setText(self._text_before)
            self.show_error("")
            self.selectAll()
            self._offer_drag(True)
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down) and self._role == "value":
            way = 1 if event.key() == Qt.Key.Key_Up else -1
            is_fine = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            self.stepped.emit(way, is_fine, not event.isAutoRepeat())
        else:
            super().keyPressEvent(event)
            if self.property("role") == "bad":
                event.accept()  # by Return: a dialog would be done with the old value

    def show_text(self, text: str) -> None:
        """Show the text of a value that was set otherwise, to which Escape returns."""
        self._text_before = text
        if text != self.text():
            self.setText(text)
        if self.hasFocus() and self._role == "value":
            self.selectAll()

    def commit(self) -> None:
        """Commit the typed text, if any, as on leaving."""
        if self.isModified():
            self._commit_text()

    def show_error(self, reason: str) -> None:
        """Show that the typed text is invalid, with the reason, which whoever types sees at once; "" clears that."""
        was_bad = self.property("role") == "bad"
        theme.set_role(self, "bad" if reason else self._role)
        self.setProperty("reason", reason)
        if reason:
            self.setToolTip(reason)
        if reason and self.hasFocus():
            QToolTip.showText(self.mapToGlobal(QPoint(0, self.height())), reason, self)
        elif was_bad and not reason:
            QToolTip.hideText()

    def _commit_text(self) -> None:
        if not self.is_untouched:
            self.committed.emit(self.text())
            if self.property("role") != "bad":
                self._text_before = self.text()
        if self.hasFocus() and self.property("role") == "value":
            self.selectAll()  # the next number may be typed, or clicked into, at once
            self._offer_drag(True)


def end_typing(window: QWidget) -> None:
    """Commit what is being typed in the window, as on leaving its field, which keeps the focus."""
    typed = window.focusWidget()
    if isinstance(typed, QLineEdit | QPlainTextEdit) and typed.hasFocus():
        typed.clearFocus()
        if typed.isVisible():
            typed.setFocus()


_LEAST_LETTERS = 3
"""Of an elided text, with its ellipsis: fewer name nothing."""


class ElidedButton(QPushButton):
    """A flat button whose text is elided at its end if space is short."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.setProperty("role", "flat")
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self._text, self._tail, self._detail = "", "", ""

    def set_full_text(self, text: str, tail: str = "", detail: str = "") -> None:
        """Set the text; `tail` is never elided. `detail`, before it, is left out where it leaves no word."""
        self._text, self._tail, self._detail = text, tail, detail
        self._fit()

    def full_text(self) -> str:
        return self._text

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        shown, tail = "", ""
        for tail in (self._detail + self._tail, self._tail):
            room = self.width() - 10 - self.fontMetrics().horizontalAdvance(tail)
            shown = self.fontMetrics().elidedText(self._text, Qt.TextElideMode.ElideRight, room)
            if len(shown) >= min(_LEAST_LETTERS, len(self._text)):
                break
        self.setText(literal(shown + tail))


def value_text(parameter: Parameter, value: object) -> str:
    """Return a short text of a parameter's value, as its field shows it.

    >>> value_text(Number(0.82e-3, 0.0, 1.0, unit="m"), 0.82e-3), value_text(Number(1.0, 0.0, 8.0, scale="gain"), 2.0)
    ('820 µm', '6.021 dB')
    """
    if isinstance(parameter, Number | Count) and isinstance(value, float | int):
        in_db = isinstance(parameter, Number) and parameter.scale == "gain"
        return gain(value, 4) if in_db else quantity(value, parameter.unit, 4)
    if isinstance(value, str):
        return value or "an empty text"
    return "the default"


def allowed_gain(parameter: Number) -> str:
    """Return the allowed values of a factor that is set in decibels."""
    inverted = ", also inverted" if parameter.low < 0.0 else ""
    return f"{gain(max(parameter.low, 0.0))} to {gain(parameter.high)}{inverted}"


def help_text(parameter: Parameter) -> str:
    """Return the tooltip of a parameter: its meaning and allowed values."""
    if isinstance(parameter, Number | Count):
        unit = parameter.unit
        allowed = f"{quantity(parameter.low, unit)} to {quantity(parameter.high, unit)}"
        if isinstance(parameter, Number) and parameter.scale == "gain":
            allowed = f"{allowed_gain(parameter)}; a factor is typed as x2"
    elif isinstance(parameter, Numbers):
        allowed = f"{parameter.least} to {parameter.most} numbers, {number(parameter.low)} to {number(parameter.high)}"
        allowed += f" {pretty_unit(parameter.unit)}" if parameter.unit else ""
    else:
        allowed = parameter.allowed
    return "\n".join(line for line in (pretty_text(parameter.doc), allowed) if line)


def range_text(parameter: Parameter, values: Sequence[object]) -> str:
    """Return differing values as a short text.

    >>> range_text(Count(0, 0, 9), [3, 1, 2])
    '1 to 3'
    """
    if isinstance(parameter, Number | Count):
        numbers = [float(value) for value in values if isinstance(value, int | float)]
        return f"{value_text(parameter, min(numbers))} to {value_text(parameter, max(numbers))}"
    return "several values"
