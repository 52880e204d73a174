"""What a hand does with groups and sub-patches on the canvas."""

from design_samples import LEFT, NONE
from PySide6.QtCore import Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

CONTROL = Qt.KeyboardModifier.ControlModifier


def write(workspace, text, key=Qt.Key.Key_Return, modifiers=NONE):
    assert workspace.canvas.inline.isVisible()
    workspace.canvas.inline.selectAll()
    QTest.keyClicks(workspace.canvas.inline, text)
    QTest.keyClick(workspace.canvas.inline, key, modifiers)


def collapse(workspace, *ids):
    """Make a sub-patch of these, and give it no title if it is asked for; return the first one of the patch."""
    workspace.canvas.patch_scene.select(ids)
    QTest.keyClick(workspace.canvas, Qt.Key.Key_E, CONTROL)
    if workspace.canvas.inline.isVisible():
        write(workspace, "")
    return workspace.canvas.patch_scene.group_nodes.get("group")


def in_view(workspace, place):
    return workspace.canvas.mapFromScene(place)


def menu_at(workspace, place, reason=QContextMenuEvent.Reason.Mouse):
    """The context menu, open, at a place of the canvas."""
    view = workspace.canvas.viewport()
    QApplication.sendEvent(view, QContextMenuEvent(reason, place, view.mapToGlobal(place)))
    return next(menu for menu in workspace.canvas.findChildren(QMenu) if menu.isVisible())


def menu_texts(workspace, place, reason=QContextMenuEvent.Reason.Mouse):
    """What the context menu at a place of the canvas offers."""
    menu = menu_at(workspace, place, reason)
    texts = [action.text() for action in menu.actions()]
    menu.close()
    return texts


def click_in_menu(workspace, place, text):
    """Choose by the mouse in the context menu at a place of the canvas."""
    menu = menu_at(workspace, place)
    there = menu.actionGeometry(next(action for action in menu.actions() if action.text() == text)).center()
    menu.cursor().setPos(menu.mapToGlobal(there))
    QTest.mouseClick(menu, LEFT, NONE, there)
