"""Pictures in the inspector, under mouse and keys: modes, bars, curves, an envelope, a contact, intervals."""

import numpy as np
import pytest
from design_samples import send
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.engine.reports import Distributions
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.design.workspace import DesignWorkspace

LEFT, NONE, SHIFT = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
KEY = Qt.Key


@pytest.fixture
def selected(qtbot):
    """`selected(type)`: the workspace with one node of this type, selected."""

    def made(type, **values):
        workspace = DesignWorkspace(REGISTRY)
        qtbot.addWidget(workspace)
        workspace.resize(1280, 800)
        show(qtbot, workspace)
        workspace.set_patch(Patch().add(type, REGISTRY, **values))
        workspace.canvas.patch_scene.select([type])
        workspace.inspector.widget().adjustSize()
        return workspace

    return made


def now(workspace, name):
    """A parameter's value in the patch."""
    node = workspace.patch().nodes[0]
    return REGISTRY[node.type].values(node.parameters)[name]


def drag(pad, start, end):
    """A drag from a place of a picture to another, in steps."""
    send(pad, QEvent.Type.MouseButtonPress, start.toPoint(), LEFT)
    for share in (0.3, 0.7, 1.0):
        send(pad, QEvent.Type.MouseMove, (start + share * (end - start)).toPoint(), LEFT)
    send(pad, QEvent.Type.MouseButtonRelease, end.toPoint(), LEFT)


def typed(workspace, name, text):
    """Type a parameter's value in the inspector."""
    field = workspace.inspector.editors[name].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, text)
    QTest.keyClick(field, KEY.Key_Return)


def wheel(pad, place, notches):
    at = QPointF(place)
    event = QWheelEvent(
        at, QPointF(pad.mapToGlobal(place)), QPoint(), QPoint(0, 120 * notches), Qt.MouseButton.NoButton, NONE,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(pad, event)


def test_a_partial_is_dragged_in_frequency_and_gain_in_one_step_of_undo(selected):
    workspace = selected("modal-bank")
    pad = workspace.inspector.editors["modes"].pad
    drag(pad, pad.handles()[0], pad.place(1000.0, -20.0))
    modes = now(workspace, "modes")
    assert modes[0][0] == pytest.approx(1000.0, rel=0.03)
    assert modes[0][2] == pytest.approx(0.1, rel=0.15)
    assert modes[0][1] == 90.0
    assert modes[1:] == REGISTRY["modal-bank"].parameters["modes"].default[1:]
    assert workspace.document.stack.count() == 1
    assert workspace.inspector.editors["modes"].table.item(0, 0).text() == f"{modes[0][0]:.6g}"
    workspace.undo_action.trigger()
    assert now(workspace, "modes")[0] == (180.0, 90.0, 1.0)
    assert pad.rows()[0] == (180.0, 90.0, 1.0)


def test_an_object_that_is_hit_is_louder_by_its_shape(selected):
    workspace = selected("impact")
    pad = workspace.inspector.editors["modes"].pad
    drag(pad, pad.handles()[0], pad.place(92.0, 12.0))
    frequency, decay, mass, shape = now(workspace, "modes")[0]
    assert (decay, mass) == (22.0, 0.9)
    assert frequency == pytest.approx(92.0, rel=0.03)
    assert 20.0 * np.log10(shape**2 / mass) == pytest.approx(12.0, abs=0.5)


def test_wheel_double_click_right_click_and_delete_on_partials(selected):
    workspace = selected("modal-bank")
    pad = workspace.inspector.editors["modes"].pad
    place = pad.handles()[1].toPoint()
    wheel(pad, place, 2)
    assert workspace.document.stack.count() == 0  # nobody had chosen it
    pad.setFocus()
    QTest.mouseClick(pad, LEFT, NONE, place)
    wheel(pad, place, 1)
    wheel(pad, place, 1)
    assert now(workspace, "modes")[1][1] == pytest.approx(140.0 * 1.21, rel=1e-3)
    assert workspace.document.stack.count() == 1
    QTest.mouseDClick(pad, LEFT, NONE, pad.place(2000.0, 0.0).toPoint())
    assert len(now(workspace, "modes")) == 5
    assert now(workspace, "modes")[4][0] == pytest.approx(2000.0, rel=0.03)
    QTest.keyClick(pad, KEY.Key_Delete)
    assert len(now(workspace, "modes")) == 4
    QTest.mouseClick(pad, Qt.MouseButton.RightButton, NONE, pad.handles()[0].toPoint())
    assert [mode[0] for mode in now(workspace, "modes")] == [310.0, 470.0, 690.0]
    assert workspace.document.stack.count() == 4


def test_partials_by_keys_alone(selected):
    workspace = selected("modal-bank")
    pad = workspace.inspector.editors["modes"].pad
    pad.setFocus()
    for key, modifier in ((KEY.Key_N, NONE), (KEY.Key_Right, NONE), (KEY.Key_Up, SHIFT), (KEY.Key_PageUp, NONE)):
        QTest.keyClick(pad, key, modifier)
    frequency, decay, amplitude = now(workspace, "modes")[0]
    assert frequency == pytest.approx(180.0 * 2 ** (1 / 12), rel=1e-4)
    assert decay == pytest.approx(99.0)
    assert 20.0 * np.log10(amplitude) == pytest.approx(0.1, abs=0.01)
    QTest.keyClick(pad, KEY.Key_Return)
    assert len(now(workspace, "modes")) == 5
    QTest.keyClick(pad, KEY.Key_Backspace)
    assert len(now(workspace, "modes")) == 4


def test_harmonics_are_drawn_over_in_one_drag_and_typed_below(selected):
    workspace = selected("tone", harmonics=[1.0, 1.0, 1.0, 1.0])
    editor = workspace.inspector.editors["harmonics"]
    area = editor.bars.area()
    y = 0.5 * (area.bottom() + editor.bars.handles()[0].y())
    start, end = (QPointF(area.x() + share * area.width(), y) for share in (0.1, 0.9))
    send(editor.bars, QEvent.Type.MouseButtonPress, start.toPoint(), LEFT)
    for share in np.linspace(0.0, 1.0, 9):
        send(editor.bars, QEvent.Type.MouseMove, (start + share * (end - start)).toPoint(), LEFT)
    send(editor.bars, QEvent.Type.MouseButtonRelease, end.toPoint(), LEFT)
    assert now(workspace, "harmonics") == pytest.approx([0.5] * 4, abs=0.02)
    assert workspace.document.stack.count() == 1
    editor.bars.setFocus()
    for key in (KEY.Key_P, KEY.Key_Up, KEY.Key_Return, KEY.Key_Return, KEY.Key_Delete):
        QTest.keyClick(editor.bars, key)
    assert len(now(workspace, "harmonics")) == 5
    editor.field.setFocus()
    editor.field.selectAll()
    QTest.keyClicks(editor.field, "1 -0.5")
    QTest.keyClick(editor.field, KEY.Key_Return)
    assert now(workspace, "harmonics") == (1.0, -0.5)
    assert editor.bars.values() == [1.0, -0.5]
    editor.field.selectAll()
    QTest.keyClicks(editor.field, "0,5; -0,25")
    QTest.keyClick(editor.field, KEY.Key_Return)
    assert now(workspace, "harmonics") == (0.5, -0.25)


def test_a_point_of_a_curve_is_dragged_between_its_neighbours(selected):
    workspace = selected("stance-curve")
    pad = workspace.inspector.editors["curve"].pad
    drag(pad, pad.handles()[1], pad.place((80.0, 0.5)))
    assert now(workspace, "curve")[1] == pytest.approx((80.0, 0.5), abs=1.0)
    assert workspace.document.stack.count() == 1
    drag(pad, pad.handles()[0], pad.place((90.0, 0.3)))
    assert now(workspace, "curve")[0][0] == now(workspace, "curve")[1][0]
    QTest.mouseDClick(pad, LEFT, NONE, pad.place((20.0, 0.9)).toPoint())
    assert len(now(workspace, "curve")) == 4
    assert workspace.document.stack.count() == 3


def test_an_envelope_by_its_handles(selected):
    workspace = selected("attack-decay")
    pad = workspace.inspector.picture
    drag(pad, pad.handles()[0], pad.place(0.05, 0.8))
    assert now(workspace, "attack") == pytest.approx(0.05, rel=0.05)
    assert now(workspace, "amplitude") == pytest.approx(0.8, abs=0.03)
    assert workspace.document.stack.count() == 1
    drag(pad, pad.handles()[1], pad.place(0.1, 0.8))
    assert now(workspace, "decay") == pytest.approx(0.1, rel=0.05)
    drag(pad, pad.handles()[2], pad.place(0.15, 0.0))
    assert now(workspace, "duration") == pytest.approx(0.15, rel=0.05)
    assert workspace.document.stack.count() == 3
    assert workspace.inspector.editors["decay"].value() == now(workspace, "decay")
    pad.setFocus()
    QTest.keyClick(pad, KEY.Key_N)
    QTest.keyClick(pad, KEY.Key_Left)
    assert pad.caption().startswith(("up in", "up"))


def test_a_contact_is_made_softer_by_its_tip(selected):
    workspace = selected("impact")
    pad = workspace.inspector.picture
    tip = pad.handles()[0]
    drag(pad, tip, QPointF(0.5 * (tip.x() + pad.area().x()), tip.y()))
    assert now(workspace, "stiffness") == pytest.approx(1e5 * 2.0**2.5, rel=0.1)
    assert workspace.document.stack.count() == 1
    before = pad.caption()
    typed(workspace, "damping", "2")
    assert pad.caption() != before


def test_the_intervals_of_a_random_process_stand_beside_their_distribution(selected, qtbot):
    workspace = selected("poisson")
    distribution = workspace.inspector.distribution
    assert not distribution.plots[0].isVisible(), "axes of nothing"
    with qtbot.waitSignal(
        workspace.previews.preview_requested, check_params_cb=lambda node, tile, distributions: distributions
    ):
        typed(workspace, "interval", "50 ms")
    workspace.previews.show_distributions(Distributions(0, REGISTRY["poisson"].distributions({"interval": 0.05})))
    assert distribution.plots[0].isVisible()
    drawing = distribution.plots[0].drawing
    assert drawing.series[1].name == "exponential distribution"
    workspace.inspector.update_colours()
    assert workspace.inspector.distribution is not distribution
    assert workspace.inspector.distribution.plots[0].drawing is drawing
