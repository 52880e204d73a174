"""Connects the list of presets with the open patch: listening to, opening and saving presets."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtWidgets import QDialogButtonBox, QFormLayout, QLineEdit, QWidget

from underfoot.errors import UnderfootError
from underfoot.files import make_folder, write_file
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.groups import LONGEST_LABEL, Group
from underfoot.patch.patch import Patch
from underfoot.patch.preset_files import Preset, file_of
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.menu import add_action
from underfoot.widgets.controls.question import ask
from underfoot.widgets.design.preset_drops import PresetDrops
from underfoot.widgets.design.side_panel import PRESETS, SidePanel
from underfoot.widgets.workspace import WorkspaceContext


class PresetBrowsing(QObject):
    """Connects the preset panel with the open patch and its playback. `folder` is that of the user's presets."""

    inserted = Signal(object, str)
    """Carries a patch to insert into the open one, and its title."""

    def __init__(self, side: SidePanel, context: WorkspaceContext, folder: Path) -> None:
        super().__init__(side)
        self._side, self._context, self.folder = side, context, folder
        panel, self._notify = side.presets, side.presets.notified.emit
        panel.bind(folder, context.settings.stars)
        panel.audition_changed.connect(self._audition)
        panel.chosen.connect(lambda preset: self.open(preset.path))
        panel.insertion_requested.connect(lambda preset: self.insert(preset.path))
        add = partial(add_action, side, where=Qt.ShortcutContext.WindowShortcut)
        self.show_action = add("Presets beside the canvas", "Ctrl+P", partial(side.show_page, PRESETS))
        self.save_action = add("Save as preset…", "Ctrl+Alt+S", self.ask_to_save)

    def accept_drops(
        self, canvas: QWidget, slots: Mapping[str, QWidget], open_in_other: Callable[[Path], object]
    ) -> None:
        """Open a preset that is dropped on the canvas, or on a slot, in that slot."""

        def open_in(slot: str, path: Path) -> None:
            (self.open if slot == self._context.open_patch.slot else open_in_other)(path)

        drops = PresetDrops(self)
        drops.accept_on(canvas, self.open)
        for slot, button in slots.items():
            drops.accept_on(button, partial(open_in, slot))

    def ask_to_save(self) -> None:
        """Ask for the name of the patch as a preset of the user's, and write it."""
        dialog = PresetDialog(self._context.open_patch.patch, self._side.window())
        dialog.accepted.connect(lambda: self._save(dialog.named()))
        dialog.open()

    def _audition(self, preset: Preset | None) -> None:
        listening = self._context.listening
        if preset is None:
            listening.play_preset(None)
            return
        path = preset.path
        self._context.open_patch.nodes.when_patch_allowed(path, lambda: self._play(path))

    def _play(self, path: Path) -> None:
        try:
            patch = Patch.load(path, self._context.registry)
        except UnderfootError as error:
            self._notify(str(error))
            return
        self._context.listening.play_preset(with_files_kept(patch, self._context.registry, path.parent, None))

    def open(self, path: Path) -> None:
        """Open a preset in the edited slot, as an undoable step."""
        self._side.presets.end_audition()
        self._context.listening.play_preset(None)
        self._context.open_patch.open_preset(path)

    def insert(self, path: Path) -> None:
        """Insert a preset into the open patch, as a sub-patch."""
        self._context.open_patch.nodes.when_patch_allowed(path, lambda: self._insert(path))

    def _insert(self, path: Path) -> None:
        registry, folder = self._context.registry, self._context.open_patch.folder
        try:
            patch = with_files_kept(Patch.load(path, registry), registry, path.parent, folder)
        except UnderfootError as error:
            self._notify(str(error))
            return
        title = patch.title or path.stem
        if patch.canvas_items():
            self.inserted.emit(as_sub_patch(patch, title), title)
        else:
            self._notify(f"“{title}” is an empty patch: there is nothing to insert")

    def _save(self, patch: Patch) -> None:
        path = file_of(patch.title, self.folder)
        if not path.exists():
            self._write(patch, path)
            return
        text = f"There is a preset “{patch.title}” already. Replace it?"
        ask(self._side.window(), "Save as preset", text, "Replace", partial(self._write, patch, path))

    def _write(self, patch: Patch, path: Path) -> None:
        try:
            make_folder(self.folder)
            open_patch = self._context.open_patch
            kept = with_files_kept(patch, self._context.registry, open_patch.folder, self.folder)
            write_file(path, kept.dumps())  # unchecked, as the patch's own file
        except UnderfootError as error:
            self._notify(str(error))
            return
        self._side.show_page(PRESETS)
        self._side.presets.show_saved(path)
        left = open_patch.nodes.copy_node_files(patch, open_patch.folder, self.folder)
        self._notify(f"Saved as the preset “{patch.title}”; it is under My presets{left}")


def as_sub_patch(patch: Patch, title: str) -> Patch:
    """Return the patch, which is not empty, with all nodes in a collapsed group of this title, cut if too long."""
    items = patch.canvas_items()
    at = min(item.at[0] for item in items), min(item.at[1] for item in items)
    ids, title = tuple(item.id for item in items), title[:LONGEST_LABEL]
    whole = Group(patch.free_id("preset"), ids, title, collapsed=True, at=at)
    return replace(patch, groups=(whole, *patch.groups))


class PresetDialog(Dialog):
    """Fields for a preset's title and description."""

    def __init__(self, patch: Patch, parent: QWidget | None = None) -> None:
        super().__init__("Save as preset", parent)
        self._patch = patch
        self.title, self.comment = QLineEdit(patch.title), QLineEdit(patch.comment)
        self.comment.setCursorPosition(0)
        self.tags, self.author = QLineEdit(", ".join(patch.tags)), QLineEdit(patch.author)
        self.tags.setPlaceholderText("words to be found by, with commas between")
        self.comment.setPlaceholderText("what it feels like")
        form = QFormLayout()
        form.setHorizontalSpacing(2 * theme.GRID)
        form.setVerticalSpacing(theme.GRID)
        for name, field in (
            ("&Title", self.title),
            ("Co&mment", self.comment),
            ("Ta&gs", self.tags),
            ("&Author", self.author),
        ):
            form.addRow(name, field)
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Save, QDialogButtonBox.StandardButton.Cancel)
        layout = self.column()
        layout.addLayout(form)
        layout.addWidget(self.buttons)
        self.resize(56 * theme.GRID, 10)
        self.title.textChanged.connect(self._check)
        self._check()
        self.title.selectAll()

    def named(self) -> Patch:
        """Return the patch with the typed texts."""
        tags = tuple(dict.fromkeys(tag.strip() for tag in self.tags.text().split(",") if tag.strip()))
        return replace(
            self._patch,
            title=self.title.text().strip(),
            comment=self.comment.text().strip(),
            tags=tags,
            author=self.author.text().strip(),
        )

    def _check(self) -> None:
        self.buttons.button(QDialogButtonBox.StandardButton.Save).setEnabled(bool(self.title.text().strip()))
