"""A hand that never rests: whatever it does on the canvas, the patch is what is seen, saved and taken back.

A seed that fails, fails again: print what `drag` and the others do, and leave out gestures until few are left. That of
the test goes into the sub-patch and out, and pulls at wires that are there; others may delete everything at first.
"""

import random

from design_samples import REGISTRY, sample, send
from msgspec.structs import replace
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent, QKeySequence
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from underfoot.patch.patch import Group, Note, Patch

SEED, GESTURES = 7, 60
LEFT, RIGHT, NONE = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier
HELD = (*4 * [NONE], *(Qt.KeyboardModifier[f"{key}Modifier"] for key in ("Shift", "Control", "Alt")))
KEYS = (
    *("Ctrl+G", "Ctrl+G", "Ctrl+E", "Ctrl+E", "Ctrl+E", "Ctrl+Shift+G", "Shift+G", "Return", "U", "Ctrl+L", "Escape"),
    *("Ctrl+X", "Ctrl+C", "Ctrl+V", "Ctrl+V", "Ctrl+D", "Ctrl+Shift+D", "Delete", "Ctrl+A", "N", "K", "C", "R", "T"),
    *("F2", "Home", "+", "-", "Left", "Shift+Up", "M", "B", "S", "Ctrl+Z", "Ctrl+Z", "Ctrl+Shift+Z", "Ctrl+F", "/"),
)
WORDS = ("", "Chain", "a" * 60, "<b>&", "thr", "hum", "shak")


def place(canvas, rng):
    """A position of the view: of a node or sub-patch, its ports, a wire, a note, a frame's title, or anywhere."""
    scene = canvas.patch_scene
    places = [QPointF(canvas.mapToScene(rng.randrange(1200), rng.randrange(600)))]
    for item in scene.nodes_and_group_nodes():
        places += [item.mapToScene(at) for at in (QPointF(30, 10), item.geometry.plot.center())]
        places += [item.mapToScene(port.at) for port in item.geometry.ports]
    places += [drawn.sceneBoundingRect().center() for drawn in (*scene.wires.values(), *scene.notes.values())]
    places += [frame.title_rect().center() for frame in scene.group_frames.values()]
    return canvas.mapFromScene(rng.choice(places))


def press(widget, keys):
    pressed = QKeySequence(keys)[0]
    QTest.keyClick(widget, pressed.key(), pressed.keyboardModifiers())


def drag(canvas, rng):
    """Press, move and let go; now and then a key comes between."""
    view, button, at = canvas.viewport(), rng.choice((LEFT, LEFT, LEFT, RIGHT)), place(canvas, rng)
    send(view, QEvent.Type.MouseButtonPress, at, button, HELD[-2] if button == RIGHT else rng.choice(HELD))
    for _ in range(rng.randrange(4)):
        at = place(canvas, rng)
        send(view, QEvent.Type.MouseMove, at, button)
        if rng.random() < 0.1:
            press(canvas, rng.choice(KEYS))
    send(view, QEvent.Type.MouseButtonRelease, at, button, rng.choice(HELD))


def double_click(canvas, rng):
    at = place(canvas, rng)
    send(canvas.viewport(), QEvent.Type.MouseButtonDblClick, at, LEFT)
    send(canvas.viewport(), QEvent.Type.MouseButtonRelease, at, LEFT)


def choose_in_menu(canvas, rng):
    at = place(canvas, rng)
    QApplication.sendEvent(canvas.viewport(), QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, QPoint()))
    for menu in [menu for menu in canvas.findChildren(QMenu) if menu.isVisible()]:
        action = rng.choice([one for one in menu.actions() if one.isEnabled() and not one.isSeparator()])
        menu.close()
        action.trigger()


def answer(canvas, rng):
    """Type into the field or the list that is open, if any is, and take it or leave it."""
    searches = (canvas.search, canvas.item_search, canvas.connection_search)
    fields = [canvas.inline, *(search.field for search in searches)]
    for field in [field for field in fields if field.isVisible()]:
        QTest.keyClicks(field, rng.choice(WORDS))
        press(field, rng.choice(("Down", "Return")))
        for key in ("Return", "Escape"):
            if field.isVisible():
                press(field, key)


def look(canvas, patch):
    """What is drawn is the patch, and what would be saved is read as it is."""
    scene = canvas.patch_scene
    assert Patch.loads(patch.dumps(), REGISTRY) == scene.patch == patch
    shown = scene.group_view.shown_as
    at = {node.id: node.at for node in (*patch.nodes, *patch.notes) if shown.get(node.id) == node.id}
    at |= {group.id: group.at for group in scene.group_view.collapsed}
    assert {id: (item.pos().x(), item.pos().y()) for id, item in scene.movable().items()} == at
    assert set(scene.wires) == {wire for wire in patch.wires if any(scene.group_view.ends(wire))}
    assert all(wire.isVisible() for wire in scene.wires.values())
    assert canvas.inside in ("", *(group.id for group in patch.groups))


def test_random_gestures_leave_the_patch_that_is_shown_and_are_taken_back_to_the_first(workspace):
    canvas, rng, levels = workspace.canvas, random.Random(SEED), set()
    patch = sample().add("through", REGISTRY, (240.0, 160.0)).connect("hum.out", "through.signal", REGISTRY)
    patch = patch.connect("through.out", "shaker.acceleration", REGISTRY)
    sub, note = Group("tone", ("hum",), "Tone", collapsed=True, at=(0.0, 160.0)), Note("note", "Heel", (0.0, 320.0))
    workspace.set_patch(replace(patch, groups=(sub,), notes=(note,)))
    first = workspace.patch().dumps()
    canvas.cursor().setPos(0, 0)  # Paste asks where it is
    QApplication.clipboard().clear()
    acts = [drag, drag, double_click, choose_in_menu, lambda canvas, rng: press(canvas, rng.choice(KEYS))]
    for _ in range(GESTURES):
        rng.choice(acts)(canvas, rng)
        answer(canvas, rng)
        look(canvas, workspace.patch())
        levels.add(canvas.inside)
    states, stack = [workspace.patch().dumps()], workspace.document.stack
    done = stack.index()
    assert done > 5
    assert len(levels) > 1
    for _ in range(done):
        workspace.undo_action.trigger()
        look(canvas, workspace.patch())
        states.append(workspace.patch().dumps())
    assert states[-1] == first
    for state in states[-2::-1]:
        workspace.redo_action.trigger()
        assert workspace.patch().dumps() == state
