"""The column beside the canvas: nodes to add, or presets to open."""

from PySide6.QtWidgets import QButtonGroup, QHBoxLayout, QPushButton, QStackedWidget, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.panels import one_of_several
from underfoot.widgets.design.node_palette import NodePalette
from underfoot.widgets.design.preset_panel import PresetPanel

NODES, PRESETS = "Nodes", "Presets"
_TIPS = {NODES: "Nodes to build with (/ on the canvas)", PRESETS: "Presets to hear and to begin with (Ctrl+P)"}


class SidePanel(QWidget):
    """Two pages, one of which is visible."""

    def __init__(self, palette: NodePalette, presets: PresetPanel, parent: QWidget) -> None:
        super().__init__(parent)
        theme.fill(self, "panel")
        self._pages: dict[str, QWidget] = {NODES: palette, PRESETS: presets}
        self.presets = presets
        self._stack = QStackedWidget()
        self.tabs: dict[str, QPushButton] = {}
        group, line = QButtonGroup(self), QHBoxLayout()
        line.setContentsMargins(8, 8, 4, 0)
        line.setSpacing(4)
        for name, page in self._pages.items():
            self._stack.addWidget(page)
            tab = self.tabs[name] = one_of_several(name, _TIPS[name])
            tab.clicked.connect(lambda _=False, name=name: self.show_page(name))
            group.addButton(tab)
            line.addWidget(tab)
        line.addStretch(1)
        self.tabs[NODES].setChecked(True)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(line)
        column.addWidget(self._stack, 1)

    @property
    def page(self) -> str:
        """The name of the visible page."""
        return next(name for name, page in self._pages.items() if page is self._stack.currentWidget())

    def show_page(self, name: str) -> None:
        """Show a page, with the focus in its search field."""
        if name != PRESETS:
            self.presets.end_audition()
        self.tabs[name].setChecked(True)
        self._stack.setCurrentWidget(self._pages[name])
        if name == PRESETS:
            self.presets.refresh()
            self.presets.field.setFocus()
            self.presets.field.selectAll()
