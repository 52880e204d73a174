"""Controls made from the declaration of a parameter alone; each edits a value, independent of its use."""

import os
from functools import singledispatch
from pathlib import Path

from PySide6.QtCore import QSignalBlocker
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QToolButton

from underfoot.errors import BadValue
from underfoot.files import no_file
from underfoot.number_parsing import parse_numbers
from underfoot.parameters import Choice, Count, FilePath, Number, Numbers, Parameter, Rows, Text, Tiles
from underfoot.patch.file_paths import named_from
from underfoot.widgets import theme
from underfoot.widgets.controls.choice_box import ChoiceBox
from underfoot.widgets.controls.fields import Field, ParameterEditor, help_text
from underfoot.widgets.controls.file_dialog import ask_file
from underfoot.widgets.controls.list_editors import RowsEditor, TilesEditor
from underfoot.widgets.controls.local_files import local_files
from underfoot.widgets.controls.number_editor import EXACT_DIGITS, NumberEditor

PADDING_PX = 24
"""Of a field, left and right together, where it has no room for text."""


@singledispatch
def editor_for(parameter: Parameter) -> ParameterEditor:
    """Return the control for a parameter, made from its declaration."""
    raise AssertionError(f"no control for {type(parameter).__name__}")


class ChoiceEditor(ParameterEditor):
    """A choice of one of several names."""

    def __init__(self, parameter: Choice) -> None:
        super().__init__(parameter)
        self.box = ChoiceBox(self)
        self.box.addItems(list(parameter.options))
        self._place_control(self.box)
        self.box.activated.connect(self._picked)
        self.set_value(parameter.default)

    def _show(self) -> None:
        with QSignalBlocker(self.box):
            self.box.setCurrentText(self._value)

    def _picked(self) -> None:
        self.edit_began.emit()
        self._commit(self.box.currentText())


class TextEditor(ParameterEditor):
    """A line of text; its tooltip has all of a text that is longer than the field."""

    def __init__(self, parameter: Parameter) -> None:
        super().__init__(parameter)
        self.field = Field(self, role="")
        self.field.committed.connect(self._typed)
        self.field.focus_lost.connect(self._drop_refused)
        self._place_control(self.field)
        self.set_value(parameter.default)

    def _as_text(self) -> str:
        return str(self._value)

    def _from_text(self, text: str) -> object:
        return text

    def _show(self) -> None:
        if not self.field.hasFocus():
            self.field.setText(self._as_text())
            self.field.setCursorPosition(0)  # show the beginning of a long text
        elif self.field.is_untouched:
            self.field.show_text(self._as_text())
        self._show_help()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_help()

    def _typed(self, text: str) -> None:
        try:
            value = self._from_text(text)
            self.edit_began.emit()
            self._commit(value)
        except BadValue as error:
            self.field.show_error(self._refusal(error))
            return
        self.field.setText(self._as_text())
        self._show_valid()

    def _drop_refused(self) -> None:
        """Show the value again when a refused text is left, as a number does."""
        if self.field.property("role") == "bad":
            self._show_valid()
            self._show()

    def _show_valid(self) -> None:
        self.field.show_error("")
        self._show_help()

    def _show_help(self) -> None:
        if self.field.property("role") == "bad":
            return  # the tooltip has the reason
        text, tip = self._as_text(), help_text(self.parameter)
        is_cut = self.field.fontMetrics().horizontalAdvance(text) > self.field.width() - PADDING_PX
        self.field.setToolTip(f"{text}\n{tip}" if is_cut else tip)


class NumbersEditor(TextEditor):
    """A list of numbers in a text field, separated by spaces or commas, each with or without its unit."""

    def __init__(self, parameter: Numbers) -> None:
        self._unit = parameter.unit
        super().__init__(parameter)

    def _as_text(self) -> str:
        return ", ".join(f"{item:.{EXACT_DIGITS}g}" for item in self._value)  # an edit of one keeps the others

    def _from_text(self, text: str) -> list[float]:
        return parse_numbers(text, self._unit)


class FileEditor(TextEditor):
    """The path of a file: typed, chosen in a dialog, or that of a file that is dropped here. The label says where there
    is no such file.
    """

    _folder: Path | None = None  # of the class: the path is shown before an editor is made

    def __init__(self, parameter: FilePath) -> None:
        super().__init__(parameter)
        self.setAcceptDrops(True)
        self.field.setAcceptDrops(False)  # it would take the file's address as text
        look = QToolButton(self)
        look.setText("…")
        look.setAccessibleName("Look for a file")
        look.setToolTip("Look for a file")
        look.clicked.connect(self._look)
        line = QHBoxLayout()
        line.setSpacing(4)
        line.addWidget(self.field)
        line.addWidget(look)
        self.grid.addLayout(line, 1, 0, 1, 3)

    def set_folder(self, folder: Path | None) -> None:
        """Set the folder to which paths below it are shown relative, so that the folder can be moved."""
        self._folder = folder
        self._show_whether_there()

    def set_mixed(self, values: str, wired: str = "") -> None:
        super().set_mixed(values, wired)
        self._show_whether_there()

    def _show(self) -> None:
        super()._show()
        self._show_whether_there()

    def _typed(self, text: str) -> None:
        super()._typed(text)
        self._show_whether_there()

    def _show_whether_there(self) -> None:
        if self._mixed:
            return
        path, label = Path(self._folder or "", self._value), self.parameter.label
        lacks = bool(self._value) and path.is_absolute() and not os.path.isfile(path)  # which raises nothing
        self.label.setText(f"{label}: {no_file(path)}" if lacks else label)
        theme.set_role(self.label, "alarm" if lacks else "muted")

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if local_files(event.mimeData()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        event.acceptProposedAction()
        self.choose(local_files(event.mimeData())[0])

    def _look(self) -> None:
        ask_file(self.window(), self.parameter.label, "", self.choose, str(self._folder or ""))

    def choose(self, path: Path) -> None:
        """Use this file, as a change by the user."""
        self._typed(named_from(self._folder, path))


editor_for.register(Number, NumberEditor)
editor_for.register(Count, NumberEditor)
editor_for.register(Choice, ChoiceEditor)
editor_for.register(Numbers, NumbersEditor)
editor_for.register(Rows, RowsEditor)
editor_for.register(Text, TextEditor)
editor_for.register(FilePath, FileEditor)
editor_for.register(Tiles, TilesEditor)
