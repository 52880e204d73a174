"""What is previewed next: the chosen node, then what comparing needs, then small plots, then run time over error.

One preview is requested at a time: the compiler renders them one after another.
"""

from collections.abc import Sequence

from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.engine.reports import Distributions, Outlines, Preview
from underfoot.floor.layout import Tile
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import downstream
from underfoot.widgets.design.canvas import Canvas
from underfoot.widgets.design.inspector import Inspector
from underfoot.widgets.design.patch_editing import changed_nodes, is_only_heard, outputs_with_wired_units
from underfoot.widgets.design.preview import PreviewPanel
from underfoot.widgets.design.silence import why_silent
from underfoot.widgets.design.slot_listening import SlotListening
from underfoot.widgets.design.small_plots import SmallPlots

PREVIEW_DELAY_MS = 10
"""Edits in a row, as from a slider, ask for one preview."""
IDLE_MS = 150
"""Time without edits after which the small plots of the other nodes are updated."""


class PreviewRequests(QObject):
    """Requests the previews of an edited patch, and hands those that arrive to the views that show them."""

    preview_requested = Signal(str, Tile, bool)
    """A preview of this node of the patch on this tile should be rendered and handed to `show_preview`, and whether its
    distributions should be drawn. With `OTHER_PREFIX`, a node of the patch in the other slot."""

    errors_requested = Signal(str)
    """The run time over error of this node of the patch should be measured, and handed to the inspector."""

    def __init__(self, canvas: Canvas, inspector: Inspector, preview: PreviewPanel, registry: Registry) -> None:
        super().__init__(canvas)
        self.slots: SlotListening | None = None
        self.small_plots = SmallPlots(canvas)
        self._canvas, self._inspector, self._preview, self._registry = canvas, inspector, preview, registry
        self._previewed = self._output = self._requested = self._distributions_of = ""
        self._preview_timer = QTimer(self, singleShot=True, interval=PREVIEW_DELAY_MS)
        self._preview_timer.timeout.connect(self._request_previewed)
        self._idle_timer = QTimer(self, singleShot=True, interval=IDLE_MS)
        self._idle_timer.timeout.connect(self._request_next)
        canvas.view_moved.connect(self._restart_idle)
        preview.tiles.activated.connect(self.request_all)
        preview.distributions_requested.connect(self.request_all)
        self.small_plots.signal_ranges_changed.connect(inspector.show_signal_ranges)
        self.small_plots.signal_ranges_changed.connect(canvas.patch_scene.show_signal_ranges)
        inspector.errors_toggled.connect(self._request_previewed)  # which stops the measurement, or begins one

    def compare(self, slots: SlotListening) -> None:
        """Request the previews that comparing slots A and B needs, too."""
        self.slots = slots
        self.preview_requested.connect(slots.request)
        slots.preview_requested.connect(self._request_next)
        slots.preview_update_requested.connect(self._idle_timer.start)

    # --- what asks for previews ---

    def update_patch(self, before: Patch, patch: Patch) -> None:
        """Request the previews that an edit changed."""
        changed = downstream(patch.wires, changed_nodes(before, patch))
        if self.slots is not None:
            self.slots.patch_changed(patch, changed)
        ids = {node.id for node in patch.nodes}
        is_another = patch.title != before.title  # in which a node with this id is another one
        self.small_plots.retain(ids - changed if is_another else ids)
        self.small_plots.mark_stale(changed)
        if self._previewed not in ids:
            self.choose(self._canvas.selected_ids())
        elif self._previewed in changed or self._name_and_units(before) != self._name_and_units(patch):
            self._preview_timer.start()
        self._restart_idle()

    def choose(self, ids: Sequence[str], output: str = "") -> None:
        """Preview the selected node, by this output if one is named, or, without a selection, the tile's output."""
        nodes = {node.id: node.type for node in self._patch.nodes}
        played = [id for id, type in nodes.items() if self._registry[type].is_sink]
        sinks = sorted(played, key=lambda id: self._registry[nodes[id]].to_sound)
        wanted = ids[0] if len(ids) == 1 else self._previewed if self._previewed in nodes else (sinks or [""])[0]
        if not ids and sinks:
            wanted = sinks[0]
        self._output = output
        if wanted == self._previewed:
            self._preview.choose_output(output)
            return
        self._previewed = wanted
        if wanted:
            self._preview_timer.start()
        else:
            self._preview.clear()

    def request_chosen(self) -> None:
        """Request the chosen node's preview again: what it is played through has changed."""
        self._preview_timer.start()

    def request_all(self) -> None:
        """Request all previews again, the chosen node's first: of another tile or duration, or of another session,
        which does not know what was requested of the one before.
        """
        if self.slots is not None:
            self.slots.forget()
        self._requested = ""
        self.small_plots.forget_request()
        self.small_plots.mark_stale(node.id for node in self._patch.nodes)
        self._preview_timer.start()
        self._idle_timer.start()

    # --- previews that arrive ---

    def show_preview(self, preview: Preview, node: str = "") -> None:
        """Show a preview of `node`, or of the node requested last."""
        node = node or self._requested or self._previewed
        if node == self._requested:
            self._requested = ""
        if self.slots is not None:
            self.slots.use_preview(preview, node, is_shown=node == self._previewed)
        if not preview.error:
            self.small_plots.show_preview(node, preview)
        if node == self._previewed:
            self._preview.show_preview(preview)
        self._idle_timer.start()

    def show_outlines(self, outlines: Outlines) -> None:
        """Show the small plots of visible nodes."""
        shown = self.small_plots.show_outlines(outlines)
        if self.slots is not None:
            self.slots.use_outlines(outlines, shown)
        self._idle_timer.start()

    def show_distributions(self, distributions: Distributions) -> None:
        """Show the distributions of the previewed node."""
        if self._distributions_of != self._previewed:
            return
        self._preview.show_distributions(distributions)
        self._inspector.show_distributions(distributions)

    # --- inside ---

    @property
    def _patch(self) -> Patch:
        """The edited patch."""
        return self._canvas.document.patch

    def _name_and_units(self, patch: Patch) -> object:
        """Return what the preview says of its node besides its signal."""
        if self._previewed not in patch.types:
            return None
        return patch.node(self._previewed).label, outputs_with_wired_units(patch, self._registry, self._previewed)

    def _request_previewed(self) -> None:
        id, patch, registry = self._previewed, self._patch, self._registry
        if any(node.id == id for node in patch.nodes):
            node, is_heard = patch.node(id), is_only_heard(patch, registry, id)
            why = why_silent(patch, registry, id, self._preview.pad.tile.id)
            outputs = outputs_with_wired_units(patch, registry, id)
            self._preview.expect(
                id,
                registry[node.type],
                outputs=outputs,
                output=self._output,
                why_silent=why,
                is_heard=is_heard,
                label=node.label,
            )
            self._request(id)

    def _request(self, id: str) -> None:
        self._requested = id
        self.small_plots.forget_request()
        shows = self._preview.wants_distributions or self._inspector.wants_distributions
        wanted = shows and id == self._previewed
        self._distributions_of = id if wanted else self._distributions_of
        self.preview_requested.emit(id, self._preview.pad.tile, wanted)

    def _restart_idle(self) -> None:
        if self.small_plots.are_stale:
            self._idle_timer.start()

    def _request_next(self) -> None:
        if self._requested or self._preview_timer.isActive() or self.small_plots.is_waiting:
            return
        needed = self.slots.needed_preview(self._previewed) if self.slots is not None else ""
        if needed:
            self._request(needed)
            return
        if self.small_plots.request_visible(except_node=self._previewed):
            return
        if self._inspector.errors is not None and self._inspector.errors.wants_curve:
            self._inspector.errors.start_measuring()
            self.errors_requested.emit(self._previewed)
