"""The Recordings workspace, used by mouse and keys."""

import csv
import math
import multiprocessing
import os
import shutil
import sqlite3
from contextlib import closing
from datetime import datetime
from itertools import combinations

import numpy as np
import pytest
from long_recording import write_recording
from on_screen import show
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QContextMenuEvent, QDragEnterEvent, QDropEvent, QFontMetricsF, QGuiApplication, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog, QMessageBox, QStyle, QStyleOptionViewItem
from recordings_shown import place_on
from windows import quiet_window

from underfoot.engine.survey_process import Progress
from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording
from underfoot.records.summary import Summary
from underfoot.records.survey import ContactSpan
from underfoot.widgets import theme
from underfoot.widgets.controls.step_table import COLUMNS
from underfoot.widgets.dialogs.export_dialog import ExportDialog as PatchDialog
from underfoot.widgets.recordings.exporting import ExportDialog
from underfoot.widgets.recordings.readout import contacts_at
from underfoot.widgets.recordings.recording_list import Summaries, summary_text
from underfoot.widgets.recordings.steps import RecordedSteps


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Six seconds of somebody who walks on two tiles."""
    return write_recording(tmp_path_factory.mktemp("walks") / "walk.underfoot", 6.0, default_floor(1, 2))


@pytest.fixture
def opened(workspace, walk, qtbot):
    """The workspace with a recording whose steps were found."""
    workspace.open_file(walk)
    qtbot.waitUntil(lambda: workspace.axis.content is not None and workspace.axis.content.overview is not None)
    qtbot.waitUntil(lambda: len(workspace.steps.visible_steps()) >= 6 and not workspace.surveyor.is_busy)
    workspace.axis.setFocus()
    return workspace


def wheel(axis, at, degrees, modifiers=Qt.KeyboardModifier.NoModifier):
    event = QWheelEvent(
        at, axis.mapToGlobal(at), QPoint(), QPoint(0, 8 * degrees), Qt.MouseButton.NoButton, modifiers,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(axis, event)


def drag(axis, begin, end, modifiers=Qt.KeyboardModifier.NoModifier):
    QTest.mousePress(axis, Qt.MouseButton.LeftButton, modifiers, begin.toPoint())
    for share in (0.5, 1.0):
        QTest.mouseMove(axis, (begin + share * (end - begin)).toPoint())
    QTest.mouseRelease(axis, Qt.MouseButton.LeftButton, modifiers, end.toPoint())


def test_the_list_says_when_how_long_on_which_floor_and_is_searched(workspace, folder, walk, qtbot):
    for day, name in enumerate(("tuesday", "monday")):  # a mark in Monday's writes that file anew
        shutil.copy(walk, folder / f"{name}.underfoot")
        with closing(sqlite3.connect(folder / f"{name}.underfoot", isolation_level=None)) as file:
            file.execute("insert into about values ('begun', ?)", [f"2026-11-{24 - day}T10:00:00"])
        os.utime(folder / f"{name}.underfoot", (86_400.0 * day, 86_400.0 * day))
    (folder / "notes.txt").write_text("no recording")
    workspace.recordings.refresh()
    shown = workspace.recordings.list
    items = [shown.item(row) for row in range(shown.count())]
    assert sorted(item.text().split("\n")[0] for item in items) == ["monday", "tuesday"]
    qtbot.waitUntil(lambda: all("6 s" in item.text() and "1 × 2" in item.text() for item in items))
    assert [shown.item(row).text().split("\n")[0] for row in range(2)] == ["tuesday", "monday"]
    qtbot.keyClicks(workspace.recordings.search, "tues")
    assert [item.text().split("\n")[0] for item in items if not item.isHidden()] == ["tuesday"]
    qtbot.keyClicks(workspace.recordings.search, " 1x2")
    assert [item.isHidden() for item in items].count(False) == 1
    assert not workspace.recordings.empty_text.isVisible()
    qtbot.keyClicks(workspace.recordings.search, " 3x3")
    assert workspace.recordings.empty_text.isVisible()
    assert workspace.recordings.empty_text.text().startswith("No recording has these words")


def test_a_click_opens_and_what_was_found_is_there_the_next_time(workspace, folder, walk, qtbot):
    shutil.copy(walk, folder / "monday.underfoot")
    workspace.recordings.refresh()
    panel, said = workspace.steps, []
    workspace.reader.opened.connect(lambda _: said.append((panel.count.text(), panel.plot.drawing.note)))
    place = workspace.recordings.list.visualItemRect(workspace.recordings.list.item(0)).center()
    qtbot.mouseClick(workspace.recordings.list.viewport(), Qt.MouseButton.LeftButton, pos=place)
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    assert workspace.title.text() == "monday"
    qtbot.waitUntil(lambda: bool(workspace.axis.content.steps) and not workspace.surveyor.is_busy)
    steps = len(workspace.axis.content.steps)
    assert panel.count.text() == str(steps)
    workspace.open(folder / "monday.underfoot")
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    assert len(workspace.axis.content.steps) == steps
    assert said == [("none yet", "looking for steps…"), (str(steps), "")]
    assert not workspace.surveyor.is_busy


def test_wheel_keys_and_drags_zoom_scroll_scrub_and_select(opened, qtbot):
    axis = opened.axis
    at = place_on(axis, 3.0, "force")
    wheel(axis, at, 120)
    wheel(axis, at, 120)
    assert axis.view.end_s - axis.view.begin_s < 3.0
    assert axis.time_at(at.x()) == pytest.approx(3.0, abs=0.02)
    begin_s = axis.view.begin_s
    wheel(axis, at, -120, Qt.KeyboardModifier.ShiftModifier)
    assert axis.view.begin_s > begin_s
    qtbot.keyClick(axis, Qt.Key.Key_0)
    assert (axis.view.begin_s, axis.view.end_s) == (0.0, pytest.approx(6.0, abs=0.01))
    drag(axis, place_on(axis, 1.0, "force"), place_on(axis, 2.0, "force"))
    assert axis.cursor_s == pytest.approx(2.0, abs=0.02)
    qtbot.waitUntil(lambda: opened.readout.text.full_text.startswith(f"{axis.cursor_s:.3f} s"))
    assert all(unit in opened.readout.text.full_text for unit in (" N", "commanded", "measured"))
    drag(axis, place_on(axis, 2.0, "force"), place_on(axis, 4.0, "force"), Qt.KeyboardModifier.ShiftModifier)
    assert axis.selection == (pytest.approx(2.0, abs=0.02), pytest.approx(4.0, abs=0.02))
    qtbot.keyClick(axis, Qt.Key.Key_Backspace)
    assert axis.selection is None
    qtbot.keyClick(axis, Qt.Key.Key_Right, Qt.KeyboardModifier.ShiftModifier)
    assert axis.cursor_s == pytest.approx(2.001, abs=0.02)


def test_the_time_axis_shows_that_it_has_the_focus(opened):
    axis = opened.axis
    edges = []
    for focused in (axis, opened.recordings.search):
        focused.setFocus()
        edges.append(axis.grab().toImage().pixelColor(axis.width() // 2, axis.height() - 1).name())
    assert [edge == theme.VIBRATION for edge in edges] == [True, False]


def test_the_list_of_keys_has_those_of_the_ends_and_of_a_mark_that_is_removed(workspace):
    told = dict(workspace.shortcuts)
    assert told["Cursor to the beginning, to the end"] == "Home, End"
    assert told["Mark; mark with a text; remove the nearest mark"].endswith("Shift+Backspace")


def test_what_is_seen_goes_on_with_what_is_played(opened):
    axis = opened.axis
    axis.set_view(1.0, 2.0)
    for time_s, begin_s in ((1.5, 1.0), (2.1, 2.1), (0.5, 0.5), (math.nan, 0.5), (5.0, 0.5), (5.2, 0.5)):
        axis.set_playing(time_s)
        assert (axis.view.begin_s, axis.view.end_s) == (begin_s, pytest.approx(begin_s + 1.0))


def test_the_cursor_reads_newtons_acceleration_hertz_and_decibels(opened, qtbot):
    """The recording is of 200 Hz: 1 mm/s² a newton was asked, and 0.8 of it was done."""
    moments = []
    opened.reader.cursor_values_read.connect(moments.append)
    step = opened.axis.content.steps[2].step
    opened.readout.choose_tile(opened.axis.content.opened.floor.index(step.tile))
    opened.axis.set_cursor(step.start_s + 0.4 * 1e-3 * step.contact_ms)
    qtbot.waitUntil(lambda: "200 Hz" in opened.readout.text.full_text)
    assert "dB" in opened.readout.text.full_text
    moment = moments[-1]
    assert moment.vibration["measured"].peak_m_s2 == pytest.approx(0.8 * moment.vibration["commanded"].peak_m_s2)
    assert moment.vibration["commanded"].peak_m_s2 == pytest.approx(1e-3 * moment.corners_n.sum(axis=1).max(), rel=0.25)


def test_close_up_it_shows_the_samples_themselves(opened, qtbot):
    step = opened.axis.content.steps[2].step
    opened.axis.set_view(step.start_s + 0.2, step.start_s + 0.25)
    qtbot.waitUntil(lambda: opened.axis.content.detail is not None and opened.axis.content.detail.frames < 10.0)
    samples = opened.axis.content.detail.envelopes["commanded"]
    assert (samples.end - samples.begin == 1.0).all()
    opened.axis.repaint()


def test_m_marks_the_cursor_in_the_file(workspace, folder, walk, qtbot):
    path = folder / "marked.underfoot"
    shutil.copy(walk, path)
    workspace.open_file(path)
    qtbot.waitUntil(lambda: workspace.axis.content is not None and workspace.axis.content.overview is not None)
    workspace.axis.setFocus()
    workspace.axis.set_cursor(1.5)
    qtbot.keyClick(workspace.axis, Qt.Key.Key_M)
    qtbot.waitUntil(lambda: len(workspace.axis.content.opened.marks) == 1)
    with Recording(path) as recording:
        assert [mark.frame for mark in recording.marks()] == [72_000]
    qtbot.keyClick(workspace.axis, Qt.Key.Key_Backspace, Qt.KeyboardModifier.ShiftModifier)
    qtbot.waitUntil(lambda: not workspace.axis.content.opened.marks)


def test_no_contact_hides_another_where_many_are_on_the_floor(opened):
    """There were four rows of them; the bars of more feet lay on each other."""
    content = opened.axis.content
    content.show_survey([ContactSpan(k, 1.0 + 0.01 * k, 2.0 + 0.01 * k, (0,)) for k in range(1, 17)], [])
    painter = opened.axis.painter()
    bars, track, tiles = [bar for _, bar in painter.bars()], painter.tracks["contacts"], painter.tracks["tiles"]
    assert tiles.bottom - tiles.top >= 13.0 * len(content.opened.floor.tiles)  # each row has room for its name
    assert [one.intersects(other) for one, other in combinations(bars, 2)] == [False] * math.comb(16, 2)
    assert track.top <= min(bar.top() for bar in bars) < max(bar.bottom() for bar in bars) <= track.bottom
    measured, image = painter.tracks["measured"], opened.axis.grab().toImage()
    assert measured.bottom <= image.height()
    colours = {image.pixelColor(x, round(measured.top + measured.bottom) // 2).name() for x in range(image.width())}
    assert theme.PALETTE["measured"] in colours  # as in Design and Monitor


def test_a_click_on_a_step_chooses_its_row_curve_and_time(opened, qtbot):
    third = opened.axis.content.steps[3].step
    at = next(bar for contact, bar in opened.axis.painter().bars() if contact.id == third.contact).center()
    qtbot.mouseClick(opened.axis, Qt.MouseButton.LeftButton, pos=at.toPoint())
    assert opened.steps.table.selected_steps() == [third]
    assert opened.axis.cursor_s == third.start_s
    assert opened.axis.selection == (third.start_s, pytest.approx(third.start_s + 1e-3 * third.contact_ms))
    assert [series.name for series in opened.steps.plot.drawing.series][-1] == f"step {third.step}"
    qtbot.keyClick(opened.axis, Qt.Key.Key_Period)
    assert opened.steps.table.selected_steps() == [opened.axis.content.steps[4].step]
    opened.steps.table.selectRow(0)
    qtbot.waitUntil(lambda: opened.axis.view.step == 0)


def test_next_and_last_step_go_from_the_cursor_and_from_the_table_too(opened, qtbot):
    starts_s = [step.step.start_s for step in opened.axis.content.steps]
    opened.axis.set_cursor(0.5 * (starts_s[3] + starts_s[4]))
    opened.steps.table.setFocus()
    for key, step in ((Qt.Key.Key_Period, 4), (Qt.Key.Key_Period, 5), (Qt.Key.Key_Comma, 4)):
        qtbot.keyClick(opened.steps.table, key)
        assert opened.axis.cursor_s == starts_s[step]
    opened.axis.set_cursor(0.5 * (starts_s[3] + starts_s[4]))
    qtbot.keyClick(opened.steps.table, Qt.Key.Key_Comma)
    assert opened.axis.cursor_s == starts_s[3]


def test_next_and_last_step_pass_over_what_is_filtered_out(opened, qtbot):
    panel, steps = opened.steps, [step.step for step in opened.axis.content.steps]
    tile = steps[0].tile
    panel.filters["tile"].setCurrentIndex(panel.filters["tile"].findData(tile))
    passing_s = sorted(step.start_s for step in steps if step.tile == tile)
    assert 2 <= len(passing_s) < len(steps)
    opened.axis.set_cursor(0.0)
    for start_s in passing_s:
        qtbot.keyClick(opened.axis, Qt.Key.Key_Period)
        assert opened.axis.cursor_s == start_s
    other = next(step for step in steps if step.tile != tile)
    bar = next(bar for contact, bar in opened.axis.painter().bars() if contact.id == other.contact)
    qtbot.mouseClick(opened.axis, Qt.MouseButton.LeftButton, pos=bar.center().toPoint())
    assert opened.axis.cursor_s == other.start_s
    assert panel.table.selected_steps() == []


def test_feet_stand_on_the_map_where_they_press(opened):
    for contact in opened.axis.content.contacts:
        (found,) = (one for one in contacts_at(opened.axis.content, contact.start_s + 0.2) if one.id == contact.id)
        tile = opened.axis.content.opened.floor.tiles[contact.tiles[0]]
        assert np.abs(np.array([found.x_m, found.y_m]) - tile.centre_m).max() < 0.6 * tile.size_m[0]
        assert 0.3 * max(force_n for _, _, force_n in contact.places) < found.force_n


def test_a_table_of_a_recording_begins_at_its_first_step(opened):
    assert opened.steps.table.verticalScrollBar().value() == 0


def test_steps_are_sorted_by_keys(opened, qtbot):
    table = opened.steps.table
    middle = table.viewport().rect().center()
    for sign in (1.0, -1.0):  # the same column once more: the other way round
        asked = QContextMenuEvent(QContextMenuEvent.Reason.Keyboard, middle, table.viewport().mapToGlobal(middle))
        QApplication.sendEvent(table.viewport(), asked)
        for text in ("Sort by", "Impulse, N·s"):
            menu = QApplication.activePopupWidget()
            while menu.activeAction() is None or menu.activeAction().text() != text:
                QTest.keyClick(menu, Qt.Key.Key_Down)
            QTest.keyClick(menu, Qt.Key.Key_Return)
        impulses = [sign * step.impulse_ns for step in table.steps_in_order()]
        assert impulses == sorted(impulses)


def test_steps_are_sorted_filtered_and_copied(opened):
    table, panel = opened.steps.table, opened.steps
    column = [one.name for one in COLUMNS].index("loading_kn_s")
    table.sortByColumn(column, Qt.SortOrder.DescendingOrder)
    rates = [step.loading_kn_s for step in table.steps_in_order()]
    assert rates == sorted(rates, reverse=True)
    tile = opened.axis.content.steps[0].step.tile
    panel.filters["tile"].setCurrentIndex(panel.filters["tile"].findData(tile))
    assert {step.tile for step in table.steps_in_order()} == {tile}
    assert f"mean of {len(panel.visible_steps())}" in [series.name for series in panel.plot.drawing.series]
    table.clearSelection()
    QTest.mouseClick(panel.copy_button, Qt.MouseButton.LeftButton)
    rows = list(csv.DictReader(QGuiApplication.clipboard().text().splitlines()))
    assert [row["tile"] for row in rows] == [tile] * len(panel.visible_steps())


def test_a_recording_is_deleted_only_once_that_is_confirmed(workspace, folder, walk, qtbot, monkeypatch):
    path = folder / "old.underfoot"
    shutil.copy(walk, path)
    workspace.open_file(path)
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    workspace.axis.select(0.5, 1.0)
    monkeypatch.setattr("underfoot.widgets.recordings.recording_list.move_to_trash", lambda path: False)
    qtbot.mouseClick(workspace.recordings.delete, Qt.MouseButton.LeftButton)
    box = workspace.recordings.findChild(QMessageBox)
    qtbot.mouseClick(box.button(QMessageBox.StandardButton.Cancel), Qt.MouseButton.LeftButton)
    assert path.exists()
    qtbot.mouseClick(workspace.recordings.delete, Qt.MouseButton.LeftButton)
    for _ in ("to the trash", "for good, where there is none"):
        qtbot.waitUntil(lambda: any(one.isVisible() for one in workspace.recordings.findChildren(QMessageBox)))
        box = next(one for one in workspace.recordings.findChildren(QMessageBox) if one.isVisible())
        qtbot.mouseClick(box.button(QMessageBox.StandardButton.Yes), Qt.MouseButton.LeftButton)
    assert not path.exists()
    assert workspace.axis.content is None
    assert workspace.readout.text.full_text == ""
    assert workspace.recordings.list.count() == 0


def test_one_key_exports_the_recording_here_and_the_patch_elsewhere(qtbot, folder, walk, tmp_path):
    window = quiet_window(qtbot, tmp_path / "kept")

    assert window.actions_by_name["export"].shortcut().toString() == "Ctrl+Shift+E"

    def dialogs_after_key():
        window.actions_by_name["export"].trigger()
        found = [type(dialog).__name__ for dialog in window.findChildren(QDialog) if dialog.isVisible()]
        for dialog in window.findChildren(QDialog):
            dialog.close()
        return found

    window.workspaces.choose("Design")
    assert dialogs_after_key() == [PatchDialog.__name__]
    window.workspaces.choose("Recordings")
    assert dialogs_after_key() == []
    assert window.status.message == "No recording is open: choose one in the list, then export it."
    window.open_file(walk)
    qtbot.waitUntil(lambda: window.workspaces["Recordings"].axis.content is not None)
    assert dialogs_after_key() == [ExportDialog.__name__]


def test_a_recording_is_exported_in_a_process_that_can_be_stopped(opened, folder, qtbot):
    said = []
    opened.notified.connect(said.append)
    qtbot.mouseClick(opened.export_button, Qt.MouseButton.LeftButton)
    dialog = opened.window().findChild(ExportDialog)
    dialog.format.setCurrentIndex(dialog.format.findData(".wav"))
    assert dialog.vibration.isVisible()
    assert "force" in dialog.omissions.text()
    dialog.reject()
    opened.exporting.begin(opened.axis.content.opened.path, folder / "walk.wav", "measured")
    qtbot.waitUntil(lambda: not opened.exporting.is_busy)
    assert (folder / "walk.wav").exists()
    assert any("was exported to" in line for line in said)
    opened.exporting.begin(opened.axis.content.opened.path, folder / "walk.csv", "measured")
    opened.exporting.stop()
    qtbot.waitUntil(lambda: not opened.exporting.is_busy)
    assert not (folder / "walk.csv").exists()


@pytest.mark.parametrize("tiles", ["[0,", "[99]"])
def test_damaged_envelopes_are_reported_and_the_next_recording_opens(workspace, folder, walk, qtbot, tiles):
    said = []
    workspace.notified.connect(said.append)
    damaged = folder / "damaged.underfoot"
    shutil.copy(walk, damaged)
    with closing(sqlite3.connect(damaged)) as base:
        base.executescript(f"update envelope set tiles = '{tiles}'")
    workspace.open_file(damaged)
    qtbot.waitUntil(lambda: any("table envelope cannot be read: " in line for line in said))
    workspace.open_file(walk)
    qtbot.waitUntil(lambda: workspace.axis.content is not None and workspace.axis.content.opened.path == walk)
    qtbot.waitUntil(lambda: workspace.axis.content.overview is not None)


def kill(name):
    """Kill a process that the window has just started, as a system without memory does."""
    (child,) = (one for one in multiprocessing.active_children() if one.name == f"underfoot {name}")
    child.kill()


def test_an_export_and_a_survey_that_are_killed_are_said_to_be_lost(opened, folder, qtbot):
    said = []
    opened.notified.connect(said.append)
    path = opened.axis.content.opened.path
    opened.exporting.begin(path, folder / "walk.csv", "measured")
    kill("export")
    qtbot.waitUntil(lambda: not opened.exporting.is_busy)
    assert said == ["The export was lost: its process ended with signal 9; export it again."]
    opened.surveyor.begin(path)
    kill("survey")
    qtbot.waitUntil(lambda: not opened.surveyor.is_busy)
    assert said[1:] == ["The search for footsteps ended before it was done; open the recording again."]


def test_what_cannot_be_opened_is_said(workspace, folder, qtbot):
    broken = folder / "broken.underfoot"
    broken.write_bytes(b"SQLite format 3\0 and nothing more")
    with qtbot.waitSignal(workspace.notified) as said:
        workspace.open_file(broken)
    assert "broken.underfoot" in said.args[0]
    assert "broken.underfoot" in workspace.axis.note


def test_a_recording_that_a_fault_of_the_disk_took_is_listed_as_one_that_cannot_be_read(workspace, folder, qtbot):
    (folder / "lost.underfoot").write_bytes(bytes(5000))
    (folder / "older.underfoot").mkdir()
    workspace.recordings.refresh()
    assert workspace.recordings.list.count() == 1
    item = workspace.recordings.list.item(0)
    qtbot.waitUntil(lambda: item.text() == "lost\ncannot be read")
    assert "is not a recording" in item.toolTip()


def test_a_recording_dropped_on_the_window_opens_in_the_workspace(qtbot, tmp_path, folder, walk):
    window = quiet_window(qtbot, tmp_path / "kept")
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(walk))])
    none = (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier)
    enter = QDragEnterEvent(QPoint(600, 400), Qt.DropAction.CopyAction, data, *none)
    QApplication.sendEvent(window, enter)
    assert enter.isAccepted()
    QApplication.sendEvent(window, QDropEvent(QPointF(600, 400), Qt.DropAction.CopyAction, data, *none))
    workspace = window.workspaces["Recordings"]
    assert window.workspaces.chosen == "Recordings"
    qtbot.waitUntil(lambda: workspace.axis.content is not None)
    assert str(walk) in window.settings.recordings
    workspace.close_down()


def test_what_was_being_opened_when_the_window_closed_is_not_surveyed(workspace, walk):
    workspace.close_down()
    workspace.surveyor.begin(walk)  # as on a report of the reader that comes after
    assert not workspace.surveyor.is_busy


def test_a_list_that_is_closed_reads_no_more(qtbot, tmp_path):
    summaries = Summaries()
    with qtbot.waitSignal(summaries.failed):
        summaries.read([tmp_path / "nothing.underfoot"])
    summaries.close()
    with qtbot.assertNotEmitted(summaries.failed, wait=50):
        summaries.read([tmp_path / "nothing.underfoot"])


def test_the_title_of_the_plot_of_stances_is_on_the_line_of_the_steps(qtbot):
    steps = RecordedSteps()
    qtbot.addWidget(steps)
    steps.resize(800, 220)
    show(qtbot, steps)
    image, across = steps.grab().toImage(), steps.plot.mapTo(steps, QPoint(0, 0)).x()

    def top(left):
        """The first row with something bright, from here on for the width of a letter or two."""
        places = ((x, y) for y in range(60) for x in range(left, left + 24))
        return next(y for x, y in places if image.pixelColor(x, y).lightness() > 130)

    assert abs(top(2 * theme.GRID) - top(across + theme.GRID)) <= 1


def test_the_list_has_room_for_when_an_hour_was_recorded(workspace, folder, walk, qtbot):
    """Its length ended in dots."""
    for number in range(20):  # with a scroll bar
        shutil.copy(walk, folder / f"{number}.underfoot")
    workspace.recordings.refresh()
    shown = workspace.recordings.list
    qtbot.waitUntil(shown.verticalScrollBar().isVisible)
    hour = Summary(
        folder / "0.underfoot", datetime(2026, 11, 29, 20, 48), 3600.0, default_floor(6, 6), 20_000, np.ones(9)
    )
    item = next(shown.item(row) for row in range(20) if shown.item(row).text().startswith("0"))
    option = QStyleOptionViewItem()
    shown.initViewItemOption(option)
    shown.itemDelegate().initStyleOption(option, shown.indexFromItem(item))
    option.rect = shown.visualItemRect(item)
    margin = shown.style().pixelMetric(QStyle.PixelMetric.PM_FocusFrameHMargin, option, shown) + 1
    room = shown.style().subElementRect(QStyle.SubElement.SE_ItemViewItemText, option, shown).width() - 2 * margin
    assert all(shown.fontMetrics().horizontalAdvance(line) <= room for line in summary_text(hour).split("\n"))


def test_what_is_being_done_keeps_off_the_name_in_a_narrow_window(opened):
    opened.resize(900, 548)
    opened.surveyor.progressed.emit(Progress("Looking for footsteps", 0.68))
    QApplication.processEvents()
    assert opened.title.geometry().right() < opened.progress.geometry().left()
    assert opened.progress.text().startswith("68 %")


def test_the_names_of_tracks_keep_off_the_figures_of_their_axes(opened):
    """Where nothing was played, 0.01 stood in "Commanded,"."""
    metrics = QFontMetricsF(theme.font(theme.SMALL_PX))
    name_px, figure_px = (metrics.horizontalAdvance(text) for text in ("Commanded,", "0.01"))
    axis = opened.axis
    assert 8.0 + name_px + 4.0 <= place_on(axis, 0.0, "commanded").x() - 6.0 - figure_px
