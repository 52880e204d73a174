"""A sample of another text size, and the choice to restart Underfoot in it at once."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDialogButtonBox, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.key_names import with_native_keys

SAMPLE = "Level −12.0 dB"


class TextSizeDialog(Dialog):
    """Shows a line in the chosen size. It closes itself for good."""

    restart_requested = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__("Text size", parent)
        self.title = theme.label("", "title")
        self.sample = theme.label(SAMPLE)
        explained = theme.paragraph(
            "Text, rows and nodes have this size when Underfoot has started again. What is open comes back, saved or"
            + with_native_keys(" not, and can still be undone; only the sound pauses. Ctrl++ and Ctrl+- choose on."),
            "muted",
        )
        buttons = self.button_row()
        self.now = buttons.addButton("Restart now", QDialogButtonBox.ButtonRole.AcceptRole)
        self.later = buttons.addButton("At the next start", QDialogButtonBox.ButtonRole.RejectRole)
        self.now.setDefault(True)
        self.accepted.connect(self.restart_requested)
        layout = self.column(theme.GRID)
        for widget in (self.title, self.sample, explained, buttons):
            layout.addWidget(widget)
        self.setMinimumWidth(52 * theme.GRID)

    def show_size(self, percent: int, running_percent: int) -> None:
        """Show the sample as it would be, in a window that has `running_percent` now."""
        self.title.setText(f"Text {percent} %")
        self.sample.setFont(theme.font(round(theme.TEXT_PX * percent / running_percent)))
