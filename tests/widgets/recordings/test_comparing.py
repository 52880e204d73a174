"""Recordings compared in the window, by mouse and keys."""

import csv

import pytest
from long_recording import write_recording
from made_steps import STEP
from msgspec.structs import replace
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QMessageBox

from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording
from underfoot.records.survey import RecordedForces, Stance, Survey, cache_survey

CONTACT_MS = {"before": (600.0, 620.0), "after": (640.0, 650.0)}


@pytest.fixture
def two(workspace, folder, qtbot):
    """The workspace with two recordings, the earlier one open; steps are those of `CONTACT_MS`, left and right, the
    later ones of two persons."""
    for day, (name, contacts_ms) in enumerate(CONTACT_MS.items()):
        path = folder / f"{name}.underfoot"
        about = {"begun": f"2026-11-{24 + day}T10:00:00"}
        write_recording(path, 0.5, default_floor(1, 2), vibration=False, about=about)
        steps = [
            Stance(replace(STEP, contact_ms=ms, side=side, person=person), (ms,) * 101)
            for side, person, ms in zip(("left", "right"), (1, 1 + day), contacts_ms, strict=True)
        ]
        with Recording(path) as recording:
            cache_survey(recording, Survey(steps=steps, until_s=RecordedForces(recording).length_s, whole=True))
    workspace.recordings.refresh()
    qtbot.waitUntil(lambda: item_of(workspace, "before").text().count("\n") == 2)
    qtbot.waitUntil(lambda: item_of(workspace, "after").text().count("\n") == 2)
    click(workspace, "before")
    qtbot.waitUntil(lambda: workspace.axis.content is not None and len(workspace.steps.visible_steps()) == 2)
    return workspace


def item_of(workspace, name):
    shown = workspace.recordings.list
    return next(item for row in range(shown.count()) if (item := shown.item(row)).text().startswith(name))


def click(workspace, name, modifiers=Qt.KeyboardModifier.NoModifier):
    shown = workspace.recordings.list
    at = shown.visualItemRect(item_of(workspace, name)).center()
    QTest.mouseClick(shown.viewport(), Qt.MouseButton.LeftButton, modifiers, at)


def row_of(workspace, heading):
    """The texts of a row of the comparison; of all columns from the first group on."""
    table = workspace.comparison.table
    row = next(row for row in range(table.rowCount()) if table.item(row, 0).text() == heading)
    return [table.item(row, column).text() for column in range(1, table.columnCount())]


def test_two_recordings_that_are_chosen_are_side_by_side_until_escape(two, qtbot, folder):
    view = two.comparison
    click(two, "after", Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: len(view.table.groups) == 2)
    assert view.isVisible()
    assert [view.table.horizontalHeaderItem(place).text() for place in (1, 2, 3)] == ["before", "after", "Difference"]
    assert row_of(two, "Contact, ms") == ["610 ± 14", "645 ± 7", "+35 (+5.7 %)"]
    of_each = [view.table.item(2, column).toolTip() for column in (1, 2)]
    assert of_each == ["Mean ± SD of 2 steps", "Mean ± SD of 2 steps of 2 persons together"]
    assert [one.name for one in view.plot.drawing.series if one.style == "line"] == ["before", "after"]
    two.recordings.search.setText("before")
    (folder / "another.underfoot").touch()
    two.recordings.refresh()  # as when a recording has ended
    two.recordings.search.clear()
    assert [path.stem for path in two.recordings.chosen_paths()] == ["before", "after"]
    view.table.setFocus()
    QTest.keyClick(view.table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    lines = list(csv.DictReader(QGuiApplication.clipboard().text().splitlines(), delimiter="\t"))
    assert {line["measure"]: line["after difference"] for line in lines}["contact_ms"] == "35"
    QTest.keyClick(view.table, Qt.Key.Key_M)  # a mark would be put into a recording that is not seen
    view.by.setCurrentIndex(view.by.findData("side"))
    assert row_of(two, "Contact, ms") == ["600", "620", "+20 (+3.3 %)", "640", "+40 (+6.7 %)", "650", "+50 (+8.3 %)"]
    QTest.keyClick(view.table, Qt.Key.Key_Escape)
    assert not view.isVisible()
    assert [path.stem for path in two.recordings.chosen_paths()] == ["before"]
    assert not two.axis.content.opened.marks


def test_the_feet_of_one_recording_are_compared_renamed_and_saved(two, qtbot, folder):
    view = two.comparison
    shown = two.recordings.list.viewport()
    qtbot.mouseClick(shown, Qt.MouseButton.LeftButton, pos=shown.rect().bottomLeft() + QPoint(9, -9))
    assert [path.stem for path in two.recordings.chosen_paths()] == ["before"]  # which is still open
    qtbot.mouseClick(two.steps.compare_button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(view.table.groups) == 2)
    assert row_of(two, "Contact, ms") == ["600", "620", "+20 (+3.3 %)"]
    QTest.keyClick(view.table, Qt.Key.Key_F2)
    QTest.keyClicks(two.recordings.inline, "shod")
    QTest.keyClick(two.recordings.inline, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: view.facts.full_text == "shod")
    assert two.export()
    two.window().findChild(QFileDialog).fileSelected.emit(str(folder / "feet.csv"))
    assert (folder / "feet.csv").read_text().startswith("measure,left n,left mean,left SD,right n")
    assert (folder / "feet.stance.csv").read_text().splitlines()[1] == "0,600,,620,"
    qtbot.mouseClick(view.close_button, Qt.MouseButton.LeftButton)
    assert not view.isVisible()


def test_a_selection_by_shift_goes_on_when_the_list_is_read_anew(two, qtbot):
    two.recordings.list.setFocus()
    QTest.keyClick(two.recordings.list, Qt.Key.Key_Up, Qt.KeyboardModifier.ShiftModifier)
    assert [path.stem for path in two.recordings.chosen_paths()] == ["before", "after"]
    two.recordings.refresh()  # as when the steps of the open one were found
    QTest.keyClick(two.recordings.list, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    assert [path.stem for path in two.recordings.chosen_paths()] == ["before"]


def test_the_earliest_is_the_first_also_where_that_is_read_after_they_were_chosen(two, qtbot, folder):
    """They were in the order in which their files were written last, as by a copy or by a mark."""
    begun = {"begun": "2026-11-01T10:00:00"}
    write_recording(folder / "first.underfoot", 0.5, default_floor(1, 2), vibration=False, about=begun)
    two.recordings.refresh()
    click(two, "first")
    click(two, "after", Qt.KeyboardModifier.ControlModifier)
    assert [path.stem for path in two.comparison.paths] == ["after", "first"]
    qtbot.waitUntil(lambda: two.axis.content is not None and two.axis.content.opened.path.stem == "first")
    assert len(two.recordings.chosen_paths()) == 2  # also once the first has been opened
    qtbot.waitUntil(lambda: [path.stem for path in two.comparison.paths] == ["first", "after"])


def test_a_recording_that_is_renamed_while_its_steps_are_looked_for_is_compared_under_its_new_name(two, qtbot, folder):
    view = two.comparison
    write_recording(folder / "new.underfoot", 3.0, default_floor(1, 2), vibration=False)
    two.recordings.refresh()
    two.recordings.compared.emit([folder / "new.underfoot"])  # as of its context menu
    qtbot.waitUntil(lambda: "looking" in view.facts.full_text)
    two.recordings.rename_requested.emit(folder / "new.underfoot", "named")
    qtbot.waitUntil(lambda: view.paths == [folder / "named.underfoot"])
    qtbot.waitUntil(lambda: view.plot.drawing.note == "no steps whose side is known")
    assert view.facts.full_text == "named"


def test_steps_that_nobody_has_looked_for_are_found_and_what_is_damaged_is_left_out(two, qtbot, folder):
    view, said = two.comparison, []
    two.notified.connect(said.append)
    write_recording(folder / "new.underfoot", 3.0, default_floor(1, 2), vibration=False)
    (folder / "torn.underfoot").write_bytes(b"SQLite format 3\0" + bytes(200))
    two.recordings.refresh()
    two.recordings.list.setFocus()
    QTest.keyClick(two.recordings.list, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: len(view.table.groups) == 3 and view.save_button.isEnabled(), timeout=60_000)
    assert {path.stem for path in view.paths} == {"before", "after", "new"}
    assert next(group for group in view.table.groups if group.name == "new").steps >= 2
    assert len(said) == 1
    assert "torn.underfoot" in said[0]
    assert view.copy_button.isEnabled()


def test_of_more_than_a_table_is_read_of_it_says_what_compares_them(two, qtbot, folder):
    for k in range(11):
        (folder / f"{k}.underfoot").write_bytes((folder / "before.underfoot").read_bytes())
    two.recordings.refresh()
    qtbot.waitUntil(lambda: two.recordings.list.count() == 13)
    with qtbot.waitSignal(two.notified) as said:
        QTest.keyClick(two.recordings.list, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    assert said.args == ["13 are chosen; up to 12 are compared here, more by underfoot compare."]
    assert not two.comparison.isVisible()


def test_all_that_are_chosen_are_deleted_at_once_and_no_longer_compared(two, qtbot, folder):
    click(two, "after", Qt.KeyboardModifier.ControlModifier)
    qtbot.waitUntil(lambda: len(two.comparison.table.groups) == 2)
    QTest.keyClick(two.recordings.list, Qt.Key.Key_Delete)
    box = next(one for one in two.recordings.findChildren(QMessageBox) if one.isVisible())
    assert box.text() == "Move 2 recordings to the trash?\n\nbefore\nafter"
    with qtbot.waitSignal(
        two.recordings.notified, check_params_cb=lambda text: text == "2 recordings are in the trash."
    ):
        QTest.mouseClick(box.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
    assert not list(folder.glob("*.underfoot"))
    assert not two.comparison.isVisible()
    assert two.axis.content is None
    assert two.readout.map.accessibleDescription() == "no floor"  # and not the one of what is gone


def test_of_several_the_one_that_cannot_be_deleted_is_told_last(two, qtbot, folder, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "file" / "share"))  # so that there is no trash
    click(two, "after", Qt.KeyboardModifier.ControlModifier)
    said = []
    two.recordings.notified.connect(said.append)
    QTest.keyClick(two.recordings.list, Qt.Key.Key_Delete)
    (folder / "before.underfoot").unlink()
    (folder / "before.underfoot").mkdir()
    for question in ("Move 2 recordings to the trash?", "There is no trash for 2 recordings."):
        qtbot.waitUntil(lambda: any(one.isVisible() for one in two.recordings.findChildren(QMessageBox)))
        box = next(one for one in two.recordings.findChildren(QMessageBox) if one.isVisible())
        assert box.text().startswith(question)
        QTest.mouseClick(box.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
    assert said[0] == "after.underfoot is deleted."
    assert "before.underfoot cannot be deleted" in said[-1]
