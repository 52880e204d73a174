"""Names, notes, groups and sub-patches on the canvas, by mouse and keys."""

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port, send
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent, QDragMoveEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.patch.grouping import published
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import item_rect
from underfoot.widgets.design.node_list import MIME

CONTROL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def row(workspace):
    """A tone through two nodes to the shaker, with room between."""
    patch = Patch().add("hum", REGISTRY).add("through", REGISTRY, (200.0, 0.0)).add("through", REGISTRY, (400.0, 0.0))
    patch = patch.add("shaker", REGISTRY, (600.0, 0.0))
    for wire in (("hum.out", "through.signal"), ("through.out", "through1.signal")):
        patch = patch.connect(*wire, REGISTRY)
    workspace.set_patch(patch.connect("through1.out", "shaker.acceleration", REGISTRY))
    workspace.canvas.zoom_to(1.0)
    return workspace


def write(workspace, text, key=Qt.Key.Key_Return, modifiers=NONE):
    assert workspace.canvas.inline.isVisible()
    workspace.canvas.inline.selectAll()
    QTest.keyClicks(workspace.canvas.inline, text)
    QTest.keyClick(workspace.canvas.inline, key, modifiers)


def collapse(workspace, *ids):
    workspace.canvas.patch_scene.select(ids)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_E, CONTROL)
    return workspace.canvas.patch_scene.group_nodes["group"]


def in_view(workspace, place):
    return workspace.canvas.mapFromScene(place)


def frame_picture(workspace, frame):
    """The colour of a frame's ground, beside its title."""
    canvas = workspace.canvas
    corner = canvas.mapFromScene(frame.frame_rect().bottomRight() - QPointF(5.0, 5.0))
    return canvas.viewport().grab().toImage().pixelColor(corner).name()


def menu_texts(workspace, place, reason=QContextMenuEvent.Reason.Mouse):
    """What the context menu at a place of the canvas offers."""
    QApplication.sendEvent(
        workspace.canvas.viewport(), QContextMenuEvent(reason, place, workspace.canvas.viewport().mapToGlobal(place))
    )
    menu = next(menu for menu in workspace.canvas.findChildren(QMenu) if menu.isVisible())
    texts = [action.text() for action in menu.actions()]
    menu.close()
    return texts


# --- names and notes ---


def test_f2_names_a_node_and_its_id_stays(workspace):
    workspace.canvas.patch_scene.select(["hum"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F2)
    write(workspace, "Engine below")
    assert workspace.patch().node("hum").label == "Engine below"
    assert workspace.canvas.patch_scene.nodes["hum"].description.title == "Engine below"
    assert workspace.document.stack.undoText() == "Rename Hum"
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F2)
    write(workspace, "Hum")
    assert workspace.patch().node("hum").label == ""
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F2)
    write(workspace, "x", Qt.Key.Key_Escape)
    assert workspace.patch().node("hum").label == ""


def test_a_double_click_on_a_title_names_a_node_too(workspace):
    item = workspace.canvas.patch_scene.nodes["hum"]
    QTest.mouseDClick(workspace.canvas.viewport(), LEFT, NONE, in_view(workspace, item.pos() + QPointF(30, 10)))
    write(workspace, "Low")
    assert workspace.patch().node("hum").label == "Low"


def test_a_note_is_written_moved_edited_and_deleted(workspace):
    canvas = workspace.canvas
    QTest.keyClick(canvas, Qt.Key.Key_T)
    write(workspace, "What the sole feels", Qt.Key.Key_Return, CONTROL)
    note = workspace.patch().notes[0]
    assert note.text == "What the sole feels"
    start = in_view(workspace, canvas.patch_scene.notes["note"].sceneBoundingRect().center())
    drag(workspace, start, start + QPoint(40, 64))
    assert workspace.patch().notes[0].at == (note.at[0] + 40.0, note.at[1] + 64.0)
    QTest.mouseDClick(canvas.viewport(), LEFT, NONE, start + QPoint(40, 64))
    write(workspace, "Changed")
    QTest.mouseClick(canvas.viewport(), LEFT, NONE, QPoint(5, 5))
    assert workspace.patch().notes[0].text.startswith("Changed")
    canvas.patch_scene.select(["note"])
    QTest.keyClick(canvas, Qt.Key.Key_Delete)
    assert workspace.patch().notes == ()
    assert workspace.undo_action.text() == "Undo: delete 1 note"
    workspace.undo_action.trigger()
    for chosen, words in ((["hum", "note"], "Hum and 1 note"), (["hum", "step", "note"], "2 nodes and 1 note")):
        canvas.patch_scene.select(chosen)
        QTest.keyClick(canvas, Qt.Key.Key_Right)
        assert workspace.undo_action.text() == f"Undo: move {words}"


@pytest.mark.parametrize("key", [Qt.Key.Key_F2, Qt.Key.Key_T, Qt.Key.Key_G])
def test_a_text_that_is_too_long_stays_there_to_be_shortened(workspace, qtbot, key):
    """A name of a node, a note, and a title of a group."""
    canvas, field = workspace.canvas, workspace.canvas.inline
    most, ending = (4000, CONTROL) if key == Qt.Key.Key_T else (80, NONE)
    canvas.patch_scene.select(["hum"])
    QTest.keyClick(canvas, key, CONTROL if key == Qt.Key.Key_G else NONE)
    before = workspace.patch()
    field.insertPlainText("x" * (most + 1))
    QTest.keyClick(field, Qt.Key.Key_Return, ending)
    assert field.hasFocus()
    assert field.toPlainText() == "x" * (most + 1)
    assert canvas.message.startswith("'xxx")
    assert canvas.message.endswith(f"of at most {most} characters")
    assert workspace.patch() == before
    QTest.mouseClick(
        canvas.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(4, 4)
    )  # nor is it lost by a click elsewhere
    qtbot.waitUntil(field.hasFocus)
    assert field.toPlainText() == "x" * (most + 1)
    QTest.keyClick(field, Qt.Key.Key_End, CONTROL)
    QTest.keyClick(field, Qt.Key.Key_Backspace)
    QTest.keyClick(field, Qt.Key.Key_Return, ending)
    assert field.isHidden()
    assert canvas.hasFocus()
    patch = workspace.patch()
    texts = [patch.node("hum").label, *(g.title for g in patch.groups), *(n.text for n in patch.notes)]
    assert "x" * most in texts


# --- groups ---


def test_a_group_has_a_title_and_colour_and_moves_what_is_in_it(row):
    row.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Body")
    row.canvas.actions_by_name["colour violet"].trigger()
    group = row.patch().groups[0]
    assert (group.title, group.colour, group.members) == ("Body", "violet", ("through", "through1"))
    frame = row.canvas.patch_scene.group_frames["group"]
    before = frame.frame_rect()
    assert all(before.contains(row.canvas.patch_scene.nodes[id].pos()) for id in group.members)
    row.canvas.patch_scene.select([])
    start = in_view(row, frame.title_rect().center())
    drag(row, start, start + QPoint(16, 80))
    assert row.patch().node("through").at == (216.0, 80.0)
    assert row.patch().node("through1").at == (416.0, 80.0)
    assert row.patch().node("hum").at == (0.0, 0.0)
    assert frame.frame_rect().topLeft() == before.topLeft() + QPointF(16, 80)
    assert row.document.stack.undoText() == "Move 2 nodes"
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL | SHIFT)
    assert row.patch().groups == ()
    assert not row.canvas.patch_scene.group_frames


def test_a_group_that_would_cut_another_is_refused_in_words(row):
    row.canvas.patch_scene.select(["through", "through1"])
    row.canvas.group()
    write(row, "Body")
    row.canvas.patch_scene.select(["hum", "through"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    assert row.canvas.message == "It would hold a part of the group “Body”; take all of it, or nothing"
    assert len(row.patch().groups) == 1


# --- into groups and out of them ---


@pytest.fixture
def chain(row):
    """The row, whose two nodes in the middle are a group named "Chain"."""
    row.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Chain")
    return row


def members_of(workspace):
    return [set(group.members) for group in workspace.patch().groups]


def test_a_node_that_is_dragged_into_a_frame_is_in_the_group_and_is_taken_out_by_a_key(chain):
    frame = chain.canvas.patch_scene.group_frames["group"]
    place, inside = middle(chain, "hum"), middle(chain, "through")
    plain = frame_picture(chain, frame)
    drag(chain, place, inside, release=False)
    assert frame_picture(chain, frame) != plain
    send(chain.canvas.viewport(), QEvent.Type.MouseButtonRelease, inside, LEFT)
    assert members_of(chain) == [{"hum", "through", "through1"}]
    assert chain.document.stack.undoText() == "Move Hum into Chain"
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert members_of(chain) == [{"through", "through1"}]
    assert chain.document.stack.undoText() == "Take Hum out of the group"
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert chain.canvas.message == "Select what is in a frame"
    for _ in range(2):
        QTest.keyClick(chain.canvas, Qt.Key.Key_Z, CONTROL)
    assert members_of(chain) == [{"through", "through1"}]
    assert chain.patch().node("hum").at == (0.0, 0.0)


def test_what_is_taken_out_of_a_frame_lies_beside_it(chain):
    frame = chain.canvas.patch_scene.group_frames["group"]
    drag(chain, middle(chain, "hum"), middle(chain, "through") + QPoint(100, 0))
    inside = item_rect(chain.canvas.patch_scene.nodes["hum"])
    assert frame.frame_rect().contains(inside)
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert not frame.frame_rect().intersects(item_rect(chain.canvas.patch_scene.nodes["hum"]))
    QTest.keyClick(chain.canvas, Qt.Key.Key_Z, CONTROL)
    assert item_rect(chain.canvas.patch_scene.nodes["hum"]) == inside


def test_the_title_of_a_frame_is_read_beside_a_node_that_lies_on_it(chain):
    scene = chain.canvas.patch_scene
    frame = scene.group_frames["group"]
    patch = chain.patch().disconnect([("hum.out", "through.signal")])  # only the title is to be in the strip
    chain.document.edit(patch.move({"hum": (frame.frame_rect().x(), frame.frame_rect().y() - 40.0)}), "Move")
    strip, node = frame.title_rect().adjusted(0.0, 2.0, -2.0, -2.0), item_rect(scene.nodes["hum"])
    assert strip.intersects(node)
    strip.setLeft(node.right() + 8.0)
    image = chain.canvas.viewport().grab(in_view(chain, strip).boundingRect()).toImage()
    assert len({image.pixel(x, y) for x in range(image.width()) for y in range(image.height())}) > 1


def test_the_last_node_that_is_taken_out_takes_the_group_with_it(chain):
    chain.canvas.patch_scene.select(["through", "through1"])
    assert "Take out of the group" in menu_texts(chain, middle(chain, "through"))
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert members_of(chain) == []


def test_a_sub_patch_is_taken_out_of_a_frame_whole(chain):
    chain.canvas.patch_scene.select(["hum"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_E, CONTROL)
    chain.canvas.patch_scene.select(["shaker", *chain.canvas.patch_scene.group_nodes])
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, CONTROL)
    write(chain, "Ends")
    chain.canvas.patch_scene.select(chain.canvas.patch_scene.group_nodes)
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert [members for members in members_of(chain) if members != {"through", "through1"}] == [{"shaker"}, {"hum"}]
    assert chain.patch() == Patch.loads(chain.patch().dumps(), REGISTRY)


def test_nodes_that_are_dragged_away_from_their_group_stay_in_it(chain):
    chain.canvas.patch_scene.select([])
    place = middle(chain, "through")
    drag(chain, place, place + QPoint(-80, 160))
    assert members_of(chain) == [{"through", "through1"}]
    assert chain.document.stack.undoText() == "Move Through"


def test_a_whole_group_that_is_dragged_into_another_frame_stays_a_group(chain):
    chain.canvas.patch_scene.select(["hum", "shaker"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, CONTROL)
    write(chain, "Ends")
    drag(chain, middle(chain, "hum"), middle(chain, "through") + QPoint(0, 8))
    assert members_of(chain) == [{"through", "through1"}, {"hum", "shaker"}]


def test_a_frame_lights_up_under_a_node_from_the_palette(chain):
    frame = chain.canvas.patch_scene.group_frames["group"]
    plain, data = frame_picture(chain, frame), QMimeData()
    data.setData(MIME, b"beat")
    place = QPointF(in_view(chain, frame.frame_rect().bottomLeft() + QPointF(40.0, -4.0)))
    how = (Qt.DropAction.CopyAction, data, LEFT, NONE)
    chain.canvas.dragMoveEvent(QDragMoveEvent(place.toPoint(), *how))
    assert frame_picture(chain, frame) != plain
    chain.canvas.dropEvent(QDropEvent(place, *how))
    assert members_of(chain) == [{"through", "through1", "beat"}]
    assert frame_picture(chain, frame) == plain


def test_a_node_that_is_added_in_a_frame_is_in_the_group(chain):
    frame = chain.canvas.patch_scene.group_frames["group"].frame_rect()
    chain.canvas.add("beat", frame.bottomLeft() + QPointF(40.0, -4.0))
    chain.canvas.add("beat", frame.bottomLeft() + QPointF(0.0, 200.0))
    assert members_of(chain) == [{"through", "through1", "beat"}]


# --- sub-patches ---


def test_a_frame_and_a_sub_patch_are_pasted_into_a_sub_patch_as_they_are(chain):
    for ids, keys in ((["hum"], "E"), (["group1", "through", "through1"], "CE")):
        chain.canvas.patch_scene.select(ids)
        for key in keys:
            QTest.keyClick(chain.canvas, key, CONTROL)
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
    menu = QApplication.activePopupWidget()
    next(action for action in menu.actions() if "shaker" in action.text()).trigger()
    menu.close()
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
    assert [placed.name for placed in row.canvas.patch_scene.group_nodes["group"].geometry.ports][-1] == "beat.out"


def test_a_sub_patch_in_a_sub_patch_and_back_to_the_same_bytes(row):
    before = row.patch().dumps()
    collapse(row, "through")
    QTest.keyClick(row.canvas, Qt.Key.Key_Return)
    assert set(row.canvas.patch_scene.nodes) == {"through"}
    QTest.keyClick(row.canvas, Qt.Key.Key_U)
    row.canvas.patch_scene.select(["group", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_E, CONTROL)
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
    QTest.keyClick(row.canvas, Qt.Key.Key_Delete)
    row.canvas.patch_scene.select(["group"])
    QTest.keyClick(row.canvas, Qt.Key.Key_Delete)
    assert row.patch().wires == (("hum.out", "shaker.acceleration"),)
    assert row.patch().groups == ()


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
    row.document.edit(published(row.patch(), "hum.frequency", True), "Show")
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
