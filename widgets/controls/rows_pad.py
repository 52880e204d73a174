"""A picture with a handle for each of some rows of numbers, and the editor that has it above their table."""

from collections.abc import Sequence

from underfoot.parameters import Rows
from underfoot.widgets.controls.handle_pad import HandlePad
from underfoot.widgets.controls.list_editors import RowsEditor

Row = tuple[float, ...]


class RowsPad(HandlePad):
    """Rows as handles. Subclasses place, drag and add them."""

    def __init__(self, parameter: Rows) -> None:
        super().__init__()
        self._columns, self._max_rows = parameter.columns, parameter.most
        self._rows: list[Row] = []

    def rows(self) -> list[Row]:
        return list(self._rows)

    def set_rows(self, rows: Sequence[Row]) -> None:
        """Show these rows, without emitting a change."""
        self._rows = list(rows)
        self.chosen = min(self.chosen, len(self._rows) - 1)
        self.update()

    def remove(self, index: int) -> None:
        del self._rows[index]
        self.emit_changed()

    def replace(self, index: int, row: Row) -> None:
        """Change a row, and emit that if it is another."""
        if row != self._rows[index]:
            self._rows[index] = row
            self.emit_changed()


class RowsPadEditor(RowsEditor):
    """The picture above the table of the same rows."""

    TABLE_ROW = 2

    def __init__(self, parameter: Rows, pad: RowsPad, tip: str) -> None:
        self.pad = pad
        super().__init__(parameter)
        self.pad.setParent(self)
        self.pad.setToolTip(tip)
        self.grid.addWidget(self.pad, 1, 0, 1, 3)
        self.pad.edit_began.connect(self.edit_began)
        self.pad.changed.connect(self._drawn)

    def _drawn(self) -> None:
        self._commit(self.pad.rows())
        super()._show()

    def _show(self) -> None:
        super()._show()
        self.pad.set_rows(self._value)
