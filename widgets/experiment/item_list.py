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
from underfoot.widgets.controls.scrolled import Pages

LIST_PX = 28 * theme.GRID


class ItemList(QWidget):
    """Names in order, one of them selected; buttons and keys do what is possible with it."""

    chosen = Signal(int)
    changed = Signal()
    """The items were edited."""

    def __init__(
        self,
        what: str,
        several: str,
        add: Callable[[], object],
        copy: Callable[[int], object],
        remove: Callable[[int], object],
        move: Callable[[int, int], object],
    ) -> None:
        """`what` is the name of an item, and `several` that of all; `move` takes an index, and the shift (-1 or 1)."""
        super().__init__()
        self.list = QListWidget()
        self.list.setAccessibleName(several)
        self.list.setMinimumHeight(8 * theme.GRID)
        self.list.setWordWrap(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

        def move_by(shift: int) -> None:
            if 0 <= self.list.currentRow() + shift < self.list.count():
                move(self.list.currentRow(), shift)

        self.buttons = QGridLayout()
        self.buttons.setSpacing(theme.GRID // 2)
        self.add = self._button("Add", "Ins", f"Add a {what}", add)
        self.copy = self._button("Copy", "Ctrl+D", f"Copy the {what}", lambda: copy(self.list.currentRow()))
        self.remove = self._button("Remove", "Del", f"Remove the {what}", lambda: remove(self.list.currentRow()))
        self.up = self._button("Up", "Alt+Up", f"Move the {what} up", lambda: move_by(-1))
        self.down = self._button("Down", "Alt+Down", f"Move the {what} down", lambda: move_by(1))
        self.detail = Pages()
        self.detail.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        left = QVBoxLayout()
        left.addWidget(self.list, 1)
        left.addLayout(self.buttons)
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

    def _button(self, text: str, key: str, says: str, do: Callable[[], object]) -> QPushButton:
        button = QPushButton(text)
        button.setToolTip(with_native_keys(f"{says} ({key})"))
        button.setAccessibleName(says)
        button.clicked.connect(lambda _: do())
        shortcut = QShortcut(QKeySequence(key), self.list)
        shortcut.setContext(Qt.ShortcutContext.WidgetShortcut)
        shortcut.activated.connect(button.click)
        at = self.buttons.count()
        self.buttons.addWidget(button, at // 3, at % 3)
        return button

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
        form = self.detail.page
        again = next((one for one in form.findChildren(QWidget) if name and one.accessibleName() == name), None)
        if again is not None:
            again.setFocus()
        self.detail.inside.adjustSize()
        self.detail.verticalScrollBar().setValue(scrolled)

    def show_detail(self, form: QWidget) -> None:
        """Show the form of the selected item."""
        theme.fill(form, "ground")
        self.detail.show_page(form)

    def _show_form(self, index: int) -> None:
        """Build the form of an item, and show it: each owner's."""
        raise AssertionError(f"{type(self).__name__} has no forms")

    def _show_edited(self, chosen: int) -> None:
        self.show_names(chosen)
        self.refresh()
        self.changed.emit()
