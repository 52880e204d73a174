"""A recording gets another name in the list: by F2, by the menu, and only if nothing is lost by it."""

import shutil
import threading
from itertools import pairwise

import pytest
from long_recording import write_recording
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu, QMessageBox, QWidget
from recordings_shown import place_on

from underfoot.engine.survey_process import Progress
from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer
from underfoot.records.survey import load_cached_survey

TIMEOUT_S = 60.0


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("walks") / "walk.underfoot", 2.0, default_floor(1, 2))


@pytest.fixture
def folder(folder, walk):
    """Where the program records, with two recordings."""
    for name in ("monday", "tuesday"):
        shutil.copy(walk, folder / f"{name}.underfoot")
    return folder


@pytest.fixture
def workspace(qtbot, workspace):
    """The workspace on the screen, with Monday open and its steps found."""
    click(workspace, "monday")
    qtbot.waitUntil(lambda: workspace.axis.content is not None and workspace.axis.content.overview is not None)
    qtbot.waitUntil(lambda: not workspace.surveyor.is_busy)
    return workspace


def names(workspace):
    items = (workspace.recordings.list.item(row) for row in range(workspace.recordings.list.count()))
    return sorted(item.text().split("\n")[0] for item in items)


def place(workspace, name):
    items = [workspace.recordings.list.item(row) for row in range(workspace.recordings.list.count())]
    item = next(item for item in items if item.text().split("\n")[0] == name)
    return workspace.recordings.list.visualItemRect(item).center()


def click(workspace, name):
    QTest.mouseClick(workspace.recordings.list.viewport(), Qt.MouseButton.LeftButton, pos=place(workspace, name))


def type_name(workspace, name, key=Qt.Key.Key_Return):
    """Press F2, type a name over the present one, and press a key."""
    QTest.keyClick(workspace.recordings.list, Qt.Key.Key_F2)
    assert workspace.recordings.inline.isVisible()
    QTest.keyClicks(workspace.recordings.inline, name)
    QTest.keyClick(workspace.recordings.inline, key)
    assert not workspace.recordings.inline.isVisible()


def test_f2_renames_the_open_one_which_stays_open_where_it_was_looked_at(workspace, folder, qtbot):
    workspace.axis.set_view(0.5, 1.0)
    workspace.axis.set_cursor(0.75)
    type_name(workspace, "first walk")
    qtbot.waitUntil(lambda: workspace.title.text() == "first walk")
    assert names(workspace) == ["first walk", "tuesday"]
    assert sorted(path.name for path in folder.iterdir()) == ["first walk.underfoot", "tuesday.underfoot"]
    assert workspace.recordings.chosen_path() == folder / "first walk.underfoot"
    assert (workspace.axis.view.begin_s, workspace.axis.cursor_s) == (0.5, 0.75)
    workspace.axis.setFocus()
    qtbot.keyClick(workspace.axis, Qt.Key.Key_M)  # the file that is open now is the renamed one
    qtbot.waitUntil(lambda: len(workspace.axis.content.opened.marks) == 1)
    with Recording(folder / "first walk.underfoot") as recording:
        assert len(recording.marks()) == 1


def test_escape_keeps_the_name(workspace, folder):
    type_name(workspace, "nothing", Qt.Key.Key_Escape)
    assert names(workspace) == ["monday", "tuesday"]
    assert workspace.recordings.list.hasFocus()


def test_the_menu_renames_what_is_under_the_mouse(workspace, folder, qtbot):
    qtbot.mouseClick(workspace.recordings.list.viewport(), Qt.MouseButton.RightButton, pos=place(workspace, "tuesday"))
    at = place(workspace, "tuesday")
    event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, workspace.recordings.list.viewport().mapToGlobal(at))
    QApplication.sendEvent(workspace.recordings.list.viewport(), event)
    menu = next(one for one in workspace.recordings.list.findChildren(QMenu) if one.isVisible())
    assert [action.text() for action in menu.actions()] == ["Compare left and right", "Rename…\tF2", "Delete…\tDel"]
    qtbot.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(menu.actions()[1]).center())
    assert workspace.recordings.inline.toPlainText() == "tuesday"
    QTest.keyClicks(workspace.recordings.inline, "wednesday")
    click(workspace, "monday")  # a click elsewhere commits, and opens what was clicked
    qtbot.waitUntil(lambda: names(workspace) == ["monday", "wednesday"])
    qtbot.waitUntil(lambda: workspace.title.text() == "monday" and workspace.axis.content is not None)
    assert workspace.recordings.chosen_path() == folder / "monday.underfoot"


def test_a_recording_that_is_renamed_while_it_is_being_opened_is_surveyed_under_its_new_name(workspace, folder, qtbot):
    said, found = [], []
    workspace.notified.connect(said.append)
    workspace.surveyor.found.connect(lambda survey: found.append(survey.whole))
    click(workspace, "tuesday")
    type_name(workspace, "wednesday")  # nothing of the recording was shown yet
    qtbot.waitUntil(lambda: True in found or bool(said))
    assert not said
    assert workspace.title.text() == "wednesday"
    with Recording(folder / "wednesday.underfoot") as recording:
        assert load_cached_survey(recording).whole


def test_what_is_opened_while_another_is_clicked_is_not_shown_in_its_place(workspace, qtbot):
    """It was shown for a moment, and its survey went on: its steps came into the recording that was clicked then."""
    is_opened, shown = threading.Event(), []
    workspace.reader.opened.connect(is_opened.set, Qt.ConnectionType.DirectConnection)
    workspace.reader.opened.connect(lambda _: shown.append(workspace.title.text()))
    click(workspace, "tuesday")
    assert is_opened.wait(TIMEOUT_S)  # in the reader's thread, and not told in this one yet
    click(workspace, "monday")
    qtbot.waitUntil(lambda: len(shown) == 2)
    assert shown == ["monday", "monday"]
    assert workspace.recordings.chosen_path().stem == "monday"
    assert not workspace.surveyor.is_busy


@pytest.mark.parametrize(
    ("typed", "why"),
    [("tuesday", "tuesday.underfoot is there already; choose another name"), ("a/b", "'a/b' is not a file name")],
)
def test_a_name_that_cannot_be_is_refused_below_the_list(workspace, folder, qtbot, typed, why):
    type_name(workspace, typed)
    problem = workspace.recordings.problem
    qtbot.waitUntil(problem.isVisible)
    assert problem.text().startswith(why)
    assert names(workspace) == ["monday", "tuesday"]
    workspace.axis.setFocus()
    qtbot.keyClick(workspace.axis, Qt.Key.Key_M)  # it is still open
    qtbot.waitUntil(lambda: len(workspace.axis.content.opened.marks) == 1)
    click(workspace, "tuesday")
    assert not problem.isVisible()


def test_a_recording_that_is_being_recorded_or_exported_stays_as_it_is(workspace, folder, qtbot, monkeypatch):
    monkeypatch.setattr(workspace.follower, "is_written", lambda path: path.stem == "monday")
    type_name(workspace, "later")
    assert "monday.underfoot is being recorded; stop that" in workspace.recordings.problem.text()
    monkeypatch.undo()
    monkeypatch.setattr(workspace.exporting, "is_reading", lambda path: True)
    type_name(workspace, "later")
    assert "monday.underfoot is being exported" in workspace.recordings.problem.text()
    workspace.recordings.show_problem("")
    QTest.keyClick(workspace.recordings.list, Qt.Key.Key_Delete)
    assert "monday.underfoot is being exported" in workspace.recordings.problem.text()
    monkeypatch.undo()
    monkeypatch.setattr("underfoot.records.renaming.PATIENCE_S", 0.05)
    with Recording(folder / "tuesday.underfoot") as recording:
        about = recording.about
    writer = Writer(folder / "tuesday.underfoot", about, resume=True)  # another program records
    writer.set_about("target", "elsewhere")
    click(workspace, "tuesday")
    qtbot.waitUntil(lambda: workspace.title.text() == "tuesday" and workspace.axis.content is not None)
    type_name(workspace, "later")
    qtbot.waitUntil(lambda: "cannot be renamed: it is being recorded or read" in workspace.recordings.problem.text())
    QTest.keyClick(workspace.recordings.list, Qt.Key.Key_Delete)
    box = next(one for one in workspace.recordings.findChildren(QMessageBox) if one.isVisible())
    QTest.mouseClick(box.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: "cannot be deleted: it is being recorded or read" in workspace.recordings.problem.text())
    qtbot.waitUntil(lambda: workspace.title.text() == "tuesday" and workspace.axis.content is not None)
    workspace.reader.close()
    writer.close()
    assert sorted(path.name for path in folder.glob("*.underfoot")) == ["monday.underfoot", "tuesday.underfoot"]


def test_a_single_file_that_was_added_is_found_under_its_new_name(qtbot, workspace, walk, tmp_path):
    path = shutil.copy(walk, tmp_path / "own.underfoot")
    workspace.open_file(path)
    qtbot.waitUntil(lambda: workspace.title.text() == "own" and workspace.axis.content is not None)
    workspace.recordings.list.setFocus()
    type_name(workspace, "mine")
    qtbot.waitUntil(lambda: workspace.title.text() == "mine")
    assert names(workspace) == ["mine", "monday", "tuesday"]


def test_a_long_list_shows_the_field_at_the_item(workspace):
    QTest.keyClick(workspace.recordings.list, Qt.Key.Key_F2)
    inline = workspace.recordings.inline
    item = workspace.recordings.list.visualItemRect(workspace.recordings.list.currentItem())
    assert item.contains(inline.geometry().center())
    assert item.topLeft() != QPoint()
    QTest.keyClick(inline, Qt.Key.Key_Escape)


def test_a_long_name_is_cut_off_and_lies_over_nothing_in_a_narrow_window(qtbot, workspace):
    """It lay over what was being done, and over the first buttons."""
    name = "2026-11-29 participant 17 second day"
    type_name(workspace, name)
    qtbot.waitUntil(lambda: workspace.title.toolTip() == name or workspace.title.text() == name)
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    workspace.resize(900, 548)
    for doing in ("Looking for footsteps", ""):
        workspace.surveyor.progressed.emit(Progress(doing, 0.68))
        QApplication.processEvents()
        row = workspace.title.parentWidget().findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly)
        shown = sorted((one.geometry() for one in row if one.isVisible()), key=QRect.left)
        assert all(left.right() < right.left() for left, right in pairwise(shown))
        assert workspace.title.text().startswith("2026-11")
        assert workspace.title.toolTip() == name


def test_the_unit_of_a_low_track_is_beside_it_and_not_over_its_curve(workspace, qtbot):
    workspace.resize(900, 548)
    qtbot.waitUntil(lambda: not workspace.surveyor.is_busy and workspace.axis.content.overview is not None)
    QApplication.processEvents()
    axis = workspace.axis
    name = QRect(0, round(place_on(axis, 0.0, "commanded").y()) + 5, 60, 8)  # below "Commanded,"
    picture = axis.grab(name).toImage()
    assert len({picture.pixel(x, y) for x in range(name.width()) for y in range(name.height())}) > 1
