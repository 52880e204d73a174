"""Run time of a block: of each stage and each node of the patch, and which nodes sleep."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QComboBox,
    QDialogButtonBox,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from underfoot.bench.block_stages import STAGES, BlockStages, NodeCost, block_stages
from underfoot.floor.layout import Floor
from underfoot.patch.patch import Patch
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.tables import offer_copy
from underfoot.widgets.polled_process import PolledProcess

_COLUMNS = ("", "ms a second", "Share", "")
_FIGURES = (1, 2)


class CostDialog(Dialog):
    """Measures a patch on a floor in another process, and shows the result. Closing it stops the measurement.

    `how` is what else `block_stages` takes, but the feet.
    """

    def __init__(self, patch: Patch, floor: Floor, how: Mapping[str, Any], parent: QWidget | None = None) -> None:
        super().__init__("Cost of a block", parent)
        self._patch, self._floor, self._how = patch, floor, how
        self._measurement = PolledProcess("cost", self)
        self._measurement.received.connect(self._show_answer)
        self._measurement.ended.connect(lambda _: self._stop("The process that measured died; measure again."))
        tiles = len(floor.tiles)
        self.feet = QComboBox()
        self.feet.setAccessibleName("Tiles with a foot on them")
        for text, count in (("every tile", tiles), ("two tiles", min(2, tiles)), ("no tile", 0)):
            self.feet.addItem(text, count)
        self.start_button = QPushButton("Measure")
        self.start_button.clicked.connect(self._start_or_stop)
        self.summary = theme.paragraph("", "muted")
        self.table = QTreeWidget()
        self.table.setAccessibleName("Run time of stages and nodes")
        self.table.setHeaderLabels(_COLUMNS)
        self.table.setHeaderHidden(True)  # until there is something below it
        for figure in _FIGURES:
            self.table.headerItem().setTextAlignment(figure, Qt.AlignmentFlag.AlignRight)
        self.table.setRootIsDecorated(False)
        self.table.setSelectionMode(QTreeWidget.SelectionMode.ExtendedSelection)
        offer_copy(self.table)
        self.table.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.table.header().setSectionResizeMode(len(_COLUMNS) - 1, QHeaderView.ResizeMode.Stretch)
        top = QHBoxLayout()
        for widget in (theme.label("A foot steps on"), self.feet, self.start_button):
            top.addWidget(widget)
        top.addStretch(1)
        column = self.column(theme.GRID)
        column.addLayout(top)
        column.addWidget(self.summary)
        column.addWidget(self.table)
        column.addWidget(self.button_row(QDialogButtonBox.StandardButton.Close))
        self.resize(128 * theme.GRID, 72 * theme.GRID)
        self._start_or_stop()

    def done(self, result: int) -> None:
        """Stop the measurement; Close, Esc and the frame's button end here."""
        self._stop("")
        super().done(result)

    def _start_or_stop(self) -> None:
        if self._measurement.is_running:
            self._stop("Stopped.")
            return
        feet = self.feet.currentData()
        self._measurement.begin(partial(block_stages, self._patch, self._floor, feet=feet, **self._how))
        self.start_button.setText("Stop")
        self.summary.setText("Measuring for about ten seconds, in another process; other work makes it seem slower")

    def _stop(self, message: str) -> None:
        self._measurement.stop()
        self.start_button.setText("Measure")
        self.summary.setText(message)

    def _show_answer(self, answers: list[BlockStages | str]) -> None:
        answer = answers[0]
        if isinstance(answer, str):
            self._stop(answer)
        else:
            self._stop("")
            self.show_cost(answer)

    def show_cost(self, found: BlockStages) -> None:
        """Show what was measured."""
        self.summary.setText(
            f"Block {found.block}, a foot on {found.stood_on} of {counted(found.tiles, 'tile')}: "
            f"{found.whole_ms:.1f} ms a second of sound, {found.whole_ms / 10.0:.1f} % of a core"
        )
        self.table.clear()
        self.table.setHeaderHidden(False)
        self._heading("STAGES")
        for stage in found.stages:
            self._row(stage.stage, stage.ms, found.whole_ms, STAGES[stage.stage])
        self._row("reading", found.reading_ms, 0.0, "not in the block: readings to newtons, where devices are read")
        if found.nodes or found.left_out:
            self._heading("NODES")
        names = self._patch.names()
        for node in sorted(found.nodes, key=lambda node: -node.ms):
            self._row(names[node.node], node.ms, found.whole_ms, _cost_of_node(node, found.tiles))
        for id in found.left_out:
            self._row(names[id], 0.0, 0.0, "left out: no output needs it")

    def _heading(self, text: str) -> None:
        item = QTreeWidgetItem([text])
        item.setFont(0, theme.font(theme.SMALL_PX, bold=True))
        item.setFlags(Qt.ItemFlag.ItemIsEnabled)
        self.table.addTopLevelItem(item)

    def _row(self, name: str, ms: float, whole_ms: float, text: str) -> None:
        share = f"{100.0 * ms / whole_ms:.1f} %" if whole_ms else ""
        item = QTreeWidgetItem([name, f"{ms:.3f}", share, text])
        item.setToolTip(len(_COLUMNS) - 1, text)
        for column in _FIGURES:
            item.setTextAlignment(column, Qt.AlignmentFlag.AlignRight)
        self.table.addTopLevelItem(item)


def _cost_of_node(node: NodeCost, tiles: int) -> str:
    sleeps = f"sleeps when {node.sleeps}" if node.sleeps else "never sleeps"
    return f"{node.type}, awake on {node.tiles_awake:.1f} of {counted(tiles, 'tile')}; {sleeps}"
