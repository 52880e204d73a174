"""Finding nodes, notes and groups of the patch by name."""

from groups_by_hand import collapse, write
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

CONTROL = Qt.KeyboardModifier.ControlModifier


def names(search):
    return [search.list.item(row).text() for row in range(search.list.count())]


def find(workspace, words):
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F, CONTROL)
    search = workspace.canvas.item_search
    assert search.field.hasFocus()
    QTest.keyClicks(search.field, words)
    return search


def test_a_node_in_a_sub_patch_is_found_by_its_name_shown_and_selected(row):
    canvas, scene = row.canvas, row.canvas.patch_scene
    scene.select(["through1"])
    QTest.keyClick(canvas, Qt.Key.Key_F2)
    write(row, "Crust of ice")
    collapse(row, "through", "through1")
    search = find(row, "")
    with_all = search.height()
    search = find(row, "ice crust")
    assert names(search) == ["Crust of ice"]
    assert search.height() < with_all  # covers no more of the patch than it needs
    assert search.list.verticalScrollBar().maximum() == 0
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert (canvas.inside, scene.selected()) == ("group", ["through1"])
    assert canvas.hasFocus()
    search = find(row, "shaker")
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert (canvas.inside, scene.selected()) == ("", ["shaker"])
    QTest.keyClick(find(row, "sub-patch").field, Qt.Key.Key_Return)
    assert (canvas.inside, scene.selected()) == ("", ["group"])


def test_what_is_found_from_afar_is_shown_in_a_size_in_which_it_can_be_read(row):
    canvas, scene = row.canvas, row.canvas.patch_scene
    canvas.zoom_to(0.2)
    QTest.keyClick(find(row, "shaker").field, Qt.Key.Key_Return)
    assert "shaker" in canvas.visible_ids()
    canvas.zoom_to(0.7)
    QTest.keyClick(find(row, "hum").field, Qt.Key.Key_Return)
    assert canvas.transform().m11() == 0.7
    assert scene.selected() == ["hum"]


def test_notes_and_frames_are_found_and_what_is_not_there_is_said(row):
    canvas, scene = row.canvas, row.canvas.patch_scene
    scene.select(["through", "through1"])
    QTest.keyClick(canvas, Qt.Key.Key_G, CONTROL)
    write(row, "Crust")
    canvas.add_note(QPointF(5000.0, 3000.0))
    write(row, "Try less of it", Qt.Key.Key_Return, CONTROL)
    scene.select(())
    canvas.fit_view()
    QTest.keyClick(find(row, "cru").field, Qt.Key.Key_Return)
    assert set(scene.selected()) == {"through", "through1"}
    search = find(row, "less of")
    assert names(search) == ["Try less of it"]
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    seen = canvas.mapToScene(canvas.viewport().rect()).boundingRect()
    assert seen.contains(scene.notes[scene.selected()[0]].sceneBoundingRect())
    search = find(row, "lava")
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert search.isVisible()
    assert names(search) == ["Nothing in the patch has these words"]
    QTest.keyClick(search.field, Qt.Key.Key_Escape)
    assert search.isHidden()
    assert canvas.hasFocus()
