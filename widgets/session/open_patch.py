"""The patches that are open, A and B: where they lie, whether they are saved, and their copy that survives a crash."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from underfoot.errors import UnderfootError
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.node import Registry
from underfoot.patch.outside_files import outside_files
from underfoot.patch.patch import Patch
from underfoot.widgets.dialogs.file_question import FileQuestion
from underfoot.widgets.session.autosave import Autosave, Rescued
from underfoot.widgets.session.own_nodes import OwnNodes
from underfoot.widgets.session.settings import Settings

AUTOSAVE_MS = 1000
"""How long after the last edit unsaved work is written down."""

SLOTS = ("A", "B")

FILTER = "Patches (*.json);;All files (*)"
_Answer = QMessageBox.StandardButton


def other_slot(slot: str) -> str:
    """The slot beside this one.

    >>> other_slot("A")
    'B'
    """
    return SLOTS[1 - SLOTS.index(slot)]


@dataclass(frozen=True)
class Waiting:
    """The patch of the slot that is not edited, its file, and what is in that."""

    patch: Patch
    path: Path | None
    saved: Patch

    @property
    def folder(self) -> Path | None:
        """The folder that it lies in; None while it has no file."""
        return self.path.absolute().parent if self.path else None


@dataclass(frozen=True)
class _Adoption:
    """A preset took the place of a patch: both, and that one's file and what is in it."""

    before: Patch
    path: Path | None
    saved: Patch
    after: Patch


class OpenPatch(QObject):
    """A patch and its file; and beside it another one, in the other of two slots, once it was asked for.

    Whoever edits it calls `take`; who shows it listens to the signals.
    """

    opened = Signal(object)
    """Another `Patch`, to be edited from now on."""
    patch_changed = Signal(object)
    """The `Patch`, when it is another one and after every edit."""
    paths_changed = Signal(object)
    """The `Patch` with other paths to the same files, when it was saved in another folder; to be edited on."""
    folder_changed = Signal(object)
    """The folder that the patch lies in, or None."""
    adopted = Signal(object, str)
    """A `Patch` that takes the place of the one that is edited, as an edit of this name that can be taken back."""
    switched = Signal(str, object)
    """The slot that is edited from now on, and its `Patch`."""
    title_changed = Signal()
    """Name or unsaved mark may have changed."""
    said = Signal(str)
    """A line for the person."""

    def __init__(self, registry: Registry, settings: Settings, folder: Path, window: QWidget) -> None:
        """`folder` is where copies of unsaved work are kept; `window` is that of the dialogs."""
        super().__init__(window)
        self.patch = Patch()
        self.path: Path | None = None
        self.slot = SLOTS[0]
        self.other: Waiting | None = None
        self.keeps_unsaved = False
        self.autosave = Autosave(folder)
        self.nodes = OwnNodes(registry, settings, window)
        self.nodes.said.connect(self.said)
        self._saved = self.patch
        self._adoptions: list[_Adoption] = []
        self._registry, self._settings, self._window = registry, settings, window
        self._files = FileQuestion(window, lambda: settings.folder, self.said.emit)
        self._writer = ThreadPoolExecutor(1, "autosave")
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(AUTOSAVE_MS)
        self._timer.timeout.connect(self.keep)

    @property
    def is_saved(self) -> bool:
        """Whether the patch is on disk as it is now, or was never edited."""
        return self.patch == self._saved

    @property
    def is_all_saved(self) -> bool:
        """The same, of both slots."""
        return self.is_saved and (self.other is None or self.other.patch == self.other.saved)

    @property
    def name(self) -> str:
        """What the title shows: the patch's own title, else its file's name."""
        return self.patch.title or (self.path.stem if self.path else "Untitled")

    @property
    def folder(self) -> Path | None:
        """The folder that the patch lies in; None while it has no file."""
        return self.path.absolute().parent if self.path else None

    def take(self, patch: Patch) -> None:
        """The patch after an edit."""
        self.patch = patch
        for step in reversed(self._adoptions):
            if patch in (step.before, step.after):
                self._follow(step, patch == step.after)
                break
        self._timer.start()
        self.patch_changed.emit(patch)
        self.title_changed.emit()

    def adopt(self, path: Path) -> None:
        """Edit on with a copy of a preset, as a step that can be taken back; what was before is kept for that."""
        self.nodes.ask(path, lambda: self._adopt(path))

    def _adopt(self, path: Path) -> bool:
        try:
            patch = with_files_kept(self.nodes.load(path), self._registry, path.parent, None)
        except UnderfootError as error:
            self.said.emit(str(error))
            return False
        if patch != self.patch:
            self._adoptions.append(_Adoption(self.patch, self.path, self._saved, patch))
            self.adopted.emit(patch, f"Open {patch.title or path.stem}")
            self.said.emit(f"{patch.title or path.stem} is open; undo brings back what was there.")
        return True

    def _follow(self, step: "_Adoption", is_after: bool) -> None:
        """A preset has no file of the person's: saving asks for one. What was before it has its own again."""
        was_saved = step.before == step.saved
        self._saved = step.after if is_after and was_saved else step.saved
        self._set_path(None if is_after else step.path)

    # --- A and B ---

    def switch(self) -> None:
        """Edit and play the other slot. B begins as a copy of A without a file."""
        self._adoptions.clear()
        other = self.other or Waiting(self._without_folder(), None, self._without_folder())
        self.other = Waiting(self.patch, self.path, self._saved)
        self.slot = other_slot(self.slot)
        self.patch, self._saved = other.patch, other.saved
        self._set_path(other.path)
        self.switched.emit(self.slot, self.patch)
        self.patch_changed.emit(self.patch)
        self.title_changed.emit()
        self._timer.start()

    def copy_to_other(self) -> Patch:
        """The patch as the other slot is to have it, with files that are found from there."""
        return self._without_folder()

    def take_other(self, patch: Patch) -> None:
        """The patch of the other slot after an edit, such as a copy."""
        other = self.other or Waiting(patch, None, patch)
        self.other = replace(other, patch=patch)
        self._timer.start()
        self.patch_changed.emit(self.patch)

    def _without_folder(self) -> Patch:
        return with_files_kept(self.patch, self._registry, self.folder, None)

    # --- begin ---

    def begin(self, path: Path | None, otherwise: Patch) -> None:
        """At the start: what a crash left, else the file that was asked for, else this patch."""
        rescued = self.autosave.rescue(self._registry, self.nodes.make_ready)
        if path is not None and self.read(path):
            if rescued is not None:
                self.autosave.put_aside()
                self.said.emit("Unsaved work from last time is kept: start Underfoot without a file to restore it.")
        elif rescued is not None:
            other = rescued.other
            self.other = Waiting(other.patch, other.path, self._on_disk(other.path)) if other is not None else None
            self._begin_with(rescued.patch, rescued.path, saved=self._on_disk(rescued.path))
            self.said.emit("Underfoot was not closed normally last time: your unsaved work is restored.")
        else:
            self._begin_with(otherwise, None, saved=otherwise)

    def read(self, path: Path) -> bool:
        """Open the patch in a file; a file that cannot be is said, and nothing changes.

        Returns whether it is open now: it may be that a question has to be answered first.
        """
        return self.nodes.ask(path, lambda: self._read(path))

    def _read(self, path: Path) -> bool:
        try:
            patch = self.nodes.load(path)
        except UnderfootError as error:
            self.said.emit(str(error))
            return False
        unknown = self._unknown_files(patch, path.absolute().parent)
        if unknown:
            self._ask_for_files(path, patch, unknown)
            return False
        self._open(path, patch)
        return True

    def _open(self, path: Path, patch: Patch) -> None:
        self._begin_with(patch, path, saved=patch)
        self._settings.remember_file(path)
        if missing := self.nodes.missing(patch):
            self.said.emit(missing)

    def _begin_with(self, patch: Patch, path: Path | None, saved: Patch) -> None:
        self._adoptions.clear()
        self.patch, self._saved = patch, saved
        self._set_path(path)
        self.opened.emit(patch)
        self.patch_changed.emit(patch)
        self.title_changed.emit()
        self._timer.start()

    def _set_path(self, path: Path | None) -> None:
        before, self.path = self.folder, path
        if self.folder != before:
            self.folder_changed.emit(self.folder)

    def _on_disk(self, path: Path | None) -> Patch:
        try:
            return self.nodes.load(path) if path else Patch()
        except UnderfootError:
            return Patch()

    # --- files ---

    def new(self) -> None:
        """Begin an empty patch, when the present one is safe."""
        self.when_safe(lambda: self._begin_with(Patch(), None, saved=Patch()))

    def open(self, path: Path | None = None) -> None:
        """Open a file, asked for where it is not given, when the present patch is safe."""
        if path is not None:
            self.when_safe(lambda: self.read(path))
        else:
            self.when_safe(lambda: self._files.ask("Open a patch", FILTER, self.read))

    def take_over(self, patch: Patch) -> None:
        """Begin with a patch that has no file yet, such as one that was imported."""
        self._begin_with(patch, None, saved=patch)

    def save(self, then: Callable[[], object] | None = None) -> None:
        """Save to the patch's file, asked for where there is none yet; go on with `then` once it is saved."""
        if self.path is None:
            self.save_as(then)
        elif self._write(self.path) and then is not None:
            then()

    def save_as(self, then: Callable[[], object] | None = None) -> None:
        """Save to another file."""

        def write(path: Path) -> None:
            if self._write(path) and then is not None:
                then()

        self._files.ask("Save the patch", FILTER, write, f"{self.name}.json")

    def _write(self, path: Path) -> bool:
        before, folder = self.patch, path.absolute().parent
        try:
            patch = before if folder == self.folder else with_files_kept(before, self._registry, self.folder, folder)
            patch.save(path)
        except UnderfootError as error:
            self.said.emit(str(error))
            return False
        left = self.nodes.bring_along(patch, self.folder, folder)
        self.patch = self._saved = patch
        self._set_path(path)
        self._settings.outside_files += self._unknown_files(patch, folder)  # the person's own choice
        if patch != before:
            self.paths_changed.emit(patch)
        self._settings.remember_file(path)
        self._timer.start()
        self.said.emit(f"Saved as {path}{left}")
        self.title_changed.emit()
        return True

    # --- questions ---

    def when_safe(self, then: Callable[[], object]) -> None:
        """Go on with `then` at once if all is saved, else when the person has said what to do with it."""
        if self.is_saved:
            then()
            return
        box = QMessageBox(self._window)
        box.setWindowTitle("Unsaved work")
        box.setText(f"Save the changes to “{self.name}”?")
        box.setStandardButtons(_Answer.Save | _Answer.Discard | _Answer.Cancel)
        box.setDefaultButton(_Answer.Save)
        box.finished.connect(lambda answer: self._answered(_Answer(answer), then))
        box.finished.connect(box.deleteLater)
        box.open()

    def when_all_safe(self, then: Callable[[], object]) -> None:
        """The same for both slots, one after the other."""
        if self.is_saved and not self.is_all_saved:
            self.switch()
        self.when_safe(then if self.is_all_saved or self.other is None else lambda: self.when_all_safe(then))

    def _unknown_files(self, patch: Patch, folder: Path) -> list[str]:
        """Files outside its folder that the patch reads, and that nobody has allowed yet."""
        named = (os.path.abspath(path) for path in outside_files(patch, self._registry, folder))
        return [name for name in named if name not in self._settings.outside_files]

    def _ask_for_files(self, path: Path, patch: Patch, files: list[str]) -> None:
        """Open the patch if the person lets it read files outside its folder."""
        box = QMessageBox(self._window)
        box.setWindowTitle("Files outside the folder")
        some = "\n".join(files[:5]) + (f"\nand {len(files) - 5} more" if len(files) > 5 else "")
        box.setText(f"“{path.name}” reads sound files outside its own folder:\n\n{some}")
        box.setInformativeText("Open it, and let patches read these files from now on?")
        box.setStandardButtons(_Answer.Open | _Answer.Cancel)
        box.setDefaultButton(_Answer.Cancel)

        def answered(answer: int) -> None:
            if _Answer(answer) == _Answer.Open:
                self._settings.outside_files += files
                self._open(path, patch)

        box.finished.connect(answered)
        box.finished.connect(box.deleteLater)
        box.open()

    def _answered(self, answer: _Answer, then: Callable[[], object]) -> None:
        if answer == _Answer.Save:
            self.save(then)
        elif answer == _Answer.Discard:
            self._saved = self.patch
            then()

    # --- the copy ---

    def keep(self) -> None:
        """Write unsaved work down, or take the copy away where all is saved: in a thread, for disks can be slow."""
        if self.is_all_saved:
            self._writer.submit(self.autosave.forget)
        else:
            other = Rescued(self.other.patch, self.other.path) if self.other is not None else None
            self._writer.submit(self.autosave.keep, self.patch, self.path, other)

    def close(self) -> None:
        """The window closes. Unsaved work is forgotten, for the person was asked; or kept, if nobody was."""
        self._timer.stop()
        if self.keeps_unsaved:
            self.keep()
        else:
            self._writer.submit(self.autosave.forget)
        self._writer.shutdown()
        self.autosave.close()
