"""Drafts of a study that were not saved: kept on disk, asked about, and there again in the next window."""

import json
import shutil
import threading

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from study_hand import CTRL, UNSAVED, Hand
from windows import dialog_of, quiet_window


@pytest.fixture
def made(qtbot, tmp_path):
    return Hand(qtbot, tmp_path)


def test_what_was_not_saved_is_asked_about_and_outlives_the_window(made):
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Half done")
    made.qtbot.keyClick(made.protocol_editor, Qt.Key.Key_Escape)
    made.answer("Go on with it")
    assert made.protocol_editor.draft is not None
    made.close_down(made.workspace)
    kept = made.folder / "protocols" / UNSAVED
    assert json.loads(kept.read_bytes())["protocol"]["title"] == "Half done"
    again = made.opened()
    again.protocol_editor.restore_unsaved()
    assert again.protocol_editor.draft.raw["title"] == "Half done"
    assert again.protocol_editor.is_changed
    made.qtbot.keyClick(again.protocol_editor, Qt.Key.Key_S, CTRL)
    assert made.protocols() == ["half-done.json"]
    made.qtbot.waitUntil(lambda: not kept.exists())


def test_a_draft_outlives_a_crash_of_its_window_while_another_window_leaves_it_alone(made):
    """It was written only when the window closed."""
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Half done")
    kept = made.folder / "protocols" / UNSAVED
    made.qtbot.waitUntil(kept.is_file)
    other = made.opened().protocol_editor
    other.restore_unsaved()
    assert other.draft is None
    crashed = made.folder / "crashed"
    shutil.copytree(kept.parent, crashed / "protocols", ignore=shutil.ignore_patterns("*.lock"))
    after = Hand(made.qtbot, crashed).protocol_editor
    after.restore_unsaved()
    assert after.draft.raw["title"] == "Half done"
    assert (crashed / "protocols" / UNSAVED).is_file()
    made.qtbot.keyClick(made.protocol_editor, Qt.Key.Key_Escape)
    made.answer("Discard the changes")
    made.qtbot.waitUntil(lambda: not kept.exists())


def test_a_level_that_is_measured_when_the_window_closes_comes_no_more(made):
    """It came a second later, when no copy can be written: an error, as of *Restart now*."""
    made.click(made.workspace.study_list.new)
    made.page(2)
    stimuli = made.protocol_editor.stimuli
    made.click(stimuli.form.measure)
    assert stimuli.background.is_busy
    made.close_down(made.workspace)
    assert not stimuli.background.is_busy
    assert "background" not in [thread.name for thread in threading.enumerate()]


def test_a_draft_that_cannot_be_read_is_kept_beside_the_next_one(made):
    """The next unsaved draft replaced it."""
    protocols = made.folder / "protocols"
    protocols.mkdir()
    (protocols / UNSAVED).write_bytes(b'{"protocol": "cut')
    (protocols / "unreadable-1.draft").write_bytes(b"earlier")
    made.protocol_editor.restore_unsaved()
    assert made.said[-1] == f"{protocols / UNSAVED} cannot be read; it is kept as unreadable-2.draft"
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Half done")
    made.qtbot.waitUntil((protocols / UNSAVED).is_file)
    assert (protocols / "unreadable-2.draft").read_bytes() == b'{"protocol": "cut'
    assert (protocols / "unreadable-1.draft").read_bytes() == b"earlier"


def test_a_draft_that_cannot_be_kept_is_asked_about_before_the_window_closes(qtbot, tmp_path):
    """It was lost with a line in a window that was hidden already."""
    window = quiet_window(qtbot, tmp_path)
    window.workspaces.choose("Experiment")
    editor = window.workspaces["Experiment"].protocol_editor
    editor.make_new()
    title = editor.rows["study"].controls["title"]
    title.selectAll()
    qtbot.keyClicks(title, "Half done")
    kept = tmp_path / "protocols" / UNSAVED
    kept.mkdir(parents=True)
    for words, is_open in (("Go on with it", True), ("Discard the changes", False)):
        window.close()
        assert window.status.message == f"{kept} cannot be written: it is a folder"
        box = dialog_of(window, QMessageBox)
        button = next(one for one in box.buttons() if one.text().replace("&", "") == words)
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        assert window.isVisible() == is_open
        assert (editor.draft is not None) == is_open
    assert window.last_box.informativeText() == f"{kept} cannot be written: it is a folder"
    window.last_box.close()


def test_a_draft_that_could_be_kept_is_not_there_again_after_it_was_saved(made):
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Half done")
    assert not made.workspace.would_lose  # but another workspace would, and the window stays open
    made.keep()
    made.close_down(made.workspace)
    assert not (made.folder / "protocols" / UNSAVED).exists()
