"""A form of declared fields for the values of a document: one row per field; changes are written at once."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QCheckBox, QComboBox, QGridLayout, QLabel, QPlainTextEdit, QWidget

from underfoot.errors import BadValue
from underfoot.experiments.declared import BooleanField, NamedChoice, TextLine, caption, shown_name
from underfoot.experiments.method import StimulusName, StimulusNames
from underfoot.number_parsing import parse_numbers, parse_quantity
from underfoot.parameters import Choice, Count, Number, Numbers, Parameter, Rows
from underfoot.quantities import pretty_text, pretty_unit
from underfoot.widgets import theme
from underfoot.widgets.controls.choice_box import ChoiceBox, name_control
from underfoot.widgets.controls.undo_actions import DocumentLine, DocumentText

CONTROL_PX, LABEL_PX, PROSE_PX = 36 * theme.GRID, 18 * theme.GRID, 10 * theme.GRID
LEAST_CONTROL_PX, NARROW_PX = 12 * theme.GRID, 76 * theme.GRID
"""Smallest width of a control, and the width of a form below which help texts are placed below the controls."""
LONG_TEXTS = ("about", "text")
"""Fields with several lines."""


class FieldRows(QWidget):
    """Shows `parameters` with their `values`, and writes edits into `values`.

    Text that is not a valid value is stored as typed; the check of the document reports it. `stimuli` are the names to
    choose from.
    """

    changed = Signal(str)
    """The name of a field that was set."""

    def __init__(
        self, parameters: Mapping[str, Parameter], values: dict[str, Any], stimuli: Sequence[str] = ()
    ) -> None:
        super().__init__()
        self._values, self._stimuli = values, stimuli
        self.controls: dict[str, QWidget] = {}
        self._lines: list[tuple[int, QWidget, QLabel]] = []
        """Rows of the grid with a control, and its help beside or below it."""
        self._is_narrow = False
        self._grid = grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setHorizontalSpacing(theme.GRID)
        grid.setVerticalSpacing(theme.GRID // 2)
        grid.setColumnMinimumWidth(0, LABEL_PX)
        grid.setColumnStretch(2, 1)
        for index, (name, parameter) in enumerate(parameters.items()):
            row = 2 * index
            text, unit = shown_name(name, parameter), caption(name)[1]
            label = theme.label(text, "muted")
            control = self._control(name, parameter, values.get(name, parameter.default))
            control.setToolTip(pretty_text(f"{parameter.doc} Allowed: {parameter.allowed}".strip()))
            name_control(control, text)
            self.controls[name] = control
            is_prose = isinstance(control, QPlainTextEdit)
            grid.addWidget(label, row, 0, Qt.AlignmentFlag.AlignTop if is_prose else Qt.AlignmentFlag.AlignVCenter)
            if parameter.kind == "text":
                grid.addWidget(control, row, 1, 1, 2)
                continue
            unit = pretty_unit(getattr(parameter, "unit", "") or unit)
            help = theme.paragraph("  ".join(part for part in (unit, pretty_text(parameter.doc)) if part), "small")
            grid.addWidget(control, row, 1)
            self._lines.append((row, control, help))
        self._arrange()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        if self._is_narrow != (self.width() < NARROW_PX):
            self._is_narrow = not self._is_narrow
            self._arrange()

    def _arrange(self) -> None:
        is_narrow = self._is_narrow
        self._grid.setColumnStretch(1, 1 if is_narrow else 0)
        self._grid.setColumnStretch(2, 0 if is_narrow else 1)
        for row, control, help in self._lines:
            control.setMinimumWidth(LEAST_CONTROL_PX if is_narrow else CONTROL_PX)
            control.setMaximumWidth(CONTROL_PX)
            self._grid.addWidget(help, row + is_narrow, 1 if is_narrow else 2)
            help.setVisible(bool(help.text()) or not is_narrow)

    def _set(self, name: str, value: object) -> None:
        self._values[name] = value
        self.changed.emit(name)

    def _control(self, name: str, parameter: Parameter, value: object) -> QWidget:
        match parameter:
            case BooleanField():
                box = QCheckBox()
                box.setChecked(bool(value))
                box.toggled.connect(lambda on: self._set(name, on))
                return box
            case Choice(options=options):
                return self._choices(name, dict(zip(options, options, strict=True)), value)
            case NamedChoice(values=values):
                return self._choices(name, values, value)
            case StimulusName():
                return self._choices(name, {"(none)": "", **{stimulus: stimulus for stimulus in self._stimuli}}, value)
        if name in LONG_TEXTS:
            text = DocumentText(str(value))
            text.setTabChangesFocus(True)
            text.setFixedHeight(PROSE_PX)
            text.textChanged.connect(lambda: self._set(name, text.toPlainText()))
            return text
        line = DocumentLine(value_text(parameter, value))
        match parameter:
            case StimulusNames(moved=moved):
                all_of = "all that vibrate" if moved else f"all: {', '.join(self._stimuli)}"
                line.setPlaceholderText(all_of[:80])
            case TextLine():
                line.setPlaceholderText("none")
            case Rows(columns=columns):
                line.setPlaceholderText("; ".join([", ".join(column for column, _, _ in columns)] * 2) + "; …")
        line.textEdited.connect(lambda typed: self._set(name, parsed_value(parameter, typed)))
        return line

    def _choices(self, name: str, choices: Mapping[str, Any], value: object) -> QComboBox:
        box = ChoiceBox()
        for text, item in choices.items():
            box.addItem(text, item)
        if value not in choices.values():
            box.addItem(str(value), value)
        box.setCurrentIndex(box.findData(value))
        box.activated.connect(lambda at: self._set(name, box.itemData(at)))
        return box


def parsed_value(parameter: Parameter, typed: str) -> object:
    """Return the value of typed text, or the text itself if it is not a valid value.

    >>> parsed_value(Count(1, 1, 9), "4"), parsed_value(Count(1, 1, 9), "many")
    (4, 'many')
    >>> parsed_value(Number(1.0, 0.0, 9.0, unit="s"), "250 ms")
    0.25
    >>> parsed_value(Numbers((1.0,), 0.0, 20.0), "8, 15")
    [8.0, 15.0]
    >>> parsed_value(TextLine(), "often, never"), parsed_value(TextLine(), "yes, always; no")
    (['often', 'never'], ['yes, always', 'no'])
    >>> parsed_value(Rows((), columns=()), "1, 2; 3, 4")
    [[1.0, 2.0], [3.0, 4.0]]
    """
    text = typed.strip()
    unit = getattr(parameter, "unit", "")
    try:
        match parameter:
            case Count():
                found = parse_quantity(text, unit)
                return int(found) if found == found // 1 else found
            case Number():
                return parse_quantity(text, unit)
            case Numbers():
                return parse_numbers(text, unit)
            case StimulusNames():
                return [part for part in re.split(r"[,;\s]+", text) if part]
            case TextLine():
                return [part.strip() for part in text.split(";" if ";" in text else ",") if part.strip()]
            case Rows():
                return [parse_numbers(row) for row in text.split(";") if row.strip()]
    except BadValue:
        return text
    return typed


def value_text(parameter: Parameter, value: object) -> str:
    """Return a value as text that `parsed_value` reads.

    >>> value_text(TextLine(), ["yes, always", "no"]), value_text(Rows((), columns=()), [[1.0, 2.5], [3.0, 4.0]])
    ('yes, always; no', '1, 2.5; 3, 4')
    """
    if isinstance(value, list | tuple):
        if isinstance(parameter, Rows):
            return "; ".join(_joined(row) for row in value)
        return _joined(value)
    return _number_text(value)


def _joined(items: object) -> str:
    words = [_number_text(item) for item in items] if isinstance(items, list | tuple) else [str(items)]
    return ("; " if any("," in word for word in words) else ", ").join(words)


def _number_text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
