"""The sessions of a study: how far each is, whose it is, and which the analysis leaves out, with why."""

from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialogButtonBox,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from underfoot.experiments.store import SessionFile
from underfoot.quantities import counted
from underfoot.studies.session_lines import SessionLine, session_line
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.tables import make_read_only, offer_copy
from underfoot.widgets.experiment.studies import LONGEST_ID, is_id

_COLUMNS = ("Participant", "Begun", "Trials", "State", "Noted")
_WIDEST_PX = 34 * theme.GRID
"""A longer reason is cut off in its cell, and whole under the mouse."""
_TRIALS_TIP = "How many count, neither practice nor spoiled; of one that is not finished, of how many or about so many"
WHY_FIRST = "Type first why it is left out."


class SessionsDialog(Dialog):
    """Lists session files; a session is left out of the analysis for a reason, or taken in again, or gets another id.

    `changed` is told of each in a line.
    """

    def __init__(self, paths: Sequence[Path], changed: Callable[[str], object], parent: QWidget) -> None:
        super().__init__("Sessions", parent)
        self._changed = changed
        self.lines: list[SessionLine] = []
        self.reader, self.writer = BackgroundWorker(self), BackgroundWorker(self)
        self.table = QTableWidget(0, len(_COLUMNS))
        self.why = QLineEdit()
        self.why.setPlaceholderText("Why it is left out, such as: a loose shoe")
        self.why.setAccessibleName("Why the session is left out")
        self.leave_button = QPushButton("Leave out")
        self.id = QLineEdit()
        self.id.setMaxLength(LONGEST_ID)
        self.id.setAccessibleName("Participant's id")
        self.id_button = QPushButton("Correct the id")
        self.id_button.setToolTip("Tables have this id; the file keeps the one that it was begun with, for its orders")
        self.note = theme.paragraph(f"Reading {counted(len(paths), 'session')}…", "muted")
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Close)
        self.close_button = self.buttons.button(QDialogButtonBox.StandardButton.Close)
        self._lay_out()
        self.table.currentCellChanged.connect(self._show_current)
        self.leave_button.clicked.connect(self._leave_out)
        self.id.textChanged.connect(self._show_id)
        self.id.textEdited.connect(lambda: self.id_button.setDefault(True))  # Return is of the field that is typed in
        self.why.textEdited.connect(lambda: self.leave_button.setDefault(True))
        self.id_button.clicked.connect(self._correct_id)
        self.reader.found.connect(self._show_lines)
        self.writer.found.connect(self._show_written)
        self.writer.failed.connect(self._say)
        self._show_current()
        self.reader.compute(lambda task: [session_line(path) for path in paths if not task.is_stopped()])

    def done(self, result: int) -> None:
        """Stop reading, and wait for what is written; Esc and the frame's button both end here."""
        self.reader.stop()
        for worker in (self.reader, self.writer):
            worker.join()
        super().done(result)

    def _lay_out(self) -> None:
        self.table.setAccessibleName("Sessions")
        self.table.setHorizontalHeaderLabels(_COLUMNS)
        make_read_only(self.table)
        offer_copy(self.table)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.table.setWordWrap(False)
        self.table.verticalHeader().setDefaultSectionSize(3 * theme.GRID)
        heading = self.table.horizontalHeaderItem(_COLUMNS.index("Trials"))
        if heading is not None:
            heading.setToolTip(_TRIALS_TIP)
        header = self.table.horizontalHeader()
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        header.setSectionResizeMode(len(_COLUMNS) - 1, QHeaderView.ResizeMode.Stretch)
        words = "A session that is left out stays in its file and in tables of trials, as spoiled, with the reason."
        row = QHBoxLayout()
        for part, share in ((self.why, 3), (self.leave_button, 0), (self.id, 1), (self.id_button, 0)):
            row.addWidget(part, share)
        column = self.column(theme.GRID)
        column.addWidget(theme.paragraph(words, "muted"))
        column.addWidget(self.table, 1)
        column.addLayout(row)
        column.addWidget(self.note)
        column.addWidget(self.buttons)
        self.resize(104 * theme.GRID, 60 * theme.GRID)

    def _show_lines(self, lines: list[SessionLine]) -> None:
        self.lines = lines
        self.table.setRowCount(len(lines))
        for row, line in enumerate(lines):
            self._fill(row, line)
        self.table.resizeColumnsToContents()
        for column in range(len(_COLUMNS) - 1):
            self.table.setColumnWidth(column, min(self.table.columnWidth(column) + theme.GRID, _WIDEST_PX))
        self._say("")
        if lines:
            self.table.setCurrentCell(0, 0)
            self.table.setFocus()

    def _fill(self, row: int, line: SessionLine) -> None:
        noted = "; ".join(reversed(line.notes))  # what is cut off is what the program noted at the beginning
        for column, text in enumerate((line.participant, line.begun, line.progress, line.state, noted)):
            item = QTableWidgetItem(text)
            item.setToolTip("\n".join(line.notes) if text is noted else text)
            self.table.setItem(row, column, item)

    @property
    def _line(self) -> SessionLine | None:
        """The chosen session; None if its file cannot be read."""
        row = self.table.currentRow()
        line = self.lines[row] if 0 <= row < len(self.lines) else None
        return None if line is None or line.error else line

    def _show_current(self) -> None:
        """Offer what can be done with the chosen session."""
        line = self._line
        is_left_out = line is not None and bool(line.left_out)
        self.leave_button.setText("Take in again" if is_left_out else "Leave out")
        self.leave_button.setEnabled(line is not None)
        # A second Return behind a reason must not take the session in again.
        (self.close_button if is_left_out else self.leave_button).setDefault(True)
        self.why.setText(line.left_out if line is not None else "")
        self.why.setEnabled(line is not None and not is_left_out)
        self.id.setText(line.id if line is not None else "")
        self.id.setEnabled(line is not None)
        self._show_id()

    def _show_id(self) -> None:
        """Offer to correct the chosen session's id where another one is typed."""
        line, typed = self._line, self.id.text()
        self.id_button.setEnabled(line is not None and is_id(typed) and typed != line.id)

    def _correct_id(self) -> None:
        """Let the chosen session have the id that was typed."""
        path, typed = self.lines[self.table.currentRow()].path, self.id.text()
        self.writer.compute(lambda _: [_written(path, lambda file: file.correct_id(typed))])

    def _leave_out(self) -> None:
        """Leave the chosen session out, or take it in again."""
        row = self.table.currentRow()
        line, why = self.lines[row], " ".join(self.why.text().split())
        if not line.left_out and not why:
            self._say(WHY_FIRST)
            self.why.setFocus()
            return
        new = "" if line.left_out else why
        self.writer.compute(lambda _: [_written(line.path, lambda file: file.leave_out(new))])

    def _show_written(self, lines: list[SessionLine]) -> None:
        (line,) = lines
        row = [known.path for known in self.lines].index(line.path)
        self.lines[row] = line
        self._fill(row, line)
        self.table.setFocus()
        self._show_current()
        self._say("")
        self._changed(f"{line.participant}: {line.notes[-1]}. What is shown was found before: analyse once more.")

    def _say(self, text: str) -> None:
        theme.set_role(self.note, "alarm" if text else "muted")
        self.note.setText(text)


def _written(path: Path, change: Callable[[SessionFile], None]) -> SessionLine:
    """Change a session's file; return what the list says of it now."""
    with closing(SessionFile.open(path)) as file:
        change(file)
    return session_line(path)
