"""The gait of each person, told under the mouse."""

from collections.abc import Callable, Sequence

from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QWidget

from underfoot.floor.footsteps import Step
from underfoot.floor.gait_summary import GaitTotals


class GaitTip(QObject):
    """Tells the gait of each person of some steps over widgets. It is computed when it is asked for, not at each step.

    `steps` returns the steps, all of a person's in a row: figures such as the stride time are of neighbours.
    """

    def __init__(self, widgets: Sequence[QWidget], steps: Callable[[], Sequence[Step]]) -> None:
        super().__init__(widgets[0])
        self._steps = steps
        for widget in widgets:
            widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and isinstance(watched, QWidget):
            totals = GaitTotals()
            totals.add(self._steps())
            watched.setToolTip("\n".join(totals.lines()))
        return super().eventFilter(watched, event)
