"""The page before a calibration: its purpose, the profile's present and earlier state, and the start buttons."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from underfoot.calibration.results.labels import unit_of
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Part
from underfoot.parameters import Parameter
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.calibrate.page_view import FORM_PX
from underfoot.widgets.calibrate.part_drawings import drawings_of
from underfoot.widgets.calibrate.quantity_views import QuantityTable
from underfoot.widgets.calibrate.tile_picture import TilePicture
from underfoot.widgets.controls.fields import Field, ParameterEditor
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.controls.scrolled import scroll_in
from underfoot.widgets.controls.tab_order import set_tab_order
from underfoot.widgets.plots.drawing_column import DrawingColumn


class Overview(QWidget):
    """Shows one procedure and the matching part of a tile's profile; signals when to begin."""

    begin_requested = Signal(bool)
    """Begin; whether to run automatically."""
    reference_given = Signal(object)
    """The reference that was entered."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.title = theme.label("", "title")
        self.about = theme.label("")
        self.verdict = theme.label("", "muted")
        self.note = theme.label("", "force")
        theme.wrap(self.title, self.about, self.verdict, self.note)
        self.begin = QPushButton("Begin")
        self.begin.setProperty("role", "primary")
        self.begin.setToolTip("Go through it page by page (Return)")
        self.begin_automatic = QPushButton("Run automatically")
        self.begin_automatic.setToolTip("The simulator presses, page after page; it can be paused and stopped")
        self.begin_automatic.setIcon(theme.icon("fast-forward"))
        self.reference = QVBoxLayout()
        self.reference_help = theme.paragraph("", "small")
        self.reference_help.setMaximumWidth(FORM_PX)
        self.editor: ParameterEditor | None = None
        self.table = QuantityTable("Figures of the calibration in use")
        self.drawings = DrawingColumn()
        scroll_in(self, body := QWidget())  # from the outside in: another parent has all within it looked up again
        layout = QHBoxLayout(body)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        left = QWidget()
        layout.addWidget(left, 1)
        buttons = QHBoxLayout()
        buttons.setSpacing(theme.GRID)
        for button in (self.begin, self.begin_automatic):
            button.ensurePolished()
            button.setMinimumWidth(max(15 * theme.GRID, button.sizeHint().width()))
            buttons.addWidget(button)
        buttons.addStretch(1)
        column = QVBoxLayout(left)
        column.setContentsMargins(3 * theme.GRID, 2 * theme.GRID, 2 * theme.GRID, 2 * theme.GRID)
        column.setSpacing(theme.GRID)
        column.addWidget(self.title)
        column.addWidget(self.about)
        column.addLayout(self.reference)
        column.addWidget(self.reference_help)
        column.addSpacing(theme.GRID)
        column.addLayout(buttons)
        column.addWidget(self.note)
        column.addSpacing(theme.GRID)
        column.addWidget(theme.label("IN USE", "heading"))
        column.addWidget(self.verdict)
        column.addWidget(self.table, 1)
        self.picture = TilePicture()
        column.addWidget(self.picture, 2)
        layout.addWidget(self.drawings, 1)
        self.begin.clicked.connect(lambda: self.begin_requested.emit(False))
        self.begin_automatic.clicked.connect(lambda: self.begin_requested.emit(True))

    def show_kind(self, title: str, about: str) -> None:
        """Show a procedure."""
        self.title.setText(title)
        self.about.setText(about)

    def show_reference(self, parameter: Parameter | None, value: str) -> None:
        """Ask for the reference; None asks nothing."""
        if self.editor is not None and self.editor.parameter is not parameter:
            self.reference.removeWidget(self.editor)
            self.editor.hide()
            self.editor.deleteLater()
            self.editor = None
        if parameter is not None and self.editor is None:
            self.editor = editor_for(parameter)
            self.editor.setMaximumWidth(FORM_PX)
            self.editor.value_changed.connect(self.reference_given)
            self.reference.addWidget(self.editor)
            set_tab_order([*self.editor.findChildren(Field), self.begin, self.begin_automatic, self.table])
        if self.editor is not None:
            self.editor.set_value(value)
        self.reference_help.setText("" if parameter is None else parameter.doc)
        self.reference_help.setVisible(parameter is not None)

    def show_availability(self, why_not: str, *, can_run_automatically: bool) -> None:
        """Show whether it can begin, or `why_not`, and whether it can run automatically."""
        self.begin.setEnabled(not why_not)
        self.begin_automatic.setVisible(can_run_automatically)
        self.begin_automatic.setEnabled(not why_not)
        self.note.setText(why_not)
        self.note.setVisible(bool(why_not))

    def show_part(self, tile: Tile, part: Part | None, earlier: Part | None = None) -> None:
        """Show the part of the profile, and an `earlier` one to compare with."""
        self.verdict.setText(
            pretty_text(part.verdict or f"Calibrated on {part.made}.") if part is not None else "Not calibrated yet."
        )
        theme.set_role(self.verdict, "muted" if part is None else "good" if part.good else "alarm")
        self.table.setVisible(part is not None or earlier is not None)
        self.picture.setVisible(part is None and earlier is None)
        self.picture.set_tile(tile)
        now, then = ({} if one is None else one.measured for one in (part, earlier))
        shown = part or earlier
        unit = "" if shown is None else shown.error_unit
        quantities = [(name, now.get(name, float("nan")), unit_of(name, unit)) for name in {**now, **then}]
        self.table.show_quantities(
            quantities,
            "in use" if part is None else part.made,
            then if earlier is not None else None,
            "" if earlier is None else earlier.made,
        )
        self.drawings.show_drawings(drawings_of(tile, part, earlier), "Measurements are drawn here.")

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            (self.begin_automatic if self.begin_automatic.hasFocus() else self.begin).click()
        else:
            super().keyPressEvent(event)
