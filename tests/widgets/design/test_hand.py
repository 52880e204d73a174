"""A hand's habits on the canvas: nodes dropped on wires, wires that heal, nodes changed, none on top of another."""

from itertools import combinations

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port, send
from groups_by_hand import click_in_menu, write
from msgspec.structs import replace
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QContextMenuEvent, QDragMoveEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.nodes import REGISTRY as NODES
from underfoot.patch.groups import Group, Note
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import item_rect
from underfoot.widgets.design.node_list import MIME, NodeList
from underfoot.widgets.design.rewiring import types_of_unit, types_that_fit

CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def line(workspace):
    """A patch of a tone that is played, with room between."""
    patch = Patch().add("hum", REGISTRY).add("shaker", REGISTRY, (560.0, 0.0)).add("through", REGISTRY, (0.0, 240.0))
    workspace.set_patch(patch.connect("hum.out", "shaker.acceleration", REGISTRY))
    return workspace


def in_the_middle(workspace, wire):
    """Where the middle of a wire is in the view."""
    return workspace.canvas.mapFromScene(workspace.canvas.patch_scene.wires[wire].boundingRect().center())


WIRE = ("hum.out", "shaker.acceleration")
THROUGH = {("hum.out", "through.signal"), ("through.out", "shaker.acceleration")}


def boxes(workspace):
    return [QRectF(i.pos().x(), i.pos().y(), *i.size) for i in workspace.canvas.patch_scene.nodes.values()]


def choose(workspace, words):
    QTest.keyClicks(workspace.canvas.search.field, words)
    QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Return)


# --- into a wire ---


def test_a_node_dragged_onto_a_wire_lights_it_up_and_goes_into_it(line):
    start, wire = middle(line, "through"), line.canvas.patch_scene.wires[WIRE]
    drag(line, start, in_the_middle(line, WIRE), release=False)
    assert wire.is_highlighted
    send(line.canvas.viewport(), QEvent.Type.MouseButtonRelease, in_the_middle(line, WIRE), LEFT)
    assert set(line.patch().wires) == THROUGH
    assert line.document.stack.undoText() == "Insert Through"
    assert not [pair for pair in combinations(boxes(line), 2) if pair[0].intersects(pair[1])]
    line.undo_action.trigger()
    assert line.patch().wires == (WIRE,)
    assert line.patch().node("through").at == (0.0, 240.0)


@pytest.mark.parametrize("by", ["drag", "list"])
def test_a_wire_into_which_a_node_goes_makes_room_for_it(chain, by):
    """What follows moves right, with a frame and what that would come to lie over; all in one step."""
    chain.document.edit(chain.patch().add("beat", REGISTRY, (784.0, 0.0)).add("through", REGISTRY, (0.0, 240.0)), "Add")
    before, wire = chain.patch(), ("hum.out", "through.signal")
    if by == "drag":
        drag(chain, middle(chain, "through2"), in_the_middle(chain, wire))
    else:
        QTest.mouseDClick(chain.canvas.viewport(), LEFT, NONE, in_the_middle(chain, wire))
        choose(chain, "thr")
    id = chain.canvas.selected_ids()[0]
    assert {("hum.out", f"{id}.signal"), (f"{id}.out", "through.signal")} <= {*chain.patch().wires}
    places = [chain.patch().node(one).at[0] for one in ("hum", id, "through", "shaker", "beat")]
    assert places == [0.0, 160.0, 336.0, 736.0, 920.0]
    assert not [pair for pair in combinations(boxes(chain), 2) if pair[0].intersects(pair[1])]
    chain.undo_action.trigger()
    assert chain.patch() == before


@pytest.mark.parametrize(("framed", "places"), [("hum", (0, 336, 496)), ("shaker", (0, 160, 456))])
def test_a_node_in_a_wire_that_leaves_a_frame_lies_beside_the_frame(workspace, framed, places):
    """It lay over it, where the frame is wider than the end of the wire in it, and was not in its group."""
    patch = Patch().add("hum", REGISTRY).add("shaker", REGISTRY, (360.0 if framed == "hum" else 280.0, 0.0))
    workspace.set_patch(patch.connect(*WIRE, REGISTRY).add("beat", REGISTRY, (160.0, 160.0)))
    workspace.canvas.patch_scene.select([framed, "beat"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_G, CONTROL)
    write(workspace, "Wide")
    QTest.mouseDClick(workspace.canvas.viewport(), LEFT, NONE, in_the_middle(workspace, WIRE))
    choose(workspace, "thr")
    frame, nodes = workspace.canvas.patch_scene.group_frames["group"], workspace.canvas.patch_scene.nodes
    assert tuple(nodes[id].pos().x() for id in ("hum", "through", "shaker")) == places
    assert not frame.frame_rect().intersects(item_rect(nodes["through"]))


def test_a_node_that_is_dropped_at_the_end_of_a_long_wire_moves_nothing_else(line):
    before = line.patch()
    shaker = line.canvas.patch_scene.nodes["shaker"].port_place("in", "acceleration")
    QTest.mouseDClick(line.canvas.viewport(), LEFT, NONE, line.canvas.mapFromScene(shaker - QPointF(16.0, 0.0)))
    choose(line, "thr")
    assert [node.at for node in line.patch().nodes[:3]] == [node.at for node in before.nodes]
    assert line.patch().node("through1").at[0] == 560.0 - 24.0 - 136.0


def test_a_node_that_does_not_fit_lights_nothing_up(line):
    line.document.edit(line.patch().add("beat", REGISTRY, (0.0, 400.0)), "Add")
    drag(line, middle(line, "beat"), in_the_middle(line, WIRE), release=False)
    assert not line.canvas.patch_scene.wires[WIRE].is_highlighted
    send(line.canvas.viewport(), QEvent.Type.MouseButtonRelease, in_the_middle(line, WIRE), LEFT)
    assert line.patch().wires == (WIRE,)


def test_a_node_dropped_from_the_palette_on_a_wire_goes_into_it(line):
    data = QMimeData()
    data.setData(MIME, b"through")
    line.document.edit(line.patch().remove(["through"]), "Delete")
    place = QPointF(in_the_middle(line, WIRE))
    copy = Qt.DropAction.CopyAction
    line.canvas.dragMoveEvent(QDragMoveEvent(place.toPoint(), copy, data, LEFT, NONE))
    assert line.canvas.patch_scene.wires[WIRE].is_highlighted
    line.canvas.dropEvent(QDropEvent(place, copy, data, LEFT, NONE))
    assert set(line.patch().wires) == THROUGH


def test_a_double_click_on_a_wire_lists_what_goes_into_it(line):
    line.document.edit(line.patch().remove(["through"]), "Delete")
    QTest.mouseDClick(line.canvas.viewport(), LEFT, NONE, in_the_middle(line, WIRE))
    assert set(line.canvas.search.list.types()) == {"through", "shaker"}
    choose(line, "thr")
    assert set(line.patch().wires) == THROUGH


def test_a_wire_that_was_clicked_is_not_deleted_with_what_a_key_selects(line):
    QTest.mouseClick(line.canvas.viewport(), LEFT, NONE, in_the_middle(line, WIRE))
    assert line.canvas.patch_scene.chosen_wires() == [WIRE]
    QTest.keyClick(line.canvas, Qt.Key.Key_N, Qt.KeyboardModifier.ShiftModifier)
    QTest.keyClick(line.canvas, Qt.Key.Key_Delete)
    assert [node.id for node in line.patch().nodes] == ["hum", "shaker"]
    assert line.patch().wires == (WIRE,)


# --- wires in the open ---


def test_a_wire_in_the_open_lists_only_what_fits(workspace):
    start = port(workspace, "push", "out", "force")
    drag(workspace, start, start + QPoint(30, 260))
    assert set(workspace.canvas.search.list.types()) == {"step", "through"}
    choose(workspace, "step")
    assert ("push.force", "step1.force") in workspace.patch().wires


def test_an_input_lists_what_can_feed_it(workspace):
    start = port(workspace, "shaker", "in", "acceleration")
    drag(workspace, start, start + QPoint(-60, 160))
    assert set(workspace.canvas.search.list.types()) == {"hum", "shaker", "through"}


@pytest.mark.parametrize("leave", ["escape", "elsewhere"])
def test_a_list_that_is_left_never_loses_the_wire(workspace, leave):
    end = port(workspace, "step", "in", "force")
    drag(workspace, end, end + QPoint(0, 200))
    if leave == "escape":
        QTest.keyClick(workspace.canvas.search.field, Qt.Key.Key_Escape)
    else:
        QTest.mouseClick(workspace.canvas.viewport(), LEFT, NONE, QPoint(20, 20))
    assert not workspace.canvas.search.isVisible()
    assert workspace.patch().wires == (("push.force", "step.force"),)
    assert workspace.canvas.patch_scene.wires[("push.force", "step.force")].isVisible()
    assert workspace.document.stack.count() == 0


def test_a_pulled_wire_goes_to_what_is_chosen(workspace):
    end = port(workspace, "step", "in", "force")
    drag(workspace, end, end + QPoint(0, 200))
    choose(workspace, "thr")
    assert workspace.patch().wires == (("push.force", "through.signal"),)
    assert workspace.document.stack.count() == 1


# --- out of a wire, and into another node ---


def test_wires_heal_where_a_node_goes(line):
    line.canvas.insert(line.patch(), "through", WIRE)
    line.canvas.patch_scene.select(["through"])
    QTest.keyClick(line.canvas, Qt.Key.Key_Delete)
    assert line.patch().wires == (WIRE,)
    assert line.document.stack.undoText() == "Delete Through"


def test_wires_heal_over_several_nodes_and_not_where_units_differ(workspace):
    patch = workspace.patch().add("through", REGISTRY).add("through", REGISTRY)
    for wire in (
        ("push.force", "through.signal"),
        ("through.out", "through1.signal"),
        ("through1.out", "shaker.acceleration"),
        ("through1.out", "step.force"),
    ):
        patch = patch.connect(*wire, REGISTRY)
    workspace.set_patch(patch)
    workspace.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    assert workspace.patch().wires == (("push.force", "step.force"),)


def test_a_node_is_replaced_and_keeps_wires_place_and_parameters(line):
    patch = line.patch().set("hum", "frequency", 80.0, REGISTRY).name("hum", "Engine")
    line.set_patch(patch.move({"hum": (8.0, 16.0)}))
    line.canvas.patch_scene.select(["hum"])
    QTest.keyClick(line.canvas, Qt.Key.Key_R)
    assert "hum" not in line.canvas.search.list.types()
    choose(line, "through")
    assert line.patch().wires == (("through1.out", "shaker.acceleration"),)
    node = line.patch().nodes[0]
    assert (node.type, node.at, node.label, node.parameters) == ("through", (8.0, 16.0), "Engine", {})
    assert line.document.stack.undoText() == "Replace Engine by Through"


def test_a_wire_that_fits_no_port_of_the_new_node_goes_and_is_told(line):
    line.canvas.patch_scene.select(["hum"])
    QTest.keyClick(line.canvas, Qt.Key.Key_R)
    choose(line, "beat")
    assert line.patch().wires == ()
    assert "1 wire did not fit Beat" in line.canvas.message


# --- room ---


def test_no_new_node_lies_on_another(workspace):
    canvas = workspace.canvas
    for _ in range(6):
        workspace.node_palette.chosen.emit("hum")
    for _ in range(3):
        QTest.keyClick(canvas, Qt.Key.Key_D, CONTROL)
    canvas.select_all()
    QTest.keyClick(canvas, Qt.Key.Key_C, CONTROL)
    QTest.keyClick(canvas, Qt.Key.Key_V, CONTROL)
    assert len(workspace.patch().nodes) == 26
    assert not [pair for pair in combinations(boxes(workspace), 2) if pair[0].intersects(pair[1])]


def test_tidying_up_follows_the_flow_and_is_one_step(workspace):
    patch = Patch()
    for i in range(3):
        patch = patch.add("through", REGISTRY, (float(300 - 80 * i), float(40 * i)))
    patch = patch.add("hum", REGISTRY).add("shaker", REGISTRY, (0.0, 3000.0))
    for wire in (
        ("hum.out", "through.signal"),
        ("through.out", "through1.signal"),
        ("through1.out", "shaker.acceleration"),
    ):
        patch = patch.connect(*wire, REGISTRY)
    framed = Note("upper", "How", (0.0, -400.0)), Note("lower", "and why", (0.0, 2900.0))
    patch = replace(
        patch, notes=(Note("note", "The tile", (0.0, 3120.0)), *framed), groups=(Group("legend", ("upper", "lower")),)
    )
    workspace.set_patch(patch)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_L, CONTROL)
    places = {node.id: node.at for node in workspace.patch().nodes}
    assert places["hum"][0] < places["through"][0] < places["through1"][0] < places["shaker"][0]
    assert min(x for x, _ in places.values()) == min(node.at[0] for node in patch.nodes)
    assert min(y for _, y in places.values()) == min(node.at[1] for node in patch.nodes)
    assert not [pair for pair in combinations(boxes(workspace), 2) if pair[0].intersects(pair[1])]
    note, upper, lower = workspace.patch().notes
    assert note.at == (places["shaker"][0], places["shaker"][1] + 120.0)  # not 3000 below it
    assert (lower.at[0] - upper.at[0], lower.at[1] - upper.at[1]) == (0.0, 3300.0)  # of one frame
    assert workspace.document.stack.undoText() == "Tidy up 5 nodes"
    workspace.undo_action.trigger()
    assert workspace.patch() == patch


def test_tidying_up_puts_nodes_without_wires_in_rows(workspace):
    """In one column, 30 of them were 3000 pixels high. Three are one row, which tidying up again leaves as it is."""
    patch = Patch()
    for i in range(3):
        patch = patch.add("shaker", REGISTRY, (0.0, 300.0 * i))
    workspace.set_patch(patch)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_L, CONTROL)
    tidy = workspace.patch()
    assert {node.at[1] for node in tidy.nodes} == {0.0}
    QTest.keyClick(workspace.canvas, Qt.Key.Key_L, CONTROL)
    assert workspace.patch() == tidy
    patch = Patch()
    for i in range(30):
        patch = patch.add("through" if i % 2 else "shaker", REGISTRY, (0.0, 10.0 * i))
    workspace.set_patch(patch)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_L, CONTROL)
    extent = workspace.canvas.patch_scene.extent()
    assert 0.5 < extent.width() / extent.height() < 2.0
    assert not [pair for pair in combinations(boxes(workspace), 2) if pair[0].intersects(pair[1])]


def test_tidying_up_leaves_room_for_wires_to_what_is_not_arranged(line):
    """Beside each other, in a sub-patch, two nodes looked as if one fed the other."""
    patch = line.patch().add("shaker", REGISTRY, (760.0, 160.0))
    line.set_patch(patch.connect("hum.out", "shaker1.acceleration", REGISTRY))
    line.canvas.patch_scene.select(["shaker", "shaker1"])
    QTest.keyClick(line.canvas, Qt.Key.Key_L, CONTROL)
    assert [line.patch().node(id).at[0] for id in ("shaker", "shaker1")] == [560.0, 560.0]


def test_the_list_says_why_what_was_typed_is_not_in_it(line):
    start = port(line, "hum", "out", "out")
    drag(line, start, start + QPoint(0, 120))
    field, rows = line.canvas.search.field, line.canvas.search.list
    for words, said in (("step", "Step does not fit here"), ("zzz", "No node has these words")):
        field.setText(words)
        assert [rows.item(i).text() for i in range(rows.count())] == [said]
        assert rows.current() == ""
        QTest.keyClick(field, Qt.Key.Key_Return)
        assert (field.isVisible(), field.text()) == (True, words)
    field.clear()
    choose(line, "thr")
    assert ("hum.out", "through1.signal") in line.patch().wires


def test_a_click_in_the_list_chooses_its_row_and_on_a_heading_nothing(line):
    search = line.canvas.search
    QTest.keyClick(line.canvas, Qt.Key.Key_Slash)
    QTest.keyClick(search.field, Qt.Key.Key_Down)
    for words, nodes in (("FLOOR", 3), ("Beat", 4)):
        (row,) = search.list.findItems(words, Qt.MatchFlag.MatchExactly)
        QTest.mouseClick(search.list.viewport(), LEFT, NONE, search.list.visualItemRect(row).center())
        assert (search.isVisible(), len(line.patch().nodes)) == (words == "FLOOR", nodes)
    assert line.canvas.hasFocus()


def test_the_list_is_no_higher_than_the_canvas_and_begins_at_its_top(line):
    search = line.canvas.search
    line.canvas.setFixedHeight(240)
    QTest.keyClick(line.canvas, Qt.Key.Key_Slash)
    assert line.canvas.rect().contains(search.geometry())
    search.list.scrollToBottom()
    QTest.keyClick(search.field, Qt.Key.Key_Escape)
    QTest.keyClick(line.canvas, Qt.Key.Key_Slash)
    assert search.list.visualItemRect(search.list.item(0)).top() == 0


@pytest.mark.parametrize(
    ("typed", "first"), [("force", "tile-force"), ("force env", "force-envelope"), ("tile", "tile-force")]
)
def test_of_names_that_fit_those_with_the_unit_of_the_wire_come_first(qtbot, typed, first):
    end = NODES["stick-slip"].input_ports["force"]
    fitting = types_that_fit(NODES, end, "in")
    nodes = NodeList(NODES)
    qtbot.addWidget(nodes)
    nodes.set_allowed(fitting, preferred=types_of_unit(NODES, fitting, end, "in"))
    nodes.filter_by(typed)
    assert nodes.types()[0] == first


@pytest.mark.parametrize("typed", ["friction", "squeak", "rubber", "stick"])
def test_a_squeak_is_found_by_words_for_it(qtbot, typed):
    nodes = NodeList(NODES)
    qtbot.addWidget(nodes)
    nodes.filter_by(typed)
    assert nodes.types()[0] == "stick-slip"


def test_a_node_pulled_from_an_input_ends_where_the_wire_was_let_go(line):
    line.set_patch(Patch().add("shaker", REGISTRY, (560.0, 0.0)))
    line.canvas.zoom_to(1.0)
    start = port(line, "shaker", "in", "acceleration")
    end = start - QPoint(240, 0)
    drag(line, start, end)
    choose(line, "hum")
    assert line.patch().wires == (WIRE,)
    there = port(line, "hum", "out", "out")
    moved = port(line, "shaker", "in", "acceleration") - start  # the view may have followed
    assert abs(there.x() - end.x() - moved.x()) <= 8


def test_nodes_that_are_added_to_a_port_lie_in_a_row_with_it_and_none_behind_it(workspace):
    """Each lay lower than the one before; where there was no room, one went to the left of the port that fed it."""
    canvas = workspace.canvas
    workspace.set_patch(Patch().add("through", REGISTRY))
    for source in ("through", "through1", "through", "through", "through"):
        canvas.patch_scene.select([source])
        QTest.keyClick(canvas, Qt.Key.Key_C)
        QTest.keyClick(canvas.connection_search.field, Qt.Key.Key_Return)
        choose(workspace, "through")
    places = [node.at for node in workspace.patch().nodes]
    assert places[:3] == [(0.0, 0.0), (184.0, 0.0), (368.0, 0.0)]
    assert min(x for x, _ in places[3:]) == 184.0


# --- what was just made is seen ---


def seen(workspace, id):
    """Whether an item is wholly in the view, and not behind the map."""
    canvas = workspace.canvas
    place = canvas.mapFromScene(canvas.patch_scene.extent([id])).boundingRect()
    is_covered = not canvas.map.isHidden() and place.intersects(canvas.map.geometry())
    return canvas.viewport().rect().contains(place) and not is_covered


def at_the_lower_edge(workspace, *ids):
    """Move the view until these nodes are at its lower edge, and select them."""
    canvas = workspace.canvas
    canvas.zoom_to(1.0)
    canvas.patch_scene.select(ids)
    bottom = canvas.mapFromScene(canvas.patch_scene.extent(ids)).boundingRect().bottom()
    canvas.pan(0, bottom - canvas.viewport().height() + 8)


@pytest.mark.parametrize("keys", [(Qt.Key.Key_D,), (Qt.Key.Key_C, Qt.Key.Key_V)])
def test_a_copy_is_in_the_view(line, keys):
    at_the_lower_edge(line, "hum")
    for key in keys:
        QTest.keyClick(line.canvas, key, CONTROL)
    assert line.canvas.selected_ids() == ["hum1"]
    assert seen(line, "hum1")


def test_what_arrows_move_stays_in_the_view(line):
    at_the_lower_edge(line, "hum")
    for _ in range(4):
        QTest.keyClick(line.canvas, Qt.Key.Key_Down, Qt.KeyboardModifier.ShiftModifier)
    assert seen(line, "hum")


def test_a_sub_patch_is_in_the_view_once_it_is_made(line):
    line.set_patch(line.patch().move({"through": (0.0, 0.0), "hum": (0.0, 900.0)}))
    at_the_lower_edge(line, "hum", "through")
    QTest.keyClick(line.canvas, Qt.Key.Key_E, CONTROL)
    assert seen(line, line.canvas.patch_scene.selected()[0])


# --- the right button ---


@pytest.mark.parametrize("held", ["wire", "node"])
def test_the_right_button_cancels_a_drag_and_opens_no_menu(workspace, held):
    """The menu took the release of the left button: a wire stayed at the mouse, and the pulled one hidden."""
    canvas, view, patch = workspace.canvas, workspace.canvas.viewport(), workspace.patch()
    start = port(workspace, "step", "in", "force") if held == "wire" else middle(workspace, "step")
    end = start + QPoint(-40, 120)
    drag(workspace, start, end, release=False)
    right = Qt.MouseButton.RightButton
    send(view, QEvent.Type.MouseButtonPress, end, right)
    asks = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, end, view.mapToGlobal(end))
    QApplication.sendEvent(view, asks)
    assert not [menu for menu in canvas.findChildren(QMenu) if menu.isVisible()]
    assert all(wire.isVisible() for wire in canvas.patch_scene.wires.values())
    send(view, QEvent.Type.MouseButtonRelease, end, right)
    send(view, QEvent.Type.MouseButtonRelease, end, LEFT)
    assert workspace.patch() == patch
    assert not canvas.search.isVisible()
    assert canvas.patch_scene.nodes["step"].pos().toTuple() == patch.node("step").at


def test_what_the_menu_adds_lies_where_the_menu_was_asked_for(line):
    canvas, added = line.canvas, []
    canvas.patch_scene.select(["hum"])
    QTest.keyClick(canvas, Qt.Key.Key_C, CONTROL)
    for text, there in (("Add a note", QPointF(400.0, 240.0)), ("Paste", QPointF(400.0, 320.0))):
        click_in_menu(line, canvas.mapFromScene(there), text)
        if canvas.inline.isVisible():
            write(line, "Here", Qt.Key.Key_Return, CONTROL)
        added.append(canvas.patch_scene.movable()[canvas.patch_scene.selected()[0]].pos())
    assert added == [QPointF(400.0, 240.0), QPointF(400.0, 320.0)]


def test_space_moves_the_view_while_it_is_held_here(workspace, qtbot):
    """It is let go where the focus has gone to meanwhile, as by Ctrl+P: the next clicks still moved the view."""
    canvas, start = workspace.canvas, middle(workspace, "hum")
    QTest.keyPress(canvas, Qt.Key.Key_Space)
    drag(workspace, start, start + QPoint(40, 0))
    assert middle(workspace, "hum") == start + QPoint(40, 0)
    with qtbot.assertNotEmitted(canvas.play_requested):
        QTest.keyRelease(canvas, Qt.Key.Key_Space)
    with qtbot.waitSignal(canvas.play_requested):
        QTest.keyClick(canvas, Qt.Key.Key_Space)
    QTest.keyPress(canvas, Qt.Key.Key_Space)
    workspace.node_palette.field.setFocus()
    QTest.keyRelease(workspace.node_palette.field, Qt.Key.Key_Space)
    QTest.mouseClick(canvas.viewport(), LEFT, NONE, middle(workspace, "hum"))
    assert canvas.selected_ids() == ["hum"]
