"""What a right click on the time axis of a recording offers, how its marks are drawn, and what is said of its keys."""

import numpy as np
from long_recording import write_recording
from made_recordings import ABOUT
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent, QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu
from recordings_shown import place_on

from underfoot.floor.layout import default_floor
from underfoot.records.recording import Mark
from underfoot.records.recording_writer import Writer


def test_the_place_of_a_right_click_is_marked_and_the_mark_removed(workspace, folder, qtbot):
    path = folder / "marked.underfoot"
    write_recording(path, 0.5, default_floor(1, 2), vibration=False)
    workspace.open_file(path)
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    axis, said = workspace.axis, []
    workspace.notified.connect(said.append)
    place = place_on(axis, 0.25, "force").toPoint()
    for text, left in (("Mark\tM", 1), ("Remove the mark\tShift+Backspace", 0)):
        event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, place, axis.mapToGlobal(place))
        QApplication.sendEvent(axis, event)
        menu = next(menu for menu in axis.findChildren(QMenu) if menu.isVisible())
        action = next(action for action in menu.actions() if action.text() == text)
        QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())
        qtbot.waitUntil(lambda left=left: len(axis.content.opened.marks) == left)
        assert abs(axis.cursor_s - 0.25) <= axis.seconds_per_px
    assert not said
    show(qtbot, workspace)  # a menu that closes takes the focus along
    axis.setFocus()
    QTest.keyClick(axis, Qt.Key.Key_Backspace, Qt.KeyboardModifier.ShiftModifier)
    assert said == ["No mark is near the cursor."]
    QTest.mousePress(axis, Qt.MouseButton.LeftButton, pos=place)
    before, elsewhere = axis.cursor_s, QPointF(place + QPoint(90, 0))  # where a dialog has taken the release
    at, none = (elsewhere, QPointF(axis.mapToGlobal(elsewhere))), Qt.MouseButton.NoButton
    QApplication.sendEvent(axis, QMouseEvent(QEvent.Type.MouseMove, *at, none, none, Qt.KeyboardModifier.NoModifier))
    assert axis.cursor_s == before


def test_of_marks_in_one_pixel_the_words_of_one_are_drawn_and_those_beyond_the_view_are_not(workspace, folder, qtbot):
    write_recording(folder / "marked.underfoot", 2.0, default_floor(1, 2), vibration=False)
    workspace.open_file(folder / "marked.underfoot")
    qtbot.waitUntil(lambda: workspace.axis.content is not None and not workspace.surveyor.is_busy)
    axis = workspace.axis
    axis.set_view(0.5, 1.5)

    def picture(*marks):
        axis.content.opened.marks[:] = [Mark(number, *mark) for number, mark in enumerate(marks)]
        axis.redraw()
        return axis.grab().toImage()

    one = picture((48_002, "turn"))
    assert picture((23_000, "x"), *[(48_002, "")] * 999, (48_003, "turn"), (48_004, "back"), (90_000, "y")) == one
    assert picture((48_002, "")) != one
    assert picture((48_002, "turn"), (60_000, "stop")) != one


def test_a_recording_that_is_opened_has_the_forces_of_its_first_sample_at_the_cursor(workspace, folder, qtbot):
    writer = Writer(folder / "begun.underfoot", ABOUT)
    writer.put("vibration", 0, np.zeros((480, 2), np.float32))
    writer.put("force", 0, np.array([[128.0, 128.0, *[100.0] * 4, *[0.0] * 4]]))  # as a session of 128 frames a block
    writer.close()
    workspace.open_file(folder / "begun.underfoot")
    qtbot.waitUntil(lambda: "N" in workspace.readout.text.full_text)
    assert workspace.readout.text.full_text.startswith("0.000 s  ·  all tiles 400 N  ·  tile t1 400 N")


def test_the_readout_and_a_screen_reader_say_what_keys_did_on_the_time_axis(workspace, folder, qtbot):
    write_recording(folder / "read.underfoot", 0.5, default_floor(1, 2), vibration=False)
    workspace.open_file(folder / "read.underfoot")
    axis, text = workspace.axis, workspace.readout.text
    qtbot.waitUntil(lambda: axis.content is not None)
    qtbot.keyClick(axis, Qt.Key.Key_Right)
    qtbot.waitUntil(lambda: axis.accessibleDescription().startswith(f"{axis.cursor_s:.3f} s  ·  all tiles"))
    qtbot.keyClick(axis, Qt.Key.Key_BracketLeft)
    begin_s, end_s = axis.selection
    assert text.full_text.startswith(f"{begin_s:.3f} s to {end_s:.3f} s selected, {end_s - begin_s:.3f} s  ·  ")
    assert axis.accessibleDescription() == text.full_text
    qtbot.keyClick(axis, Qt.Key.Key_Backspace)
    assert "selected" not in axis.accessibleDescription() == text.full_text
    qtbot.keyClick(axis, Qt.Key.Key_BracketLeft)
    workspace.open(folder / "read.underfoot")
    assert text.full_text == axis.accessibleDescription() == "", "nothing of the one before"
