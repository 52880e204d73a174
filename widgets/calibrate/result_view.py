"""The last page: the verdict in plain words, remarks, and the figures, new and previous."""

from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from underfoot.calibration.result import Result
from underfoot.calibration.results.drift import drift
from underfoot.floor.profile import Part
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.calibrate.quantity_views import QuantityTable


class ResultView(QWidget):
    """Shows a result beside the profile's previous part."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._shown: Result | None = None
        self.title = theme.label("", "title")
        self.verdict = theme.label("")
        self.warnings = theme.label("", "force")
        self.table = QuantityTable("Figures of the result")
        self.table.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Expanding)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(theme.GRID)
        theme.wrap(self.title, self.verdict, self.warnings)
        for label in (self.title, self.verdict, self.warnings):
            layout.addWidget(label)
        layout.addSpacing(theme.GRID)
        layout.addWidget(self.table, 1)

    def show_result(self, result: Result, before: Part | None, *, simulated: bool) -> None:
        """Show this result, of a `simulated` tile or not; `before` is the part of the profile that it would replace."""
        if result is self._shown:
            return
        self._shown = result
        self.title.setText(result.title)
        self.verdict.setText(pretty_text(result.verdict))
        theme.set_role(self.verdict, "good" if result.good else "alarm")
        lines = [*result.warnings, *filter(None, [drift(result.with_origin(simulated=simulated).part, before)])]
        self.warnings.setText("\n".join(f"•  {pretty_text(line)}" for line in lines))
        self.warnings.setVisible(bool(lines))
        old = None if before is None else before.measured
        self.table.show_quantities(result.quantities, "this time", old, "" if before is None else f"of {before.made}")
