"""The audio dialog: which device plays, how fast and in which blocks, and which tile is which."""

import threading
from collections.abc import Callable, Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QHideEvent
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QGridLayout,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from underfoot.devices.accelerometers import FORM, accelerometers_of
from underfoot.errors import BadValue
from underfoot.floor.layout import Floor
from underfoot.widgets import theme

RATES_HZ = (44_100, 48_000, 96_000)
BLOCKS = (32, 64, 128, 256, 512, 1024)

Device = tuple[str, int, float]
"""Name, output channels, default rate in Hz."""

_COLUMNS = 6


class AudioDialog(QDialog):
    """Edits device, rate and block; Apply emits them. The tiles' buttons ask for a pulse at once.

    `find` looks for sound devices, which can take a second: it runs in a thread, for which the dialog waits when it is
    closed.
    """

    applied = Signal(object, int, int, str)
    """Device (None: no sound, "": the default one, else its name), rate in Hz, frames in a block, accelerometers."""
    pulse_wanted = Signal(str)
    """The tile whose shaker is to be heard."""
    found = Signal(list)
    """The devices that there are."""

    def __init__(self, find: Callable[[], Sequence[Device]], floor: Floor, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Audio")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.devices: list[Device] | None = None
        self.device, self.rate, self.block = QComboBox(), QComboBox(), QComboBox()
        self.accelerometers = QLineEdit()
        self.accelerometers.setPlaceholderText("none")
        self.accelerometers.setToolTip(
            f"Accelerometers on inputs of this device, with spaces between: {FORM}. Monitor then shows what each tile "
            "does beside what it is asked, and recordings keep it."
        )
        self._floor = floor
        self.note = theme.label("", "muted")
        self.note.setWordWrap(True)
        self.length = theme.label("", "small")
        self._fill()
        form = QFormLayout()
        form.setHorizontalSpacing(2 * theme.GRID)
        form.setVerticalSpacing(theme.GRID)
        for name, widget in (("&Device", self.device), ("&Rate", self.rate), ("&Block", self.block), ("", self.length)):
            form.addRow(name, widget)
        form.addRow("&Accelerometers", self.accelerometers)
        self.buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Apply | QDialogButtonBox.StandardButton.Close)
        self.buttons.button(QDialogButtonBox.StandardButton.Apply).clicked.connect(self._apply)
        self.buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(*[2 * theme.GRID] * 4)
        layout.setSpacing(2 * theme.GRID)
        layout.addLayout(form)
        layout.addWidget(self.note)
        layout.addWidget(theme.label("Which tile is which", "title"))
        layout.addWidget(theme.label("A click plays a short 60 Hz burst on one tile, at the output level.", "muted"))
        layout.addWidget(self._tiles(floor), 1)
        layout.addWidget(self.buttons)
        self.block.currentIndexChanged.connect(self._explain)
        self.rate.currentIndexChanged.connect(self._explain)
        self.device.currentIndexChanged.connect(self._explain)
        self.resize(60 * theme.GRID, 56 * theme.GRID)
        self.found.connect(self._show_devices)
        self._search = threading.Thread(
            target=lambda: self.found.emit(list(find())), name="look for sound devices", daemon=True
        )
        self._search.start()

    def hideEvent(self, event: QHideEvent) -> None:
        self._search.join()
        super().hideEvent(event)

    def set_values(self, device: str | None, rate_hz: int, block: int, accelerometers: str = "") -> None:
        """What is in use."""
        self.accelerometers.setText(accelerometers)
        if _index(self.device, device) < 0:
            self.device.addItem(str(device), device)
        for box, value in ((self.device, device), (self.rate, rate_hz), (self.block, block)):
            box.setCurrentIndex(max(0, _index(box, value)))
        self._explain()

    def values(self) -> tuple[str | None, int, int, str]:
        """Device, rate in Hz, frames in a block and accelerometers, as chosen."""
        text = " ".join(self.accelerometers.text().split())
        return self.device.currentData(), self.rate.currentData(), self.block.currentData(), text

    def _fill(self) -> None:
        self.device.addItem("Default device of this computer", "")
        self.device.addItem("No sound", None)
        for rate_hz in RATES_HZ:
            self.rate.addItem(f"{rate_hz / 1000:g} kHz", rate_hz)
        for block in BLOCKS:
            self.block.addItem(f"{block} frames", block)

    def _show_devices(self, devices: list[Device]) -> None:
        self._search.join()
        self.devices = devices
        chosen = self.device.currentData()
        known = [name for name, _, _ in devices]
        for index in range(self.device.count()):
            name = self.device.itemData(index)
            if name and name not in known:
                self.device.setItemText(index, f"{name} (not connected)")
        for name, channels, rate_hz in devices:
            words = f"{name}  ·  {channels} channels, {rate_hz / 1000:g} kHz"
            if name == chosen:
                self.device.setItemText(self.device.currentIndex(), words)
            else:
                self.device.addItem(words, name)
        self._explain()

    def _explain(self) -> None:
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

    def _apply(self) -> None:
        try:
            accelerometers_of(self.accelerometers.text(), self._floor)
        except BadValue as error:
            self.note.setText(str(error))
            self.note.show()
            self.accelerometers.setFocus()
            return
        self._explain()
        self.applied.emit(*self.values())

    def _tiles(self, floor: Floor) -> QWidget:
        area, inside = QScrollArea(), QWidget()
        grid = QGridLayout(inside)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(theme.GRID)
        for i, tile in enumerate(floor.tiles):
            channel = i if tile.output is None else tile.output
            button = QPushButton(tile.id)
            button.setAutoDefault(False)
            button.setToolTip(f"Pulse tile {tile.id}: output channel {channel + 1}")
            button.clicked.connect(lambda _=False, id=tile.id: self.pulse_wanted.emit(id))
            grid.addWidget(button, i // _COLUMNS, i % _COLUMNS)
        grid.setRowStretch(grid.rowCount(), 1)
        area.setWidget(inside)
        area.setWidgetResizable(True)
        return area


def _index(box: QComboBox, value: object) -> int:
    """Where `value` is in a box; Qt's own search does not tell None from ""."""
    return next((i for i in range(box.count()) if box.itemData(i) == value), -1)
