"""The row that begins a session of a study: the participant's id, a pilot, and the equipment."""

from collections.abc import Callable

import msgspec
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QPushButton, QWidget

from underfoot.errors import UnderfootError
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets import theme
from underfoot.widgets.controls.question import ask
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog, choice_of_settings
from underfoot.widgets.experiment.studies import LONGEST_ID, SessionFolder, StudyFile, is_id
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.settings import Settings

GO_ON, ANOTHER_ID = "Go on with that one", "Begin anew under another id"
_HOW = "Pilot: try two trials of each stage yourself. Begin: type a participant's id first."


class SessionStart(QWidget):
    """Asks for a participant's id and for the equipment, and says why no session can begin."""

    begin_requested = Signal(object, str)
    """The `StudyFile`, and the id of a participant whose session is to begin or to continue."""
    stop_requested = Signal()
    """The session that is about to begin is not to."""
    stated = Signal(str)
    """Why no session can begin, or what came of the last one; "" for neither."""

    def __init__(self, study: StudyFile, sessions: SessionFolder, read_again: Callable[[], object]) -> None:
        """Begin with this study; `read_again` leads to `show_study` where its file was changed since."""
        super().__init__()
        self._read_again = read_again
        self._study, self._sessions = study, sessions
        self._is_opening = False
        self._controller: SessionController | None = None
        self._settings: Settings | None = None
        self.equipment = EquipmentChoice()
        self.participant = QLineEdit()
        self.participant.setPlaceholderText("Participant's id, such as P01")
        self.participant.setAccessibleName("Participant's id")
        self.participant.setMinimumWidth(26 * theme.GRID)
        self.participant.setMaximumWidth(30 * theme.GRID)
        self.begin_button, self.pilot_button = QPushButton("Begin"), QPushButton("Pilot")
        self.equipment_button = QPushButton()
        self.begin_button.setProperty("role", "primary")
        self.begin_button.setToolTip("Begin, or go on with, the session of the participant with this id")
        self.pilot_button.setToolTip(
            "Try it yourself: two trials of each stage, kept apart from the participants' sessions"
        )
        self.equipment_button.setToolTip("Plate, masking sound, trigger and LSL streams of sessions in this window")
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.GRID)
        for part in (self.participant, self.begin_button, self.pilot_button, self.equipment_button):
            row.addWidget(part)
        row.addStretch(1)
        self._use_equipment(self.equipment)
        self.begin_button.clicked.connect(self._begin_or_stop)
        self.participant.returnPressed.connect(self.begin)
        self.participant.textChanged.connect(self.show_availability)
        self.pilot_button.clicked.connect(self.begin_pilot)
        self.equipment_button.clicked.connect(self.ask_equipment)

    def attach(self, controller: SessionController, settings: Settings) -> None:
        """Begin sessions on the window's session, with the equipment of its settings."""
        self._controller, self._settings = controller, settings
        self._use_equipment(choice_of_settings(settings.study_equipment))
        controller.opened.connect(self.show_availability)
        self.show_availability()

    def show_study(self, study: StudyFile) -> None:
        """Begin sessions of this study from now on."""
        self._study = study
        self.show_availability()

    def show_availability(self) -> None:
        """Enable the buttons for the id that was typed, and say why a session cannot begin."""
        if self._is_opening:
            return
        person = self.participant.text()
        has_session = self._controller is not None and self._controller.session is not None
        alike = self._sessions.alike(self._study, person) if is_id(person) else ""
        goes_on = is_id(person) and not alike and self._sessions.path(self._study, person).exists()
        why_not = "The session is not open yet." if not has_session else "" if person else _HOW
        if person and not is_id(person):
            why_not = f"An id has up to {LONGEST_ID} letters, digits, - and _; names are not asked for."
        if alike:
            why_not = (
                f"{alike} has a session already, and ids must differ in more than letter case; type {alike} to go on."
            )
        if goes_on and not why_not and (found := self._sessions.begun(self._study, person)):
            begun, is_over = found
            now = "has come to the end" if is_over else "goes on there"
            why_not = f"{person} was begun on {begun:%d %b %Y, %H:%M}, and {now}. Somebody else needs another id."
        self.pilot_button.setEnabled(has_session)
        self.begin_button.setEnabled(has_session and is_id(person) and not alike)
        self.begin_button.setText("Go on" if goes_on else "Begin")
        self.stated.emit(why_not)

    def show_opening(self) -> None:
        """Offer only to stop, while equipment is opened."""
        self._is_opening = True
        self.begin_button.setEnabled(True)
        self.begin_button.setText("Stop")
        self.participant.setReadOnly(True)
        if self.pilot_button.hasFocus():
            self.begin_button.setFocus()  # a disabled button would lose the focus to another page
        for button in (self.pilot_button, self.equipment_button):
            button.setEnabled(False)
        self.stated.emit(f"Opening {self.equipment.text}…" if self.equipment.text else "")

    def show_opened(self) -> None:
        """Offer to begin a session again."""
        self._is_opening = False
        self.participant.setReadOnly(False)
        self.equipment_button.setEnabled(True)
        self.show_availability()

    def show_end(self, participant: str, *, is_pilot: bool) -> None:
        """Say that this participant has finished the study, and wait for the next one's id."""
        self.participant.clear()
        if is_pilot:
            self.stated.emit(f"Pilot {participant} is done. Its answers are kept apart from the participants'.")
        else:
            self.stated.emit(f"{participant} has come to the end of the study. The answers are kept.")

    def begin(self) -> None:
        """Begin or continue the session of the participant whose id was typed.

        If the study was changed since that session began, ask first.
        """
        participant = self.participant.text()
        if self._is_opening or not self.begin_button.isEnabled():
            return
        try:
            self._read_again()
            study = self._study
            is_other = self._sessions.was_begun_otherwise(study, participant)
        except UnderfootError as error:
            self.stated.emit(str(error))
            return
        if not is_other:
            self.begin_requested.emit(study, participant)
            return
        text = f"{participant} was begun with an earlier form of this study. Go on with that one?"
        self.participant.setFocus()
        self.participant.selectAll()  # so that another id can be typed
        ask(
            self.window(),
            "An earlier form",
            text,
            GO_ON,
            lambda: self.begin_requested.emit(study, participant),
            ANOTHER_ID,
        )

    def begin_pilot(self) -> None:
        """Begin a pilot: two trials of each stage of the study."""
        try:
            self._read_again()
        except UnderfootError as error:
            self.stated.emit(str(error))
            return
        pilot = self._study.pilot()
        self.begin_requested.emit(pilot, self._sessions.unused_id(pilot))

    def ask_equipment(self) -> None:
        """Ask for the equipment beside the floor."""
        calibrated = "" if self._settings is None else self._settings.calibrated_plate
        EquipmentDialog(self._use_equipment, self.equipment, self.window(), calibrated).open()

    def _begin_or_stop(self) -> None:
        if self._is_opening:
            self.stop_requested.emit()
        else:
            self.begin()

    def _use_equipment(self, choice: EquipmentChoice) -> None:
        self.equipment = choice
        if self._settings is not None:
            self._settings.study_equipment = msgspec.to_builtins(choice)
        self.equipment_button.setText(f"Equipment: {choice.text}…" if choice.text else "Equipment…")
