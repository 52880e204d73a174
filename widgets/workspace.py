"""Workspaces: the pages of the window. Each is a folder of `underfoot.widgets`.

A folder is a workspace if its `__init__.py` has a `WorkspaceDeclaration`. The window, its menu, the tabs, the list of
shortcuts and the pictures of `--screenshot` follow from the declarations.
"""

import dis
import importlib.abc
import importlib.util
import pkgutil
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

from msgspec import Struct
from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

import underfoot.widgets
from underfoot.patch.node import Registry
from underfoot.widgets.dialogs.shortcuts import Keys
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.listening import Listening
from underfoot.widgets.session.network_link import NetworkLink
from underfoot.widgets.session.open_patch import OpenPatch
from underfoot.widgets.session.settings import Settings


class WorkspaceContext(Struct, frozen=True):
    """Objects that the window shares with its workspaces. `folder` contains the program's own files."""

    registry: Registry
    settings: Settings
    folder: Path
    open_patch: OpenPatch
    controller: SessionController
    listening: Listening
    network: NetworkLink


class Workspace(QWidget):
    """A page of the window. Until `attach` it is independent of the session, as tests use it."""

    notified = Signal(str)
    """A message for the user, shown at the bottom of the window."""
    withdrawn = Signal(str)
    """A message of `notified` that no longer holds."""
    warnings_changed = Signal(object)
    """Warnings, one line each, for the main bar; a click there shows this workspace."""
    loaded = Signal()
    """Modules or kernels that stay in memory were just loaded."""
    files_pasted = Signal(list)
    """Paths of pasted files, to be opened like dropped ones."""

    unmade: Iterator[None] = iter(())
    """Makes its missing parts, one at each `next`: all at once would stop the window."""

    focused_first: QWidget | None = None
    """What has the focus once the workspace is shown. As its focus proxy, it would take every Tab out of the workspace,
    too, and the keyboard would never leave."""

    def make(self, parts: Iterator[None]) -> None:
        """Leave these parts to the stack, which makes one between two events; without a parent, make all now."""
        self.unmade = parts
        if self.parent() is None:
            self.complete()

    def complete(self) -> None:
        """Make all parts that are missing."""
        for _ in self.unmade:
            pass

    def attach(self, context: WorkspaceContext) -> None:
        """Show the present state and follow its changes. Called once."""

    def menu_actions(self) -> Sequence[QAction]:
        """Return actions for the window's menu."""
        return ()

    @property
    def shortcuts(self) -> Keys:
        """Actions and their keys, for the list of shortcuts."""
        return ()

    def set_active(self, active: bool) -> None:
        """Note that the workspace is now visible, or hidden."""

    def open_file(self, path: Path) -> None:
        """Open a file with one of the declared suffixes or formats."""

    def save(self) -> bool:
        """Save what is edited here, which is not the patch; return False if there is no such thing."""
        return False

    def export(self) -> bool:
        """Export what is shown, in a dialog; return False if only the patch can be exported here."""
        return False

    def silence(self) -> None:
        """Stop whatever makes sound by itself (panic)."""

    def save_for_restart(self, folder: Path) -> None:
        """Save to `folder` what is in no file, before the window is closed and opened again."""

    @property
    def would_lose(self) -> bool:
        """Whether closing the window would lose or interrupt a measurement: then `ask_to_leave` asks."""
        return False

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Ask the user before something is lost (`would_lose`); call `then` if they agree."""
        then()

    def close_down(self) -> None:
        """End what runs, and wait for files being written, before the window closes."""


class WorkspaceDeclaration(Struct, frozen=True):
    """The declaration of a workspace. `make(context, parent)` imports the code: an unused workspace costs nothing.

    The code is `workspace.py` in the folder, the package `package`; `load` imports it beforehand. Files with one of
    the `suffixes`, and documents of one of the `formats`, open here, if they are dropped on the window; the former
    also if they are given on the command line. The tab shows `name`, or in a narrow window `icon`; the shortcut `key`
    shows the workspace; tabs are in the order of keys. `focus` says where the focus must be for its shortcuts; "" for
    the whole workspace.
    """

    name: str
    key: str
    make: Callable[[WorkspaceContext, QWidget], Workspace]
    focus: str = ""
    suffixes: tuple[str, ...] = ()
    formats: tuple[str, ...] = ()
    icon: str = "list"
    package: str = ""

    def load(self) -> bool:
        """Import the next part of the workspace's code; return whether there was one.

        A part is one imported module, the last one the workspace's own: to import all at once would block the window.
        """
        name = f"{self.package}.workspace"
        if not self.package or name in sys.modules:
            return False
        importlib.import_module(_first_part_of(name))
        return True


def _first_part_of(name: str, importers: tuple[str, ...] = ()) -> str:
    """Return the module that an import of `name` would load first of all of ours; `name` if the others are loaded."""
    for part in _imports_of(name):
        if part not in sys.modules and part not in importers and part.startswith(f"{underfoot.__name__}."):
            return _first_part_of(part, (*importers, name))
    return name


@cache
def _imports_of(name: str) -> tuple[str, ...]:
    """Return the names of the modules that a module imports when it runs, without importing it."""
    spec = importlib.util.find_spec(name)
    assert spec is not None
    assert isinstance(spec.loader, importlib.abc.InspectLoader)
    code = spec.loader.get_code(name)
    assert code is not None
    names, is_asked, skipped_to = [], False, 0
    for one in dis.get_instructions(code):
        if one.offset < skipped_to:  # only type checkers read it
            continue
        if one.opname == "IMPORT_NAME":
            names.append(one.argval)
        elif one.argval == "TYPE_CHECKING" and one.opname.startswith("LOAD_"):
            is_asked = True
        elif is_asked and "JUMP" in one.opname:
            is_asked, skipped_to = False, one.argval
    return tuple(names)


def discover() -> tuple[WorkspaceDeclaration, ...]:
    """Return the workspaces declared by the folders of `underfoot.widgets`, in the order of their keys.

    >>> "Design" in [workspace.name for workspace in discover()]
    True
    """
    found = []
    for folder in pkgutil.iter_modules(underfoot.widgets.__path__):
        if folder.ispkg:
            package = importlib.import_module(f"{underfoot.widgets.__name__}.{folder.name}")
            found += [value for value in vars(package).values() if isinstance(value, WorkspaceDeclaration)]
    return tuple(sorted(found, key=lambda workspace: workspace.key))
