"""The Experiment workspace: a study is chosen, simulated, run on a person, and analysed."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec
from PySide6.QtCore import QFile, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QStackedWidget

from underfoot.engine.commands import PressTile, Walk
from underfoot.engine.reports import Report
from underfoot.errors import UnderfootError
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.report import text_of
from underfoot.experiments.draft import Draft
from underfoot.experiments.store import SessionFile
from underfoot.files import make_folder, read_file, write_file
from underfoot.patch.node import Registry
from underfoot.studies.equipment import Equipment, EquipmentChoice
from underfoot.studies.runner import Phase, Runner
from underfoot.studies.target import Stand
from underfoot.widgets.controls.file_dialog import file_dialog
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.experiment.background import Background, Task
from underfoot.widgets.experiment.choice import StudyList, StudyOverview
from underfoot.widgets.experiment.desk import Desk
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog, kept_choice
from underfoot.widgets.experiment.findings import analysed_sessions, answers_so_far, simulated_study
from underfoot.widgets.experiment.maker import Maker, ask_to_delete
from underfoot.widgets.experiment.participant_window import ParticipantWindow
from underfoot.widgets.experiment.studies import (
    StudyFile,
    is_id,
    load_study,
    own_studies,
    preset_studies,
    session_path,
    sessions_of,
)
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.workspace import Workspace, WorkspaceContext

PEOPLE = 100
LEAST_ANSWERED = 4
"""From so many trials on what they say is drawn while a study runs."""
UNSAVED = "unsaved.draft"
"""Beside a person's own protocols: what was being made when the window was closed."""
SHORTCUTS = (
    ("New study, make one's own, edit", "Alt+N, Alt+M, Alt+E"),
    ("Making a study: save, close", "Ctrl+S, Esc"),
    ("Making a study: add, copy, remove, move", "Ins, Ctrl+D, Del, Alt+Up and Alt+Down"),
    ("Begin a presentation, or continue", "Space or Return"),
    ("Choose an answer", "1, 2, …"),
    ("Move a slider", "Left and Right"),
    ("In the participant's window: stop", "Esc"),
)


class ExperimentWorkspace(Workspace):
    """Runs studies through the window's session; session files lie below `root`, a folder for each study.

    A person's own protocols lie in `own`, `own_patches` is where their own presets are.
    """

    def __init__(self, registry: Registry, root: Path, own: Path, own_patches: Path) -> None:
        super().__init__()
        self.setProperty("role", "ground")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self._registry, self.root, self.own = registry, root, own
        self.studies: list[StudyFile] = preset_studies(registry)
        own_ones, self._wrong = own_studies(own, registry)
        self.studies += own_ones
        self._study = self.studies[0]
        self._controller: SessionController | None = None
        self._walked, self._drawn = False, 0
        self.equipment = EquipmentChoice()
        self._settings: Settings | None = None
        self.runner: Runner | None = None
        self.window_of_participant: ParticipantWindow | None = None
        self.background = Background(self)
        self.list, self.overview, self.desk = StudyList(), StudyOverview(), Desk()
        self.maker = Maker(root, own_patches)
        self.stack = QStackedWidget()
        for view in (self.overview, self.desk, self.maker):
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

    def listen(self, context: WorkspaceContext) -> None:
        self._controller, self._settings = context.controller, context.settings
        self._use_equipment(kept_choice(context.settings.study_equipment))
        bridge = context.controller.bridge
        bridge.reported.connect(self._take)
        bridge.ticked.connect(self._tick)
        context.controller.opened.connect(self._show_way)
        self._show_way()
        for line in self._wrong:
            self.said.emit(line)
        self.go_on_making()

    def shortcuts(self) -> Keys:
        return SHORTCUTS

    def silence(self) -> None:
        """Panic: the study stops, and what was presented begins anew when it goes on."""
        if self.runner is not None:
            self.runner.stop("panic")

    def close_down(self) -> None:
        """End what runs; the session's file stays as it is, to be gone on with."""
        self.leave()
        self.background.stop()
        self.background.join()
        unsaved = self.maker.unsaved()
        if unsaved:
            write_file(make_folder(self.own) / UNSAVED, unsaved)

    # --- the choice ---

    @property
    def study(self) -> StudyFile:
        """The study that is chosen."""
        return self._study

    def choose(self, place: int) -> None:
        """Choose a study by its place in the list."""
        if 0 <= place < len(self.studies) and self.runner is None:
            self.background.stop()
            self._study = self.studies[place]
            self.overview.show_findings((), "")
            self._show()

    def open_protocol(self, path: Path) -> None:
        """Add the protocol in a file to the list, and choose it; what is wrong with it is said."""
        try:
            self.studies.append(load_study(path, self._registry))
        except UnderfootError as error:
            self.said.emit(str(error))
            return
        self.list.show_studies(self.studies, len(self.studies) - 1)

    def _show(self) -> None:
        self.overview.show_study(self._study, len(sessions_of(self.root, self._study)))
        self.list.show_own(self._study.is_own)
        self._show_way()

    def _show_way(self) -> None:
        person = self.overview.participant.text()
        has_session = self._controller is not None and self._controller.session is not None
        goes_on = is_id(person) and session_path(self.root, self._study, person).exists()
        why_not = "" if has_session else "The session is not open yet."
        if person and not is_id(person):
            why_not = "An id has letters, digits, - and _; names are not asked for."
        self.overview.show_way(has_session and is_id(person), goes_on, why_not)

    def _ask_protocol(self) -> None:
        dialog = file_dialog(self, "A protocol", "", "Protocols (*.json)")
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setFileMode(QFileDialog.FileMode.ExistingFile)
        dialog.fileSelected.connect(lambda path: self.open_protocol(Path(path)))
        dialog.open()

    # --- protocols of one's own ---

    def make_new(self) -> None:
        """Open the form with a protocol of two trials."""
        self._open_maker(Draft.new(self._registry, self.own))

    def make_own(self) -> None:
        """Open the form with a copy of the chosen study."""
        study = self._study
        draft = Draft.of(study.protocol, self._registry, self.own)
        draft.raw["title"] = f"{study.protocol.title or study.name}, my own"
        try:
            draft.take_patches(study.folder)
        except UnderfootError as error:
            self.said.emit(str(error))
            return
        self._open_maker(draft)

    def edit_own(self) -> None:
        """Open the form with the chosen study, where that is a person's own."""
        study = self._study
        if study.is_own:
            count = len(sessions_of(self.root, study))
            begun = f"{count} {'session was' if count == 1 else 'sessions were'} begun with it as it is"
            note = f"{begun}: they stay, but can only be gone on with, and analysed here, while it is not changed."
            self._open_maker(Draft.of(study.protocol, self._registry, self.own), study.path, note=note if count else "")

    def ask_to_delete_own(self) -> None:
        """Delete the chosen study's file, where that is a person's own, after asking."""
        study = self._study
        if study.is_own:
            title = study.protocol.title or study.name
            ask_to_delete(self.window(), title, len(sessions_of(self.root, study)), lambda: self._delete(study))

    def _delete(self, study: StudyFile) -> None:
        if not QFile.moveToTrash(str(study.path)):
            self.said.emit(f"{study.path} could not be moved to the trash; delete it by hand")
            return
        place = self.studies.index(study)
        self.studies.remove(study)
        self.list.show_studies(self.studies, min(place, len(self.studies) - 1))

    def _open_maker(self, draft: Draft, path: Path | None = None, note: str = "") -> None:
        if self.runner is None:
            self.maker.edit(draft, path, note)
            self.list.setEnabled(False)
            self.stack.setCurrentWidget(self.maker)

    def _leave_maker(self) -> None:
        self.list.setEnabled(True)
        self.stack.setCurrentWidget(self.overview)
        self.list.list.setFocus()

    def _made(self, path: Path) -> None:
        """A protocol was saved: it is in the list, and chosen; the participant's id is next."""
        study = load_study(path, self._registry, is_own=True)
        known = [one.path for one in self.studies]
        if path in known:
            self.studies[known.index(path)] = study
        else:
            self.studies.append(study)
        self._leave_maker()
        self.list.show_studies(self.studies, [one.path for one in self.studies].index(path))
        self.overview.participant.clear()
        self.overview.participant.setFocus()

    def go_on_making(self) -> None:
        """Open the form with what was not saved when the window was closed."""
        kept = self.own / UNSAVED
        if not kept.is_file():
            return
        try:
            found = json.loads(read_file(kept))
            draft = Draft(found["protocol"], self._registry, self.own)
            self._open_maker(draft, Path(found["path"]) if found["path"] else None, "Not saved when the window closed.")
        except (UnderfootError, ValueError, KeyError, TypeError, AttributeError):
            self.said.emit(f"{kept} cannot be read; it is left as it is")
            return
        self.maker.mark_unsaved()
        kept.unlink()

    # --- findings ---

    def simulate(self) -> None:
        """Run the study on simulated people, and show bias and spread of what it estimates."""
        study = self._study
        self._compute(f"Simulating {PEOPLE} people…", lambda task: simulated_study(study, PEOPLE, task))

    def analyse(self) -> None:
        """Show what the sessions so far say."""
        study, paths = self._study, sessions_of(self.root, self._study)
        count = f"{len(paths)} {'session' if len(paths) == 1 else 'sessions'}"
        self._compute(f"Analysing {count}…", lambda task: analysed_sessions(study, paths, task))

    def _compute(self, words: str, make: Callable[[Task], list[Any]]) -> None:
        """Compute this, or stop what is being computed."""
        if self.background.is_busy:
            self.background.stop()
            return
        self.overview.show_busy(words)
        self.background.compute(make)

    def _show_findings(self, findings: Sequence[Findings]) -> None:
        drawings = [drawing for found in findings for drawing in found.drawings]
        if self.runner is not None:
            self.desk.drawings.show_drawings(drawings, "")
            return
        self.overview.show_busy("")
        self.overview.show_findings(drawings, text_of(findings))
        self.loaded.emit()

    def _failed(self, why: str) -> None:
        self.overview.show_busy("")
        self.overview.state.setText(why)

    # --- equipment ---

    def ask_equipment(self) -> None:
        """Ask what is used beside the floor."""
        EquipmentDialog(self._use_equipment, self.equipment, self.window()).open()

    def _use_equipment(self, choice: EquipmentChoice) -> None:
        self.equipment = choice
        if self._settings is not None:
            self._settings.study_equipment = msgspec.to_builtins(choice)
        self.overview.show_equipment(choice.words)

    # --- a session ---

    def begin(self, participant: str) -> None:
        """Begin or go on with a participant's session; what hinders it is said."""
        controller, study = self._controller, self._study
        if controller is None or self.runner is not None:
            return
        self.background.stop()
        path = session_path(self.root, study, participant)
        try:
            make_folder(path.parent)
            file = SessionFile.open(path) if path.exists() else self._created(path, study, participant)
            session = controller.lend()
            if session is None:
                file.close()
                return
            equipment = Equipment()
            try:
                floor, sounds = session.target.floor, study.protocol.sounds
                equipment = self.equipment.opened(sounds, floor, session.force_rate_hz)
                self.runner = Runner(session, file, study.protocol, study.folder, equipment)
            except UnderfootError:
                equipment.close()
                file.close()
                controller.take_back()
                raise
        except UnderfootError as error:
            self.overview.state.setText(str(error))
            return
        self._walked, self._drawn = session.target.walker, 0
        session.send(Walk(False))
        presses = session.target.kind == "simulator"
        self.desk.begin(session.target.floor, f"{study.protocol.title}  ·  {participant}", presses)
        self.list.setEnabled(False)
        self.stack.setCurrentWidget(self.desk)
        self.desk.setFocus()
        self.show_participant()

    def show_participant(self) -> None:
        """Open the participant's window on the last of the other screens; beside this one where there is none."""
        if self.runner is None:
            return
        if self.window_of_participant is None:
            made = ParticipantWindow(Stand.of(self._study.protocol))
            made.answered.connect(self._answer)
            made.slid.connect(self._slide)
            made.go_wanted.connect(self._go)
            made.stop_wanted.connect(lambda: self._do(lambda runner: runner.stop("by the participant")))
            made.closed.connect(self._window_closed)
            self.window_of_participant = made
        others = [screen for screen in QGuiApplication.screens() if screen is not self.screen()]
        if others:
            self.window_of_participant.show_on(others[-1])
        else:
            self.window_of_participant.resize(1000, 700)
            self.window_of_participant.show()
            self.window_of_participant.activateWindow()
        self.window_of_participant.show_runner(self.runner)

    def leave(self) -> None:
        """End the session for now; it can be gone on with."""
        runner, self.runner = self.runner, None
        if self.window_of_participant is not None:
            self.window_of_participant.close()
        if runner is None or self._controller is None:
            return
        if self._controller.session is not None:
            runner.session.send(Walk(self._walked))
        runner.close_file()
        self._controller.take_back()
        self.list.setEnabled(True)
        self.stack.setCurrentWidget(self.overview)
        self._show()

    def _created(self, path: Path, study: StudyFile, participant: str) -> SessionFile:
        target = self._controller.target if self._controller is not None else None
        about = {"target": f"{target.kind}:{target.source}", "profiles": target.profiles} if target is not None else {}
        return SessionFile.create(path, study.protocol, participant, study.folder, about)

    def _take(self, reports: list[Report]) -> None:
        if self.runner is not None:
            self._do(lambda runner: runner.poll(reports))

    def _tick(self) -> None:
        if self.runner is None:
            return
        self._do(lambda runner: runner.poll(()))
        self.desk.show_runner(self.runner)
        self._draw_answers(self.runner)
        if self.window_of_participant is not None:
            self.window_of_participant.show_runner(self.runner)

    def _draw_answers(self, runner: Runner) -> None:
        """Analyse what was answered so far, in a thread, whenever something was."""
        study, entries = runner.study, list(runner.study.entries)
        answered = sum(entry.trial is not None and not entry.spoiled for entry in entries)
        if answered < LEAST_ANSWERED or answered == self._drawn or self.background.is_busy:
            return
        self._drawn = answered
        self.background.compute(lambda _: answers_so_far(study.protocol, study.participant, entries))

    def _do(self, what: Callable[[Runner], object]) -> None:
        """Do something with the runner; what hinders it is said."""
        if self.runner is None:
            return
        try:
            what(self.runner)
        except UnderfootError as error:
            self.said.emit(str(error))

    def _go(self) -> None:
        """Begin a presentation, or continue with a page that asks nothing."""
        runner = self.runner
        if runner is None:
            return
        if runner.may_play:
            self._do(lambda r: r.start())
        elif runner.phase is Phase.PAGE and not runner.page.asks:
            self._do(lambda r: r.answer({}))
        elif runner.phase is Phase.END:
            self.leave()

    def _answer(self, values: dict[str, Any]) -> None:
        if self.runner is not None and self.runner.page.kind == "learn":
            self._do(lambda runner: runner.play(runner.learned[values["number"] - 1]))
        else:
            self._do(lambda runner: runner.answer(values))

    def _slide(self, name: str, value: float) -> None:
        if self.runner is not None and self.runner.page.kind == "level":
            self._do(lambda runner: runner.set_level(value))

    def _press(self, tile: str, x_m: float, y_m: float, force_n: float) -> None:
        self._do(lambda runner: runner.session.send(PressTile(tile, x_m, y_m, force_n)))

    def _window_closed(self) -> None:
        self.window_of_participant = None

    def _connect(self) -> None:
        self.list.chosen.connect(self.choose)
        self.list.open_wanted.connect(self._ask_protocol)
        self.list.new_wanted.connect(self.make_new)
        self.list.own_wanted.connect(self.make_own)
        self.list.edit_wanted.connect(self.edit_own)
        self.list.delete_wanted.connect(self.ask_to_delete_own)
        self.maker.saved.connect(self._made)
        self.maker.left.connect(self._leave_maker)
        self.maker.said.connect(self.said)
        overview, desk = self.overview, self.desk
        overview.begin_wanted.connect(self.begin)
        overview.participant_typed.connect(lambda _: self._show_way())
        overview.equipment_wanted.connect(self.ask_equipment)
        overview.simulate_wanted.connect(self.simulate)
        overview.analyse_wanted.connect(self.analyse)
        self.background.found.connect(self._show_findings)
        self.background.failed.connect(self._failed)
        self.background.said.connect(overview.state.setText)
        desk.next_wanted.connect(self._go)
        desk.stop_wanted.connect(lambda: self._do(lambda runner: runner.stop("by the experimenter")))
        desk.go_on_wanted.connect(lambda: self._do(lambda runner: runner.go_on()))
        desk.spoil_wanted.connect(lambda why: self._do(lambda runner: runner.spoil(why)))
        desk.repeat_wanted.connect(lambda why: self._do(lambda runner: runner.repeat_last(why)))
        desk.note_given.connect(lambda text: self._do(lambda runner: runner.note(text)))
        desk.window_wanted.connect(self.show_participant)
        desk.leave_wanted.connect(self.leave)
        desk.answered.connect(self._answer)
        desk.slid.connect(self._slide)
        desk.pressed.connect(self._press)
