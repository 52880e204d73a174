"""The distributions of a node, side by side; a line of text while they are computed."""

from itertools import zip_longest

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QWidget

from underfoot.engine.reports import Distributions
from underfoot.widgets import theme
from underfoot.widgets.plots.plot import Plot

DISTRIBUTIONS_PAGE = 3
"""Number of a node's distributions that are drawn."""
LATE_AFTER_MS = 400
"""Time in milliseconds after which the view says that distributions are being computed."""


class DistributionView(QStackedWidget):
    """Shows axes only once the quantity is known, hides outdated distributions, and draws at most `most` of them."""

    def __init__(self, most: int = DISTRIBUTIONS_PAGE) -> None:
        super().__init__()
        self.text = theme.paragraph("", "muted")
        self.text.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.plots = [Plot(f"Distribution {k + 1}") for k in range(most)]
        page = QWidget(self)
        row = QHBoxLayout(page)
        row.setContentsMargins(0, 0, 0, 0)
        for plot in self.plots:
            row.addWidget(plot)
        self.addWidget(self.text)
        self.addWidget(page)
        self._late = QTimer(self, singleShot=True, interval=LATE_AFTER_MS)
        self._late.timeout.connect(self.wait)

    def expect(self) -> None:
        """Expect new distributions; the current ones stay visible for a short time."""
        self._late.start()

    def wait(self) -> None:
        """Show that distributions are being computed."""
        self._show_text("being made…")

    def show_distributions(self, distributions: Distributions) -> None:
        """Show the distributions, or the reason why there are none."""
        self._late.stop()
        if distributions.error or not distributions.drawings:
            self._show_text(distributions.error or "it draws from no distribution")
            return
        for plot, drawing in zip_longest(self.plots, distributions.drawings):
            plot.setVisible(drawing is not None)
            if drawing is not None:
                plot.show_drawing(drawing)
        self.setCurrentIndex(1)

    def _show_text(self, text: str) -> None:
        self.text.setText(text)
        self.setCurrentIndex(0)
