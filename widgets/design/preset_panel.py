"""The presets beside the canvas: found by words, seen, heard as one goes through them, and opened."""

from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QMessageBox, QToolButton, QVBoxLayout, QWidget

from underfoot.engine.preset_pictures import PresetPicture
from underfoot.patch.preset_files import Preset, all_presets, ranked
from underfoot.widgets import theme
from underfoot.widgets.controls.trash import moved_to_trash
from underfoot.widgets.design.node_list import SearchField
from underfoot.widgets.design.preset_list import PresetList, in_words
from underfoot.widgets.design.preset_pictures import PresetPictures

REST_MS = 150
"""A preset is heard when one has rested on it for so long."""
_SHOWS = {"All": "All presets", "★": "Those with a star", "Mine": "Presets that you saved"}


class PresetPanel(QWidget):
    """`chosen` gives the preset to be opened; `heard` the one to be played meanwhile, or None for the patch itself.

    `bind` says where the person's own presets lie, and which files have a star.
    """

    chosen = Signal(object)
    heard = Signal(object)
    said = Signal(str)
    left = Signal()
    """Escape was pressed: whoever has nothing more to do here goes on elsewhere."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._own: Path | None = None
        self._stars: list[str] = []
        self._presets: list[Preset] = []
        self._known: dict[Path, PresetPicture] = {}
        self._heard: Preset | None = None
        self.pictures = PresetPictures(self)
        self.pictures.arrived.connect(self._show_picture)
        self.field = SearchField("Search presets", self, closes=True)
        self.list = PresetList(self)
        self.about = theme.label("", "small")
        self.about.setWordWrap(True)
        self.about.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.shows = QButtonGroup(self)
        self.hears = QToolButton(self)
        self.hears.setText("Hear")
        self.hears.setCheckable(True)
        theme.set_role(self.hears, "chip")
        self.hears.setChecked(True)
        self.hears.setToolTip("Play a preset while you go through the list; Esc goes back to your patch")
        self._lay_out()
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self._hear)
        self.field.textChanged.connect(self._narrow)
        self.field.stepped.connect(self.list.step)
        self.field.entered.connect(self._enter)
        self.field.left.connect(self._leave_field)
        self.shows.buttonClicked.connect(lambda _: self._narrow())
        self.list.moved.connect(self._moved)
        self.list.chosen.connect(self._choose)
        self.list.starred.connect(self._star)
        self.list.unwanted.connect(self._ask_to_remove)
        self.list.left.connect(self.end_hearing)
        self.list.left.connect(self.left)

    def bind(self, own: Path, stars: list[str]) -> None:
        """`own` is the folder of the person's own presets; `stars`, the files with a star, is kept up to date."""
        self._own, self._stars = own, stars

    def refresh(self) -> None:
        """Look at the folders again: what was saved or taken away meanwhile shows."""
        self._presets = all_presets(self._own)
        self._narrow()
        self.pictures.ask([preset.path for preset in self._presets])

    def reveal(self, path: Path) -> None:
        """Show a preset that was saved just now."""
        self.pictures.forget(path)
        self.field.clear()
        self.shows.buttons()[0].setChecked(True)
        self.refresh()

    def end_hearing(self) -> None:
        """Let the patch itself be heard again."""
        self._rest.stop()
        if self._heard is not None:
            self._heard = None
            self.heard.emit(None)

    def close_down(self) -> None:
        """End what computes pictures."""
        self.pictures.close()

    # --- inside ---

    def _lay_out(self) -> None:
        chips = QHBoxLayout()
        chips.setSpacing(4)
        for text, tip in _SHOWS.items():
            button = QToolButton(self)
            button.setText(text)
            button.setToolTip(tip)
            button.setCheckable(True)
            theme.set_role(button, "chip")
            self.shows.addButton(button)
            chips.addWidget(button)
        self.shows.buttons()[0].setChecked(True)
        chips.addStretch(1)
        chips.addWidget(self.hears)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 0, 4, 8)
        column.setSpacing(4)
        column.addWidget(self.field)
        column.addLayout(chips)
        column.addWidget(self.list, 1)
        column.addWidget(self.about)

    def _narrow(self, _: str = "") -> None:
        which = next(button.text() for button in self.shows.buttons() if button.isChecked())
        fitting = [
            preset
            for preset in self._presets
            if (which != "★" or str(preset.path) in self._stars) and (which != "Mine" or preset.is_user_preset)
        ]
        fitting = ranked(fitting, self.field.text())
        self.list.show_presets(fitting, self._known, self._stars, headed=not self.field.text())
        self.list.setVisible(bool(fitting))
        self.about.setText("" if fitting else self._nothing(which))

    def _nothing(self, which: str) -> str:
        if self.field.text():
            return "No preset has these words."
        return {
            "★": "A click on the star at a preset's end keeps it here.",
            "Mine": "Save as preset, in the menu, puts your patch here.",
        }.get(which, "")

    def _show_picture(self, path: Path, picture: PresetPicture) -> None:
        self._known[path] = picture
        self.list.show_picture(path, picture)

    def _moved(self, preset: Preset) -> None:
        self.about.setText(in_words(preset, self._known.get(preset.path)))
        if self.hears.isChecked():
            self._rest.start()

    def _hear(self) -> None:
        self._heard = self.list.current()
        if self._heard is not None:
            self.heard.emit(self._heard)
            self.said.emit(f"Hearing {self._heard.title}. Enter opens it, Esc goes back to your patch.")

    def _enter(self) -> None:
        current = self.list.current()
        if current is None and self.list.presets():
            current = self.list.presets()[0]
        if current is not None:
            self._choose(current)

    def _choose(self, preset: Preset) -> None:
        self._rest.stop()
        self._heard = None
        self.chosen.emit(preset)

    def _leave_field(self) -> None:
        if not self.list.hasFocus():
            self.end_hearing()
        if self.field.hasFocus():
            self.left.emit()

    def _star(self, preset: Preset) -> None:
        path = str(preset.path)
        if path in self._stars:
            self._stars.remove(path)
        else:
            self._stars.append(path)
        self._narrow()

    def _ask_to_remove(self, preset: Preset) -> None:
        if not preset.is_user_preset:
            self.said.emit(f"{preset.title} came with the program and stays; only your own presets can be deleted")
            return
        box = QMessageBox(self.window())
        box.setWindowTitle("Delete preset")
        box.setText(f"Delete the preset “{preset.title}”? Its file goes to the trash.")
        box.setStandardButtons(QMessageBox.StandardButton.Yes | QMessageBox.StandardButton.Cancel)
        box.setDefaultButton(QMessageBox.StandardButton.Cancel)
        box.button(QMessageBox.StandardButton.Yes).setText("Delete")
        box.accepted.connect(lambda: self._remove(preset))
        box.finished.connect(box.deleteLater)
        box.open()

    def _remove(self, preset: Preset) -> None:
        self.end_hearing()
        if not moved_to_trash(preset.path):
            self.said.emit(f"{preset.path} could not be moved to the trash; delete it by hand")
        self.refresh()
