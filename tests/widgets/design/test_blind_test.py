"""The pages of a blind test before and after its trials, by keys alone."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from windows import design, quiet_window

from underfoot.widgets.design.blind_test import BlindTest


@pytest.fixture
def window(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    return quiet_window(qtbot, tmp_path / "kept")


def begun(window):
    QTest.keyClick(design(window).canvas, Qt.Key.Key_B, Qt.KeyboardModifier.ControlModifier)
    return window.findChild(BlindTest)


def press(test, key):
    """A key to the field of the participant, from which it goes on as it would with the focus there."""
    QTest.keyClick(test.participant, key)


def test_escape_leaves_the_first_page_and_enter_begins(window, qtbot):
    panics = []
    window.controller.panic = lambda: panics.append(1)
    press(begun(window), Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: window.findChild(BlindTest) is None)
    assert window.focusWidget() is design(window).canvas  # it was the menu's button
    assert not panics
    window.listening.match_levels(False)
    test = begun(window)
    press(test, Qt.Key.Key_Return)
    assert test.comparison is not None
    QTest.keyClick(test, Qt.Key.Key_Escape)
    assert panics, "in a trial Escape is panic"
    assert test.isVisible()


def test_that_a_and_b_are_the_same_is_said_before_the_test(window, qtbot):
    test = begun(window)  # B was not there yet, and begins as a copy of A
    assert test.complaint.text().startswith("A and B are the same")
    press(test, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: window.findChild(BlindTest) is None)
    patch = design(window).patch()
    moved = patch.move({patch.nodes[0].id: (0.0, 800.0)})
    design(window).document.edit(moved, "Move")
    assert begun(window).complaint.text(), "where a node stands is not heard"
    press(window.findChild(BlindTest), Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: window.findChild(BlindTest) is None)
    design(window).document.edit(patch.remove([patch.nodes[0].id]), "Delete")
    assert begun(window).complaint.text() == ""


def test_a_node_that_waits_to_be_played_alone_is_not_played_in_it(window):
    workspace = design(window)
    node = workspace.patch().nodes[0].id
    workspace.canvas.audition_requested.emit(node)
    assert workspace.slots.needed_preview("") == node
    press(begun(window), Qt.Key.Key_Return)
    assert workspace.slots.needed_preview("") != node
