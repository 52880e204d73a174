"""The equipment of studies, chosen in a dialog by clicks and keys; the plate and the trigger are pseudo-terminals."""

import os
import signal
from types import SimpleNamespace

import pytest
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialogButtonBox
from serial.tools import list_ports

from underfoot.devices.emulation.plate import EmulatedPlate
from underfoot.devices.plate import PlateCalibration
from underfoot.devices.transports import serial
from underfoot.experiments.protocol import Sounds
from underfoot.floor.layout import default_floor
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog, choice_of_settings
from underfoot.widgets.session.settings import Settings

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def hand(qtbot):
    return Hand(qtbot)


class Hand:
    """Opens the dialog, and fills it in."""

    def __init__(self, qtbot):
        self.qtbot, self.used = qtbot, []

    def opened(self, choice=None):
        self.dialog = EquipmentDialog(self.used.append, choice or EquipmentChoice())
        self.dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
        self.qtbot.addWidget(self.dialog)
        show(self.qtbot, self.dialog)
        return self.dialog

    def switch(self, name):
        box = self.dialog.check_boxes[name]
        box.setFocus()
        self.qtbot.keyClick(box, Qt.Key.Key_Space)

    def click(self, button):
        self.qtbot.mouseClick(button, LEFT)


def test_a_plate_and_a_trigger_are_chosen_tried_and_remembered(hand, tmp_path):
    tty = pytest.importorskip("tty")
    emulated = EmulatedPlate()
    master, slave = os.openpty()
    tty.setraw(slave)
    PlateCalibration(positions=(0.0, 1.0), stiffness_n_mm=(40.0, 160.0)).save(tmp_path / "plate.json")
    try:
        dialog = hand.opened()
        hand.switch("plate")
        hand.qtbot.keyClicks(dialog.plate.lineEdit(), emulated.name)
        hand.qtbot.keyClicks(dialog.calibration, str(tmp_path / "plate.json"))
        hand.switch("trigger")
        hand.qtbot.keyClicks(dialog.trigger.lineEdit(), os.ttyname(slave))
        hand.click(dialog.try_out)
        hand.qtbot.waitUntil(lambda: dialog.note.text() == "Opened: plate, trigger.")
        hand.click(dialog.use_button)
        (chosen,) = hand.used
        assert chosen == EquipmentChoice(plate=f"{emulated.name}:{tmp_path / 'plate.json'}", trigger=os.ttyname(slave))
        with_all = chosen.opened(Sounds(), default_floor(), 1000.0)
        with_all.mark("begin", "main.1")
        assert os.read(master, 10) == b"\x01"
        with_all.close()
        again = hand.opened(chosen)
        assert again.choice() == chosen
    finally:
        emulated.close()
        for end in (master, slave):
            os.close(end)


def test_what_is_wrong_is_one_line_and_nothing_is_used(hand, tmp_path):
    dialog = hand.opened()
    hand.switch("trigger")
    hand.click(dialog.use_button)
    assert dialog.note.text() == "trigger is ''; allowed: a serial port, as /dev/ttyUSB0 or COM3"
    hand.qtbot.keyClicks(dialog.trigger.lineEdit(), str(tmp_path / "no-port"))
    hand.click(dialog.try_out)
    refused = f"the trigger {tmp_path / 'no-port'} cannot be opened"
    hand.qtbot.waitUntil(lambda: dialog.note.text().startswith(refused))
    hand.switch("trigger")
    hand.switch("plate")
    hand.qtbot.keyClicks(dialog.plate.lineEdit(), "/dev/ttyACM9")
    hand.qtbot.keyClicks(dialog.calibration, str(tmp_path / "none.json"))
    hand.click(dialog.use_button)
    assert dialog.note.text().startswith(f"{tmp_path / 'none.json'} cannot be read")
    assert "\n" not in dialog.note.text()
    assert hand.used == []


def test_ports_are_offered_by_the_names_that_boards_keep(hand, tmp_path, monkeypatch):
    """As in the dialog of tiles: a plate or a trigger that was plugged in again had another number."""
    monkeypatch.setattr(list_ports, "comports", lambda: [SimpleNamespace(device=str(tmp_path / "ttyACM0"))])
    monkeypatch.setattr(serial, "LASTING_NAMES", tmp_path)
    (tmp_path / "usb-board-if00").symlink_to("ttyACM0")
    dialog = hand.opened(EquipmentChoice(trigger="/dev/ttyACM1"))
    assert dialog.plate.findText(str(tmp_path / "usb-board-if00")) > 0
    assert dialog.trigger.itemText(0) == str(tmp_path / "usb-board-if00")
    assert dialog.trigger.currentText() == "/dev/ttyACM1"


def test_a_simulated_plate_needs_no_calibration(hand):
    dialog = hand.opened()
    hand.switch("plate")
    dialog.plate.setCurrentIndex(dialog.plate.findText("simulated"))
    hand.click(dialog.try_out)
    hand.qtbot.waitUntil(lambda: dialog.note.text() == "Opened: plate.")
    hand.click(dialog.use_button)
    assert hand.used == [EquipmentChoice(plate="simulated")]


def test_the_cards_come_while_the_dialog_is_open_and_a_server_that_hangs_holds_nothing_up(hand, null_sink, until):
    """The window stood still for as long as a sound server did."""
    server = min(null_sink.threads())
    os.kill(server, signal.SIGSTOP)
    try:
        dialog = hand.opened(EquipmentChoice(masking="headphones"))
        assert dialog.masking.currentText() == "headphones"
        dialog.masking.setCurrentIndex(0)
        hand.click(dialog.try_out)
        assert (dialog.note.text(), dialog.use_button.isEnabled()) == ("Opening…", False)
        hand.click(dialog.buttons.button(QDialogButtonBox.StandardButton.Cancel))
        assert not dialog.isVisible()
    finally:
        os.kill(server, signal.SIGCONT)
    dialog.trial.join()
    dialog = hand.opened(EquipmentChoice(masking="headphones"))
    hand.qtbot.waitUntil(lambda: dialog.masking.findText("uf") > 0)
    assert dialog.masking.currentText() == "headphones"
    hand.click(dialog.buttons.button(QDialogButtonBox.StandardButton.Cancel))


def test_the_window_remembers_and_forgives(tmp_path):
    settings = Settings(study_equipment={"trigger": "COM3", "masking": ""})
    settings.save(tmp_path)
    assert choice_of_settings(Settings.load(tmp_path).study_equipment) == EquipmentChoice(trigger="COM3", masking="")
    assert choice_of_settings({"plate": "nowhere"}) == EquipmentChoice()
