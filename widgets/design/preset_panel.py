"""The panel of presets beside the canvas: search, pictures, listening, opening."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QVBoxLayout, QWidget

from underfoot.engine.preset_pictures import PresetPicture
from underfoot.patch.preset_files import Preset, all_presets, ranked
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.panels import chip, one_of_several
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.trash import move_to_trash
from underfoot.widgets.design.node_list import SearchField
from underfoot.widgets.design.preset_list import PresetList, tooltip_text
from underfoot.widgets.design.preset_pictures import PresetPictures

AUDITION_DELAY_MS = 150
"""Time after which the current preset is played."""
_FILTERS = {"All": "All presets", "★": "Those with a star", "Mine": "Presets that you saved"}


class PresetPanel(QWidget):
    """`chosen` carries the preset to open; `audition_changed` the one to play, None for the patch itself.

    `bind` sets the folder of the user's presets, and the list of starred files.
    """

    chosen = Signal(object)
    insertion_requested = Signal(object)
    """A preset to insert into the open patch."""
    audition_changed = Signal(object)
    notified = Signal(str)
    escaped = Signal()
    """Escape was pressed; the focus can go elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self._own_folder: Path | None = None
        self._stars: list[str] = []
        self._presets: list[Preset] = []
        self._pictures: dict[Path, PresetPicture] = {}
        self._auditioned: Preset | None = None
        self.pictures = PresetPictures(self)
        self.pictures.arrived.connect(self._show_picture)
        self.field = SearchField("Search presets", self, closes=True)
        self.list = PresetList(self)
        self.about = theme.paragraph("", "small")
        self.about.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.filters = QButtonGroup(self)
        tip = "Play a preset while you go through the list; Esc goes back to your patch"
        self.audition_button = chip("Hear", tip, self, checked=True)
        self._lay_out()
        self._audition_timer = QTimer(self, singleShot=True, interval=AUDITION_DELAY_MS)
        self._audition_timer.timeout.connect(self._audition)
        self.field.textChanged.connect(self._filter)
        self.field.stepped.connect(self.list.step)
        self.field.return_pressed.connect(self._enter)
        self.field.escaped.connect(self._leave_field)
        self.filters.buttonClicked.connect(lambda _: self._filter())
        self.list.current_changed.connect(self._moved)
        self.list.chosen.connect(self._choose)
        self.list.insertion_requested.connect(self._insert)
        self.list.starred.connect(self._toggle_star)
        self.list.deletion_requested.connect(self._ask_to_remove)
        self.list.escaped.connect(self.end_audition)
        self.list.escaped.connect(self.escaped)

    def bind(self, own_folder: Path, stars: list[str]) -> None:
        """Set the folder of the user's presets; `stars`, the starred files, is updated in place."""
        self._own_folder, self._stars = own_folder, stars

    def refresh(self) -> None:
        """Reload the folders, to show saved and deleted presets."""
        self._presets = all_presets(self._own_folder)
        self._filter()
        self.pictures.ask([preset.path for preset in self._presets])

    def show_saved(self, path: Path) -> None:
        """Show a preset that has just been saved."""
        self.pictures.forget(path)
        self.field.clear()
        self.filters.buttons()[0].setChecked(True)
        self.refresh()

    def end_audition(self) -> None:
        """Play the patch itself again."""
        self._audition_timer.stop()
        if self._auditioned is not None:
            self._auditioned = None
            self.audition_changed.emit(None)
            self.notified.emit("Hearing your patch again.")

    def close_down(self) -> None:
        """Stop the computation of pictures."""
        self.pictures.close()

    # --- inside ---

    def _lay_out(self) -> None:
        chips = QHBoxLayout()
        chips.setSpacing(4)
        for text, tip in _FILTERS.items():
            button = one_of_several(text, tip, "chip", self)
            button.setAccessibleName(tip)
            self.filters.addButton(button)
            chips.addWidget(button)
        self.filters.buttons()[0].setChecked(True)
        chips.addStretch(1)
        chips.addWidget(self.audition_button)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 4, 8)
        column.setSpacing(4)
        column.addWidget(self.field)
        column.addLayout(chips)
        column.addWidget(self.list, 1)
        column.addWidget(self.about)

    def _filter(self, _: str = "") -> None:
        which = next(button.text() for button in self.filters.buttons() if button.isChecked())
        fitting = [
            preset
            for preset in self._presets
            if (which != "★" or str(preset.path) in self._stars) and (which != "Mine" or preset.is_user_preset)
        ]
        fitting = ranked(fitting, self.field.text())
        self.list.show_presets(fitting, self._pictures, self._stars, headed=not self.field.text())
        self.list.setVisible(bool(fitting))
        self.about.setText("" if fitting else self._empty_text(which))

    def _empty_text(self, which: str) -> str:
        if self.field.text():
            return "No preset has these words."
        return {
            "★": "A click on the star at a preset's end keeps it here.",
            "Mine": "Save as preset, in the menu, puts your patch here.",
        }.get(which, "")

    def _show_picture(self, path: Path, picture: PresetPicture) -> None:
        self._pictures[path] = picture
        self.list.show_picture(path, picture)

    def _moved(self, preset: Preset) -> None:
        self.about.setText(tooltip_text(preset, self._pictures.get(preset.path)))
        if self.audition_button.isChecked():
            self._audition_timer.start()

    def _audition(self) -> None:
        self._auditioned = self.list.current()
        if self._auditioned is not None:
            self.audition_changed.emit(self._auditioned)
            keys = with_native_keys("Enter opens it, Shift+Enter puts it into your patch, Esc goes back.")
            self.notified.emit(f"Hearing {self._auditioned.title}. {keys}")

    def _enter(self, with_shift: bool) -> None:
        """Open the current preset, or else the first; with Shift, insert it into the patch."""
        meant = self.list.current() or next(iter(self.list.presets()), None)
        if meant is not None:
            (self._insert if with_shift else self._choose)(meant)

    def _insert(self, preset: Preset) -> None:
        self.end_audition()
        self.insertion_requested.emit(preset)

    def _choose(self, preset: Preset) -> None:
        self._audition_timer.stop()
        self._auditioned = None
        self.notified.emit(f"{preset.title}: undo brings your patch back.")
        self.chosen.emit(preset)  # which shows the error, if it cannot be opened

    def _leave_field(self) -> None:
        if not self.list.hasFocus():
            self.end_audition()
        if self.field.hasFocus():
            self.escaped.emit()

    def _toggle_star(self, preset: Preset) -> None:
        path = str(preset.path)
        if path in self._stars:
            self._stars.remove(path)
        else:
            self._stars.append(path)
        self._filter()

    def _ask_to_remove(self, preset: Preset) -> None:
        if not preset.is_user_preset:
            self.notified.emit(f"{preset.title} came with the program and stays; only your own presets can be deleted")
            return
        text = f"Delete the preset “{preset.title}”? Its file goes to the trash."
        ask(self.window(), "Delete preset", text, "Delete", partial(self._remove, preset))

    def _remove(self, preset: Preset) -> None:
        self.end_audition()
        if not move_to_trash(preset.path):
            self.notified.emit(f"{preset.path} could not be moved to the trash; delete it by hand")
        self.refresh()
