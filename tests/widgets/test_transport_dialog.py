"""The menu and the dialog of every transport follow from what it declares."""

import threading

import pytest
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QWidget
from shiboken6 import isValid
from windows import LONG_MS

from underfoot.devices.transports import TRANSPORTS
from underfoot.devices.transports.udp import UdpTransport
from underfoot.engine.target import Target
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.widgets.dialogs.transport_dialog import TransportDialog
from underfoot.widgets.session.target_settings import target_text
from underfoot.widgets.session.targets import choices


@pytest.fixture(params=TRANSPORTS)
def transport(request):
    return TRANSPORTS[request.param]


def test_the_menu_has_it(transport):
    assert (f"transport {transport.scheme}", f"{transport.title}…") in choices()


def test_a_target_is_told_in_its_words(transport):
    target = Target(default_floor(), kind=transport.scheme, source="somewhere")
    assert target_text(target) == f"{transport.label}  somewhere"


def test_the_dialog_offers_its_addresses_and_takes_another(qtbot, transport, monkeypatch):
    monkeypatch.setattr(transport, "suggestions", classmethod(lambda cls: ["first", "second"]))
    chosen, answers = [], threading.Event()

    def require(address):
        assert answers.wait(60.0)
        if address == "nowhere":
            raise BadValue("address is 'nowhere'; allowed: one that is there")

    window = QWidget()
    qtbot.addWidget(window)
    dialog = TransportDialog(transport, "a floor", require, chosen.append, window)
    show(qtbot, dialog)
    shown = [label.text() for label in dialog.findChildren(QLabel)]
    assert dialog.windowTitle() == transport.title
    assert transport.dialog_help in shown
    assert "Floor: a floor" in shown
    assert [dialog.address.itemText(i) for i in range(dialog.address.count())] == ["first", "second"]
    for text, said in (("  ", ""), ("nowhere", "address is 'nowhere'; allowed: one that is there")):
        dialog.address.setEditText(text)
        qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
        if said:  # the window goes on while the hardware is waited for
            assert "Connecting…" in [button.text() for button in dialog.findChildren(QPushButton)]
            qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
            answers.set()
        qtbot.waitUntil(lambda said=said: dialog.refusal.text() == said, timeout=LONG_MS)
        assert not chosen
        assert dialog.isVisible()
        assert dialog.refusal.isVisible() == bool(said)
    dialog.address.setEditText(f" {transport.scheme}:there ")
    qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: chosen == ["there"] and not isValid(dialog), timeout=LONG_MS)
    qtbot.waitUntil(lambda: "background" not in {thread.name for thread in threading.enumerate()}, timeout=LONG_MS)


def test_an_address_is_typed_where_a_plug_in_cannot_list_any(qtbot):
    """As one of a radio that is not plugged in: its dialog did not open."""

    class Own(UdpTransport):
        suggestions = classmethod(lambda cls: {}["antenna"])

    window = QWidget()
    qtbot.addWidget(window)
    dialog = TransportDialog(Own, "a floor", str, print, window)
    assert dialog.refusal.text() == "KeyError: 'antenna'"
    qtbot.keyClicks(dialog.address, "there")
    assert dialog.address.currentText() == "there"


def test_a_long_refusal_is_read_whole(qtbot):
    def require(address):
        raise BadValue(f"address is {address!r}; allowed: " + "a port of this computer, or several with commas; " * 24)

    window = QWidget()
    qtbot.addWidget(window)
    dialog = TransportDialog(UdpTransport, "a floor", require, print, window)
    show(qtbot, dialog)
    dialog.address.setEditText("there")
    qtbot.keyClick(dialog.address, Qt.Key.Key_Return)
    said = dialog.refusal
    qtbot.waitUntil(said.isVisible, timeout=LONG_MS)
    qtbot.waitUntil(lambda: said.height() >= said.heightForWidth(said.width()), timeout=LONG_MS)
    dialog.close()
