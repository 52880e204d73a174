"""Names, notes and groups on the canvas, by mouse and keys."""

from itertools import combinations

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, sample, send
from groups_by_hand import click_in_menu, collapse, in_view, menu_texts, write
from msgspec.structs import replace
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QContextMenuEvent, QDragMoveEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.patch.groups import Note
from underfoot.patch.patch import Patch
from underfoot.widgets.design.group_items import FRAME_PAD, item_rect
from underfoot.widgets.design.node_geometry import TITLE
from underfoot.widgets.design.node_list import MIME

CONTROL = Qt.KeyboardModifier.ControlModifier
SHIFT = Qt.KeyboardModifier.ShiftModifier


def frame_picture(workspace, frame):
    """The colour of a frame's ground, beside its title."""
    canvas = workspace.canvas
    corner = canvas.mapFromScene(frame.frame_rect().bottomRight() - QPointF(5.0, 5.0))
    return canvas.viewport().grab().toImage().pixelColor(corner).name()


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
    canvas, before = workspace.canvas, workspace.patch()
    for key in (Qt.Key.Key_Escape, Qt.Key.Key_Return):
        QTest.keyClick(canvas, Qt.Key.Key_T)
        QTest.keyClick(canvas.inline, key, CONTROL if key == Qt.Key.Key_Return else NONE)
        assert workspace.patch() == before
    QTest.keyClick(canvas, Qt.Key.Key_T)
    write(workspace, "What the sole feels", Qt.Key.Key_Return, CONTROL)
    assert [workspace.document.stack.text(i) for i in range(workspace.document.stack.count())] == ["Add a note"]
    note = workspace.patch().notes[0]
    assert note.text == "What the sole feels"
    start = in_view(workspace, canvas.patch_scene.notes["note"].sceneBoundingRect().center())
    drag(workspace, start, start + QPoint(1, 1))
    drag(workspace, start, start + QPoint(41, 63))  # it keeps to the grid, as nodes do
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
    assert canvas.message.startswith(f"'{'x' * 55}...'; allowed: ")
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


@pytest.mark.parametrize("key", [Qt.Key.Key_F2, Qt.Key.Key_R, Qt.Key.Key_Slash])
def test_a_field_on_the_canvas_closes_where_undo_in_the_menu_takes_its_node_away(workspace, key):
    canvas = workspace.canvas
    canvas.add("hum", QPointF(400.0, 300.0))
    QTest.keyClick(canvas, key)
    workspace.undo_action.trigger()  # the menu of the window leaves the field the focus
    assert canvas.hasFocus()
    QTest.keyClicks(QApplication.focusWidget(), "Low")
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)
    workspace.side.setFocus()
    assert workspace.patch() == sample()


# --- groups ---


def test_a_group_has_a_title_and_colour_and_moves_what_is_in_it(row):
    row.canvas.patch_scene.select(["through", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Body")
    assert (row.document.stack.count(), row.document.stack.undoText()) == (1, "Group 2 nodes")
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


def test_a_frame_is_selected_and_dragged_beside_others_as_a_node_is(chain):
    canvas, scene = chain.canvas, chain.canvas.patch_scene
    title = in_view(chain, scene.group_frames["group"].title_rect().center())
    scene.select(["hum"])
    for held, chosen in ((SHIFT, ["hum", "through", "through1"]), (CONTROL, ["hum"]), (SHIFT, [*scene.nodes][:3])):
        QTest.mouseClick(canvas.viewport(), LEFT, held, title)
        assert scene.selected() == chosen
    drag(chain, title, title + QPoint(0, 80))
    assert [node.at[1] for node in chain.patch().nodes] == [80.0, 80.0, 80.0, 0.0]
    assert chain.document.stack.undoText() == "Move 3 nodes"
    QTest.mouseClick(canvas.viewport(), LEFT, NONE, title + QPoint(0, 80))
    assert scene.selected() == ["through", "through1"]


def test_the_menu_of_a_frame_names_the_group_also_of_one_node(row):
    row.canvas.patch_scene.select(["through"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Body")
    title = row.canvas.patch_scene.group_frames["group"].title_rect().center()
    click_in_menu(row, in_view(row, title), "Rename…")
    write(row, "Heel")
    assert (row.patch().group("group").title, row.patch().node("through").label) == ("Heel", "")


def test_a_group_that_would_cut_another_is_refused_in_words(row):
    row.canvas.patch_scene.select(["through", "through1"])
    row.canvas.group()
    write(row, "Body")
    row.canvas.patch_scene.select(["hum", "through"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    assert row.canvas.message == "It would hold a part of the group “Body”; take all of it, or nothing"
    assert len(row.patch().groups) == 1


def test_a_frame_shrinks_again_when_a_node_in_it_hides_its_parameters(workspace):
    canvas = workspace.canvas
    canvas.patch_scene.select(["shaker"])
    QTest.keyClick(canvas, Qt.Key.Key_G, CONTROL)
    write(workspace, "Low")
    shaker, frame = canvas.patch_scene.nodes["shaker"], canvas.patch_scene.group_frames["group"]
    before = frame.frame_rect()
    QTest.mouseClick(canvas.viewport(), LEFT, NONE, in_view(workspace, shaker.mapToScene(shaker.geometry.more)))
    workspace.document.edit(workspace.patch().name("push", "Heel"), "Rename")
    assert frame.frame_rect().height() > before.height()
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert frame.frame_rect() == before


def test_a_new_frame_says_who_lies_in_it_and_is_not_in_its_group(row):
    row.canvas.patch_scene.select(["hum", "through1"])
    QTest.keyClick(row.canvas, Qt.Key.Key_G, CONTROL)
    said = "Through lies in the frame but not in its group: drag it out, or put it in by the context menu"
    assert row.canvas.message == said


def test_a_frame_grows_away_from_what_is_not_in_it(chain):
    canvas, frame = chain.canvas, chain.canvas.patch_scene.group_frames["group"]
    canvas.add("beat", QPointF(230.0, -140.0))
    canvas.patch_scene.select(["through"])
    canvas.copy()
    canvas.paste(frame.title_rect().center())
    assert len(chain.patch().groups[0].members) == 3
    strangers = [item_rect(canvas.patch_scene.nodes[id]) for id in ("hum", "shaker", "beat")]
    assert not [rect for rect in strangers if rect.intersects(frame.frame_rect())]


# --- into groups and out of them ---


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


def choose_in_menu(workspace, *texts):
    """Open the context menu by its key, and go to an entry by the arrows: into the menus of the first texts."""
    canvas = workspace.canvas
    middle = canvas.viewport().rect().center()
    asked = QContextMenuEvent(QContextMenuEvent.Reason.Keyboard, middle, canvas.viewport().mapToGlobal(middle))
    QApplication.sendEvent(canvas.viewport(), asked)
    for text in texts:
        menu = QApplication.activePopupWidget()
        while menu.activeAction() is None or menu.activeAction().text() != text:
            QTest.keyClick(menu, Qt.Key.Key_Down)
        QTest.keyClick(menu, Qt.Key.Key_Return)


def test_a_node_is_put_into_a_frame_by_keys(chain):
    scene = chain.canvas.patch_scene
    while scene.selected() != ["hum"]:
        QTest.keyClick(chain.canvas, Qt.Key.Key_N)
    others = [item_rect(scene.nodes[id]) for id in ("through", "through1", "shaker")]
    choose_in_menu(chain, "Put into", "Chain")
    assert members_of(chain) == [{"hum", "through", "through1"}]
    assert chain.document.stack.undoText() == "Move Hum into Chain"
    assert scene.group_frames["group"].frame_rect().contains(item_rect(scene.nodes["hum"]))
    assert not scene.group_frames["group"].frame_rect().intersects(item_rect(scene.nodes["shaker"]))
    assert not any(item_rect(scene.nodes["hum"]).intersects(other) for other in others)
    assert "Put into" not in menu_texts(chain, middle(chain, "hum"))
    QTest.keyClick(chain.canvas, Qt.Key.Key_Z, CONTROL)
    assert members_of(chain) == [{"through", "through1"}]


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


def test_the_title_of_a_frame_and_a_note_can_be_read_from_far(chain):
    frame, note = chain.canvas.patch_scene.group_frames["group"], Note("note", "Heel, left", (200.0, 200.0))
    patch = chain.patch().disconnect([("hum.out", "through.signal")])
    chain.document.edit(replace(patch, notes=(note,)), "Disconnect, and add a note")
    chain.canvas.zoom_to(0.35)
    title = QRectF(frame.frame_rect().topLeft(), QSizeF(200.0, TITLE + FRAME_PAD))
    for strip in (title, item_rect(chain.canvas.patch_scene.notes["note"])):
        place = in_view(chain, strip.adjusted(8.0, 4.0, 0.0, -4.0)).boundingRect()
        image = chain.canvas.viewport().grab(place).toImage()
        rows = [{image.pixel(x, y) for x in range(4, image.width() - 4)} for y in range(image.height())]
        assert sum(len(colours) > 1 for colours in rows) >= 8  # pixels: the letters' height


def test_the_last_node_that_is_taken_out_takes_the_group_with_it(chain):
    chain.canvas.patch_scene.select(["through", "through1"])
    assert "Take out of the group" in menu_texts(chain, middle(chain, "through"))
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert members_of(chain) == []


def test_a_sub_patch_is_taken_out_of_a_frame_whole(chain):
    collapse(chain, "hum")
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


def test_a_sub_patch_that_is_dragged_into_a_frame_is_in_the_group(chain):
    collapse(chain, "hum")
    (block,) = chain.canvas.patch_scene.group_nodes.values()
    start = in_view(chain, block.pos() + QPointF(block.geometry.plot.center()))
    drag(chain, start, middle(chain, "through") + QPoint(0, 40))
    assert members_of(chain) == [{"hum", "through", "through1"}, {"hum"}]
    assert chain.document.stack.undoText() == "Move Hum into Chain"
    QTest.keyClick(chain.canvas, Qt.Key.Key_G, SHIFT)
    assert members_of(chain) == [{"through", "through1"}, {"hum"}]


def test_what_is_duplicated_in_a_frame_is_in_its_group_and_a_whole_frame_is_beside_it(chain):
    chain.canvas.patch_scene.select(["through"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_D, CONTROL)
    assert members_of(chain) == [{"through", "through1", "through2"}]
    chain.canvas.patch_scene.select(["through", "through1", "through2"])
    QTest.keyClick(chain.canvas, Qt.Key.Key_D, CONTROL)
    assert members_of(chain) == [{"through", "through1", "through2"}, {"through3", "through4", "through5"}]
    frames = [frame.frame_rect() for frame in chain.canvas.patch_scene.group_frames.values()]
    assert not frames[0].intersects(frames[1])
    chain.canvas.add("beat", QPointF(frames[0].right() - 100.0, frames[0].top() - 40.0))
    beat = item_rect(chain.canvas.patch_scene.nodes["beat"])
    assert not any(map(beat.intersects, frames))


def test_what_is_pasted_or_written_under_the_mouse_in_a_frame_is_in_its_group(chain, qtbot):
    canvas = chain.canvas
    canvas.patch_scene.select(["hum"])
    QTest.keyClick(canvas, Qt.Key.Key_C, CONTROL)
    place = in_view(chain, canvas.patch_scene.group_frames["group"].title_rect().center())
    canvas.cursor().setPos(canvas.viewport().mapToGlobal(place))
    qtbot.waitUntil(canvas.viewport().underMouse)
    QTest.keyClick(canvas, Qt.Key.Key_V, CONTROL)
    QTest.keyClick(canvas, Qt.Key.Key_T)
    write(chain, "Why", Qt.Key.Key_Return, CONTROL)
    assert members_of(chain) == [{"through", "through1", "hum1", "note"}]


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


def test_tidying_up_keeps_in_each_frame_what_is_in_its_group(row):
    """A wire leaves the outer frame and comes back into it, which no order of columns can follow."""
    canvas, scene = row.canvas, row.canvas.patch_scene
    canvas.add_note(QPointF(300.0, 300.0))
    write(row, "Rough", Qt.Key.Key_Return, CONTROL)
    for ids in (("hum", "through1", "note"), ("hum", "note")):
        scene.select(ids)
        QTest.keyClick(canvas, Qt.Key.Key_G, CONTROL)
        write(row, ids[1])
    scene.select(())
    QTest.keyClick(canvas, Qt.Key.Key_L, CONTROL)
    assert row.document.stack.undoText() == "Tidy up 4 nodes"
    for frame in scene.group_frames.values():
        inside = {id for id, item in scene.movable().items() if frame.frame_rect().intersects(item_rect(item))}
        assert inside == set(frame.shown_group.members)
    rects = list(map(item_rect, scene.movable().values()))
    assert not [pair for pair in combinations(rects, 2) if pair[0].intersects(pair[1])]
    assert scene.group_frames["group"].frame_rect().right() < scene.extent(["shaker"]).left()
