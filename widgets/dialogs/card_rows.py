"""The sound cards of a floor, a line each: which device, and how many of its channels."""

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QPushButton, QSpinBox, QVBoxLayout, QWidget

from underfoot.devices.outputs import MOST_CARDS, Output, outputs_of, text_of
from underfoot.devices.sound import MAX_CHANNELS, Card
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.tab_order import set_tab_order


class CardRow(QWidget):
    """One card. The first may be "no sound"; a further one has a button that takes it away."""

    changed = Signal()

    def __init__(self, is_first: bool) -> None:
        super().__init__()
        self.device_box, self.channels, self.remove_button = QComboBox(), QSpinBox(), QPushButton("Remove")
        self.device_box.setAccessibleName("Sound card")
        self.device_box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.device_box.addItem("Default device of this computer", "")
        if is_first:
            self.device_box.addItem("No sound", None)
        self.channels.setAccessibleName("Channels of this card")
        self.channels.setToolTip("How many channels of this card are used; the tiles behind them play on the next card")
        self.channels.setRange(0, MAX_CHANNELS)
        self.channels.setSpecialValueText("all channels")
        self.channels.setSuffix(" channels")
        self.channels.lineEdit().setTextMargins(theme.GRID, 0, theme.GRID, 0)
        self.remove_button.setAutoDefault(False)
        self.remove_button.setVisible(not is_first)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(theme.GRID)
        layout.addWidget(self.device_box, 1)
        layout.addWidget(self.channels)
        layout.addWidget(self.remove_button)
        self.device_box.currentIndexChanged.connect(self.changed)
        self.channels.valueChanged.connect(self.changed)

    def output(self) -> Output:
        """Return the chosen card."""
        return Output(self.device_box.currentData() or "", self.channels.value())

    def show_output(self, name: str | None, channels: int) -> None:
        """Choose a card, also one that is not there."""
        if index_of(self.device_box, name) < 0:
            self.device_box.addItem(str(name), name)
        self.device_box.setCurrentIndex(max(0, index_of(self.device_box, name)))
        self.channels.setValue(channels)

    def show_cards(self, cards: Sequence[Card]) -> None:
        """Offer the cards that there are."""
        known = [card.name for card in cards]
        for index in range(self.device_box.count()):
            name = self.device_box.itemData(index)
            if name and name not in known:
                self.device_box.setItemText(index, f"{name} (not connected)")
        for card in cards:
            text = f"{card.name}  ·  {counted(card.channels, 'channel')}, {card.rate_hz / 1000:g} kHz"
            index = index_of(self.device_box, card.name)
            if index < 0:
                self.device_box.addItem(text, card.name)
            else:
                self.device_box.setItemText(index, text)


class CardRows(QWidget):
    """All cards, the first of which sets the clock, and a button for one more."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[CardRow] = []
        self._cards: Sequence[Card] = ()
        self.add_button = QPushButton("Add a card")
        self.add_button.setAutoDefault(False)
        self.add_button.setToolTip("For floors of more tiles than one card has channels; each card keeps its own clock")
        self.add_button.clicked.connect(lambda: self._add())
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(theme.GRID)
        foot = QHBoxLayout()
        self.search_again = QPushButton("Look again")
        self.search_again.setAutoDefault(False)
        self.search_again.setToolTip(
            "Look which cards there are now; a card that was plugged in since is on the list then"
        )
        foot.addWidget(self.add_button)
        foot.addWidget(self.search_again)
        foot.addStretch(1)
        self._add()
        self._layout.addLayout(foot)

    @property
    def text(self) -> str | None:
        """The cards as `outputs_of` reads them; None for no sound. A card that is there twice counts once."""
        if self.rows[0].device_box.currentData() is None:
            return None
        return text_of(list({output.name: output for output in (row.output() for row in self.rows)}.values()))

    def show_text(self, text: str | None) -> None:
        """Show the cards that are in use."""
        outputs = outputs_of(text or "")
        while len(self.rows) > len(outputs):
            self._remove(self.rows[-1])
        while len(self.rows) < len(outputs):
            self._add()
        for row, output in zip(self.rows, outputs, strict=True):
            row.show_output(output.name if text is not None else None, output.channels)

    def show_cards(self, cards: Sequence[Card]) -> None:
        """Offer the cards that there are."""
        self._cards = cards
        for row in self.rows:
            row.show_cards(cards)

    def _add(self) -> None:
        row = CardRow(is_first=not self.rows)
        row.show_cards(self._cards)
        row.changed.connect(self.changed)
        row.remove_button.clicked.connect(lambda: self._remove(row))
        self._layout.insertWidget(len(self.rows), row)
        self.rows.append(row)
        parts = [part for one in self.rows for part in (one.device_box, one.channels, one.remove_button)]
        if len(self.rows) > 1:  # the first is made before the buttons
            set_tab_order((*parts, self.add_button, self.search_again))
        taken = {row.device_box.currentData() for row in self.rows[:-1]}
        free = next((card.name for card in self._cards if card.name not in taken), None)
        if len(self.rows) > 1 and free is not None:
            row.show_output(free, 0)
        self.add_button.setEnabled(len(self.rows) < MOST_CARDS)
        self.changed.emit()

    def _remove(self, row: CardRow) -> None:
        self.rows.remove(row)
        row.setParent(None)
        row.deleteLater()
        self.add_button.setEnabled(True)
        self.changed.emit()


def index_of(box: QComboBox, value: object) -> int:
    """Return the index of `value` in a combo box; Qt's own search does not tell None from ""."""
    return next((i for i in range(box.count()) if box.itemData(i) == value), -1)
