"""The undo history of a draft: the states of its document, of which editors change the present one in place."""

import json
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from underfoot.experiments.draft_edits import DraftEdit, edit_between

MAX_STEPS = 500
"""Edits that can be taken back; each costs two texts of a few kilobytes."""


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

    def show_state(self, text: str, edit: DraftEdit) -> None:
        """Restore a state, unless it is the present one, as it is when a step is recorded."""
        if text != self._now:
            self._now = text
            self.restored.emit(json.loads(text), edit)


class _Step(QUndoCommand):
    def __init__(self, history: DraftHistory, before: str, after: str, edit: DraftEdit) -> None:
        super().__init__(edit.name)
        self._history, self._before, self._after, self._edit = history, before, after, edit

    def undo(self) -> None:
        self._history.show_state(self._before, self._edit)

    def redo(self) -> None:
        self._history.show_state(self._after, self._edit)

    def id(self) -> int:
        return 1 if self._edit.merge else -1

    def mergeWith(self, other: QUndoCommand) -> bool:
        if not isinstance(other, _Step) or other._edit.merge != self._edit.merge:
            return False
        self._after = other._after
        self.setObsolete(self._after == self._before)
        return True
