"""The menu of results: the list of sessions, analysis of other files, and export of trials."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFileDialog, QMenu, QPushButton

from underfoot.studies.results import FORMS
from underfoot.widgets.controls.file_dialog import ask_save, file_dialog

_WORDS = {
    "CSV": "Write all trials as CSV…",
    "estimates": "Write each person's estimates as CSV…",
    "BIDS": "Write BIDS…",
    "report": "Write a report…",
}
_TABLES = {"CSV": ("A table of all trials", "trials.csv"), "estimates": ("A table of people", "estimates.csv")}
_FILES = "Sessions and tables of trials (*.session *.csv)"


class ResultsButton(QPushButton):
    """A button with a menu. `files_chosen` carries files to analyse, `place_chosen` a format and a path to write."""

    files_chosen = Signal(list)
    place_chosen = Signal(str, Path)
    sessions_requested = Signal()
    """The study's sessions are to be listed."""

    def __init__(self) -> None:
        super().__init__("Results")
        self.setToolTip("List sessions and leave some out; analyse other files; write trials for other programs")
        menu = QMenu(self)
        self._sessions = menu.addAction("Sessions…")
        self._sessions.triggered.connect(self.sessions_requested)
        menu.addAction("Analyse files…", self._ask_files)
        self.lapses = menu.addAction("Lapses: give psychometric curves a lapse rate")
        self.lapses.setCheckable(True)
        menu.addSeparator()
        self._writing = [self._writing_action(menu, form) for form in FORMS]
        self.setMenu(menu)

    def enable_writing(self, has_sessions: bool) -> None:
        """Enable the list and export if there are sessions."""
        for action in (self._sessions, *self._writing):
            action.setEnabled(has_sessions)

    def _writing_action(self, menu: QMenu, form: str) -> QAction:
        action = menu.addAction(_WORDS[form])
        action.triggered.connect(lambda: self._ask_place(form))
        return action

    def _ask_files(self) -> None:
        dialog = file_dialog(self.window(), "Sessions, or tables of trials", "", _FILES)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFiles)
        dialog.filesSelected.connect(lambda paths: self.files_chosen.emit([Path(path) for path in paths]))
        dialog.open()

    def _ask_place(self, form: str) -> None:
        if form in _TABLES:
            then = partial(self.place_chosen.emit, form)
            ask_save(self.window(), *_TABLES[form], "Tables (*.csv)", ".csv", then)
            return
        dialog = file_dialog(self.window(), f"A folder for the {form}")
        dialog.setFileMode(QFileDialog.FileMode.Directory)
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.fileSelected.connect(lambda path: self.place_chosen.emit(form, Path(path)))
        dialog.open()
