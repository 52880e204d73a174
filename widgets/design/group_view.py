"""The visible part of a patch at one level, on which a collapsed group is drawn as a node. Without Qt."""

from collections import Counter
from collections.abc import Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from underfoot.patch.groups import Group, innermost, parents
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import Wire, node_id
from underfoot.widgets import theme
from underfoot.widgets.design.node_geometry import NodeDescription, PortRow, display_name

_OPEN, _OUTSIDE = "", "."
"""Representations of a group's members that are not drawn as a block; no node id contains a dot."""

_COLOURS = {
    "grey": "muted",
    "teal": "vibration",
    "amber": "force",
    "violet": "events",
    "green": "contact",
    "red": "alarm",
}
"""The colours that a group may have, by their names in the palettes."""


def colour_of(group: Group) -> str:
    """Return a group's colour in the palette that is in use, as #rrggbb."""
    return theme.PALETTE[_COLOURS[group.colour]]


class GroupView(Struct, frozen=True):
    """The visible nodes and wires in an open group, or in the whole patch."""

    shown_as: Mapping[str, str]
    """For each visible node and note: itself, or the collapsed group that contains it."""
    collapsed: tuple[Group, ...]
    """Collapsed groups that are drawn as one node."""
    opened: tuple[Group, ...]
    """Groups that are drawn as a frame, the outer ones first."""

    def ends(self, wire: Wire) -> tuple[str, str]:
        """Return the visible ends of a wire; "" for an end outside, and twice "" for a hidden wire."""
        source, target = (self.shown_as.get(node_id(end), "") for end in wire)
        return ("", "") if source == target else (source, target)


def group_view_of(patch: Patch, inside: str = "") -> GroupView:
    """Return the view of the group `inside`, or of the whole patch."""
    ids = [one.id for one in patch.canvas_items()]
    if not patch.groups:
        return GroupView({id: id for id in ids}, (), ())
    above, inner = parents(patch.groups), innermost(patch.groups)
    state = {"": _OUTSIDE if inside else _OPEN}
    collapsed, opened = [], []
    for group in patch.groups:
        around = state[above[group.id]]
        if group.id == inside:
            state[group.id] = _OPEN
        elif around != _OPEN:
            state[group.id] = around
        elif group.collapsed:
            state[group.id] = group.id
            collapsed.append(group)
        else:
            state[group.id] = _OPEN
            opened.append(group)
    shown_as = {}
    for id in ids:
        what = state[inner.get(id, "")]
        if what != _OUTSIDE:
            shown_as[id] = what or id
    return GroupView(shown_as, tuple(collapsed), tuple(opened))


def description_of_group(patch: Patch, registry: Registry, group: Group) -> NodeDescription:
    """Return a collapsed group's description: ports for wires across its border, and for unwired ports."""
    inside = set(group.members)
    nodes = sorted((n for n in patch.nodes if n.id in inside), key=lambda node: (node.at[1], node.at[0]))
    wired = {end for wire in patch.wires for end in wire}
    crossing = {
        end for wire in patch.wires if (node_id(wire[0]) in inside) != (node_id(wire[1]) in inside) for end in wire
    }
    inputs, outputs = [], []
    for node in nodes:
        type = registry[node.type]
        plain = {port.name for port in type.inputs}
        into = [p for n, p in type.input_ports.items() if _is_port(f"{node.id}.{n}", crossing, wired, plain=n in plain)]
        out = [p for n, p in type.output_ports.items() if _is_port(f"{node.id}.{n}", crossing, wired, plain=True)]
        inputs += [PortRow(p, f"{node.id}.{p.name}", _text(node, registry, p.name, len(into))) for p in into]
        outputs += [PortRow(p, f"{node.id}.{p.name}", _text(node, registry, p.name, len(out))) for p in out]
    title = group.title or "Sub-patch"
    names = ", ".join(node.name_in(registry) for node in nodes)
    return NodeDescription(title, f"Sub-patch of {names}", colour_of(group), _distinct(inputs), _distinct(outputs))


def _distinct(rows: Sequence[PortRow]) -> tuple[PortRow, ...]:
    """Return the ports of one side; where several have one label, each has the id of its node, too."""
    uses = Counter(row.text for row in rows)
    return tuple(replace(row, text=f"{row.text} ({node_id(row.end)})") if uses[row.text] > 1 else row for row in rows)


def node_of_group(patch: Patch, group: Group) -> PlacedNode:
    """Return the node that represents a collapsed group: muted or bypassed if all members are, soloed if any is."""
    marks = [node.marks for node in patch.nodes if node.id in set(group.members)]
    muted, bypassed = (bool(marks) and all(name in mark for mark in marks) for name in ("muted", "bypassed"))
    soloed = any("soloed" in mark for mark in marks)
    return PlacedNode(group.id, "", group.at, muted=muted, bypassed=bypassed, soloed=soloed)


def _is_port(end: str, crossing: set[str], wired: set[str], *, plain: bool) -> bool:
    return end in crossing or (plain and end not in wired)


def _text(node: PlacedNode, registry: Registry, port: str, ports: int) -> str:
    """Return the label of a group's port: its node's name, with the port's own name if the node has several."""
    name = node.name_in(registry)
    return name if ports == 1 else f"{name} {display_name(port)}"
