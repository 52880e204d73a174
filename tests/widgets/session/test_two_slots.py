"""Two patches that are open, A and B: neither is lost, whatever happens to the window."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox
from windows import choose_file, design, dialog_of, noise_patch, quiet_window

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

X = Qt.Key.Key_X
BUTTON = QMessageBox.StandardButton


@pytest.fixture
def two(qtbot, tmp_path):
    """A window with a file in A, and an edited copy of it in B."""
    noise_patch().save(tmp_path / "hiss.json")
    window = quiet_window(qtbot, tmp_path, tmp_path / "hiss.json")
    workspace = design(window)
    QTest.keyClick(workspace.canvas, X)
    workspace.document.edit(workspace.patch().set("noise", "amplitude", 4.0, REGISTRY), "Set amplitude")
    return window


def answer(window, qtbot, button):
    question = dialog_of(window, QMessageBox)
    qtbot.mouseClick(question.button(button), Qt.MouseButton.LeftButton)
    return question.text()


def test_what_is_in_the_other_slot_survives_a_crash(two, qtbot, tmp_path):
    edited = design(two).patch()
    QTest.keyClick(design(two).canvas, X)
    assert two.open_patch.is_saved
    assert not two.open_patch.is_all_saved
    two.open_patch.write_autosave()
    qtbot.waitUntil((tmp_path / "unsaved" / "work-0.json").exists)
    two.open_patch.autosave.close()
    second = quiet_window(qtbot, tmp_path)
    assert design(second).patch() == noise_patch()
    assert second.open_patch.path == tmp_path / "hiss.json"
    QTest.keyClick(design(second).canvas, X)
    assert design(second).patch() == edited
    assert not second.open_patch.is_saved


def test_closing_asks_about_the_slot_that_is_not_seen(two, qtbot):
    QTest.keyClick(design(two).canvas, X)
    two.close()
    assert two.isVisible()
    assert design(two).patch().node("noise").parameters == {"amplitude": 4.0}  # what is asked about is shown
    answer(two, qtbot, BUTTON.Cancel)
    assert two.isVisible()
    two.close()
    answer(two, qtbot, BUTTON.Discard)
    assert not two.isVisible()


def test_closing_asks_about_both_one_after_the_other(two, qtbot):
    QTest.keyClick(design(two).canvas, X)
    design(two).document.edit(noise_patch("Hiss").set("noise", "amplitude", 3.0, REGISTRY), "Set amplitude")
    two.close()
    assert answer(two, qtbot, BUTTON.Discard) == "Save the changes to “Hiss (A)”?"
    assert two.isVisible()
    assert answer(two, qtbot, BUTTON.Discard) == "Save the changes to “Hiss (B)”?"
    assert not two.isVisible()


def test_each_slot_is_saved_to_its_own_file(two, qtbot, tmp_path):
    choose_file(two, tmp_path / "b.json", two.open_patch.save)
    qtbot.waitUntil(two.isActiveWindow)
    assert Patch.load(tmp_path / "b.json", REGISTRY).node("noise").parameters == {"amplitude": 4.0}
    QTest.keyClick(design(two).canvas, X)
    assert two.open_patch.path == tmp_path / "hiss.json"
    assert Patch.load(tmp_path / "hiss.json", REGISTRY) == noise_patch()
    assert two.open_patch.is_all_saved


def test_another_file_is_opened_into_the_slot_that_is_edited(two, tmp_path):
    QTest.keyClick(design(two).canvas, X)
    noise_patch("Third").save(tmp_path / "third.json")
    two.open_patch.open(tmp_path / "third.json")
    assert design(two).patch().title == "Third"
    QTest.keyClick(design(two).canvas, X)
    assert design(two).patch().node("noise").parameters == {"amplitude": 4.0}


def test_a_copy_names_the_files_that_its_original_named(qtbot, tmp_path):
    """B has no folder: what A names from its own, B names in full."""
    patch = noise_patch().add("wav-player", REGISTRY, file="step.wav")
    patch.save(tmp_path / "a.json")
    window = quiet_window(qtbot, tmp_path, tmp_path / "a.json")
    QTest.keyClick(design(window).canvas, X)
    assert design(window).patch().node("wav-player").parameters["file"] == str(tmp_path / "step.wav")
    assert window.open_patch.is_saved


def test_slots_that_differ_by_less_than_is_shown_are_equally_loud(two):
    two.listening.set_level("A", 1.0)
    two.listening.set_level("B", 1.004)
    assert design(two).listen_bar.state.full_text == "equally loud"
    two.listening.set_level("B", 1.04)
    assert design(two).listen_bar.state.full_text == "B −0.3 dB"
