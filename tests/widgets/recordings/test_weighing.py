"""A body weight is noted in the window: proposed from a standing phase, or typed, and curves are in percent of it."""

import pytest
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog
from stood_and_walked import stood_and_walked

from underfoot.records.recording import Recording


@pytest.fixture
def opened(workspace, folder, qtbot):
    """The workspace with somebody of 500 N who stood and walked."""
    workspace.open_file(stood_and_walked(folder / "ann.underfoot", 500))
    qtbot.waitUntil(lambda: len(workspace.steps.visible_steps()) >= 6 and not workspace.surveyor.is_busy)
    return workspace


def dialog_of(opened, qtbot):
    """The dialog that asks for the weight."""
    show(qtbot, opened)  # a dialog that closes takes the focus along
    opened.axis.setFocus()
    QTest.keyClick(opened.axis, Qt.Key.Key_W)
    qtbot.waitUntil(lambda: any(one.isVisible() for one in opened.findChildren(QInputDialog)))
    return next(one for one in opened.findChildren(QInputDialog) if one.isVisible())


def test_the_weight_of_who_stands_is_proposed_and_another_can_be_typed_and_removed(opened, qtbot):
    panel = opened.steps
    assert panel.plot.drawing.y == "force, N"
    dialog = dialog_of(opened, qtbot)
    assert "Somebody stands still: 500." in dialog.labelText()
    dialog.accept()
    qtbot.waitUntil(lambda: panel.plot.drawing.y == "force, % of body weight")
    assert max(panel.plot.drawing.series[-1].y) == pytest.approx(110.0, abs=2.0)
    assert "  ·  weighs 500 N  ·  8 tiles" in opened.facts.full_text
    path = opened.axis.content.opened.path
    with Recording(path) as recording:
        assert recording.body_weights()[0].source.startswith("standing at ")
    dialog = dialog_of(opened, qtbot)
    assert dialog.textValue().startswith("500.")
    dialog.setTextValue("75")
    QTest.keyClick(dialog, Qt.Key.Key_Return)
    assert "the body weight is '75'; allowed: with its unit, such as 71.4 kg" in dialog.labelText()
    assert (dialog.isVisible(), dialog.textValue()) == (True, "75")
    dialog.reject()
    panel.filters["person"].setCurrentText("person 1")
    dialog = dialog_of(opened, qtbot)
    assert "of person 1" in dialog.labelText()
    dialog.setTextValue("100 kg")
    dialog.accept()
    qtbot.waitUntil(lambda: "  ·  weighs 500 N  ·  person 1 weighs 981 N  ·  " in opened.facts.full_text)
    opened.steps.compare_button.click()
    opened.comparison.by.setCurrentText("By person")
    table = opened.comparison.table
    qtbot.waitUntil(lambda: table.rowCount() > 0)
    assert {"Peak 1, %BW", "Loading, %BW/s"} <= {table.item(row, 0).text() for row in range(table.rowCount())}
    assert opened.comparison.plot.drawing.y == "mean force ± 1 SD, % of body weight"


def test_the_feet_of_who_stands_briefly_are_left_out_with_the_weight_that_they_give(workspace, folder, qtbot):
    workspace.open_file(stood_and_walked(folder / "bo.underfoot", 800, stands_s=3.0))
    qtbot.waitUntil(lambda: len(workspace.steps.visible_steps()) == 10 and not workspace.surveyor.is_busy)
    dialog = dialog_of(workspace, qtbot)
    assert "Left out of means with it, as standing: step 1, 2." in dialog.labelText()
    dialog.accept()
    qtbot.waitUntil(lambda: [step.left_out for step in workspace.steps.visible_steps()] == ["standing"] * 2 + [""] * 8)
