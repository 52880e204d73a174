"""A field over the canvas with the list that it searches."""

from PySide6.QtCore import QPoint, QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QListWidgetItem, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.design.named_list import NamedList
from underfoot.widgets.design.node_list import SearchField

_SIZE = QSize(248, 320)


class SearchPopup(QFrame):
    """Asks for a row of a list, by words or arrow keys. It closes by a choice, by Escape, or when the focus leaves."""

    chosen = Signal(str)
    """The id of the chosen row."""
    closed = Signal()

    list: NamedList

    def __init__(self, view: QWidget, shown: NamedList) -> None:
        super().__init__(view)
        self._view, self.list = view, shown
        self.setObjectName("search")
        self.setStyleSheet(
            f"#search {{ background: {theme.PANEL}; border: 1px solid {theme.LINE}; border-radius: 6px; }}"
            f"QListWidget {{ background: {theme.PANEL}; }}"
        )
        self.setFixedSize(_SIZE)
        self.field = SearchField("", self, closes=True)
        self.setFocusProxy(self.field)  # or a click in the list gives the focus to the canvas, which closes the list
        shown.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        shown.setDragEnabled(False)
        shown.itemClicked.connect(self._take)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.GRID, theme.GRID, theme.GRID, theme.GRID)
        column.setSpacing(theme.GRID)
        column.addWidget(self.field)
        column.addWidget(shown)
        self.field.textChanged.connect(shown.filter_by)
        self.field.textChanged.connect(self._fit)
        self.field.stepped.connect(shown.step)
        self.field.return_pressed.connect(self._take_current)
        self.field.escaped.connect(self.give_up)
        self.hide()

    def open_at(self, at: QPoint, hint: str) -> None:
        """Open at a point of the view, moved inside it if necessary; `hint` says what is asked for."""
        room = self._view.rect()
        x, y = room.width() - self.width() - 8, room.height() - self._most_height() - 8
        self.move(max(min(at.x(), x), 8), max(min(at.y(), y), 8))
        self.field.clear()
        self.field.setPlaceholderText(hint)
        self.field.setAccessibleName(hint)
        self.list.filter_by("")
        self.list.scrollToTop()  # not where it was left the last time
        self._fit()
        self.show()
        self.raise_()
        self.field.setFocus()

    def _most_height(self) -> int:
        return min(_SIZE.height(), self._view.height() - 16)

    def _fit(self) -> None:
        """Be as high as the rows, up to what there is room for: what is left of few covers little of the patch."""
        rows = min(self.list.count(), _SIZE.height() // theme.GRID)  # more have no room in any case
        high = sum(self.list.sizeHintForRow(row) for row in range(rows))
        around = 3 * theme.GRID + self.field.sizeHint().height() + 2 * self.frameWidth()
        self.setFixedHeight(min(around + high, self._most_height()))

    def give_up(self) -> None:
        """Close without a choice."""
        self._close("")

    def _take(self, clicked: QListWidgetItem) -> None:
        """Use the row that was clicked; a heading is none."""
        if id := clicked.data(Qt.ItemDataRole.UserRole):
            self._close(id)

    def _take_current(self) -> None:
        """Use the current row. Where there is none, before an arrow key or for words that no row has, the list stays: a
        wire that was drawn into the open would be lost.
        """
        if self.list.current():
            self._close(self.list.current())

    def _close(self, id: str) -> None:
        if self.isHidden():
            return
        self.hide()
        self.closed.emit()
        if id:
            self.chosen.emit(id)  # which may open another list
