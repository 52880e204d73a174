"""The preview: the response of the selected node to one step, its distributions, and the tile that is stepped on."""

from collections.abc import Sequence
from itertools import pairwise

from PySide6.QtCore import QSignalBlocker, QTimer, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QSizePolicy, QStackedWidget, QVBoxLayout, QWidget

from underfoot.engine.reports import Distributions, Preview
from underfoot.floor.layout import Tile
from underfoot.patch.node import NodeType, Port
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.panels import chip
from underfoot.widgets.design.distribution_view import LATE_AFTER_MS, DistributionView
from underfoot.widgets.design.preview_plots import NARROW_PX, PreviewPlots
from underfoot.widgets.design.preview_signal import PreviewSignal, event_rows, signal_of
from underfoot.widgets.design.tile_pad import TilePad

_LEAST_NAME_PX = 192
"""Room for a name in a narrow panel: a longer one is cut short, rather than making all of Design wider."""


class PreviewPanel(QWidget):
    """Shows one output of one node. It requests nothing: `expect` announces a preview, and `show_preview` shows it."""

    struck = Signal(str, float)
    pressed = Signal(str, float, float, float)
    distributions_requested = Signal()
    """The distributions of the node are needed with the next preview."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        theme.fill(self, "ground")
        self._ports: dict[str, Port] = {}
        self._preview: Preview | None = None
        self._other: tuple[Preview, str, Port] | None = None
        self._other_slot, self._shows_other = "B", True
        self._is_late = False
        self.node = self._why_silent = ""
        self.title = ElidedLabel("title")
        self.short_title = ElidedLabel("heading")
        self.note = ElidedLabel("small")
        self.output = QComboBox(self)
        self.output.setAccessibleName("Output")
        self.output.setToolTip("The output that is shown")
        self.output.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.output.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.output.hide()
        self.distributions = chip(
            "Distributions",
            "The distributions that the node draws from, instead of what it does in a step",
        )
        self.distributions.hide()
        self.distribution_view = DistributionView()
        self.distribution_view.setContentsMargins(8, 0, 8, 8)
        self.tiles = QComboBox(self)
        self.tiles.setAccessibleName("Tile")
        self.tiles.setToolTip("The tile that is shown, struck and pressed")
        self.tiles.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToContents)
        self.tiles.setMinimumWidth(5 * theme.GRID)
        self.tiles.setMaximumWidth(18 * theme.GRID)
        self.tiles.hide()
        self.pad = TilePad(self)
        self.plots = PreviewPlots(self.pad)
        self._lay_out()
        self._late = QTimer(self, singleShot=True, interval=LATE_AFTER_MS)
        self._late.timeout.connect(self._show_late)
        self._connect()
        self.clear()

    def _connect(self) -> None:
        self.output.activated.connect(self._draw)
        self.plots.noted.connect(self.note.set_full_text)
        self.distributions.toggled.connect(self._choose_page)
        self.tiles.currentTextChanged.connect(self.pad.set_tile)
        self.pad.struck.connect(self.struck)
        self.pad.pressed.connect(self.pressed)

    def _lay_out(self) -> None:
        head = self._head = QHBoxLayout()
        head.setContentsMargins(16, 8, 8, 0)
        head.setSpacing(2)
        for box in (self.output, self.tiles):
            box.setProperty("role", "chip")
        head.addWidget(self.title, 1)
        in_line = (self.output, self.distributions, *self.plots.controls, self.tiles)
        for widget in in_line:
            head.addWidget(widget)
        self._pages = QStackedWidget(self)
        self._pages.addWidget(self.plots)
        self._pages.addWidget(self.distribution_view)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(head)
        note_line = self._note_line = QHBoxLayout()
        note_line.setSpacing(theme.GRID)
        note_line.addWidget(self.short_title)
        note_line.addWidget(self.note, 1)
        column.addLayout(note_line)
        column.addWidget(self._pages, 1)
        for one, following in pairwise((*in_line, self.plots.waveform, self.plots.spectrogram, self.pad)):
            QWidget.setTabOrder(one, following)

    def clear(self) -> None:
        """Show nothing, without a node."""
        self.node, self._ports, self._preview, self._is_late = "", {}, None, False
        self._show_name("Preview")
        self.note.set_full_text("select a node")
        self.output.hide()
        self.distributions.hide()
        self._choose_page()
        self._late.stop()
        self._other = None
        self.plots.zoom_out()
        self._draw()

    def expect(
        self,
        node: str,
        type: NodeType,
        *,
        outputs: Sequence[Port] = (),
        output: str = "",
        why_silent: str = "",
        is_heard: bool = False,
        label: str = "",
    ) -> None:
        """Announce a preview of this node, called `label`; the current one stays visible for a short time.

        `outputs` are those of the type with the units that wires give them. Of another node than before `output` is
        shown, or the first. With `is_heard`, for a node that is heard and not felt, the frequency range is the audible
        one.
        """
        self._late.start()
        if self.wants_distributions:
            self.distribution_view.expect()
        self._why_silent, self.plots.is_heard = why_silent, is_heard
        self._show_name(label or type.label)
        before, self._ports = list(self._ports), {port.name: port for port in outputs or type.outputs}
        if node == self.node and list(self._ports) == before:
            return
        self.node = node
        self._preview = self._other = None
        self.plots.zoom_out()
        self._is_late = False
        self.note.set_full_text("")
        self.distributions.setVisible(type.distributions is not None)
        self._choose_page()
        self.output.clear()
        self.output.addItems(list(self._ports))
        self.output.setCurrentText(output)
        self.output.setVisible(len(self._ports) > 1)
        self._draw()

    def _show_name(self, name: str) -> None:
        """Show the node's name in the head, or in a narrow panel before the figures, where there is more room."""
        is_narrow = self.width() < NARROW_PX
        self.short_title.set_full_text(name)
        self.short_title.setMinimumWidth(min(self.short_title.sizeHint().width(), _LEAST_NAME_PX))
        self.short_title.setVisible(is_narrow)
        self._note_line.setContentsMargins(16, 4 if is_narrow else 0, 8, 2)
        line = self._note_line if is_narrow else self._head
        if line.indexOf(self.output) < 0:
            line.insertWidget(1, self.output)
            line.insertWidget(2, self.distributions)
        self.title.set_full_text("" if is_narrow else name)

    def show_preview(self, preview: Preview) -> None:
        """Show a preview."""
        self._late.stop()
        self._is_late, self._preview = False, preview
        self._draw()

    def show_other(self, preview: Preview, node: str, port: Port, slot: str) -> None:
        """Draw the output of the other slot's corresponding node over this one's."""
        self._other, self._other_slot = (preview, node, port), slot
        self._draw()

    def forget_other(self) -> None:
        """Remove the other slot's output, until a new one comes."""
        if self._other is not None:
            self._other = None
            self._draw()

    def set_overlay(self, on: bool) -> None:
        """Set whether the other slot's output is drawn."""
        self._shows_other = on
        self._draw()

    @property
    def wants_distributions(self) -> bool:
        """Whether the distributions of the node are visible."""
        return self.distributions.isChecked() and not self.distributions.isHidden()

    def show_distributions(self, distributions: Distributions) -> None:
        """Show the requested distributions."""
        self.distribution_view.show_distributions(distributions)

    def _choose_page(self) -> None:
        """Show the page of the step's response, or of the distributions."""
        wanted = self.wants_distributions
        self._pages.setCurrentWidget(self.distribution_view if wanted else self.plots)
        for widget in self.plots.controls:
            widget.setEnabled(not wanted)
        self.note.setVisible(not wanted)  # it describes the step
        if wanted:
            self.distribution_view.wait()
            self.distributions_requested.emit()

    def set_tiles(self, tiles: Sequence[Tile]) -> None:
        """Set the tiles that can be struck and pressed."""
        self.pad.set_tiles(tiles)
        now = self.pad.tile.id
        with QSignalBlocker(self.tiles):
            self.tiles.clear()
            self.tiles.addItems([tile.id for tile in tiles])
            self.tiles.setCurrentText(now)
        self.tiles.setVisible(len(tiles) > 1)

    def choose_output(self, name: str) -> None:
        """Show this output of the node; nothing changes if it has none of this name."""
        if name in self._ports:
            self.output.setCurrentText(name)
            self._draw()

    @property
    def port(self) -> Port | None:
        """The output shown; None if there is none."""
        return self._ports.get(self.output.currentText())

    def _draw(self) -> None:
        port, preview = self.port, self._preview
        if port is None or preview is None or preview.error:
            self.plots.show_nothing("being made…" if self._is_late else "")
            if preview is not None and preview.error:
                self.note.set_full_text(preview.error)
            elif self.node and port is None:
                self.note.set_full_text("it has no output to be seen")
            return
        signal = PreviewSignal.of(preview, self.node, port)
        if port.kind == "event":
            rows = event_rows(signal_of(preview.events, self.node, port.name))
            self.plots.show_events(signal, rows, self._why_silent)
            is_previewed = port.name in preview.events or f"{self.node}.{port.name}" in preview.events
            self.note.set_full_text(counted(len(rows), "event") if is_previewed else "the preview holds no events")
        else:
            self.plots.show_signal(signal, self._other_signal(), self._other_slot, self._why_silent)

    def _other_signal(self) -> PreviewSignal | None:
        other = self._other
        if other is None or not self._shows_other or other[0].error or other[2].kind == "event":
            return None
        return PreviewSignal.of(*other)

    def _show_late(self) -> None:
        """Replace the outdated preview by a message when the new one takes long."""
        self._is_late, self._preview = True, None
        self._draw()
        self.note.set_full_text("being made…")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_name(self.short_title.full_text)
        self.plots.arrange_for(self.width(), self.height())
