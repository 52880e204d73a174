"""What can be done on the canvas, with its keys; and the menu that shows both."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QMenu

from underfoot.widgets.design.editing import open_targets
from underfoot.widgets.design.shape import shown

if TYPE_CHECKING:
    from underfoot.widgets.design.canvas import Canvas

ALIGN = (
    ("left", "Left edges", "Ctrl+Shift+Left"),
    ("right", "Right edges", "Ctrl+Shift+Right"),
    ("top", "Top edges", "Ctrl+Shift+Up"),
    ("bottom", "Bottom edges", "Ctrl+Shift+Down"),
    ("across", "Equal gaps across", "Ctrl+Shift+H"),
    ("down", "Equal gaps down", "Ctrl+Shift+V"),
)


def canvas_actions(canvas: "Canvas") -> dict[str, QAction]:
    """The canvas's actions by name. Their keys work while the canvas has the focus."""
    key = QKeySequence.StandardKey
    made: dict[str, QAction] = {}

    def action(name: str, text: str, keys: QKeySequence.StandardKey | list[str], do: Callable[[], None]) -> None:
        made[name] = QAction(text, canvas)
        if isinstance(keys, list):
            made[name].setShortcuts([QKeySequence(k) for k in keys])
        else:
            made[name].setShortcuts(keys)
        made[name].setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        made[name].triggered.connect(do)

    action("cut", "Cut", key.Cut, canvas.cut)
    action("copy", "Copy", key.Copy, canvas.copy)
    action("paste", "Paste", key.Paste, canvas.paste)
    action("duplicate", "Duplicate", ["Ctrl+D"], canvas.duplicate)
    action("delete", "Delete", ["Delete", "Backspace"], canvas.delete)
    action("select all", "Select all", key.SelectAll, canvas.select_all)
    action("next", "Next node", ["N"], lambda: canvas.step_selection(1))
    action("previous", "Previous node", ["Shift+N"], lambda: canvas.step_selection(-1))
    action("connect", "Connect…", ["C"], lambda: open_connect_menu(canvas))
    action("frame", "Frame", ["F"], canvas.frame)
    action("frame all", "Frame all", ["Home"], lambda: canvas.frame(True))
    action("zoom in", "Zoom in", ["+", "="], lambda: canvas.zoom_to(canvas.transform().m11() * 1.2))
    action("zoom out", "Zoom out", ["-"], lambda: canvas.zoom_to(canvas.transform().m11() / 1.2))
    action("life size", "Life size", ["0"], lambda: canvas.zoom_to(1.0))
    for side, text, keys in ALIGN:
        action(f"align {side}", text, [keys], partial(canvas.align, side))
    return made


def context_menu(canvas: "Canvas", place: QPoint) -> QMenu:
    """The menu at this place of the canvas; it goes away when it is closed."""
    some = bool(canvas.selected_ids())
    menu = QMenu(canvas)
    menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    menu.addAction("Add a node…", lambda: canvas.open_search(place)).setShortcut("Space")
    if len(canvas.selected_ids()) == 1:
        menu.addAction(canvas.commands["connect"])
    menu.addSeparator()
    for name in ("cut", "copy", "duplicate", "delete"):
        if some or (name == "delete" and canvas.patch_scene.chosen_wires()):
            menu.addAction(canvas.commands[name])
    menu.addAction(canvas.commands["paste"])
    menu.addAction(canvas.commands["select all"])
    if len(canvas.selected_ids()) > 1:
        align = menu.addMenu("Align")
        align.addActions([canvas.commands[f"align {side}"] for side, _, _ in ALIGN])
    menu.addSeparator()
    menu.addActions([canvas.commands[name] for name in ("frame", "frame all", "life size")])
    return menu


def open_connect_menu(canvas: "Canvas") -> None:
    """Offer, beside the selected node, every input that its outputs may go to: wiring without a mouse."""
    ids = canvas.selected_ids()
    if len(ids) != 1:
        canvas.say("Select the one node whose output is to be connected")
        return
    patch, registry = canvas.document.patch, canvas.registry
    item = canvas.patch_scene.nodes[ids[0]]
    menu = QMenu(canvas)
    menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    for output in item.node_type.outputs:
        source = f"{ids[0]}.{output.name}"
        into = menu if len(item.node_type.outputs) == 1 else menu.addMenu(shown(output.name))
        for target in open_targets(patch, registry, source):
            id, _, port = target.partition(".")
            text = f"{registry[patch.node(id).type].label} ({id}): {shown(port)}"
            into.addAction(text, partial(canvas.connect_ports, source, target))
    if menu.isEmpty():
        menu.addAction("There is no input that fits").setEnabled(False)
    menu.popup(canvas.viewport().mapToGlobal(canvas.mapFromScene(item.sceneBoundingRect().topRight())))
