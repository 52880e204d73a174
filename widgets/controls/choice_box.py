"""A box of choices that the wheel does not change on its way past."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QComboBox, QWidget

from underfoot.widgets.controls.wheel import takes_wheel


class ChoiceBox(QComboBox):
    """Takes the wheel only with the focus, which the wheel alone does not give it: a form around it is scrolled."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if takes_wheel(self, event):
            super().wheelEvent(event)


def name_control(control: QWidget, name: str) -> None:
    """Give a control a name for screen readers. On Linux that of a box is its choice, and of what it is only the
    description.
    """
    control.setAccessibleName(name)
    if isinstance(control, QComboBox):
        control.setAccessibleDescription(": ".join(filter(None, (name, control.toolTip()))))
