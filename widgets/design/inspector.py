"""The inspector: the selected nodes, with controls made from the declarations of their parameters."""

import re
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import QFrame, QVBoxLayout, QWidget

from underfoot.engine.reports import Costs, Distributions, ErrorCurveDrawn
from underfoot.models.signals.rhythm import Rhythm
from underfoot.network.cue_patch import SETTABLE
from underfoot.parameters import Count, Number, Parameter, Text
from underfoot.patch.groups import Group, chain, innermost
from underfoot.patch.node import NodeType, Registry
from underfoot.patch.patch import LEAST_SCALE, MOST_SCALE, Patch
from underfoot.patch.wiring import node_id, port_name
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.controls.fields import Field, ParameterEditor, range_text
from underfoot.widgets.controls.list_editors import TilesEditor
from underfoot.widgets.controls.number_editor import NumberEditor
from underfoot.widgets.controls.parameter_editor import FileEditor, editor_for
from underfoot.widgets.controls.scrolled import Pages
from underfoot.widgets.design.distribution_view import DistributionView
from underfoot.widgets.design.error_view import ErrorView
from underfoot.widgets.design.facts import Facts, awake_text, cost_text
from underfoot.widgets.design.node_geometry import accent, display_name
from underfoot.widgets.design.node_pictures import PICTURES, TIPS, NodePicture
from underfoot.widgets.design.osc_actions import REMARK, Answers, OscActions
from underfoot.widgets.design.patch_editing import drivers, with_wired_unit
from underfoot.widgets.design.pictured_editor import pictured_editor_for
from underfoot.widgets.design.rhythm_editor import RhythmEditor
from underfoot.widgets.design.shared_parameters import shared_by, shown_value, values_of

INTERVAL_NODES = ("poisson", "texture")
"""Nodes with random intervals, whose distribution the inspector shows. Other nodes' distributions take too long."""
DISTRIBUTION_PX = 200
TITLE = Text("", doc="what the patch is called", label="Title")
COMMENT = Text("", doc="what to know about it", label="Comment")
SEED = Count(0, 0, 2**31 - 1, doc="the same seed gives the same random draws", label="Seed")
ERROR_SCALE = Number(
    1.0,
    LEAST_SCALE,
    MOST_SCALE,
    scale="log",
    doc="factor on the errors that nodes may have: larger costs less, and is less exact",
    label="Error factor",
)
PATCH_FIELDS = {"title": TITLE, "comment": COMMENT, "seed": SEED, "error_scale": ERROR_SCALE}
MINIMUM_PX = 272

_LINE_END = re.compile(r"(?<!\n)\n(?!\n)")
"""Line break within a paragraph, which is wrapped again."""


class Inspector(Pages):
    """Shows one or several selected nodes, or the patch. It emits new values, and edits nothing itself."""

    edited = Signal(list, str, object, str)
    """Nodes, a parameter of all of them, its value, and a word that is the same for changes which belong together."""

    patch_edited = Signal(str, object, str)
    """Field of the patch, value, and the same word."""

    publish_requested = Signal(str, str, bool)
    """A parameter ("node.parameter"), and whether to show it on the sub-patch around its node."""

    disconnect_requested = Signal(str)
    """An input ("node.port") whose wire is to be removed."""

    refused = Signal(str)
    """Why a typed value was not taken, for a line of text."""

    keep_requested = Signal()
    """What other programs have set is to become the patch's."""

    give_back_requested = Signal(str)
    """A parameter ("node.parameter") is to have the patch's value again, and not what another program has set."""

    notified = Signal(str)
    """What was done without an edit, for a line of text."""

    errors_toggled = Signal()
    """The measurement of the node's run time over error was switched on or off."""

    drive_requested = Signal(str, str, QPoint, list)
    """Open a menu of drivers: node, parameter, position on the screen, and further actions of the menu."""

    def __init__(self, registry: Registry, parent: QWidget) -> None:
        super().__init__(parent)
        self._registry = registry
        self._patch = Patch()
        self._ids: list[str] = []
        self._groups: Sequence[Group] = ()
        self._tiles: tuple[str, ...] = ()
        self._folder: Path | None = None
        self._shape: object = None
        self._edit_number = 0
        self._costs: Costs | None = None
        self._signal_ranges: Mapping[str, tuple[float, float]] = {}
        self._set_values: Mapping[tuple[str, str], object] = {}
        self.editors: dict[str, ParameterEditor] = {}
        self._ends: dict[str, list[str]] = {}
        """What each editor sets: the same parameter of one node or of several, "node.parameter". None: the patch's."""
        self._osc: dict[str, OscActions] = {}
        self.picture: NodePicture | None = None
        self.distribution: DistributionView | None = None
        self._distributions: Distributions | None = None
        self.errors: ErrorView | None = None
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setProperty("role", "panel")  # beside the page, where the scroll bar would be, too
        self.setAccessibleName("Inspector")
        self.setMinimumWidth(MINIMUM_PX)
        self.show_selection(Patch(), [])

    def show_selection(self, patch: Patch, ids: Sequence[str], groups: Collection[str] = ()) -> None:
        """Show these nodes of a patch; without any, show the patch. `groups` are the sub-patches that have them all."""
        self._patch = patch
        self._groups = [one for one in patch.groups if one.id in groups]
        there = {node.id: node for node in patch.nodes}
        self._ids = [id for id in ids if id in there]
        shape = [(id, there[id].type, there[id].label) for id in self._ids]
        around = [(one.id, one.title, one.published) for one in patch.groups if {*self._ids}.intersection(one.members)]
        ends = [(id, name) for id in self._ids[:1] for name in self._registry[there[id].type].parameters]
        if self._groups:
            ends = [(node_id(end), port_name(end)) for group in self._groups for end in group.published]
        units = [getattr(self._declared(*end), "unit", "") for end in ends]
        looks = (shape, [group.id for group in self._groups], around, units)
        if looks != self._shape:
            self._shape = looks
            self._edit_number += 1
            self._build()
        self._refresh()

    def update_colours(self) -> None:
        """Rebuild the page in the current colours."""
        distributions = self._distributions
        self._shape = None
        self.show_selection(self._patch, self._ids, [group.id for group in self._groups])
        if distributions is not None:
            self.show_distributions(distributions)

    def set_tiles(self, ids: Sequence[str]) -> None:
        """Set the ids of the tiles to choose from."""
        self._tiles = tuple(ids)
        for editor in self.editors.values():
            if isinstance(editor, TilesEditor):
                editor.set_tiles(self._tiles)

    def set_folder(self, folder: Path | None) -> None:
        """Set the folder of the patch, to which file paths are relative."""
        self._folder = folder
        for editor in self.editors.values():
            if isinstance(editor, FileEditor):
                editor.set_folder(folder)

    def show_costs(self, costs: Costs | None) -> None:
        """Show the share of the block time and the number of awake tiles; None if the engine is stopped."""
        self._costs = costs
        self._show_facts()

    def show_signal_ranges(self, signal_ranges: Mapping[str, tuple[float, float]]) -> None:
        """Show the ranges of the outputs ("node.port") in their last preview, for driving nodes."""
        self._signal_ranges = signal_ranges
        if len(self._ids) == 1 or len(self._groups) == 1:
            self._refresh()

    def show_set_values(self, values: Mapping[tuple[str, str], object]) -> None:
        """Show what other programs have set, by node and parameter, in place of the patch's values."""
        changed = {id for (id, _), _ in values.items() ^ self._set_values.items()}
        self._set_values = values
        if changed.intersection(self._ids):
            self._refresh()

    @property
    def wants_distributions(self) -> bool:
        """Whether the distribution of the node's intervals is visible."""
        return self.distribution is not None

    def show_distributions(self, distributions: Distributions) -> None:
        """Show the distribution of the node's intervals, the last of its distributions."""
        self._distributions = distributions
        if self.distribution is not None:
            self.distribution.show_distributions(replace(distributions, drawings=distributions.drawings[-1:]))

    def show_errors(self, curve: ErrorCurveDrawn) -> None:
        """Show the node's run time as a function of error, as far as it has been measured."""
        if self.errors is not None:
            self.errors.show_curve(curve)

    # --- building ---

    def _build(self) -> None:
        self.editors, self.picture, self.distribution, self.errors, self._distributions = {}, None, None, None, None
        self._osc, self._ends = {}, {}
        page = QWidget(self.inside)
        page.setProperty("role", "panel")
        column = QVBoxLayout(page)
        column.setContentsMargins(16, 16, 8, 16)
        column.setSpacing(8)
        if len(self._groups) == 1:
            self._build_group(column, self._groups[0])
        elif len(self._ids) == 1:
            self._build_node(column, self._registry[self._patch.node(self._ids[0]).type])
        elif self._ids:
            self._build_many(column)
        else:
            self._build_patch(column)
        column.addStretch()
        self._fit_page()
        self.show_page(page)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_page()

    def _fit_page(self) -> None:
        """Set the same width for every page, with space for the scroll bar, so that the layout never shifts."""
        self.inside.setFixedWidth(self.width() - self.verticalScrollBar().sizeHint().width())

    def _build_node(self, column: QVBoxLayout, type: NodeType) -> None:
        id = self._ids[0]
        title = theme.paragraph(self._patch.node(id).name_in(self._registry), "title")
        title.setStyleSheet(f"color: {theme.mixed(accent(type), theme.TEXT, 0.6)};")
        column.addWidget(title)
        if self._patch.node(id).label:
            column.addWidget(theme.label(type.label, "muted"))
        column.addWidget(theme.paragraph(pretty_text(_LINE_END.sub(" ", type.doc)), "small"))
        column.addWidget(theme.paragraph(pretty_text(f"Accuracy: {type.accuracy}"), "small"))
        column.addSpacing(8)
        if type.type in PICTURES:
            self.picture = PICTURES[type.type](type)
            self.picture.setToolTip(TIPS[type.type])
            self.picture.setAccessibleName(f"{type.label} as a picture")
            self.picture.edit_began.connect(self._begin)
            self.picture.edited.connect(
                lambda name, value: self.edited.emit([id], name, value, self._word(f"{id} picture"))
            )
            column.addWidget(self.picture)
        for name in type.parameters:
            self._add_parameter(column, name, self._declared(id, name), [f"{id}.{name}"])
        if type.type in INTERVAL_NODES:
            self.distribution = DistributionView(most=1)
            self.distribution.setFixedHeight(DISTRIBUTION_PX)
            self.distribution.expect()
            column.addWidget(self.distribution)
        if type.requested_error is not None:
            self.errors = ErrorView()
            self.errors.toggled.connect(self.errors_toggled)
            column.addWidget(self.errors)
        self._add_facts(column, "Cost", "Awake", "Id")

    def _add_parameter(self, column: QVBoxLayout, key: str, parameter: Parameter, ends: list[str]) -> ParameterEditor:
        """Add the control of the same parameter, "node.parameter", of one node or of several.

        That of one can be driven, and has a menu.
        """
        editor = pictured_editor_for(parameter)
        self._add_editor(column, key, editor)
        self._ends[key] = ends
        ids, name = [node_id(end) for end in ends], port_name(ends[0])
        editor.value_changed.connect(lambda value: self.edited.emit(ids, name, value, self._word(*ends)))
        if isinstance(editor, RhythmEditor):
            editor.rhythm_chosen.connect(lambda rhythm: self._set_rhythm(ends, rhythm))
        if len(ends) > 1:
            return editor
        if isinstance(editor, NumberEditor):
            drive = partial(self.drive_requested.emit, ids[0], name)
            editor.offer_driving()
            editor.disconnect_requested.connect(lambda: self.disconnect_requested.emit(ends[0]))
            editor.drive_requested.connect(lambda place: drive(place, editor.actions()))
        self._add_menu(editor, ends[0])
        return editor

    def _add_menu(self, editor: ParameterEditor, end: str) -> None:
        """Add a menu that exposes the parameter on the sub-patch that is shown or has its node, and on those around.

        It has what concerns OSC, too.
        """
        groups = self._patch.groups
        first = self._groups[0].id if self._groups else innermost(groups).get(node_id(end), "")
        around = [one for id in chain(groups, first) for one in groups if one.id == id and one.collapsed]
        for group in reversed(around):  # a frame shows no parameters
            where = "" if group is around[-1] else f" around it{group.title and f': {group.title}'}"
            action = QAction(f"Show on the sub-patch{where}", editor)
            action.setCheckable(True)
            action.setChecked(end in group.published)
            action.triggered.connect(lambda on, id=group.id: self.publish_requested.emit(id, end, on))
            editor.addAction(action)
        if editor.parameter.kind in SETTABLE:
            do = Answers(self.keep_requested.emit, self.give_back_requested.emit, self.notified.emit)
            self._osc[end] = OscActions(editor, end, do)
        if editor.actions() and not (isinstance(editor, NumberEditor) and editor.can_be_driven):
            editor.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)  # others: below what may drive them

    def _declared(self, id: str, name: str) -> Parameter:
        """Return a parameter of node `id`, in the unit that its wires give it."""
        type = self._registry[self._patch.node(id).type]
        return with_wired_unit(self._patch, self._registry, id, type.parameters[name])

    def _build_group(self, column: QVBoxLayout, group: Group) -> None:
        column.addWidget(theme.paragraph(group.title or "Sub-patch", "title"))
        types = {node.id: self._registry[node.type] for node in self._patch.nodes if node.id in self._ids}
        inside = ", ".join(_with_counts([type.label for type in types.values()]))
        column.addWidget(theme.paragraph(f"Sub-patch of {inside}", "small"))
        column.addSpacing(8)
        for end in group.published:
            id = node_id(end)
            editor = self._add_parameter(column, end, self._declared(id, port_name(end)), [end])
            editor.set_name(f"{self._patch.node(id).name_in(self._registry)}: {editor.parameter.label.lower()}")
            editor.label.setWordWrap(True)
        if not group.published:
            hint = "A parameter of a node in it is shown here when its context menu says so."
            column.addWidget(theme.paragraph(hint, "muted"))
        self._add_facts(column, "Nodes", "Cost")

    def _set_rhythm(self, notes: list[str], rhythm: Rhythm) -> None:
        """Set the bar and the repeats of a chosen rhythm, in the same undo step as its notes, "node.parameter"."""
        ids = [node_id(end) for end in notes]
        types = [self._registry[self._patch.node(id).type] for id in ids]
        for name, value in (("bar", rhythm.bar_s), ("repeats", rhythm.repeats)):
            if all(name in type.parameters for type in types):
                self.edited.emit(ids, name, value, self._word(*notes))

    def _build_many(self, column: QVBoxLayout) -> None:
        of = f" in {len(self._groups)} sub-patches" if self._groups else ""
        column.addWidget(theme.paragraph(f"{len(self._ids)} nodes{of}", "title"))
        there = {node.id: node.type for node in self._patch.nodes}
        names = [self._registry[there[id]].label for id in self._ids]
        column.addWidget(theme.paragraph(", ".join(_with_counts(names)), "small"))
        column.addSpacing(8)
        for parameter, label, ids in shared_by(self._patch, self._registry, self._ids, self._groups):
            name = parameter.name
            key = f"{ids[0]}.{name}" if self._groups else name
            editor = self._add_parameter(column, key, parameter, [f"{id}.{name}" for id in ids])
            editor.set_name(label)
            editor.label.setWordWrap(True)
        self._add_facts(column, "Cost")

    def _build_patch(self, column: QVBoxLayout) -> None:
        column.addWidget(theme.label("Patch", "title"))
        column.addWidget(theme.paragraph("Select a node to see its parameters.", "small"))
        column.addSpacing(8)
        for name, parameter in PATCH_FIELDS.items():
            editor = editor_for(parameter)
            editor.can_reset = name == "error_scale"
            self._add_editor(column, name, editor)
            editor.value_changed.connect(
                lambda value, name=name: self.patch_edited.emit(name, value, self._word(f"patch.{name}"))
            )
        self._add_facts(column, "Nodes", "Wires", "Cost")

    def _add_editor(self, column: QVBoxLayout, name: str, editor: ParameterEditor) -> None:
        if isinstance(editor, TilesEditor):
            editor.set_tiles(self._tiles)
        if isinstance(editor, FileEditor):
            editor.set_folder(self._folder)
        editor.edit_began.connect(self._begin)
        editor.let_go.connect(self._refresh)
        controls: list[ParameterEditor | Field] = [editor, *editor.findChildren(Field)]
        for control in controls:
            control.refused.connect(lambda why: self.refused.emit(f"{editor.parameter.label}: {why}"))
        self.editors[name] = editor
        column.addWidget(editor)

    def _add_facts(self, column: QVBoxLayout, *names: str) -> None:
        line = QFrame()
        line.setFixedHeight(1)
        line.setStyleSheet(f"background: {theme.LINE};")
        self._facts = Facts(*names)
        column.addWidget(line)
        column.addWidget(self._facts)

    def _begin(self) -> None:
        self._edit_number += 1

    def _word(self, *what: str) -> str:
        """Return the word for what belongs to the change that was begun last, of these parameters."""
        return f"{' '.join(what)} {self._edit_number}"

    # --- refreshing ---

    def _refresh(self) -> None:
        wires = drivers(self._patch)
        for key, editor in self.editors.items():
            match self._ends.get(key, ()):
                case [end]:
                    self._show_parameter(editor, node_id(end), port_name(end), wires)
                case [_, *_] as ends:
                    self._show_shared(editor, ends, wires)
                case _ if getattr(self._patch, key) != editor.value():
                    editor.set_value(getattr(self._patch, key))
        if self.errors is not None:
            self.errors.set_state((self._patch.node(self._ids[0]).parameters, self._patch.error_scale))
        if self.picture is not None:
            self.picture.set_values({name: editor.value() for name, editor in self.editors.items()})
        self._show_facts()

    def _show_parameter(
        self, editor: ParameterEditor, id: str, name: str, wires: Mapping[str, Mapping[str, str]]
    ) -> None:
        """Show a parameter of one node, and what drives it. What a hand holds follows no other program."""
        own = editor.parameter.check(self._patch.node(id).parameters.get(name, editor.parameter.default))
        source = wires.get(id, {}).get(name, "")
        is_set = (id, name) in self._set_values and not source
        value = shown_value(editor.parameter, [self._set_values[id, name], own]) if is_set else own
        if value != editor.value() and not editor.is_held:
            editor.set_value(value)
        if (osc := self._osc.get(f"{id}.{name}")) is not None:
            osc.show(own, is_driven=bool(source), is_set=is_set)
        if isinstance(editor, NumberEditor):
            self._show_driver(editor, source)

    def _show_shared(
        self, editor: ParameterEditor, ends: Sequence[str], wires: Mapping[str, Mapping[str, str]]
    ) -> None:
        """Show the common value of several nodes, or that their values differ, in how many it is driven, and whether
        OSC has set any.
        """
        name, ids = port_name(ends[0]), [node_id(end) for end in ends]
        driven = sum(name in wires.get(id, {}) for id in ids)
        is_set = any((id, name) in self._set_values for id in ids)
        values = values_of(self._patch, self._registry, ids, name, self._set_values)
        value = shown_value(editor.parameter, values)
        differing = range_text(editor.parameter, values) if len(values) > 1 else ""
        wired = f"driven in {driven} of {len(ids)}" if driven else ""
        editor.set_mixed(differing, ", ".join(filter(None, (wired, REMARK if is_set else ""))))
        if value != editor.value() and not editor.is_held:
            editor.set_value(value)

    def _show_driver(self, editor: NumberEditor, source: str) -> None:
        if not source:
            editor.set_driven("")
            return
        id, _, port = source.partition(".")
        node = self._patch.node(id)
        type = self._registry[node.type]
        output = type.output_ports[port]
        title = node.name_in(self._registry)
        name = title if len(type.outputs) == 1 else f"{title}, {display_name(port)}"
        editor.set_driven(name, theme.signal_colour(output.kind, output.unit), self._signal_ranges.get(source))

    def _show_facts(self) -> None:
        shows_some = bool(self._ids or self._groups)
        ids, id = self._ids if shows_some else list(self._patch.types), next(iter(self._ids), "")
        self._facts.show_facts(
            {
                "Nodes": str(len(ids)),
                "Wires": str(len(self._patch.wires)),
                "Cost": cost_text(self._costs, ids),
                "Awake": awake_text(self._costs, id, len(self._tiles)),
                "Id": id,
            }
        )


def _with_counts(names: Sequence[str]) -> list[str]:
    """Return the distinct names, with their counts.

    >>> _with_counts(["Noise", "Gain", "Noise"])
    ['2 × Noise', 'Gain']
    """
    return [f"{names.count(name)} × {name}" if names.count(name) > 1 else name for name in dict.fromkeys(names)]
