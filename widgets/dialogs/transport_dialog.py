"""Asks for the address of hardware on a transport, as the transport declares it."""

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QComboBox, QDialogButtonBox, QWidget

from underfoot.devices.transport import Transport
from underfoot.errors import kind_and_words
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.controls.dialog import Dialog, room_for


class TransportDialog(Dialog):
    """Chooses an address of `transport`; `floor` names the layout that is assumed.

    `require` is asked first, in a thread, since it may wait for the hardware. If it refuses the address by an
    `UnderfootError`, the dialog shows it and stays; otherwise the address goes to `use`.
    """

    def __init__(
        self,
        transport: type[Transport],
        floor: str,
        require: Callable[[str], object],
        use: Callable[[str], object],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(transport.title, parent)
        self._require, self._use, self._scheme = require, use, transport.scheme
        self._trial = BackgroundWorker(self)
        self._trial.found.connect(self._connected)
        self._trial.failed.connect(self._show_refusal)
        self.address = QComboBox()
        self.address.setEditable(True)
        self.address.setAccessibleName(transport.title)
        self.address.setMinimumWidth(45 * theme.GRID)
        help = theme.paragraph(transport.dialog_help, "small")
        self.refusal = theme.paragraph("", "alarm")
        self.refusal.hide()
        buttons = self.button_row(QDialogButtonBox.StandardButton.Cancel)
        self._connect = buttons.addButton("Connect", QDialogButtonBox.ButtonRole.AcceptRole)
        self._connect.setDefault(True)
        column = self.column()
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
        try:
            self.address.addItems(transport.suggestions())
        except Exception as error:  # a plug-in's can raise anything, and an address may be typed all the same
            self._show_refusal(kind_and_words(error))

    def accept(self) -> None:
        """Take what was typed or chosen; nothing is no address. The scheme may be before it, as on the command line."""
        address = self.address.currentText().strip().removeprefix(f"{self._scheme}:")
        if not address or self._trial.is_busy:
            return

        def allowed(_: Task) -> list[Any]:
            self._require(address)
            return [address]

        self._connect.setText("Connecting…")
        self._connect.setEnabled(False)
        self.refusal.hide()
        self._trial.compute(allowed)

    def done(self, result: int) -> None:
        """Close, and wait for no answer any more."""
        super().done(result)
        self._trial.stop()

    def _connected(self, addresses: list[str]) -> None:
        """Use the address that `require` has allowed."""
        self._use(*addresses)
        super().accept()

    def _show_refusal(self, why: str) -> None:
        """Show why an address is refused, or none is suggested."""
        self._connect.setText("Connect")
        self._connect.setEnabled(True)
        self.refusal.setText(pretty_text(why))
        self.refusal.show()
        width = self.sizeHint().width()
        self.resize(QSize(width, self.heightForWidth(width)).boundedTo(room_for(self)))  # Qt's own ends at two thirds
        self.address.setFocus()  # which the button has lost
