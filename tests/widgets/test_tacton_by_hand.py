"""A whole visit by hand: an impact tacton from nothing, looped, grouped, kept, found, compared, undone and redone."""

import json

import numpy as np
import pytest
from design_samples import drag, port
from on_screen import choose, show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from windows import quiet_window

from underfoot import render
from underfoot.nodes import REGISTRY
from underfoot.widgets.design.preset_browsing import PresetDialog

CONTROL = Qt.KeyboardModifier.ControlModifier


class Hand:
    """Counts what it does: each key, click, drag, and each entry of words with Return."""

    def __init__(self, design):
        self.design, self.actions = design, 0

    def add(self, words):
        self.actions += 1
        QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Slash)
        self._choose(words)

    def pull(self, node, output, words, by):
        """Pull a wire into the open and choose there what it goes to."""
        self.actions += 1
        start = port(self.design, node, "out", output)
        drag(self.design, start, start + by)
        self._choose(words)

    def rhythm(self, name):
        self.actions += 2
        button = self.design.inspector.editors["notes"].rhythms
        choose(button, next(action.text() for action in button.menu().actions() if action.text().startswith(name)))

    def _choose(self, words):
        self.actions += 1
        field = self.design.canvas.search.field
        QTest.keyClicks(field, words)
        QTest.keyClick(field, Qt.Key.Key_Return)


@pytest.fixture
def window(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.resize(1440, 900)
    window.actions_by_name["new"].trigger()
    return window


def test_the_thesis_s_tacton_is_built_kept_found_compared_and_undone(window, qtbot):
    design = window.workspaces["Design"]
    canvas, hand = design.canvas, Hand(window.workspaces["Design"])
    assert design.patch().nodes == ()
    hand.add("rhythm")
    hand.rhythm("R1")
    hand.pull("rhythm", "out", "impact", QPoint(120, 0))
    hand.pull("impact", "acceleration", "tile output", QPoint(120, 0))
    assert hand.actions <= 8
    types = [node.type for node in design.patch().nodes]
    assert types == ["rhythm", "impact", "tile-output"]
    assert design.patch().wires == (
        ("rhythm.out", "impact.strike"),
        ("impact.acceleration", "tile-output.acceleration"),
    )
    assert np.abs(render(design.patch(), seconds=1.0).samples).max() > 0.001
    # heard again and again
    qtbot.mouseClick(design.listen_bar.loop, Qt.MouseButton.LeftButton)
    assert design.listen_bar.loop.isChecked()
    qtbot.mouseClick(design.listen_bar.loop, Qt.MouseButton.LeftButton)
    # grouped, and kept as a preset
    show(qtbot, window)
    canvas.setFocus()
    QTest.keyClick(canvas, Qt.Key.Key_A, CONTROL)
    QTest.keyClick(canvas, Qt.Key.Key_G, CONTROL)
    assert len(design.patch().groups) == 1
    QTest.keyClick(canvas, Qt.Key.Key_Escape)  # the title of the new group is left as it is
    whole = design.patch().dumps()
    design.browsing.save_action.trigger()
    dialog = window.findChild(PresetDialog)
    dialog.title.selectAll()
    QTest.keyClicks(dialog.title, "Knock on R1")
    QTest.keyClick(dialog, Qt.Key.Key_Return)
    QTest.keyClicks(design.side.presets.field, "knock on r1")
    assert design.side.presets.list.presets()[0].title == "Knock on R1"
    # beside IT1, which is B
    QTest.keyClick(canvas, Qt.Key.Key_X)
    assert window.open_patch.slot == "B"
    design.side.presets.field.selectAll()
    QTest.keyClicks(design.side.presets.field, "it1")
    QTest.keyClick(design.side.presets.field, Qt.Key.Key_Return)
    assert design.patch().title == "Impact tacton IT1"
    QTest.keyClick(canvas, Qt.Key.Key_X)
    assert design.patch().dumps() == whole
    # all the way back, and again
    while design.undo_action.isEnabled():
        design.undo_action.trigger()
    assert design.patch().nodes == ()
    while design.redo_action.isEnabled():
        design.redo_action.trigger()
    assert design.patch().dumps() == whole
    assert json.loads(whole)["groups"]


def test_a_node_that_would_be_too_strong_alone_begins_softly_and_goes_back_to_that(window, qtbot):
    design, hand = window.workspaces["Design"], Hand(window.workspaces["Design"])
    canvas = design.canvas
    hand.add("stick-slip")
    level = REGISTRY["stick-slip"].parameters["level"]
    assert design.patch().node("stick-slip").parameters == {"level": level.initial}
    assert level.initial < level.default
    editor = design.inspector.editors["level"]
    assert not editor.reset_button.isVisible()
    editor.field.selectAll()
    QTest.keyClicks(editor.field, "x0.5")
    QTest.keyClick(editor.field, Qt.Key.Key_Return)
    assert design.patch().node("stick-slip").parameters["level"] == pytest.approx(0.5)
    qtbot.mouseClick(editor.reset_button, Qt.MouseButton.LeftButton)
    assert design.patch().node("stick-slip").parameters["level"] == level.initial
    canvas.setFocus()
    QTest.keyClick(canvas, Qt.Key.Key_R)
    QTest.keyClicks(canvas.search.field, "impact")
    QTest.keyClick(canvas.search.field, Qt.Key.Key_Return)
    assert design.patch().nodes[0].parameters == REGISTRY["impact"].initial
