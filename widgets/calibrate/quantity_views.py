"""Display of figures: labels, and values with units, now and before."""

import math
from collections.abc import Mapping, Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from underfoot.calibration.results.labels import label_of
from underfoot.floor.profile import Part
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.tables import make_read_only, offer_copy

Quantities = Sequence[tuple[str, float, str]]

ROW_PX = 24


def part_text(part: Part | None) -> str:
    """Describe a part of a profile in one line.

    >>> part_text(None), part_text(Part(made="2026-03-04", error=1.25, error_unit="mm"))
    ('not calibrated yet', '2026-03-04 · errs by 1.25 mm')
    >>> from underfoot.floor.profile import Latency
    >>> part_text(Latency(made="2026-03-04", error=0.02, error_unit="ms", round_trip_ms=20.0))
    '2026-03-04 · jitter 0.02 ms'
    """
    return " · ".join(filter(None, ("" if part is None else part.made, error_text(part))))


def error_text(part: Part | None) -> str:
    """Describe how accurate a part of a profile is; "" where that is not known."""
    if part is None:
        return "not calibrated yet"
    return f"{part.errs} {quantity(part.error, part.error_unit)}" if part.error_unit else ""


class QuantityRow(QWidget):
    """A few figures side by side, each under its name."""

    MAX_QUANTITIES = 6

    def __init__(self) -> None:
        super().__init__()
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(theme.GRID)
        self._pairs: list[tuple[QLabel, QLabel]] = []
        for _ in range(self.MAX_QUANTITIES):
            name, value = theme.label("", "small"), theme.label("")
            cell = QVBoxLayout()
            cell.setSpacing(0)
            for label in (name, value):
                label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
                cell.addWidget(label)
            self._layout.addLayout(cell, 1)
            self._pairs.append((name, value))
        self._layout.addStretch(1)
        self.setFixedHeight(4 * theme.GRID + 4)

    def show_quantities(self, quantities: Quantities) -> None:
        """Show the first of these figures."""
        for place, (name, value) in enumerate(self._pairs):
            what, amount, unit = quantities[place] if place < len(quantities) else ("", math.nan, "")
            name.setText(label_of(what))
            name.setToolTip(name.text())
            value.setText(quantity(amount, unit) if what else "")
            for label in (name, value):
                label.setVisible(bool(what))

    def texts(self) -> list[str]:
        """Return the displayed names and values."""
        return [f"{name.text()} {value.text()}" for name, value in self._pairs if name.text()]


class QuantityTable(QTableWidget):
    """Figures with up to two values each: now, and before."""

    def __init__(self, name: str) -> None:
        super().__init__(0, 3)
        self.setAccessibleName(name)
        make_read_only(self)
        offer_copy(self)
        self.verticalHeader().setMinimumSectionSize(ROW_PX)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)  # long names take two lines
        head = self.horizontalHeader()
        head.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def show_quantities(
        self, quantities: Quantities, now: str, before: Mapping[str, float] | None = None, then: str = ""
    ) -> None:
        """Show figures under the heading `now`, and their values `before`, if known, under `then`."""
        head = self.horizontalHeader()
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)  # or every item would be measured again
        self.setHorizontalHeaderLabels(["", now, then])
        self.setColumnHidden(2, before is None)
        self.setRowCount(len(quantities))
        for row, (name, value, unit) in enumerate(quantities):
            old = "" if before is None or name not in before else quantity(before[name], unit)
            for column, text in enumerate((label_of(name), quantity(value, unit), old)):
                item = QTableWidgetItem(text)
                if column == 2:
                    item.setForeground(self.palette().placeholderText())
                self.setItem(row, column, item)
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
