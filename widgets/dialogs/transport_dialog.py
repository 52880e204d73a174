"""Asks for the address of hardware on a transport, as the transport declares it."""

from collections.abc import Callable

from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from underfoot.devices.transport import Transport
from underfoot.errors import UnderfootError
from underfoot.quantities import pretty_text
from underfoot.widgets import theme


class TransportDialog(QDialog):
    """Chooses an address of `transport`; `floor` names the layout that is assumed.

    If `use` refuses the address by an `UnderfootError`, the dialog shows it and stays.
    """

    def __init__(
        self, transport: type[Transport], floor: str, use: Callable[[str], object], parent: QWidget | None = None
    ) -> None:
        super().__init__(parent)
        self._use, self._scheme = use, transport.scheme
        self.setWindowTitle(transport.title)
        self.address = QComboBox()
        self.address.setEditable(True)
        self.address.setAccessibleName(transport.title)
        self.address.setMinimumWidth(45 * theme.GRID)
        self.address.addItems(transport.suggestions())
        help = theme.label(transport.dialog_help, "small")
        help.setWordWrap(True)
        self.refusal = theme.label("", "alarm")
        self.refusal.setWordWrap(True)
        self.refusal.hide()
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
            self.refusal,
            buttons,
        ):
            column.addWidget(widget)
        self.address.setFocus()

    def accept(self) -> None:
        """Take what was typed or chosen; nothing is no address. The scheme may be before it, as on the command line."""
        text = self.address.currentText().strip().removeprefix(f"{self._scheme}:")
        if not text:
            return
        try:
            self._use(text)
        except UnderfootError as error:
            self.refusal.setText(pretty_text(str(error)))
            self.refusal.show()
            self.adjustSize()
            return
        super().accept()
