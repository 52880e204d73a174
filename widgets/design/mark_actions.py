"""Actions on how nodes are heard, with their keys: play one alone; mute, bypass and solo the selected ones."""

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QObject, Signal

from underfoot.patch.effective import can_be_bypassed
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.quantities import counted
from underfoot.widgets.controls.menu import add_action
from underfoot.widgets.design.canvas import Canvas

MARK_NAMES = {"muted": ("Mute", "Unmute"), "bypassed": ("Bypass", "End bypass"), "soloed": ("Solo", "End solo")}
"""The names of setting and of removing each mark."""


class MarkActions(QObject):
    """Adds its actions to a canvas, and edits the marks of its selected nodes."""

    audition_requested = Signal(str, bool)
    """A node to play alone, or to stop if it is playing alone, and whether on all tiles."""

    def __init__(self, canvas: Canvas, registry: Registry) -> None:
        super().__init__(canvas)
        self._canvas, self._registry = canvas, registry
        add = partial(add_action, canvas)
        canvas.actions_by_name |= {
            "audition": add("Audition node", "A", partial(self._audition, everywhere=False)),
            "audition everywhere": add(
                "Audition node on all tiles", "Shift+A", partial(self._audition, everywhere=True)
            ),
            "mute": add("Mute", "M", partial(self.toggle, "muted")),
            "bypass": add("Bypass", "B", partial(self.toggle, "bypassed")),
            "solo": add("Solo", "S", partial(self.toggle, "soloed")),
        }
        canvas.audition_requested.connect(lambda node: self.audition_requested.emit(node, False))

    def toggle(self, mark: str) -> None:
        """Set a mark on the selected nodes, or remove it if all have it."""
        document, ids = self._canvas.document, self._canvas.selected_ids()
        after, what = toggled(document.patch, self._registry, ids, mark)
        if after == document.patch:
            self._canvas.show_message(what)
        else:
            document.edit(after, what)

    def _audition(self, *, everywhere: bool) -> None:
        ids = self._canvas.selected_ids()
        if len(ids) == 1:
            self.audition_requested.emit(ids[0], everywhere)
        else:
            self._canvas.show_message("Select one node to audition")


def toggled(patch: Patch, registry: Registry, ids: Sequence[str], mark: str) -> tuple[Patch, str]:
    """Return the patch with a mark set on these nodes, or removed if all have it, and the name of the edit.

    If no node can be marked, return the same patch and the reason.
    """
    if not ids:
        return patch, f"Select the nodes first, then {MARK_NAMES[mark][0].lower()}"
    if mark == "bypassed":
        can_bypass = [id for id in ids if can_be_bypassed(registry[patch.node(id).type])]
        if not can_bypass:
            name = patch.node(ids[0]).name_in(registry)
            return patch, f"{name} cannot be bypassed: nothing that comes in could go out in its place; mute it"
        ids = can_bypass
    on = not all(mark in patch.node(id).marks for id in ids)
    whom = patch.node(ids[0]).name_in(registry) if len(ids) == 1 else counted(len(ids), "node")
    return patch.mark(ids, mark, on=on), f"{MARK_NAMES[mark][0 if on else 1]} {whom}"
