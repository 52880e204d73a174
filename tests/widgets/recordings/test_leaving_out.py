"""Steps of the open recording are left out of means by a key and by a menu, shown so, and taken in again."""

import csv
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from long_recording import write_recording
from on_screen import show
from PySide6.QtCore import QItemSelectionModel, Qt
from PySide6.QtGui import QContextMenuEvent, QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QInputDialog, QMenu

from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("walks") / "walk.underfoot", 6.0, default_floor(1, 2))


@pytest.fixture
def opened(workspace, walk, folder, qtbot):
    """The workspace with a copy of the recording, whose steps were found."""
    (folder / "walk.underfoot").write_bytes(walk.read_bytes())
    workspace.open_file(folder / "walk.underfoot")
    qtbot.waitUntil(lambda: len(workspace.steps.visible_steps()) >= 6 and not workspace.surveyor.is_busy)
    return workspace


def answer(opened, why, qtbot):
    """Answer the dialog that asks why."""
    qtbot.waitUntil(lambda: any(one.isVisible() for one in opened.findChildren(QInputDialog)))
    dialog = next(one for one in opened.findChildren(QInputDialog) if one.isVisible())
    dialog.setTextValue(why)
    dialog.accept()


def bar_colour(axis):
    """The colour of the first step's bar, beside its number."""
    bar = next(bar for contact, bar in axis.painter().bars(0) if contact.id == axis.content.steps[0].step.contact)
    return axis.grab().toImage().pixelColor(round(bar.left()) + 3, round(bar.bottom()) - 3)


def reasons(opened):
    return [step.left_out for step in opened.steps.visible_steps()]


def test_the_step_on_the_axis_is_left_out_by_a_key_and_taken_in_again(opened, qtbot):
    axis, panel, said = opened.axis, opened.steps, []
    opened.notified.connect(said.append)
    every = len(panel.visible_steps())
    axis.setFocus()
    QTest.keyClick(axis, Qt.Key.Key_X)
    assert said == ["No step is chosen: click one, or press . for the next."]
    QTest.keyClick(axis, Qt.Key.Key_Period)
    QTest.keyClick(axis, Qt.Key.Key_X)
    bar, table = bar_colour(axis), panel.table.grab().toImage()
    answer(opened, " ", qtbot)  # which the dialog takes for no reason, and waits for one
    answer(opened, "stumbled", qtbot)
    qtbot.waitUntil(lambda: reasons(opened) == ["stumbled", *[""] * (every - 1)])
    assert "s  ·  1 step left out  ·  2 tiles" in opened.facts.full_text
    names = [one.name for one in panel.plot.drawing.series]
    assert (f"mean of {every - 1}" in names, names[-1]) == (True, "step 1, left out")
    mean = next(one for one in panel.plot.drawing.series if one.name.startswith("mean"))
    curves = [one.force_n for one in axis.content.steps]
    np.testing.assert_allclose(mean.y, np.mean(curves[1:], axis=0))
    assert bar != bar_colour(axis)
    assert table != panel.table.grab().toImage()
    assert panel.table.model().index(0, 4).data(Qt.ItemDataRole.ToolTipRole) == "Left out: stumbled"
    with Recording(axis.content.opened.path) as recording:
        assert [one.why for one in recording.left_out()] == ["stumbled"]
    show(qtbot, opened)  # a dialog that closes takes the focus along
    axis.setFocus()
    QTest.keyClick(axis, Qt.Key.Key_X)
    qtbot.waitUntil(lambda: reasons(opened) == [""] * every)
    assert "left out" not in opened.facts.full_text


def test_several_steps_are_left_out_by_the_menu_of_the_table_and_copied_with_the_reason(opened, qtbot):
    table = opened.steps.table
    flags = QItemSelectionModel.SelectionFlag
    for row in (1, 2):
        table.selectionModel().select(table.model().index(row, 0), flags.Select | flags.Rows)
    place = table.viewport().rect().center()
    QApplication.sendEvent(
        table.viewport(),
        QContextMenuEvent(QContextMenuEvent.Reason.Mouse, place, table.viewport().mapToGlobal(place)),
    )
    menu = next(menu for menu in table.findChildren(QMenu) if menu.isVisible())
    action = next(action for action in menu.actions() if action.text().startswith("Leave out…"))
    QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())
    answer(opened, "a turn, sharp", qtbot)
    qtbot.waitUntil(lambda: reasons(opened)[:4] == ["", "a turn, sharp", "a turn, sharp", ""])
    assert [step.step for step in table.selected_steps()] == [2, 3], "they stay selected, to be taken in again"
    opened.steps.copy()
    lines = list(csv.DictReader(QGuiApplication.clipboard().text().splitlines()))
    assert [(line["step"], line["left_out"]) for line in lines] == [("2", "a turn, sharp"), ("3", "a turn, sharp")]


@pytest.fixture
def often(monkeypatch):
    """Notes of other programs are looked for at once, and not once a second."""
    monkeypatch.setattr("underfoot.widgets.recordings.recording_follower.POLL_MS", 10)


def test_what_another_program_notes_is_seen_also_after_what_cannot_be_read(often, opened, qtbot):
    path, step = opened.axis.content.opened.path, opened.steps.visible_steps()[1]
    with Recording(path) as other, closing(sqlite3.connect(path)) as damaged:
        other.leave_out([(opened.axis.content.opened.first + round(step.start_s * 48_000.0), step.tile)], "turned")
        qtbot.waitUntil(lambda: reasons(opened)[:3] == ["", "turned", ""])
        with qtbot.waitSignal(opened.reader.failed), damaged:
            damaged.execute("insert into left_out values ('soon', 't1', 'no frame', 'anna', '')")
        with damaged:
            damaged.execute("delete from left_out where why = 'no frame'")
        other.add_mark(48_000, "door")
        qtbot.waitUntil(lambda: [mark.text for mark in opened.axis.content.opened.marks] == ["door"])
