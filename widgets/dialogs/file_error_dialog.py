"""An error in a file, with the lines around its place."""

from PySide6.QtCore import Qt
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QDialogButtonBox, QWidget

from underfoot.file_places import FilePlace
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog

WIDTH_PX = 64 * theme.GRID
MAX_LETTERS = 72
"""Number of characters shown of a line."""


class FileErrorDialog(Dialog):
    """Shows the file that could not be read, the line, and what is allowed there; deleted when closed."""

    def __init__(self, place: FilePlace, parent: QWidget) -> None:
        super().__init__("A file was not read", parent)
        self.setFixedWidth(WIDTH_PX)
        self.file = theme.paragraph(place.file, "muted")
        self.error_text = theme.paragraph(f"Line {place.line}: {place.says}" if place.line else place.says)
        self.lines = theme.label("\n".join(_numbered_lines(place)), "code")
        self.lines.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.lines.setVisible(bool(self.lines.text()))
        buttons = self.button_row(QDialogButtonBox.StandardButton.Close)
        layout = self.column(theme.GRID)
        layout.addWidget(theme.label("This file cannot be read", "title"))
        for label in (self.file, self.error_text, self.lines):
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            layout.addWidget(label)
        layout.addWidget(buttons)


def _numbered_lines(place: FilePlace) -> list[str]:
    """Return the lines around the place with their numbers, and a mark at the line of the error."""
    cut = ((k, f"{line[:MAX_LETTERS]}…" if len(line) > MAX_LETTERS else line) for k, line in place.excerpt())
    return [f"{'▸' if k == place.line else ' '}{k:5}  {line}" for k, line in cut]
