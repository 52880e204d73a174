"""A whole visit by hand: an impact tacton from nothing, looped, grouped, kept, found, compared, undone and redone."""

import json

import numpy as np
import pytest
from design_samples import drag, port
from on_screen import choose, show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from windows import VibrationRecorder, dialog_of, end_window, play_on_simulator, quiet_window

from underfoot import render
from underfoot.engine.commands import Swap
from underfoot.engine.reports import CommandApplied
from underfoot.nodes import REGISTRY
from underfoot.widgets.design.preset_browsing import PresetDialog

CONTROL, NONE = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.NoModifier


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
def window(qapp, patch_folder):
    """A window that plays, for one test: what draws the pictures of its presets ends with it."""
    made = play_on_simulator(patch_folder)
    yield made
    end_window(made)


@pytest.fixture
def quiet(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.resize(1440, 900)
    window.actions_by_name["new"].trigger()
    return window


def starts(window):
    """The frames at which the session's engine began the patch anew, from now on."""
    found = []
    window.bridge.reported.connect(
        lambda reports: found.extend(
            report.frame
            for report in reports
            if isinstance(report, CommandApplied) and isinstance(report.command, Swap) and report.command.anew
        )
    )
    return found


def build_the_tacton(hand):
    """A rhythm of impacts on the tiles, in at most eight actions."""
    hand.add("rhythm")
    hand.rhythm("R1")
    hand.pull("rhythm", "out", "impact", QPoint(120, 0))
    hand.pull("impact", "acceleration", "tile output", QPoint(120, 0))
    assert hand.actions <= 8
    patch = hand.design.patch()
    assert [node.type for node in patch.nodes] == ["rhythm", "impact", "tile-output"]
    assert patch.wires == (("rhythm.out", "impact.strike"), ("impact.acceleration", "tile-output.acceleration"))
    assert np.abs(render(patch, seconds=1.0).samples).max() > 0.001


def hear_it_again_and_again(window, qtbot):
    """In a loop the engine begins the patch anew, and the tiles vibrate."""
    design = window.workspaces["Design"]
    heard, begun = VibrationRecorder(window), starts(window)
    qtbot.mouseClick(design.listen_bar.loop, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: len(begun) > 2 and heard.any())
    assert window.controller.session.patch.types.keys() >= design.patch().types.keys()
    qtbot.mouseClick(design.listen_bar.loop, Qt.MouseButton.LeftButton)
    assert not window.listening.is_looping


def test_the_thesis_s_tacton_is_built_heard_kept_found_compared_and_undone(window, qtbot):
    """By keys and mouse alone, in a window that plays."""
    design = window.workspaces["Design"]
    canvas, hand = design.canvas, Hand(window.workspaces["Design"])

    def press(*keys, on=canvas):
        """Keys to a widget that has the focus, in a window that has it."""
        show(qtbot, window)
        on.setFocus()
        for key, modifiers in keys:
            QTest.keyClick(on, key, modifiers)

    press((Qt.Key.Key_N, CONTROL))
    assert design.patch().nodes == ()
    build_the_tacton(hand)
    hear_it_again_and_again(window, qtbot)
    # grouped, and kept as a preset
    press((Qt.Key.Key_A, CONTROL), (Qt.Key.Key_G, CONTROL))
    assert len(design.patch().groups) == 1
    press((Qt.Key.Key_Escape, NONE))  # the title of the new group is left as it is
    whole = design.patch().dumps()
    press((Qt.Key.Key_S, CONTROL | Qt.KeyboardModifier.AltModifier))
    dialog = dialog_of(window, PresetDialog)
    QTest.keyClick(dialog.title, Qt.Key.Key_A, CONTROL)
    QTest.keyClicks(dialog.title, "Knock on R1")
    QTest.keyClick(dialog, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: not dialog.isVisible())
    # found by its words
    field = design.side.presets.field
    press((Qt.Key.Key_P, CONTROL))
    qtbot.waitUntil(field.isVisible)
    QTest.keyClicks(field, "knock on r1")
    assert design.side.presets.list.presets()[0].title == "Knock on R1"
    # beside IT1, which is B
    press((Qt.Key.Key_X, NONE))
    assert window.open_patch.slot == "B"
    press((Qt.Key.Key_A, CONTROL), on=field)
    QTest.keyClicks(field, "it1")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert design.patch().title == "Impact tacton IT1"
    qtbot.waitUntil(lambda: window.controller.session.patch.title == "Impact tacton IT1")
    press((Qt.Key.Key_X, NONE))
    assert design.patch().dumps() == whole
    qtbot.waitUntil(lambda: window.controller.session.patch.title != "Impact tacton IT1")
    # all the way back, and again
    while design.undo_action.isEnabled():
        press((Qt.Key.Key_Z, CONTROL))
    assert design.patch().nodes == ()
    while design.redo_action.isEnabled():
        press((Qt.Key.Key_Z, CONTROL | Qt.KeyboardModifier.ShiftModifier))
    assert design.patch().dumps() == whole
    assert json.loads(whole)["groups"]


def test_a_node_that_would_be_too_strong_alone_begins_softly_and_goes_back_to_that(quiet, qtbot):
    design, hand = quiet.workspaces["Design"], Hand(quiet.workspaces["Design"])
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
