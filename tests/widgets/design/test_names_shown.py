"""Names are shown as they were typed: & marks no key in menus and on buttons, and < begins no markup."""

import re

import pytest
from design_samples import REGISTRY, drag, port, sample, send
from groups_by_hand import collapse
from msgspec.structs import replace
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu
from windows import quiet_window

from underfoot.engine.reports import Fault
from underfoot.patch.groups import Note
from underfoot.widgets import theme
from underfoot.widgets.design.node_geometry import TITLE
from underfoot.widgets.design.node_painting import far_name, far_note

NAME = "Heel & toe <b>hard</b>"
IN_MENUS = "Heel && toe <b>hard</b>"


def named(workspace, id):
    """Give a node the name, by hand."""
    workspace.canvas.patch_scene.select([id])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_F2)
    QTest.keyClicks(workspace.canvas.inline, NAME)
    QTest.keyClick(workspace.canvas.inline, Qt.Key.Key_Return)


def test_a_name_is_no_markup(workspace):
    named(workspace, "hum")
    shown = [label for label in workspace.findChildren(QLabel) if label.text() == NAME]
    assert shown
    assert {label.textFormat() for label in shown} == {Qt.TextFormat.PlainText}


def test_a_name_has_its_ampersand_in_the_list_of_connections_and_in_undo(workspace):
    named(workspace, "shaker")
    workspace.canvas.patch_scene.select(["hum"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_C)
    search = workspace.canvas.connection_search
    assert f"{NAME}: acceleration" in [search.list.item(row).text() for row in range(search.list.count())]
    QTest.keyClick(search.field, Qt.Key.Key_Escape)
    workspace.canvas.patch_scene.select(["shaker"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_Delete)
    assert workspace.undo_action.text() == f"Undo: delete {IN_MENUS}"


def test_messages_name_a_node_as_its_title_does(workspace):
    canvas = workspace.canvas
    canvas.add("through")
    named(workspace, "hum")
    canvas.connect_ports("hum.out", "step.force")
    assert canvas.message == f"{NAME}.out → Step.force; allowed: N, not m/s²; put a Scale node between"
    canvas.connect_ports("hum.out", "through.signal")
    canvas.connect_ports("through.out", "hum.frequency")
    assert canvas.message == f"wires make a cycle: {NAME} ← Through ← {NAME}; take one of these wires away"
    canvas.connect_ports("hum.out", "shaker.acceleration")
    drag(workspace, port(workspace, "through", "out", "out"), port(workspace, "shaker", "in", "acceleration"))
    assert canvas.message.startswith(f"The wire from {NAME}.out gave way")
    workspace.show_fault(Fault("hum", "t1", 0))
    assert canvas.message.endswith(f": {NAME}")


def test_a_name_has_its_ampersand_on_buttons(workspace):
    workspace.canvas.patch_scene.select(["hum", "shaker"])
    QTest.keyClick(workspace.canvas, Qt.Key.Key_G, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClicks(workspace.canvas.inline, NAME)
    QTest.keyClick(workspace.canvas.inline, Qt.Key.Key_Return)
    workspace.canvas.open_group("group")
    assert workspace.canvas.breadcrumbs.buttons[1].text() == IN_MENUS
    workspace.canvas.leave_group()
    through = workspace.patch().add("through", REGISTRY).name("through", NAME)
    workspace.document.edit(through.connect("through.out", "hum.frequency", REGISTRY), "Drive")
    workspace.canvas.patch_scene.select(["hum"])
    assert workspace.inspector.editors["frequency"].driver.text().startswith("driven by Heel &&")


def test_a_recent_file_has_the_ampersand_of_its_path(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.settings.recent = ["/sounds/ice & snow.json"]
    recent = next(menu for menu in window.menu.findChildren(QMenu) if menu.title() == "Open recent")
    recent.aboutToShow.emit()
    assert [action.text() for action in recent.actions()] == ["/sounds/ice && snow.json"]


def test_a_long_name_is_cut_short_and_the_mouse_shows_all_of_it(workspace):
    """The node grew over its neighbour, and a sub-patch of it over half of the canvas."""
    canvas, name = workspace.canvas, "The heel of a heavy boot that comes down on frozen gravel"
    workspace.document.edit(workspace.patch().name("hum", name), "Rename")
    hum = canvas.patch_scene.nodes["hum"]
    assert hum.geometry.width <= 28 * theme.GRID
    place = canvas.mapFromScene(hum.mapToScene(QPointF(60.0, TITLE / 2)))
    for way in (0, 1):
        send(canvas.viewport(), QEvent.Type.MouseMove, place + QPoint(way, 0), Qt.MouseButton.NoButton)
    assert hum.toolTip().splitlines() == [name, "A tone."]
    collapse(workspace, "hum")
    assert canvas.patch_scene.group_nodes["group"].geometry.width <= 32 * theme.GRID
    size_px, lines = far_name("The Everlasting", 30, 128.0, 80.0)  # from far
    assert size_px == 24
    assert re.fullmatch("The\nE.+…", lines)
    size_px, lines = far_name("Drawn modal bank", 30, 168.0, 60.0)
    assert 24 <= size_px < 30
    assert lines == "Drawn modal\nbank"
    assert far_name("Tone", 30, 128.0, 80.0) == (30, "Tone")
    assert re.fullmatch("Two feet.*\n.+…", far_note("Two feet on one tile:\nthe left one is softer", 24, 224.0, 64.0))
    assert far_note("Short", 24, 224.0, 16.0) == "Short"


@pytest.mark.parametrize("zoom", [1.0, 0.4])
def test_a_note_runs_from_right_to_left_if_its_words_do(workspace, zoom):
    """As while it is typed. A mark that is not seen before the words decides on the direction."""

    def picture(mark):
        workspace.set_patch(replace(sample(), notes=(Note("note", f"{mark}خطوات (3)!", (240.0, 160.0)),)))
        workspace.canvas.zoom_to(zoom)
        return workspace.canvas.grab().toImage()

    left_to_right, right_to_left = "\u200e", "\u200f"
    assert picture("") == picture(right_to_left)
    assert picture("") != picture(left_to_right)


def test_a_wire_tells_its_ends_by_name_and_the_range_of_its_signal(workspace):
    workspace.document.edit(workspace.patch().name("push", "Heel"), "Rename")
    canvas = workspace.canvas

    def told():
        wire = canvas.patch_scene.wires[("push.force", "step.force")]
        place = canvas.mapFromScene(wire.shape().boundingRect().center())
        for way in (0, 1):
            send(canvas.viewport(), QEvent.Type.MouseMove, place + QPoint(way, 0), Qt.MouseButton.NoButton)
        return wire.toolTip()

    workspace.previews.small_plots.signal_ranges_changed.emit({"push.force": (-2.0, 1300.0)})
    assert told() == "Heel: force → Step: force\n−2 N to 1.3 kN in the step that is previewed"
    collapse(workspace, "step")
    canvas.open_group("group")
    assert told().splitlines()[0] == "Heel: force → Step: force"
