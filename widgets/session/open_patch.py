"""The open patches, A and B: their files, whether they are saved, and the copies that survive a crash."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace
from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QMessageBox, QWidget

from underfoot.errors import UnderfootError
from underfoot.files import read_file, write_file
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.node import Registry
from underfoot.patch.outside_files import outside_files
from underfoot.patch.patch import Patch
from underfoot.quantities import first_of
from underfoot.widgets.controls.fields import end_typing
from underfoot.widgets.controls.question import ask, message_box
from underfoot.widgets.dialogs.file_chooser import FileChooser
from underfoot.widgets.session.autosave import AUTOSAVE_MS, Autosave, CopyWriter, RecoveredWork
from underfoot.widgets.session.own_nodes import MOST_FILES_NAMED, OwnNodes
from underfoot.widgets.session.settings import Settings

FIRST_PRESET = "gravel"
SLOTS = ("A", "B")

PATCH_FILES = "; allowed: a patch, which is a .json file (Import… takes those of other programs)"
FILTER = "Patches (*.json);;All files (*)"
_Answer = QMessageBox.StandardButton


def other_slot(slot: str) -> str:
    """Return the other slot.

    >>> other_slot("A")
    'B'
    """
    return SLOTS[1 - SLOTS.index(slot)]


def first_patch() -> Patch:
    """Return the preset that there is to play with at the first start; nothing where it is missing."""
    try:
        return Patch.load(preset_files.patches()[FIRST_PRESET], REGISTRY)
    except (KeyError, UnderfootError):
        return Patch()


class SlotContent(Struct, frozen=True):
    """The patch of a slot, its file, and the saved content."""

    patch: Patch
    path: Path | None
    saved: Patch

    @property
    def folder(self) -> Path | None:
        """The folder of its file; None without a file."""
        return self.path.absolute().parent if self.path else None

    @property
    def is_saved(self) -> bool:
        """Whether the patch equals its file, or was never edited."""
        return self.patch == self.saved


class OpenPatch(QObject):
    """A patch and its file, and on request another one in the second of two slots.

    Editors call `set_patch`; views connect to the signals.
    """

    opened = Signal(object)
    """Another `Patch`, to be edited from now on."""
    patch_changed = Signal(object)
    """The `Patch`, when it is replaced and after every edit."""
    paths_changed = Signal(object)
    """The `Patch` with new paths to the same files, after it was saved in another folder; editing continues."""
    folder_changed = Signal(object)
    """The folder of the patch, or None."""
    preset_opened = Signal(object, str)
    """A `Patch` that replaces the edited one, as an undoable edit of this name."""
    switched = Signal(str, object)
    """The slot that is edited from now on, and its `Patch`."""
    title_changed = Signal()
    """The name or the unsaved mark may have changed."""
    notified = Signal(str)
    """A line for the user."""
    not_read = Signal(object, str)
    """The `Path` of a file that was to be opened, and why it cannot be read, in a line."""

    def __init__(self, registry: Registry, settings: Settings, folder: Path, window: QWidget) -> None:
        """Create the open patch; copies of unsaved work are kept in `folder`, and `window` is the parent of dialogs."""
        super().__init__(window)
        self.slot = SLOTS[0]
        self.content = SlotContent(Patch(), None, Patch())
        self.other: SlotContent | None = None
        self.keeps_autosave = self.reopens = False
        """`reopens`: the window closes to be opened anew with what is open now, saved or not."""
        self.autosave = Autosave(folder)
        self.nodes = OwnNodes(registry, settings, window)
        self.nodes.notified.connect(self.notified)
        self._preset_openings: list[tuple[SlotContent, Patch]] = []  # what a preset replaced, and the preset
        self._registry, self._settings, self._window = registry, settings, window
        self._file_chooser = FileChooser(window, lambda: settings.folder, self.notified.emit)
        self._timer = QTimer(self, singleShot=True, interval=AUTOSAVE_MS)
        self._timer.timeout.connect(self.write_autosave)
        self._writer = CopyWriter(self.notified.emit, self._timer)

    @property
    def patch(self) -> Patch:
        """The patch that is edited."""
        return self.content.patch

    @property
    def path(self) -> Path | None:
        """Its file; None without one."""
        return self.content.path

    @property
    def is_saved(self) -> bool:
        """Whether the patch equals its file, or was never edited."""
        return self.content.is_saved

    @property
    def is_all_saved(self) -> bool:
        """The same, for both slots."""
        return self.is_saved and (self.other is None or self.other.is_saved)

    @property
    def name(self) -> str:
        """The patch's own title, else its file's name."""
        return self.patch.title or (self.path.stem if self.path else "Untitled")

    @property
    def name_and_slot(self) -> str:
        """The name, with the slot where there are two."""
        return f"{self.name} ({self.slot})" if self.other is not None else self.name

    @property
    def folder(self) -> Path | None:
        """Folder of the patch; None without a file."""
        return self.content.folder

    def set_patch(self, patch: Patch) -> None:
        """Set the patch after an edit."""
        self.content = replace(self.content, patch=patch)
        for before, preset in reversed(self._preset_openings):
            if patch in (before.patch, preset):
                self._restore_file(before, preset if patch == preset else None)
                break
        self._timer.start()
        self.patch_changed.emit(patch)
        self.title_changed.emit()

    def open_preset(self, path: Path) -> None:
        """Continue with a copy of a preset, as an undoable edit; the previous patch is kept for undo."""
        self.nodes.when_allowed(path, lambda: self._open_preset(path))

    def _open_preset(self, path: Path) -> bool:
        try:
            patch = with_files_kept(self.nodes.load(path), self._registry, path.parent, None)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return False
        if patch != self.patch:
            self._preset_openings.append((self.content, patch))
            self.preset_opened.emit(patch, f"Open {patch.title or path.stem}")
            self.notified.emit(f"{patch.title or path.stem} is open; undo brings back what was there.")
        return True

    def _restore_file(self, before: SlotContent, preset: Patch | None) -> None:
        """Restore the file after an undo, or after a redo, of a `preset`, which has none: saving asks for one."""
        saved = preset if preset is not None and before.is_saved else before.saved
        self._set_content(SlotContent(self.patch, before.path if preset is None else None, saved))

    # --- A and B ---

    def switch(self) -> None:
        """Edit and play the other slot. B starts as a copy of A without a file."""
        self._preset_openings.clear()
        other = self.other or SlotContent(self.patch_for_other(), None, self.patch_for_other())
        self.other, self.slot = self.content, other_slot(self.slot)
        self._set_content(other)
        self.switched.emit(self.slot, self.patch)
        self.patch_changed.emit(self.patch)
        self.title_changed.emit()
        self._timer.start()

    def patch_for_other(self) -> Patch:
        """Return the patch for the other slot, with file paths that are valid there."""
        return with_files_kept(self.patch, self._registry, self.folder, None)

    def set_other(self, patch: Patch) -> None:
        """Set the patch of the other slot, after an edit such as a copy."""
        other = self.other or SlotContent(patch, None, patch)
        self.other = replace(other, patch=patch)
        self._timer.start()
        self.patch_changed.emit(self.patch)

    # --- start ---

    def restore_or_open(self, path: Path | None, default_patch: Patch) -> None:
        """Open, at the start, the work left by a crash, else the requested file, else this patch."""
        recovered, unreadable = None, ""
        try:
            recovered = self.autosave.recover(self._registry, self.nodes.register_nodes)
        except UnderfootError as error:
            unreadable = str(error)

        def keep() -> None:
            if unreadable:
                self.notified.emit(unreadable)
            if recovered is not None:
                self._writer.submit(self.autosave.put_aside)  # after the copies before
                self.notified.emit("Unsaved work from last time is kept: start Underfoot without a file to restore it.")

        if path is not None and self.read(path, keep):
            return
        if recovered is not None:
            self.other = self._recovered(recovered.other) if recovered.other is not None else None
            self._replace(self._recovered(recovered))
            if not recovered.for_restart:
                self.notified.emit("Underfoot was not closed normally last time: your unsaved work is restored.")
        else:
            self.open_untitled(default_patch)
            if unreadable:
                self.notified.emit(unreadable)

    def read(self, path: Path, then: Callable[[], object] = lambda: None) -> bool:
        """Open the patch in a file, and call `then`; if that fails, report it and change nothing.

        Returns whether it is open now; a question may have to be answered first.
        """
        return self.nodes.when_allowed(path, lambda: self._read(path, then))

    def _read(self, path: Path, then: Callable[[], object]) -> bool:
        try:
            patch = self.nodes.load(path)
        except UnderfootError as error:
            if not path.exists():
                self._settings.forget_file(path)
            is_other = path.suffix.lower() != ".json" and "allowed:" not in str(error)
            self.not_read.emit(path, f"{error}{PATCH_FILES if is_other else ''}")
            return False
        unknown = self._unknown_files(patch, path.absolute().parent)
        if unknown:
            self._ask_for_files(path, patch, unknown, then)
            return False
        self._open(path, patch, then)
        return True

    def _open(self, path: Path, patch: Patch, then: Callable[[], object]) -> None:
        if path.resolve() in map(Path.resolve, preset_files.patches().values()):  # the program's file, not the user's
            self.open_untitled(with_files_kept(patch, self._registry, path.parent, None))
        else:
            self._replace(SlotContent(patch, path, patch))
            self._settings.remember_file(path)
        self.notified.emit(self.nodes.missing_text(patch) or f"{path.name} is open.")
        then()

    def _replace(self, content: SlotContent) -> None:
        self._preset_openings.clear()
        self._set_content(content)
        self.opened.emit(self.patch)
        self.patch_changed.emit(self.patch)
        self.title_changed.emit()
        self._timer.start()

    def _set_content(self, content: SlotContent) -> None:
        before, self.content = self.folder, content
        if self.folder != before:
            self.folder_changed.emit(self.folder)

    def _recovered(self, work: RecoveredWork) -> SlotContent:
        """Return what was in a slot; what cannot be read of its file counts as an empty patch."""
        saved = work.patch if work.path is None and work.is_saved else Patch()
        if work.path is not None:
            with suppress(UnderfootError):
                saved = self.nodes.load(work.path)
        return SlotContent(work.patch, work.path, saved)

    # --- files ---

    def new(self) -> None:
        """Begin an empty patch, once the present one is safe."""

        def begin() -> None:
            self.open_untitled(Patch())
            self.notified.emit("A new patch is open.")

        self.ask_to_save(begin)

    def open(self, path: Path | None = None) -> None:
        """Open a file once the present patch is safe; ask for it if it is not given."""
        if path is None:
            self.ask_to_save(lambda: self._file_chooser.ask("Open a patch", FILTER, self.read))
            return
        try:
            Patch.unchecked(read_file(path), str(path))
        except UnderfootError:
            self.read(path)  # which says why not, and replaces nothing that would have to be saved
        else:
            self.ask_to_save(lambda: self.read(path))

    def open_untitled(self, patch: Patch) -> None:
        """Begin with a patch without a file, such as an imported one."""
        self._replace(SlotContent(patch, None, patch))

    def save(self, then: Callable[[], object] | None = None) -> None:
        """Save to the patch's file, asking for one if needed; call `then` once it is saved."""
        path = self.path
        if path is None:
            self.save_as(then)
        elif self._was_changed(path):
            text = (
                f"“{path.name}” was changed by another program or window. Replace it with what is open here?\n"
                "To keep both, cancel, and choose Save as…"
            )
            ask(self._window, "The file was changed", text, "Replace", lambda: self._write_then(path, then))
        else:
            self._write_then(path, then)

    def _was_changed(self, path: Path) -> bool:
        """Return whether the patch's file holds something else than was read from it or written to it."""
        try:
            return read_file(path) != self.content.saved.dumps() and self.nodes.load(path) != self.content.saved
        except UnderfootError:  # as a patch, or not at all
            return path.exists()

    def save_as(self, then: Callable[[], object] | None = None) -> None:
        """Save to another file; its present name, or else one from the title, is offered."""
        end_typing(self._window)
        offered = self.path.name if self.path is not None else f"{self.name}.json"
        self._file_chooser.ask("Save the patch", FILTER, lambda path: self._write_then(path, then), offered)

    def _write_then(self, path: Path, then: Callable[[], object] | None) -> None:
        if self._write(path) and then is not None:
            then()

    def _write(self, path: Path) -> bool:
        before, folder = self.patch, path.absolute().parent
        try:
            patch = before if folder == self.folder else with_files_kept(before, self._registry, self.folder, folder)
            write_file(path, patch.dumps())  # unchecked: a node may be another one since, and work is to be kept
        except UnderfootError as error:
            self.notified.emit(str(error))
            return False
        left = self.nodes.copy_node_files(patch, self.folder, folder)
        self._set_content(SlotContent(patch, path, patch))
        self._settings.outside_files += self._unknown_files(patch, folder)  # the user's own choice
        if patch != before:
            self.paths_changed.emit(patch)
        self._settings.remember_file(path)
        self._timer.start()
        self.notified.emit(f"Saved as {path}{left}")
        self.title_changed.emit()
        return True

    # --- questions ---

    def ask_to_save(self, then: Callable[[], object]) -> None:
        """Call `then` at once if all is saved, else after the user has decided what to do."""
        end_typing(self._window)
        if self.is_saved:
            then()
            return
        box = message_box(self._window, "Unsaved work", f"Save the changes to “{self.name_and_slot}”?")
        box.setStandardButtons(_Answer.Save | _Answer.Discard | _Answer.Cancel)
        box.setDefaultButton(_Answer.Save)
        box.finished.connect(lambda answer: self._answered(_Answer(answer), then))
        box.open()

    def ask_to_save_all(self, then: Callable[[], object]) -> None:
        """Ask for both slots, in sequence."""
        self.ask_to_save(lambda: self._ask_to_save_other(then))

    def _ask_to_save_other(self, then: Callable[[], object]) -> None:
        if self.other is not None and not self.other.is_saved:
            self.switch()
            self.ask_to_save(then)
        else:
            then()

    def _unknown_files(self, patch: Patch, folder: Path) -> list[str]:
        """Return the files outside its folder that the patch reads, and that are not allowed yet."""
        named = (os.path.abspath(path) for path in outside_files(patch, self._registry, folder))
        return [name for name in named if name not in self._settings.outside_files]

    def _ask_for_files(self, path: Path, patch: Patch, files: list[str], then: Callable[[], object]) -> None:
        """Open the patch if the user allows it to read files outside its folder."""
        some = "\n".join(first_of(files, MOST_FILES_NAMED))
        text = f"“{path.name}” reads sound files outside its own folder:\n\n{some}"
        more = "Open it, and let patches read these files from now on?"
        box = message_box(self._window, "Files outside the folder", text, more)
        box.setStandardButtons(_Answer.Open | _Answer.Cancel)
        box.setDefaultButton(_Answer.Cancel)

        def answered(answer: int) -> None:
            if _Answer(answer) == _Answer.Open:
                self._settings.outside_files += files
                self._open(path, patch, then)

        box.finished.connect(answered)
        box.open()

    def _answered(self, answer: _Answer, then: Callable[[], object]) -> None:
        if answer == _Answer.Save:
            self.save(then)
        elif answer == _Answer.Discard:
            then()  # what is there stays unsaved: a dialog that follows may be cancelled

    # --- copies ---

    def write_autosave(self) -> None:
        """Copy unsaved work, or remove the copy if all is saved, in a thread, because disks can be slow."""
        if self.is_all_saved and not self.reopens:
            self._writer.submit(self.autosave.remove)
            return
        waiting = self.other
        other = RecoveredWork(waiting.patch, waiting.path, is_saved=waiting.is_saved) if waiting else None
        self._writer.submit(
            self.autosave.write, RecoveredWork(self.patch, self.path, other, self.is_saved, self.reopens)
        )

    def close(self) -> None:
        """Close with the window. The copy is removed if the user was asked, and kept otherwise."""
        self._timer.stop()
        if self.keeps_autosave or self.reopens:
            self.write_autosave()
        else:
            self._writer.submit(self.autosave.remove)
        self._writer.close()
        self.autosave.close()
