"""What tables that are only read have in common."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QAbstractItemView, QTableView


def make_read_only(table: QTableView) -> None:
    """Take what is for editing out of a table: grid, typing, numbers of rows, marked headings; Tab leaves it."""
    table.setShowGrid(False)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setTabKeyNavigation(False)
    table.verticalHeader().hide()
    table.horizontalHeader().setHighlightSections(False)


def takes_table_key(event: QKeyEvent, copy: Callable[[], object]) -> bool:
    """Take a key that means the same in each table: one copies; Space is left to the window, where it plays or stops.

    Return whether it was one of these.
    """
    if event.matches(QKeySequence.StandardKey.Copy):
        copy()
    elif event.key() == Qt.Key.Key_Space:
        event.ignore()
    else:
        return False
    return True
