"""Step of an undo history: the state before and after it. Consecutive steps of one kind, such as letters, are one."""

from typing import Generic, TypeVar

from PySide6.QtGui import QUndoCommand

State = TypeVar("State")


class UndoStep(QUndoCommand, Generic[State]):
    """An edit named `text`; `undo` and `redo` are its subclass's. Steps with the same `merge` are one, "" with none."""

    def __init__(self, text: str, before: State, after: State, merge: str) -> None:
        super().__init__(text)
        self.before, self.after = before, after
        self._merge = merge

    def id(self) -> int:
        return 1 if self._merge else -1

    def mergeWith(self, other: QUndoCommand) -> bool:
        if not isinstance(other, UndoStep) or other._merge != self._merge:
            return False
        self.after = other.after
        self.setObsolete(self.after == self.before)
        return True
