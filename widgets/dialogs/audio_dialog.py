"""The audio dialog: which cards play, how fast and in which blocks, and which tile is on which channel."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import Signal
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import (
    QComboBox,
    QDialogButtonBox,
    QFormLayout,
    QGridLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QWidget,
)

from underfoot.devices.accelerometers import FORM, accelerometers_of
from underfoot.devices.outputs import outputs_of
from underfoot.devices.sound import MAX_CHANNELS, Card
from underfoot.errors import BadValue
from underfoot.floor.layout import Floor
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.dialogs.card_rows import CardRows, index_of

RATES_HZ = (44_100, 48_000, 96_000)
BLOCKS = (32, 64, 128, 256, 512, 1024)

_COLUMNS = 6


class AudioDialog(Dialog):
    """Edits device, rate and block; Apply emits them. The tiles' buttons ask for a pulse at once.

    `find` looks for sound devices, which can take a second: it runs in a thread, when the dialog is opened and at each
    "Look again". When the dialog is closed `cancel_search` lets it come back at once.
    """

    applied = Signal(object, int, int, str)
    """Device (None: no sound, "": the default one, else its name), rate in Hz, frames in a block, accelerometers."""
    pulse_requested = Signal(str)
    """The tile on which a pulse should play."""

    def __init__(
        self,
        find: Callable[[], Sequence[Card]],
        cancel_search: Callable[[], None],
        floor: Floor,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__("Audio", parent)
        self.devices: list[Card] | None = None
        self.cards, self.rate, self.block = CardRows(), QComboBox(), QComboBox()
        self.accelerometers = QLineEdit()
        self.accelerometers.setPlaceholderText("none")
        self.accelerometers.setToolTip(
            f"Accelerometers on inputs of this device, with spaces between: {FORM}. Monitor then shows measured "
            "beside commanded vibration, and recordings keep it."
        )
        self._floor, self._find, self._cancel_search = floor, find, cancel_search
        self.search = BackgroundWorker(self)
        self.note = theme.paragraph("", "muted")
        self.length = theme.paragraph("", "small")
        self._fill()
        form = QFormLayout()
        form.setHorizontalSpacing(2 * theme.GRID)
        form.setVerticalSpacing(theme.GRID)
        for name, widget in (("Car&ds", self.cards), ("&Rate", self.rate), ("&Block", self.block), ("", self.length)):
            form.addRow(name, widget)
        form.addRow("Acce&lerometers", self.accelerometers)
        self.buttons = self.button_row(QDialogButtonBox.StandardButton.Apply, QDialogButtonBox.StandardButton.Close)
        self.buttons.button(QDialogButtonBox.StandardButton.Apply).clicked.connect(self._apply)
        column = self.column()
        layout = self.scrolled(column)
        layout.addLayout(form)
        layout.addWidget(self.note)
        layout.addWidget(theme.label("Which tile is which", "title"))
        layout.addWidget(theme.label("A click plays a short 60 Hz burst on one tile, at the output level.", "muted"))
        self.map = QScrollArea()
        self.map.setWidgetResizable(True)
        layout.addWidget(self.map, 1)
        column.addWidget(self.buttons)
        self.block.currentIndexChanged.connect(self._update_note)
        self.rate.currentIndexChanged.connect(self._update_note)
        self.cards.changed.connect(self._update_note)
        self.resize(72 * theme.GRID, 60 * theme.GRID)
        self.search.found.connect(self._show_devices)
        self.cards.search_again.clicked.connect(self.find_devices)
        self.find_devices()

    def find_devices(self) -> None:
        """Look which cards there are now. What plays goes on."""
        if not self.search.is_busy:
            self.devices = None
            self.cards.search_again.setEnabled(False)
            self.search.compute(lambda _: list(self._find()))
            self._update_note()

    def hideEvent(self, event: QHideEvent) -> None:
        self._cancel_search()
        self.search.stop()
        self.search.join()
        super().hideEvent(event)

    def set_values(self, device: str | None, rate_hz: int, block: int, accelerometers: str = "") -> None:
        """Show the present settings; a rate or block that is not offered, as of a file edited by hand, is added."""
        self.accelerometers.setText(accelerometers)
        self.cards.show_text(device)
        for box, value, add in ((self.rate, rate_hz, self._add_rate), (self.block, block, self._add_block)):
            if index_of(box, value) < 0:
                add(value)
            box.setCurrentIndex(index_of(box, value))
        self._update_note()

    def values(self) -> tuple[str | None, int, int, str]:
        """Return the chosen device, rate in Hz, block in frames, and accelerometers."""
        text = " ".join(self.accelerometers.text().split())
        return self.cards.text, self.rate.currentData(), self.block.currentData(), text

    def _fill(self) -> None:
        for rate_hz in RATES_HZ:
            self._add_rate(rate_hz)
        for block in BLOCKS:
            self._add_block(block)

    def _add_rate(self, rate_hz: int) -> None:
        self.rate.addItem(f"{rate_hz / 1000:g} kHz", rate_hz)

    def _add_block(self, block: int) -> None:
        self.block.addItem(f"{block} frames", block)

    def _show_devices(self, devices: list[Card]) -> None:
        self.cards.search_again.setEnabled(True)
        self.devices = devices
        self.cards.show_cards(devices)
        self._update_note()

    def _update_note(self) -> None:
        device, rate_hz, block, _ = self.values()
        lasts_ms = 1e3 * block / rate_hz
        self.length.setText(
            f"A block lasts {lasts_ms:.2f} ms. Short blocks respond sooner and cost more computing time."
        )
        if self.devices is None:
            self.note.setText("Looking for sound devices…")
        elif not self.devices:
            self.note.setText(
                "No sound device was found, or PortAudio is not installed. "
                "Everything else works, but nothing is heard or felt."
            )
        elif device is None:
            self.note.setText("Everything else works, but nothing is heard or felt.")
        else:
            self.note.setText("")
        self.note.setVisible(bool(self.note.text()))
        self._show_map()

    def _apply(self) -> None:
        try:
            accelerometers_of(self.accelerometers.text(), self._floor)
        except BadValue as error:
            self.note.setText(str(error))
            self.note.show()
            self.accelerometers.setFocus()
            return
        self._update_note()
        self.applied.emit(*self.values())

    def _show_map(self) -> None:
        """Show each card with the tiles on its channels; a click on a tile plays a pulse."""
        tiles = sorted(zip(self._floor.channels, self._floor.ids, strict=True))
        inside = QWidget()
        grid = QGridLayout(inside)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(theme.GRID)
        for name, first, end in self._channel_ranges(max(self._floor.channels) + 1):
            there = [(channel, tile) for channel, tile in tiles if first <= channel < end]
            if name and there:
                grid.addWidget(theme.label(name, "muted"), grid.rowCount(), 0, 1, _COLUMNS)
            row = grid.rowCount()
            for i, (channel, tile) in enumerate(there):
                button = QPushButton(tile)
                button.setAutoDefault(False)
                button.setToolTip(f"Pulse tile {tile}: output channel {channel - first + 1}")
                button.clicked.connect(lambda _=False, id=tile: self.pulse_requested.emit(id))
                grid.addWidget(button, row + i // _COLUMNS, i % _COLUMNS)
        grid.setRowStretch(grid.rowCount(), 1)
        self.map.setWidget(inside)

    def _channel_ranges(self, wanted: int) -> list[tuple[str, int, int]]:
        """Name, first channel and the one behind the last, of each card, and of what no card has a channel for."""
        has = {card.name: card.channels for card in self.devices or ()}
        spans, first = [], 0
        text = self.cards.text
        for output in outputs_of(text) if text is not None else ():
            end = first + min(output.channels or MAX_CHANNELS, has.get(output.name, MAX_CHANNELS))
            spans.append((output.name or "Default device", first, end))
            first = end
        if len(spans) < 2 and first >= wanted:
            return [("", 0, wanted)]
        return [*spans, ("No channel: these tiles are silent", first, max(first, wanted))]
