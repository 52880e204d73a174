"""Dialogs on a screen of 1280 x 800 at 200 %, which has 640 x 400 points: their buttons can be reached."""

from collections.abc import Callable
from itertools import pairwise

import pytest
from made_studies import preset_protocol
from on_screen import show
from PySide6.QtCore import QRect, Qt
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialogButtonBox,
    QLabel,
    QLineEdit,
    QStyle,
    QStyleOptionComboBox,
    QWidget,
)

from underfoot.floor.layout import default_floor
from underfoot.network.server import Counts
from underfoot.studies.equipment import EquipmentChoice
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.file_dialog import file_dialog
from underfoot.widgets.dialogs.audio_dialog import AudioDialog
from underfoot.widgets.dialogs.network_dialog import NetworkDialog
from underfoot.widgets.dialogs.shortcuts import ShortcutsDialog
from underfoot.widgets.experiment.equipment_dialog import EquipmentDialog
from underfoot.widgets.experiment.people_dialog import PeopleDialog, SimulatedPeople
from underfoot.widgets.session.settings import DEFAULT_ADDRESSES


def audio():
    return AudioDialog(list, lambda: None, default_floor())


def network():
    return NetworkDialog(lambda *_: None, Counts, str, DEFAULT_ADDRESSES, [])


def keys():
    return ShortcutsDialog([("EVERYWHERE", [("What a key does, told in a line of ordinary length", "F1")] * 90)])


def people():
    return PeopleDialog(lambda _: None, preset_protocol("identification-impact"), SimulatedPeople(), None)


def equipment():
    return EquipmentDialog(lambda _: None, EquipmentChoice())


def shown(qtbot, made: Dialog):
    made.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose, False)
    qtbot.addWidget(made)
    show(qtbot, made)
    return made


def place_in(dialog: QWidget, part: QWidget):
    return QRect(part.mapTo(dialog, part.rect().topLeft()), part.size())


@pytest.mark.parametrize("make", [audio, network, keys, people, equipment])
def test_the_buttons_of_a_dialog_are_in_sight_on_a_low_screen(qtbot, make: Callable[[], Dialog]):
    dialog = shown(qtbot, make())
    dialog.resize(608, 336)
    qtbot.waitUntil(lambda: dialog.size().toTuple() == (608, 336))
    buttons = dialog.findChild(QDialogButtonBox)
    assert dialog.rect().contains(place_in(dialog, buttons))
    lines = [line for line in dialog.findChildren(QLabel) if line.isVisible() and line.wordWrap()]
    assert [line.text() for line in lines if line.height() < line.heightForWidth(line.width())] == []
    dialog.close()


def test_what_tab_comes_to_is_scrolled_to_and_nothing_overlaps(qtbot):
    dialog = shown(qtbot, network())
    dialog.resize(608, 336)
    inside = dialog.addresses["tuio"].parentWidget()
    parts = [part for part in inside.findChildren(QWidget) if part.isVisible()]
    rows = sorted((place for place in (place_in(inside, part) for part in parts) if place.left() == 0), key=QRect.top)
    assert len(rows) >= len(dialog.check_boxes)
    assert all(above.bottom() < below.top() for above, below in pairwise(rows))
    stops = {part for kind in (QCheckBox, QLineEdit) for part in inside.findChildren(kind)}
    dialog.check_boxes["tuio"].setFocus()
    passed = set()
    for _ in stops:
        part = dialog.focusWidget()
        assert dialog.rect().contains(place_in(dialog, part))
        passed.add(part)
        qtbot.keyClick(part, Qt.Key.Key_Tab)
    assert passed == stops
    assert dialog.buttons.isAncestorOf(dialog.focusWidget())


def room_for_text(box: QComboBox):
    option = QStyleOptionComboBox()
    box.initStyleOption(option)
    part = QStyle.SubControl.SC_ComboBoxEditField
    return box.style().subControlRect(QStyle.ComplexControl.CC_ComboBox, option, part, box).width()


def test_where_there_is_room_a_sound_card_is_named_whole(qtbot):
    boxes = shown(qtbot, audio()).findChildren(QComboBox)
    box = next(box for box in boxes if box.currentText() == "Default device of this computer")
    assert room_for_text(box) >= box.fontMetrics().horizontalAdvance(box.currentText())


def test_what_is_wrong_is_said_beside_the_buttons(qtbot):
    dialog = shown(qtbot, network())
    dialog.resize(608, 336)
    dialog.addresses["tuio"].setText("nowhere")
    dialog.check_boxes["tuio"].setChecked(True)
    assert "nowhere" in dialog.note.text()
    qtbot.waitUntil(lambda: dialog.rect().contains(place_in(dialog, dialog.note)))


def test_a_dialog_is_no_larger_than_the_screen(qtbot):
    made = Dialog("Wide", None)
    made.column().addWidget(QWidget())
    made.resize(4000, 3000)
    room = shown(qtbot, made).screen().availableGeometry()
    assert made.width() < room.width()
    assert made.height() < room.height()


def test_the_dialog_for_files_of_desktops_without_one_is_no_larger(qtbot):
    parent = QWidget()
    qtbot.addWidget(parent)
    made = file_dialog(parent, "Open")
    assert made.width() < made.screen().availableGeometry().width()
