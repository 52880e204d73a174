"""What is dragged to the canvas's edge scrolls the view."""

import pytest
from design_samples import LEFT, NONE, REGISTRY, drag, middle, port, sample, send
from on_screen import show
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QContextMenuEvent, QDragEnterEvent, QDragLeaveEvent, QDragMoveEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.widgets.design.workspace import DesignWorkspace

CANCELS = ("escape", "right button")


@pytest.fixture
def alone(qtbot):
    """A workspace of the test's own: after a drag from elsewhere its window is not activated again."""
    made = DesignWorkspace(REGISTRY)
    qtbot.addWidget(made)
    made.resize(1280, 748)
    show(qtbot, made)
    made.set_patch(sample())
    made.canvas.zoom_to(1.0)
    return made


@pytest.fixture
def canvas(workspace):
    workspace.canvas.zoom_to(1.0)
    return workspace.canvas


def left_edge(canvas):
    return canvas.mapToScene(QPoint(0, 0)).x()


def right_of(canvas, beyond_px=0):
    """Return a position at the right edge of the view, or further right."""
    return QPoint(canvas.viewport().width() - 1 + beyond_px, canvas.viewport().height() // 2)


def give_up(canvas, how, at):
    """Cancel a drag by Escape or by the right button."""
    if how == "escape":
        QTest.keyClick(canvas, Qt.Key.Key_Escape)
    else:
        asked = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, canvas.viewport().mapToGlobal(at))
        QApplication.sendEvent(canvas.viewport(), asked)


def test_a_node_at_the_edge_scrolls_the_view_and_stays_under_the_mouse(workspace, canvas, qtbot):
    item, before = canvas.patch_scene.nodes["hum"], left_edge(canvas)
    start, end = middle(workspace, "hum"), right_of(canvas, 40)
    held = canvas.mapToScene(start) - item.pos()
    drag(workspace, start, end, release=False)
    qtbot.waitUntil(lambda: left_edge(canvas) > before + 1500)  # and on, while the mouse stands still
    slip = canvas.mapToScene(end) - held - item.pos()
    assert max(abs(slip.x()), abs(slip.y())) <= 8  # the grid
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert workspace.patch().node("hum").at[0] > 1500
    assert not canvas.edge_scrolling.is_scrolling


def test_a_wire_reaches_a_node_that_was_out_of_view(workspace, canvas, qtbot):
    workspace.document.edit(workspace.patch().move({"shaker": (1300.0, 160.0)}), "Move")
    assert not canvas.viewport().rect().contains(port(workspace, "shaker", "in", "acceleration"))
    start, end = port(workspace, "hum", "out", "out"), right_of(canvas)
    drag(workspace, start, end, release=False)
    qtbot.waitUntil(lambda: canvas.viewport().rect().contains(port(workspace, "shaker", "in", "acceleration")))
    end = canvas.viewport().rect().center()
    send(canvas.viewport(), QEvent.Type.MouseMove, end, LEFT)
    end = port(workspace, "shaker", "in", "acceleration")
    send(canvas.viewport(), QEvent.Type.MouseMove, end, LEFT)
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert ("hum.out", "shaker.acceleration") in workspace.patch().wires


def test_a_rubber_band_goes_on_from_where_it_began(workspace, canvas, qtbot):
    workspace.document.edit(workspace.patch().move({"shaker": (1300.0, 160.0)}), "Move")
    assert not canvas.viewport().rect().contains(middle(workspace, "shaker"))
    start = canvas.mapFromScene(-20.0, -20.0)
    end = QPoint(canvas.viewport().width() + 40, canvas.mapFromScene(0.0, 320.0).y())
    drag(workspace, start, end, release=False)
    qtbot.waitUntil(lambda: canvas.patch_scene.nodes["shaker"].isSelected())
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert set(canvas.selected_ids()) == {"push", "step", "hum", "shaker"}


def test_a_frame_is_dragged_on_over_the_edge(chain, qtbot):
    canvas = chain.canvas
    title = next(iter(canvas.patch_scene.group_frames.values())).frame_rect().topLeft() + QPointF(16.0, 8.0)
    end = QPoint(-40, canvas.mapFromScene(title).y())
    drag(chain, canvas.mapFromScene(title), end, release=False)
    qtbot.waitUntil(lambda: canvas.patch_scene.nodes["through"].pos().x() < -400)
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    through, through1 = chain.patch().node("through").at, chain.patch().node("through1").at
    assert through[0] < -400
    assert through1[0] - through[0] == 200


@pytest.mark.parametrize("cancel", CANCELS)
def test_a_drag_that_is_cancelled_at_the_edge_ends_there(workspace, canvas, qtbot, cancel):
    item, patch, before = canvas.patch_scene.nodes["hum"], workspace.patch(), left_edge(canvas)
    end = right_of(canvas, 40)
    drag(workspace, middle(workspace, "hum"), end, release=False)
    qtbot.waitUntil(lambda: left_edge(canvas) > before + 200)
    give_up(canvas, cancel, end)
    qtbot.waitUntil(lambda: not canvas.edge_scrolling.is_scrolling)
    assert item.pos().toTuple() == (0.0, 160.0)
    assert workspace.patch() == patch
    assert left_edge(canvas) == before  # and the view is back
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert left_edge(canvas) == before


@pytest.mark.parametrize("cancel", CANCELS)
def test_a_rubber_band_that_is_cancelled_leaves_selection_and_view(workspace, canvas, qtbot, cancel):
    canvas.patch_scene.select(["hum"])
    before, panics = left_edge(canvas), []
    workspace.window().addAction("panic", "Esc", lambda: panics.append(1))
    end = QPoint(canvas.viewport().width() + 40, canvas.mapFromScene(0.0, 120.0).y())
    drag(workspace, canvas.mapFromScene(-20.0, -20.0), end, release=False)
    qtbot.waitUntil(lambda: left_edge(canvas) > before + 200)
    assert set(canvas.selected_ids()) == {"push", "step"}
    give_up(canvas, cancel, end)
    assert canvas.rubberBandRect().isNull()
    send(canvas.viewport(), QEvent.Type.MouseMove, end + QPoint(0, 90), LEFT)
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, end, LEFT)
    assert canvas.selected_ids() == ["hum"]
    assert left_edge(canvas) == before
    assert not panics


def test_a_press_at_the_edge_scrolls_nothing(workspace, canvas):
    at = right_of(canvas, -2)
    send(canvas.viewport(), QEvent.Type.MouseButtonPress, at, LEFT)
    send(canvas.viewport(), QEvent.Type.MouseMove, at + QPoint(1, 1), LEFT)
    assert not canvas.edge_scrolling.is_scrolling


def from_the_list(workspace):
    """Return how the node Hum is dragged."""
    palette = workspace.node_palette.list
    data = palette.mimeData(palette.findItems("Hum", Qt.MatchFlag.MatchContains))
    return Qt.DropAction.CopyAction, data, LEFT, NONE


def test_a_node_from_the_list_scrolls_the_view_once_it_was_within(alone, qtbot):
    canvas = alone.canvas
    view, before, end = canvas.viewport(), left_edge(canvas), right_of(canvas, -4)
    how = from_the_list(alone)
    QApplication.sendEvent(view, QDragEnterEvent(QPoint(1, end.y()), *how))
    QApplication.sendEvent(view, QDragMoveEvent(QPoint(2, end.y()), *how))
    assert not canvas.edge_scrolling.is_scrolling  # the list is beside this edge
    QApplication.sendEvent(view, QDragMoveEvent(view.rect().center(), *how))
    QApplication.sendEvent(view, QDragMoveEvent(end, *how))
    qtbot.waitUntil(lambda: left_edge(canvas) > before + 100)
    place = canvas.mapToScene(end)
    QApplication.sendEvent(view, QDropEvent(QPointF(end), *how))
    assert not canvas.edge_scrolling.is_scrolling
    assert abs(alone.patch().nodes[-1].at[0] - place.x()) <= 24
    stays = left_edge(canvas)
    alone.hide()
    assert left_edge(canvas) == stays


def test_a_node_from_the_list_that_is_given_up_leaves_the_view_where_it_was(alone, qtbot):
    canvas = alone.canvas
    view, before, end, how = canvas.viewport(), left_edge(canvas), right_of(canvas, -4), from_the_list(alone)
    QApplication.sendEvent(view, QDragEnterEvent(view.rect().center(), *how))
    QApplication.sendEvent(view, QDragMoveEvent(view.rect().center(), *how))
    QApplication.sendEvent(view, QDragMoveEvent(end, *how))
    qtbot.waitUntil(lambda: left_edge(canvas) > before + 100)
    QApplication.sendEvent(view, QDragLeaveEvent())
    assert not canvas.edge_scrolling.is_scrolling
    assert left_edge(canvas) > before  # it may come back
    palette = alone.node_palette.list
    at = palette.visualItemRect(palette.findItems("Hum", Qt.MatchFlag.MatchContains)[0]).center()
    for kind, way in ((QEvent.Type.MouseButtonPress, 0), (QEvent.Type.MouseMove, 30), (QEvent.Type.MouseMove, 60)):
        send(palette.viewport(), kind, at + QPoint(way, 0), LEFT)  # without a screen a drag ends as it begins
    assert left_edge(canvas) == before


def test_a_file_that_is_dragged_over_the_edge_scrolls_nothing(alone):
    canvas = alone.canvas
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile("/sounds/ice.json")])
    how = Qt.DropAction.CopyAction, data, LEFT, NONE
    view = canvas.viewport()
    QApplication.sendEvent(view, QDragEnterEvent(view.rect().center(), *how))
    QApplication.sendEvent(view, QDragMoveEvent(view.rect().center(), *how))
    QApplication.sendEvent(view, QDragMoveEvent(right_of(canvas, -4), *how))
    assert not canvas.edge_scrolling.is_scrolling
