"""The network dialog: what it gives back, what it warns of, and what it counts."""

import pytest
from on_screen import show
from PySide6.QtCore import Qt

from underfoot.errors import DeviceError
from underfoot.network.server import Counts
from underfoot.widgets.dialogs.network_dialog import NetworkDialog
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES


class Desk:
    """A dialog, what it applied, and what it is told."""

    def __init__(self, qtbot, on=()):
        self.applied, self.counts, self.trouble, self.error = [], Counts(), "", None
        self.qtbot = qtbot
        self.dialog = NetworkDialog(self.apply, lambda: self.counts, lambda: self.trouble, DEFAULT_ADDRESSES, list(on))
        self.dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
        qtbot.addWidget(self.dialog)
        show(qtbot, self.dialog)

    def apply(self, addresses, on):
        if self.error is not None:
            raise self.error
        self.applied.append((addresses, on))

    def click(self, widget):
        self.qtbot.mouseClick(widget, Qt.MouseButton.LeftButton, pos=widget.rect().center() * 0.2)

    def type(self, name, text):
        field = self.dialog.addresses[name]
        field.selectAll()
        self.qtbot.keyClicks(field, text)


@pytest.fixture
def desk(qtbot):
    return Desk(qtbot, ["tuio"])


def test_apply_gives_what_is_used_and_where_it_goes(desk):
    desk.qtbot.keyClick(desk.dialog.check_boxes["listen"], Qt.Key.Key_Space)
    desk.type("tuio", "127.0.0.1:4444")
    desk.qtbot.mouseClick(desk.dialog.apply, Qt.MouseButton.LeftButton)
    assert desk.applied == [({**DEFAULT_ADDRESSES, "tuio": "127.0.0.1:4444"}, ["tuio", "listen"])]
    assert not desk.dialog.note.isVisible()


def test_an_address_of_another_computer_is_warned_of_before_it_is_used(desk):
    desk.qtbot.keyClick(desk.dialog.check_boxes["listen"], Qt.Key.Key_Space)
    desk.type("listen", "0.0.0.0:9700")
    assert desk.dialog.note.isVisible()
    assert "without a password" in desk.dialog.note.text()
    assert not desk.applied


def test_what_is_no_address_is_said(desk):
    desk.type("tuio", "the projector")
    assert "HOST:PORT" in desk.dialog.note.text()
    desk.qtbot.keyClick(desk.dialog.check_boxes["tuio"], Qt.Key.Key_Space)
    assert not desk.dialog.note.isVisible(), "it is not used"


def test_what_cannot_be_applied_is_said(desk):
    desk.error = DeviceError("cues cannot be taken at 127.0.0.1:9700: Address already in use; choose another port")
    desk.qtbot.mouseClick(desk.dialog.apply, Qt.MouseButton.LeftButton)
    assert "choose another port" in desk.dialog.note.text()


def test_an_open_network_dialog_counts_what_is_sent(desk):
    desk.counts = Counts(12345, 6, 7, "gain_db is nan; allowed: -80 to 20 dB")
    desk.qtbot.waitUntil(lambda: "12\u202f345" in desk.dialog.counters.text())
    assert desk.dialog.counters.text().endswith("Cues received 6   Refused 7")
    assert desk.dialog.refusal.text() == "Last refused: gain_db is nan; allowed: -80 to 20 dB"
    desk.trouble = "LSL needs the package pylsl"
    desk.qtbot.waitUntil(lambda: desk.dialog.trouble.text() == f"{desk.trouble}.")
