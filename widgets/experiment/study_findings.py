"""Findings of a study: simulated people, analysed sessions, and trials written for other programs."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QPlainTextEdit, QPushButton, QSplitter, QWidget

from underfoot.drawing import Drawing
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.report import text_of
from underfoot.experiments.analysis.settings import Settings
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.experiment.findings import analysed_in_process, simulated_study, written_in_process
from underfoot.widgets.experiment.people_dialog import PeopleDialog, SimulatedPeople, people_text
from underfoot.widgets.experiment.results_menu import ResultsButton
from underfoot.widgets.experiment.sessions_dialog import SessionsDialog
from underfoot.widgets.experiment.studies import SessionFolder, StudyFile
from underfoot.widgets.plots.drawing_column import DrawingColumn
from underfoot.widgets.session.settings import Settings as WindowSettings

_SIZES = (400, 200)


class StudyFindings(QObject):
    """Simulates or analyses a study with `buttons`, and shows drawings and a table in `results`."""

    stated = Signal(str)
    """What is being computed, or why it failed; "" when it is done."""
    loaded = Signal()
    """Modules that stay in memory were just loaded."""

    def __init__(self, study: StudyFile, sessions: SessionFolder, parent: QObject) -> None:
        super().__init__(parent)
        self._study, self._sessions = study, sessions
        self._people: dict[Path, SimulatedPeople] = {}
        self.background = BackgroundWorker(self)
        self.simulate_button, self.analyse_button = QPushButton(), QPushButton()
        self.people_button = QPushButton("People…")
        self.people_button.setToolTip("How many people are simulated, and what is true of them")
        self.results_button = ResultsButton()
        self.buttons = QWidget()
        row = QHBoxLayout(self.buttons)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.GRID)
        for button in (self.simulate_button, self.people_button, self.analyse_button, self.results_button):
            row.addWidget(button)
        row.addStretch(1)
        self.drawings, self.table = DrawingColumn(), QPlainTextEdit()
        self.table.setReadOnly(True)
        self.table.setAccessibleName("Findings")
        self.table.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.table.setFont(theme.font(theme.TEXT_PX))
        self.table.setStyleSheet("font-family: monospace;")
        self.results = QSplitter(Qt.Orientation.Vertical)
        self.results.setObjectName("experiment findings")
        self.results.addWidget(self.drawings)
        self.results.addWidget(self.table)
        self.results.setSizes(_SIZES)
        self._show((), "")
        self._connect()

    def attach(self, settings: WindowSettings) -> None:
        """Analyse as the window's settings say, and keep there what is chosen."""
        lapses = self.results_button.lapses
        lapses.setChecked(settings.study_lapses)
        lapses.toggled.connect(lambda on: setattr(settings, "study_lapses", on))

    def show_study(self, study: StudyFile) -> None:
        """Show no findings but those of this study from now on."""
        self.stop()
        if study is not self._study:
            self._study = study
            self._show((), "")
        self._show_people()
        self._show_sessions()

    def arrange(self, orientation: Qt.Orientation) -> None:
        """Place the table below the drawings, or beside them."""
        if self.results.orientation() != orientation:
            self.results.setOrientation(orientation)
            self.results.setSizes(_SIZES)

    def stop(self) -> None:
        """Stop the running computation."""
        self.background.stop()

    @property
    def people(self) -> SimulatedPeople:
        """The simulated participants of the study."""
        return self._people.get(self._study.path, SimulatedPeople())

    def forget_people(self, path: Path) -> None:
        """Simulate the usual people again in the study of this file, whose methods may have changed."""
        self._people.pop(path, None)

    def ask_people(self) -> None:
        """Ask for the number of simulated participants and their true parameters."""
        PeopleDialog(self._use_people, self._study.protocol, self.people, self.buttons.window()).open()

    def ask_sessions(self) -> None:
        """List the study's sessions, of which some can be left out of the analysis."""
        SessionsDialog(self._sessions.files(self._study), self.stated.emit, self.buttons.window()).open()

    def simulate(self) -> None:
        """Run the study with simulated people, and show bias and spread of its estimates."""
        study, people = self._study, self.people
        who = counted(people.count, "person", "people")
        self._compute(f"Simulating {who}…", lambda task: simulated_study(study, people, task))

    def analyse(self) -> None:
        """Show the findings of the sessions so far."""
        self._analyse_files(self._sessions.files(self._study), are_its=True)

    def _analyse_files(self, paths: Sequence[Path], *, are_its: bool = False) -> None:
        count = counted(len(paths), "session" if are_its else "file")
        work = partial(analysed_in_process, paths, self._study.protocol, self._settings, are_its=are_its)
        self._compute(f"Analysing {count}…", work)

    def _write(self, form: str, where: Path) -> None:
        """Write the trials of the study's sessions."""
        protocol, paths, settings = self._study.protocol, self._sessions.files(self._study), self._settings
        self._compute(f"Writing {form}…", lambda task: written_in_process(paths, protocol, form, where, settings, task))

    @property
    def _settings(self) -> Settings:
        return Settings(with_lapses=self.results_button.lapses.isChecked())

    def _compute(self, text: str, make: Callable[[Task], list[Any]]) -> None:
        """Start a computation, or stop the running one."""
        if self.background.is_busy:
            self.stop()
            return
        self.simulate_button.setText("Stop")
        if self.analyse_button.hasFocus():
            self.simulate_button.setFocus()  # a disabled button would lose the focus to another page
        for button in (self.analyse_button, self.people_button, self.results_button):
            button.setEnabled(False)
        self.stated.emit(text)
        self.background.compute(make)

    def _use_people(self, people: SimulatedPeople) -> None:
        self._people[self._study.path] = people
        self._show_people()

    def _show_people(self) -> None:
        self.simulate_button.setText(people_text(self.people))

    def _show_sessions(self) -> None:
        """Show how many sessions were begun; they can be analysed while nothing else is computed."""
        sessions = self._sessions.files(self._study)
        self.analyse_button.setText(f"Analyse {counted(len(sessions), 'session')}")
        self.analyse_button.setToolTip(f"The sessions of this study lie in {self._sessions.of(self._study)}")
        self.analyse_button.setEnabled(bool(sessions))
        self.results_button.enable_writing(bool(sessions))

    def _end(self, why: str = "") -> None:
        self._show_people()
        self._show_sessions()
        for button in (self.people_button, self.results_button):
            button.setEnabled(True)
        self.stated.emit(why)

    def _show_findings(self, findings: Sequence[Findings]) -> None:
        self._end()
        self._show([drawing for found in findings for drawing in found.drawings], text_of(findings))
        self.loaded.emit()

    def _show(self, drawings: Sequence[Drawing], text: str) -> None:
        self.drawings.show_drawings(drawings, "" if text else "What is simulated or analysed is shown here.")
        self.drawings.setVisible(bool(drawings) or not text)
        self.table.setPlainText(text)
        self.table.setVisible(bool(text))

    def _connect(self) -> None:
        self.simulate_button.clicked.connect(self.simulate)
        self.people_button.clicked.connect(self.ask_people)
        self.analyse_button.clicked.connect(self.analyse)
        self.results_button.sessions_requested.connect(self.ask_sessions)
        self.results_button.files_chosen.connect(self._analyse_files)
        self.results_button.place_chosen.connect(self._write)
        self.background.found.connect(self._show_findings)
        self.background.failed.connect(self._end)
        self.background.notified.connect(self.stated)
