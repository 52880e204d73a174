"""Actions of the canvas with their keys, and the menus that offer them; independent of the canvas class."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from underfoot.patch.groups import COLOURS, Group
from underfoot.widgets.controls.menu import Menu, Shortcut, add_action, literal

_KEY = QKeySequence.StandardKey


class CanvasAction(NamedTuple):
    """An action: its name in code, its text, and its keys."""

    name: str
    text: str
    keys: Shortcut


ALIGNMENTS = (
    CanvasAction("align left", "Left edges in line", ("Ctrl+Shift+Left",)),
    CanvasAction("align right", "Right edges in line", ("Ctrl+Shift+Right",)),
    CanvasAction("align top", "Top edges in line", ("Ctrl+Shift+Up",)),
    CanvasAction("align bottom", "Bottom edges in line", ("Ctrl+Shift+Down",)),
    CanvasAction("align across", "Equal horizontal gaps", ("Ctrl+Shift+H",)),
    CanvasAction("align down", "Equal vertical gaps", ("Ctrl+Shift+V",)),
)

COLOUR_ACTIONS = tuple(CanvasAction(f"colour {name}", name.capitalize(), ()) for name in COLOURS)

ACTIONS = (
    CanvasAction("add", "Add a node…", ("/", "Insert")),
    CanvasAction("note", "Add a note", ("T",)),
    CanvasAction("rename", "Rename…", ("F2",)),
    CanvasAction("replace", "Replace by…", ("R",)),
    CanvasAction("group", "Group", ("Ctrl+G",)),
    CanvasAction("ungroup", "Ungroup", ("Ctrl+Shift+G",)),
    CanvasAction("take out", "Take out of the group", ("Shift+G",)),
    CanvasAction("collapse", "Collapse to a sub-patch, or open it", ("Ctrl+E",)),
    CanvasAction("enter", "Look into the sub-patch", ()),
    CanvasAction("leave", "Back out of the sub-patch", ("U", "Alt+Up")),
    CanvasAction("tidy", "Tidy up", ("Ctrl+L",)),
    CanvasAction("cut", "Cut", _KEY.Cut),
    CanvasAction("copy", "Copy", _KEY.Copy),
    CanvasAction("paste", "Paste", _KEY.Paste),
    CanvasAction("duplicate", "Duplicate", ("Ctrl+D",)),
    CanvasAction("duplicate fed", "Duplicate with input wires", ("Ctrl+Shift+D",)),
    CanvasAction("delete", "Delete", ("Delete", "Backspace")),
    CanvasAction("select all", "Select all", _KEY.SelectAll),
    CanvasAction("find", "Find…", _KEY.Find),
    CanvasAction("next", "Next node", ("N",)),
    CanvasAction("previous", "Previous node", ("Shift+N",)),
    CanvasAction("keep", "Keep selected, and go on to another", ("K",)),
    CanvasAction("connect", "Connect…", ("C",)),
    CanvasAction("frame", "Fit selection to view", ("F",)),
    CanvasAction("frame all", "Fit all to view", ("Home",)),
    CanvasAction("zoom in", "Zoom in", ("+", "=")),
    CanvasAction("zoom out", "Zoom out", ("-",)),
    CanvasAction("actual size", "Actual size", ("0",)),
    *ALIGNMENTS,
    *COLOUR_ACTIONS,
)


VIEW_ACTIONS = ("frame", "frame all", "zoom in", "zoom out", "actual size")
"""Actions that only move the view, also during a drag."""

MARK_ACTIONS = ("audition", "audition everywhere", "mute", "bypass", "solo")
"""Actions on how nodes are heard, which `underfoot.widgets.design.mark_actions` adds."""


def make_actions(canvas: QWidget, handlers: Mapping[str, Callable[[], object]]) -> dict[str, QAction]:
    """Add the actions to the canvas, with their handlers, and return them by name."""
    return {name: add_action(canvas, text, keys, handlers[name]) for name, text, keys in ACTIONS}


class Selection(NamedTuple):
    """The properties of the selection on which a menu depends."""

    selected: int
    """Number of selected items."""
    is_node: bool
    """Whether the only selected item is a node."""
    is_group: bool
    """Whether a group, or a member of one, is selected."""
    is_framed: bool
    """Whether something in a frame is selected."""
    is_sub_patch: bool
    """Whether the only selected item is a sub-patch."""
    joinable: Sequence[Group]
    """The groups with a frame that the selection can be put into."""
    has_wire: bool
    inside: bool
    """Whether a sub-patch is open."""


def context_menu(
    canvas: QWidget,
    actions: Mapping[str, QAction],
    here: Mapping[str, Callable[[], object]],
    join: Callable[[Group], object],
    chosen: Selection,
) -> Menu:
    """Return the menu for the selection. `here` is what "add", "note", "paste" and "rename" do
    where it was asked for, not where the mouse is then; `join` puts the selection into a group.
    """
    menu = Menu(canvas)

    def act_here(name: str) -> None:
        menu.addAction(actions[name].text(), here[name]).setShortcut(actions[name].shortcut())

    act_here("add")
    act_here("note")
    menu.addSeparator()
    if chosen.is_node:
        menu.addActions([actions[name] for name in ("connect", "replace")])
    if chosen.selected:
        act_here("rename")
        menu.addAction(actions["group"])
        if chosen.joinable:
            into = menu.addMenu("Put into")
            for group in chosen.joinable:
                into.addAction(literal(group.title or "Group"), partial(join, group))
        if chosen.is_framed:
            menu.addAction(actions["take out"])
        if chosen.is_group:
            menu.addAction(actions["ungroup"])
            colour = menu.addMenu("Colour")
            colour.addActions([actions[action.name] for action in COLOUR_ACTIONS])
        menu.addAction(actions["collapse"])
        if chosen.is_sub_patch:
            menu.addAction(actions["enter"])
        menu.addSeparator()
    if chosen.inside:
        menu.addAction(actions["leave"])
    for name in ("cut", "copy", "duplicate", "duplicate fed", "delete"):
        if chosen.selected or (name == "delete" and chosen.has_wire):
            menu.addAction(actions[name])
    if chosen.selected:
        heard = menu.addMenu("Hear")
        heard.addActions([actions[name] for name in MARK_ACTIONS if name in actions])
    act_here("paste")
    menu.addActions([actions[name] for name in ("find", "select all", "tidy")])
    if chosen.selected > 1:
        align = menu.addMenu("Align")
        align.addActions([actions[alignment.name] for alignment in ALIGNMENTS])
    menu.addSeparator()
    menu.addActions([actions[name] for name in ("frame", "frame all", "actual size")])
    return menu
