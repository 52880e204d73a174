"""The page that searches a plate for the chosen tile: requirements, matching plates, and their trade-off."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtWidgets import (
    QAbstractItemView,
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import BadValue
from underfoot.floor.layout import Tile
from underfoot.floor.plate_search import STIFFNESSES, PlateSearch, SearchResult, drawing, search, why_none, write
from underfoot.floor.tile_parameters import TileParameters
from underfoot.parameters import Choice, Number, declared_in
from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.controls.scrolled import scroll_in
from underfoot.widgets.controls.tables import make_read_only, offer_copy
from underfoot.widgets.plots.drawing_column import DrawingColumn

_COLUMNS = ("E\nGPa", "h\nmm", "mass\nkg", "sag\nmm", "f1\nHz", "dip\nHz")
_ABOUT = (
    "A grid over Young's modulus and thickness (section 4.4.2): which plates are light, hardly bend under the load at "
    "their middle, and have their first mode, edges held, above the band. The dip of the tile, with its shaker at the "
    "middle, is where its own band ends; it lies lower, and rises as the sag falls."
)


class _SearchParameters:
    """The requirements, in the units of the page."""

    least_modulus = Number(1.0, 0.01, 1000.0, unit="GPa", scale="log", label="Modulus from", doc="Least modulus.")
    most_modulus = Number(220.0, 0.01, 1000.0, unit="GPa", scale="log", label="to", doc="Largest modulus.")
    least_thickness = Number(5.0, 1.0, 200.0, unit="mm", scale="log", label="Thickness from", doc="The thinnest.")
    most_thickness = Number(50.0, 1.0, 200.0, unit="mm", scale="log", label="to", doc="The thickest.")
    stiffness = Choice("textbook", STIFFNESSES, label="Stiffness", doc="Sandwich (textbook's, thesis's), or solid.")
    density = Number(210.0, 1.0, 20_000.0, unit="kg/m^3", scale="log", label="Density", doc="Mean of the whole plate.")
    most_mass = Number(0.6, 0.01, 100.0, unit="kg", scale="log", label="Mass at most", doc="Mass of the plate.")
    most_sag = Number(0.2, 0.001, 50.0, unit="mm", scale="log", label="Sag at most", doc="Deflection of the middle.")
    load = Number(1000.0, 1.0, 10_000.0, unit="N", scale="log", label="Load", doc="Force on the middle.")
    least_mode = Number(1000.0, 10.0, 20_000.0, unit="Hz", scale="log", label="First mode from", doc="Edges held.")


class PlatePage(QWidget):
    """Searches at each change of a number; a search takes some milliseconds."""

    closed = Signal()
    """Back to the calibrations."""
    report_requested = Signal(object)
    """Write a report of this `SearchResult`."""

    def __init__(self) -> None:
        super().__init__()
        self._tile: Tile | None = None
        self._parameters = TileParameters()
        self.found: SearchResult | None = None
        self.editors = {name: editor_for(one) for name, one in declared_in(_SearchParameters).items()}
        self.title = theme.label("Which plates fit", "title")
        about = theme.label(_ABOUT, "muted")
        form = QGridLayout()
        form.setHorizontalSpacing(3 * theme.GRID)
        for place, editor in enumerate(self.editors.values()):
            form.addWidget(editor, place // 2, place % 2)
            editor.value_changed.connect(self.search)
        self.verdict = theme.label("")
        theme.wrap(about, self.verdict)
        self.table = _table()
        self.back, self.report = QPushButton("Back"), QPushButton("Save a report…")
        self.back.setToolTip(with_native_keys("To the calibrations (Alt+Left)"))
        self.report.setToolTip("A page with table and picture, in a folder")
        self.drawings = DrawingColumn()
        self._lay_out(form, (self.title, about), (self.report, self.back))
        self.back.clicked.connect(self.closed)
        key = QShortcut(QKeySequence("Alt+Left"), self, context=Qt.ShortcutContext.WidgetWithChildrenShortcut)
        key.activated.connect(self.closed)
        self.report.clicked.connect(lambda: self.report_requested.emit(self.found))
        self.setFocusProxy(self.editors["least_modulus"])

    def show_tile(self, tile: Tile, parameters: TileParameters) -> None:
        """Search plates for this tile, with the frame, mounts and shaker of these parameters."""
        plate = parameters.plate
        if parameters != self._parameters or self._tile is None:
            self.editors["stiffness"].set_value(plate.stiffness)
            self.editors["density"].set_value(plate.density_kg_m3)
        self._tile, self._parameters = tile, parameters
        x, y = (100.0 * side for side in tile.size_m)
        self.title.setText(f"Which plates fit  ·  {number(x)} × {number(y)} cm")
        self.search()

    def search(self) -> None:
        """Search with the present requirements; if that is impossible, show the reason."""
        if self._tile is None:
            return
        try:
            self.found = search(self._tile, self._parameters, self._search_request())
        except BadValue as error:
            self.found = None
            self._show_verdict(str(error), good=False)
        else:
            share = f"{100.0 * self.found.fits.mean():.0f} % of the grid fit; the lightest first."
            self._show_verdict(share if self.found.best else why_none(self.found), good=bool(self.found.best))
        self.report.setEnabled(self.found is not None)
        self._show_found()

    def write_report(self, folder: Path) -> str:
        """Write a report of the visible results, and return a line with its path."""
        assert self.found is not None
        write([self.found], folder)
        return f"The report is in {folder / 'index.html'}"

    def _search_request(self) -> PlateSearch:
        of = {name: editor.value() for name, editor in self.editors.items()}
        return PlateSearch(
            modulus_pa=(1e9 * of["least_modulus"], 1e9 * of["most_modulus"]),
            thickness_m=(1e-3 * of["least_thickness"], 1e-3 * of["most_thickness"]),
            stiffness=of["stiffness"],
            density_kg_m3=of["density"],
            facing_m=self._parameters.plate.facing_m,
            most_kg=of["most_mass"],
            most_deflection_m=1e-3 * of["most_sag"],
            load_n=of["load"],
            least_hz=of["least_mode"],
        )

    def _show_verdict(self, text: str, *, good: bool) -> None:
        self.verdict.setText(text[:1].upper() + text[1:])
        theme.set_role(self.verdict, "good" if good else "alarm")

    def _show_found(self) -> None:
        best = self.found.best if self.found is not None else ()
        self.table.setRowCount(len(best))
        for row, one in enumerate(best):
            values = (1e-9 * one.modulus_pa, 1e3 * one.thickness_m, one.mass_kg, 1e3 * one.deflection_m)
            for column, value in enumerate((*values, one.first_hz, one.antiresonance_hz)):
                item = QTableWidgetItem(number(value))
                item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                self.table.setItem(row, column, item)
        self.drawings.show_drawings(() if self.found is None else (drawing(self.found),), "Nothing was searched.")

    def _lay_out(self, form: QGridLayout, labels: Sequence[QWidget], buttons: Sequence[QWidget]) -> None:
        side = QWidget()
        column = QVBoxLayout(side)
        column.setContentsMargins(3 * theme.GRID, 2 * theme.GRID, 2 * theme.GRID, 2 * theme.GRID)
        column.setSpacing(theme.GRID)
        for label in labels:
            column.addWidget(label)
        column.addLayout(form)
        column.addWidget(self.verdict)
        column.addWidget(self.table, 1)
        row = QHBoxLayout()
        row.addStretch(1)
        for button in buttons:
            row.addWidget(button)
        column.addLayout(row)
        layout = QHBoxLayout(body := QWidget())
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(side, 1)
        layout.addWidget(self.drawings, 1)
        scroll_in(self, body)


def parameters_of(simulation: str) -> TileParameters:
    """Return the tile parameters of a target, if known: a simulator's file, else the thesis's."""
    from underfoot.floor.tile_parameters import simulation as read

    return read(simulation)[0] or TileParameters()


def _table() -> QTableWidget:
    table = QTableWidget(0, len(_COLUMNS))
    table.setAccessibleName("Plates that fit")
    table.setHorizontalHeaderLabels(list(_COLUMNS))
    table.horizontalHeader().setDefaultAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
    make_read_only(table)
    offer_copy(table)
    table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
    return table
