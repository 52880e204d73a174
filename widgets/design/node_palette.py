"""The palette: all node types, to be dragged onto the canvas or added by Enter."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QVBoxLayout, QWidget

from underfoot.patch.node import Registry
from underfoot.widgets.design.node_list import NodeList, SearchField


class NodePalette(QWidget):
    """A search field and node types by family. `chosen` carries the type to add."""

    chosen = Signal(str)

    def __init__(self, registry: Registry, parent: QWidget) -> None:
        super().__init__(parent)
        self.setProperty("role", "panel")
        self.field = SearchField("Search nodes", self)
        self.list = NodeList(registry, self)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 4, 8)
        column.setSpacing(4)
        column.addWidget(self.field)
        column.addWidget(self.list)
        self.field.textChanged.connect(self.list.filter_by)
        self.field.stepped.connect(self.list.step)
        self.field.return_pressed.connect(self._enter)
        self.list.chosen.connect(self.chosen)

    def _enter(self) -> None:
        if self.list.current():
            self.chosen.emit(self.list.current())
