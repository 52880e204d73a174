"""A list of items with a form beside it; buttons and keys add, copy, move and remove items."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QApplication,
    QGridLayout,
    QHBoxLayout,
    QListWidget,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.scrolled import scroll_area

LIST_PX = 28 * theme.GRID


class ItemList(QWidget):
    """Names in order, one of them selected; the owner of the items performs the requested edits, which are possible."""

    chosen = Signal(int)
    changed = Signal()
    """The items were edited."""
    add_requested = Signal()
    copy_requested = Signal(int)
    remove_requested = Signal(int)
    move_requested = Signal(int, int)
    """Carries the index, and the shift (-1 or 1)."""

    def __init__(self, what: str, several: str) -> None:
        """`what` is the name of an item, and `several` that of all."""
        super().__init__()
        self.list = QListWidget()
        self.list.setAccessibleName(several)
        self.list.setMinimumHeight(8 * theme.GRID)
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.add, self.copy, self.remove, self.up, self.down = (
            QPushButton("Add"),
            QPushButton("Copy"),
            QPushButton("Remove"),
            QPushButton("Up"),
            QPushButton("Down"),
        )
        self.buttons = buttons = QGridLayout()
        buttons.setSpacing(theme.GRID // 2)
        for index, (button, key, says) in enumerate(
            (
                (self.add, "Ins", f"Add a {what}"),
                (self.copy, "Ctrl+D", f"Copy the {what}"),
                (self.remove, "Del", f"Remove the {what}"),
                (self.up, "Alt+Up", f"Move the {what} up"),
                (self.down, "Alt+Down", f"Move the {what} down"),
            )
        ):
            button.setToolTip(with_native_keys(f"{says} ({key})"))
            button.setAccessibleName(says)
            shortcut = QShortcut(QKeySequence(key), self.list)
            shortcut.setContext(Qt.ShortcutContext.WidgetShortcut)
            shortcut.activated.connect(button.click)
            buttons.addWidget(button, index // 3, index % 3)
        self.detail = scroll_area()
        self.detail.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        left = QVBoxLayout()
        left.addWidget(self.list, 1)
        left.addLayout(buttons)
        side = QWidget()
        side.setFixedWidth(LIST_PX)
        side.setLayout(left)
        left.setContentsMargins(0, 0, 0, 0)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(2 * theme.GRID)
        row.addWidget(side)
        row.addWidget(self.detail, 1)
        self.setFocusProxy(self.list)
        self.chosen.connect(self._show_form)
        self.list.currentRowChanged.connect(self.chosen)
        self.add.clicked.connect(self.add_requested)
        self.copy.clicked.connect(lambda: self.copy_requested.emit(self.list.currentRow()))
        self.remove.clicked.connect(lambda: self.remove_requested.emit(self.list.currentRow()))
        self.up.clicked.connect(lambda: self._ask_to_move(-1))
        self.down.clicked.connect(lambda: self._ask_to_move(1))

    def names(self) -> Sequence[str]:
        """Return the names of all items, in order: each owner's."""
        raise AssertionError(f"{type(self).__name__} has no items")

    def show_names(self, chosen: int) -> None:
        """Show the names of all items and select one, without a signal: its form is built by `refresh`."""
        names = self.names()
        with QSignalBlocker(self.list):
            self.list.clear()
            self.list.addItems(names)
            self.list.setCurrentRow(min(max(chosen, 0), len(names) - 1))
        for button in (self.copy, self.remove, self.up, self.down):
            button.setEnabled(bool(names))

    def refresh(self) -> None:
        """Build the form of the selected item anew."""
        self._show_form(self.list.currentRow())

    def rename(self, index: int, name: str) -> None:
        """Change the name at an index."""
        item = self.list.item(index)
        if item is not None:
            item.setText(name)

    def rebuild_detail(self, show: Callable[[], None]) -> None:
        """Rebuild the form of the same item with `show`; focus and scroll position are kept."""
        focus, scrolled = QApplication.focusWidget(), self.detail.verticalScrollBar().value()
        name = focus.accessibleName() if focus is not None and self.detail.isAncestorOf(focus) else ""
        show()
        form = self.detail.widget()
        if form is None:
            return
        again = next((one for one in form.findChildren(QWidget) if name and one.accessibleName() == name), None)
        if again is not None:
            again.setFocus()
        form.adjustSize()
        self.detail.verticalScrollBar().setValue(scrolled)

    def show_detail(self, form: QWidget) -> None:
        """Show the form of the selected item."""
        theme.fill(form, "ground")
        old = self.detail.takeWidget()
        if old is not None:
            old.hide()
            old.deleteLater()
        self.detail.setWidget(form)

    def _show_form(self, index: int) -> None:
        """Build the form of an item, and show it: each owner's."""
        raise AssertionError(f"{type(self).__name__} has no forms")

    def _show_edited(self, chosen: int) -> None:
        self.show_names(chosen)
        self.refresh()
        self.changed.emit()

    def _ask_to_move(self, by: int) -> None:
        index = self.list.currentRow()
        if 0 <= index + by < self.list.count():
            self.move_requested.emit(index, by)
