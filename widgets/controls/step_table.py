"""The table of footsteps, filled as they occur."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import (
    QAbstractTableModel,
    QEvent,
    QItemSelection,
    QItemSelectionModel,
    QModelIndex,
    QPersistentModelIndex,
    QRect,
    QSize,
    QSortFilterProxyModel,
    Qt,
)
from PySide6.QtGui import (
    QContextMenuEvent,
    QGuiApplication,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QPixmap,
    QResizeEvent,
)
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QTableView,
    QWidget,
)

from underfoot.floor.footsteps import BODY_WEIGHT_MEASURES, Step
from underfoot.quantities import fixed
from underfoot.records.tables import step_table
from underfoot.widgets import theme
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.controls.tables import copy_action, leaves_space, make_read_only
from underfoot.widgets.pictures import blank_picture


class Column(NamedTuple):
    """A column: its name in files, its heading and unit in the window, its decimals and its meaning."""

    name: str
    heading: str
    unit: str
    decimals: int
    doc: str


COLUMNS = (
    Column("step", "Step", "", 0, "Number of the step since the start"),
    Column("tile", "Tile", "", 0, "The tile that took most of the impulse"),
    Column("side", "Side", "", 0, "Left or right foot, where the walk shows it"),
    Column("start_s", "Start", "s", 2, "Onset of the contact, since the session or the recording began"),
    Column("contact_ms", "Contact", "ms", 0, "From heel strike to toe off; told up to 0.7 s late by uncalibrated FSRs"),
    Column("peak1_n", "Peak 1", "N", 0, "Largest force in the first half of the contact"),
    Column("peak1_percent_bw", "Peak 1", "%BW", 1, "Largest force in the first half, in percent of the body weight"),
    Column("valley_n", "Valley", "N", 0, "Least force between the peaks"),
    Column("valley_percent_bw", "Valley", "%BW", 1, "Least force between the peaks, in percent of the body weight"),
    Column("peak2_n", "Peak 2", "N", 0, "Largest force in the second half of the contact"),
    Column("peak2_percent_bw", "Peak 2", "%BW", 1, "Largest force in the second half, in percent of the body weight"),
    Column("impulse_ns", "Impulse", "N·s", 1, "Integral of the force over the contact"),
    Column("impulse_percent_bw_s", "Impulse", "%BW·s", 1, "Integral of the force, in percent of the body weight"),
    Column("loading_kn_s", "Loading", "kN/s", 1, "Loading rate: slope of the force from 20 to 80 % of the first peak"),
    Column("loading_percent_bw_per_s", "Loading", "%BW/s", 1, "Loading rate, in percent of the body weight"),
    Column("path_mm", "Path", "mm", 0, "Length of the path of the contact centroid"),
    Column("net_mm", "Net", "mm", 0, "Distance of the contact centroid from its first place to its last"),
    Column("person", "Person", "", 0, "Who walks, as far as one step follows from another"),
    Column("cadence_per_min", "Cadence", "/min", 0, "From the person's last step to this one"),
    Column("step_length_mm", "Length", "mm", 0, "From the other foot to this one, along the way"),
    Column("step_width_mm", "Width", "mm", 0, "From the other foot to this one, across the way"),
    Column("swing_ms", "Swing", "ms", 0, "How long this foot was in the air before"),
    Column("double_support_ms", "Both", "ms", 0, "Both feet down as this one came; below 0: neither; empty: unseen"),
    Column("heading_deg", "Heading", "°", 0, "Where the foot points, counter-clockwise from the floor's x axis"),
    Column("heading_error_deg", "Heading ±", "°", 0, "Standard error of the heading"),
)
"""The columns of the step table in files (docs/contracts.md#files), but for `spike`, a mark at the loading rate, and
`contact`. Those of the body weight are shown while that of a step is noted."""

_LEFT_OUT = [Column("left_out", "Left out", "", 0, "Why the step does not count")]
"""In what is copied; the table shows such a row struck through."""

TEXT_COLUMNS = ("tile", "side")
ALIGNMENTS = tuple(
    Qt.AlignmentFlag.AlignVCenter
    | (Qt.AlignmentFlag.AlignLeft if column.name in TEXT_COLUMNS else Qt.AlignmentFlag.AlignRight)
    for column in COLUMNS
)
"""That of each column's text."""

UNKNOWN = "–"

SORT_ROLE = Qt.ItemDataRole.UserRole
"""The role of a cell's value, by which rows are put in order."""

MAX_STEPS = 10_000
"""Number of steps that are kept."""

_SPIKE = " !"
_LOADING = [number for number, column in enumerate(COLUMNS) if column.heading == "Loading"]
_OF_BODY_WEIGHT = [number for number, column in enumerate(COLUMNS) if column.name in BODY_WEIGHT_MEASURES]
_MARGIN_PX = 4
_MAX_PICTURES = 200
_WIDEST_NUMBER, _WIDEST_GROWN = 9999.0, 9_999_999.0
"""What a column fits, unless the user widens it, and what those do whose numbers grow with the session's age: of more,
digits are cut off."""
_Index = QModelIndex | QPersistentModelIndex


class StepModel(QAbstractTableModel):
    """Footsteps as rows, oldest first; the latest `max_steps` are kept."""

    def __init__(self, max_steps: int) -> None:
        super().__init__()
        self.steps: list[Step] = []
        self._texts: list[tuple[str, ...]] = []
        """The texts of each step; () until they are shown: an hour of steps has 700,000 cells."""
        self._max_steps = max_steps

    def add(self, steps: Sequence[Step]) -> None:
        """Append steps."""
        if not steps:
            return
        surplus = len(self.steps) + len(steps) - self._max_steps
        if surplus > 0:
            self.beginRemoveRows(QModelIndex(), 0, surplus - 1)
            del self.steps[:surplus], self._texts[:surplus]
            self.endRemoveRows()
        first = len(self.steps)
        self.beginInsertRows(QModelIndex(), first, first + len(steps) - 1)
        self.steps.extend(steps)
        self._texts.extend([()] * len(steps))
        self.endInsertRows()

    def clear(self) -> None:
        """Remove all steps."""
        self.beginResetModel()
        self.steps.clear()
        self._texts.clear()
        self.endResetModel()

    def texts(self, row: int) -> tuple[str, ...]:
        """Return the displayed texts of a step, by column."""
        self._texts[row] = self._texts[row] or _row_texts(self.steps[row])
        return self._texts[row]

    def rowCount(self, parent: _Index = QModelIndex()) -> int:  # noqa: B008
        return 0 if parent.isValid() else len(self.steps)

    def columnCount(self, parent: _Index = QModelIndex()) -> int:  # noqa: B008
        return 0 if parent.isValid() else len(COLUMNS)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole) -> object:
        if orientation != Qt.Orientation.Horizontal:
            return None
        column = COLUMNS[section]
        if role == Qt.ItemDataRole.DisplayRole:
            return f"{column.heading}, {column.unit}" if column.unit else column.heading
        if role == Qt.ItemDataRole.ToolTipRole:
            return column.doc
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return ALIGNMENTS[section]
        return None

    def data(self, index: _Index, role: int = Qt.ItemDataRole.DisplayRole) -> object:
        step, column = self.steps[index.row()], COLUMNS[index.column()]
        spike = column.heading == "Loading" and step.spike
        if role == SORT_ROLE:
            value = getattr(step, column.name)
            # NaN compares as neither less nor greater, which would disorder the whole sort.
            return -math.inf if isinstance(value, float) and math.isnan(value) else value
        if role == Qt.ItemDataRole.DisplayRole:
            return self.texts(index.row())[index.column()]
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return ALIGNMENTS[index.column()]
        if role == Qt.ItemDataRole.ToolTipRole and step.left_out:
            return f"Left out: {step.left_out}"
        if role == Qt.ItemDataRole.ToolTipRole and spike:
            return "The first peak is the impact transient: it rises more steeply than weight is taken on."
        return None


class StepTable(QTableView):
    """The table of the latest `max_steps` steps. It stays scrolled to its end, unless the user has scrolled up.

    With `sortable`, a click on a heading, or the context menu, sorts the rows by that column, and the scroll position
    stays.
    """

    def __init__(self, max_steps: int = MAX_STEPS, *, sortable: bool = False) -> None:
        super().__init__()
        self.setAccessibleName("Footsteps")
        self.steps = StepModel(max_steps)
        self.steps.setParent(self)
        self._sorted = QSortFilterProxyModel(self)
        self._sorted.setSourceModel(self.steps)
        self._sorted.setSortRole(SORT_ROLE)
        self.setModel(self._sorted)
        make_read_only(self)
        self._copying = copy_action(self, self._copy)
        self._offered: list[tuple[str, Callable[[], object]]] = []
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setWordWrap(False)
        self.verticalHeader().setDefaultSectionSize(3 * theme.GRID)
        header = self.horizontalHeader()
        header.setMinimumSectionSize(5 * theme.GRID)
        for number, column in enumerate(COLUMNS):  # once: fitting to visible rows takes as long as painting
            most = _WIDEST_GROWN if column.name in ("step", "start_s") else _WIDEST_NUMBER
            widest = "right" if column.name in TEXT_COLUMNS else _cell_text(most, column)
            room = self.fontMetrics().horizontalAdvance(widest) + 2 * _MARGIN_PX
            header.resizeSection(number, max(header.sectionSizeHint(number), room))
        if sortable:  # now: the hints would have room for the arrow, which is above the heading
            self.sortByColumn(-1, Qt.SortOrder.AscendingOrder)
            self.setSortingEnabled(True)
        self.show_body_weight(False)
        self._row_pictures: dict[tuple[tuple[str, ...], bool, bool, float], QPixmap] = {}
        header.sectionResized.connect(self._row_pictures.clear)
        header.sectionMoved.connect(self._row_pictures.clear)
        self._is_sortable = sortable
        self._is_at_end = not sortable
        self._end = 0
        bar = self.verticalScrollBar()
        bar.rangeChanged.connect(self._scroll_to_end)
        bar.valueChanged.connect(self._update_is_at_end)
        self._sorted.rowsInserted.connect(self._follow)

    def steps_in_order(self) -> list[Step]:
        """Return all steps in display order."""
        return [self._step_at(row) for row in range(self._sorted.rowCount())]

    def selected_steps(self) -> list[Step]:
        """Return the steps of the selected rows."""
        ranges = self.selectionModel().selection().toList()  # of whole rows
        rows = {row for one in ranges for row in range(one.top(), one.bottom() + 1)}
        return [self._step_at(row) for row in sorted(rows)]

    def select_step(self, step: Step) -> None:
        """Select the row of a step, and scroll to it."""
        number = next((k for k, one in enumerate(self.steps.steps) if one is step), None)
        if number is not None:
            index = self._sorted.mapFromSource(self.steps.index(number, 0))
            self.selectRow(index.row())
            self.scrollTo(index)

    def select_steps(self, steps: Iterable[Step]) -> None:
        """Select the rows of these steps."""
        wanted, selection = set(map(id, steps)), QItemSelection()
        for number, step in enumerate(self.steps.steps):
            if id(step) in wanted:
                index = self._sorted.mapFromSource(self.steps.index(number, 0))
                selection.select(index, index)
        flags = QItemSelectionModel.SelectionFlag
        self.selectionModel().select(selection, flags.ClearAndSelect | flags.Rows)

    def show_body_weight(self, shown: bool) -> None:
        """Show or hide the forces in percent of the body weight."""
        for number in _OF_BODY_WEIGHT:
            self.setColumnHidden(number, not shown)

    def _shown_columns(self) -> list[int]:
        return [number for number in range(len(COLUMNS)) if not self.isColumnHidden(number)]

    def offer(self, text: str, do: Callable[[], object]) -> None:
        """Offer something in the context menu."""
        self._offered.append((text, do))

    def _step_at(self, row: int) -> Step:
        return self.steps.steps[self._sorted.mapToSource(self._sorted.index(row, 0)).row()]

    def export(self, path: Path) -> None:
        """Write the steps as CSV."""
        with step_table(path) as write:
            write(self.steps.steps)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint rows from cached pictures, because each step moves all rows, and painting cells is slow."""
        painter = QPainter(self.viewport())
        first, last = self.rowAt(0), self.rowAt(self.viewport().height() - 1)
        for row in range(max(first, 0), (last if last >= 0 else self._sorted.rowCount() - 1) + 1):
            number = self._sorted.mapToSource(self._sorted.index(row, 0)).row()
            texts, is_left_out = self.steps.texts(number), bool(self.steps.steps[number].left_out)
            key = texts, is_left_out, self.selectionModel().isRowSelected(row), self.devicePixelRatioF()
            if key not in self._row_pictures:
                self._row_pictures[key] = self._paint_row(*key)
            painter.drawPixmap(-self.horizontalOffset(), self.rowViewportPosition(row), self._row_pictures[key])
        if self.hasFocus():
            painter.setPen(theme.VIBRATION)
            painter.drawRect(self.viewport().rect().adjusted(0, 0, -1, -1))

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if hasattr(self, "_row_pictures"):
            self._row_pictures.clear()  # the colours or the font have changed

    def _paint_row(self, texts: tuple[str, ...], is_left_out: bool, is_selected: bool, ratio: float) -> QPixmap:
        if len(self._row_pictures) >= _MAX_PICTURES:
            self._row_pictures.clear()
        header, height = self.horizontalHeader(), self.verticalHeader().defaultSectionSize()
        colour = self.palette().highlight().color() if is_selected else Qt.GlobalColor.transparent
        picture = blank_picture(QSize(header.length(), height), ratio, colour)
        painter = QPainter(picture)
        font = self.font()
        font.setStrikeOut(is_left_out)
        painter.setFont(font)
        for column in self._shown_columns():
            text = texts[column]
            plain = self.palette().highlightedText().color() if is_selected else theme.TEXT
            plain = theme.MUTED if is_left_out and not is_selected else plain
            painter.setPen(theme.FORCE if text.endswith(_SPIKE) else theme.MUTED if text == UNKNOWN else plain)
            left, width = header.sectionPosition(column) + _MARGIN_PX, header.sectionSize(column) - 2 * _MARGIN_PX
            painter.drawText(QRect(left, 0, width, height), ALIGNMENTS[column], text)
        painter.end()
        return picture

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not leaves_space(event):
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer to copy, and the columns to sort by: their headings cannot be reached by keys."""
        menu = Menu(self)
        menu.addAction(self._copying)
        for text, do in self._offered:
            menu.addAction(text, do)
        if self._is_sortable:
            by = menu.addMenu("Sort by")
            for number in self._shown_columns():
                heading = self._sorted.headerData(number, Qt.Orientation.Horizontal)
                by.addAction(heading, partial(self._sort_by, number))
        menu.open_once(event.globalPos())

    def _sort_by(self, column: int) -> None:
        """Sort by a column; if the rows are sorted by it, the other way round, as a click on its heading does."""
        header, ascending = self.horizontalHeader(), Qt.SortOrder.AscendingOrder
        is_reversed = (header.sortIndicatorSection(), header.sortIndicatorOrder()) == (column, ascending)
        self.sortByColumn(column, Qt.SortOrder.DescendingOrder if is_reversed else ascending)

    def keyboardSearch(self, search: str) -> None:
        """Do nothing: typed keys go to the window's shortcuts."""

    def _copy(self) -> None:
        """Put the selected rows, or all, on the clipboard, with tabs between columns as a spreadsheet takes them."""
        steps = self.selected_steps() or self.steps_in_order()
        columns = [COLUMNS[number] for number in self._shown_columns()]
        columns += _LEFT_OUT * any(step.left_out for step in steps)
        lines = ["\t".join(f"{c.heading}, {c.unit}" if c.unit else c.heading for c in columns)]
        lines += ["\t".join(_plain_text(getattr(step, column.name)) for column in columns) for step in steps]
        QGuiApplication.clipboard().setText("\n".join(lines))

    def _follow(self) -> None:
        if self._is_at_end:
            self.scrollToBottom()

    def _update_is_at_end(self, value: int) -> None:
        """Update whether the table is scrolled to its end, after the user has scrolled."""
        bar = self.verticalScrollBar()
        if bar.maximum() == self._end and not self._is_sortable:
            self._is_at_end = value >= bar.maximum()

    def _scroll_to_end(self, _: int, end: int) -> None:
        """Scroll to the end after a change of rows or height, also while the table is hidden."""
        follows, self._end = self._is_at_end, end
        if follows:
            self.verticalScrollBar().setValue(end)
        self._is_at_end = follows


class WholeRows(QWidget):
    """Limits the table's height to whole rows, so that none is cut off."""

    def __init__(self, table: StepTable) -> None:
        super().__init__()
        self._table = table
        table.setParent(self)
        table.setFrameShape(QFrame.Shape.NoFrame)
        theme.fill(self, "panel")

    def resizeEvent(self, event: QResizeEvent) -> None:
        header = self._table.horizontalHeader().sizeHint().height()
        row = self._table.verticalHeader().defaultSectionSize()
        beside = header + self._table.horizontalScrollBar().sizeHint().height()
        rows = max(1, (self.height() - beside) // row)
        self._table.setGeometry(0, 0, self.width() - theme.GRID, beside + rows * row)


def _row_texts(step: Step) -> tuple[str, ...]:
    texts = [_cell_text(getattr(step, column.name), column) for column in COLUMNS]
    for number in _LOADING * step.spike:
        texts[number] += _SPIKE * (texts[number] != UNKNOWN)
    return tuple(texts)


def _cell_text(value: str | float, column: Column) -> str:
    """Return a value as the table shows it."""
    if isinstance(value, str):
        return UNKNOWN if value == "unknown" else value
    if not math.isfinite(value):
        return UNKNOWN
    return fixed(value, column.decimals)


def _plain_text(value: str | float) -> str:
    """Return a value as a spreadsheet reads it."""
    if isinstance(value, float):
        return f"{value:.10g}" if math.isfinite(value) else ""
    return str(value)
