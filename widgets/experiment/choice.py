"""The page on which a study is chosen: list of studies, overview, participant's id, and results so far."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QListWidget,
    QPlainTextEdit,
    QPushButton,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from underfoot.drawing import Drawing
from underfoot.experiments.duration import about, usual_s, usual_trials
from underfoot.experiments.method import ListedMethod
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import all_stages
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.experiment.people_dialog import SimulatedPeople, people_text
from underfoot.widgets.experiment.results_menu import ResultsButton
from underfoot.widgets.experiment.studies import StudyFile, is_id
from underfoot.widgets.plots.drawing_column import DrawingColumn

LIST_PX = 40 * theme.GRID
LOW_PX = 84 * theme.GRID
"""Height below which drawings and tables are side by side."""
FOUND_SIZES = (400, 200)


class StudyList(QWidget):
    """The list of studies by title; one is selected."""

    chosen = Signal(int)
    open_requested = Signal()
    new_requested = Signal()
    copy_requested = Signal()
    edit_requested = Signal()
    delete_requested = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedWidth(LIST_PX)
        self.list = QListWidget()
        self.list.setAccessibleName("Studies")
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)  # titles wrap
        self.new, self.copy_button, self.edit, self.delete, self.open = (
            QPushButton("&New study…"),
            QPushButton("&Make a copy…"),
            QPushButton("&Edit…"),
            QPushButton("Delete…"),
            QPushButton("Open a protocol…"),
        )
        self.copy_button.setToolTip("A copy of the chosen study, to be changed")
        below = QGridLayout()
        below.setSpacing(theme.GRID // 2)
        for index, button in enumerate((self.new, self.copy_button, self.edit, self.delete)):
            below.addWidget(button, index // 2, index % 2)
        below.addWidget(self.open, 2, 0, 1, 2)
        column = QVBoxLayout(self)
        column.addWidget(theme.label("STUDIES", "heading"))
        column.addWidget(self.list, 1)
        column.addLayout(below)
        self.list.currentRowChanged.connect(self.chosen)
        self.new.clicked.connect(self.new_requested)
        self.copy_button.clicked.connect(self.copy_requested)
        self.edit.clicked.connect(self.edit_requested)
        self.delete.clicked.connect(self.delete_requested)
        self.open.clicked.connect(self.open_requested)
        self.setFocusProxy(self.list)

    def show_studies(self, studies: Sequence[StudyFile], chosen: int) -> None:
        """Show these studies in order, and select one by index."""
        self.list.clear()
        self.list.addItems([_title_of(study) for study in studies])
        self.list.setCurrentRow(chosen)

    def set_editable(self, is_own: bool) -> None:
        """Set whether the selected study is the user's own, which can be edited and deleted."""
        self.edit.setEnabled(is_own)
        self.delete.setEnabled(is_own)


class StudyOverview(QWidget):
    """The overview of a study, a field for the participant's id, and buttons for actions."""

    begin_requested = Signal(str)
    pilot_requested = Signal()
    simulate_requested = Signal()
    people_requested = Signal()
    equipment_requested = Signal()
    analyse_requested = Signal()
    participant_typed = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.title, self.about, self.facts = theme.label("", "title"), theme.label("", "muted"), theme.label()
        for label in (self.about, self.facts):
            label.setWordWrap(True)
        self.participant = QLineEdit()
        self.participant.setPlaceholderText("Participant's id, such as P01")
        self.participant.setAccessibleName("Participant's id")
        self.participant.setMinimumWidth(26 * theme.GRID)
        self.participant.setMaximumWidth(30 * theme.GRID)
        self.begin, self.simulate, self.analyse = (
            QPushButton("Begin"),
            QPushButton(),
            QPushButton("Analyse"),
        )
        self.pilot = QPushButton("Pilot")
        self.pilot.setToolTip("Try it yourself: two trials of each stage, kept apart from the participants' sessions")
        self.people = QPushButton("People…")
        self.people.setToolTip("How many people are simulated, and what is true of them")
        self.results = ResultsButton()
        self._simulate_words, self._can_analyse = "", False
        self.show_people(people_text(SimulatedPeople()))
        self.begin.setProperty("role", "primary")
        self.equipment = QPushButton()
        self.equipment.setToolTip("Plate, masking sound, trigger and LSL streams of sessions in this window")
        self.show_equipment("")
        self.state = theme.label("", "muted")
        self.drawings = DrawingColumn()
        self.table = QPlainTextEdit()
        self.table.setReadOnly(True)
        self.table.setAccessibleName("Findings")
        self.table.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        fixed = theme.font(theme.TEXT_PX)
        self.table.setFont(fixed)
        self.table.setStyleSheet("font-family: monospace;")
        self._lay_out()
        self.begin.clicked.connect(self._begin)
        self.pilot.clicked.connect(self.pilot_requested)
        self.participant.returnPressed.connect(self._begin)
        self.participant.textChanged.connect(self.participant_typed)
        self.equipment.clicked.connect(self.equipment_requested)
        self.simulate.clicked.connect(self.simulate_requested)
        self.people.clicked.connect(self.people_requested)
        self.analyse.clicked.connect(self.analyse_requested)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Place tables beside the drawings if the window is low."""
        super().resizeEvent(event)
        below = Qt.Orientation.Vertical if self.height() > LOW_PX else Qt.Orientation.Horizontal
        if self._found.orientation() != below:
            self._found.setOrientation(below)
            self._found.setSizes(FOUND_SIZES)

    def show_study(self, study: StudyFile, sessions: int, folder: Path) -> None:
        """Show a study, its number of started sessions, and their folder."""
        self.title.setText(study.protocol.title or study.name)
        self.about.setText(study.protocol.about)
        self.facts.setText(facts_of(study.protocol))
        self.analyse.setText(f"Analyse {counted(sessions, 'session')}")
        self.analyse.setToolTip(f"The sessions of this study lie in {folder}")
        self._can_analyse = sessions > 0
        self.analyse.setEnabled(self._can_analyse)
        self.results.enable_writing(self._can_analyse)

    def show_availability(self, has_session: bool, may_begin: bool, goes_on: bool, why_not: str) -> None:
        """Enable the buttons to begin or continue a session, or show the reason why not."""
        self.pilot.setEnabled(has_session)
        self.begin.setEnabled(may_begin)
        self.begin.setText("Go on" if goes_on else "Begin")
        self.state.setText(why_not)

    def choose_another_id(self) -> None:
        """Let what is typed next be another participant's id."""
        self.participant.setFocus()
        self.participant.selectAll()

    def show_equipment(self, text: str) -> None:
        """Show the equipment in use; "" for none."""
        self.equipment.setText(f"Equipment: {text}…" if text else "Equipment…")

    def show_people(self, text: str) -> None:
        """Set the text of the button that simulates."""
        self._simulate_words = text
        self.simulate.setText(text)

    def show_findings(self, drawings: Sequence[Drawing], text: str) -> None:
        """Show results as drawings and text."""
        self.drawings.show_drawings(drawings, "" if text else "Nothing was simulated or analysed yet.")
        self.drawings.setVisible(bool(drawings) or not text)
        self.table.setPlainText(text)
        self.table.setVisible(bool(text))

    def show_busy(self, text: str) -> None:
        """Show the name of the running computation, with a button to stop it; "" for none."""
        self.simulate.setText("Stop" if text else self._simulate_words)
        if text and self.analyse.hasFocus():
            self.simulate.setFocus()  # a disabled button would lose the focus to another page
        self.analyse.setEnabled(self._can_analyse and not text)
        for button in (self.people, self.results):
            button.setEnabled(not text)
        self.state.setText(text)

    def _begin(self) -> None:
        if self.begin.isEnabled() and is_id(self.participant.text()):
            self.begin_requested.emit(self.participant.text())

    def _lay_out(self) -> None:
        who, found_by = QHBoxLayout(), QHBoxLayout()
        for row, parts in (
            (who, (self.participant, self.begin, self.pilot, self.equipment)),
            (found_by, (self.simulate, self.people, self.analyse, self.results)),
        ):
            for part in parts:
                row.addWidget(part)
            row.addStretch(1)
        found = self._found = QSplitter(Qt.Orientation.Vertical)
        found.setObjectName("experiment findings")
        found.addWidget(self.drawings)
        found.addWidget(self.table)
        found.setSizes(FOUND_SIZES)
        column = QVBoxLayout(self)
        column.setContentsMargins(*[2 * theme.GRID] * 4)
        column.setSpacing(theme.GRID)
        for text in (self.title, self.about, self.facts):
            column.addWidget(text)
        column.addLayout(who)
        column.addLayout(found_by)
        column.addWidget(self.state)
        column.addWidget(found, 1)


def _title_of(study: StudyFile) -> str:
    title = study.protocol.title or study.name
    return f"{title}  (own)" if study.is_own else title


def facts_of(protocol: Protocol) -> str:
    """Return a description of a protocol's stages, one per line."""
    lines = []
    for stage in protocol.order():
        if stage.method is None:
            words = {"consent": "consent", "read": "instruction", "learn": "learning", "level": "level"}
            lines.append(words.get(stage.kind, stage.kind) + (f", {stage.seconds:.0f} s" if stage.seconds else ""))
            continue
        method = METHODS[stage.method.kind]
        is_known = issubclass(method, ListedMethod) or "trials" in method.parameters or stage.most_trials
        count = f"{'' if is_known else 'some '}{counted(usual_trials(protocol, stage)[0], 'trial')}"
        practice = ", practice" if stage.practice else ""
        begun = f", begun by {stage.start}" if method.uses_stimuli else ""
        lines.append(f"{method.name[0].lower()}{method.name[1:]}: {count}{practice}{begun}")
    return "  ·  ".join([*lines, about(sum(usual_s(protocol, stage) for stage in all_stages(protocol)))])
