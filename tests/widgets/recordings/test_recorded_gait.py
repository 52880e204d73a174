"""The gait of who walked in a recording."""

import csv

import pytest
from made_steps import STEP
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QHelpEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from underfoot.drawing import table
from underfoot.drawing.shapes import Text
from underfoot.records.survey import Stance
from underfoot.widgets.recordings.steps import RecordedSteps, stance_drawing


def test_the_gait_of_each_person_is_told_at_the_number_of_steps(qtbot):
    """Of all steps of who is chosen, whichever sides are shown: a gait is of steps that follow one another."""
    panel = RecordedSteps()
    qtbot.addWidget(panel)
    sides = ("left", "right")
    steps = [replace(STEP, step=k, person=1 + k // 4, side=sides[k % 2], cadence_per_min=100.0) for k in range(8)]
    panel.show_steps([Stance(step, ()) for step in steps])

    def told():
        at = panel.count.rect().center()
        QApplication.sendEvent(panel.count, QHelpEvent(QEvent.Type.ToolTip, at, panel.count.mapToGlobal(at)))
        return panel.count.toolTip().split("\n")

    assert [line.split(", stance")[0] for line in told()] == [
        f"person {k}: 4 steps, 100 steps a minute" for k in (1, 2)
    ]
    panel.filters["person"].setCurrentText("person 2")
    panel.filters["side"].setCurrentText("left")
    assert [line.split(", ")[0] for line in told()] == ["person 2: 4 steps"]


@pytest.fixture
def four(qtbot):
    """The panel with four steps, of 100, 200, 400 and 700 N."""
    panel = RecordedSteps()
    qtbot.addWidget(panel)
    panel.resize(1000, 300)
    show(qtbot, panel)
    panel.show_steps(
        [Stance(replace(STEP, step=k), (force_n,) * 101) for k, force_n in enumerate((100.0, 200.0, 400.0, 700.0), 1)]
    )
    return panel


def click(panel, row, modifiers=Qt.KeyboardModifier.NoModifier):
    at = QPoint(9, panel.table.rowViewportPosition(row) + 5)
    QTest.mouseClick(panel.table.viewport(), Qt.MouseButton.LeftButton, modifiers, at)


def curves_of(panel):
    """The force at half the stance by the name of its curve, in the data that the plot saves."""
    lines = csv.DictReader(table.csv(panel.plot.drawing).splitlines())
    return {line["series"]: float(line["force, N"]) for line in lines if line["share of stance, %"] == "50"}


def legend_of(panel):
    """The curves that the plot's legend names, as it is painted."""
    painted = {shape.text for shape in panel.plot.frame.shapes if isinstance(shape, Text)}
    return painted & {one.name for one in panel.plot.drawing.series}


def test_the_mean_over_stance_is_that_of_the_steps_that_are_selected_if_several_are(four, qtbot):
    """So bad steps are left out; each step's curve is told by its number where the plot is saved as data."""
    everyone = {"step 1": 100.0, "step 2": 200.0, "step 3": 400.0, "step 4": 700.0, "mean of 4": 350.0}
    assert curves_of(four).items() >= everyone.items()
    click(four, 0)
    others = [f"step {k}" for k in (2, 3, 4)]
    qtbot.waitUntil(lambda: [one.name for one in four.plot.drawing.series][1:] == [*others, "mean of 4", "step 1"])
    assert legend_of(four) == {"± 1 SD", "mean of 4", "step 1"}
    click(four, 2, Qt.KeyboardModifier.ShiftModifier)
    qtbot.waitUntil(lambda: curves_of(four).get("mean of 3") == pytest.approx(700.0 / 3.0))
    click(four, 0, Qt.KeyboardModifier.ControlModifier)  # the one that was chosen first
    qtbot.waitUntil(lambda: curves_of(four).get("mean of 2") == 300.0)
    assert curves_of(four).keys() == {"± 1 SD", "step 2", "step 3", "mean of 2"}
    assert legend_of(four) == {"± 1 SD", "mean of 2"}
    click(four, 3)
    qtbot.waitUntil(lambda: curves_of(four).items() >= everyone.items())


def test_each_of_a_thousand_curves_is_drawn_and_every_second_one_of_more():
    """Who saves them counts on having all; painting more would hold up the window."""
    walked = [Stance(replace(STEP, step=k), (1.0,) * 101) for k in range(1001)]
    named = [[one.name for one in stance_drawing(walked[:count]).series][1:-1] for count in (1000, 1001)]
    assert named == [[f"step {k}" for k in range(1000)], [f"step {k}" for k in range(0, 1001, 2)]]
