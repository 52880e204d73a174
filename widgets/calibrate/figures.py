"""Figures for the person: names as words, values with their units, now and before."""

import math
import re
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

from underfoot.floor.profile import Part
from underfoot.quantities import quantity
from underfoot.widgets import theme

Quantities = Sequence[tuple[str, float, str]]

_UNITS = {
    "percent": "%", "mm": "mm", "hz": "Hz", "db": "dB", "ms": "ms", "ms2": "m/s^2", "per_unit": "m/s^2", "n": "N",
    "m": "m", "s": "s",
}  # fmt: skip
"""Units as the names of figures have them, behind what they are of."""
_WORDS = {
    "bound_percent": "best_of_any_curve",
    "memory_error_percent": "error_with_memory",
    "creep_percent_decade": "creep",
    "acceleration_per_unit": "acceleration_at_full_scale",
    "usable_low_hz": "usable_from",
    "usable_high_hz": "usable_up_to",
    "usable_low_before_hz": "usable_from,_before",
    "usable_high_before_hz": "usable_up_to,_before",
    "standing_changes_db": "change_by_standing",
    "corner_changes_db": "change_by_a_foot_on_a_corner",
}
"""Figures whose names say too little."""
ROW_PX = 24


def name_in_words(name: str) -> str:
    """A figure's name without its unit, which stands behind the value.

    >>> name_in_words("full_scale_n"), name_in_words("error_percent_2"), name_in_words("Force")
    ('Full scale', 'Error of sensor 2', 'Force')
    >>> name_in_words("mean_after_mm_at_150_n"), name_in_words("p95_before_mm"), name_in_words("snr_db")
    ('Mean after at 150 N', '95th percentile before', 'SNR')
    """
    plain = re.sub(r"_(\d+)_(n|hz)(?=_|$)", lambda m: f"_{m[1]} {_UNITS[m[2]]}", _WORDS.get(name, name))
    plain = re.sub(r"^error_percent_(\d)$", r"error of sensor \1", plain)
    plain = re.sub(r"^distortion_(\d)_percent$", r"distortion, harmonic \1", plain)
    plain = re.sub(rf"_({'|'.join(_UNITS)})(?=_|$)", "", plain)
    plain = re.sub(r"\bp(\d\d)(?=_|$)", r"\1th percentile", plain).replace("_", " ").strip()
    plain = re.sub(r"\b(snr|thd|fsr)\b", lambda m: m[1].upper(), plain)
    return plain[:1].upper() + plain[1:]


def unit_in(name: str) -> str:
    """The unit that a figure's name ends with.

    >>> unit_in("full_scale_n"), unit_in("error_percent_2"), unit_in("sensors"), unit_in("mean_mm_at_150_n")
    ('N', '%', '', 'mm')
    >>> unit_in("distortion_2_percent"), unit_in("at_50_hz_db")
    ('%', 'dB')
    """
    found = re.search(rf"_({'|'.join(_UNITS)})(?=_|$)", re.sub(r"_\d+_(n|hz)(?=_|$)", "", name))
    return _UNITS[found[1]] if found else ""


def part_in_words(part: Part | None) -> str:
    """A part of a profile in a line.

    >>> part_in_words(None), part_in_words(Part(made="2026-03-04", error=1.25, error_unit="mm"))
    ('not calibrated yet', '2026-03-04 · errs by 1.25 mm')
    """
    if part is None:
        return "not calibrated yet"
    error = f" · errs by {quantity(part.error, part.error_unit)}" if part.error_unit else ""
    return f"{part.made}{error}"


class FigureRow(QWidget):
    """A few figures beside one another, each under its name."""

    MOST = 6

    def __init__(self) -> None:
        super().__init__()
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(2 * theme.GRID)
        self._pairs: list[tuple[QLabel, QLabel]] = []
        for _ in range(self.MOST):
            name, value = theme.label("", "small"), theme.label("")
            cell = QVBoxLayout()
            cell.setSpacing(0)
            for label in (name, value):
                label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
                cell.addWidget(label)
            self._layout.addLayout(cell, 1)
            self._pairs.append((name, value))
        self.setFixedHeight(4 * theme.GRID + 4)

    def show_figures(self, quantities: Quantities) -> None:
        """Show the first of these."""
        for place, (name, value) in enumerate(self._pairs):
            what, amount, unit = quantities[place] if place < len(quantities) else ("", math.nan, "")
            name.setText(name_in_words(what))
            name.setToolTip(name.text())
            value.setText(quantity(amount, unit) if what else "")

    def texts(self) -> list[str]:
        """What is shown, name and value."""
        return [f"{name.text()} {value.text()}" for name, value in self._pairs if name.text()]


class FigureTable(QTableWidget):
    """Figures with up to two values each: now, and before."""

    def __init__(self, name: str) -> None:
        super().__init__(0, 3)
        self.setAccessibleName(name)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        head = self.horizontalHeader()
        head.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        head.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        head.setHighlightSections(False)
        self.setShowGrid(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setTabKeyNavigation(False)
        self.setVerticalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def show_figures(
        self, quantities: Quantities, now: str, before: Mapping[str, float] | None = None, then: str = ""
    ) -> None:
        """These under the heading `now`, and what they were `before` under `then`, where that is known."""
        head = self.horizontalHeader()
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.Fixed)  # or every item would be measured anew
        self.setHorizontalHeaderLabels(["", now, then])
        self.setColumnHidden(2, before is None)
        self.setRowCount(len(quantities))
        for row, (name, value, unit) in enumerate(quantities):
            old = "" if before is None or name not in before else quantity(before[name], unit)
            for column, text in enumerate((name_in_words(name), quantity(value, unit), old)):
                item = QTableWidgetItem(text)
                if column == 2:
                    item.setForeground(self.palette().placeholderText())
                self.setItem(row, column, item)
        for column in (1, 2):
            head.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
