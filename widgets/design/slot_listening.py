"""Connects the Design workspace with playback: slots A and B, single nodes, loops."""

from collections.abc import Iterable, Set
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from PySide6.QtCore import QObject, Signal

from underfoot.engine.reports import COMMANDED, Outlines, Preview
from underfoot.errors import UnderfootError
from underfoot.floor.layout import Tile
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.patch import Patch
from underfoot.widgets.controls.file_dialog import documents_folder
from underfoot.widgets.design.canvas import Canvas
from underfoot.widgets.design.listen_bar import ListenBar
from underfoot.widgets.design.mark_actions import MarkActions
from underfoot.widgets.design.patch_editing import changed_nodes
from underfoot.widgets.design.preview import PreviewPanel
from underfoot.widgets.design.preview_signal import event_rows, felt_rms, signal_of
from underfoot.widgets.session.listening import AuditionedOutput, gain_text
from underfoot.widgets.session.open_patch import SLOTS, other_slot
from underfoot.widgets.workspace import WorkspaceContext

OTHER_PREFIX = "/"
"""Prefix of the names of the other slot's previews; no node's id has it."""


class SlotListening(QObject):
    """Connects a workspace with `Listening` and `OpenPatch`, and selects the previews for comparing A and B."""

    preview_requested = Signal()
    """Somebody waits for `needed_preview`."""
    preview_update_requested = Signal()
    """`needed_preview` may return another name now; it is asked once edits have paused."""
    slot_chosen = Signal(str, object)
    """The slot that is edited from now on, and its `Patch`."""

    def __init__(
        self,
        canvas: Canvas,
        mark_actions: MarkActions,
        preview: PreviewPanel,
        bar: ListenBar,
        context: WorkspaceContext,
    ) -> None:
        super().__init__(canvas)
        self._canvas, self._preview, self._bar, self._context = canvas, preview, bar, context
        self._open_patch, self._listening = context.open_patch, context.listening
        self._peaks: dict[str, dict[str, float]] = {}
        self._pending: AuditionedOutput | None = None
        self._requested: tuple[tuple[object, ...], Patch] | None = None
        self._overlaid = ""
        listening, open_patch = self._listening, self._open_patch
        listening.tile = preview.pad.tile.id
        bar.start_requested.connect(listening.play_from_start)
        bar.loop_requested.connect(listening.loop)
        bar.switch_requested.connect(open_patch.switch)
        bar.copy_requested.connect(self._copy)
        bar.match_requested.connect(listening.match_levels)
        bar.whole_patch_requested.connect(listening.end_audition)
        bar.blind_requested.connect(self._open_blind_test)
        mark_actions.audition_requested.connect(self.audition)
        preview.tiles.currentTextChanged.connect(self._choose_tile)
        canvas.document.other_changed.connect(open_patch.set_other)
        open_patch.switched.connect(self._switch)
        open_patch.opened.connect(self._use_opened)
        listening.changed.connect(self._show)
        self._show()

    @property
    def _patch(self) -> Patch:
        """The edited patch."""
        return self._canvas.document.patch

    # --- previews ---

    def needed_preview(self, previewed: str) -> str:
        """Return the name of the next preview needed to play a node alone, or to compare A and B; "" for none."""
        other = self._open_patch.other
        if self._pending is not None and self._pending.node in self._patch.types:
            return self._pending.node
        if other is None:
            return ""
        own, theirs = self._sink(self._patch), self._sink(other.patch)
        if own and self._listening.level(self._open_patch.slot) is None:
            return own
        if theirs and self._listening.level(other_slot(self._open_patch.slot)) is None:
            return OTHER_PREFIX + theirs
        node = self._counterpart(previewed)
        return OTHER_PREFIX + node if node and self._overlaid != previewed else ""

    def request(self, name: str, tile: Tile, distributions: bool) -> None:
        """Request a preview of a node on a tile; a prefix of the name selects the other slot."""
        patch, node = self._patch_of(name), name.removeprefix(OTHER_PREFIX)
        if patch is None:
            return
        self._requested = (self._conditions(), patch)
        if name != node and self._open_patch.other is not None:
            patch = with_files_kept(patch, self._context.registry, self._open_patch.other.folder, None)
        seconds = self._bar.seconds
        self._context.controller.previews.request_preview(
            patch, node, tile, seconds, distributions=distributions, name=name
        )

    def use_preview(self, preview: Preview, name: str, *, is_shown: bool) -> None:
        """Store the loudness of a preview; the other slot's is drawn over the visible one."""
        slot, is_other = self._open_patch.slot, name.startswith(OTHER_PREFIX)
        node, patch = name.removeprefix(OTHER_PREFIX), self._patch_of(name)
        if patch is None or node not in patch.types or not self._is_as_requested(patch):
            return
        if self._open_patch.other is not None and (preview.error or COMMANDED in preview.signals):
            level = felt_rms(preview.signals.get(COMMANDED, np.zeros(0)), preview.rate_hz)
            self._store_level(other_slot(slot) if is_other else slot, level)
        if is_other:
            self._overlay(preview, node, patch)
        elif not preview.error:
            self._store_peaks(preview, node, patch)
            if is_shown:
                self._listening.set_loop_length(len(preview.force_n) / preview.rate_hz)
        elif self._pending is not None and self._pending.node == node:
            self._pending = None
            self._canvas.show_message(preview.error)

    def use_outlines(self, outlines: Outlines, nodes: Set[str]) -> None:
        """Store the loudness of these nodes."""
        for name, values in outlines.signals.items():
            node, _, port = name.partition(".")
            if node in nodes:
                self._peaks.setdefault(node, {})[port] = float(np.abs(np.nan_to_num(values)).max(initial=0.0))
        for name, rows in outlines.events.items():
            node, _, port = name.partition(".")
            if node in nodes:
                self._peaks.setdefault(node, {})[port] = float(rows[:, 1].max(initial=0.0))

    def patch_changed(self, patch: Patch, changed: Iterable[str]) -> None:
        """Mark the previews of these nodes of the edited patch as outdated; show the name that a node has now."""
        gone = set(changed) | {id for id in self._peaks if not any(node.id == id for node in patch.nodes)}
        self._peaks = {id: peaks for id, peaks in self._peaks.items() if id not in gone}
        if gone and self._listening.level(self._open_patch.slot) is not None:
            self._listening.set_level(self._open_patch.slot, None)
        self._show_auditioned()

    def forget(self) -> None:
        """Discard all previews."""
        self._peaks.clear()
        self._overlaid = ""
        self._preview.forget_other()
        for slot in SLOTS:
            self._listening.set_level(slot, None)

    def _store_level(self, slot: str, rms_m_s2: float) -> None:
        if self._listening.level(slot) is None:
            self._listening.set_level(slot, rms_m_s2)

    def _store_peaks(self, preview: Preview, node: str, patch: Patch) -> None:
        found = {}
        for port in self._context.registry[patch.node(node).type].outputs:
            values = (
                event_rows(signal_of(preview.events, node, port.name))[:, 1]
                if port.kind == "event"
                else signal_of(preview.signals, node, port.name)
            )
            magnitude = np.abs(np.nan_to_num(values))
            found[port.name] = float(magnitude.max(initial=0.0))
        self._peaks[node] = found
        if self._pending is not None and self._pending.node == node:
            self._start_audition(self._pending)

    def _overlay(self, preview: Preview, node: str, patch: Patch) -> None:
        shown = self._preview
        if self._counterpart(shown.node) != node:
            return
        type = self._context.registry[patch.node(node).type]
        port = type.output_ports.get(shown.port.name) if shown.port is not None else None
        self._overlaid = shown.node
        if port is not None:
            shown.show_other(preview, node, port, other_slot(self._open_patch.slot))

    def _counterpart(self, node: str) -> str:
        """Return the corresponding node in the other slot's patch: same id and type, or the tile's output."""
        other, own = self._open_patch.other, self._patch
        types = {node.id: node.type for node in own.nodes}
        if other is None or node not in types:
            return ""
        if any((one.id, one.type) == (node, types[node]) for one in other.patch.nodes):
            return node
        return self._sink(other.patch) if self._context.registry[types[node]].is_sink else ""

    def _sink(self, patch: Patch) -> str:
        types = self._context.registry
        return next((n.id for n in patch.nodes if types[n.type].is_sink and not types[n.type].to_sound), "")

    def _patch_of(self, name: str) -> Patch | None:
        """Return the patch to which the preview of this name belongs; None if there is none."""
        if not name.startswith(OTHER_PREFIX):
            return self._patch
        return self._open_patch.other.patch if self._open_patch.other is not None else None

    def _is_as_requested(self, patch: Patch) -> bool:
        """Return whether a preview's slot, tile, duration and nodes are still current; its patch can be older."""
        if self._requested is None or self._requested[0] != self._conditions():
            return False
        return not changed_nodes(self._requested[1], patch)

    def _conditions(self) -> tuple[object, ...]:
        return self._open_patch.slot, self._preview.pad.tile.id, self._bar.seconds

    # --- playback ---

    def audition(self, node: str, everywhere: bool = False) -> None:
        """Play a node's output alone; if it is playing alone already, stop that."""
        output = self._listening.auditioned_output
        if output is not None and output.node == node:
            self._listening.end_audition()
            return
        type = self._context.registry[self._patch.node(node).type]
        if not type.outputs:
            self._canvas.show_message(f"{type.label} has no output to be heard")
            return
        shown = self._preview
        port = shown.port.name if shown.node == node and shown.port is not None else type.outputs[0].name
        self._pending = AuditionedOutput(node, port, "" if everywhere else self._preview.pad.tile.id)
        if node in self._peaks:
            self._start_audition(self._pending)
        else:
            self.preview_requested.emit()

    def _start_audition(self, output: AuditionedOutput) -> None:
        self._pending = None
        self._listening.audition(replace(output, peak=self._peaks[output.node].get(output.port, 1.0)))

    def _choose_tile(self, tile: str) -> None:
        self._listening.tile = tile
        self._pending = None
        output = self._listening.auditioned_output
        if output is not None and output.tile:
            self._listening.audition(replace(output, tile=tile))

    # --- A and B ---

    def _use_opened(self) -> None:
        self._pending = None
        self.forget()

    def _switch(self, slot: str, patch: Patch) -> None:
        self._pending = None
        self._peaks.clear()
        self._overlaid = ""
        self._preview.forget_other()
        self.slot_chosen.emit(slot, patch)
        self._show()
        self.preview_update_requested.emit()

    def _copy(self) -> None:
        """Copy the edited slot's patch to the other slot, as an undoable step there."""
        slot = self._open_patch.slot
        self._set_other(self._open_patch.patch_for_other(), f"Copy {slot} to {other_slot(slot)}")
        self._canvas.show_message(f"{other_slot(slot)} is now as {slot} is; X switches", alarm=False)

    def open_in_other(self, path: Path) -> None:
        """Open a preset in the slot that is not edited, as an undoable step there."""
        self._open_patch.nodes.when_patch_allowed(path, lambda: self._open_in_other(path))

    def _open_in_other(self, path: Path) -> None:
        try:
            patch = Patch.load(path, self._context.registry)
        except UnderfootError as error:
            self._canvas.show_message(str(error))
            return
        slot, title = other_slot(self._open_patch.slot), patch.title or path.stem
        self._listening.play_preset(None)
        self._set_other(with_files_kept(patch, self._context.registry, path.parent, None), f"Open {title} in {slot}")
        self._canvas.show_message(f"{title} is open in {slot}; X switches", alarm=False)

    def _set_other(self, patch: Patch, text: str) -> None:
        """Set the other slot's patch, as an edit if it has one already."""
        self._listening.set_level(other_slot(self._open_patch.slot), None)
        other = self._open_patch.other
        if other is None:
            self._open_patch.set_other(patch)
        else:
            self._canvas.document.edit_other(other.patch, patch, text)
        self._overlaid = ""
        self._show()
        self.preview_update_requested.emit()

    def _open_blind_test(self) -> None:
        from underfoot.widgets.design.blind_test import BlindTest

        if self._open_patch.other is None:
            self._copy()
        other = self._open_patch.other
        assert other is not None
        self._pending = None  # a node that waits to be played alone would be, in the middle of a trial
        titles = {self._open_patch.slot: self._patch.title}
        titles[other_slot(self._open_patch.slot)] = other.patch.title
        a, b = (titles[slot] for slot in SLOTS)
        test = BlindTest(self._listening, (a, b), documents_folder(), self._canvas.window())
        if not changed_nodes(other.patch, self._patch) and not changed_nodes(self._patch, other.patch):
            test.warn("A and B are the same: one can only guess. Change one of them, then compare.")
        test.destroyed.connect(self._canvas.setFocus)  # or keys go to the first button of the window
        test.open()

    def _show(self) -> None:
        bar, listening = self._bar, self._listening
        has_other = self._open_patch.other is not None
        bar.show_slot(self._open_patch.slot, has_other=has_other)
        bar.show_looping(listening.is_looping)
        self._show_auditioned()
        if has_other:
            bar.show_match({slot: gain_text(listening, slot) for slot in SLOTS}, listening.is_matched)

    def _show_auditioned(self) -> None:
        output = self._listening.auditioned_output
        node = output.node if output is not None else ""
        self._bar.show_auditioned(self._patch.names(self._context.registry).get(node, node))
        self._canvas.patch_scene.show_auditioned(node)
