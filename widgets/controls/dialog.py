"""What the window's dialogs have in common."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QDialog, QDialogButtonBox, QVBoxLayout, QWidget

from underfoot.widgets import theme


class Dialog(QDialog):
    """A dialog with this title, which is deleted when it closes."""

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

    def button_row(self, *standard: QDialogButtonBox.StandardButton) -> QDialogButtonBox:
        """Return a row of these buttons, which accept or reject the dialog by what they are; more can be added."""
        row = QDialogButtonBox()  # whose place among the fields is that in the layout, also for Tab
        for button in standard:
            row.addButton(button)
        row.accepted.connect(self.accept)
        row.rejected.connect(self.reject)
        return row
