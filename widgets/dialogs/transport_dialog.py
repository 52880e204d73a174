"""Asks for the address of hardware on a transport, as the transport declares it."""

import threading
from collections.abc import Callable
from concurrent.futures import Future

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QComboBox, QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from underfoot.devices.transport import Transport
from underfoot.errors import UnderfootError
from underfoot.quantities import pretty_text
from underfoot.widgets import theme

_LOOK_MS = 20


class TransportDialog(QDialog):
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
        super().__init__(parent)
        self._require, self._use, self._scheme = require, use, transport.scheme
        self._address = ""
        self._answer: Future[str] | None = None
        self._look = QTimer(self, interval=_LOOK_MS)
        self._look.timeout.connect(self._take_answer)
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
        self._connect = buttons.addButton("Connect", QDialogButtonBox.ButtonRole.AcceptRole)
        self._connect.setDefault(True)
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
        address = self.address.currentText().strip().removeprefix(f"{self._scheme}:")
        if not address or self._answer is not None:
            return
        self._connect.setText("Connecting…")
        self._connect.setEnabled(False)
        self._refuse("")
        self._address, self._answer = address, Future()
        threading.Thread(target=_ask, args=(self._require, address, self._answer), name="connect", daemon=True).start()
        self._look.start()

    def _take_answer(self) -> None:
        """Use the address that `require` has allowed, or show why not."""
        if self._answer is None or not self._answer.done():
            return
        self._look.stop()
        refusal, self._answer = self._answer.result(), None
        self._connect.setText("Connect")
        self._connect.setEnabled(True)
        self._refuse(refusal)
        if refusal:
            self.address.setFocus()  # which the button has lost
        else:
            self._use(self._address)
            super().accept()

    def _refuse(self, why: str) -> None:
        """Show why an address is refused, "" for nothing."""
        self.refusal.setText(pretty_text(why))
        self.refusal.setVisible(bool(why))
        self.adjustSize()


def _ask(require: Callable[[str], object], address: str, answer: "Future[str]") -> None:
    """Answer with the reason for which an address is refused, "" for none."""
    try:
        require(address)
    except UnderfootError as error:
        answer.set_result(str(error))
    except BaseException as error:
        answer.set_exception(error)
        raise
    else:
        answer.set_result("")
