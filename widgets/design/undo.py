"""The document that is being edited: one patch, and the patches it was before."""

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from underfoot.patch.patch import Patch

LIMIT = 500
"""Edits that can be taken back. Patches share what did not change, so each costs little."""


class Document(QObject):
    """Holds the patch. Whoever edits it hands over the next patch; whoever shows it listens to `changed`."""

    changed = Signal(object)
    """The patch, after every edit, undo, redo and load."""

    def __init__(self, patch: Patch, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._patch = patch
        self.stack = QUndoStack(self)
        self.stack.setUndoLimit(LIMIT)

    @property
    def patch(self) -> Patch:
        return self._patch

    def load(self, patch: Patch) -> None:
        """Begin anew with another patch; there is nothing to undo."""
        self._patch = patch
        self.stack.clear()
        self.changed.emit(patch)

    def edit(self, after: Patch, text: str, merge: str = "") -> None:
        """Go on to `after` as one step of undo, called `text`. Steps in a row with the same `merge` become one."""
        if after != self._patch:
            self.stack.push(_Edit(self, after, text, merge))

    def _take(self, patch: Patch) -> None:
        self._patch = patch
        self.changed.emit(patch)


class _Edit(QUndoCommand):
    def __init__(self, document: Document, after: Patch, text: str, merge: str) -> None:
        super().__init__(text)
        self._document = document
        self._before = document.patch
        self._after = after
        self._merge = merge

    def undo(self) -> None:
        self._document._take(self._before)

    def redo(self) -> None:
        self._document._take(self._after)

    def id(self) -> int:
        return 1 if self._merge else -1

    def mergeWith(self, other: QUndoCommand) -> bool:
        if not isinstance(other, _Edit) or other._merge != self._merge:
            return False
        self._after = other._after
        self.setObsolete(self._after == self._before)
        return True
