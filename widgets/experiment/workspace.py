"""The Experiment workspace: choose, simulate, run and analyse a study."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QStackedWidget

from underfoot.errors import UnderfootError
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.report import text_of
from underfoot.experiments.draft import Draft
from underfoot.experiments.protocol import Protocol, node_files_of
from underfoot.files import make_folder, read_file, write_file
from underfoot.patch.node import Registry
from underfoot.quantities import counted
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets.controls.file_dialog import file_dialog
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.trash import move_to_trash
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.experiment.background import BackgroundWorker, Task
from underfoot.widgets.experiment.choice import StudyList, StudyOverview
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog, choice_of_settings
from underfoot.widgets.experiment.experimenter_view import ExperimenterView
from underfoot.widgets.experiment.findings import analysed_in_process, simulated_study, written_in_process
from underfoot.widgets.experiment.people_dialog import PeopleDialog, SimulatedPeople, people_text
from underfoot.widgets.experiment.protocol_editor import ProtocolEditor, ask_to_delete
from underfoot.widgets.experiment.running_study import RunningStudy
from underfoot.widgets.experiment.studies import (
    StudyFile,
    is_id,
    load_study,
    own_node_files,
    own_studies,
    preset_studies,
    session_path,
    sessions_of,
    unused_id,
    was_begun_otherwise,
)
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.own_nodes import OwnNodes
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.workspace import Workspace, WorkspaceContext

UNSAVED = "unsaved.draft"
"""File beside the user's protocols with the draft that was open when the window was closed."""
_HOW = "Pilot: try two trials of each stage yourself. Begin: type a participant's id first."
GO_ON, ANOTHER_ID = "Go on with that one", "Begin anew under another id"
SHORTCUTS = (
    ("New study, make a copy, edit", "Alt+N, Alt+M, Alt+E"),
    ("Making a study: save and go on, close", "Ctrl+S, Esc"),
    ("Making a study: add, copy, remove, move", "Ins, Ctrl+D, Del, Alt+Up and Alt+Down"),
    ("Begin a presentation, or continue", "Space or Return"),
    ("Choose an answer", "1, 2, …"),
    ("Move a slider", "Left and Right"),
    ("In the participant's window: stop", "Esc"),
)


class ExperimentWorkspace(Workspace):
    """Runs studies on the window's session; session files are below `root`, in one folder per study.

    The user's protocols are in `own`, the user's presets in `own_patches`.
    """

    def __init__(self, registry: Registry, root: Path, own: Path, own_patches: Path) -> None:
        super().__init__()
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._registry, self.root, self.own = registry, root, own
        self.studies: list[StudyFile] = preset_studies(registry)
        own_ones, self._load_errors = own_studies(own, registry)
        self.studies += own_ones
        self._study = self.studies[0]
        self._is_pilot = False  # the running study, or the last one
        self._has_saved = False  # whether the form has saved the chosen study since it was opened
        self._controller: SessionController | None = None
        self.equipment = EquipmentChoice()
        self._people: dict[Path, SimulatedPeople] = {}
        self._settings: Settings | None = None
        self._nodes: OwnNodes | None = None
        self.background = BackgroundWorker(self)
        self.list, self.overview, self.experimenter = StudyList(), StudyOverview(), ExperimenterView()
        self.running = RunningStudy(self.experimenter, self.background)
        self.protocol_editor = ProtocolEditor(root, own_patches)
        self.stack = QStackedWidget()
        for view in (self.overview, self.experimenter, self.protocol_editor):
            self.stack.addWidget(view)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.list)
        layout.addWidget(self.stack, 1)
        self.setFocusProxy(self.list)
        self._connect()
        self.list.show_studies(self.studies, 0)
        self.overview.show_findings((), "")

    # --- as a workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        self._controller, self._settings = context.controller, context.settings
        self._nodes = context.open_patch.nodes
        self.protocol_editor.ask_to_run = self._nodes.when_patch_allowed
        self._use_equipment(choice_of_settings(context.settings.study_equipment))
        bridge = context.controller.bridge
        bridge.reported.connect(self.running.take)
        bridge.ticked.connect(self.running.tick)
        context.controller.opened.connect(self._show_availability)
        self._show_availability()
        for line in self._load_errors:
            self.notified.emit(line)
        self.restore_unsaved()

    def set_active(self, active: bool) -> None:
        """Show or leave the workspace; when shown, ask whether custom nodes of the user's studies may run."""
        nodes = self._nodes if active else None
        if nodes is not None and (files := own_node_files(self.own)):
            nodes.when_files_allowed("your own studies", files, self._load_own_studies)

    def _load_own_studies(self) -> None:
        known = [study.path for study in self.studies]
        fresh = [study for study in own_studies(self.own, self._registry)[0] if study.path not in known]
        if fresh:
            self.studies += fresh
            self.list.show_studies(self.studies, self.studies.index(self._study))

    def shortcuts(self) -> Keys:
        return SHORTCUTS

    def silence(self) -> None:
        """Stop the study (panic); the current presentation begins again on continuation."""
        self.running.stop("panic")

    @property
    def would_lose(self) -> bool:
        """Whether a participant's session is running."""
        return self.running.has_participant

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Ask before the end of a participant's running session, then call `then`."""
        text = "A study is running. Its answers are kept, and it can be gone on with another time."
        ask(self.window(), "Close during a study", text, "Close", then, "Go on with it")

    def close_down(self) -> None:
        """End the running study; its session file can be continued."""
        self.running.leave()
        self.background.stop()
        self.background.join()
        unsaved = self.protocol_editor.unsaved()
        if unsaved:
            write_file(make_folder(self.own) / UNSAVED, unsaved)

    # --- the choice ---

    @property
    def study(self) -> StudyFile:
        """The selected study."""
        return self._study

    def choose(self, index: int) -> None:
        """Select a study by its index in the list."""
        if 0 <= index < len(self.studies) and not self.running.is_on:
            self.background.stop()
            self._study = self.studies[index]
            self.overview.show_findings((), "")
            self._show()

    def open_protocol(self, path: Path) -> None:
        """Add the protocol in a file to the list, and select it; show errors.

        If its patches need custom nodes in files, ask whether these may run.
        """
        try:
            files = node_files_of(path)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        if self._nodes is not None:
            self._nodes.when_files_allowed(path.name, files, lambda: self._add_protocol(path))
        else:
            self._add_protocol(path)

    def _add_protocol(self, path: Path) -> None:
        """Add a protocol, or read it again in its place in the list."""
        known = [study.path.resolve() for study in self.studies]
        index = known.index(path.resolve()) if path.resolve() in known else len(known)
        is_own = index < len(known) and self.studies[index].is_own
        try:
            self.studies[index : index + 1] = [load_study(path, self._registry, is_own)]
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self.list.show_studies(self.studies, index)

    def _show(self) -> None:
        sessions = sessions_of(self.root, self._study)
        self.overview.show_study(self._study, len(sessions), self.root / self._study.name)
        self.overview.show_people(people_text(self.people))
        self.list.set_editable(self._study.is_own)
        self._show_availability()

    def _show_availability(self) -> None:
        person = self.overview.participant.text()
        has_session = self._controller is not None and self._controller.session is not None
        goes_on = is_id(person) and session_path(self.root, self._study, person).exists()
        why_not = "The session is not open yet." if not has_session else "" if person else _HOW
        if person and not is_id(person):
            why_not = "An id has up to 40 letters, digits, - and _; names are not asked for."
        self.overview.show_availability(has_session, has_session and is_id(person), goes_on, why_not)

    def _ask_protocol(self) -> None:
        dialog = file_dialog(self, "A protocol", "", "Protocols (*.json)")
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.fileSelected.connect(lambda path: self.open_protocol(Path(path)))
        dialog.open()

    # --- the user's protocols ---

    def make_new(self) -> None:
        """Open the editor with a new protocol of two trials."""
        self._open_editor(Draft.new(self._registry, self.own))

    def copy_study(self) -> None:
        """Open the editor with a copy of the selected study."""
        study = self._study
        draft = Draft.of(study.protocol, self._registry, self.own)
        draft.raw["title"] = f"{study.protocol.title or study.name}, my own"
        try:
            draft.take_patches(study.folder)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._open_editor(draft)

    def edit_study(self) -> None:
        """Open the editor with the selected study, if it is the user's own."""
        study = self._study
        if study.is_own:
            count = len(sessions_of(self.root, study))
            begun = f"{count} {'session was' if count == 1 else 'sessions were'} begun with it as it is"
            note = (
                f"{begun}: they stay, and go on as they were begun, but are analysed here only while it is unchanged."
            )
            self._open_editor(
                Draft.of(study.protocol, self._registry, self.own), study.path, note=note if count else ""
            )

    def ask_to_delete_study(self) -> None:
        """Delete the selected study's file, if it is the user's own, after a question."""
        study = self._study
        if study.is_own:
            title = study.protocol.title or study.name
            ask_to_delete(self.window(), title, len(sessions_of(self.root, study)), lambda: self._delete(study))

    def _delete(self, study: StudyFile) -> None:
        if not move_to_trash(study.path):
            self.notified.emit(f"{study.path} could not be moved to the trash; delete it by hand")
            return
        index = self.studies.index(study)
        self.studies.remove(study)
        self.list.show_studies(self.studies, min(index, len(self.studies) - 1))

    def _open_editor(self, draft: Draft, path: Path | None = None, note: str = "") -> None:
        if not self.running.is_on:
            self._has_saved = False
            self.protocol_editor.edit(draft, path, note)
            self.list.setEnabled(False)
            self.stack.setCurrentWidget(self.protocol_editor)

    def _close_editor(self) -> None:
        """Return to the list of studies; after a save, focus the field of the participant's id."""
        self.list.setEnabled(True)
        self.stack.setCurrentWidget(self.overview)
        (self.overview.participant if self._has_saved else self.list.list).setFocus()

    def _protocol_saved(self, path: Path) -> None:
        """Add a saved protocol to the list, and select it."""
        study = load_study(path, self._registry, is_own=True)
        self._people.pop(path, None)  # its methods may have changed
        known = [study.path for study in self.studies]
        if path in known:
            self.studies[known.index(path)] = study
        else:
            self.studies.append(study)
        self.list.show_studies(self.studies, [study.path for study in self.studies].index(path))
        self.overview.participant.clear()
        self._has_saved = True
        self.notified.emit(f"Saved as {path}")

    def restore_unsaved(self) -> None:
        """Open the editor with the draft that was unsaved when the window was closed."""
        kept = self.own / UNSAVED
        if not kept.is_file():
            return
        try:
            found = json.loads(read_file(kept))
            draft = Draft(found["protocol"], self._registry, self.own)
            self._open_editor(
                draft, Path(found["path"]) if found["path"] else None, "Not saved when the window closed."
            )
        except (UnderfootError, ValueError, KeyError, TypeError, AttributeError):
            self.notified.emit(f"{kept} cannot be read; it is left as it is")
            return
        self.protocol_editor.mark_unsaved()
        kept.unlink()

    # --- findings ---

    def simulate(self) -> None:
        """Run the study with simulated people, and show bias and spread of its estimates."""
        study, people = self._study, self.people
        who = counted(people.count, "person", "people")
        self._compute(f"Simulating {who}…", lambda task: simulated_study(study, people, task))

    @property
    def people(self) -> SimulatedPeople:
        """The simulated participants of the selected study."""
        return self._people.get(self._study.path, SimulatedPeople())

    def ask_people(self) -> None:
        """Ask for the number of simulated participants and their true parameters."""
        PeopleDialog(self._use_people, self._study.protocol, self.people, self.window()).open()

    def _use_people(self, people: SimulatedPeople) -> None:
        self._people[self._study.path] = people
        self.overview.show_people(people_text(people))

    def analyse(self) -> None:
        """Show the findings of the sessions so far."""
        self._analyse_files(sessions_of(self.root, self._study), self._study.protocol)

    def _analyse_files(self, paths: Sequence[Path], protocol: Protocol | None = None) -> None:
        count = counted(len(paths), "file" if protocol is None else "session")
        self._compute(f"Analysing {count}…", lambda task: analysed_in_process(paths, protocol, task))

    def _write(self, form: str, where: Path) -> None:
        """Write the trials of the chosen study's sessions."""
        study, paths = self._study, sessions_of(self.root, self._study)
        self._compute(f"Writing {form}…", lambda task: written_in_process(paths, study.protocol, form, where, task))

    def _compute(self, text: str, make: Callable[[Task], list[Any]]) -> None:
        """Start a computation, or stop the running one."""
        if self.background.is_busy:
            self.background.stop()
            return
        self.overview.show_busy(text)
        self.background.compute(make)

    def _show_findings(self, findings: Sequence[Findings]) -> None:
        drawings = [drawing for found in findings for drawing in found.drawings]
        if self.running.is_on:
            self.experimenter.drawings.show_drawings(drawings, "")
            return
        self.overview.show_busy("")
        self.overview.show_findings(drawings, text_of(findings))
        self.loaded.emit()

    def _failed(self, why: str) -> None:
        if self.running.is_on:
            self.experimenter.drawings.show_drawings((), why)
        self.overview.show_busy("")
        self.overview.state.setText(why)

    # --- equipment ---

    def ask_equipment(self) -> None:
        """Ask for the equipment beside the floor."""
        calibrated = "" if self._settings is None else self._settings.calibrated_plate
        EquipmentDialog(self._use_equipment, self.equipment, self.window(), calibrated).open()

    def _use_equipment(self, choice: EquipmentChoice) -> None:
        self.equipment = choice
        if self._settings is not None:
            self._settings.study_equipment = msgspec.to_builtins(choice)
        self.overview.show_equipment(choice.text)

    # --- a session ---

    def begin(self, participant: str) -> None:
        """Begin or continue a participant's session; show errors."""
        self._begin(self._study, participant)

    def begin_pilot(self) -> None:
        """Begin a pilot: two trials of each stage of the study."""
        pilot = self._study.pilot()
        self._begin(pilot, unused_id(self.root, pilot))

    def _begin(self, study: StudyFile, participant: str) -> None:
        """Begin or go on; where the study was changed since the session was begun, the person is asked first."""
        if self.running.is_on:
            return
        try:
            is_other = was_begun_otherwise(session_path(self.root, study, participant), study)
        except UnderfootError as error:
            self.overview.state.setText(str(error))
            return
        if not is_other:
            self._run(study, participant)
            return
        text = f"{participant} was begun with an earlier form of this study. Go on with that one?"
        self.overview.choose_another_id()
        ask(self.window(), "An earlier form", text, GO_ON, lambda: self._run(study, participant), ANOTHER_ID)

    def _run(self, study: StudyFile, participant: str) -> None:
        controller = self._controller
        if controller is None or self.running.is_on:
            return
        self.background.stop()
        path = session_path(self.root, study, participant)
        self._is_pilot = study.is_pilot
        try:
            self.running.begin(controller, study, participant, path, self.equipment)
        except UnderfootError as error:
            self.overview.state.setText(str(error))
        if self.running.is_on:
            self.list.setEnabled(False)
            self.stack.setCurrentWidget(self.experimenter)
            self.experimenter.setFocus()
            self.running.show_participant()

    def _show_choice(self, done: str) -> None:
        """Return to the choice of a study after a session; `done` is the id of a finished participant, else ""."""
        self.list.setEnabled(True)
        self.stack.setCurrentWidget(self.overview)
        self.overview.participant.setFocus()
        if done:
            self.overview.participant.clear()
        self._show()
        if done and self._is_pilot:
            self.overview.state.setText(f"Pilot {done} is done. Its answers are kept apart from the participants'.")
        elif done:
            self.overview.state.setText(f"{done} has come to the end of the study. The answers are kept.")

    def _connect(self) -> None:
        self.list.chosen.connect(self.choose)
        self.list.open_requested.connect(self._ask_protocol)
        self.list.new_requested.connect(self.make_new)
        self.list.copy_requested.connect(self.copy_study)
        self.list.edit_requested.connect(self.edit_study)
        self.list.delete_requested.connect(self.ask_to_delete_study)
        self.protocol_editor.saved.connect(self._protocol_saved)
        self.protocol_editor.closed.connect(self._close_editor)
        self.protocol_editor.notified.connect(self.notified)
        overview = self.overview
        overview.begin_requested.connect(self.begin)
        overview.pilot_requested.connect(self.begin_pilot)
        overview.participant_typed.connect(lambda _: self._show_availability())
        overview.equipment_requested.connect(self.ask_equipment)
        overview.simulate_requested.connect(self.simulate)
        overview.people_requested.connect(self.ask_people)
        overview.analyse_requested.connect(self.analyse)
        overview.results.files_chosen.connect(self._analyse_files)
        overview.results.place_chosen.connect(self._write)
        self.background.found.connect(self._show_findings)
        self.background.failed.connect(self._failed)
        self.background.notified.connect(overview.state.setText)
        self.running.notified.connect(self.notified)
        self.running.ended.connect(self._show_choice)
