"""Wires that rest are painted from one picture: it shows what the wires themselves would."""

from itertools import pairwise
from pathlib import Path

from design_samples import LEFT, middle, port, send
from PySide6.QtCore import QEvent, QPoint, QPointF

from underfoot import scenes
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.widgets.design.items import curve
from underfoot.widgets.design.scene import PatchScene


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


def test_a_level_wire_looks_the_same_all_along(row, qapp):
    """Dots were seen along it, where the segments of a curve met."""
    begin, end = port(row, "hum", "out", "out"), port(row, "through", "in", "signal")
    image = seen(row, qapp)
    across = [[image.pixel(x, begin.y() + y) for y in range(-4, 5)] for x in range(begin.x() + 10, end.x() - 10)]
    assert len(across) > 20
    assert all(column == across[0] for column in across)


def test_a_wire_of_no_length_does_not_end_the_program(row, qapp):
    """Its path has one point; where painting it failed, Qt for Python crashed, as often as the patch was opened."""
    out, into = (row.canvas.patch_scene.nodes[id] for id in ("hum", "through"))
    by = out.port_place("out", "out") - into.port_place("in", "signal")
    row.document.edit(row.patch().move({"through": (into.pos().x() + by.x(), into.pos().y() + by.y())}), "Move")
    wire = row.canvas.patch_scene.wires["hum.out", "through.signal"]
    assert wire.path_middle() == wire.target_place() == out.port_place("out", "out")
    wire.set_chosen(True)  # so that it is painted by itself, too
    assert seen(row, qapp) == all_anew(row, qapp)


def test_a_short_wire_that_is_not_quite_level_does_not_zigzag():
    for across in (-8.0, 8.0):
        path = curve(QPointF(0.0, 0.0), QPointF(24.0, across))  # the gap that dropped nodes keep
        ahead = [path.pointAtPercent(i / 50).x() for i in range(51)]
        assert all(after > before - 0.5 for before, after in pairwise(ahead))


def test_no_wire_of_a_preset_or_a_scene_runs_behind_a_node(qapp):
    for path in (*preset_files.patches().values(), *Path(scenes.__file__).parent.glob("*/patch.json")):
        drawn = PatchScene(REGISTRY)
        drawn.show(Patch.load(path, REGISTRY))
        for ends, wire in drawn.wires.items():
            others = [node for node in drawn.nodes.values() if node not in (wire.source, wire.target)]
            hidden_by = [node.node.id for node in others if wire.passes(node.mapRectToScene(node.geometry.rect))]
            assert not hidden_by, f"{path.name}: {ends}"
