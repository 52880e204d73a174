"""Custom nodes in files beside a patch, in the window: run after confirmation, or replaced by stand-ins."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from underfoot.errors import BadFile, UnderfootError
from underfoot.files import read_file
from underfoot.patch.custom_nodes import (
    add_stand_ins,
    copy_needed,
    files_needed,
    node_files,
    run_file,
    running_elsewhere,
    unknown_types,
)
from underfoot.patch.node import Registry
from underfoot.patch.node_files import NodeFile, has_nodes
from underfoot.patch.patch import Patch
from underfoot.quantities import first_of, number
from underfoot.widgets.controls.question import message_box
from underfoot.widgets.session.settings import Settings

MOST_FILES_NAMED = 5
"""Of the files that a question is about; of more, the number is told."""
_WORDS = (
    "A node is a program: it runs with your rights, and can read, change and send whatever you can. Run it only if you "
    "know who wrote it; Show Details shows what is in it.\n\nNot run, it is missing: it puts out nothing, and is saved "
    "as it is. You are asked again when the file has changed."
)


class OwnNodes(QObject):
    """Asks before a file is run, and remembers consent by the file's SHA-256 in the settings."""

    changed = Signal()
    """The set of nodes has changed."""
    consent_given = Signal()
    """The user has agreed to a file: to be saved at once."""
    notified = Signal(str)
    """A line for the user."""

    def __init__(self, registry: Registry, settings: Settings, window: QWidget) -> None:
        super().__init__(window)
        self._registry, self._settings, self._window = registry, settings, window
        self._refused: set[str] = set()

    def when_allowed(self, path: Path, then: Callable[[], bool]) -> bool:
        """Call `then`; first ask if there are files beside the patch `path` that have not been decided on.

        Returns the result of `then`; False if a question is asked first.
        """
        try:
            files = self._undecided_files(node_files(path.absolute().parent))
        except BadFile as error:
            self.notified.emit(str(error))
            return False
        if not files:
            return then()
        self._ask(path.name, files, then)
        return False

    def when_patch_allowed(self, path: Path, then: Callable[[], object]) -> None:
        """Call `then`, which plays or presents the patch in a file, once its files run or are refused."""
        folder = path.absolute().parent
        if not has_nodes(folder):
            then()
            return
        try:
            files = files_needed(Patch.unchecked(read_file(path), str(path)).types.values(), folder)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self.when_files_allowed(path.name, files, then)

    def when_files_allowed(self, name: str, files: Sequence[NodeFile], then: Callable[[], object]) -> None:
        """Do the same for the files that something called `name` needs; files agreed to before are run.

        A patch that needs a file that does not run is then refused for that reason by its reader.
        """

        def go_on() -> None:
            self._run_beside(files)
            then()

        files = [file for file in files if not running_elsewhere(file)]  # it is in use by an open patch
        fresh = self._undecided_files(files)
        if fresh:
            self._ask(name, fresh, go_on)
        else:
            go_on()

    def _undecided_files(self, files: Iterable[NodeFile]) -> list[NodeFile]:
        known = {*self._settings.run_code, *self._refused}
        return [file for file in files if file.sha256 not in known]

    def _ask(self, name: str, files: list[NodeFile], then: Callable[[], object]) -> None:
        box = self._question(name, files)

        def answered() -> None:
            hashes = [file.sha256 for file in files]
            if box.buttonRole(box.clickedButton()) == QMessageBox.ButtonRole.AcceptRole:
                self._settings.run_code += hashes
                self.consent_given.emit()
            else:
                self._refused.update(hashes)
            then()

        box.finished.connect(answered)
        box.open()

    def _run_beside(self, files: Iterable[NodeFile]) -> None:
        """Run the files that were agreed to."""
        is_new = False
        for file in files:
            try:
                if file.sha256 in self._settings.run_code:
                    is_new |= run_file(file)
            except BadFile as error:
                self.notified.emit(str(error))
        if is_new:
            self.changed.emit()

    def load(self, path: Path) -> Patch:
        """Load the patch in a file, once the nodes beside it are available or replaced by stand-ins."""
        text = read_file(path)
        self.register_nodes(Patch.unchecked(text, str(path)), path.absolute().parent)
        return Patch.loads(text, self._registry, str(path))

    def register_nodes(self, patch: Patch, folder: Path | None) -> None:
        """Run the files beside a patch that were agreed to, and register stand-ins for the nodes of the others."""
        reasons: dict[str, str] = {}
        is_new = False
        for file in node_files(folder):
            try:
                if file.sha256 in self._settings.run_code:
                    is_new |= run_file(file)
                else:
                    reasons[file.type] = f"{file.path} was not run, for nobody has agreed to it"
            except BadFile as error:
                reasons[file.type] = str(error)
        missing = {}
        for type in unknown_types(patch.types.values()):
            before = self._registry[type].missing if type in self._registry else ""
            if type in reasons or before:
                missing[type] = reasons.get(type, before)
        add_stand_ins(patch.types, patch.wires, missing)
        if is_new or missing:
            self.changed.emit()

    def missing_text(self, patch: Patch) -> str:
        """Return a line on the nodes of a patch that are missing, and why; "" for none."""
        types = dict.fromkeys(patch.types.values())
        return "; ".join(f"{type} is missing: {why}" for type in types if (why := self._registry[type].missing))

    def copy_node_files(self, patch: Patch, before: Path | None, after: Path) -> str:
        """Copy the files that a patch needs when it is saved in another folder; return a description of errors."""
        try:
            wrong = copy_needed(patch.types.values(), before, after)
        except UnderfootError as error:
            wrong = [f"its nodes could not be copied beside it: {error}"]
        return "".join(f"; {line}" for line in wrong)

    def _question(self, name: str, files: list[NodeFile]) -> QMessageBox:
        named = [f"{file.path}  ({number(len(file.source), 9)} bytes)" for file in files]
        some = "\n".join(first_of(named, MOST_FILES_NAMED))
        what = "lies a node in a file of its own" if len(files) == 1 else "lie nodes in files of their own"
        text = f"Beside “{name}” {what}:\n\n{some}"
        box = message_box(self._window, "A program beside the patch", text, _WORDS)
        box.setDetailedText("\n\n".join(f"# {file.path}\n{file.source.decode(errors='replace')}" for file in files))
        box.addButton("Run it" if len(files) == 1 else "Run them", QMessageBox.ButtonRole.AcceptRole)
        refuse = box.addButton("Do not", QMessageBox.ButtonRole.RejectRole)
        box.setDefaultButton(refuse)
        box.setEscapeButton(refuse)
        return box
