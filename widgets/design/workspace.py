"""The Design workspace: palette, canvas, inspector and preview around one document."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QHBoxLayout, QWidget

from underfoot.engine.commands import PressTile, Strike
from underfoot.engine.reports import Costs, Fault, Health
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.floor.layout import Tile, default_floor
from underfoot.network.cue_patch import CuedChanges, with_cues
from underfoot.patch.grouping import published
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import node_id, port_name
from underfoot.quantities import first_of
from underfoot.widgets import theme
from underfoot.widgets.controls.menu import add_action
from underfoot.widgets.controls.panels import column, splitter
from underfoot.widgets.controls.scrolled import scrolling
from underfoot.widgets.controls.undo_actions import UndoActions
from underfoot.widgets.design.canvas import Canvas
from underfoot.widgets.design.first_steps import FirstSteps
from underfoot.widgets.design.inspector import PATCH_FIELDS, Inspector
from underfoot.widgets.design.listen_bar import ListenBar
from underfoot.widgets.design.mark_actions import MarkActions
from underfoot.widgets.design.node_palette import NodePalette
from underfoot.widgets.design.patch_editing import changed_nodes
from underfoot.widgets.design.preset_browsing import PresetBrowsing
from underfoot.widgets.design.preset_panel import PresetPanel
from underfoot.widgets.design.preview import PreviewPanel
from underfoot.widgets.design.preview_requests import PreviewRequests
from underfoot.widgets.design.side_panel import SidePanel
from underfoot.widgets.design.silence import SilenceHint
from underfoot.widgets.design.slot_listening import SlotListening
from underfoot.widgets.design.undo import Document
from underfoot.widgets.dialogs.shortcuts import Keys, keys_of
from underfoot.widgets.session.network_link import NetworkLink
from underfoot.widgets.session.open_patch import OpenPatch
from underfoot.widgets.workspace import Workspace, WorkspaceContext

_NATIVE = QKeySequence.SequenceFormat.NativeText

UNDO_FILE = "undo.json"


class DesignWorkspace(Workspace):
    """Edits a patch: `set_patch`, `patch`, `patch_edited`. The `show...` methods show reports of the engine."""

    patch_edited = Signal(object)
    """The patch after every edit, undo and redo; not after `set_patch`."""

    struck = Signal(str, float)
    """Tile and strength: the person clicked on the tile."""

    pressed = Signal(str, float, float, float)
    """Tile, place in the tile's frame in metres, force in newtons (0: released)."""

    refused = Signal(str)
    """Why something was not done; the canvas shows it, too."""

    def __init__(self, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.registry = registry
        self.document = Document(Patch(), self)
        self._said = ""
        self.make(self._parts())

    def _parts(self) -> Iterator[None]:
        registry = self.registry
        self.node_palette = NodePalette(registry, self)
        self.side = SidePanel(self.node_palette, PresetPanel(), self)
        self.browsing: PresetBrowsing | None = None
        yield
        self._first_steps = FirstSteps(self)
        self.canvas = Canvas(self.document, registry, self)
        yield
        self.listen_bar = ListenBar(self)
        self.preview = PreviewPanel(self)
        yield
        self.inspector = Inspector(registry, self)
        yield
        self.previews = PreviewRequests(self.canvas, self.inspector, self.preview, registry)
        self.mark_actions = MarkActions(self.canvas, registry)
        self.silence_hint = SilenceHint(lambda text: self.canvas.show_message(text, alarm=False))
        self.slots: SlotListening | None = None
        yield from self._lay_out()
        yield
        self.undo_actions = UndoActions(self.document.group, self)
        self.undo_action, self.redo_action = self.undo_actions.undo, self.undo_actions.redo
        self.undo_actions.used.connect(self._say)
        within, text = Qt.ShortcutContext.WidgetWithChildrenShortcut, "From the canvas to the parameters, and back"
        self.parameters_action = add_action(self, text, "F6", self._change_focus, within)
        self._connect()
        self.set_floor(default_floor().tiles)

    # --- as a workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        controller, open_patch = context.controller, context.open_patch
        self.set_folder(open_patch.folder)
        self.set_patch(open_patch.patch)
        self.document.restore_history(context.folder / UNDO_FILE, self.registry)
        open_patch.opened.connect(self.set_patch)
        open_patch.nodes.changed.connect(self._update_nodes)
        open_patch.folder_changed.connect(self.set_folder)
        open_patch.paths_changed.connect(lambda patch: self.document.edit(patch, "Save in another folder"))
        self.patch_edited.connect(open_patch.set_patch)
        controller.opened.connect(self._set_target)
        self._set_target(controller.target)
        self.silence_hint.begin(controller.is_playing)
        controller.playing_changed.connect(self.silence_hint.begin)
        controller.bridge.costs_measured.connect(self.show_costs)
        controller.bridge.health_reported.connect(self.show_health)
        controller.bridge.faulted.connect(self.show_fault)
        controller.previews.preview_computed.connect(self.previews.show_preview)
        controller.previews.outlines_computed.connect(self.previews.show_outlines)
        controller.previews.distributions_computed.connect(self.previews.show_distributions)
        controller.previews.errors_measured.connect(self.inspector.show_errors)
        controller.equaliser_changed.connect(lambda tile: self.previews.request_chosen())
        self.previews.small_plots.outlines_requested.connect(
            lambda nodes: controller.previews.request_outlines(
                self.patch(), nodes, self.preview.pad.tile, self.listen_bar.seconds
            )
        )
        self.previews.errors_requested.connect(lambda node: controller.previews.measure_errors(self.patch(), node))
        self.slots = SlotListening(self.canvas, self.mark_actions, self.preview, self.listen_bar, context)
        self.previews.compare(self.slots)
        self.slots.slot_chosen.connect(self.show_slot)
        self.canvas.play_requested.connect(controller.play_or_stop)
        self.struck.connect(lambda tile, strength: controller.send(Strike("", tile, strength)))
        self.pressed.connect(lambda *press: controller.send(PressTile(*press)))
        open_patch.preset_opened.connect(self.document.edit)
        open_patch.preset_opened.connect(self.canvas.fit_new_patch)
        self.side.presets.notified.connect(self.notified)
        self.side.presets.escaped.connect(self.canvas.setFocus)
        self.browsing = PresetBrowsing(self.side, context, context.folder / "presets")
        self.browsing.inserted.connect(self.canvas.put_in)
        self.browsing.accept_drops(self.canvas.viewport(), self.listen_bar.slots, self.slots.open_in_other)
        self._follow_other_programs(context.network, open_patch)
        self._prepare_first_steps(context)

    def _follow_other_programs(self, network: NetworkLink, open_patch: OpenPatch) -> None:
        """Show what other programs set. A hand that sets it, or another patch, which may have nodes of the same ids,
        ends that, also by an undo; what is kept becomes the patch's.
        """

        def release_changed(before: Patch, patch: Patch) -> None:
            were, are = ({node.id: node.parameters for node in one.nodes} for one in (before, patch))
            network.release(
                [(id, name) for id, name in network.values if are.get(id, {}).get(name) != were.get(id, {}).get(name)]
            )

        def keep() -> None:
            own = {node.id for node in self.patch().nodes}
            after = with_cues(self.patch(), CuedChanges(values=network.values), (), self.registry)
            self.document.edit(after, "Keep what OSC has set")
            network.release([end for end in network.values if end[0] in own])  # others are of presets on tiles

        to_others = (open_patch.opened, open_patch.preset_opened, open_patch.switched, self.listen_bar.blind_requested)
        for to_another in to_others:
            to_another.connect(lambda *_: network.release(list(network.values)))
        self.document.edited.connect(release_changed)
        network.values_set.connect(self.inspector.show_set_values)
        self.inspector.show_set_values(network.values)
        self.inspector.edited.connect(lambda ids, name, *_: network.release([(id, name) for id in ids]))
        self.inspector.give_back_requested.connect(lambda end: network.release([(node_id(end), port_name(end))]))
        self.inspector.keep_requested.connect(keep)

    def _update_nodes(self) -> None:
        self.node_palette.list.filter_by(self.node_palette.field.text())
        self.canvas.patch_scene.forget_descriptions()
        self.previews.request_all()  # the patch may be the same, and what its nodes do another

    def save_for_restart(self, folder: Path) -> None:
        try:
            self.document.save_history(folder / UNDO_FILE)
        except UnderfootError as error:
            self.notified.emit(str(error))

    def close_down(self) -> None:
        self.side.presets.close_down()

    def _prepare_first_steps(self, context: WorkspaceContext) -> None:
        """Show the three steps of a first start, until the user dismisses them."""
        settings, controller = context.settings, context.controller
        steps = self._first_steps

        def note_output(_: object) -> None:
            steps.note_output(controller.is_playing, controller.has_sound)

        steps.is_wanted = lambda: not settings.first_steps_done
        for changed in (controller.playing_changed, controller.bridge.started, controller.bridge.output_changed):
            changed.connect(note_output)
        self.struck.connect(lambda *_: steps.mark_done("press"))
        self.pressed.connect(lambda *_: steps.mark_done("press"))
        self.inspector.edited.connect(lambda *_: steps.mark_done("turn"))
        steps.done.connect(lambda: setattr(settings, "first_steps_done", True))

    def menu_actions(self) -> Sequence[QAction]:
        presets = (self.browsing.show_action, self.browsing.save_action) if self.browsing is not None else ()
        return self.undo_action, self.redo_action, *presets, *self.listen_bar.actions_by_name.values()

    @property
    def shortcuts(self) -> Keys:
        steps = [
            (name, ", ".join(key.toString(_NATIVE) for key in action.shortcuts()))
            for name, action in (("Undo", self.undo_action), ("Redo", self.redo_action))
        ]
        hand = [
            ("Look into the sub-patch", "Enter, double-click"),
            ("Edit a note or a title", "Double-click"),
            ("Put a preset into the patch", "Shift+Enter, with the focus on the presets"),
            ("Move what is selected, or else the view", "Arrow keys; with Shift further"),
            ("Move the view", "Space and drag, middle button"),
            ("Copy what is dragged", "Alt as you let it go"),
            ("Cut wires", "Ctrl and drag with the right button"),
        ]
        own = (*self.menu_actions()[2:], self.parameters_action, *self.canvas.actions_by_name.values())
        return [*steps, *keys_of(own), *hand]

    # --- the document ---

    def patch(self) -> Patch:
        """Return the current patch."""
        return self.document.patch

    def set_patch(self, patch: Patch) -> None:
        """Edit this patch from now on, with an empty undo history, and show all of it."""
        patch.check(self.registry)
        self.document.load(patch)
        self.canvas.patch_scene.select([])
        self.canvas.fit_new_patch()
        if self.isVisible():
            self.canvas.setFocus()  # so that keys, such as / for a node, act on the opened patch

    # --- reports of the engine ---

    def show_costs(self, costs: Costs | None) -> None:
        """Show each node's cost, and the nodes that are asleep; None if the engine is stopped."""
        self.canvas.patch_scene.show_costs(costs)
        self.inspector.show_costs(costs)
        if costs:
            self.silence_hint.take(self.patch(), self.registry, costs.awake)

    def show_health(self, health: Health) -> None:
        """Clear the costs while the engine is not running."""
        if not health.running:
            self.show_costs(None)

    def show_fault(self, fault: Fault | None) -> None:
        """Mark a node that produced a value that is not finite, and name all that did; None clears the marks."""
        faulty = self.canvas.patch_scene.show_fault(fault.node if fault else None)
        if fault:
            names = self.patch().names(self.registry)
            told = first_of([names.get(id, id) for id in dict.fromkeys([*faulty, fault.node])], 4)
            self.canvas.show_message(f"Values that are not finite are silenced: {', '.join(told)}")

    def set_floor(self, tiles: Sequence[Tile]) -> None:
        """Set the tiles of another session's target, which may play through other calibrations: all is previewed
        again.
        """
        self.inspector.set_tiles([tile.id for tile in tiles])
        self.preview.set_tiles(tiles)
        self.previews.request_all()

    def set_folder(self, folder: Path | None) -> None:
        """Set the folder of the patch; paths of files below it are stored relative to it."""
        self.canvas.folder = folder
        self.inspector.set_folder(folder)

    # --- inside ---

    def _lay_out(self) -> Iterator[None]:
        # From the outside in: a widget that gets another parent has the style of all within it looked up again.
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        self._across = splitter("design across", Qt.Orientation.Horizontal)
        self._across.setMinimumHeight(52 * theme.GRID)
        row.addWidget(scrolling(self._across))
        self._middle = splitter("design down", Qt.Orientation.Vertical)
        for widget in (self.side, self._middle, self.inspector):
            self._across.addWidget(widget)
        yield
        column(self._first_steps, self.canvas, body=self.canvas, parent=self._middle)
        column(self.listen_bar, self.preview, body=self.preview, parent=self._middle)
        self._middle.setStretchFactor(0, 3)
        self._middle.setStretchFactor(1, 1)
        self._middle.setSizes([420, 320])
        self._across.setStretchFactor(1, 1)
        self._across.setSizes([192, 800, 280])
        self.focused_first = self.canvas
        self.canvas.setFocus()

    def _say(self, text: str) -> None:
        """Say what was undone or redone until the next change, select and show what it brought back, and ensure that
        the patch is visible.
        """
        if self.canvas.brought:
            self.canvas.patch_scene.select(self.canvas.brought)
            self.canvas.ensure_visible(self.canvas.brought)
        self.canvas.fit_if_lost()
        self._said = text
        self.notified.emit(text)

    def _connect(self) -> None:
        self.document.changed.connect(self._changed)
        self.document.edited.connect(lambda _, patch: self.patch_edited.emit(patch))
        self.node_palette.chosen.connect(lambda type: self.canvas.add(type))
        self.node_palette.list.drag_ended.connect(self.canvas.edge_scrolling.undo)
        self.canvas.selected.connect(self._selected)
        self.canvas.refused.connect(self.refused)
        self.canvas.files_pasted.connect(self.files_pasted)
        self.inspector.edited.connect(self._set)
        self.inspector.patch_edited.connect(self._set_patch_field)
        self.inspector.disconnect_requested.connect(self._disconnect)
        self.inspector.refused.connect(self.canvas.show_message)
        self.inspector.notified.connect(self.notified)
        self.inspector.drive_requested.connect(self.canvas.driver_menus.open_menu)
        self.inspector.publish_requested.connect(self._publish)
        self.preview.struck.connect(self.struck)
        self.preview.pressed.connect(self.pressed)
        self.listen_bar.length_chosen.connect(self.previews.request_all)
        self.listen_bar.overlay_requested.connect(self.preview.set_overlay)

    def _set_target(self, target: Target) -> None:
        self.set_floor(target.floor.tiles)

    def _set(self, ids: list[str], name: str, value: object, merge_key: str) -> None:
        patch = self.patch()
        text = f"Set {self.registry[patch.node(ids[0]).type].parameters[name].label.lower()}"
        for id in ids:
            patch = patch.set(id, name, value, self.registry)
        self.document.edit(patch, f"{text} of {len(ids)} nodes" if len(ids) > 1 else text, merge_key)

    def _set_patch_field(self, field: str, value: object, merge_key: str) -> None:
        name = PATCH_FIELDS[field].label.lower()
        self.document.edit(replace(self.patch(), **{field: value}), f"Set {name}", merge_key)

    def _disconnect(self, target: str) -> None:
        patch = self.patch()
        self.document.edit(patch.disconnect([w for w in patch.wires if w[1] == target]), "Disconnect")

    def _changed(self, before: Patch, patch: Patch) -> None:
        self.withdrawn.emit(self._said)
        if changed_nodes(before, patch):
            self.canvas.patch_scene.show_fault(None)  # one that is still there is reported again
        self.previews.update_patch(before, patch)
        self._inspect(self.canvas.selected_ids())

    def _selected(self, ids: list[str]) -> None:
        self._inspect(ids)
        scene = self.canvas.patch_scene
        if not ids and len(wires := scene.chosen_wires()) == 1:
            source = wires[0][0]
            self.previews.choose([node_id(source)], port_name(source))
            return
        sub_patches = scene.selected_sub_patches()
        ports = sub_patches[0].geometry.ports if len(sub_patches) == 1 else ()
        self.previews.choose([node_id(placed.name) for placed in ports if placed.side == "out"][:1] or ids)

    def show_slot(self, slot: str, patch: Patch) -> None:
        """Edit this slot from now on, which holds this patch."""
        shared = {node.id for node in patch.nodes} & {node.id for node in self.patch().nodes}
        self.document.switch(slot, patch)
        if not shared:
            self.canvas.fit_view(all_nodes=True)

    def _inspect(self, ids: Sequence[str]) -> None:
        sub_patches = [item.node.id for item in self.canvas.patch_scene.selected_sub_patches()]
        had_focus = self.inspector.isAncestorOf(self.window().focusWidget() or self)
        self.inspector.show_selection(self.patch(), ids, sub_patches)
        if had_focus and not self.inspector.isAncestorOf(self.window().focusWidget() or self):
            self.canvas.setFocus()  # its field is gone, with the page of another selection

    def _change_focus(self) -> None:
        """Give the focus to the inspector's first control, which is many Tabs away; from there, to the canvas."""
        page, reason = self.inspector.page, Qt.FocusReason.TabFocusReason
        if page.isAncestorOf(self.window().focusWidget() or self):
            self.canvas.setFocus(reason)
            return
        # By Qt: PySide makes what `nextInFocusChain` returns a child of what it was asked of, and invalid with that.
        page.setFocus(reason)
        self.inspector.focusNextChild()
        if not page.isAncestorOf(self.window().focusWidget() or self):
            self.canvas.setFocus(reason)
            self.canvas.show_message("What is selected has no parameters to change")

    def _publish(self, group: str, end: str, on: bool) -> None:
        text = "Show on the sub-patch" if on else "Do not show on the sub-patch"
        self.document.edit(published(self.patch(), group, end, on), text)
