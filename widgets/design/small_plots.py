"""Updates of the small plots in nodes."""

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from underfoot.engine.reports import Outlines, Preview
from underfoot.widgets.design.preview_signal import event_rows, signal_of

if TYPE_CHECKING:
    from underfoot.widgets.design.canvas import Canvas


class SmallPlots(QObject):
    """Requests the outdated small plots of all visible nodes together, and shows the results."""

    outlines_requested = Signal(list)
    """Requests the responses of these nodes to one step, for `show_outlines`."""

    signal_ranges_changed = Signal(dict)
    """Least and largest value of signals, by "node.port"."""

    def __init__(self, canvas: "Canvas") -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._stale: set[str] = set()
        self._requested: set[str] = set()
        self._signal_ranges: dict[str, tuple[float, float]] = {}
        self.is_waiting = False
        """Whether a request is pending."""

    def mark_stale(self, nodes: Iterable[str]) -> None:
        """Mark the plots of these nodes as outdated."""
        changed = set(nodes)
        self._stale |= changed
        self._requested -= changed

    def retain(self, nodes: Iterable[str]) -> None:
        """Discard the plots and the signals' ranges of all other nodes: a new node may get the id of a removed one."""
        kept = set(nodes)
        self._stale &= kept
        self._canvas.patch_scene.retain_curves(kept)
        ranges = {name: ends for name, ends in self._signal_ranges.items() if name.rpartition(".")[0] in kept}
        if ranges != self._signal_ranges:
            self._signal_ranges = ranges
            self.signal_ranges_changed.emit(ranges)

    def forget_request(self) -> None:
        """Forget the current request, because a new one may replace it."""
        self.is_waiting = False

    @property
    def are_stale(self) -> bool:
        """Whether any plots are outdated, visible or not."""
        return bool(self._stale)

    def request_visible(self, except_node: str) -> bool:
        """Request the outdated plots of visible nodes except `except_node`; return whether there were any."""
        nodes, stale = self._canvas.patch_scene.nodes, self._stale - {except_node}
        visible = [id for id in self._canvas.visible_ids() if id in stale and nodes[id].description.outputs]
        if visible:
            self._requested, self.is_waiting = set(visible), True
            self.outlines_requested.emit(visible)
        return bool(visible)

    def show_outlines(self, outlines: Outlines) -> set[str]:
        """Show the plots that have not become outdated since the request; return their nodes."""
        self.is_waiting = False
        shown, self._requested = self._requested & set(self._canvas.patch_scene.nodes), set()
        for node in shown:
            self._show(node, outlines.signals, outlines.events)
        self.signal_ranges_changed.emit(self._signal_ranges)
        self._stale -= shown
        return shown

    def show_preview(self, node: str, preview: Preview) -> None:
        """Show the small plot of a node from its full preview."""
        frames = max(preview.force_n.shape[0], 1)
        events = {}
        for port, rows in preview.events.items():
            found = event_rows(rows)
            events[port] = np.column_stack([found[:, 0] / frames, found[:, 1]])
        if node in self._canvas.patch_scene.nodes:
            self._show(node, preview.signals, events)
            self.signal_ranges_changed.emit(self._signal_ranges)
        self._stale.discard(node)

    def _show(self, node: str, signals: Mapping[str, NDArray[Any]], events: Mapping[str, NDArray[Any]]) -> None:
        ports = [row.port for row in self._canvas.patch_scene.nodes[node].description.outputs]
        for port in ports:
            values = np.asarray(signal_of(signals, node, port.name), float)
            if port.kind == "signal" and values.size:
                self._signal_ranges[f"{node}.{port.name}"] = (float(values.min()), float(values.max()))
        if ports and ports[0].kind == "event":
            self._canvas.patch_scene.show_curve(node, signal_of(events, node, ports[0].name).reshape(-1, 2))
        elif ports:
            self._canvas.patch_scene.show_curve(node, np.asarray(signal_of(signals, node, ports[0].name), float))
