"""The context menu of the canvas; independent of the canvas class."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

from underfoot.patch.groups import Group
from underfoot.widgets.controls.menu import Menu, literal

MARK_ACTIONS = ("audition", "audition everywhere", "mute", "bypass", "solo")
"""Actions on how nodes are heard, which `underfoot.widgets.design.mark_actions` adds."""


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
            colour.addActions(_named(actions, "colour "))
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
        align.addActions(_named(actions, "align "))
    menu.addSeparator()
    menu.addActions([actions[name] for name in ("frame", "frame all", "actual size")])
    return menu


def _named(actions: Mapping[str, QAction], begin: str) -> list[QAction]:
    """Return the actions whose names begin so."""
    return [action for name, action in actions.items() if name.startswith(begin)]
