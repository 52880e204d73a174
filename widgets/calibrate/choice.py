"""The choice of a calibration: the tile, the procedures with the state of its profile, and its history."""

from collections.abc import Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QButtonGroup,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.floor.layout import Floor
from underfoot.floor.profile import Part, Profile
from underfoot.widgets import theme
from underfoot.widgets.calibrate.quantity_views import error_text, part_text
from underfoot.widgets.calibrate.tile_picture import tile_text
from underfoot.widgets.controls.fields import Field
from underfoot.widgets.controls.scrolled import scroll_area
from underfoot.widgets.floor_map import FloorMap

WIDTH_PX = 34 * theme.GRID


class ChoicePanel(QWidget):
    """Shows a floor and one tile's profile; signals the choice."""

    tile_chosen = Signal(str)
    kind_chosen = Signal(str)
    earlier_chosen = Signal(int)
    """Index among the profile's earlier parts of the one to compare with; -1 for none."""
    restore_requested = Signal(int)
    serial_given = Signal(str)
    plate_search_requested = Signal()
    """Open the search for plates for the chosen tile."""

    def __init__(self, kinds: Sequence[tuple[str, str]], parent: QWidget) -> None:
        super().__init__(parent)
        theme.fill(self, "panel")
        self.setFixedWidth(WIDTH_PX)
        self.map = FloorMap()
        self.map.setFixedHeight(21 * theme.GRID)
        self.map.setToolTip("Click a tile, or choose one with the arrow keys")
        self._tile, self.flags = theme.label("", "muted"), theme.label("", "force")
        theme.wrap(self._tile, self.flags)
        self.serial = Field(role="")
        self.serial.setPlaceholderText("Serial number")
        self.serial.setAccessibleName("Serial number of the tile")
        self.serial.setToolTip("The tile's serial number, for its profile and reports")
        self.conditions = Field(role="")
        self.conditions.setPlaceholderText("Instruments, temperature")
        self.conditions.setAccessibleName("Conditions of calibrations")
        self.conditions.setToolTip("Instruments, temperature: goes with the next results. Return: it is so today")
        self.cards: dict[str, KindCard] = {}
        self._group = QButtonGroup(self)
        self.history = QListWidget()
        self.history.setAccessibleName("Earlier calibrations")
        self.history.setToolTip("Select one to compare it with the one in use")
        self.restore = QPushButton("Use this one again")
        self.restore.setToolTip("Use the selected calibration from now on; the one in use is kept as an earlier one")
        self._none = theme.label("None yet", "small")
        self._indices: list[int] = []
        inside, foot = self._lay_out()
        layout = QVBoxLayout(inside)
        layout.setContentsMargins(2 * theme.GRID, theme.GRID, 2 * theme.GRID, 0)
        layout.setSpacing(theme.GRID)
        layout.addWidget(theme.label("TILE", "heading"))
        layout.addWidget(self.map)
        layout.addWidget(self._tile)
        layout.addWidget(self.serial)
        layout.addWidget(self.conditions)
        layout.addWidget(theme.label("CALIBRATION", "heading"))
        for key, name in kinds:
            card = KindCard(name)
            card.clicked.connect(lambda _=False, key=key: self.kind_chosen.emit(key))
            self._group.addButton(card)
            card.setAutoExclusive(True)  # a screen reader's radio button, no check box
            self.cards[key] = card
            layout.addWidget(card)
        layout.addWidget(self.flags)
        layout.addWidget(theme.label("EARLIER CALIBRATIONS", "heading"))
        layout.addWidget(self._none)
        layout.addWidget(self.history, 1)
        layout.addWidget(self.restore)
        layout.addStretch()
        self.plates = QPushButton("Which plates fit…")
        self.plates.setToolTip("Search modulus and thickness of a plate for this tile, before it is built")
        self.plates.clicked.connect(self.plate_search_requested)
        foot.addWidget(self.plates)
        self.map.tile_chosen.connect(self.tile_chosen)
        self.history.currentRowChanged.connect(self._compare)
        self.restore.clicked.connect(self._restore)
        self.serial.committed.connect(lambda text: self.serial_given.emit(text.strip()))
        self.setFocusProxy(self.map)

    def _lay_out(self) -> tuple[QWidget, QHBoxLayout]:
        """Return the empty page, which scrolls if the window is too low, and the line below it, which stays visible."""
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        area, inside = scroll_area(), QWidget()
        column.addWidget(area, 1)
        area.setWidget(inside)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        foot = QHBoxLayout()
        foot.setContentsMargins(2 * theme.GRID, theme.GRID, 2 * theme.GRID, theme.GRID)
        column.addLayout(foot)
        return inside, foot

    def set_floor(self, floor: Floor) -> None:
        """Show the tiles of a floor; the first is chosen."""
        self._floor = floor
        self.map.set_floor(floor)

    def show_profile(self, profile: Profile, kind: str, flags: Sequence[str]) -> None:
        """Show the profile that the chosen tile uses, and the history of its part `kind`."""
        tile = self._floor.tiles[self._floor.index(self.map.chosen_tile())]
        self._tile.setText(tile_text(tile))
        self.serial.show_text(profile.serial)
        for key, card in self.cards.items():
            card.show_part(profile.part(key))
        self.cards[kind].setChecked(True)
        self.flags.setText("\n".join(f"{flag[:1].upper()}{flag[1:]}." for flag in flags))
        self.flags.setVisible(bool(flags))
        self._indices = [i for i, earlier in enumerate(profile.earlier) if earlier.kind == kind][::-1]
        with QSignalBlocker(self.history):
            self.history.clear()
            for index in self._indices:
                part: Part = getattr(profile.earlier[index], kind)
                self.history.addItem(part_text(part))
                self.history.item(self.history.count() - 1).setToolTip(part.identity)
            self.history.setCurrentRow(-1)
        self.history.setVisible(bool(self._indices))
        self._none.setVisible(not self._indices)
        self.restore.setVisible(bool(self._indices))
        self.restore.setEnabled(False)

    def _restore(self) -> None:
        self.restore.setEnabled(False)  # a second click would be meant for the list as it was
        self.restore_requested.emit(self._indices[self.history.currentRow()])

    def _compare(self, row: int) -> None:
        self.restore.setEnabled(row >= 0)
        self.earlier_chosen.emit(self._indices[row] if row >= 0 else -1)


class KindCard(QPushButton):
    """A procedure's name, above the state of the profile."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setProperty("role", "tab")
        self.setCheckable(True)
        self.setStyleSheet(f"QPushButton {{ min-height: {5 * theme.GRID}px; }}")
        self._name, self._title = name, QLabel(name)
        self._made, self._state = theme.label("", "small"), theme.label("", "small")
        layout = QGridLayout(self)
        layout.setContentsMargins(theme.GRID, theme.GRID // 2, theme.GRID, theme.GRID // 2)
        layout.setSpacing(0)
        layout.setColumnStretch(0, 1)
        for label in (self._title, self._made, self._state):
            label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        layout.addWidget(self._title, 0, 0)
        layout.addWidget(self._made, 0, 1)
        layout.addWidget(self._state, 1, 0, 1, 2)

    def show_part(self, part: Part | None) -> None:
        """Show the part of the profile that this procedure makes."""
        text = part_text(part)
        self._made.setText("" if part is None else part.made)
        self._state.setText(error_text(part))
        theme.set_role(self._state, "small" if part is None or part.good else "alarm")
        self.setAccessibleName(f"{self._name}: {text}")
        self.setToolTip(text if part is None else f"{part.verdict or text}\n{part.identity}")

    def visible_text(self) -> str:
        """Return the text beside and under the name."""
        return f"{self._made.text()} {self._state.text()}".strip()
