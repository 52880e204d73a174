"""Controls of list parameters: rows of a table, and tiles."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QTableWidget,
    QTableWidgetItem,
    QToolButton,
    QWidget,
)

from underfoot.errors import BadValue, require
from underfoot.number_parsing import parse_quantity
from underfoot.parameters import Rows, Tiles
from underfoot.quantities import number, pretty_unit
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import Field, ParameterEditor

ROW_PX, HEADING_PX = 24, 36
MAX_ROWS_SHOWN = 8
"""Rows of a table that are seen at once."""


class RowsEditor(ParameterEditor):
    """Rows of numbers as a table; the last, empty row adds one."""

    TABLE_ROW = 1
    """The table's row in the grid; subclasses put a picture above it."""

    def __init__(self, parameter: Rows) -> None:
        super().__init__(parameter)
        self._columns, self._max_rows = parameter.columns, parameter.most
        self.table = QTableWidget(0, len(parameter.columns), self)
        self.table.setHorizontalHeaderLabels([heading(name) for name, _, _ in parameter.columns])
        head = self.table.horizontalHeader()
        head.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft)
        head.setStyleSheet(f"QHeaderView::section {{ font-size: {theme.SMALL_PX}px; padding: 2px 0 2px 3px; }}")
        head.setFixedHeight(HEADING_PX)
        head.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        head.setHighlightSections(False)  # bold, "frequency" has no room
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.table.setTabKeyNavigation(False)
        self._place_control(self.table)
        self.grid.addWidget(self.table, self.TABLE_ROW, 0, 1, 3)
        line = QHBoxLayout()
        self.add_button = self._button("+", "Add a row", self._add)
        self.remove_button = self._button("−", "Remove the row", self._remove)
        line.addWidget(self.add_button)
        line.addWidget(self.remove_button)
        line.addStretch()
        self.grid.addLayout(line, self.TABLE_ROW + 1, 0, 1, 3)
        self.table.itemChanged.connect(self._typed)
        self.set_value(parameter.default)

    def _button(self, text: str, tip: str, do: Callable[[], None]) -> QToolButton:
        button = QToolButton(self)
        button.setText(text)
        button.setToolTip(tip)
        button.setAccessibleName(tip)
        button.setFixedWidth(32)
        button.clicked.connect(do)
        return button

    def _show(self) -> None:
        with QSignalBlocker(self.table):
            self.table.setRowCount(len(self._value))
            for i, row in enumerate(self._value):
                for j, item in enumerate(row):
                    self.table.setItem(i, j, QTableWidgetItem(f"{item:.6g}"))
        rows = min(max(len(self._value), 1), MAX_ROWS_SHOWN)
        self.table.setFixedHeight(HEADING_PX + rows * ROW_PX + 2)

    def _typed(self, item: QTableWidgetItem) -> None:
        rows = [list(row) for row in self._value]
        name, low, high = self._columns[item.column()]
        try:
            value = parse_quantity(item.text(), _name_and_unit(name)[1])
            require(low <= value <= high, name, item.text(), f"{number(low)} to {number(high)}")
            rows[item.row()][item.column()] = value
            self.edit_began.emit()
            self._commit(rows)
        except BadValue as error:
            self.refused.emit(str(error))
        self._show()

    def _add(self) -> None:
        new = self._value[-1] if self._value else tuple(low for _, low, _ in self._columns)
        if len(self._value) < self._max_rows:
            self.edit_began.emit()
            self._commit([*self._value, new])
            self._show()

    def _remove(self) -> None:
        row = self.table.currentRow()
        if 0 <= row < len(self._value):
            self.edit_began.emit()
            self._commit([*self._value[:row], *self._value[row + 1 :]])
            self._show()


def heading(name: str) -> str:
    """Return a column's name with its unit on a second line.

    >>> heading("decay 1/s"), heading("attack")
    ('decay\\n1/s', 'attack\\n')
    """
    what, unit = _name_and_unit(name)
    return f"{what}\n{pretty_unit(unit)}"


def _name_and_unit(column: str) -> tuple[str, str]:
    what, _, unit = column.replace("_", " ").rpartition(" ")
    return (what, unit) if what else (column, "")


class TilesEditor(ParameterEditor):
    """A choice of tiles: a button for all, and one for each known tile."""

    MAX_BUTTONS, ROOM_PX = 16, 252

    def __init__(self, parameter: Tiles) -> None:
        super().__init__(parameter)
        self._tile_ids: tuple[str, ...] = ()
        self.buttons: dict[str, QToolButton] = {}
        self.field = Field(self, role="")
        self.field.committed.connect(self._typed)
        self.field.focus_lost.connect(self._show_valid)
        self._holder = QWidget(self)
        self._cells = QGridLayout(self._holder)
        self._cells.setContentsMargins(0, 4, 0, 0)
        self._cells.setSpacing(4)
        self._place_control(self._holder)
        self.grid.addWidget(self.field, 2, 0, 1, 3)
        self.set_tiles(())
        self.set_value(parameter.default)

    def set_tiles(self, ids: Sequence[str]) -> None:
        """Offer these tiles; for many, or none, offer a text field instead."""
        self._tile_ids = tuple(ids)
        for button in self.buttons.values():
            button.deleteLater()
        self.buttons = {}
        few = 0 < len(ids) <= self.MAX_BUTTONS
        for id in ("all", *ids) if few else ():
            self.buttons[id] = button = QToolButton(self._holder)
            button.setText(id)
            name = "All tiles" if id == "all" else f"Tile {id}"
            button.setAccessibleName(name)
            button.setToolTip(name)
            button.setCheckable(True)
            button.setMinimumWidth(44)
            button.clicked.connect(lambda on, id=id: self._toggled(id, on))
        widest = max((button.sizeHint().width() for button in self.buttons.values()), default=1)
        across = max(self.ROOM_PX // (widest + self._cells.spacing()), 1)
        for i, button in enumerate(self.buttons.values()):
            self._cells.addWidget(button, i // across, i % across)
        self._holder.setVisible(few)
        self.field.setVisible(not few)
        self._show()

    def _show(self) -> None:
        self.field.setText(self._value)
        for id, button in self.buttons.items():
            button.setChecked(id == self._value or (id != "all" and id in self._value.split("+")))

    def _toggled(self, id: str, on: bool) -> None:
        chosen = set(self._value.split("+")) - {"all"}
        chosen = set() if id == "all" else (chosen | {id} if on else chosen - {id})
        self.edit_began.emit()
        self._commit("+".join(tile for tile in self._tile_ids if tile in chosen) or "all")
        self._show()

    def _typed(self, text: str) -> None:
        try:
            self.edit_began.emit()
            self._commit(text.replace(" ", ""))
        except BadValue as error:
            self.field.show_error(self._refusal(error))
            return
        self._show_valid()

    def _show_valid(self) -> None:
        self.field.show_error("")
        self._show()
