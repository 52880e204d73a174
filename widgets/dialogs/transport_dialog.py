"""Asks for the line that tiles are on: a serial port, or the address at which their datagrams are listened to."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QVBoxLayout, QWidget
from serial.tools.list_ports import comports

from underfoot.widgets import theme

FIRST_ADDRESS = "0.0.0.0:9000"
_WORDS = {
    "serial": (
        "Tiles on a serial port",
        "A port, or PORT@BAUD for another rate than 1,000,000 baud. `underfoot emulate --pty` names one to try.",
    ),
    "udp": ("Tiles over UDP", "HOST:PORT to listen at. 0.0.0.0 listens to all networks of this computer."),
}


class LineDialog(QDialog):
    """`chosen` gives the source of a target of `kind`, "serial" or "udp"."""

    chosen = Signal(str)

    def __init__(self, kind: str, floor: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        title, words = _WORDS[kind]
        self.setWindowTitle(title)
        self.line = QComboBox()
        self.line.setEditable(True)
        self.line.setAccessibleName(title)
        self.line.setMinimumWidth(45 * theme.GRID)
        self.line.addItems([port.device for port in comports()] if kind == "serial" else [FIRST_ADDRESS])
        help = theme.label(words, "small")
        help.setWordWrap(True)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        connect = buttons.addButton("Connect", QDialogButtonBox.ButtonRole.AcceptRole)
        connect.setDefault(True)
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        column = QVBoxLayout(self)
        column.setContentsMargins(*[3 * theme.GRID] * 4)
        column.setSpacing(2 * theme.GRID)
        for widget in (
            theme.label(title, "title"),
            self.line,
            help,
            theme.label(f"Its floor: {floor}", "muted"),
            buttons,
        ):
            column.addWidget(widget)
        self.line.setFocus()

    def accept(self) -> None:
        """Take what was typed or chosen; nothing is no line."""
        text = self.line.currentText().strip()
        if text:
            super().accept()
            self.chosen.emit(text)
