"""What can be undone goes on after the window was closed and opened anew."""

import pytest
from design_samples import REGISTRY, sample
from windows import quiet_window

from underfoot.patch.patch import Patch
from underfoot.widgets.controls.undo_step import MAX_SAVED_STEPS
from underfoot.widgets.design.undo import Document


def read():
    """The sample as it comes from a file."""
    return Patch.loads(sample().dumps(), REGISTRY)


def edited(count):
    document = Document(read())
    for i in range(count):
        id = document.patch.nodes[0].id
        document.edit(document.patch.move({id: (8.0 * (i + 1), 8.0)}), f"Move {i}")
    return document


def test_undo_and_redo_go_on_after_a_new_start(qapp, tmp_path):
    first = edited(5)
    first.stack.undo()
    first.stack.undo()
    first.save_history(tmp_path / "undo.json")
    second = Document(first.patch)
    said = []
    second.changed.connect(lambda *patches: said.append(patches))
    second.restore_history(tmp_path / "undo.json", REGISTRY)
    assert second.patch == first.patch
    assert said == []
    assert (second.stack.undoText(), second.stack.redoText()) == ("Move 2", "Move 3")
    for act in ("redo", "redo", "undo", "undo", "undo", "undo", "undo"):
        getattr(first.stack, act)()
        getattr(second.stack, act)()
        assert second.patch.dumps() == first.patch.dumps()
    assert second.patch == read()
    assert not (tmp_path / "undo.json").exists()


def test_of_many_edits_the_last_are_kept(qapp, tmp_path):
    first = edited(MAX_SAVED_STEPS + 3)
    first.save_history(tmp_path / "undo.json")
    second = Document(first.patch)
    second.restore_history(tmp_path / "undo.json", REGISTRY)
    assert second.stack.count() == MAX_SAVED_STEPS


@pytest.mark.parametrize("text", ["", "[]", '{"at": 0, "steps": []}', '{"at": 9, "steps": [{}]}', "\x00"])
def test_what_cannot_be_read_or_leads_elsewhere_is_let_go(qapp, tmp_path, text):
    (tmp_path / "undo.json").write_text(text)
    document = Document(sample())
    document.restore_history(tmp_path / "undo.json", REGISTRY)
    assert document.stack.count() == 0
    assert not (tmp_path / "undo.json").exists()
    edited(2).save_history(tmp_path / "undo.json")
    document.restore_history(tmp_path / "undo.json", REGISTRY)
    assert document.stack.count() == 0


def test_what_was_undone_is_said_until_something_else_is_done(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    design = window.workspaces["Design"]
    patch = design.patch()
    design.document.edit(patch.move({patch.nodes[0].id: (0.0, 800.0)}), "Move a node")
    design.undo_action.trigger()
    assert window.status.message == "Undone: move a node"
    design.redo_action.trigger()
    assert window.status.message == "Redone: move a node"
    design.document.edit(patch, "Move it back")
    assert window.status.message == ""
    design.undo_action.trigger()
    window.show_message("The recording was saved")
    design.redo_action.trigger()
    window.show_message("The recording was saved")
    design.document.edit(patch.move({patch.nodes[0].id: (0.0, 900.0)}), "Move a node")
    assert window.status.message == "The recording was saved"
