"""Several drawings in a column."""

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QScrollArea, QVBoxLayout, QWidget

from underfoot.drawing import Drawing
from underfoot.widgets import theme
from underfoot.widgets.plots.plot import Plot

MIN_PX = 304
"""Least height of a drawing, if the column is as high; below it, the column scrolls."""
MIN_MAP_PX = 480
"""Least height of a map, whose axes have the same scale."""
LEAST_PX = 176
"""No drawing is lower, though a column may be."""
LEAST_WIDTH_PX = 280
"""Nor is a column narrower: the axes could not be read."""


class DrawingColumn(QScrollArea):
    """Drawings one below the other; as many as fit are visible, the rest by scrolling."""

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setMinimumWidth(LEAST_WIDTH_PX)
        self.setAccessibleName("Drawings")
        inside = QWidget()
        theme.fill(inside, "ground")
        self._layout = QVBoxLayout(inside)
        self._layout.setContentsMargins(theme.GRID, theme.GRID, 0, theme.GRID)
        self._layout.setSpacing(2 * theme.GRID)
        self.empty_text = theme.paragraph("", "muted")
        self.empty_text.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._layout.addWidget(self.empty_text)
        self._plots: list[Plot] = []
        self.setWidget(inside)
        self.show_drawings((), "")

    @property
    def plots(self) -> list[Plot]:
        """Return the visible plots."""
        return [plot for plot in self._plots if not plot.isHidden()]

    def show_drawings(self, drawings: Sequence[Drawing], empty_text: str) -> None:
        """Show these drawings, or a text on why there are none."""
        while len(self._plots) < len(drawings):
            plot = Plot()
            self._plots.append(plot)
            self._layout.addWidget(plot)
        for plot, drawing in zip(self._plots, drawings, strict=False):
            plot.show_drawing(drawing)
        self._fit_heights()
        for place, plot in enumerate(self._plots):
            plot.setVisible(place < len(drawings))
        self.empty_text.setText(empty_text)
        self.empty_text.setVisible(not drawings)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus if len(drawings) > 1 else Qt.FocusPolicy.NoFocus)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_heights()

    def _fit_heights(self) -> None:
        """Limit the height of a drawing so that its axis is visible without scrolling."""
        margins = self._layout.contentsMargins()
        room = self.viewport().height() - margins.top() - margins.bottom()
        for plot in self._plots:
            least = MIN_MAP_PX if plot.drawing.equal else MIN_PX
            plot.setMinimumHeight(max(min(least, room), LEAST_PX))
