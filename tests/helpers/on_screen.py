"""Windows of tests on the screen, with the focus, also without a window manager."""

from PySide6.QtCore import QPointF, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu


def show(qtbot, widget):
    """Show a window, and wait until it has the focus."""
    widget.show()
    widget.activateWindow()
    qtbot.waitUntil(widget.isActiveWindow)


def place_on(floor_map, tile, x_m=0.0, y_m=0.0):
    """Convert a position on a tile to the pixels of a floor map."""
    return floor_map.to_screen().map(QPointF(*tile.to_floor((x_m, y_m)))).toPoint()


def type_into(qtbot, editor, text, end=Qt.Key.Key_Return):
    """Type over what is in the field of a parameter's editor, and press Return, or another key."""
    editor.field.setFocus()
    editor.field.selectAll()
    qtbot.keyClicks(editor.field, text)
    qtbot.keyClick(editor.field, end)


def choose(button, *words):
    """Click a button that opens a menu, and through its menus to the choice with these words.

    An open menu has an event loop of its own, so a timer clicks in it. Wait first until a dialog that was just closed
    has given the focus back: when it does so later, open menus close.
    """
    button.window().activateWindow()
    assert QTest.qWaitForWindowActive(button.window(), 60_000)
    left, menus = list(words), [button.menu()]

    def click():
        menu = menus[-1]
        if not menu.isVisible():
            return
        action = next((action for action in menu.actions() if action.text() == left[0]), None)
        if action is None:  # what is asked for is not there: the menu would wait for ever
            timer.stop()
            menus[0].close()
            return
        # Not action.menu(): the menu that older Qt for Python returns is deleted with its name here.
        menus.extend(under for under in menu.findChildren(QMenu) if under.menuAction() == action)
        del left[0]
        if not left:
            timer.stop()
        QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(action).center())

    timer = QTimer()
    timer.setInterval(20)
    timer.timeout.connect(click)
    timer.start()
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    timer.stop()
    assert not left, f"no choice {left[0]!r} in the menu"
