"""Opening a patch with a node in a file beside it: the question, the answer, and the node that is missing."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from windows import design, dialog_of, quiet_window

from underfoot.nodes import REGISTRY
from underfoot.patch.heard import without_missing
from underfoot.patch.patch import Patch
from underfoot.widgets.session.settings import Settings


def answer(qtbot, window, word):
    """Click the button of this word in the question that is asked."""
    question = dialog_of(window, QMessageBox)
    button = next(one for one in question.buttons() if one.text() == word)
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    return question


def test_a_node_is_run_and_offered_once_the_person_has_agreed(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    offered = design(window).palette_panel.list
    window.open_patch.open(beside.patch)
    assert beside.runs == 0
    question = answer(qtbot, window, "Run it")
    assert str(beside.file) in question.text()
    assert f"{beside.file.stat().st_size:,} bytes" in question.text()
    assert "with your rights" in question.informativeText()
    assert beside.runs == 1
    design(window).palette_panel.field.setText("hum of mine")
    assert offered.current() == "hum-of-mine"
    design(window).canvas.patch_scene.select(["hum"])
    assert design(window).inspector.editors["strength"].value() == 2.5
    window.open_patch.new()
    window.open_patch.open(beside.patch)  # not asked a second time
    assert window.open_patch.patch.title == "Hum"
    assert not question.isVisible()
    window.settings.save(beside.folder)
    assert len(Settings.load(beside.folder).run_code) == 1


def test_another_file_is_asked_about_again_and_is_what_is_run_then(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Run it")
    first = REGISTRY["hum-of-mine"]
    beside.write(sign="-1.0")
    window.open_patch.open(beside.patch)
    assert beside.runs == 1
    answer(qtbot, window, "Do not")
    assert REGISTRY["hum-of-mine"].missing  # the file that was agreed to is not there any more
    assert beside.runs == 1
    beside.write(sign="-2.0")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Run it")
    assert beside.runs == 2
    assert REGISTRY["hum-of-mine"] is not first


def test_without_consent_the_node_is_missing_says_why_and_is_saved_as_it_is(qtbot, beside):
    window = quiet_window(qtbot, beside.folder / "kept")
    window.open_patch.open(beside.patch)
    answer(qtbot, window, "Do not")
    assert beside.runs == 0
    assert "hum-of-mine is missing" in window.status.message
    assert "nobody has agreed" in window.status.message
    before = beside.patch.read_bytes()
    patch = window.open_patch.patch
    assert [node.id for node in without_missing(patch, REGISTRY).nodes] == ["out"]
    assert [node.id for node in window.controller.patch.nodes] == ["out"]
    design(window).palette_panel.field.setText("hum of mine")
    assert design(window).palette_panel.list.current() == ""
    design(window).canvas.patch_scene.select(["hum"])
    design(window).document.edit(patch.move({"hum": (10.0, 0.0)}), "Move")
    window.open_patch.save()
    assert Patch.unchecked(beside.patch.read_bytes(), "saved") == Patch.unchecked(before, "first").move(
        {"hum": (10.0, 0.0)}
    )


def test_a_broken_file_and_work_that_was_left_behind_lose_nothing(qtbot, beside):
    beside.file.write_text("1 / 0")
    first = quiet_window(qtbot, beside.folder / "kept", beside.patch)
    answer(qtbot, first, "Run it")
    assert "ZeroDivisionError: division by zero" in first.status.message
    patch = first.open_patch.patch
    edited = patch.move({"hum": (10.0, 0.0)})
    design(first).document.edit(edited, "Move")
    first.leave()
    REGISTRY.pop("hum-of-mine")  # as in a new process
    second = quiet_window(qtbot, beside.folder / "kept")
    assert second.open_patch.patch == edited
