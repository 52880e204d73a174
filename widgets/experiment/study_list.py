"""The list of studies: the presets, the user's own protocols, and those that were opened from elsewhere."""

from pathlib import Path

from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import QGridLayout, QListWidget, QPushButton, QVBoxLayout, QWidget

from underfoot.errors import UnderfootError
from underfoot.experiments.protocol import node_files_of
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.file_dialog import ask_file
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.trash import move_to_trash
from underfoot.widgets.experiment.studies import (
    SessionFolder,
    StudyFile,
    load_study,
    own_node_files,
    own_studies,
    preset_studies,
)
from underfoot.widgets.session.own_nodes import OwnNodes

LIST_PX = 40 * theme.GRID


class StudyList(QWidget):
    """Lists the studies by title, of which one is selected; the user's own protocols are in the folder `own`."""

    chosen = Signal(object)
    """The `StudyFile` that was selected."""
    new_requested = Signal()
    copy_requested = Signal()
    edit_requested = Signal()
    notified = Signal(str)

    def __init__(self, own: Path, sessions: SessionFolder) -> None:
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedWidth(LIST_PX)
        self._own, self._sessions = own, sessions
        self._nodes: OwnNodes | None = None
        own_ones, self._load_errors = own_studies(own)
        self.studies = [*preset_studies(), *own_ones]
        self.study = self.studies[0]
        """The selected study."""
        self.list = QListWidget()
        self.list.setAccessibleName("Studies")
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)  # titles wrap
        self.new, self.copy_button, self.edit, self.delete, self.open = (
            QPushButton("&New study…"),
            QPushButton("Make a &copy…"),
            QPushButton("&Edit…"),
            QPushButton("Delete…"),
            QPushButton("Open a protocol…"),
        )
        self.copy_button.setToolTip("A copy of the chosen study, to be changed")
        self.edit.setToolTip("Change the chosen study, if it is your own; of another, make a copy")
        self.delete.setToolTip("Move the chosen study to the trash, if it is your own (Delete)")
        below = QGridLayout()
        below.setSpacing(theme.GRID // 2)
        for index, button in enumerate((self.new, self.copy_button, self.edit, self.delete)):
            below.addWidget(button, index // 2, index % 2)
        below.addWidget(self.open, 2, 0, 1, 2)
        column = QVBoxLayout(self)
        column.addWidget(theme.label("STUDIES", "heading"))
        column.addWidget(self.list, 1)
        column.addLayout(below)
        self.list.currentRowChanged.connect(self._select)
        self.new.clicked.connect(self.new_requested)
        self.copy_button.clicked.connect(self.copy_requested)
        self.edit.clicked.connect(self.edit_requested)
        self.delete.clicked.connect(self.ask_to_delete)
        deleting = QShortcut(QKeySequence.StandardKey.Delete, self.list, self.ask_to_delete)
        deleting.setContext(Qt.ShortcutContext.WidgetShortcut)
        self.list.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        self.list.customContextMenuRequested.connect(self._show_menu)
        self.open.clicked.connect(self._ask_protocol)
        self.setFocusProxy(self.list)
        self._show(0)

    def attach(self, nodes: OwnNodes) -> None:
        """Ask `nodes` whether custom nodes of protocols may run, from now on; report protocols that cannot be read."""
        self._nodes = nodes
        for line in self._load_errors:
            self.notified.emit(line)

    def ask_to_run_nodes(self) -> None:
        """Ask whether custom nodes of the user's studies may run; if so, list these studies, too."""
        if self._nodes is not None and (files := own_node_files(self._own)):
            self._nodes.when_files_allowed("your own studies", files, self._load_own_studies)

    def _load_own_studies(self) -> None:
        known = [study.path for study in self.studies]
        fresh = [study for study in own_studies(self._own)[0] if study.path not in known]
        if fresh:
            self.studies += fresh
            self._show(self.studies.index(self.study))

    def open_protocol(self, path: Path) -> None:
        """Add the study in a protocol file, and select it; show errors.

        If its patches need custom nodes in files, ask whether these may run.
        """
        try:
            files = node_files_of(path)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        if self._nodes is not None:
            self._nodes.when_files_allowed(path.name, files, lambda: self.add(path))
        else:
            self.add(path)

    def add(self, path: Path, *, is_own: bool = False) -> None:
        """Add the study in a protocol file, or read it again in its place in the list, and select it; show errors."""
        known = [study.path.resolve() for study in self.studies]
        index = known.index(path.resolve()) if path.resolve() in known else len(known)
        is_own = is_own or (index < len(known) and self.studies[index].is_own)
        try:
            self.studies[index : index + 1] = [load_study(path, is_own=is_own)]
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._show(index)

    def read_again(self) -> None:
        """Read the selected study again if its file says something else by now; raise `BadFile` if it cannot be read.

        A file that is gone changes nothing.
        """
        study = self.study
        if study.path.exists():
            fresh = load_study(study.path, is_own=study.is_own)
            if fresh != study:
                self.add(study.path)

    def ask_to_delete(self) -> None:
        """Delete the file of the selected study, if it is the user's own, after a question; its sessions are kept."""
        study = self.study
        if study.is_own:
            count = len(self._sessions.files(study))
            kept = f" Its {counted(count, 'session stays', 'sessions stay')}." if count else ""
            text = f"Delete the protocol “{study.title}”? Its file goes to the trash.{kept}"
            ask(self.window(), "Delete protocol", text, "Delete", lambda: self._delete(study))
        else:
            self.notified.emit(f"Only your own studies are deleted here; “{study.title}” is not one.")

    def _show_menu(self, at: QPoint) -> None:
        """Offer what can be done with the chosen study, which is the one under the mouse."""
        if self.list.itemAt(at) is None:
            return
        menu = Menu(self.list)
        for text, button in (("Edit…", self.edit), ("Make a copy…", self.copy_button), ("Delete…\tDel", self.delete)):
            menu.addAction(text, button.click).setEnabled(button.isEnabled())
        menu.open_once(self.list.viewport().mapToGlobal(at))

    def _delete(self, study: StudyFile) -> None:
        if not move_to_trash(study.path):
            self.notified.emit(f"{study.path} could not be moved to the trash; delete it by hand")
            return
        index = self.studies.index(study)
        self.studies.remove(study)
        self._show(min(index, len(self.studies) - 1))

    def _ask_protocol(self) -> None:
        ask_file(self, "A protocol", "Protocols (*.json)", self.open_protocol)

    def _show(self, index: int) -> None:
        """List the studies, and select one."""
        self.list.clear()
        self.list.addItems([f"{study.title}  (own)" if study.is_own else study.title for study in self.studies])
        self.list.setCurrentRow(index)

    def _select(self, index: int) -> None:
        if index >= 0:
            self.study = self.studies[index]
            self.edit.setEnabled(self.study.is_own)
            self.delete.setEnabled(self.study.is_own)
            self.chosen.emit(self.study)
