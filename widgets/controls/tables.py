"""What tables that are only read have in common."""

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction, QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QAbstractItemView, QTableView, QTreeView

from underfoot.widgets import theme
from underfoot.widgets.controls.menu import Menu, add_action


def make_read_only(table: QTableView) -> None:
    """Take what is for editing out of a table: grid, typing, numbers of rows, marked headings; Tab leaves it."""
    theme.set_role(table.horizontalHeader(), "read")
    table.setShowGrid(False)
    table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    table.setTabKeyNavigation(False)
    table.verticalHeader().hide()
    table.horizontalHeader().setHighlightSections(False)


def leaves_space(event: QKeyEvent) -> bool:
    """Leave Space to the window, where it plays or stops; return whether it was that."""
    if event.key() != Qt.Key.Key_Space:
        return False
    event.ignore()
    return True


def copy_action(table: QAbstractItemView, copy: Callable[[], object]) -> QAction:
    """Return an action that copies from a table by its key, which Qt would take for the current cell alone."""
    return add_action(table, "Copy", QKeySequence.StandardKey.Copy, copy)


def offer_copy(table: QTableView | QTreeView, text: Callable[[], str] | None = None) -> None:
    """Copy `text`, or else what the table shows, by key and in its context menu."""
    text = text or partial(shown_text, table)
    action = copy_action(table, lambda: QGuiApplication.clipboard().setText(text()))

    def ask(at: QPoint) -> None:
        menu = Menu(table)
        menu.addAction(action)
        menu.open_once(table.viewport().mapToGlobal(at))

    table.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
    table.customContextMenuRequested.connect(ask)


def shown_text(table: QTableView | QTreeView) -> str:
    """Return the headings and the selected rows, or all, with tabs between columns as a spreadsheet takes them.

    It reads numbers neither with a minus sign nor with narrow spaces between thousands.
    """
    model, across = table.model(), Qt.Orientation.Horizontal
    columns = [column for column in range(model.columnCount()) if not table.isColumnHidden(column)]
    rows = sorted({index.row() for index in table.selectionModel().selectedRows()}) or range(model.rowCount())
    lines = [[model.headerData(column, across) for column in columns]]
    lines += [[model.index(row, column).data() for column in columns] for row in rows]
    plain = str.maketrans({"−": "-", "\u202f": None, "\n": " ", "\t": " "})
    return "\n".join("\t".join(str(cell or "").translate(plain) for cell in line) for line in lines)
