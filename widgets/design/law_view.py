"""The distributions of a node, side by side; a line of text while they are computed."""

from itertools import zip_longest

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QWidget

from underfoot.engine.reports import Distributions
from underfoot.widgets import theme
from underfoot.widgets.plots.plot import Plot

LAWS_PAGE = 3
"""Number of a node's distributions that are drawn."""


class LawView(QStackedWidget):
    """Shows axes only once the quantity is known, and hides outdated distributions after `late_after_ms`."""

    def __init__(self, late_after_ms: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.text = theme.label("", "muted")
        self.text.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.text.setWordWrap(True)
        self.plots = [Plot(f"Law {k + 1}") for k in range(LAWS_PAGE)]
        page = QWidget(self)
        row = QHBoxLayout(page)
        row.setContentsMargins(8, 0, 8, 8)
        for plot in self.plots:
            row.addWidget(plot)
        self.addWidget(self.text)
        self.addWidget(page)
        self._late = QTimer(self, singleShot=True, interval=late_after_ms)
        self._late.timeout.connect(self.wait)

    def expect(self) -> None:
        """Expect new distributions; the current ones stay visible for a short time."""
        self._late.start()

    def wait(self) -> None:
        """Show that distributions are being computed."""
        self._show_text("being made…")

    def show_laws(self, laws: Distributions) -> None:
        """Show the distributions, or the reason why there are none."""
        self._late.stop()
        if laws.error or not laws.drawings:
            self._show_text(laws.error or "it draws from no law")
            return
        for plot, drawing in zip_longest(self.plots, laws.drawings):
            plot.setVisible(drawing is not None)
            if drawing is not None:
                plot.show_drawing(drawing)
        self.setCurrentIndex(1)

    def _show_text(self, text: str) -> None:
        self.text.setText(text)
        self.setCurrentIndex(0)
