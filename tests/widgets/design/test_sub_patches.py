"""Sub-patches on the canvas, by mouse and keys."""

from itertools import combinations

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port
from groups_by_hand import collapse, in_view, menu_texts, write
from msgspec import structs
from on_screen import type_into
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.nodes import REGISTRY as ALL_NODES
from underfoot.patch.grouping import published
from underfoot.patch.groups import Group
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import item_rect
from underfoot.widgets.design.patch_editing import snapped

CONTROL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


def test_a_frame_and_a_sub_patch_are_pasted_into_a_sub_patch_as_they_are(chain):
    collapse(chain, "hum")
    chain.canvas.patch_scene.select(["group1", "through", "through1"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_C, CONTROL)
    collapse(chain, "group1", "through", "through1")
    QTest.keyClick(chain.canvas, Qt.Key.Key_Return)
    QTest.keyClick(chain.canvas, Qt.Key.Key_V, CONTROL)
    scene = chain.canvas.patch_scene
    assert [frame.shown_group.title for frame in scene.group_frames.values()] == ["Chain"] * 2
    assert len(scene.group_nodes) == 2
    assert chain.document.stack.undoText() == "Paste 3 nodes"


def test_collapsed_it_is_one_node_with_the_ports_of_the_wires_across_its_border(row):
    before = row.patch()
    block = collapse(row, "through", "through1")
    assert set(row.canvas.patch_scene.nodes) == {"hum", "shaker"}
    assert [placed.name for placed in block.geometry.ports] == ["through.signal", "through1.out"]
    assert set(row.canvas.patch_scene.wires) == {("hum.out", "through.signal"), ("through1.out", "shaker.acceleration")}
    assert row.patch().nodes == before.nodes
    assert row.patch().wires == before.wires
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL | SHIFT)
    assert row.patch() == before
    assert len(row.canvas.patch_scene.wires) == 3
    assert set(row.canvas.patch_scene.selected()) == {"through", "through1"}


def test_a_sub_patch_is_named_as_it_is_made_in_one_step_unless_its_frame_has_a_title(chain):
    before, stack = chain.patch(), chain.document.stack
    done = stack.count()
    chain.canvas.patch_scene.select(["hum"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_E, CONTROL)
    assert chain.canvas.inline.hasFocus()
    write(chain, "Engine")
    assert (chain.patch().group("group1").title, chain.canvas.patch_scene.selected()) == ("Engine", ["group1"])
    assert (stack.count() - done, stack.undoText()) == (1, "Collapse Hum")
    chain.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_E, CONTROL)
    assert (chain.canvas.inline.isVisible(), [*chain.canvas.patch_scene.group_nodes]) == (False, ["group1", "group"])
    for _ in range(2):
        chain.undo_action.trigger()
    assert chain.patch() == before


def test_a_selected_sub_patch_is_previewed_by_its_output(row, qtbot):
    """It had the preview of the node that was selected before, or 'select a node'."""
    with qtbot.waitSignal(row.previews.preview_requested) as asked:
        collapse(row, "through", "through1")
    assert asked.args[0] == "through1"


def test_ports_of_a_sub_patch_that_would_have_one_label_tell_whose_they_are(row):
    row.set_patch(row.patch().disconnect([("through.out", "through1.signal")]))
    ports = collapse(row, "through", "through1").geometry.ports
    assert [placed.row.text for placed in ports] == ["Through (through)", "Through (through1)"] * 2


@pytest.mark.parametrize(("zoom", "drawn"), [(0.5, True), (0.4, False)])
def test_from_far_the_boxes_of_a_sub_patch_do_not_lie_over_its_name(row, zoom, drawn):
    row.set_patch(structs.replace(row.patch(), wires=()))
    block = collapse(row, "through", "through1", "shaker")  # three inputs: there is room below the name
    row.canvas.zoom_to(zoom)
    boxes = QRectF(-27.0, -7.0, 54.0, 14.0).translated(block.geometry.plot.center())
    image = row.canvas.viewport().grab(in_view(row, block.mapRectToScene(boxes)).boundingRect()).toImage()
    assert (len({image.pixel(x, y) for x in range(image.width()) for y in range(image.height())}) > 1) == drawn


@pytest.mark.parametrize("keys", [(Qt.Key.Key_D,), (Qt.Key.Key_C, Qt.Key.Key_V)])
def test_a_copy_of_all_that_is_in_the_open_sub_patch_is_nodes_beside_them(row, keys):
    collapse(row, "through", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    for key in (Qt.Key.Key_A, *keys):
        QTest.keyClick(row.canvas, key, CONTROL)
    assert row.canvas.patch_scene.selected() == ["through2", "through3"]
    assert [group.members for group in row.patch().groups] == [("through", "through1", "through2", "through3")]
    assert ("through2.out", "through3.signal") in row.patch().wires


def test_wires_are_drawn_to_a_sub_patch_and_pulled_off_it(row):
    block = collapse(row, "through", "through1")
    start = in_view(row, block.wire_place("in", "through.signal"))
    drag(row, start, start + QPoint(0, 220))
    QTest.keyClick(row.canvas.search.field, Qt.Key.Key_Return)
    assert ("hum.out", "through.signal") not in row.patch().wires
    drag(row, port(row, "hum", "out", "out"), in_view(row, block.wire_place("in", "through.signal")))
    assert ("hum.out", "through.signal") in row.patch().wires


def test_the_outputs_of_a_sub_patch_are_connected_by_a_key(row):
    row.document.edit(row.patch().disconnect([("through1.out", "shaker.acceleration")]), "Disconnect")
    collapse(row, "through", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_C)
    QTest.keyClicks(row.canvas.connection_search.field, "shaker accel")
    QTest.keyClick(row.canvas.connection_search.field, Qt.Key.Key_Return)
    assert ("through1.out", "shaker.acceleration") in row.patch().wires


def test_enter_goes_in_and_the_crumbs_lead_out(row):
    collapse(row, "through", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    scene = row.canvas.patch_scene
    assert set(scene.nodes) == {"through", "through1"}
    assert set(scene.wires) == set(row.patch().wires)
    assert [button.text() for button in row.canvas.breadcrumbs.buttons] == ["Patch", "Sub-patch"]
    QTest.mouseClick(row.canvas.breadcrumbs.buttons[0], LEFT)
    assert set(scene.nodes) == {"hum", "shaker"}
    assert scene.selected() == ["group"]
    assert not row.canvas.breadcrumbs.isVisible()


def test_the_path_covers_no_node_of_what_is_opened(row):
    patch = Patch()
    for i in range(40):
        patch = patch.add("hum", REGISTRY, (240.0 * (i % 8), 200.0 * (i // 8)))
    row.set_patch(patch)
    collapse(row, *(node.id for node in patch.nodes))
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    crumbs = row.canvas.breadcrumbs.geometry()
    for item in row.canvas.patch_scene.nodes.values():
        assert not row.canvas.mapFromScene(item.sceneBoundingRect()).boundingRect().intersects(crumbs)


def test_the_path_of_deep_sub_patches_is_in_sight(row):
    collapse(row, "through", "through1")
    crumbs, seen = row.canvas.breadcrumbs, []
    for _ in range(12):
        for key, how in ((Qt.Key.Key_Return, NONE), (Qt.Key.Key_A, CONTROL), (Qt.Key.Key_E, CONTROL)):
            QTest.keyClick(row.canvas, key, how)
        write(row, "")
        shown = [button for button in crumbs.buttons if button.isVisibleTo(crumbs)]
        assert shown[0].text() == "Patch"
        assert shown[-1] is crumbs.buttons[-1]
        assert all(crumbs.width() > button.sizeHint().width() for button in shown)
        assert crumbs.width() >= crumbs.sizeHint().width()
        assert crumbs.geometry().right() <= row.canvas.width()
        seen.append(len(shown))
    assert seen[:4] == [2, 3, 4, 5]
    assert seen[-1] < 13  # the outermost are left out
    QTest.mouseClick(shown[-2], LEFT)
    assert len(crumbs.buttons) == 12


def test_a_sub_patch_opens_on_its_leftmost_node_and_the_way_out_leads_to_the_former_view(row):
    places = {"hum": (1200.0, -900.0), "through": (0.0, 900.0), "through1": (2400.0, 0.0)}
    row.document.edit(row.patch().move(places), "Move")
    canvas, seen = row.canvas, lambda: row.canvas.mapToScene(row.canvas.viewport().rect()).boundingRect()
    block = collapse(row, "hum", "through", "through1")
    canvas.zoom_to(1.4)
    zoom, before = canvas.transform().m11(), seen().center()
    QTest.mouseDClick(canvas.viewport(), LEFT, NONE, in_view(row, block.sceneBoundingRect().center()))
    assert seen().contains(canvas.patch_scene.nodes["through"].sceneBoundingRect())
    QTest.keyClick(canvas, Qt.Key.Key_U)
    assert canvas.transform().m11() == zoom
    assert (seen().center() - before).manhattanLength() < 4.0


def test_taking_out_is_offered_only_for_what_is_in_a_frame(chain):
    assert "Take out of the group" in menu_texts(chain, middle(chain, "through"))
    block = collapse(chain, "through", "through1")
    offered = menu_texts(chain, in_view(chain, block.sceneBoundingRect().center()))
    assert "Ungroup" in offered
    assert "Take out of the group" not in offered


def test_a_frame_of_sub_patches_alone_is_collapsed_and_not_they_expanded(row):
    for id in ("through", "through1"):
        collapse(row, id)
    row.canvas.patch_scene.select(["group", "group1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Both")
    row.canvas.patch_scene.select(["group"])
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    assert [button.text() for button in row.canvas.breadcrumbs.buttons] == ["Patch", "Sub-patch"]
    QTest.keyClick(row.canvas, Qt.Key.Key_U)
    assert (row.canvas.inside, row.canvas.selected_ids()) == ("", ["through"])  # and not into the frame
    row.canvas.patch_scene.select(["group", "group1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_E, CONTROL)
    assert [item.description.title for item in row.canvas.patch_scene.group_nodes.values()] == ["Both"]
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    assert len(row.canvas.patch_scene.group_nodes) == 2


@pytest.mark.parametrize("key", [Qt.Key.Key_G, Qt.Key.Key_E])
def test_all_that_is_in_a_sub_patch_is_grouped_within_it(row, key):
    collapse(row, "through", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    for one in (Qt.Key.Key_A, key):
        QTest.keyClick(row.canvas, one, CONTROL)
    scene = row.canvas.patch_scene
    assert list(scene.group_frames if key == Qt.Key.Key_G else scene.group_nodes) == ["group1"]
    QTest.mouseClick(row.canvas.breadcrumbs.buttons[0], LEFT)
    assert list(scene.group_nodes) == ["group"]


def test_what_is_added_inside_belongs_there(row):
    block = collapse(row, "through", "through1")
    QTest.mouseDClick(row.canvas.viewport(), LEFT, NONE, in_view(row, block.sceneBoundingRect().center()))
    QTest.keyClick(row.canvas, Qt.Key.Key_Slash)
    QTest.keyClicks(row.canvas.search.field, "beat")
    QTest.keyClick(row.canvas.search.field, Qt.Key.Key_Return)
    assert "beat" in row.patch().groups[0].members
    assert "beat" in row.canvas.patch_scene.nodes
    QTest.keyClick(row.canvas, Qt.Key.Key_U)
    assert "beat" not in row.canvas.patch_scene.nodes
    assert "beat.out" in [placed.name for placed in row.canvas.patch_scene.group_nodes["group"].geometry.ports]


def test_what_is_inserted_into_a_wire_that_leaves_the_open_sub_patch_lies_within(row):
    collapse(row, "through", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    out = row.canvas.patch_scene.wires[("through1.out", "shaker.acceleration")]
    QTest.mouseDClick(row.canvas.viewport(), LEFT, NONE, in_view(row, out.target_place() - QPointF(12.0, 0.0)))
    QTest.keyClicks(row.canvas.search.field, "through")
    QTest.keyClick(row.canvas.search.field, Qt.Key.Key_Return)
    assert ("through2.out", "shaker.acceleration") in row.patch().wires
    assert row.canvas.selected_ids() == ["through2"]


def test_a_sub_patch_in_a_sub_patch_and_back_to_the_same_bytes(row):
    before = row.patch().dumps()
    collapse(row, "through")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    assert set(row.canvas.patch_scene.nodes) == {"through"}
    QTest.keyClick(row.canvas, Qt.Key.Key_U)
    collapse(row, "group", "through1")
    assert set(row.canvas.patch_scene.group_nodes) == {"group1"}
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    assert set(row.canvas.patch_scene.group_nodes) == {"group"}
    text = row.patch().dumps()
    assert Patch.loads(text, REGISTRY).dumps() == text
    while row.document.stack.canUndo():
        row.undo_action.trigger()
    assert row.patch().dumps() == before
    assert row.canvas.inside == ""


def test_a_sub_patch_is_moved_copied_and_deleted_as_one(row):
    block = collapse(row, "through", "through1")
    start = in_view(row, block.geometry.rect.center() + block.pos())
    drag(row, start, start + QPoint(0, 160))
    assert row.patch().node("through").at == (200.0, 160.0)
    QTest.keyClick(row.canvas, Qt.Key.Key_D, CONTROL)
    assert set(row.canvas.patch_scene.group_nodes) == {"group", "group1"}
    assert row.canvas.patch_scene.selected() == ["group1"]
    row.canvas.patch_scene.select(["group", "group1"])
    row.canvas.actions_by_name["colour teal"].trigger()
    assert [group.colour for group in row.patch().groups] == ["teal", "teal"]
    row.undo_action.trigger()
    assert [group.colour for group in row.patch().groups] == ["grey", "grey"]
    row.canvas.patch_scene.select(["group1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_Delete)
    row.canvas.patch_scene.select(["group"])
    QTest.keyClick(row.canvas, Qt.Key.Key_Delete)
    assert row.patch().wires == (("hum.out", "shaker.acceleration"),)
    assert row.patch().groups == ()


def test_a_copy_lies_on_nothing_and_under_the_mouse_as_it_is_drawn(row, qtbot):
    """What is in a sub-patch is far from it: where that would lie says nothing of it. A note has room, too."""
    canvas, scene = row.canvas, row.canvas.patch_scene
    collapse(row, "hum", "shaker")
    canvas.add_note(QPointF(0.0, 320.0))
    write(row, "Rough", Qt.Key.Key_Return, CONTROL)
    row.document.edit(row.patch().move({"through": (32.0, 352.0)}), "Move")
    scene.select(["group", "note"])
    QTest.keyClick(canvas, Qt.Key.Key_D, CONTROL)
    assert scene.selected() == ["group1", "note1"]
    rects = map(item_rect, scene.movable().values())
    assert not [pair for pair in combinations(rects, 2) if pair[0].intersects(pair[1])]
    scene.select(["group"])
    QTest.keyClick(canvas, Qt.Key.Key_X, CONTROL)
    canvas.pan(0, -400)
    place = QPoint(200, 60)
    canvas.cursor().setPos(canvas.viewport().mapToGlobal(place))
    qtbot.waitUntil(canvas.viewport().underMouse)
    there = canvas.mapToScene(place)
    QTest.keyClick(canvas, Qt.Key.Key_V, CONTROL)
    assert row.patch().group("group").at == snapped(there.x(), there.y())


@pytest.mark.parametrize(("key", "held"), [(Qt.Key.Key_E, CONTROL), (Qt.Key.Key_G, CONTROL | SHIFT)])
def test_a_sub_patch_that_is_opened_covers_nothing_that_was_put_there_meanwhile(row, key, held):
    canvas, scene = row.canvas, row.canvas.patch_scene
    collapse(row, "hum", "shaker")
    canvas.add("beat", QPointF(16.0, 12.0))
    assert row.patch().node("beat").at == row.patch().node("hum").at
    scene.select(["group"])
    QTest.keyClick(canvas, key, held)
    rects = map(item_rect, scene.movable().values())
    assert not [pair for pair in combinations(rects, 2) if pair[0].intersects(pair[1])]
    hum, shaker = (row.patch().node(id).at for id in ("hum", "shaker"))
    assert (shaker[0] - hum[0], shaker[1] - hum[1]) == (600.0, 0.0)


def test_escape_puts_back_what_is_dragged(row):
    start = middle(row, "hum")
    drag(row, start, start + QPoint(80, 80), release=False)
    QTest.keyClick(row.canvas, Qt.Key.Key_Escape)
    assert row.canvas.patch_scene.nodes["hum"].pos() == QPointF(0, 0)
    QTest.mouseRelease(row.canvas.viewport(), LEFT, NONE, start + QPoint(80, 80))
    assert row.document.stack.count() == 0


def test_a_parameter_inside_is_shown_and_set_on_the_sub_patch(row):
    collapse(row, "hum", "through")
    assert not row.inspector.editors
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    row.canvas.patch_scene.select(["hum"])
    show = row.inspector.editors["frequency"].actions()[0]
    assert not show.isChecked()
    show.trigger()
    assert row.patch().groups[0].published == ("hum.frequency",)
    QTest.keyClick(row.canvas, Qt.Key.Key_U)
    editor = row.inspector.editors["hum.frequency"]
    assert editor.label.text() == "Hum: frequency"
    editor.field.setFocus()
    editor.field.selectAll()
    QTest.keyClicks(editor.field, "77")
    QTest.keyClick(editor.field, Qt.Key.Key_Return)
    assert row.patch().node("hum").parameters == {"frequency": 77.0}
    row.undo_action.trigger()
    assert editor.value() == 50.0
    row.canvas.setFocus()
    QTest.keyClick(row.canvas, Qt.Key.Key_Delete)
    assert row.patch().groups == ()


def test_copies_of_a_sub_patch_are_set_together_by_what_they_show(row, qtbot):
    """Three selected showed nothing: their nodes have no parameter in common."""
    collapse(row, "hum", "through")
    row.document.edit(published(row.patch(), "group", "hum.frequency", True), "Show")
    for _ in range(2):
        QTest.keyClick(row.canvas, Qt.Key.Key_D, CONTROL)
    row.document.edit(row.patch().set("hum1", "frequency", 80.0, REGISTRY), "Set")
    row.canvas.patch_scene.select(["group", "group1", "group2"])
    editor = row.inspector.editors["hum.frequency"]
    assert editor.label.text() == "Hum: frequency: 50 Hz to 80 Hz"
    type_into(qtbot, editor, "77")
    assert [row.patch().node(id).parameters["frequency"] for id in ("hum", "hum1", "hum2")] == [77.0] * 3
    assert row.document.stack.undoText() == "Set frequency of 3 nodes"
    row.canvas.patch_scene.select(["group", "group1", "through1"])
    assert not row.inspector.editors, "a node beside them shows nothing of this"
    row.canvas.patch_scene.select(["group", "group1"])
    row.document.edit(published(row.patch(), "group1", "hum1.frequency", False), "Hide")
    assert not row.inspector.editors


def test_a_control_of_two_copies_sets_the_same_node_in_each_whatever_else_they_show(row, qtbot):
    """Where one had hidden the first of two, or shown it again, B of one was set with A of the other."""
    row.set_patch(Patch().add("hum", REGISTRY).add("hum", REGISTRY).name("hum1", "B"))
    collapse(row, "hum", "hum1")
    for end in ("hum.frequency", "hum1.frequency"):
        row.document.edit(published(row.patch(), "group", end, True), "Show")
    QTest.keyClick(row.canvas, Qt.Key.Key_D, CONTROL)
    row.canvas.patch_scene.select(["group", "group1"])
    for on, names in ((False, ["hum1"]), (True, ["hum1", "hum"])):
        row.document.edit(published(row.patch(), "group", "hum.frequency", on), "Show or hide")
        assert list(row.inspector.editors) == [f"{name}.frequency" for name in names]
        type_into(qtbot, row.inspector.editors["hum1.frequency"], f"{70 + on}")
        set_now = {node.id for node in row.patch().nodes if node.parameters.get("frequency") == 70.0 + on}
        assert set_now == {"hum1", "hum3"}


def test_copies_are_set_together_in_the_unit_of_their_wires_where_it_is_the_same(all_nodes):
    """Of other units they show it as plain numbers, as their nodes do."""
    patch = Patch().add("tone", ALL_NODES).add("delay", ALL_NODES)
    for id, end in (("value", "tone.frequency"), ("value1", "delay.time")):
        patch = patch.add("value", ALL_NODES).connect(f"{id}.out", end, ALL_NODES)
    groups = tuple(Group(f"of-{id}", (id,), collapsed=True, published=(f"{id}.low",)) for id in ("value", "value1"))
    all_nodes.set_patch(structs.replace(patch, groups=groups))
    all_nodes.canvas.patch_scene.select([group.id for group in groups])
    assert all_nodes.inspector.editors["value.low"].parameter.unit == ""
    after = all_nodes.patch().disconnect([("value1.out", "delay.time")])
    all_nodes.document.edit(after.add("tone", ALL_NODES).connect("value1.out", "tone1.frequency", ALL_NODES), "Rewire")
    assert all_nodes.inspector.editors["value.low"].parameter.unit == "Hz"


def test_a_parameter_within_two_sub_patches_is_shown_on_the_outer_one(row):
    collapse(row, "hum", "through")
    collapse(row, "group", "through1")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    row.canvas.patch_scene.select(["group"])
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    row.canvas.patch_scene.select(["hum"])
    inner, outer, _ = row.inspector.editors["frequency"].actions()
    assert [inner.text(), outer.text()] == ["Show on the sub-patch", "Show on the sub-patch around it"]
    outer.trigger()
    inner, outer, _ = row.inspector.editors["frequency"].actions()
    assert (inner.isChecked(), outer.isChecked()) == (False, True)
    for _ in range(2):
        QTest.keyClick(row.canvas, Qt.Key.Key_U)
    hide, _ = row.inspector.editors["hum.frequency"].actions()
    hide.trigger()
    assert not row.inspector.editors


def test_a_sub_patch_that_is_muted_shows_it(row):
    block = collapse(row, "through", "through1")
    row.document.edit(row.patch().mark(["through"], "muted", on=True), "Mute")
    assert block.node.marks == ()
    row.document.edit(row.patch().mark(["through", "through1"], "muted", on=True), "Mute")
    assert block.node.marks == ("muted",)
    row.document.edit(row.patch().mark(["through"], "soloed", on=True), "Solo")
    assert "soloed" in block.node.marks


def test_only_a_sub_patch_can_be_looked_into(row):
    look = "Look into the sub-patch"
    assert look not in menu_texts(row, middle(row, "through"))
    item = collapse(row, "through", "through1")
    assert look in menu_texts(row, in_view(row, item.sceneBoundingRect().center()))


def test_a_shown_parameter_of_a_node_with_a_long_name_can_be_read(row):
    row.document.edit(row.patch().name("hum", "What the heel feels of the motor below"), "Rename")
    collapse(row, "hum", "through")
    row.document.edit(published(row.patch(), "group", "hum.frequency", True), "Show")
    label = row.inspector.editors["hum.frequency"].label
    assert label.text() == "What the heel feels of the motor below: frequency"
    QApplication.processEvents()
    assert label.width() >= label.minimumSizeHint().width()
    assert label.height() >= label.heightForWidth(label.width())


def test_the_menu_key_is_about_the_selection_wherever_it_lies(workspace):
    canvas, key = workspace.canvas, QContextMenuEvent.Reason.Keyboard
    canvas.centerOn(canvas.patch_scene.nodes["hum"].sceneBoundingRect().center())
    middle_of_view = canvas.viewport().rect().center()
    assert canvas.patch_scene.node_at(canvas.mapToScene(middle_of_view)).node.id == "hum"
    for chosen in (["step"], ["push", "step"]):
        canvas.patch_scene.select(chosen)
        offered = menu_texts(workspace, middle_of_view, key)
        assert canvas.patch_scene.selected() == chosen
        assert ("Align" in offered) == (len(chosen) == 2)
    canvas.patch_scene.select([])
    assert "Rename…" in menu_texts(workspace, middle_of_view, key)  # with nothing selected, of what lies there
    assert canvas.patch_scene.selected() == ["hum"]
