"""What a workspace is: a page of the window, in a folder of its own that declares it.

A folder of `underfoot.widgets` is a workspace where its `__init__.py` has a `WorkspaceDeclaration`. The window, its
menu, the tabs, the sheet of shortcuts and the pictures of `--screenshot` follow from the declarations.
"""

import dis
import importlib.abc
import importlib.util
import pkgutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

import underfoot.widgets
from underfoot.patch.node import Registry
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.listening import Listening
from underfoot.widgets.session.open_patch import OpenPatch
from underfoot.widgets.session.settings import Settings


@dataclass(frozen=True)
class WorkspaceContext:
    """What the window shares with its workspaces. `folder` is where the program keeps its files."""

    registry: Registry
    settings: Settings
    folder: Path
    open_patch: OpenPatch
    controller: SessionController
    listening: Listening


class Workspace(QWidget):
    """One page of the window. It works alone, too, as tests use it: only `attach` binds it to anything else."""

    notified = Signal(str)
    """A line for the person, shown at the bottom of the window."""
    withdrawn = Signal(str)
    """A line that was shown there is not so any more."""
    warnings_changed = Signal(object)
    """Lines of warning, shown in the transport bar; a click there brings this workspace to the screen."""
    loaded = Signal()
    """Modules or kernels that stay have been loaded just now."""
    files_pasted = Signal(list)
    """Paths of files that were copied elsewhere and pasted here: to be opened as if they had been dropped."""

    def attach(self, context: WorkspaceContext) -> None:
        """Show the present, and connect to what is listened to from now on. Called once."""

    def menu_actions(self) -> Sequence[QAction]:
        """Actions for the window's menu."""
        return ()

    def shortcuts(self) -> Keys:
        """What is done by which keys here: for the sheet of shortcuts."""
        return ()

    def set_active(self, active: bool) -> None:
        """The workspace comes to the screen, or another one takes its place."""

    def open_file(self, path: Path) -> None:
        """Open a file of one of the suffixes that the declaration says."""

    def export(self) -> bool:
        """Export what is shown, in a dialog; whether there is anything other than the patch to be exported here."""
        return False

    def silence(self) -> None:
        """Panic: end whatever makes sound by itself."""

    def save_for_restart(self, folder: Path) -> None:
        """The window is closed to be opened anew at once: write what no file has to `folder`."""

    @property
    def would_lose(self) -> bool:
        """Whether closing the window would lose what a person measured, or break it off: `ask_to_leave` asks."""
        return False

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Where it `would_lose`, call `then` when the person agrees."""
        then()

    def close_down(self) -> None:
        """The window closes: end what runs, and wait for what is being written."""


@dataclass(frozen=True)
class WorkspaceDeclaration:
    """A workspace as its folder declares it. `make` imports what it needs, so that an unused workspace costs nothing.

    Most of that is `workspace.py` in the folder, which is the package `package`: `load` imports it beforehand.
    `suffixes` are those of files that it opens: dropped on the window, or named on the command line. `name` is on its
    tab, or in a narrow window the picture `icon`; `key` brings it to the screen; tabs are in the order of their keys.
    `focus` says where the focus must be for its shortcuts, if that is not the whole workspace.
    """

    name: str
    key: str
    make: Callable[[WorkspaceContext], Workspace]
    focus: str = ""
    suffixes: tuple[str, ...] = ()
    icon: str = "list"
    package: str = ""

    def load(self) -> bool:
        """Import the next part of the workspace's code; return whether there was one.

        A part is a module that the workspace's imports, at last the workspace's own: all at once would hold the window.
        """
        name = f"{self.package}.workspace"
        if not self.package or name in sys.modules:
            return False
        importlib.import_module(next((part for part in _imports_of(name) if part not in sys.modules), name))
        return True


@cache
def _imports_of(name: str) -> tuple[str, ...]:
    """Return the modules that a module imports, by its code."""
    spec = importlib.util.find_spec(name)
    assert spec is not None
    assert isinstance(spec.loader, importlib.abc.InspectLoader)
    code = spec.loader.get_code(name)
    assert code is not None
    return tuple(one.argval for one in dis.get_instructions(code) if one.opname == "IMPORT_NAME")


def discover() -> tuple[WorkspaceDeclaration, ...]:
    """The workspaces that the folders of `underfoot.widgets` declare, in the order of their keys.

    >>> "Design" in [workspace.name for workspace in discover()]
    True
    """
    found = []
    for folder in pkgutil.iter_modules(underfoot.widgets.__path__):
        if folder.ispkg:
            package = importlib.import_module(f"{underfoot.widgets.__name__}.{folder.name}")
            found += [value for value in vars(package).values() if isinstance(value, WorkspaceDeclaration)]
    return tuple(sorted(found, key=lambda workspace: workspace.key))
