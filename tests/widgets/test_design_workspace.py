"""The Design workspace under real mouse and key events."""

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDropEvent, QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from widgets.design.items import NodeItem
from widgets.design.node_list import MIME
from widgets.design.workspace import DesignWorkspace
from workbench.engine.messages import Costs, Fault, Preview
from workbench.errors import BadFile
from workbench.parameters import Choice, Count, Number, Rows, Tiles
from workbench.patch.node import Input, Output, node, run_kernel
from workbench.patch.patch import Patch

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


@run_kernel
def nothing(x, y, c, s, t, d, e, o, key, rate, frame, n):
    pass


@node("push", "Floor")
class Push:
    """Force, in newtons."""

    force = Output("N")
    run = nothing


@node("step", "Timing")
class Step:
    """Events from a force."""

    force = Input("N")
    threshold = Number(30.0, 1.0, 1000.0, unit="N", scale="log", doc="force at which a foot is down")
    onset = Output(kind="event")
    run = nothing


@node("shaker", "Outputs")
class Shaker:
    """Where a patch ends."""

    acceleration = Input("m/s^2")
    level = Number(1.0, 0.0, 10.0, wire="audio", doc="factor on the way out")
    tiles = Tiles()
    played = Output("m/s^2")
    run = nothing
    is_sink = True


@node("hum", "Tones")
class Hum:
    """A tone."""

    frequency = Number(50.0, 1.0, 1000.0, unit="Hz", scale="log", wire="audio", doc="of the tone")
    chains = Count(2000, 1, 100_000, doc="how many")
    sharing = Choice("global", options=("global", "local"))
    out = Output("m/s^2")
    run = nothing


@node("beat", "Timing")
class Beat:
    """A rhythm."""

    notes = Rows(((0, 4, 1.0),), (("step", 0, 23), ("length", 1, 24), ("amplitude", 0.0, 1.0)), most=24)
    out = Output(kind="event")
    run = nothing


@node("through", "Shapes")
class Through:
    """The same again."""

    signal = Input()
    out = Output()
    run = nothing


REGISTRY = {type.type: type for type in (Push, Step, Shaker, Hum, Beat, Through)}


def sample() -> Patch:
    patch = Patch(title="sample")
    for type, at in (("push", (0, 0)), ("step", (240, 0)), ("hum", (0, 160)), ("shaker", (480, 160))):
        patch = patch.add(type, REGISTRY, at)
    return patch.connect("push.force", "step.force", REGISTRY)


@pytest.fixture
def workspace(qtbot):
    made = DesignWorkspace(REGISTRY)
    qtbot.addWidget(made)
    made.resize(1280, 748)
    made.show()
    made.setPatch(sample())
    made.canvas.setFocus()
    return made


def port(workspace, id: str, side: str, name: str) -> QPoint:
    canvas = workspace.canvas
    return canvas.mapFromScene(canvas.patch_scene.nodes[id].port_place(side, name))


def middle(workspace, id: str) -> QPoint:
    """A place in a node's small plot, away from its ports."""
    item = workspace.canvas.patch_scene.nodes[id]
    return workspace.canvas.mapFromScene(item.mapToScene(item.shape_now.plot.center()))


def drag(workspace, start: QPoint, end: QPoint, release: bool = True) -> None:
    view = workspace.canvas.viewport()
    send(view, QEvent.Type.MouseButtonPress, start, LEFT)
    for share in (0.1, 0.5, 0.9, 1.0):
        place = QPoint(round(start.x() + share * (end.x() - start.x())), round(start.y() + share * (end.y() - start.y())))
        send(view, QEvent.Type.MouseMove, place, LEFT)
    if release:
        send(view, QEvent.Type.MouseButtonRelease, end, LEFT)


def send(widget, kind, place, button, modifiers=NONE) -> None:
    which = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseMove else button
    held = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseButtonRelease else button
    at = QPointF(place)
    QApplication.sendEvent(widget, QMouseEvent(kind, at, QPointF(widget.mapToGlobal(place)), which, held, modifiers))


# --- adding ---


def test_double_click_on_empty_canvas_adds_a_node_there(workspace):
    place = QPoint(120, 380)
    there = workspace.canvas.mapToScene(place)
    QTest.mouseDClick(workspace.canvas.viewport(), LEFT, NONE, place)
    assert workspace.canvas.search.isVisible()
    QTest.keyClicks(workspace.canvas.search.field, "thr")
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    added = workspace.patch().nodes[-1]
    assert added.type == "through"
    assert abs(added.at[0] - there.x()) < 32
    assert abs(added.at[1] - there.y()) < 32
    assert added.at[0] % 8 == 0 == added.at[1] % 8
    assert workspace.canvas.selected_ids() == [added.id]
    assert not workspace.canvas.search.isVisible()


def test_space_opens_the_search_and_escape_leaves_it(workspace):
    before = workspace.patch()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Space)
    assert workspace.canvas.search.isVisible()
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Escape)
    assert not workspace.canvas.search.isVisible()
    assert workspace.patch() == before


def test_enter_in_the_palette_adds_the_best_match(workspace):
    palette = workspace.palette_panel
    QTest.keyClicks(palette.field, "hum")
    assert palette.list.types() == ["hum"]
    QTest.keyClick(palette.field, Qt.Key.Key_Return)
    assert workspace.patch().nodes[-1].type == "hum"
    QTest.keyClick(palette.field, Qt.Key.Key_Escape)
    assert set(palette.list.types()) == set(REGISTRY)


def test_a_node_dropped_from_the_palette_lies_where_it_was_dropped(workspace):
    data = QMimeData()
    data.setData(MIME, b"beat")
    place = QPointF(200, 300)
    drop = QDropEvent(place, Qt.DropAction.CopyAction, data, LEFT, NONE)
    workspace.canvas.dropEvent(drop)
    at = workspace.canvas.mapToScene(place.toPoint())
    added = workspace.patch().nodes[-1]
    assert added.type == "beat"
    assert abs(added.at[0] - at.x()) < 32


# --- wires ---


def test_dragging_from_port_to_port_connects(workspace):
    drag(workspace, port(workspace, "hum", "out", "out"), port(workspace, "shaker", "in", "acceleration"))
    assert ("hum.out", "shaker.acceleration") in workspace.patch().wires
    assert len(workspace.canvas.patch_scene.wires) == 2


def test_dragging_backwards_from_an_input_connects(workspace):
    drag(workspace, port(workspace, "shaker", "in", "acceleration"), port(workspace, "hum", "out", "out"))
    assert ("hum.out", "shaker.acceleration") in workspace.patch().wires


def test_letting_go_on_a_nodes_body_finds_the_port_that_fits(workspace):
    drag(workspace, port(workspace, "hum", "out", "out"), middle(workspace, "shaker"))
    assert ("hum.out", "shaker.acceleration") in workspace.patch().wires


@pytest.mark.parametrize(
    ("source", "target", "words"),
    [
        (("step", "onset"), ("shaker", "acceleration"), ("signals", "events")),
        (("push", "force"), ("shaker", "acceleration"), ("m/s^2", "N", "Scale")),
    ],
)
def test_a_wire_that_cannot_be_is_refused_with_the_reason(workspace, qtbot, source, target, words):
    before = workspace.patch()
    with qtbot.waitSignal(workspace.refused):
        drag(workspace, port(workspace, source[0], "out", source[1]), port(workspace, target[0], "in", target[1]))
    assert workspace.patch() == before
    assert all(word in workspace.canvas.said for word in words), workspace.canvas.said


def test_a_wire_that_would_close_a_circle_is_refused(workspace):
    patch = Patch().add("through", REGISTRY).add("through", REGISTRY, (240.0, 0.0))
    workspace.setPatch(patch.connect("through.out", "through1.signal", REGISTRY))
    drag(workspace, port(workspace, "through1", "out", "out"), port(workspace, "through", "in", "signal"))
    assert len(workspace.patch().wires) == 1
    assert "cycle" in workspace.canvas.said


def test_a_wire_drives_a_parameter_that_shows_itself_under_the_drag(workspace):
    shaker = workspace.canvas.patch_scene.nodes["shaker"]
    assert shaker.shape_now.port("in", "level") is None
    start = port(workspace, "hum", "out", "out")
    drag(workspace, start, middle(workspace, "shaker"), release=False)
    assert shaker.shape_now.port("in", "level") is not None
    end = port(workspace, "shaker", "in", "level")
    send(workspace.canvas.viewport(), QEvent.Type.MouseMove, end, LEFT)
    send(workspace.canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert ("hum.out", "shaker.level") in workspace.patch().wires
    workspace.canvas.patch_scene.select(["shaker"])
    editor = workspace.inspector.editors["level"]
    assert "Hum" in editor.driver.text()
    assert not editor.slider.isEnabled()
    QTest.mouseClick(editor.driver, LEFT)
    assert ("hum.out", "shaker.level") not in workspace.patch().wires
    assert editor.slider.isEnabled()


def test_pulling_a_wire_off_disconnects_and_undo_brings_it_back(workspace):
    end = port(workspace, "step", "in", "force")
    drag(workspace, end, end + QPoint(0, 140))
    assert workspace.patch().wires == ()
    workspace.undo_action.trigger()
    assert workspace.patch().wires == (("push.force", "step.force"),)
    assert workspace.canvas.patch_scene.wires[("push.force", "step.force")].isVisible()


def test_a_pulled_wire_that_is_put_back_changes_nothing(workspace):
    end = port(workspace, "step", "in", "force")
    drag(workspace, end, end + QPoint(3, 2))
    assert workspace.document.stack.count() == 0
    assert workspace.canvas.patch_scene.wires[("push.force", "step.force")].isVisible()


def test_a_clicked_wire_is_deleted(workspace):
    wire = workspace.canvas.patch_scene.wires[("push.force", "step.force")]
    place = workspace.canvas.mapFromScene(wire._path.pointAtPercent(0.5))
    QTest.mouseClick(workspace.canvas.viewport(), LEFT, NONE, place)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    assert workspace.patch().wires == ()
    assert len(workspace.patch().nodes) == 4


# --- moving, selecting, undoing ---


def test_several_nodes_move_on_the_grid_as_one_step_of_undo(workspace):
    before = workspace.patch()
    workspace.canvas.patch_scene.select(["push", "hum"])
    start = middle(workspace, "push")
    drag(workspace, start, start + QPoint(45, 27))
    moved = {node.id: node.at for node in workspace.patch().nodes}
    by = (moved["push"][0], moved["push"][1])
    assert by[0] % 8 == 0 == by[1] % 8
    assert by[0] > 24 and by[1] > 8
    assert moved["hum"] == (by[0], 160 + by[1])
    assert moved["step"] == (240, 0)
    assert workspace.document.stack.count() == 1
    workspace.undo_action.trigger()
    assert workspace.patch() == before
    assert workspace.canvas.patch_scene.nodes["push"].pos() == QPointF(0, 0)
    workspace.redo_action.trigger()
    assert workspace.patch().node("push").at == by


def test_arrows_nudge_and_are_undone_at_once(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    for _ in range(3):
        QTest.keyClick(workspace.canvas, Qt.Key.Key_Right)
    assert workspace.patch().node("hum").at == (24.0, 160.0)
    workspace.undo_action.trigger()
    assert workspace.patch().node("hum").at == (0.0, 160.0)


def test_a_rubber_band_selects_what_it_touches(workspace):
    view = workspace.canvas
    extent = view.patch_scene.nodes["push"].sceneBoundingRect()
    start = view.mapFromScene(extent.topLeft()) - QPoint(12, 12)
    drag(workspace, start, view.mapFromScene(extent.center()))
    assert view.selected_ids() == ["push"]
    QTest.keyClick(view, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    assert len(view.selected_ids()) == 4


def test_delete_takes_nodes_and_their_wires_and_undo_brings_both(workspace):
    before = workspace.patch()
    workspace.canvas.patch_scene.select(["push"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    assert [node.id for node in workspace.patch().nodes] == ["step", "hum", "shaker"]
    assert workspace.patch().wires == ()
    assert not workspace.canvas.patch_scene.wires
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert workspace.patch() == before


def test_copy_and_paste_go_through_json_text(workspace):
    control = Qt.KeyboardModifier.ControlModifier
    workspace.canvas.patch_scene.select(["push", "step"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_C, control)
    copied = Patch.loads(QApplication.clipboard().text(), REGISTRY)
    assert [node.id for node in copied.nodes] == ["push", "step"]
    QTest.keyClick(workspace.canvas, Qt.Key.Key_V, control)
    assert ("push1.force", "step1.force") in workspace.patch().wires
    assert workspace.canvas.selected_ids() == ["push1", "step1"]
    QTest.keyClick(workspace.canvas, Qt.Key.Key_X, control)
    assert workspace.patch() == sample()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_V, control)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_D, control)
    assert len(workspace.patch().nodes) == 8


def test_text_that_is_no_patch_is_not_pasted(workspace):
    before = workspace.patch()
    QApplication.clipboard().setText("dear diary")
    QTest.keyClick(workspace.canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert workspace.patch() == before
    assert "the clipboard is not JSON" in workspace.canvas.said


@pytest.mark.parametrize("side", ["left", "right", "top", "bottom", "across", "down"])
def test_aligning_brings_edges_into_line(workspace, side):
    canvas = workspace.canvas
    canvas.select_all()
    canvas.align(side)
    rects = [item.shape_now.rect.translated(item.pos()) for item in canvas.patch_scene.nodes.values()]
    if side in ("left", "right", "top", "bottom"):
        edges = [getattr(rect, side)() for rect in rects]
        assert max(edges) - min(edges) < 8
    else:
        starts = sorted((r.left(), r.right()) if side == "across" else (r.top(), r.bottom()) for r in rects)
        gaps = [after[0] - before[1] for before, after in zip(starts, starts[1:], strict=False)]
        assert max(gaps) - min(gaps) <= 8
        assert min(gaps) > 0


# --- the view ---


def test_wheel_zooms_about_the_mouse_and_keys_bring_it_back(workspace):
    canvas = workspace.canvas
    place = QPoint(200, 150)
    under = canvas.mapToScene(place)
    wheel = QWheelEvent(
        QPointF(place),
        QPointF(canvas.viewport().mapToGlobal(place)),
        QPoint(),
        QPoint(0, 120),
        Qt.MouseButton.NoButton,
        NONE,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(canvas.viewport(), wheel)
    assert canvas.transform().m11() > 1.1
    after = canvas.mapToScene(place)
    assert abs(after.x() - under.x()) < 4 and abs(after.y() - under.y()) < 4
    QTest.keyClick(canvas, Qt.Key.Key_0)
    assert canvas.transform().m11() == pytest.approx(1.0)


def test_frame_brings_everything_into_view(workspace):
    canvas = workspace.canvas
    canvas.centerOn(9000, 9000)
    QTest.keyClick(canvas, Qt.Key.Key_F)
    seen = canvas.mapToScene(canvas.viewport().rect()).boundingRect()
    assert seen.contains(canvas.patch_scene.extent())


def test_the_map_shows_itself_when_not_all_is_seen_and_leads_there(workspace):
    canvas = workspace.canvas
    assert not canvas.map.isVisible()
    workspace.document.edit(workspace.patch().add("hum", REGISTRY, (6000.0, 4000.0)), "Add")
    assert canvas.map.isVisible()
    QTest.mouseClick(canvas.map, LEFT, NONE, QPoint(canvas.map.width() - 20, canvas.map.height() - 20))
    assert canvas.mapToScene(canvas.viewport().rect().center()).x() > 3000


# --- the inspector ---


def test_typing_a_number_with_its_unit_sets_the_parameter(workspace, qtbot):
    workspace.canvas.patch_scene.select(["step"])
    field = workspace.inspector.editors["threshold"].field
    with qtbot.waitSignal(workspace.patchEdited) as edited:
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, "0.25 kN")
        QTest.keyClick(field, Qt.Key.Key_Return)
    assert edited.args[0].node("step").parameters == {"threshold": 250.0}
    assert "250 N" in field.text()


def test_what_is_out_of_range_is_not_taken_and_says_why(workspace):
    workspace.canvas.patch_scene.select(["step"])
    before = workspace.patch()
    field = workspace.inspector.editors["threshold"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "5000")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert workspace.patch() == before
    assert "1 to 1000 N" in field.toolTip()
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert "30 N" in field.text()


def test_dragging_a_slider_is_one_step_of_undo(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    slider = workspace.inspector.editors["frequency"].slider
    y = slider.height() // 2
    send(slider, QEvent.Type.MouseButtonPress, QPoint(20, y), LEFT)
    for x in (40, 80, 120, slider.width()):
        send(slider, QEvent.Type.MouseMove, QPoint(x, y), LEFT)
    send(slider, QEvent.Type.MouseButtonRelease, QPoint(slider.width(), y), LEFT)
    assert workspace.patch().node("hum").parameters["frequency"] == 1000.0
    assert workspace.document.stack.count() == 1
    send(slider, QEvent.Type.MouseButtonPress, QPoint(20, y), LEFT)
    send(slider, QEvent.Type.MouseButtonRelease, QPoint(20, y), LEFT)
    assert workspace.document.stack.count() == 2
    workspace.undo_action.trigger()
    workspace.undo_action.trigger()
    assert workspace.patch() == sample()
    assert workspace.inspector.editors["frequency"].value() == 50.0


def test_every_control_of_a_node_can_be_reached_and_reset(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    editors = workspace.inspector.editors
    assert list(editors) == ["frequency", "chains", "sharing"]
    editors["chains"].slider.setFocus()
    QTest.keyClick(editors["chains"].slider, Qt.Key.Key_Home)
    assert workspace.patch().node("hum").parameters["chains"] == 1
    editors["sharing"].box.setFocus()
    QTest.keyClick(editors["sharing"].box, Qt.Key.Key_Down)
    assert workspace.patch().node("hum").parameters["sharing"] == "local"
    editors["chains"].back.click()
    editors["sharing"].back.click()
    assert editors["chains"].value() == 2000
    assert workspace.patch().node("hum").parameters == {"chains": 2000, "sharing": "global"}
    assert editors["chains"].back.isHidden()


def test_tiles_are_chosen_by_buttons(workspace):
    workspace.canvas.patch_scene.select(["shaker"])
    buttons = workspace.inspector.editors["tiles"]._buttons
    assert list(buttons) == ["all", "t1", "t2", "t3", "t4"]
    buttons["t3"].click()
    buttons["t1"].click()
    assert workspace.patch().node("shaker").parameters["tiles"] == "t1+t3"
    buttons["t3"].click()
    buttons["t1"].click()
    assert workspace.patch().node("shaker").parameters["tiles"] == "all"


def test_with_nothing_selected_the_patch_itself_is_edited(workspace):
    workspace.canvas.patch_scene.select([])
    field = workspace.inspector.editors["title"].field
    field.setFocus()
    field.selectAll()
    QTest.keyClicks(field, "Gravel")
    QTest.keyClick(field, Qt.Key.Key_Return)
    assert workspace.patch().title == "Gravel"
    workspace.undo_action.trigger()
    assert workspace.patch().title == "sample"


# --- the document ---


def test_a_patch_is_the_same_after_saving_and_opening(workspace, tmp_path, qtbot):
    workspace.canvas.patch_scene.select(["step"])
    workspace._set("step", "threshold", 44.0, "")
    path = tmp_path / "sample.json"
    workspace.patch().save(path)
    workspace.markSaved()
    assert not workspace.isModified()
    edited = workspace.patch()
    workspace.setPatch(Patch())
    assert not workspace.canvas.patch_scene.nodes
    workspace.setPatch(Patch.load(path, REGISTRY))
    assert workspace.patch() == edited
    assert not workspace.document.stack.canUndo()
    with qtbot.waitSignal(workspace.modifiedChanged) as modified:
        workspace._set("step", "threshold", 45.0, "")
    assert modified.args == [True]


def test_a_file_that_is_no_patch_is_not_taken():
    with pytest.raises(BadFile):
        Patch.loads("{}", REGISTRY)


def test_set_patch_does_not_say_that_it_was_edited(workspace, qtbot):
    with qtbot.assertNotEmitted(workspace.patchEdited):
        workspace.setPatch(sample())


# --- what the engine says ---


def test_previews_are_asked_for_and_shown(workspace, qtbot):
    with qtbot.waitSignal(workspace.previewWanted) as wanted:
        workspace.canvas.patch_scene.select(["hum"])
    assert wanted.args == ["hum"]
    time_s = np.arange(4800) / 48000
    signal = 3.0 * np.sin(2 * np.pi * 250 * time_s)
    workspace.showPreview(Preview(1, 48000.0, np.full(4800, 700.0), {"out": signal}), "hum")
    assert "peak 3 m/s²" in workspace.preview.note.text()
    with qtbot.waitSignal(workspace.previewWanted) as wanted:
        workspace._set("hum", "frequency", 60.0, "")
    assert wanted.args == ["hum"]


def test_the_preview_of_an_event_output_shows_its_events(workspace):
    workspace.canvas.patch_scene.select(["step"])
    workspace._ask()
    events = np.array([[480.0, 1.0, 0.0], [960.0, 0.5, 0.0]])
    workspace.showPreview(Preview(1, 48000.0, np.ones(4800), {}, events={"onset": events}), "step")
    assert "2 events" in workspace.preview.note.text()


def test_a_preview_that_failed_says_why(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    workspace._ask()
    workspace.showPreview(Preview(1, 48000.0, np.zeros(0), {}, "no such file"), "hum")
    assert workspace.preview.note.text() == "no such file"


def test_costs_sleep_and_faults_are_shown_on_the_nodes(workspace):
    scene = workspace.canvas.patch_scene
    workspace.showCosts(Costs({"push": 0.001, "step": 0.02, "shaker": 0.3}, {"push": 1, "step": 0, "shaker": 2}))
    states = {id: (item.cost, item.state) for id, item in scene.nodes.items()}
    assert states == {
        "push": ("0.1 %", ""),
        "step": ("2.0 %", "asleep"),
        "hum": ("", "unused"),
        "shaker": ("30 %", ""),
    }
    workspace.showFault(Fault("hum", "t1", 0))
    assert scene.nodes["hum"].state == "fault"
    assert "not finite" in workspace.canvas.said


def test_a_click_on_the_tile_strikes_and_a_drag_presses(workspace, qtbot):
    pad = workspace.preview.pad
    centre = pad.rect().center()
    with qtbot.waitSignal(workspace.struck) as struck, qtbot.assertNotEmitted(workspace.pressed):
        QTest.mouseClick(pad, LEFT, NONE, centre)
    assert struck.args == ["t1", 1.0]
    forces = []
    workspace.pressed.connect(lambda tile, x, y, force: forces.append((tile, round(x, 2), round(y, 2), force)))
    send(pad, QEvent.Type.MouseButtonPress, centre, LEFT)
    for by in (10, 20, 40):
        send(pad, QEvent.Type.MouseMove, centre + QPoint(by, 0), LEFT)
    send(pad, QEvent.Type.MouseButtonRelease, centre + QPoint(40, 0), LEFT)
    assert [f[:3] for f in forces] == [("t1", 0.0, 0.0)] * 4
    assert 0 < forces[0][3] < forces[1][3] < forces[2][3] < 800
    assert forces[-1][3] == 0.0


# --- size ---


def test_two_hundred_nodes_are_drawn_and_taken_away(workspace):
    patch = Patch()
    for i in range(200):
        patch = patch.add("through", REGISTRY, (176.0 * (i % 20), 128.0 * (i // 20)))
    names = [node.id for node in patch.nodes]
    for a, b in zip(names, names[1:], strict=False):
        patch = patch.disconnect([]).connect(f"{a}.out", f"{b}.signal", REGISTRY)
    workspace.setPatch(patch)
    assert not workspace.canvas.grab().isNull()
    assert len(workspace.canvas.patch_scene.nodes) == 200
    workspace.setPatch(Patch())
    assert not [item for item in workspace.canvas.patch_scene.items() if isinstance(item, NodeItem)]
