"""Run time as a function of error of the selected node, drawn during measurement, with the node's present point."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from underfoot.drawing import Drawing
from underfoot.engine.reports import ErrorCurveDrawn
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.controls.panels import chip
from underfoot.widgets.plots.plot import Plot

_PLOT_PX = 184


class ErrorView(QWidget):
    """The curve, a button that opens and closes it, and a line of text on the node's present point."""

    toggled = Signal()
    """The view was opened and needs a measurement, or closed and needs none any more."""

    def __init__(self) -> None:
        super().__init__()
        tip = "What the asked error costs, measured on this computer; closed, nothing is measured"
        self.toggle_button = chip("Run time over error", tip, self, checked=True)
        self.toggle_button.toggled.connect(self._toggle)
        self.plot = Plot("Run time over error")
        self.plot.setFixedHeight(_PLOT_PX)
        self.summary = theme.paragraph("", "muted")
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 8, 0, 0)
        column.setSpacing(4)
        for widget in (self.toggle_button, self.plot, self.summary):
            column.addWidget(widget)
        self._measured_state: object = None
        self._is_measuring = self._is_known = False
        self.plot.show_drawing(Drawing("", "error found", "run time, ms", x_log=True, y_log=True))

    @property
    def wants_curve(self) -> bool:
        """Whether a measurement is needed: the curve is visible, and not complete."""
        return self.toggle_button.isChecked() and not self._is_known

    def set_state(self, state: object) -> None:
        """Set the node and parameters of the curve; a change discards the current curve."""
        if state != self._measured_state:
            self._measured_state = state
            self._clear_state()

    def start_measuring(self) -> None:
        """Begin a measurement: later curves belong to the latest state."""
        self._is_measuring = True

    def show_curve(self, curve: ErrorCurveDrawn) -> None:
        """Show the curve as far as it has been measured."""
        if not self._is_measuring:
            return
        self._is_known = curve.left == 0
        self.plot.show_drawing(curve.drawing)
        to_come = f"; measuring, {curve.left} to come" if curve.left else ""
        self.summary.setText(pretty_text(curve.error or curve.description + to_come))

    def _toggle(self, on: bool) -> None:
        self.plot.setVisible(on)
        self.summary.setVisible(on)
        if not self._is_known:
            self._clear_state()
        self.toggled.emit()

    def _clear_state(self) -> None:
        self._is_measuring = self._is_known = False
        self.summary.setText("measured when the engine's previews are done")
