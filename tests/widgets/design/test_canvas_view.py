"""What of a patch is in view: wheel, fingers and keys, and the map."""

import pytest
from design_samples import LEFT, NONE, REGISTRY
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import (
    QImage,
    QNativeGestureEvent,
    QPointingDevice,
    QWheelEvent,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.patch.patch import Patch
from underfoot.widgets import theme


def test_wheel_zooms_about_the_mouse_and_keys_bring_it_back(workspace):
    canvas = workspace.canvas
    place = QPoint(200, 150)
    under = canvas.mapToScene(place)
    scroll(canvas, place, QPoint(0, 120))
    assert canvas.transform().m11() > 1.1
    after = canvas.mapToScene(place)
    assert abs(after.x() - under.x()) < 4
    assert abs(after.y() - under.y()) < 4
    QTest.keyClick(canvas, Qt.Key.Key_0)
    assert canvas.transform().m11() == pytest.approx(1.0)
    under = canvas.mapToScene(place)
    scroll(canvas, place, QPoint(0, -120), held=Qt.KeyboardModifier.ShiftModifier)
    scroll(canvas, place, QPoint(-120, 0))
    assert canvas.mapToScene(place) - under == QPointF(120, 0)
    assert canvas.transform().m11() == pytest.approx(1.0)


def scroll(canvas, place, angle, moved=(0, 0), phase=Qt.ScrollPhase.NoScrollPhase, held=NONE):
    where = QPointF(place), QPointF(canvas.viewport().mapToGlobal(place))
    wheel = QWheelEvent(*where, QPoint(*moved), angle, Qt.MouseButton.NoButton, held, phase, False)
    QApplication.sendEvent(canvas.viewport(), wheel)


def test_two_fingers_move_the_view_and_pinch_or_control_zooms(workspace):
    canvas, place, on = workspace.canvas, QPoint(200, 150), Qt.ScrollPhase.ScrollUpdate
    QTest.keyClick(canvas, Qt.Key.Key_0)
    under = canvas.mapToScene(place)
    scroll(canvas, place, QPoint(24, -40), (12, -20), on)
    assert canvas.mapToScene(place) - under == QPointF(-12, 20)
    assert canvas.transform().m11() == pytest.approx(1.0)
    scroll(canvas, place, QPoint(0, 120), (0, 60), on, Qt.KeyboardModifier.ControlModifier)
    assert canvas.transform().m11() == pytest.approx(1.2)
    touchpad = QPointingDevice.primaryPointingDevice()
    kind, at = Qt.NativeGestureType.ZoomNativeGesture, QPointF(place)
    pinch = QNativeGestureEvent(kind, touchpad, 2, at, at, at, 0.25, QPointF())
    QApplication.sendEvent(canvas.viewport(), pinch)
    assert canvas.transform().m11() == pytest.approx(1.5)


def test_frame_brings_everything_into_view(workspace):
    canvas = workspace.canvas
    canvas.centerOn(9000, 9000)
    QTest.keyClick(canvas, Qt.Key.Key_F)
    seen = canvas.mapToScene(canvas.viewport().rect()).boundingRect()
    assert seen.contains(canvas.patch_scene.extent())


def test_all_stays_in_view_until_somebody_looks_elsewhere(workspace):
    canvas = workspace.canvas
    workspace.document.edit(workspace.patch().add("hum", REGISTRY, (1400.0, 0.0)), "Add")
    workspace.set_patch(workspace.patch())
    far = canvas.transform().m11()
    workspace.resize(1900, 1000)
    assert canvas.transform().m11() > far
    canvas.zoom_to(0.5)
    workspace.resize(1280, 748)
    assert canvas.transform().m11() == pytest.approx(0.5)


def test_the_map_shows_itself_when_not_all_is_seen_and_leads_there(workspace):
    canvas = workspace.canvas
    assert not canvas.map.isVisible()
    workspace.document.edit(workspace.patch().add("hum", REGISTRY, (6000.0, 4000.0)), "Add")
    assert canvas.map.isVisible()
    QTest.mouseClick(canvas.map, LEFT, NONE, QPoint(canvas.map.width() - 20, canvas.map.height() - 20))
    assert canvas.mapToScene(canvas.viewport().rect().center()).x() > 3000


@pytest.mark.parametrize("x", [32.0, 880.0])
def test_the_map_of_a_patch_that_is_opened_covers_none_of_its_nodes(workspace, x):
    canvas, patch = workspace.canvas, Patch()
    for place in ((0.0, 0.0), (3000.0, 0.0), (x, 400.0)):
        patch = patch.add("hum", REGISTRY, place)
    workspace.set_patch(patch)
    assert canvas.map.isVisible()
    seen = [canvas.mapFromScene(item.sceneBoundingRect()).boundingRect() for item in canvas.patch_scene.nodes.values()]
    assert canvas.rect().contains(seen[2])
    assert not any(canvas.map.geometry().intersects(rect) for rect in seen)


def test_the_map_has_its_border_on_all_sides_at_any_scale(workspace):
    shown = workspace.canvas.map
    for ratio in (1.0, 1.25, 1.5):
        picture = QImage(shown.size() * ratio, QImage.Format.Format_RGB32)
        picture.setDevicePixelRatio(ratio)
        shown.render(picture)
        right, bottom = picture.width() - 1, picture.height() - 1
        sides = ((right // 2, 0), (right // 2, bottom), (0, bottom // 2), (right, bottom // 2))
        assert {picture.pixelColor(*side).name() for side in sides} == {theme.LINE}
