"""What a hand does on the canvas by keys alone: nodes are selected, connected and disconnected."""

from design_samples import REGISTRY
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from underfoot.nodes import REGISTRY as NODES
from underfoot.patch.patch import Patch


def test_several_nodes_are_selected_by_keys(workspace):
    """N steps, K keeps; a node that is come to again is let go, and any other selection begins anew."""
    canvas = workspace.canvas

    def selected(keys):
        for key in keys:
            QTest.keyClick(canvas, key)
        return canvas.selected_ids()

    assert selected("NK") == ["push"]
    assert selected("NNK") == ["push", "hum"]
    assert selected("N") == ["push", "hum", "shaker"]
    assert canvas.accessibleDescription() == "Shaker; 3 items selected"
    assert selected("N") == ["push", "hum"]
    assert selected("KN") == ["step", "hum"]
    canvas.patch_scene.select(["push"])
    assert selected("N") == ["step"]
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert selected("K") == []
    assert canvas.message == "Select what to keep selected"


def test_a_wire_is_taken_away_by_keys_at_either_of_its_ends(workspace):
    canvas, before = workspace.canvas, workspace.patch()
    for node, other in (("push", "Step"), ("step", "Push")):
        canvas.patch_scene.select([node])
        QTest.keyClick(canvas, Qt.Key.Key_C)
        field, shown = canvas.connection_search.field, canvas.connection_search.list
        QTest.keyClick(field, Qt.Key.Key_Up)
        assert shown.currentItem().text() == f"Disconnect {other}: force"
        QTest.keyClicks(field, other)  # to connect what is connected
        assert shown.count() == 1
        QTest.keyClick(field, Qt.Key.Key_Return)
        assert workspace.patch() == before
        field.clear()
        QTest.keyClicks(field, "disc")
        assert shown.count() == 1
        QTest.keyClick(field, Qt.Key.Key_Return)
        assert workspace.patch() == before.disconnect([("push.force", "step.force")])
        QTest.keyClick(canvas, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)


def test_an_input_of_a_large_patch_is_found_by_words_to_be_connected_to(workspace):
    """A menu had them all: most were beside the screen."""
    canvas, patch = workspace.canvas, Patch().add("through", REGISTRY)
    for i in range(60):
        patch = patch.add("hum", REGISTRY, (200.0 * i, 160.0)).add("shaker", REGISTRY, (200.0 * i, 320.0))
    workspace.set_patch(patch)
    canvas.patch_scene.select(["through"])
    QTest.keyClick(canvas, Qt.Key.Key_C)
    search = canvas.connection_search
    assert [search.list.item(row).text() for row in range(2)] == ["A new node…", "Shaker (shaker): acceleration"]
    QTest.keyClicks(search.field, "lava")
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert search.isVisible()
    search.field.clear()
    QTest.keyClicks(search.field, "shaker42 accel")
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert workspace.patch().wires == (("through.out", "shaker42.acceleration"),)
    assert canvas.hasFocus()


def test_words_mean_an_input_before_an_output_of_the_same_name(qtbot, all_nodes):
    """As an Impact has an acceleration, these words and Enter asked for a new node."""
    show(qtbot, all_nodes)
    canvas, patch = all_nodes.canvas, Patch().add("impact", NODES).add("tile-output", NODES, (300, 0))
    all_nodes.set_patch(patch)
    canvas.patch_scene.select(["impact"])
    QTest.keyClick(canvas, Qt.Key.Key_C)
    search = canvas.connection_search
    QTest.keyClicks(search.field, "acceleration")
    assert search.list.item(1).text() == "A new node…", "of that output"
    QTest.keyClick(search.field, Qt.Key.Key_Return)
    assert all_nodes.patch().wires == (("impact.acceleration", "tile-output.acceleration"),)
