"""The canvas under real mouse and key events."""

from itertools import pairwise

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port, sample, send
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import (
    QDropEvent,
    QKeySequence,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.patch.patch import Patch, PlacedNode
from underfoot.widgets.design.items import NodeItem
from underfoot.widgets.design.node_list import MIME

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


def test_a_key_opens_the_search_and_escape_leaves_it(workspace):
    before = workspace.patch()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Slash)
    assert workspace.canvas.search.isVisible()
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Escape)
    assert not workspace.canvas.search.isVisible()
    assert workspace.patch() == before


def test_enter_in_the_palette_adds_the_best_match(workspace):
    palette = workspace.node_palette
    palette.field.setFocus()
    QTest.keyClicks(palette.field, "hum")
    assert palette.list.types() == ["hum"]
    QTest.keyClick(palette.field, Qt.Key.Key_Return)
    assert workspace.patch().nodes[-1].type == "hum"
    QTest.keyClick(palette.field, Qt.Key.Key_Escape)
    assert set(palette.list.types()) == set(REGISTRY)


def test_a_node_dropped_from_the_palette_lies_where_it_was_dropped(workspace):
    data = QMimeData()
    data.setData(MIME, b"beat")
    place = QPointF(600, 300)
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


def test_a_wire_that_takes_the_place_of_another_says_so(workspace):
    drag(workspace, port(workspace, "hum", "out", "out"), port(workspace, "shaker", "in", "acceleration"))
    assert workspace.canvas.message == ""
    workspace.set_patch(workspace.patch().add("hum", REGISTRY, (0.0, 200.0)))
    drag(workspace, port(workspace, "hum1", "out", "out"), port(workspace, "shaker", "in", "acceleration"))
    assert ("hum.out", "shaker.acceleration") not in workspace.patch().wires
    assert "Hum (hum).out" in workspace.canvas.message


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
        (("push", "force"), ("shaker", "acceleration"), ("m/s²", "N", "Scale")),
    ],
)
def test_a_wire_that_cannot_be_is_refused_with_the_reason(workspace, qtbot, source, target, words):
    before = workspace.patch()
    with qtbot.waitSignal(workspace.refused):
        drag(workspace, port(workspace, source[0], "out", source[1]), port(workspace, target[0], "in", target[1]))
    assert workspace.patch() == before
    assert all(word in workspace.canvas.message for word in words), workspace.canvas.message


def test_a_wire_on_a_node_without_a_port_for_it_is_refused_with_the_reason(workspace):
    before = workspace.patch()
    for start, end, said in (
        (port(workspace, "hum", "out", "out"), middle(workspace, "push"), "Push has no input that takes signals"),
        (port(workspace, "step", "out", "onset"), middle(workspace, "hum"), "Hum has no input that takes events"),
    ):
        drag(workspace, start, end)
        assert workspace.canvas.message == said
        assert workspace.patch() == before


def test_a_wire_that_would_close_a_circle_is_refused(workspace):
    patch = Patch().add("through", REGISTRY).add("through", REGISTRY, (240.0, 0.0))
    workspace.set_patch(patch.connect("through.out", "through1.signal", REGISTRY))
    drag(workspace, port(workspace, "through1", "out", "out"), port(workspace, "through", "in", "signal"))
    assert len(workspace.patch().wires) == 1
    assert "cycle" in workspace.canvas.message
    workspace.canvas.patch_scene.select(["through"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Right)
    assert workspace.canvas.message == "", "the next edit is none that was refused"


def test_a_wire_drives_a_parameter_that_shows_itself_under_the_drag(workspace):
    shaker = workspace.canvas.patch_scene.nodes["shaker"]
    assert shaker.geometry.port("in", "level") is None
    start = port(workspace, "hum", "out", "out")
    drag(workspace, start, middle(workspace, "shaker"), release=False)
    assert shaker.geometry.port("in", "level") is not None
    end = port(workspace, "shaker", "in", "level")
    send(workspace.canvas.viewport(), QEvent.Type.MouseMove, end, LEFT)
    send(workspace.canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert ("hum.out", "shaker.level") in workspace.patch().wires
    workspace.canvas.patch_scene.select(["shaker"])
    editor = workspace.inspector.editors["level"]
    assert editor.driver.full_text() == "driven by Hum"
    assert not editor.slider.isEnabled()
    QTest.mouseClick(editor.driver, LEFT)
    assert ("hum.out", "shaker.level") not in workspace.patch().wires
    assert editor.slider.isEnabled()


def test_a_wire_let_go_in_the_open_asks_for_the_node_at_its_end(workspace):
    start = port(workspace, "hum", "out", "out")
    drag(workspace, start, start + QPoint(60, 120))
    QTest.keyClicks(workspace.canvas.search.field, "through")
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    assert ("hum.out", "through.signal") in workspace.patch().wires
    assert workspace.document.stack.count() == 1
    drag(workspace, start, start + QPoint(60, 120))
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Escape)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Slash)
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
    assert len(workspace.patch().wires) == 2


def test_pulling_a_wire_off_disconnects_and_undo_brings_it_back(workspace):
    end = port(workspace, "step", "in", "force")
    drag(workspace, end, end + QPoint(0, 140))
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)
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
    place = workspace.canvas.mapFromScene(wire.boundingRect().center())
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
    assert by[0] > 24
    assert by[1] > 8
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


def test_a_screen_reader_is_told_what_is_selected(workspace):
    canvas = workspace.canvas
    canvas.connect_ports("hum.out", "shaker.acceleration")
    said = []
    for _ in range(4):
        QTest.keyClick(canvas, Qt.Key.Key_N)
        said.append(canvas.accessibleDescription())
    assert said == ["Push, to Step", "Step, from Push", "Hum, to Shaker", "Shaker, from Hum"]
    QTest.keyClick(canvas, Qt.Key.Key_F2)
    QTest.keyClicks(canvas.inline, "Heel")
    QTest.keyClick(canvas.inline, Qt.Key.Key_Return)
    assert canvas.accessibleDescription() == "Heel, from Hum"
    canvas.select_all()
    assert canvas.accessibleDescription() == "4 items selected"
    canvas.add_note(QPointF(0, 400))
    QTest.keyClicks(canvas.inline, "Loud")
    QTest.keyClick(canvas.inline, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)
    canvas.patch_scene.select(["note"])
    assert canvas.accessibleDescription() == "Note: Loud"
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert canvas.accessibleDescription() == "Nothing selected"


@pytest.mark.parametrize(
    ("key", "held"),
    [(Qt.Key.Key_Escape, NONE), (Qt.Key.Key_Delete, NONE), (Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)],
)
def test_a_drag_that_a_key_ends_does_not_move_the_next_node(workspace, key, held):
    canvas, place = workspace.canvas, middle(workspace, "hum")
    drag(workspace, place, place + QPoint(0, 64), release=False)
    QTest.keyClick(canvas, key, held)
    ended = workspace.patch()
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, place + QPoint(0, 64), LEFT)
    assert workspace.patch() == ended
    place = middle(workspace, "step")
    drag(workspace, place, place + QPoint(0, 64))
    assert workspace.patch().node("step").at == (240.0, 64.0)


def test_a_wire_that_is_pulled_off_ends_with_an_edit_by_a_key(workspace):
    canvas, start = workspace.canvas, port(workspace, "step", "in", "force")
    drag(workspace, start, start + QPoint(60, 120), release=False)
    canvas.patch_scene.select(["push"])
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, start + QPoint(60, 120), LEFT)
    assert not canvas.search.isVisible()
    assert [node.id for node in workspace.patch().nodes] == ["step", "hum", "shaker"]


def test_what_undo_or_redo_brings_back_is_selected(workspace):
    canvas, control = workspace.canvas, Qt.KeyboardModifier.ControlModifier

    def act(key, modifiers=control):
        QTest.keyClick(canvas, key, modifiers)
        return canvas.patch_scene.selected()

    canvas.patch_scene.select(["push", "hum"])
    assert act(Qt.Key.Key_Delete, NONE) == []
    assert act(Qt.Key.Key_Z) == ["push", "hum"]
    canvas.patch_scene.select(["step", "hum"])
    assert act(Qt.Key.Key_E) == ["group"]
    assert act(Qt.Key.Key_Z) == ["step", "hum"]
    assert act(Qt.Key.Key_Y) == ["group"]
    canvas.add("beat")
    canvas.patch_scene.select(["push"])
    assert act(Qt.Key.Key_Right, NONE) == ["push"]
    assert act(Qt.Key.Key_Z) == ["push"]  # which only moved
    assert act(Qt.Key.Key_Z) == ["push"]
    assert act(Qt.Key.Key_Y) == ["beat"]
    workspace.document.edit(workspace.patch().move({"beat": (0.0, 2000.0)}), "Move")
    canvas.patch_scene.select(["beat"])
    act(Qt.Key.Key_Delete, NONE)
    canvas.ensure_visible(["push"])
    canvas.show_message("It is gone")
    assert act(Qt.Key.Key_Z) == ["beat"]
    assert canvas.visible_ids() == ["beat"], "what comes back is in view, wherever one was"
    assert canvas.message == ""
    workspace.document.edit(Patch(title="other").add("through", REGISTRY), "Open a preset")
    assert act(Qt.Key.Key_Z) == []


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


@pytest.mark.parametrize("text", ["dear diary", '{"dear": "diary"}'])
def test_text_that_is_no_patch_is_not_pasted(workspace, text):
    before = workspace.patch()
    QApplication.clipboard().setText(text)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert workspace.patch() == before
    assert "the clipboard holds no patch, but other text" in workspace.canvas.message
    QApplication.clipboard().clear()
    QTest.keyClick(workspace.canvas, Qt.Key.Key_V, Qt.KeyboardModifier.ControlModifier)
    assert workspace.patch() == before
    assert "the clipboard holds no text" in workspace.canvas.message


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ("Del", "Select what to delete"),
        ("Ctrl+C", "Select what to copy"),
        ("Ctrl+X", "Select what to cut"),
        ("Ctrl+D", "Select what to duplicate"),
        ("Ctrl+G", "Select what to group"),
        ("Ctrl+Shift+Left", "Select several nodes to align"),
    ],
)
def test_a_key_that_needs_a_selection_asks_for_one(workspace, keys, said):
    before = workspace.patch()
    QApplication.clipboard().setText("kept")
    QTest.keySequence(workspace.canvas, QKeySequence(keys))
    assert workspace.canvas.message == said
    assert workspace.patch() == before
    assert QApplication.clipboard().text() == "kept"


@pytest.mark.parametrize("side", ["left", "right", "top", "bottom", "across", "down"])
def test_aligning_brings_edges_into_line(workspace, side):
    canvas = workspace.canvas
    canvas.select_all()
    canvas.align(side)
    rects = [item.geometry.rect.translated(item.pos()) for item in canvas.patch_scene.nodes.values()]
    if side in ("left", "right", "top", "bottom"):
        edges = [getattr(rect, side)() for rect in rects]
        assert max(edges) - min(edges) < 8
    else:
        starts = sorted((r.left(), r.right()) if side == "across" else (r.top(), r.bottom()) for r in rects)
        gaps = [after[0] - before[1] for before, after in pairwise(starts)]
        assert max(gaps) - min(gaps) <= 8
        assert min(gaps) > 0


# --- size ---


def test_two_hundred_nodes_are_drawn_and_taken_away(workspace):
    names = [f"n{i}" for i in range(200)]
    nodes = tuple(PlacedNode(id, "through", (176.0 * (i % 20), 128.0 * (i // 20))) for i, id in enumerate(names))
    wires = tuple((f"{a}.out", f"{b}.signal") for a, b in pairwise(names))
    workspace.set_patch(Patch(nodes=nodes, wires=wires))
    assert not workspace.canvas.grab().isNull()
    assert len(workspace.canvas.patch_scene.nodes) == 200
    workspace.set_patch(Patch())
    assert not [item for item in workspace.canvas.patch_scene.items() if isinstance(item, NodeItem)]


@pytest.mark.parametrize("held", [Qt.KeyboardModifier.ShiftModifier, Qt.KeyboardModifier.ControlModifier])
def test_shift_or_control_extends_the_selection_by_click_and_by_rubber_band(workspace, held):
    workspace.canvas.fit_view(all_nodes=True)
    view, scene = workspace.canvas.viewport(), workspace.canvas.patch_scene
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, pos=middle(workspace, "push"))
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, held, middle(workspace, "hum"))
    assert set(scene.selected()) == {"push", "hum"}
    frame = workspace.canvas.mapFromScene(scene.nodes["shaker"].sceneBoundingRect()).boundingRect()
    send(view, QEvent.Type.MouseButtonPress, frame.topLeft() - QPoint(6, 6), Qt.MouseButton.LeftButton, held)
    send(view, QEvent.Type.MouseMove, frame.center(), Qt.MouseButton.LeftButton, held)
    send(view, QEvent.Type.MouseButtonRelease, frame.center(), Qt.MouseButton.LeftButton, held)
    assert set(scene.selected()) == {"push", "hum", "shaker"}
    QTest.mouseClick(view, Qt.MouseButton.LeftButton, held, middle(workspace, "push"))
    assert set(scene.selected()) == {"hum", "shaker"}
