"""What the mouse does on the canvas besides moving nodes, and what keys do while it holds something."""

import pytest
from design_samples import LEFT, NONE, drag, middle, port, send
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtTest import QTest

from underfoot.widgets.design.group_items import item_rect
from underfoot.widgets.design.items import WireItem

# --- keys during a drag, and drags without an end ---


@pytest.mark.parametrize("key", [Qt.Key.Key_D, Qt.Key.Key_Right])
def test_what_a_key_places_during_a_drag_is_placed_by_what_the_drag_had_moved(workspace, key):
    canvas, place = workspace.canvas, middle(workspace, "hum")
    drag(workspace, place, place + QPoint(0, 160), release=False)
    QTest.keyClick(canvas, key, Qt.KeyboardModifier.ControlModifier if key == Qt.Key.Key_D else NONE)
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
