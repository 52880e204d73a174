"""What the mouse does on the canvas besides moving nodes, and what keys do while it holds something."""

from itertools import combinations

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port, send
from groups_by_hand import CONTROL, menu_texts
from msgspec import structs
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.patch.groups import Note
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import item_rect
from underfoot.widgets.design.items import WireItem

SHIFT = Qt.KeyboardModifier.ShiftModifier


@pytest.fixture(autouse=True)
def _hand_begins_with_nothing_in_it(workspace):
    """Some tests end with a button held, over a menu that is open, or with a selection."""
    yield
    send(workspace.canvas.viewport(), QEvent.Type.MouseButtonRelease, QPoint(1, 1), LEFT)


# --- keys during a drag, and drags without an end ---


@pytest.mark.parametrize("key", [Qt.Key.Key_D, Qt.Key.Key_Right])
def test_what_a_key_places_during_a_drag_is_placed_by_what_the_drag_had_moved(workspace, key):
    canvas, place = workspace.canvas, middle(workspace, "hum")
    drag(workspace, place, place + QPoint(0, 160), release=False)
    QTest.keyClick(canvas, key, CONTROL if key == Qt.Key.Key_D else NONE)
    assert workspace.patch().node("hum").at == ((0.0, 160.0) if key == Qt.Key.Key_D else (8.0, 160.0))
    hums = [item_rect(node) for node in canvas.patch_scene.nodes.values() if node.node.type == "hum"]
    assert len(hums) == 1 or not hums[0].intersects(hums[1])


@pytest.mark.parametrize("held", ["node", "wire"])
def test_a_drag_whose_release_went_elsewhere_ends_with_the_next_move(workspace, held):
    canvas, out = workspace.canvas, port(workspace, "hum", "out", "out")
    drag(workspace, middle(workspace, "hum") if held == "node" else out, out + QPoint(60, 160), release=False)
    send(canvas.viewport(), QEvent.Type.MouseMove, out + QPoint(80, 160), Qt.MouseButton.NoButton)
    assert canvas.patch_scene.places() == {}
    assert not [item for item in canvas.patch_scene.items() if isinstance(item, WireItem) and item.wire == ("", "")]
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, out + QPoint(80, 160), LEFT)
    assert workspace.document.stack.count() == 0


def test_the_view_does_not_follow_a_mouse_whose_button_is_up(workspace):
    """A dialog had taken the release of the middle button."""
    canvas, at = workspace.canvas, QPoint(100, 100)
    send(canvas.viewport(), QEvent.Type.MouseButtonPress, at, Qt.MouseButton.MiddleButton)
    send(canvas.viewport(), QEvent.Type.MouseMove, at - QPoint(40, 0), Qt.MouseButton.MiddleButton)
    place = canvas.mapToScene(at)
    send(canvas.viewport(), QEvent.Type.MouseMove, at, Qt.MouseButton.NoButton)
    assert canvas.mapToScene(at) == place
    assert canvas.viewport().cursor().shape() == Qt.CursorShape.ArrowCursor
    send(canvas.viewport(), QEvent.Type.MouseButtonPress, at, Qt.MouseButton.MiddleButton)
    drag(workspace, middle(workspace, "hum"), middle(workspace, "hum") + QPoint(0, 80))
    assert (canvas.mapToScene(at), workspace.patch().node("hum").at) == (place, (0.0, 240.0)), "nor with the next press"


def test_a_node_that_is_held_while_a_key_deletes_it_is_let_go(workspace):
    """Qt took the next one that was dragged for it, and had it jump to the origin."""
    place, view = middle(workspace, "hum"), workspace.canvas.viewport()
    send(view, QEvent.Type.MouseButtonPress, place, LEFT)
    send(view, QEvent.Type.MouseMove, place + QPoint(1, 0), LEFT)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    send(view, QEvent.Type.MouseButtonRelease, place, LEFT)
    place = middle(workspace, "shaker")
    drag(workspace, place, place + QPoint(0, 80))
    assert [node.at for node in workspace.patch().nodes] == [(0, 0), (240, 0), (480.0, 240.0)]


def test_a_key_while_one_of_several_is_held_and_not_moved_acts_on_all_of_them(workspace):
    """It acted on that one alone: what is held is let go as if it had been clicked."""
    canvas, place = workspace.canvas, middle(workspace, "hum")
    canvas.patch_scene.select(["hum", "shaker"])
    canvas.cursor().setPos(canvas.viewport().mapToGlobal(place))
    send(canvas.viewport(), QEvent.Type.MouseButtonPress, place, LEFT)
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    assert [node.id for node in workspace.patch().nodes] == ["push", "step"]


def test_a_press_begins_anew_where_the_release_of_the_one_before_went_elsewhere(workspace):
    """A rubber band that nobody saw selected the node under the mouse alone, and the others stayed behind."""
    canvas = workspace.canvas
    send(canvas.viewport(), QEvent.Type.MouseButtonPress, canvas.mapFromScene(-30.0, 80.0), LEFT)
    canvas.patch_scene.select(["hum", "shaker"])
    place = middle(workspace, "hum")
    drag(workspace, place, place + QPoint(0, 80))
    assert [workspace.patch().node(id).at for id in ("hum", "shaker")] == [(0.0, 240.0), (480.0, 240.0)]
    drag(workspace, place, place - QPoint(0, 80), release=False)
    place = middle(workspace, "push")
    drag(workspace, place, place + QPoint(0, -80))
    assert [node.at for node in workspace.patch().nodes] == [(0.0, -80.0), (240, 0), (0.0, 240.0), (480.0, 240.0)]


def test_a_press_begins_anew_where_an_edge_was_held_before(row):
    """It went on with the edge: the note became as wide as the way to the node that was then dragged."""
    row.set_patch(structs.replace(row.patch(), notes=(Note("note", "Heel", (0.0, 200.0)),)))
    row.canvas.zoom_to(1.0)
    item, at = row.canvas.patch_scene.notes["note"], row.patch().node("hum").at
    edge = row.canvas.mapFromScene(item.mapToScene(item.size[0], 8.0))
    drag(row, edge, edge - QPoint(70, 0), release=False)
    drag(row, middle(row, "hum"), middle(row, "hum") + QPoint(0, 80))
    assert row.patch().notes[0].width == item.size[0] == 200.0
    assert row.patch().node("hum").at == (at[0], at[1] + 80.0)


# --- zoomed out ---


def test_a_port_is_hit_within_some_pixels_whatever_the_zoom_and_the_node_beside_it_is_not(workspace):
    canvas, wire = workspace.canvas, ("hum.out", "shaker.acceleration")
    canvas.zoom_to(0.2)
    out, target = (port(workspace, *end) for end in (("hum", "out", "out"), ("shaker", "in", "acceleration")))
    drag(workspace, out + QPoint(6, 5), target - QPoint(6, -5))
    assert wire in workspace.patch().wires
    drag(workspace, out - QPoint(5, 0), out + QPoint(0, 40))
    assert workspace.patch().node("hum").at != (0, 160)
    canvas.zoom_to(0.1)
    for id, side, name, by in (("push", "out", "force", 3), ("step", "in", "force", -3)):  # in reach of both
        between = canvas.mapToScene(port(workspace, id, side, name) + QPoint(by, 0))
        assert canvas.patch_scene.port_at(between)[0].node.id == id
        assert canvas.patch_scene.port_at(between, "in")[0].node.id == "step"


def test_the_field_of_a_name_goes_with_its_node_when_the_view_moves(workspace):
    canvas = workspace.canvas
    canvas.edit_title("hum")
    for moves in (lambda: canvas.zoom_to(0.6), lambda: canvas.pan(-40, 30)):
        moves()
        assert canvas.inline.pos() == canvas.mapFromScene(canvas.patch_scene.nodes["hum"].pos())
    canvas.pan(0, -4000)
    assert canvas.rect().contains(canvas.inline.geometry())  # what is being written is seen


def test_a_click_between_two_ports_that_are_close_to_each_other_connects_nothing(workspace):
    canvas = workspace.canvas
    workspace.set_patch(Patch().add("hum", REGISTRY).add("through", REGISTRY, (152.0, 0.0)))
    for zoom, by in ((1.0, 6), (1.0, 8), (0.25, 1), (0.1, 0)):
        canvas.zoom_to(zoom)
        QTest.mouseClick(canvas.viewport(), LEFT, NONE, port(workspace, "hum", "out", "out") + QPoint(by, 0))
        assert workspace.patch().wires == ()
    drag(workspace, port(workspace, "hum", "out", "out"), port(workspace, "through", "in", "signal") + QPoint(1, 0))
    assert workspace.patch().wires == (("hum.out", "through.signal"),)


# --- several wires ---

FIRST, SECOND = ("hum.out", "through.signal"), ("through.out", "through1.signal")


def on_wire(workspace, wire):
    """Where the middle of a wire is in the view."""
    return workspace.canvas.mapFromScene(workspace.canvas.patch_scene.wires[wire].boundingRect().center())


@pytest.mark.parametrize("zoom", [1.0, 0.2])  # from far all of a wire is within reach of its ports
def test_wires_are_selected_together_and_deleted_at_once(row, zoom):
    canvas = row.canvas
    canvas.zoom_to(zoom)
    canvas.patch_scene.select(["hum"])
    QTest.mouseClick(canvas.viewport(), LEFT, NONE, on_wire(row, FIRST))
    QTest.mouseClick(canvas.viewport(), LEFT, SHIFT, on_wire(row, SECOND))
    assert canvas.patch_scene.chosen_wires() == [FIRST, SECOND]
    assert "Delete" in menu_texts(row, on_wire(row, FIRST))
    assert canvas.patch_scene.chosen_wires() == [FIRST, SECOND]
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    assert len(row.patch().wires) == 1
    assert row.document.stack.undoText() == "Disconnect 2 wires"
    row.undo_action.trigger()
    for clicked, chosen in ((FIRST, [FIRST]), (SECOND, [FIRST, SECOND]), (FIRST, [SECOND])):
        QTest.mouseClick(canvas.viewport(), LEFT, CONTROL, on_wire(row, clicked))
        assert canvas.patch_scene.chosen_wires() == chosen


def test_a_press_on_a_selected_frame_lets_go_of_wires_as_one_on_a_node_does(chain):
    QTest.mouseClick(chain.canvas.viewport(), LEFT, SHIFT, on_wire(chain, FIRST))
    assert chain.canvas.patch_scene.chosen_wires() == [FIRST]
    title = chain.canvas.mapFromScene(chain.canvas.patch_scene.group_frames["group"].title_rect().center())
    drag(chain, title, title - QPoint(0, 40))
    assert chain.canvas.patch_scene.chosen_wires() == []


@pytest.mark.parametrize("ends", ["released", "escape"])
def test_a_stroke_with_control_and_the_right_button_cuts_the_wires_that_it_crosses(row, ends):
    view, right = row.canvas.viewport(), Qt.MouseButton.RightButton
    place = on_wire(row, FIRST)
    send(view, QEvent.Type.MouseButtonPress, place - QPoint(0, 60), right, CONTROL)
    QApplication.sendEvent(view, QContextMenuEvent(QContextMenuEvent.Reason.Mouse, place, QPoint(), CONTROL))
    for at in (place + QPoint(0, 90), on_wire(row, SECOND) + QPoint(0, 90), on_wire(row, SECOND) - QPoint(0, 60)):
        send(view, QEvent.Type.MouseMove, at, right, CONTROL)
    assert row.canvas.patch_scene.chosen_wires() == [FIRST, SECOND]
    if ends == "escape":
        QTest.keyClick(row.canvas, Qt.Key.Key_Escape)
    send(view, QEvent.Type.MouseButtonRelease, at, right)
    QApplication.sendEvent(view, QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, QPoint()))  # where it comes late
    assert not [menu for menu in row.canvas.findChildren(QMenu) if menu.isVisible()]
    assert row.canvas.patch_scene.chosen_wires() == []
    assert len(row.patch().wires) == (3 if ends == "escape" else 1)
    assert row.document.stack.count() == (0 if ends == "escape" else 1)


# --- copies ---

ALT = Qt.KeyboardModifier.AltModifier


def test_what_is_let_go_with_alt_is_copied_there_and_stays(chain):
    row, before = chain, chain.patch()
    row.canvas.patch_scene.select(["hum", "through"])
    place = middle(row, "hum")
    drag(row, place, place + QPoint(0, 200), modifiers=ALT)
    copies = row.patch().nodes[len(before.nodes) :]
    assert [(node.type, node.at) for node in copies] == [("hum", (0.0, 200.0)), ("through", (200.0, 200.0))]
    assert row.patch().nodes[: len(before.nodes)] == before.nodes
    assert row.patch().wires == (*before.wires, (f"{copies[0].id}.out", f"{copies[1].id}.signal"))
    assert all(item.pos() == QPointF(*item.node.at) for item in row.canvas.patch_scene.nodes.values())
    assert row.canvas.selected_ids() == [node.id for node in copies]
    row.undo_action.trigger()
    assert row.patch() == before


def test_a_duplicate_with_input_wires_is_fed_from_outside_as_its_original_is(chain):
    before = chain.patch()
    chain.canvas.patch_scene.select(["through", "through1"])
    assert "Duplicate with input wires" in menu_texts(chain, middle(chain, "through"))
    QTest.keyClick(chain.canvas, Qt.Key.Key_D, CONTROL | SHIFT)
    assert chain.canvas.selected_ids() == ["through2", "through3"]
    wires = {("through2.out", "through3.signal"), ("hum.out", "through2.signal")}
    assert set(chain.patch().wires) == {*before.wires, *wires}
    chain.undo_action.trigger()
    assert chain.patch() == before


def test_a_duplicate_with_a_wire_at_a_parameter_is_placed_by_its_height_with_that_port(row):
    """It was taken for as high as a node without wires, and lay over what is below it."""
    row.document.edit(row.patch().connect("hum.out", "shaker.level", REGISTRY), "Connect")
    for _ in range(2):
        row.canvas.patch_scene.select(["shaker"])
        QTest.keyClick(row.canvas, Qt.Key.Key_D, CONTROL | SHIFT)
    places = [item_rect(item) for id, item in row.canvas.patch_scene.nodes.items() if id.startswith("shaker")]
    assert not [pair for pair in combinations(places, 2) if pair[0].adjusted(-15, -15, 15, 15).intersects(pair[1])]


def test_a_frame_that_is_let_go_with_alt_is_copied_with_its_group(chain):
    title = chain.canvas.mapFromScene(chain.canvas.patch_scene.group_frames["group"].title_rect().center())
    drag(chain, title, title - QPoint(0, 200), modifiers=ALT)
    first, second = chain.patch().groups
    assert (first.members, second.title) == (("through", "through1"), "Chain")
    assert [chain.patch().node(id).at for id in second.members] == [(200.0, -200.0), (400.0, -200.0)]


@pytest.mark.parametrize(("down", "members"), [(304, 2), (24, 3)])
def test_a_copy_is_in_the_group_of_its_original_if_it_is_let_go_in_its_frame(chain, down, members):
    chain.canvas.patch_scene.select(["through1"])
    place = middle(chain, "through1")
    drag(chain, place, place + QPoint(0, down), modifiers=ALT)
    copy = chain.patch().nodes[-1]
    assert (copy.type, len(chain.patch().group("group").members)) == ("through", members)
    assert copy.at == (400.0, 304.0) or members == 3


def test_no_wire_lights_up_under_what_is_copied_as_a_copy_is_not_inserted(row):
    row.canvas.add("through", QPointF(200.0, 300.0))
    row.canvas.zoom_to(1.0)
    start, end, view = middle(row, "through2"), on_wire(row, FIRST), row.canvas.viewport()
    drag(row, start, end, release=False)
    assert row.canvas.patch_scene.wires[FIRST].is_highlighted
    send(view, QEvent.Type.MouseMove, end, LEFT, ALT)
    assert not row.canvas.patch_scene.wires[FIRST].is_highlighted
    send(view, QEvent.Type.MouseButtonRelease, end, LEFT, ALT)
    assert FIRST in row.patch().wires


# --- the width of a note ---


def test_the_right_edge_of_a_note_sets_its_width(row):
    words = "Heel first, then the ball of the foot"
    row.set_patch(structs.replace(row.patch(), notes=(Note("note", words, (0.0, 200.0)),)))
    row.canvas.zoom_to(1.0)
    item = row.canvas.patch_scene.notes["note"]
    low = item.size[1]

    def edge():
        return row.canvas.mapFromScene(item.mapToScene(item.size[0], 8.0))

    view = row.canvas.viewport()
    send(view, QEvent.Type.MouseMove, edge(), Qt.MouseButton.NoButton)
    drag(row, edge(), edge() - QPoint(70, 0), release=False)
    assert view.cursor().shape() == Qt.CursorShape.SizeHorCursor
    send(view, QEvent.Type.MouseButtonRelease, edge(), LEFT)
    assert (row.patch().notes[0].width, row.patch().notes[0].at) == (128.0, (0.0, 200.0))
    assert item.size[0] == 128.0
    assert item.size[1] > low
    QTest.mouseClick(view, LEFT, NONE, middle(row, "hum"))
    QTest.mouseClick(view, LEFT, SHIFT, edge())
    assert row.canvas.patch_scene.selected() == ["hum", "note"]
    drag(row, edge(), edge() - QPoint(300, 0), release=False)
    assert item.size[0] == 64.0
    QTest.keyClick(row.canvas, Qt.Key.Key_Escape)
    send(row.canvas.viewport(), QEvent.Type.MouseButtonRelease, QPoint(9, 9), LEFT)
    assert item.size[0] == row.patch().notes[0].width == 128.0
    row.undo_action.trigger()
    assert item.size == (200.0, low)
    drag(row, edge(), edge() + QPoint(296, 0))
    QTest.keyClick(row.canvas, Qt.Key.Key_F2)
    assert item.size[0] == 496.0
    assert row.canvas.inline.width() >= 496  # so that lines break where they will
    QTest.keyClick(row.canvas.inline, Qt.Key.Key_Escape)
    before = structs.replace(row.patch(), notes=(Note("note", words, (3.0, 200.0)),))
    row.set_patch(before)
    drag(row, edge(), edge() + QPoint(1, 0))
    assert row.patch() == before  # a hand that trembles sets nothing


def test_the_mouse_shows_no_copying_after_a_drag_with_alt_over_a_note_that_it_has_left_by_its_edge(row):
    row.set_patch(structs.replace(row.patch(), notes=(Note("note", "Heel", (0.0, 200.0)),)))
    row.canvas.zoom_to(1.0)
    row.canvas.centerOn(200.0, 200.0)  # so that nothing scrolls
    view, free = row.canvas.viewport(), Qt.MouseButton.NoButton
    start, edge, beside = middle(row, "hum"), *(row.canvas.mapFromScene(x, 208.0) for x in (199.0, 240.0))
    for place in (edge, beside, start):
        send(view, QEvent.Type.MouseMove, place, free)
    send(view, QEvent.Type.MouseButtonPress, start, LEFT)
    for place in (start + QPoint(0, 50), edge - QPoint(60, 0)):
        send(view, QEvent.Type.MouseMove, place, LEFT, ALT)
    send(view, QEvent.Type.MouseButtonRelease, place, LEFT, ALT)
    send(view, QEvent.Type.MouseMove, beside, free)
    assert view.cursor().shape() == Qt.CursorShape.ArrowCursor
