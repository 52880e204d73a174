"""Recordings compared: their measures side by side, and their mean force over stance."""

from collections.abc import Callable, Sequence
from pathlib import Path

from PySide6.QtCore import QEvent, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QComboBox, QVBoxLayout, QWidget

from underfoot.errors import UnderfootError
from underfoot.quantities import counted
from underfoot.records.comparison import STANCE_SUFFIX, compared, comparison_drawing, names_of, write_comparison
from underfoot.records.survey import Stance
from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.file_dialog import ask_save
from underfoot.widgets.controls.panels import splitter, tool_button, with_header
from underfoot.widgets.escape import claims_escape
from underfoot.widgets.plots.plot import Plot
from underfoot.widgets.recordings.comparison_table import ComparisonTable
from underfoot.widgets.recordings.survey_reader import SurveyReader

MOST = 12
"""Most recordings that are compared: a table of more is read by nobody."""
_BY = (
    ("recording", "By recording", "no steps"),
    ("side", "By side", "no steps whose side is known"),
    ("person", "By person", "no steps whose person is known"),
)
"""What groups differ in, in words, and what is said where there is no group."""


class ComparisonView(QWidget):
    """Compares the recordings that it is given; `closed` asks for what was shown before."""

    closed = Signal()
    notified = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        theme.fill(self, "ground")
        self.paths: list[Path] = []
        self._stances: dict[Path, Sequence[Stance]] = {}
        self._doing = ""  # what the reader does
        self.reader = SurveyReader(self)
        self.table, self.plot = ComparisonTable(), Plot("Mean force over stance")
        self.facts, self.by = ElidedLabel("muted"), QComboBox()
        self.by.setAccessibleName("What is compared")
        self.by.setToolTip(
            "Compare the recordings, or left and right, or the persons of each: a number is of its recording,\n"
            "and person 1 of another can be somebody else"
        )
        self.by.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        for by, text, _ in _BY:
            self.by.addItem(text, by)
        self.copy_button = tool_button("", "Copy", "Copy the table as CSV")
        self.save_button = tool_button("export", "Save…", "Save the table as CSV, and the curves beside it")
        self.close_button = tool_button("", "Back", "Back to the recording (Escape)")
        self._lay_out()
        self.by.currentIndexChanged.connect(lambda _: self._show())
        self.copy_button.clicked.connect(self._copy)
        self.save_button.clicked.connect(lambda _=False: self.save())
        self.close_button.clicked.connect(lambda _=False: self.closed.emit())
        self.reader.read.connect(self._take)
        self.reader.failed.connect(self._leave_out)
        self.reader.progressed.connect(self._tell)

    def compare(self, paths: Sequence[Path], is_written: Callable[[Path], bool]) -> None:
        """Compare these recordings, the first with the others; a single one by side.

        One that is being recorded has no end yet, and is left out.
        """
        if self.by.currentData() == "recording" and len(paths) == 1:
            with QSignalBlocker(self.by):
                self.by.setCurrentIndex(self.by.findData("side"))
        self.paths = [path for path in paths if not is_written(path)]
        for path in set(paths) - set(self.paths):
            self.notified.emit(f"{path.name} is being recorded; it can be compared when that has ended.")
        self._stances = {path: self._stances[path] for path in self.paths if path in self._stances}
        self._read()

    def show_renamed(self, old: Path, new: Path) -> None:
        """Show a recording under its new name."""
        if old in self.paths:
            self.paths[self.paths.index(old)] = new
            if old in self._stances:
                self._stances[new] = self._stances.pop(old)
            self._read()

    def save(self) -> None:
        """Ask for a file, and write table and curves."""
        name = str(self.paths[0].with_name("comparison.csv")) if self.paths else ""
        ask_save(self.window(), "Save the comparison", name, "CSV (*.csv)", ".csv", self._write)

    def clear(self) -> None:
        """Compare nothing, and read no more."""
        self.reader.stop()
        self.paths, self._stances = [], {}

    def close_down(self) -> None:
        """End the process and the thread."""
        self.reader.close()

    def event(self, event: QEvent) -> bool:
        return claims_escape(event) or super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self.closed.emit()
        else:
            super().keyPressEvent(event)

    def _read(self) -> None:
        """Show what is known, and read the rest."""
        self._show()
        self.reader.begin([path for path in self.paths if path not in self._stances])

    def _take(self, path: Path, stances: Sequence[Stance]) -> None:
        self._stances[path] = stances
        self._show()

    def _leave_out(self, path: Path, why: str) -> None:
        self.notified.emit(why)
        self.paths = [one for one in self.paths if one != path]
        self._show()

    def _tell(self, text: str) -> None:
        self._doing = text
        self._show_facts()

    def _show(self) -> None:
        read = [path for path in self.paths if path in self._stances]
        named = dict(zip(names_of(read), (self._stances[path] for path in read), strict=True))
        groups = compared(named, self.by.currentData()) if named else []
        self.table.show_groups(groups)
        waits = len(read) < len(self.paths)
        note = "looking for steps…" if waits else _BY[self.by.currentIndex()][2]
        self.plot.show_drawing(comparison_drawing(groups, note))
        for button in (self.copy_button, self.save_button):
            button.setEnabled(bool(groups) and not waits)
        self._show_facts()

    def _show_facts(self) -> None:
        self.facts.set_full_text(self._doing or "  ·  ".join(names_of(self.paths)))

    def _copy(self) -> None:
        self.table.copy()
        self.notified.emit(f"A comparison of {counted(len(self.table.groups), 'group')} copied as CSV.")

    def _write(self, path: Path) -> None:
        try:
            write_comparison(self.table.groups, path)
        except UnderfootError as error:
            self.notified.emit(str(error))
        else:
            self.notified.emit(f"{path.name} and {path.with_suffix(STANCE_SUFFIX).name} are saved.")

    def _lay_out(self) -> None:
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        head = [
            theme.label("Comparison", "title"),
            self.facts,
            None,
            self.by,
            self.copy_button,
            self.save_button,
            self.close_button,
        ]
        down = splitter("comparison down", Qt.Orientation.Vertical)
        layout.addWidget(with_header(head, down, ((self.facts,), (self.save_button,))))
        down.addWidget(self.plot)
        holder = QWidget(down)
        inside = QVBoxLayout(holder)
        inside.setContentsMargins(theme.GRID, 0, 0, 0)  # the headings are below those of the panels
        theme.fill(holder, "panel")
        inside.addWidget(self.table)
        self.plot.setMinimumHeight(20 * theme.GRID)
        holder.setMinimumHeight(12 * theme.GRID)
        down.setSizes([320, 400])
