"""The undo history of a draft: the states of its document, of which editors change the present one in place."""

import json
from typing import Any

from PySide6.QtCore import QObject, QSignalBlocker, Signal
from PySide6.QtGui import QUndoStack

from underfoot.experiments.draft_edits import DraftEdit, edit_between
from underfoot.widgets.controls.undo_step import UndoStep

MAX_STEPS, MAX_SAVED_STEPS = 500, 50
"""Edits that can be taken back, now and after a new start; each costs two texts of a few kilobytes."""


class DraftHistory(QObject):
    """Records a draft after each edit, and gives back an earlier state on undo."""

    restored = Signal(object, object)
    """The document of an earlier or later state, and the `DraftEdit` by which it differs from the one before."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.stack = QUndoStack(self)
        self.stack.setUndoLimit(MAX_STEPS)
        self._now = "{}"

    def begin(self, raw: dict[str, Any]) -> None:
        """Begin with this document, and no step to take back."""
        self.stack.clear()
        self.settle(raw)

    def settle(self, raw: dict[str, Any]) -> None:
        """Take what a form completed when it was built as no edit."""
        self._now = json.dumps(raw)

    def record(self, raw: dict[str, Any]) -> None:
        """Record the document after an edit; letters that are typed into one field are one step."""
        before, after = self._now, json.dumps(raw)
        if after != before:
            edit = edit_between(json.loads(before), json.loads(after))
            self._now = after
            self.stack.push(_Step(self, before, after, edit))

    # --- across restarts ---

    def saved(self) -> dict[str, Any]:
        """Return the latest steps as JSON values, for `restore`."""
        index, count = self.stack.index(), self.stack.count()
        first = max(index - MAX_SAVED_STEPS, 0)
        steps = [self.stack.command(k) for k in range(first, min(index + MAX_SAVED_STEPS, count))]
        return {"at": index - first, "steps": [(step.before, step.after) for step in steps if isinstance(step, _Step)]}

    def restore(self, saved: object) -> None:
        """Restore steps, if they lead to the present state; others are discarded, because they contain no work."""
        now = self._now
        if not isinstance(saved, dict):
            return
        try:
            at, steps = int(saved["at"]), [(str(before), str(after)) for before, after in saved["steps"]]
            edits = [edit_between(json.loads(before), json.loads(after)) for before, after in steps]
            leads_here = (steps[at - 1][1] if at else steps[0][0]) == now
        except (LookupError, TypeError, ValueError, AttributeError):
            return
        if not leads_here:
            return
        with QSignalBlocker(self):
            for (before, after), edit in zip(steps, edits, strict=True):
                self._now = after
                self.stack.push(_Step(self, before, after, edit, can_grow=False))
            self.stack.setIndex(at)
        self._now = now

    def show_state(self, text: str, edit: DraftEdit) -> None:
        """Restore a state, unless it is the present one, as it is when a step is recorded."""
        if text != self._now:
            self._now = text
            self.restored.emit(json.loads(text), edit)


class _Step(UndoStep[str]):
    def __init__(
        self, history: DraftHistory, before: str, after: str, edit: DraftEdit, *, can_grow: bool = True
    ) -> None:
        super().__init__(edit.name, before, after, edit.merge if can_grow else "")
        self._history, self._edit = history, edit

    def undo(self) -> None:
        self._history.show_state(self.before, self._edit)

    def redo(self) -> None:
        self._history.show_state(self.after, self._edit)
