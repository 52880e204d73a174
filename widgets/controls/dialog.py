"""What the window's dialogs have in common."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QSizePolicy, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.scrolled import Scrolled

FRAME_PX = 4 * theme.GRID
"""What a screen has around a dialog: its frame, and a bar."""


def room_for(dialog: QWidget) -> QSize:
    """Return the largest size that a dialog may have on its screen."""
    return dialog.screen().availableSize() - QSize(FRAME_PX, FRAME_PX)


class Dialog(QDialog):
    """A dialog with this title, no larger than the screen, which is deleted when it closes."""

    def __init__(self, title: str, parent: QWidget | None) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle(title)

    def column(self, gap_px: int = 2 * theme.GRID) -> QVBoxLayout:
        """Return the column of all that the dialog has, within its margins."""
        made = QVBoxLayout(self)
        made.setContentsMargins(theme.MARGINS)
        made.setSpacing(gap_px)
        return made

    def scrolled(self, column: QVBoxLayout) -> QVBoxLayout:
        """Return a column within that of the dialog, which scrolls on a low screen; what follows it stays in sight."""
        inside = QWidget()
        made = QVBoxLayout(inside)
        made.setContentsMargins(0, 0, 0, 0)
        made.setSpacing(2 * theme.GRID)
        area = Scrolled(inside)
        area.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        column.addWidget(area)
        return made

    def button_row(self, *standard: QDialogButtonBox.StandardButton) -> QDialogButtonBox:
        """Return a row of these buttons, which accept or reject the dialog by what they are; more can be added."""
        row = QDialogButtonBox()  # whose place among the fields is that in the layout, also for Tab
        for button in standard:
            row.addButton(button)
        row.accepted.connect(self.accept)
        row.rejected.connect(self.reject)
        return row

    def showEvent(self, event: QShowEvent) -> None:
        self.resize(self.size().boundedTo(room_for(self)))
        super().showEvent(event)
