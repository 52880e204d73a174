"""Asks for the rows and columns of a simulated floor."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QDialogButtonBox, QWidget

from underfoot.floor.layout import default_floor
from underfoot.parameters import Count, ask
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.fields import Field
from underfoot.widgets.controls.parameter_editor import editor_for

MOST_TILES = 144
"""The largest floor that the bench measures."""


class GridDialog(Dialog):
    """Begins with a present size, and shows how large the floor will be."""

    chosen = Signal(int, int)
    """Rows and columns."""

    def __init__(self, rows: int, columns: int, parent: QWidget | None = None) -> None:
        super().__init__("Simulated floor", parent)
        self.rows = editor_for(ask("rows", Count(rows, 1, 32, doc="along y")))
        self.columns = editor_for(ask("columns", Count(columns, 1, 32, doc="along x")))
        self.extent = theme.paragraph("", "muted")
        buttons = self.button_row(QDialogButtonBox.StandardButton.Cancel)
        self.use = buttons.addButton("Use", QDialogButtonBox.ButtonRole.AcceptRole)
        layout = self.column()
        for widget in (self.rows, self.columns, self.extent, buttons):
            layout.addWidget(widget)
        self.use.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves the field as it is, for `accept` to read
        self.use.setDefault(True)  # once it is in the dialog, or that takes a hidden button of an editor
        self.setMinimumWidth(40 * theme.GRID)
        for editor in (self.rows, self.columns):
            editor.value_changed.connect(lambda _: self._show_extent())
        self.accepted.connect(lambda: self.chosen.emit(self.rows.value(), self.columns.value()))
        self._show_extent()

    def accept(self) -> None:
        """Take what is typed, and close unless it is refused."""
        fields = self.findChildren(Field)
        for field in fields:
            field.commit()
        if self.use.isEnabled() and not any(field.property("reason") for field in fields):
            super().accept()

    def _show_extent(self) -> None:
        floor = default_floor(self.rows.value(), self.columns.value())
        count, (left, front, right, back) = len(floor.tiles), floor.bounds_m().ravel()
        self.use.setEnabled(count <= MOST_TILES)
        side_cm = 100.0 * floor.tiles[0].size_m[0]
        if count <= MOST_TILES:
            tail = f", {side_cm:.1f} cm square: {right - left:.3f} m along x, {back - front:.3f} m along y"
        else:
            tail = f"; allowed: up to {MOST_TILES}"
        self.extent.setText(counted(count, "tile") + tail)
