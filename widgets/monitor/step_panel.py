"""The panel of footsteps: table, number, cadence, and export."""

import math
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from itertools import count
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from underfoot.errors import UnderfootError
from underfoot.files import make_folder, remove_file, written
from underfoot.floor.footsteps import Step
from underfoot.floor.gait_summary import cadence_of
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.file_dialog import ask_save
from underfoot.widgets.controls.gait_tip import GaitTip
from underfoot.widgets.controls.panels import tool_button, with_header
from underfoot.widgets.controls.step_table import StepTable, WholeRows

CADENCE_STEPS = 8
"""Number of steps in the cadence."""

MAX_FILES = 100
"""Most files of unsaved footsteps that are kept."""

GAIT_STEPS = 100
"""Number of latest steps in each person's gait, shown under the mouse."""


class StepPanel(QWidget):
    """Shows footsteps live."""

    notified = Signal(str)
    """A line for the person."""
    cleared = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.table = StepTable()
        self.count = theme.label("", "muted")
        self.cadence = theme.label("", "muted")
        GaitTip((self.count, self.cadence), lambda: self.table.steps.steps[-GAIT_STEPS:])
        self._folder = Path.home()
        self.folder: Path | None = None
        """Where footsteps that nobody saved are kept when another session begins."""
        self._is_saved = True
        self.export_button = tool_button("export", "Export…", "Save the footsteps as a CSV table")
        self.export_button.clicked.connect(self._ask_for_file)
        self.clear_button = tool_button("broom", "Clear", "Remove all footsteps from the table")
        self.clear_button.clicked.connect(self.clear)
        title = theme.label("Footsteps", "title")
        head = [title, self.count, self.cadence, None, self.clear_button, self.export_button]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(with_header(head, WholeRows(self.table), parent=self))
        self._show_count()

    def add(self, steps: Sequence[Step]) -> None:
        """Append footsteps."""
        self.table.steps.add(steps)
        self._is_saved = self._is_saved and not steps
        self._show_count()

    def start_new_table(self) -> None:
        """Begin an empty table; unsaved footsteps are stored in a file, and a line says so."""
        count, path = len(self.table.steps.steps), self.keep()
        if path is not None:
            self.notified.emit(f"{counted(count, 'footstep')} of the session before kept as {path}.")
        if self._is_saved or self.folder is None:
            self.clear()

    def keep(self) -> Path | None:
        """Store unsaved footsteps in a file, and return it; None if there are none, or a line says why they are not."""
        if self._is_saved or self.folder is None:
            return None
        path = None
        try:
            make_folder(self.folder)
            for old in sorted(self.folder.glob("*.csv"))[: 1 - MAX_FILES]:
                old.unlink(missing_ok=True)
            path = _new_file(self.folder)
            self.table.export(path)
        except (UnderfootError, OSError) as error:
            if path is not None:
                remove_file(path)
            self.notified.emit(str(error))
            return None
        self._is_saved = True
        return path

    def clear(self) -> None:
        """Remove all footsteps."""
        self._is_saved = True
        self.table.steps.clear()
        self._show_count()
        self.cleared.emit()

    def export(self, path: Path) -> None:
        """Write the footsteps as CSV, and show that, or the reason of a failure."""
        try:
            self.table.export(path)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._folder = path.parent
        self._is_saved = True
        self.notified.emit(f"{counted(self.table.steps.rowCount(), 'footstep')} saved as {path}.")

    def _ask_for_file(self) -> None:
        name = str(self._folder / "steps.csv")
        ask_save(self, "Export footsteps", name, "CSV table (*.csv)", ".csv", self.export)

    def _show_count(self) -> None:
        steps = self.table.steps.steps
        self.count.setText(counted(len(steps), "step") if steps else "none yet")
        cadence_per_min = cadence_of(steps[-CADENCE_STEPS:])
        self.cadence.setText(f"{cadence_per_min:.0f} a minute" if math.isfinite(cadence_per_min) else "")
        self.export_button.setEnabled(bool(steps))
        self.clear_button.setEnabled(bool(steps))


def _new_file(folder: Path) -> Path:
    """Return an empty file named by the time, and a number where another window has just made one of that name."""
    name = f"{datetime.now():%Y-%m-%d %H.%M.%S}"
    for number in count(1):
        path = folder / f"{name}{'' if number == 1 else f' {number}'}.csv"
        with written(path), suppress(FileExistsError):
            path.touch(exist_ok=False)
            break
    return path
