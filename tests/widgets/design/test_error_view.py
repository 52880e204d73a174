"""Run time over error in the inspector: asked for when nothing else is, drawn point by point, stopped by its button."""

import numpy as np
import pytest
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from underfoot.drawing import Drawing, Series
from underfoot.engine.reports import ErrorCurveDrawn, Preview
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.design.workspace import DesignWorkspace


@pytest.fixture
def design(qtbot):
    """A Design workspace with an impact that is selected, and previewed."""
    made = DesignWorkspace(REGISTRY)
    qtbot.addWidget(made)
    made.resize(1280, 748)
    show(qtbot, made)
    made.set_patch(Patch().add("impact"))
    with qtbot.waitSignal(made.previews.preview_requested):
        made.canvas.patch_scene.select(["impact"])
    return made


def preview():
    return Preview(1, 48_000.0, np.zeros(480), {"acceleration": np.ones(480)})


def point(told, left):
    line = Series("here", np.array([1e-4]), np.array([0.05]), "dots")
    return ErrorCurveDrawn(1, Drawing("", "error found", "run time, ms", (line,)), told, left)


def test_errors_are_measured_once_the_preview_is_there_and_anew_when_the_node_is_another(design, qtbot):
    view = design.inspector.errors
    with qtbot.waitSignal(design.previews.errors_requested) as wanted:
        design.previews.show_preview(preview())
    assert wanted.args == ["impact"]
    design.inspector.show_errors(point("asked 0.001, found 0.0001", 3))
    assert view.summary.text() == "asked 0.001, found 0.0001; measuring, 3 to come"
    assert view.wants_curve
    design.inspector.show_errors(point("asked 0.001, found 0.0001", 0))
    assert len(view.plot.drawing.series) == 1
    assert not view.wants_curve, "all is known"
    with qtbot.waitSignal(design.previews.preview_requested):
        QTest.keyClick(design.inspector.editors["error"].slider, Qt.Key.Key_Right)
    assert view.wants_curve
    design.inspector.show_errors(point("asked 0.001, found 0.0001", 0))
    assert view.wants_curve, "what comes late is of the node as it was"


def test_closed_it_measures_nothing_and_what_runs_is_stopped_by_the_next_request(design, qtbot):
    view = design.inspector.errors
    with qtbot.waitSignal(design.previews.errors_requested):
        design.previews.show_preview(preview())
    with qtbot.waitSignal(design.previews.preview_requested):  # anything that is asked for stops it
        qtbot.mouseClick(view.toggle_button, Qt.MouseButton.LeftButton)
    assert view.plot.isHidden()
    with qtbot.assertNotEmitted(design.previews.errors_requested, wait=300):
        design.previews.show_preview(preview())


def test_a_node_that_is_exact_says_so_and_has_no_curve(design):
    design.set_patch(Patch().add("gain"))
    design.canvas.patch_scene.select(["gain"])
    assert design.inspector.errors is None


def test_the_patch_has_one_factor_for_all_errors(design, qtbot):
    design.canvas.patch_scene.select([])
    editor = design.inspector.editors["error_scale"]
    QTest.keyClick(editor.slider, Qt.Key.Key_PageUp)
    assert design.patch().error_scale == pytest.approx(10.0**0.4, rel=1e-2)
    assert design.undo_action.text() == "Undo: set error factor"
    qtbot.mouseClick(editor.reset_button, Qt.MouseButton.LeftButton)
    assert design.patch().error_scale == 1.0
