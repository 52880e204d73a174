"""The edited document: a patch in each of two slots, A and B, with their undo histories."""

from functools import partial
from pathlib import Path

import msgspec
from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoGroup, QUndoStack

from underfoot.errors import UnderfootError
from underfoot.files import read_file, write_file
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.controls.undo_step import MAX_STEPS, UndoStep, latest_steps, restore_steps
from underfoot.widgets.session.open_patch import SLOTS, other_slot


class Document(QObject):
    """Holds the patch. Editors pass the next patch to it, and views listen to `changed`, files to `edited`.

    `slot` is the edited one. The other slot has its own patch and undo history.
    """

    changed = Signal(object, object)
    """The patch that was edited before, and the present one: after every edit, undo, redo, load and switch."""
    edited = Signal(object, object)
    """The same, after an edit, undo or redo alone, once `changed` has been handled."""
    other_changed = Signal(object)
    """The new patch of the slot that is not edited."""

    def __init__(self, patch: Patch, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.slot = SLOTS[0]
        self._patches = dict.fromkeys(SLOTS, patch)
        self.group = QUndoGroup(self)
        self._stacks = {slot: QUndoStack(self.group) for slot in SLOTS}
        for stack in self._stacks.values():
            stack.setUndoLimit(MAX_STEPS)
        self.group.setActiveStack(self.stack)

    @property
    def patch(self) -> Patch:
        return self._patches[self.slot]

    @property
    def stack(self) -> QUndoStack:
        """The undo stack of the edited slot."""
        return self._stacks[self.slot]

    def load(self, patch: Patch) -> None:
        """Replace the patch, and clear the undo history."""
        before, self._patches[self.slot] = self.patch, patch
        self.stack.clear()
        self.changed.emit(before, patch)

    def switch(self, slot: str, patch: Patch) -> None:
        """Edit this slot from now on. Its undo history is kept if `patch` is its patch, else cleared."""
        before, self.slot = self.patch, slot
        self.group.setActiveStack(self.stack)
        if patch != self.patch:
            self._patches[slot] = patch
            self.stack.clear()
        self.changed.emit(before, patch)

    def edit(self, after: Patch, text: str, merge: str = "") -> None:
        """Set the patch `after` as an undo step named `text`. Consecutive steps with the same `merge` are one."""
        if after != self.patch:
            self.stack.push(self._step(self.slot, self.patch, after, text, merge))

    def edit_other(self, before: Patch, after: Patch, text: str) -> None:
        """Do the same in the other slot. Its undo history is kept if `before` is its patch, else cleared."""
        other = other_slot(self.slot)
        if before != self._patches[other]:
            self._patches[other] = before
            self._stacks[other].clear()
        if after != self._patches[other]:
            self._stacks[other].push(self._step(other, before, after, text))

    # --- across restarts ---

    def save_history(self, path: Path) -> None:
        """Write the undo history of the edited slot to a file."""
        latest, done = latest_steps(self.stack)
        steps = [{"words": step.text(), "before": step.before, "after": step.after} for step in latest]
        write_file(path, msgspec.json.encode({"format": "underfoot-undo", "at": done, "steps": steps}))

    def restore_history(self, path: Path, registry: Registry) -> None:
        """Restore the history that `save_history` wrote, if it leads to the open patch; delete the file.

        A history that cannot be read is discarded, because it contains no work itself.
        """
        if not path.exists():
            return

        def read(patch: object) -> Patch:
            return Patch.loads(msgspec.json.encode(patch), registry)

        try:
            text = read_file(path)
            path.unlink()
            kept = msgspec.json.decode(text)
            steps = [
                self._step(self.slot, read(step["before"]), read(step["after"]), str(step["words"]))
                for step in kept["steps"]
            ]
            done = int(kept["at"])
        except (UnderfootError, OSError, msgspec.DecodeError, LookupError, TypeError, ValueError):
            return
        restore_steps(self.stack, steps, done, self.patch)

    def _step(self, slot: str, before: Patch, after: Patch, text: str, merge: str = "") -> UndoStep[Patch]:
        return UndoStep(text, before, after, partial(self._set_patch, slot), merge)

    def _set_patch(self, slot: str, patch: Patch) -> None:
        before, self._patches[slot] = self._patches[slot], patch
        if slot != self.slot:
            self.other_changed.emit(patch)
            return
        self.changed.emit(before, patch)
        self.edited.emit(before, patch)
