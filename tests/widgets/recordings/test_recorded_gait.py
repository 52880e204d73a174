"""The gait of who walked in a recording."""

from made_steps import STEP
from msgspec.structs import replace
from PySide6.QtCore import QEvent
from PySide6.QtGui import QHelpEvent
from PySide6.QtWidgets import QApplication

from underfoot.records.survey import Stance
from underfoot.widgets.recordings.steps import RecordedSteps


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
