"""Run time over error of the selected node, drawn as it is measured, with the point where the node stands."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QToolButton, QVBoxLayout, QWidget

from underfoot.drawing import Drawing
from underfoot.engine.reports import ErrorCurveDrawn
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.plots.plot import Plot

_PLOT_PX = 184


class ErrorView(QWidget):
    """A button that opens and closes the curve, the curve, and a line of where the node stands."""

    toggled = Signal()
    """It was opened, and something is to be measured; or closed, and nothing is any more."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.opener = QToolButton(self)
        self.opener.setText("Run time over error")
        self.opener.setCheckable(True)
        self.opener.setChecked(True)
        self.opener.setProperty("role", "chip")
        self.opener.setToolTip("What the asked error costs, measured on this computer; closed, nothing is measured")
        self.opener.toggled.connect(self._open)
        self.plot = Plot("Run time over error")
        self.plot.setFixedHeight(_PLOT_PX)
        self.told = theme.label("", "muted")
        self.told.setWordWrap(True)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 8, 0, 0)
        column.setSpacing(4)
        for widget in (self.opener, self.plot, self.told):
            column.addWidget(widget)
        self._of: object = None
        self._is_asked = self._is_known = False
        self.plot.show_drawing(Drawing("", "error found", "run time, ms", x_log=True, y_log=True))

    @property
    def wants_curve(self) -> bool:
        """Whether something is to be measured: the curve is to be seen, and is not known."""
        return self.opener.isChecked() and not self._is_known

    def set_measured(self, of: object) -> None:
        """What the curve is of: where that has changed, the one that is shown is not it any more."""
        if of != self._of:
            self._of = of
            self._wait()

    def begin(self) -> None:
        """What comes from now on is of what was set last."""
        self._is_asked = True

    def show_curve(self, curve: ErrorCurveDrawn) -> None:
        """Show what is known by now."""
        if not self._is_asked:
            return
        self._is_known = curve.left == 0
        self.plot.show_drawing(curve.drawing)
        to_come = f"; measuring, {curve.left} to come" if curve.left else ""
        self.told.setText(pretty_text(curve.error or curve.description + to_come))

    def _open(self, on: bool) -> None:
        self.plot.setVisible(on)
        self.told.setVisible(on)
        if not self._is_known:
            self._wait()
        self.toggled.emit()

    def _wait(self) -> None:
        self._is_asked = self._is_known = False
        self.told.setText("measured when the engine's previews are done")
