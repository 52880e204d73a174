"""What the mouse holds is let go where the release of its button goes elsewhere: to a dialog, or to a menu."""

import pytest
from design_samples import LEFT, send
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QVBoxLayout, QWidget

from underfoot.floor.layout import default_floor
from underfoot.parameters import Number, Numbers
from underfoot.widgets.controls.bars_editor import Bars
from underfoot.widgets.controls.number_editor import NumberEditor
from underfoot.widgets.design.tile_pad import TilePad
from underfoot.widgets.floor_map import FloorMap


@pytest.fixture
def held(qtbot):
    """A window with a floor, a tile, a number and bars, and the mouse in the middle of each, a little dragged."""
    window = QWidget()
    qtbot.addWidget(window)
    floor, pad = FloorMap(), TilePad(window)
    floor.set_floor(default_floor(1, 1))
    floor.can_press = True
    number, bars = NumberEditor(Number(0.5, 0.0, 1.0)), Bars(Numbers((0.5,), 0.0, 1.0, most=4))
    column = QVBoxLayout(window)
    for part in (floor, pad, number, bars):
        column.addWidget(part)
    window.resize(400, 600)
    show(qtbot, window)
    for part in (floor, pad, number.slider, number.field, bars):
        middle = part.rect().center()
        QTest.mousePress(part, LEFT, pos=middle)
        send(part, QEvent.Type.MouseMove, middle - QPoint(0, 30), LEFT)
    return window, floor, pad, number, bars


def test_a_dialog_that_opens_lets_go_of_what_the_mouse_holds(held, qtbot):
    """A foot stayed on its tile, and a control showed what it had been dragged to whatever was undone."""
    window, floor, pad, number, bars = held
    forces = {}
    for part in (floor, pad):
        part.pressed.connect(lambda tile, x, y, force_n, part=part: forces.update({part: force_n}))
    with qtbot.waitSignal(number.let_go):
        dialog = QDialog(window)
        dialog.open()
    assert forces == {floor: 0.0, pad: 0.0}
    assert not number.is_held
    assert not bars.is_dragged
    dialog.close()


def test_a_number_does_not_follow_a_mouse_whose_button_is_up(held):
    """The menu of its field had taken the release."""
    _, _, _, number, _ = held
    field, before = number.field, number.value()
    for up in (40, 80):
        send(field, QEvent.Type.MouseMove, QPoint(20, -up), Qt.MouseButton.NoButton)
    assert number.value() == before
    assert not field.is_held
