"""Wires that rest are painted from one picture: it shows what the wires themselves would."""

from design_samples import LEFT, middle, send
from PySide6.QtCore import QEvent, QPoint


def seen(workspace, qapp):
    qapp.processEvents()
    return workspace.canvas.viewport().grab().toImage()


def all_anew(workspace, qapp):
    workspace.canvas.patch_scene.wire_picture.redraw_all()
    return seen(workspace, qapp)


def test_a_view_that_is_moved_shows_what_one_drawn_anew_shows(workspace, qapp):
    at_first = seen(workspace, qapp)
    for aside in ((24, -16), (-90, 40), (3000, 0), (-2934, -24)):
        workspace.canvas.pan(*aside)
        moved = seen(workspace, qapp)
        assert moved == all_anew(workspace, qapp)
    assert moved == at_first


def test_a_wire_leaves_the_picture_while_its_node_is_dragged_and_comes_back(workspace, qapp, qtbot):
    scene, view = workspace.canvas.patch_scene, workspace.canvas.viewport()
    wire = next(iter(scene.wires.values()))
    seen(workspace, qapp)
    assert wire.is_in_picture
    place = middle(workspace, wire.source.node.id)
    send(view, QEvent.Type.MouseButtonPress, place, LEFT)
    send(view, QEvent.Type.MouseMove, place + QPoint(40, 24), LEFT)
    assert not wire.is_in_picture
    dragged = seen(workspace, qapp)
    assert dragged == all_anew(workspace, qapp)
    send(view, QEvent.Type.MouseButtonRelease, place + QPoint(40, 24), LEFT)
    qtbot.waitUntil(lambda: wire.is_in_picture)
    assert seen(workspace, qapp) == all_anew(workspace, qapp)
