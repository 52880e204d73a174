"""Undo histories: steps between two states, kept across a restart. Consecutive steps, such as letters, can be one."""

from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar, cast

from PySide6.QtGui import QUndoCommand, QUndoStack

State = TypeVar("State")

MAX_STEPS = 500
"""Edits that can be taken back. States share what did not change, or are short texts: each costs little."""
MAX_SAVED_STEPS = 50
"""Edits that can be taken back after a new start, and done again: on the disk, each costs two states."""


class UndoStep(QUndoCommand, Generic[State]):
    """An edit named `text`; `show` shows a state. Steps with the same `merge` are one, "" with none."""

    def __init__(
        self, text: str, before: State, after: State, show: Callable[[State], object], merge: str = ""
    ) -> None:
        super().__init__(text)
        self.before, self.after, self.show = before, after, show
        self._merge = merge

    def undo(self) -> None:
        self.show(self.before)

    def redo(self) -> None:
        self.show(self.after)

    def id(self) -> int:
        return 1 if self._merge else -1

    def mergeWith(self, other: QUndoCommand) -> bool:
        if not isinstance(other, UndoStep) or other._merge != self._merge:
            return False
        self.after = other.after
        self.setObsolete(self.after == self.before)
        return True


def latest_steps(stack: QUndoStack) -> tuple[list[UndoStep[Any]], int]:
    """Return the steps that are kept for the next start, and how many of them are done."""
    index = stack.index()
    first, end = max(index - MAX_SAVED_STEPS, 0), min(index + MAX_SAVED_STEPS, stack.count())
    return [cast(UndoStep[Any], stack.command(k)) for k in range(first, end)], index - first


def restore_steps(stack: QUndoStack, steps: Sequence[UndoStep[State]], done: int, now: State) -> None:
    """Restore steps of which so many are done, if they lead to the present state; no state is shown.

    Others are discarded, because they contain no work.
    """
    if not steps or not 0 <= done <= len(steps) or (steps[done - 1].after if done else steps[0].before) != now:
        return
    shows = [step.show for step in steps]
    for step in steps:
        step.show = _show_nothing
        stack.push(step)
    stack.setIndex(done)
    for step, show in zip(steps, shows, strict=True):
        step.show = show


def _show_nothing(_: object) -> None:
    """Do nothing: the state is there."""
