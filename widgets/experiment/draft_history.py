"""The undo history of a draft: the states of its document, of which editors change the present one in place."""

import json
from functools import partial
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoStack

from underfoot.experiments.draft_edits import DraftEdit, edit_between
from underfoot.widgets.controls.undo_step import MAX_STEPS, UndoStep, latest_steps, restore_steps


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
            self._now = after
            self.stack.push(self._step(before, after, can_grow=True))

    # --- across restarts ---

    def saved(self) -> dict[str, Any]:
        """Return the latest steps as JSON values, for `restore`."""
        steps, done = latest_steps(self.stack)
        return {"at": done, "steps": [(step.before, step.after) for step in steps]}

    def restore(self, saved: object) -> None:
        """Restore steps, if they lead to the present state; others are discarded, because they contain no work."""
        if not isinstance(saved, dict):
            return
        try:
            steps = [self._step(str(before), str(after), can_grow=False) for before, after in saved["steps"]]
            done = int(saved["at"])
        except (LookupError, TypeError, ValueError, AttributeError):
            return
        restore_steps(self.stack, steps, done, self._now)

    def _step(self, before: str, after: str, *, can_grow: bool) -> UndoStep[str]:
        edit = edit_between(json.loads(before), json.loads(after))
        return UndoStep(edit.name, before, after, partial(self._show, edit), edit.merge if can_grow else "")

    def _show(self, edit: DraftEdit, text: str) -> None:
        """Restore a state, unless it is the present one, as it is when a step is recorded."""
        if text != self._now:
            self._now = text
            self.restored.emit(json.loads(text), edit)
