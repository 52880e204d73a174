"""The table of a comparison: a row per known measure, with each group's mean, SD and difference from the first."""

import csv
import math
from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent
from PySide6.QtWidgets import QAbstractItemView, QTableWidget, QTableWidgetItem

from underfoot.floor.footsteps import BODY_WEIGHT_MEASURES
from underfoot.quantities import counted, fixed
from underfoot.records.comparison import (
    GAIT_MEASURES,
    STEP_MEASURES,
    Figures,
    Group,
    comparison_csv,
)
from underfoot.widgets import theme
from underfoot.widgets.controls.step_table import COLUMNS, UNKNOWN, Column
from underfoot.widgets.controls.tables import leaves_space, make_read_only, offer_copy

ROWS = (
    *(column for column in COLUMNS if column.name in (*STEP_MEASURES, *BODY_WEIGHT_MEASURES)),
    Column("speed_m_s", "Speed", "m/s", 2, "Step length times cadence, of steps that are not beside a turn"),
    Column("stance_percent", "Stance", "% of the cycle", 1, "Contact over contact and the swing before it"),
    *map(
        Column,
        GAIT_MEASURES,
        ("Stance asymmetry", "Length asymmetry", "Stride time varies"),
        ("%", "%", "%"),
        (1, 1, 1),
        (
            "Of each person: difference of left and right stance over their mean",
            "Of each person: difference of left and right step length over their mean, without steps beside a turn",
            "Of each person: SD of the stride time over its mean, from 30 strides on",
        ),
    ),
)
WIDEST_PX = 24 * theme.GRID
"""A longer name of a group is cut off in its heading."""
_COUNTS = (("steps", "Steps"), ("persons", "Persons"))


class ComparisonTable(QTableWidget):
    """The figures of some groups side by side."""

    def __init__(self) -> None:
        super().__init__(0, 1)
        self.setAccessibleName("Measures side by side")
        make_read_only(self)
        offer_copy(self, self._text_for_spreadsheet)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.verticalHeader().setDefaultSectionSize(3 * theme.GRID)
        self.horizontalHeader().setTextElideMode(Qt.TextElideMode.ElideMiddle)  # names often differ at their ends
        self.groups: list[Group] = []

    def show_groups(self, groups: list[Group]) -> None:
        """Show these groups instead of those before."""
        self.groups = groups
        heads = [""]
        for number, group in enumerate(groups):
            heads += [group.name, *(["Difference"] if number else [])]
        self.clear()
        self.setColumnCount(len(heads))
        rows = [column for column in ROWS if any(group.figures[column.name].count for group in groups)]
        self.setRowCount(len(_COUNTS) + len(rows) if groups else 0)
        for place, head in enumerate(heads):
            item = QTableWidgetItem(head)
            item.setTextAlignment(_SIDE if place else _FIRST_SIDE)
            tip = f"{groups[place // 2].name} less {groups[0].name}" if head == "Difference" else head
            item.setToolTip(tip)
            self.setHorizontalHeaderItem(place, item)
        for row, (name, heading) in enumerate(_COUNTS if groups else ()):
            self._fill(row, heading, "", [(fixed(getattr(group, name)), "", "") for group in groups])
        for row, column in enumerate(rows, start=len(_COUNTS)):
            heading = f"{column.heading}, {column.unit}"
            self._fill(row, heading, column.doc, [_cells(group, column) for group in groups])
        self.resizeColumnsToContents()
        for place in range(len(heads)):
            self.setColumnWidth(place, min(self.columnWidth(place) + theme.GRID, WIDEST_PX))

    def copy(self) -> None:
        """Copy the whole table to the clipboard as CSV."""
        QGuiApplication.clipboard().setText(comparison_csv(self.groups))

    def _text_for_spreadsheet(self) -> str:
        """Return what is copied as CSV with tabs between columns, as every table is copied by its key."""
        return "\n".join(map("\t".join, csv.reader(comparison_csv(self.groups).splitlines())))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if not leaves_space(event):
            super().keyPressEvent(event)

    def keyboardSearch(self, search: str) -> None:
        """Do nothing: typed keys go to the window's shortcuts."""

    def _fill(self, row: int, heading: str, doc: str, cells: Sequence[tuple[str, str, str]]) -> None:
        """Fill a row: of each group the figure, the difference, and what is told under the mouse."""
        item = QTableWidgetItem(heading)
        item.setToolTip(doc)
        self.setItem(row, 0, item)
        for number, (figure, difference, tip) in enumerate(cells):
            for place, text in ((max(2 * number, 1), figure), (2 * number + 1, difference)):
                if place == 1 and text is difference:
                    continue  # the first group differs from none
                item = QTableWidgetItem(text)
                item.setTextAlignment(_SIDE)
                item.setToolTip(tip)
                self.setItem(row, place, item)


_SIDE = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_FIRST_SIDE = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter


def _cells(group: Group, column: Column) -> tuple[str, str, str]:
    one = group.figures[column.name]
    if not one.count:
        return UNKNOWN, "", ""
    spread = f" ± {fixed(one.sd, column.decimals)}" if math.isfinite(one.sd) else ""
    of = counted(one.count, "person") if column.name in GAIT_MEASURES else counted(one.count, "step")
    if column.name not in GAIT_MEASURES and group.persons > 1:  # whose means differ: the SD is not that of one walk
        of += f" of {counted(group.persons, 'person')} together"
    tip = f"Mean ± SD of {of}" if spread else f"Of {of}"
    return f"{fixed(one.mean, column.decimals)}{spread}", _difference(one, column.decimals), tip


def _difference(one: Figures, decimals: int) -> str:
    if not math.isfinite(one.difference):
        return ""
    share = f" ({_signed(one.difference_percent, 1)} %)" if math.isfinite(one.difference_percent) else ""
    return f"{_signed(one.difference, decimals)}{share}"


def _signed(value: float, decimals: int) -> str:
    """Return a number with its sign.

    >>> _signed(4.04, 1), _signed(-4.04, 1), _signed(0.01, 1)
    ('+4.0', '−4.0', '0.0')
    """
    return f"{'+' if round(value, decimals) > 0.0 else ''}{fixed(value, decimals)}"
