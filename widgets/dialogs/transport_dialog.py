"""Asks for the address of hardware on a transport, as the transport declares it."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from underfoot.devices.transport import Transport
from underfoot.widgets import theme


class TransportDialog(QDialog):
    """Chooses an address of `transport`; `floor` names the layout that is assumed."""

    chosen = Signal(str)

    def __init__(self, transport: type[Transport], floor: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(transport.title)
        self.address = QComboBox()
        self.address.setEditable(True)
        self.address.setAccessibleName(transport.title)
        self.address.setMinimumWidth(45 * theme.GRID)
        self.address.addItems(transport.suggestions())
        help = theme.label(transport.dialog_help, "small")
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
            theme.label(transport.title, "title"),
            self.address,
            help,
            theme.label(f"Floor: {floor}", "muted"),
            buttons,
        ):
            column.addWidget(widget)
        self.address.setFocus()

    def accept(self) -> None:
        """Take what was typed or chosen; nothing is no address."""
        text = self.address.currentText().strip()
        if text:
            super().accept()
            self.chosen.emit(text)
