"""The steps of a recording: a table with sorting and filters, and curves over 0 to 100 % of stance."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QSignalBlocker, Qt, QTimer, Signal
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QVBoxLayout, QWidget

from underfoot.drawing import Drawing, Series
from underfoot.floor.footsteps import Step
from underfoot.quantities import counted
from underfoot.records.comparison import PERCENT, StanceCurve, band, of_body_weight, stance_curve
from underfoot.records.survey import STANCE, Stance
from underfoot.records.tables import recorded_step_lines
from underfoot.widgets import theme
from underfoot.widgets.controls.gait_tip import GaitTip
from underfoot.widgets.controls.panels import splitter, tool_button, with_header
from underfoot.widgets.controls.step_table import StepTable, WholeRows
from underfoot.widgets.plots.plot import Plot

ALL = "all"
MAX_CURVES = 1000
"""Number of single curves that are drawn, and in the saved data; mean and band include all."""
_FILTERS = ("person", "side", "tile")


class RecordedSteps(QWidget):
    """All steps of a recording. The table and the picture show those that match the filters."""

    chosen = Signal(int)
    """The number of a step in the list that `show_steps` was given."""
    filtered = Signal()
    """The filters have changed."""
    comparison_wanted = Signal()
    """The recording's feet, or persons, shall be compared."""
    notified = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self._steps: Sequence[Stance] = ()
        self._visible: list[int] = []
        self._means: dict[bool, StanceCurve] = {}
        """Of the visible steps, for `stance_drawing`."""
        self._choice = -1
        self._waits_for = ""
        self.table = StepTable(1_000_000, sortable=True)
        self.plot = Plot("Force over stance")
        self.plot.setMinimumWidth(20 * theme.GRID)
        self.count = theme.label("", "muted")
        GaitTip((self.count,), self._steps_of_person)
        self.filters = {name: QComboBox() for name in _FILTERS}
        head: list[QWidget | None] = [theme.label("Steps", "title"), self.count, None]
        for name, box in self.filters.items():
            box.setAccessibleName(f"Show steps of {name}")
            box.setToolTip(f"Show the steps of one {name}, or of all")
            box.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
            box.currentTextChanged.connect(self._filter)
            head.append(box)
        self.copy_button = tool_button("", "Copy", "Copy the selected steps, or all that are shown, as CSV")
        self.copy_button.clicked.connect(self.copy)
        tip = "Compare left and right, or persons; to compare recordings, choose several with Ctrl or Shift in the list"
        self.compare_button = tool_button("balance", "Compare", tip)
        self.compare_button.clicked.connect(lambda _=False: self.comparison_wanted.emit())
        head += [self.compare_button, self.copy_button]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        across = splitter("recordings steps", Qt.Orientation.Horizontal)
        layout.addWidget(across)
        shrinking: list[list[QWidget]] = [[self.compare_button], [self.copy_button], [*self.filters.values()]]
        table = with_header(head, WholeRows(self.table), shrinking, across)
        table.setMinimumWidth(30 * theme.GRID)
        holder = QWidget(across)
        inside = QHBoxLayout(holder)
        inside.setContentsMargins(theme.GRID, theme.GRID + 1, 0, 0)  # its title is beside those of the panels
        theme.fill(holder, "ground")
        inside.addWidget(self.plot)
        across.setSizes([560, 300])
        self._selection_timer = QTimer(self, singleShot=True, interval=0)
        self._selection_timer.timeout.connect(self._choose)
        self.table.selectionModel().selectionChanged.connect(lambda *_: self._selection_timer.start())
        self.show_steps(())

    def show_steps(self, steps: Sequence[Stance], choice: int = -1) -> None:
        """Replace the steps; filters and several that are selected are kept if possible."""
        selected = {step.step for step in self.table.selected_steps()}
        self._steps, self._choice = steps, choice
        place = self.table.verticalScrollBar().value()
        values = {
            "person": sorted({str(step.step.person) for step in steps if step.step.person}, key=int),
            "side": sorted({step.step.side for step in steps}),
            "tile": sorted({step.step.tile for step in steps}, key=lambda name: (len(name), name)),
        }
        for name, box in self.filters.items():
            wanted = box.currentText().removeprefix(f"{name} ")
            with QSignalBlocker(box):
                box.clear()
                box.addItem({"person": "people"}.get(name, f"{name}s"), ALL)
                for value in values[name]:
                    box.addItem(f"{name} {value}" if name != "side" else value, value)
                box.setCurrentIndex(max(box.findData(wanted), 0))
        self._filter()
        if len(selected) > 1:
            self.table.select_steps(step for step in self.visible_steps() if step.step in selected)
        if choice < 0:
            self.table.verticalScrollBar().setValue(place)

    def show_wait(self, waits_for: str) -> None:
        """Say that there are more steps to come, and what they wait for; "" if these are all."""
        if waits_for != self._waits_for:
            self._waits_for = waits_for
            self.compare_button.setEnabled(bool(self._steps) and not waits_for)
            self._show_count()
            self._draw()

    @property
    def shown_person(self) -> int:
        """The person whose steps alone are shown; 0 for all."""
        wanted = self.filters["person"].currentData()
        return 0 if wanted in (None, ALL) else int(wanted)

    @property
    def every(self) -> int:
        """The number of all steps."""
        return len(self._steps)

    def choose(self, number: int) -> None:
        """Select a step in table and picture."""
        self._choice = number
        if number in self._visible:
            self.table.select_step(self._steps[number].step)
        else:
            self.table.clearSelection()
        self._draw()

    def matching(self, steps: Sequence[Stance]) -> list[int]:
        """Return the indices of the steps that match the filters."""
        wanted = {name: box.currentData() for name, box in self.filters.items() if box.currentData() != ALL}
        return [
            number
            for number, one in enumerate(steps)
            if all(str(getattr(one.step, name)) == value for name, value in wanted.items())
        ]

    def visible_steps(self) -> list[Step]:
        """Return the steps that match the filters."""
        return [self._steps[number].step for number in self._visible]

    def chosen_steps(self) -> list[Step]:
        """Return the selected steps; without any in the table, the one that is chosen on the axis."""
        return self.table.selected_steps() or [one.step for one in self._steps[self._choice :][: self._choice >= 0]]

    def _steps_of_person(self) -> list[Step]:
        """Return all steps of the chosen person, or of all: a gait is of steps that follow one another."""
        return [one.step for one in self._steps if self.shown_person in (0, one.step.person)]

    def copy(self) -> None:
        """Copy the selected steps, or all that match the filters, to the clipboard as CSV."""
        steps = self.table.selected_steps() or self.table.steps_in_order()
        QGuiApplication.clipboard().setText("\n".join(recorded_step_lines(steps)) + "\n")
        self.notified.emit(f"{counted(len(steps), 'step')} copied as CSV.")

    def _filter(self) -> None:
        self._visible, self._means = self.matching(self._steps), {}
        self.table.steps.clear()
        self.table.show_body_weight(any(math.isfinite(step.body_weight_n) for step in self.visible_steps()))
        self.table.steps.add(self.visible_steps())
        self._show_count()
        self.copy_button.setEnabled(bool(self._visible))
        self.compare_button.setEnabled(bool(self._steps) and not self._waits_for)
        if self._choice in self._visible:
            self.table.select_step(self._steps[self._choice].step)
        self._draw()
        self.filtered.emit()

    def _show_count(self) -> None:
        count, every = len(self._visible), len(self._steps)
        text = f"{every}" if count == every else f"{count} of {every}"
        if self._waits_for:
            text = f"{text} so far" if every else "none yet"
        self.count.setText(text)

    def _choose(self) -> None:
        selected = self.table.selected_steps()
        if len(selected) == 1 and (number := self._number_of(selected[0])) != self._choice:
            self._choice = number
            self.chosen.emit(number)
        self._draw()

    def _number_of(self, step: Step) -> int:
        return next(number for number in self._visible if self._steps[number].step is step)

    def _draw(self) -> None:
        steps = [self._steps[number] for number in self._visible]
        chosen = self._steps[self._choice] if 0 <= self._choice < len(self._steps) else None
        selected, means = set(map(id, self.table.selected_steps())), self._means
        if len(selected) > 1:
            steps, chosen, means = [one for one in steps if id(one.step) in selected], None, {}
        self.plot.show_drawing(stance_drawing(steps, chosen, self._waits_for or "no steps", means))


def stance_drawing(
    steps: Sequence[Stance],
    chosen: Stance | None = None,
    note: str = "",
    means: dict[bool, StanceCurve] | None = None,
) -> Drawing:
    """Return a drawing of the curves of steps, with mean and a band of one standard deviation; or a note without any.

    Steps that are left out are dashed, and in neither. In % of body weight where that of all is noted, else in N.
    `means` keeps the mean of these steps, of so many takes a while, for when another one of them is chosen.

    >>> from underfoot.floor.footsteps import Step
    >>> steps = [Stance(Step(k, "t1", "left", k, 600.0, *[0.0] * 7), (100.0 * k,) * 101) for k in (1, 2)]
    >>> [one.name for one in stance_drawing(steps).series]
    ['± 1 SD', 'step 1', 'step 2', 'mean of 2']
    """
    series = []
    drawn = [one for one in steps if len(one.force_n) == STANCE]
    in_bw = bool(drawn) and all(math.isfinite(one.step.body_weight_n) for one in (*drawn, chosen or drawn[0]))

    def force_of(one: Stance) -> NDArray[np.float64]:
        return of_body_weight(one) if in_bw else np.array(one.force_n)

    known = [one for one in drawn if not one.step.left_out]
    if known:
        means = {} if means is None else means
        mean = means[in_bw] = means.get(in_bw) or stance_curve([force_of(one) for one in known])
        if len(known) > 1:
            series.append(band(mean))
    for one in drawn[:: max(1, -(-len(drawn) // MAX_CURVES))]:
        if one is not chosen:
            series.append(_curve(one, force_of(one), "faint", in_legend=False))
    if known:
        series.append(Series(f"mean of {len(known)}", PERCENT, mean.mean, colour="force"))
    if chosen is not None and len(chosen.force_n) == STANCE:
        series.append(_curve(chosen, force_of(chosen), "contact"))
    largest = max((float(np.max(one.outline_y)) for one in series), default=0.0)
    return Drawing(
        "Stance",
        "share of stance, %",
        "force, % of body weight" if in_bw else "force, N",
        tuple(series),
        x_range=(0.0, 100.0),
        y_range=(0.0, max(100.0, 1.05 * largest)),
        note="" if series else note,
    )


def _curve(one: Stance, force: NDArray[np.float64], colour: str, *, in_legend: bool = True) -> Series:
    name, style = f"step {one.step.step}", "line"
    if one.step.left_out:
        name, style = f"{name}, left out", "dashed"
    return Series(name, PERCENT, force, style, colour, in_legend=in_legend)
