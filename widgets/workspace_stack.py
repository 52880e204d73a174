"""The workspaces of the window: each is created at its first use, and one of them is visible."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QStackedWidget

from underfoot.documents import document_format
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.window_state import restore_splitters, save_splitters
from underfoot.widgets.workspace import Workspace, WorkspaceContext, WorkspaceDeclaration, discover

_PAUSE_MS = 5
"""Time between steps, in which the window does what is due."""


class WorkspaceStack(QStackedWidget):
    """Creates the declared workspaces and shows the chosen one. `workspaces["Design"]` is one that exists."""

    created = Signal(str)
    """The name of a new workspace, before it is attached: connect to its signals now."""
    attached = Signal(str)
    """The name of a workspace that was attached: it has all its actions now."""
    chosen_changed = Signal(str)
    """The name of the visible workspace."""
    loaded = Signal()
    """Modules or kernels that stay in memory were just loaded."""

    def __init__(self, context: WorkspaceContext) -> None:
        super().__init__()
        self.declarations = discover()
        self._context = context
        self._by_name: dict[str, Workspace] = {}
        self._unattached: dict[str, Workspace] = {}
        """Those that are built, but not part of the window yet (`create_next`)."""
        self._is_closing = False
        self._next_step = QTimer(self, singleShot=True, interval=_PAUSE_MS)
        self._next_step.timeout.connect(self.create_next)

    def __getitem__(self, name: str) -> Workspace:
        return self._by_name[name]

    def __iter__(self) -> Iterator[Workspace]:
        return iter(self._by_name.values())

    @property
    def names(self) -> list[str]:
        """The names of all workspaces, also of those not created yet, in the order of their tabs."""
        return [declared.name for declared in self.declarations]

    @property
    def chosen(self) -> str:
        """The name of the visible workspace."""
        return next(name for name, workspace in self._by_name.items() if workspace is self.currentWidget())

    def choose(self, name: str) -> None:
        """Show a workspace; the others are not drawn."""
        self._create(name)
        self.setCurrentWidget(self[name])
        self.chosen_changed.emit(name)
        (self[name].focused_first or self[name]).setFocus()
        for other, workspace in self._by_name.items():
            workspace.set_active(other == name)

    def open_file(self, path: Path) -> bool:
        """Open a file in the workspace for it, and show that workspace; return whether there is one."""
        kinds = {path.suffix.lower(), document_format(path)}
        declared = next((one for one in self.declarations if kinds & {*one.suffixes, *one.formats}), None)
        if declared is not None:
            self.choose(declared.name)
            self[declared.name].open_file(path)
        return declared is not None

    def create_all(self) -> None:
        """Create the workspaces that do not exist yet."""
        for name in self.names:
            self._create(name)

    def create_next(self) -> None:
        """Take the next step to a missing workspace, and continue a moment later.

        A step imports a part of it, makes a part of it, or attaches it: all at once would block the window. An engine
        that starts again meanwhile asks for the same steps.
        """
        missing = [declared for declared in self.declarations if declared.name not in self._by_name]
        if missing and not self._is_closing:
            name = missing[0].name
            if not missing[0].load():
                workspace = self._unattached.pop(name, None)  # one that has a part which fails is made anew
                if workspace is None:
                    self._build(name)
                else:
                    is_whole = next(workspace.unmade, "no part is missing")
                    self._unattached[name] = workspace
                    if is_whole:
                        self._create(name)
            self._next_step.start()

    def shortcuts(self) -> list[tuple[str, Keys]]:
        """Return the keys of each workspace under its heading; creates all workspaces."""
        self.create_all()
        return [(_heading(declared), [*self[declared.name].shortcuts]) for declared in self.declarations]

    def silence(self) -> None:
        """Stop whatever makes sound by itself (panic)."""
        for workspace in self:
            workspace.silence()

    @property
    def would_lose(self) -> list[str]:
        """The names of the workspaces in which closing the window would lose or interrupt something."""
        return [name for name, workspace in self._by_name.items() if workspace.would_lose]

    def ask_to_leave(self, names: list[str], then: Callable[[], object]) -> None:
        """Show each of these workspaces in turn and ask there; call `then` if the user agrees every time."""
        if names:
            self.choose(names[0])
            self[names[0]].ask_to_leave(partial(self.ask_to_leave, names[1:], then))
        else:
            then()

    def save_for_restart(self, folder: Path) -> None:
        """Save to `folder` what is in no file, before the window is closed and opened again."""
        for workspace in self:
            workspace.save_for_restart(folder)

    def close_down(self) -> None:
        """Save the layout, end what runs, and wait for files being written; no workspace is created any more."""
        self._is_closing = True
        for name in [*self._unattached]:
            self._create(name)
        for workspace in self:
            save_splitters(workspace, self._context.settings)
            workspace.close_down()

    def _build(self, name: str) -> None:
        declared = next(declared for declared in self.declarations if declared.name == name)
        self._unattached[name] = workspace = declared.make(self._context, self)
        workspace.hide()  # or a window that is hidden now would show it, half made, with all its children
        workspace.setAttribute(Qt.WidgetAttribute.WA_PendingResizeEvent, False)  # a picture of the window would send it

    def _create(self, name: str) -> None:
        if name in self._by_name:
            return
        if name not in self._unattached:
            self._build(name)
        workspace = self._unattached.pop(name)
        workspace.complete()
        self._by_name[name] = workspace
        self.addWidget(workspace)
        restore_splitters(workspace, self._context.settings)
        workspace.loaded.connect(self.loaded)
        self.created.emit(name)
        workspace.attach(self._context)
        self.attached.emit(name)
        workspace.set_active(False)
        self.loaded.emit()


def _heading(declared: WorkspaceDeclaration) -> str:
    focus = f", with the focus on the {declared.focus}" if declared.focus else ""
    return f"{declared.name}{focus}".upper()
