"""Undo and redo while a study is made: by keys and buttons, on every page, at the place of the edit."""

import json

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QToolButton
from study_hand import CTRL, UNSAVED, Hand

SHIFT = Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def made(qtbot, tmp_path):
    """A hand with a new study open."""
    hand = Hand(qtbot, tmp_path)
    hand.click(hand.workspace.study_list.new)
    return hand


def undo(made, times=1):
    """Press Ctrl+Z where the focus is."""
    for _ in range(times):
        made.qtbot.keyClick(made.workspace.window().focusWidget(), Qt.Key.Key_Z, CTRL)


def redo(made):
    made.qtbot.keyClick(made.workspace.window().focusWidget(), Qt.Key.Key_Z, CTRL | SHIFT)


def raw(made):
    return made.protocol_editor.draft.raw


def title(made):
    return made.protocol_editor.rows["study"].controls["title"]


def test_what_is_typed_into_a_field_is_one_step_and_the_field_keeps_the_focus(made):
    made.type(title(made), "Gravel")
    made.type(made.protocol_editor.rows["study"].controls["seed"], "7")
    assert (raw(made)["title"], raw(made)["seed"]) == ("Gravel", 7)
    undo(made)
    assert (raw(made)["title"], raw(made)["seed"]) == ("Gravel", 1)
    assert made.said[-1] == "Undone: change Seed"
    undo(made)
    assert title(made).text() == "My study"
    assert title(made).hasFocus()
    assert not made.protocol_editor.is_changed
    redo(made)
    assert title(made).text() == "Gravel"
    assert made.said[-1] == "Redone: change Title"
    made.qtbot.keyClicks(title(made), "!")  # another edit ends what can be redone
    redo(made)
    assert (raw(made)["title"], raw(made)["seed"]) == ("Gravel!", 1)


def test_text_of_several_lines_has_the_same_undo(made):
    about = made.protocol_editor.rows["study"].controls["about"]
    made.qtbot.keyClicks(about, "Two lines,")
    made.qtbot.keyClick(about, Qt.Key.Key_Return)
    made.qtbot.keyClicks(about, "of text")
    assert raw(made)["about"] == "Two lines,\nof text"
    undo(made)
    assert raw(made)["about"] == ""
    assert made.protocol_editor.rows["study"].controls["about"].toPlainText() == ""


def test_stages_that_were_added_moved_and_removed_come_back_in_their_place(made):
    made.page(3)
    stages = made.protocol_editor.stages
    before = [stage["id"] for stage in raw(made)["stages"]]
    made.click(stages.add)
    made.click(stages.up)
    assert [stage["id"] for stage in raw(made)["stages"]] == ["stage-1", *before]
    made.click(stages.remove)
    made.page(0)
    made.click(next(b for b in made.protocol_editor.findChildren(QToolButton) if b.text() == "Undo"))
    assert made.said[-1] == "Undone: remove stage stage-1"
    assert made.protocol_editor.pages.currentWidget() is stages  # what came back is seen
    assert [stage["id"] for stage in raw(made)["stages"]] == ["stage-1", *before]
    assert stages.list.currentRow() == 0
    assert stages.form.rows.controls["id"].text() == "stage-1"
    undo(made, 2)
    assert [stage["id"] for stage in raw(made)["stages"]] == before
    assert not made.protocol_editor.is_changed


def test_a_method_and_its_numbers_come_back_and_what_is_edited_then_is_the_draft(made):
    made.page(3)
    stages = made.protocol_editor.stages
    made.type(stages.form.parameters.controls["blocks"], "12")
    made.choose(stages.form.method.controls["method"], "Constant stimuli")
    undo(made)
    assert raw(made)["stages"][0]["method"]["kind"] == "rating"
    assert stages.form.parameters.controls["blocks"].text() == "12"
    undo(made)
    assert stages.form.parameters.controls["blocks"].text() == "1"
    stages.form.parameters.controls["blocks"].setFocus()
    made.type(stages.form.parameters.controls["blocks"], "3")
    assert raw(made)["stages"][0]["method"]["parameters"]["blocks"] == 3
    undo(made)
    assert stages.form.parameters.controls["blocks"].hasFocus()


def test_another_kind_of_stage_is_one_step_and_the_focus_goes_to_the_list_where_its_field_is_gone(made):
    made.page(3)
    stages = made.protocol_editor.stages
    before = raw(made)["stages"][0].copy()
    made.choose(stages.form.rows.controls["kind"], "pause")
    stages.form.further.controls["seconds"].setFocus()
    undo(made)
    assert raw(made)["stages"][0] == before
    assert stages.list.hasFocus()
    assert not made.protocol_editor.is_changed


def test_a_stage_is_renamed_back_and_again_wherever_it_is_named(made):
    made.page(3)
    stages = made.protocol_editor.stages
    made.click(stages.add)
    new = stages.form.rows.controls["id"].text()
    stages.list.setCurrentRow(0)
    made.choose(stages.form.order.controls["next"], new)
    stages.list.setCurrentRow(1)
    stages.form.rows.controls["id"].setFocus()
    made.type(stages.form.rows.controls["id"], "thanks")
    assert raw(made)["stages"][0]["next"] == "thanks"
    undo(made)
    assert (raw(made)["stages"][0]["next"], raw(made)["stages"][1]["id"]) == (new, new)
    redo(made)
    assert (raw(made)["stages"][0]["next"], raw(made)["stages"][1]["id"]) == ("thanks", "thanks")


def test_a_stimulus_is_renamed_back_wherever_it_is_named(made):
    made.page(2)
    stimuli = made.protocol_editor.stimuli
    names = list(raw(made)["stimuli"])
    made.type(stimuli.form.name, "Gravel")
    assert list(raw(made)["stimuli"]) == ["Gravel", *names[1:]]
    undo(made)
    assert list(raw(made)["stimuli"]) == names
    assert made.said[-1] == f"Undone: rename stimulus {names[0]}"
    assert stimuli.form.name.text() == names[0]
    made.click(stimuli.remove)
    made.click(stimuli.add)
    undo(made, 2)
    assert list(raw(made)["stimuli"]) == names
    assert not made.protocol_editor.is_changed


def test_questions_and_sounds_have_undo_too(made):
    made.page(1)
    questions = made.protocol_editor.questions
    made.click(questions.add)
    made.qtbot.keyClick(questions.table.focusWidget() or questions.table, Qt.Key.Key_Escape)
    made.page(4)
    made.choose(made.protocol_editor.rows["sounds"].controls["noise"], "pink")
    undo(made)
    assert made.said[-1] == "Undone: change sounds, Noise"
    assert made.protocol_editor.rows["sounds"].controls["noise"].currentText() == "none"
    undo(made)
    assert made.said[-1] == "Undone: add question q1"
    assert (raw(made)["participant"], questions.table.rowCount()) == ([], 0)
    redo(made)
    assert questions.table.rowCount() == 1
    questions.table.item(0, 1).setText("How old are you?")
    assert raw(made)["participant"][0]["text"] == "How old are you?"


def test_another_study_begins_without_steps_and_saving_keeps_them(made):
    made.type(title(made), "Gravel")
    made.qtbot.waitUntil(made.protocol_editor.save_button.isEnabled)
    made.qtbot.keyClick(title(made), Qt.Key.Key_S, CTRL)
    undo(made)
    assert raw(made)["title"] == "My study"
    assert made.protocol_editor.is_changed
    redo(made)
    assert not made.protocol_editor.is_changed
    made.qtbot.keyClick(title(made), Qt.Key.Key_Escape)
    made.click(made.workspace.study_list.new)
    actions = made.protocol_editor.undo_actions
    assert not actions.undo.isEnabled()
    assert not actions.redo.isEnabled()
    assert actions.undo.toolTip() == "Undo (Ctrl+Z)"


def test_an_unsaved_study_can_be_undone_after_the_window_was_closed(made):
    made.type(title(made), "Gravel")
    made.page(3)
    made.click(made.protocol_editor.stages.add)
    made.click(made.protocol_editor.stages.remove)
    undo(made)
    made.close_down(made.workspace)
    made.workspace = made.opened()
    made.protocol_editor.restore_unsaved()
    assert [stage["id"] for stage in raw(made)["stages"]] == ["main", "stage-1"]
    redo(made)
    assert [stage["id"] for stage in raw(made)["stages"]] == ["main"]
    made.page(0)
    title(made).setFocus()
    undo(made, 3)
    assert title(made).text() == "My study"
    assert not made.protocol_editor.undo_actions.undo.isEnabled()


@pytest.mark.parametrize(
    "history", [None, [], {"at": 1}, {"at": 3, "steps": [["{}", "{}"]]}, {"at": 1, "steps": [["a", "b"]]}]
)
def test_a_history_that_does_not_fit_is_discarded_and_the_study_is_there(made, history):
    made.type(title(made), "Gravel")
    made.close_down(made.workspace)
    kept = made.folder / "protocols" / UNSAVED
    kept.write_text(json.dumps({**json.loads(kept.read_text()), "history": history}))
    made.workspace = made.opened()
    made.protocol_editor.restore_unsaved()
    assert title(made).text() == "Gravel"
    assert not made.protocol_editor.undo_actions.undo.isEnabled()
