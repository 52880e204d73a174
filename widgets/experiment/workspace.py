"""The Experiment workspace: choose, make, run and analyse a study."""

from collections.abc import Callable, Iterator
from pathlib import Path

from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QWidget

from underfoot.errors import UnderfootError
from underfoot.widgets import theme
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.scrolled import scrolling_pages
from underfoot.widgets.experiment.experimenter_view import ExperimenterView
from underfoot.widgets.experiment.overview import StudyOverview
from underfoot.widgets.experiment.protocol_editor import ProtocolEditor
from underfoot.widgets.experiment.running_study import RunningStudy
from underfoot.widgets.experiment.session_start import SessionStart
from underfoot.widgets.experiment.studies import SessionFolder, StudyFile
from underfoot.widgets.experiment.study_findings import StudyFindings
from underfoot.widgets.experiment.study_list import StudyList
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.workspace import Workspace, WorkspaceContext

SHORTCUTS = (
    ("New study, make a copy, edit", "Alt+N, Alt+M, Alt+E"),
    ("Delete the chosen study of your own", "Delete in the list"),
    ("Making a study: save and go on, close", "Ctrl+S, Esc"),
    ("Making a study: undo, redo", "Ctrl+Z, Ctrl+Shift+Z"),
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

    shortcuts = SHORTCUTS

    def __init__(self, root: Path, own: Path, own_patches: Path, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        theme.fill(self, "ground")
        self._controller: SessionController | None = None
        self.sessions = SessionFolder(root)
        self.make(self._parts(own, own_patches))

    def _parts(self, own: Path, own_patches: Path) -> Iterator[None]:
        self.study_list = StudyList(own, self.sessions)
        yield
        self.start = SessionStart(self.study_list.study, self.sessions, self.study_list.read_again)
        self.findings = StudyFindings(self.study_list.study, self.sessions, self)
        self.overview = StudyOverview(self.start, self.findings)
        yield
        self.experimenter = ExperimenterView()
        self.running = RunningStudy(self.experimenter)
        self.protocol_editor = ProtocolEditor(own, own_patches, self.sessions)
        yield
        # From the outside in: a widget that gets another parent has the style of all within it looked up again.
        self.stack = QStackedWidget()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.study_list)
        layout.addWidget(scrolling_pages(self.stack), 1)
        for view in (self.overview, self.experimenter, self.protocol_editor):
            self.stack.addWidget(view)
        self.focused_first = self.study_list
        self._connect()
        self._show_study(self.study_list.study)

    # --- as a workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        self._controller = context.controller
        nodes, bridge = context.open_patch.nodes, context.controller.bridge
        self.protocol_editor.ask_to_run = nodes.when_patch_allowed
        self.start.attach(context.controller, context.settings)
        self.findings.attach(context.settings)
        bridge.reported.connect(self.running.take)
        bridge.ticked.connect(self.running.tick)
        self.study_list.attach(nodes)
        self.protocol_editor.restore_unsaved()

    def set_active(self, active: bool) -> None:
        if active:
            self.study_list.ask_to_run_nodes()

    def open_file(self, path: Path) -> None:
        """Add the study in a protocol file to the list, unless a study is run or made."""
        if self.study_list.isEnabled():
            self.study_list.open_protocol(path)
        else:
            self.notified.emit(f"{path.name} is not opened while a study is run or made: end that first")

    def save(self) -> bool:
        """Save the study that is being made, wherever the focus is."""
        is_editing = self.stack.currentWidget() is self.protocol_editor
        if is_editing:
            self.protocol_editor.save_protocol()
        return is_editing

    def silence(self) -> None:
        """Stop the study (panic); the current presentation begins again on continuation."""
        self.running.stop("panic")

    @property
    def would_lose(self) -> bool:
        """Whether a participant's session is running, or an answer or a draft can be kept nowhere."""
        is_running = self.running.has_participant or bool(self.running.unwritten())
        return is_running or not self.protocol_editor.copy.is_kept()

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Ask before the end of a participant's running session, or of a draft, then call `then`."""
        if not self.running.has_participant or self.running.unwritten():
            self.running.ask_to_leave(lambda: self.protocol_editor.ask_to_leave(then))
            return
        text = "A study is running. Its answers are kept, and it can be gone on with another time."
        ask(self.window(), "Close during a study", text, "Close", then, "Go on with it")

    def close_down(self) -> None:
        """End the running study; its session file can be continued."""
        self.running.leave()
        for background in (self.running.background, self.findings.background):
            background.stop()
            background.join()
        self.protocol_editor.close_down()

    # --- the page that is shown ---

    def _show_study(self, study: StudyFile) -> None:
        if not self.running.is_on:
            self.overview.show_study(study)
            self.findings.show_study(study)
            self.start.show_study(study)

    def _show_alone(self, view: QWidget) -> None:
        """Show a study that is made or run, which has the room of the list meanwhile."""
        self.study_list.setEnabled(False)
        self.study_list.hide()
        self.stack.setCurrentWidget(view)

    def _show_list(self) -> None:
        """Show the list of studies again, and the chosen one."""
        self.study_list.setEnabled(True)
        self.study_list.show()
        self.stack.setCurrentWidget(self.overview)

    def _close_editor(self, has_saved: bool) -> None:
        """Return to the list of studies; after a save, focus the field of the participant's id."""
        self._show_list()
        (self.start.participant if has_saved else self.study_list.list).setFocus()

    def _add_saved(self, path: Path) -> None:
        """Add a saved protocol to the list, and select it."""
        self.findings.forget_people(path)
        self.study_list.add(path, is_own=True)
        self.start.participant.clear()
        self.notified.emit(f"Saved as {path}")

    def _begin(self, study: StudyFile, participant: str) -> None:
        """Begin or continue a participant's session; show errors."""
        controller = self._controller
        if controller is None or self.running.is_on:
            return
        self.findings.stop()
        try:
            self.sessions.claim(study)
        except UnderfootError as error:
            self.overview.state.setText(str(error))
            return
        self.study_list.setEnabled(False)
        self.start.show_opening()
        self.running.begin(controller, study, participant, self.sessions.path(study, participant), self.start.equipment)

    def _show_running(self) -> None:
        """Show the study that has begun, to the experimenter and to the participant."""
        self.start.show_opened()
        self._show_alone(self.experimenter)
        self.experimenter.setFocus()
        self.running.show_participant()

    def _show_failure(self, why: str) -> None:
        """Say why no session has begun."""
        self.start.show_opened()
        self.study_list.setEnabled(True)
        self._show_study(self.study_list.study)  # its session may have been made
        if why:
            self.overview.state.setText(why)

    def _end(self, study: StudyFile, participant: str) -> None:
        """Return to the choice of a study; `participant` is the id of who has finished the study, or ""."""
        self._show_list()
        self.start.participant.setFocus()
        self._show_study(self.study_list.study)
        if participant:
            self.start.show_end(participant, is_pilot=study.is_pilot)

    def _connect(self) -> None:
        self.study_list.chosen.connect(self._show_study)
        self.study_list.new_requested.connect(self.protocol_editor.make_new)
        self.study_list.copy_requested.connect(lambda: self.protocol_editor.make_copy(self.study_list.study))
        self.study_list.edit_requested.connect(lambda: self.protocol_editor.edit_study(self.study_list.study))
        self.protocol_editor.opened.connect(lambda: self._show_alone(self.protocol_editor))
        self.protocol_editor.saved.connect(self._add_saved)
        self.protocol_editor.closed.connect(self._close_editor)
        self.start.begin_requested.connect(self._begin)
        self.findings.loaded.connect(self.loaded)
        self.start.stop_requested.connect(self.running.leave)
        self.running.begun.connect(self._show_running)
        self.running.failed.connect(self._show_failure)
        self.running.ended.connect(self._end)
        for part in (self.study_list, self.protocol_editor, self.running):
            part.notified.connect(self.notified)
