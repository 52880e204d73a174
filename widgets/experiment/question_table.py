"""Questions of a protocol as a table: one row per question, edited in its cells."""

from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from underfoot.experiments.declared import fields_of
from underfoot.experiments.questions import Question
from underfoot.parameters import Choice
from underfoot.widgets import theme
from underfoot.widgets.controls.choice_box import ChoiceBox, name_control
from underfoot.widgets.experiment.field_rows import parsed_value, value_text

COLUMNS = ("name", "text", "kind", "low", "high", "options", "unit")
_FIELDS = fields_of(Question, COLUMNS)
_WIDTHS = {"name": 120, "kind": 96, "low": 56, "high": 56, "options": 200, "unit": 64}
TEXT_PX, OPTIONS_PX = 20 * theme.GRID, 13 * theme.GRID
"""The least width of a question's text, and of its options where it is narrow."""
_NUMBERS = ("number", "count")
_KINDS = {"low": _NUMBERS, "high": _NUMBERS, "unit": _NUMBERS, "options": ("choice",)}
"""The kinds of answers that a column is of use to; others, to all."""
_TIPS = {
    "name": "Its column in the table of trials",
    "options": "Of a choice, separated by commas; by semicolons where one has a comma in it",
}


class QuestionTable(QWidget):
    """Edits a list of questions, `questions`, in place."""

    changed = Signal()

    def __init__(self, questions: list[dict[str, Any]], rows_seen: int = 4) -> None:
        super().__init__()
        self.questions = questions
        self.table = _Table(0, len(COLUMNS))
        self.table.setAccessibleName("Questions")
        self.table.setHorizontalHeaderLabels([column.capitalize() for column in COLUMNS])
        self.table.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.table.setMinimumHeight(theme.GRID * (5 + 4 * rows_seen))
        for index, column in enumerate(COLUMNS):
            if column in _WIDTHS:
                self.table.setColumnWidth(index, _WIDTHS[column])
            heading = self.table.horizontalHeaderItem(index)
            if heading is not None:
                heading.setToolTip(_TIPS.get(column, ""))
        self.add, self.remove = QPushButton("Add a question"), QPushButton("Remove")
        row = QHBoxLayout()
        for button in (self.add, self.remove):
            row.addWidget(button)
        row.addStretch(1)
        column_of_all = QVBoxLayout(self)
        column_of_all.setContentsMargins(0, 0, 0, 0)
        column_of_all.addWidget(self.table, 1)
        column_of_all.addLayout(row)
        self.setFocusProxy(self.table)
        self.table.itemChanged.connect(self._typed)
        self.add.clicked.connect(self._add)
        self.remove.clicked.connect(self._remove)
        self._show()

    def show_questions(self, questions: list[dict[str, Any]]) -> None:
        """Edit another list from now on."""
        self.questions = questions
        self._show()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._share_width()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._share_width()  # before, the table has a width of its own

    def _share_width(self) -> None:
        """Give the column of texts the remaining width, with a readable minimum."""
        text, options = COLUMNS.index("text"), COLUMNS.index("options")
        room = self.table.viewport().width() - sum(width for column, width in _WIDTHS.items() if column != "options")
        self.table.setColumnWidth(options, min(max(room - TEXT_PX, OPTIONS_PX), _WIDTHS["options"]))
        self.table.setColumnWidth(text, max(room - self.table.columnWidth(options), TEXT_PX))

    def _show(self) -> None:
        with QSignalBlocker(self.table):
            self.table.setRowCount(len(self.questions))
            for row, question in enumerate(self.questions):
                for index, column in enumerate(COLUMNS):
                    self._cell(row, index, column, question)
        self.remove.setEnabled(bool(self.questions))

    def _cell(self, row: int, index: int, column: str, question: dict[str, Any]) -> None:
        field = _FIELDS[column]
        if isinstance(field, Choice):
            box = ChoiceBox()
            box.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # Tab comes to it by way of the table
            name_control(box, column.capitalize())
            box.addItems(list(field.options))
            box.setCurrentText(str(question.get(column, field.default)))
            box.activated.connect(lambda _: self._put_kind(row, question, box.currentText()))
            self.table.setCellWidget(row, index, box)
            return
        item = QTableWidgetItem(value_text(field, question.get(column, field.default)))
        kind = question.get("kind", _FIELDS["kind"].default)
        if kind not in _KINDS.get(column, (kind,)):
            item = QTableWidgetItem("")
            item.setFlags(item.flags() & ~Qt.ItemFlag.ItemIsEditable)
        self.table.setItem(row, index, item)

    def _put_kind(self, row: int, question: dict[str, Any], kind: str) -> None:
        self._put(question, "kind", kind)
        with QSignalBlocker(self.table):
            for column in _KINDS:
                self._cell(row, COLUMNS.index(column), column, question)

    def _typed(self, item: QTableWidgetItem) -> None:
        column = COLUMNS[item.column()]
        self._put(self.questions[item.row()], column, parsed_value(_FIELDS[column], item.text()))

    def _put(self, question: dict[str, Any], column: str, value: object) -> None:
        question[column] = value
        self.changed.emit()

    def _add(self) -> None:
        taken = {question.get("name") for question in self.questions}
        name = next(f"q{k}" for k in range(1, 1000) if f"q{k}" not in taken)
        self.questions.append({"name": name, "text": "", "kind": "text"})
        self._show()
        self.table.setCurrentCell(len(self.questions) - 1, 1)
        self.table.setFocus()
        item = self.table.item(len(self.questions) - 1, 1)
        if item is not None:
            self.table.editItem(item)
        self.changed.emit()

    def _remove(self) -> None:
        row = max(self.table.currentRow(), 0)
        if row < len(self.questions):
            del self.questions[row]
            self._show()
            self.changed.emit()


class _Table(QTableWidget):
    """Tab goes from cell to cell, and from the last one out of the table, as Shift+Tab from the first."""

    def focusNextPrevChild(self, next: bool) -> bool:
        end = (self.rowCount() - 1, self.columnCount() - 1) if next else (0, 0)
        self.setTabKeyNavigation(self.rowCount() > 0 and (self.currentRow(), self.currentColumn()) != end)
        return super().focusNextPrevChild(next)
