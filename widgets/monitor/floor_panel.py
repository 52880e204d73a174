"""The panel of the floor: its map, and what can be done to it."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QComboBox, QVBoxLayout, QWidget

from underfoot.engine.commands import PressTile, Tare, Walk
from underfoot.floor.layout import Floor
from underfoot.widgets import theme
from underfoot.widgets.controls.panels import tool_button, with_header
from underfoot.widgets.floor_map import FloorMap
from underfoot.widgets.pressed_floor import DEFAULT_PRESS_N

PRESSES_N = (50.0, 100.0, 200.0, 400.0, 800.0, 1500.0)


class FloorPanel(QWidget):
    """Shows the floor from above; emits commands for it."""

    commanded = Signal(object)
    """A `Command` for the engine."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.map = FloorMap()
        self.walker = tool_button("walk", "Walker", "Let the simulated person walk over the floor", checkable=True)
        self.walker.clicked.connect(lambda on: self.commanded.emit(Walk(on)))
        self._press_label = theme.label("Press", "muted")
        self.press_n = QComboBox()
        self.press_n.setAccessibleName("Force of a press with the mouse")
        self.press_n.setToolTip("Force with which the mouse presses a simulated tile")
        for force_n in PRESSES_N:
            self.press_n.addItem(f"{force_n:.0f} N", force_n)
        self.press_n.setCurrentIndex(PRESSES_N.index(DEFAULT_PRESS_N))
        self.press_n.currentIndexChanged.connect(lambda at: self.map.set_press(PRESSES_N[at]))
        self.tare = tool_button("balance", "Tare", "Take the present reading of every unloaded tile as zero")
        self.tare.clicked.connect(lambda: self.commanded.emit(Tare()))
        self.map.pressed.connect(self._press)
        title = theme.label("Floor", "title")
        head = [title, None, self._press_label, self.press_n, self.walker, self.tare]
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(with_header(head, self.map, ((self.walker, self.tare), (self._press_label,)), self))

    def set_floor(self, floor: Floor, *, is_simulated: bool) -> None:
        """Show this floor; if it is simulated, a person walks on it, and the mouse presses it."""
        self.map.can_press = is_simulated
        self.map.set_floor(floor)
        for widget in (self.walker, self.press_n, self._press_label):
            widget.setVisible(is_simulated)
        self.walker.setChecked(is_simulated)

    def _press(self, tile: str, x_m: float, y_m: float, force_n: float) -> None:
        self.commanded.emit(PressTile(tile, x_m, y_m, force_n))
