"""The patch that is open: where it lies, whether it is saved, and its copy that survives a crash."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from underfoot.errors import UnderfootError
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.session.settings import Autosave, Settings

AUTOSAVE_MS = 1000
"""How long after the last edit unsaved work is written down."""

FILTER = "Patches (*.json);;All files (*)"
_Answer = QMessageBox.StandardButton


class OpenPatch(QObject):
    """Knows one patch and its file. Whoever edits it calls `take`; who shows it listens to `opened` and `changed`."""

    opened = Signal(object)
    """Another `Patch`, to be edited from now on."""
    changed = Signal()
    """Name or unsaved mark may have changed."""
    said = Signal(str)

    def __init__(self, registry: Registry, settings: Settings, folder: Path, window: QWidget) -> None:
        super().__init__(window)
        self.patch = Patch()
        self.path: Path | None = None
        self.keeps_unsaved = False
        self._saved = self.patch
        self._registry, self._settings, self._window = registry, settings, window
        self._autosave = Autosave(folder)
        self._writer = ThreadPoolExecutor(1, "autosave")
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(AUTOSAVE_MS)
        self._timer.timeout.connect(self.keep)

    @property
    def is_saved(self) -> bool:
        return self.patch == self._saved

    @property
    def name(self) -> str:
        """What the title shows: the patch's own title, else its file's name."""
        return self.patch.title or (self.path.stem if self.path else "Untitled")

    def take(self, patch: Patch) -> None:
        """The patch after an edit."""
        self.patch = patch
        self._timer.start()
        self.changed.emit()

    # --- begin ---

    def begin(self, path: Path | None, otherwise: Patch) -> None:
        """At the start: what a crash left, else the file that was asked for, else this patch."""
        rescued = self._autosave.rescue(self._registry)
        if path is not None and self.read(path):
            if rescued is not None:
                self._autosave.put_aside()
                self.said.emit("Unsaved work of last time waits until the window is opened without a file.")
        elif rescued is not None:
            self._begin_with(rescued.patch, rescued.path, saved=self._on_disk(rescued.path))
            self.said.emit("Last time the window did not close by itself: here is the work as it was.")
        else:
            self._begin_with(otherwise, None, saved=otherwise)

    def read(self, path: Path) -> bool:
        """Open the patch in a file; a file that cannot be is said, and nothing changes."""
        try:
            patch = Patch.load(path, self._registry)
        except UnderfootError as error:
            self.said.emit(str(error))
            return False
        self._begin_with(patch, path, saved=patch)
        self._settings.remember_file(path)
        return True

    def _begin_with(self, patch: Patch, path: Path | None, saved: Patch) -> None:
        self.patch, self.path, self._saved = patch, path, saved
        self.opened.emit(patch)
        self.changed.emit()
        self._timer.start()

    def _on_disk(self, path: Path | None) -> Patch:
        try:
            return Patch.load(path, self._registry) if path else Patch()
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
            self.when_safe(lambda: self.ask_file("Open a patch", FILTER, self.read))

    def use(self, path: Path) -> None:
        """Begin with a copy of the patch in a file, such as a preset."""
        self.when_safe(lambda: self._copy(path))

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

        self.ask_file("Save the patch", FILTER, write, save=True)

    def _copy(self, path: Path) -> None:
        try:
            patch = Patch.load(path, self._registry)
        except UnderfootError as error:
            self.said.emit(str(error))
        else:
            self._begin_with(patch, None, saved=patch)

    def _write(self, path: Path) -> bool:
        try:
            self.patch.save(path)
        except UnderfootError as error:
            self.said.emit(str(error))
            return False
        self.path, self._saved = path, self.patch
        self._settings.remember_file(path)
        self._timer.start()
        self.said.emit(f"Saved as {path}")
        self.changed.emit()
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

    def _answered(self, answer: _Answer, then: Callable[[], object]) -> None:
        if answer == _Answer.Save:
            self.save(then)
        elif answer == _Answer.Discard:
            self._saved = self.patch
            then()

    def ask_file(self, title: str, filter: str, then: Callable[[Path], object], *, save: bool = False) -> None:
        """Ask for a file, and go on with it; an error of ours is said."""

        def chosen(name: str) -> None:
            try:
                then(Path(name))
            except UnderfootError as error:
                self.said.emit(str(error))

        dialog = QFileDialog(self._window, title, self._settings.folder, filter)
        dialog.setFileMode(QFileDialog.FileMode.AnyFile if save else QFileDialog.FileMode.ExistingFile)
        if save:
            dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
            dialog.setDefaultSuffix("json")
            dialog.selectFile(f"{self.name}.json")
        dialog.fileSelected.connect(chosen)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    # --- the copy ---

    def keep(self) -> None:
        """Write unsaved work down, or take the copy away where all is saved: in a thread, for disks can be slow."""
        if self.is_saved:
            self._writer.submit(self._autosave.forget)
        else:
            self._writer.submit(self._autosave.keep, self.patch, self.path)

    def close(self) -> None:
        """The window closes. Unsaved work is forgotten, for the person was asked; or kept, if nobody was."""
        self._timer.stop()
        if self.keeps_unsaved:
            self.keep()
        else:
            self._writer.submit(self._autosave.forget)
        self._writer.shutdown()
        self._autosave.close()
