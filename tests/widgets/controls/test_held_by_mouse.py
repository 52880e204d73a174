"""What the mouse holds is let go where the release of its button goes elsewhere: to a dialog, or to a menu."""

import pytest
from design_samples import LEFT, send
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtWidgets import QApplication, QDialog, QMenu, QVBoxLayout, QWidget

from underfoot.drawing.layout import Margins
from underfoot.floor.layout import default_floor
from underfoot.parameters import Number, Numbers
from underfoot.widgets.controls.bars_editor import Bars
from underfoot.widgets.controls.number_editor import NumberEditor
from underfoot.widgets.design.rhythm_editor import RhythmBar
from underfoot.widgets.design.tile_pad import TilePad
from underfoot.widgets.floor_map import FloorMap
from underfoot.widgets.plots.zoom_plot import ZoomPlot


@pytest.fixture
def window(qtbot):
    """A window with a floor, a tile, a number, bars and a rhythm."""
    window = QWidget()
    qtbot.addWidget(window)
    window.floor, window.pad, window.number = FloorMap(), TilePad(window), NumberEditor(Number(0.5, 0.0, 1.0))
    window.bars, window.rhythm = Bars(Numbers((0.5,), 0.0, 1.0, most=4)), RhythmBar()
    window.floor.set_floor(default_floor(1, 1))
    window.floor.can_press = True
    window.bars.set_values([0.5])
    column = QVBoxLayout(window)
    for part in (window.floor, window.pad, window.number, window.bars, window.rhythm):
        column.addWidget(part)
    window.resize(400, 700)
    show(qtbot, window)
    return window


@pytest.mark.parametrize("opened", [QDialog, QMenu])
def test_what_takes_the_mouse_lets_go_of_what_it_holds(window, qtbot, opened):
    """A foot stayed on its tile, a control showed what it had been dragged to whatever was undone, and what can be
    hovered over followed the mouse with no button down.
    """
    forces, number = {}, window.number
    for part in (window.floor, window.pad):
        part.pressed.connect(lambda tile, x, y, force_n, part=part: forces.update({part: force_n}))

    def held():
        return number.is_held, window.bars.is_dragged, window.rhythm.is_dragged, any(forces.values())

    for part in (window.floor, window.pad, number.slider, number.field, window.bars, window.rhythm):
        middle = part.rect().center()
        send(part, QEvent.Type.MouseButtonPress, middle, LEFT)
        send(part, QEvent.Type.MouseMove, middle - QPoint(0, 30), LEFT)
        assert sum(held()) == 1
        taker = opened(window)
        taker.addAction("Save")
        if opened is QDialog:
            taker.open()
        else:  # Qt tells what the mouse is over, which windows of other tests in this process change
            taker.popup(window.mapToGlobal(QPoint(1, 1)))
            QApplication.sendEvent(part, QEvent(QEvent.Type.Leave))
        assert not any(held())
        taker.close()
        show(qtbot, window)


def test_a_number_does_not_follow_a_mouse_whose_button_is_up(window):
    """Another window had taken the release."""
    field, before = window.number.field, window.number.value()
    send(field, QEvent.Type.MouseButtonPress, QPoint(20, 8), LEFT)
    for up in (40, 80):
        send(field, QEvent.Type.MouseMove, QPoint(20, -up), Qt.MouseButton.NoButton)
    assert window.number.value() == before
    assert not field.is_held


def test_a_range_is_no_longer_dragged_over_where_the_release_is_lost(qtbot):
    plot, ranges, up = ZoomPlot("Force", Margins()), [], Qt.MouseButton.NoButton
    qtbot.addWidget(plot)
    plot.resize(300, 200)
    plot.range_requested.connect(lambda *ends: ranges.append(ends))
    kinds = QEvent.Type
    for between in (LEFT, up):
        send(plot, kinds.MouseButtonPress, QPoint(100, 100), LEFT)
        for x, held in ((150, LEFT), (200, between)):
            send(plot, kinds.MouseMove, QPoint(x, 100), held)
        send(plot, kinds.MouseButtonRelease, QPoint(200, 100), LEFT)
        assert len(ranges) == 1
