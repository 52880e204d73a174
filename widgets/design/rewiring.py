"""Edits that preserve wires: insertion of a node into a wire, removal, and change of type. Without Qt."""

from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from msgspec.structs import replace

from underfoot.errors import BadValue
from underfoot.models.signals.envelopes import FULL_FORCE_N
from underfoot.models.signals.events import STARTS
from underfoot.parameters import Choice, Number, Parameter
from underfoot.patch.groups import Group, renamed
from underfoot.patch.node import NodeType, Port, Registry, can_connect
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import Wire, node_id, port_name, renamed_end, sources
from underfoot.widgets.design.patch_editing import port_of, refusal, unit_hint, wire_at

_, AT_EVENTS = STARTS


def fitting_port(type: NodeType, end: Port, side: str, taken: Collection[str] = ()) -> str:
    """Return the port of node type `type` for a wire held at `end`, on `side` of its own node; "" if none fits.

    Inputs that are `taken` do not count. Parameters count only if they have the wire's unit. For a dimensionless
    signal, such as an envelope, only the loudness parameter counts.
    """
    if side == "in":
        return next((port.name for port in type.outputs if can_connect(port, end)), "")
    plain = next((port.name for port in type.inputs if port.name not in taken and can_connect(end, port)), "")
    if plain or not end.unit:
        return plain or loudness_port(type, end)
    fitting = (port.name for port in type.drivable_ports if port.kind == end.kind and port.unit == end.unit)
    return next(fitting, "")


def loudness_port(type: NodeType, end: Port) -> str:
    """Return the loudness parameter of a node type that an envelope held at `end` can drive; "" if there is none.

    >>> from underfoot.nodes import REGISTRY
    >>> envelope = REGISTRY["attack-decay"].output_ports["out"]
    >>> loudness_port(REGISTRY["tone"], envelope), loudness_port(REGISTRY["gain"], envelope)
    ('amplitude', 'gain')
    """
    return next(
        (
            port.name
            for port in type.drivable_ports
            if not end.unit and getattr(type.parameters[port.name], "is_in_db", False) and can_connect(end, port)
        ),
        "",
    )


def types_that_fit(registry: Registry, end: Port, side: str) -> list[str]:
    """Return the node types to which a wire held at `end` can be connected."""
    return [type.type for type in registry.values() if fitting_port(type, end, side)]


def types_of_unit(registry: Registry, types: Iterable[str], end: Port, side: str) -> list[str]:
    """Return those of `types` whose fitting port has the unit of `end`, such as N for a force."""

    def ports(type: NodeType) -> Mapping[str, Port]:
        return type.output_ports if side == "in" else type.input_ports

    fitting = {name: ports(registry[name])[fitting_port(registry[name], end, side)] for name in types}
    return [name for name, port in fitting.items() if end.unit and port.unit == end.unit]


def wired(patch: Patch, registry: Registry, source: str, target: str) -> Patch:
    """Return the patch with a wire. A node that would begin by itself waits for its first events, unless how it begins
    was chosen.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("footfall", REGISTRY).add("wav-player", REGISTRY)
    >>> wired(patch, REGISTRY, "footfall.onset", "wav-player.start").node("wav-player").parameters
    {'mode': 'at events'}
    """
    after = patch.connect(source, target, registry)
    return after if wire_at(patch, target) else _waiting(after, registry, target)


def _waiting(patch: Patch, registry: Registry, target: str) -> Patch:
    """Return the patch in which the node of this input waits for its events, unless how it begins was chosen."""
    node = patch.node(node_id(target))
    type = registry[node.type]
    if type.input_ports[port_name(target)].kind != "event":
        return patch
    choices = (one for one in type.parameters.values() if isinstance(one, Choice) and AT_EVENTS in one.options)
    begins = {one.name: AT_EVENTS for one in choices if one.default != AT_EVENTS}
    return patch.with_item(replace(node, parameters={**begins, **node.parameters}))


def waiting_hint(before: Patch, after: Patch, registry: Registry, id: str) -> str:
    """Return how node `id` begins since it was `wired` to events; "" if that is as before.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("footfall", REGISTRY).add("wav-player", REGISTRY)
    >>> after = wired(patch, REGISTRY, "footfall.onset", "wav-player.start")
    >>> waiting_hint(patch, after, REGISTRY, "wav-player")
    'WAV player: mode is now at events; it was loop'
    """
    node = after.node(id)
    type = registry[node.type]
    was = type.values(before.node(id).parameters)
    for name, value in node.parameters.items():
        if value == AT_EVENTS != was[name]:
            return f"{node.name_in(registry)}: {type.parameters[name].label.lower()} is now {value}; it was {was[name]}"
    return ""


def connected(patch: Patch, registry: Registry, id: str, end: str, side: str) -> Patch:
    """Return the patch with a wire between the port `end`, on `side` of its node, and the fitting port of node `id`."""
    taken = [port_name(target) for _, target in patch.wires if node_id(target) == id]
    name = fitting_port(registry[patch.node(id).type], port_of(patch, registry, end, side), side, taken)
    if not name:
        return patch
    wire = (end, f"{id}.{name}") if side == "out" else (f"{id}.{name}", end)
    return patch if refusal(patch, registry, *wire) else wired(patch, registry, *wire)


class InsertionPorts(NamedTuple):
    """The input and the output of a node for insertion into a wire."""

    input: str
    output: str


def insertion_ports(patch: Patch, registry: Registry, type: str, wire: Wire) -> InsertionPorts | None:
    """Return the ports with which a node of `type` can be inserted into a wire; None if it cannot."""
    source, target = port_of(patch, registry, wire[0], "out"), port_of(patch, registry, wire[1], "in")
    inputs = (port.name for port in registry[type].inputs if can_connect(source, port))
    outputs = (port.name for port in registry[type].outputs if can_connect(port, target))
    input, output = next(inputs, ""), next(outputs, "")
    return InsertionPorts(input, output) if input and output else None


def sum_of(registry: Registry, kind: str) -> str:
    """Return the node type that adds what several wires of a kind bring; "" if there is none.

    >>> from underfoot.nodes import REGISTRY
    >>> sum_of(REGISTRY, "signal"), sum_of(REGISTRY, "event")
    ('mix', 'join')
    """
    return next((name for name, type in registry.items() if type.is_sum and type.inputs[0].kind == kind), "")


def free_in_sum(patch: Patch, registry: Registry, wire: Wire) -> str:
    """Return a free input of the node that feeds a wire, if that adds its inputs up for this wire alone; "" if not."""
    id, taken = node_id(wire[0]), {target for _, target in patch.wires}
    type = registry[patch.node(id).type]
    feeds_others = any(node_id(source) == id for source, target in patch.wires if (source, target) != wire)
    ends = (f"{id}.{port.name}" for port in type.inputs) if type.is_sum and not feeds_others else ()
    return next((end for end in ends if end not in taken), "")


def types_for_wire(patch: Patch, registry: Registry, wire: Wire) -> list[str]:
    """Return the node types that can be inserted into this wire."""
    return [type for type in registry if insertion_ports(patch, registry, type, wire)]


def inserted(patch: Patch, registry: Registry, id: str, wire: Wire) -> Patch:
    """Return the patch with the unwired node `id` inserted into this wire; unchanged if it does not fit.

    A new Map or Scale takes the range of what feeds it, where that is known, and gives the same; where that has not the
    wanted unit, 0 to 1.
    """
    ports = insertion_ports(patch, registry, patch.node(id).type, wire)
    if ports is None:
        return patch
    wires = tuple((f"{id}.{ports.output}", wire[1]) if other == wire else other for other in patch.wires)
    node, known = patch.node(id), known_range(patch, registry, wire[0])
    into, out = map(registry[node.type].ends, ports)
    if known and into and out and not node.parameters:
        to = [0.0, 1.0] if unit_hint(patch, registry, *wire) else known
        patch = patch.with_item(replace(node, parameters=dict(zip([*into, *out], [*known, *to], strict=True))))
    return wired(replace(patch, wires=wires), registry, wire[0], f"{id}.{ports.input}")


def known_range(patch: Patch, registry: Registry, source: str) -> list[float]:
    """Return the ends of a force, or of what is set to go from low to high; of others, nothing."""
    node = patch.node(node_id(source))
    type = registry[node.type]
    if type.output_ports[port_name(source)].unit == "N":
        return [0.0, FULL_FORCE_N]
    values = type.values(node.parameters)
    return [values[name] for name in type.ends(port_name(source))]


def fed_alike(patch: Patch, registry: Registry, copies: Mapping[str, str]) -> Patch:
    """Return the patch in which copies of nodes, by the ids of those, are also fed by what feeds those from outside."""
    fed = [wire for wire in patch.wires if node_id(wire[1]) in copies and node_id(wire[0]) not in copies]
    wires = (*patch.wires, *((source, renamed_end(target, copies)) for source, target in fed))
    return replace(patch, wires=wires).check(registry)


def removed_and_bridged(patch: Patch, registry: Registry, ids: Iterable[str]) -> Patch:
    """Return the patch without these nodes; each one's first input is wired to its outputs' targets, if it fits."""
    gone = set(ids)
    after = patch.remove(gone)
    into = sources(patch.wires)
    types = patch.node_types(registry)
    for source, target in patch.wires:
        id = node_id(source)
        if node_id(target) in gone:
            continue
        while id in gone:
            first = (into[end] for port in types[id].inputs if (end := f"{id}.{port.name}") in into)
            source = next(first, "")
            id = node_id(source)
        if id and (source, target) not in after.wires and not refusal(after, registry, source, target):
            after = after.connect(source, target, registry)
    return after


def replaced(patch: Patch, registry: Registry, id: str, type: str) -> tuple[Patch, str, int]:
    """Return the patch with a node of `type` instead of node `id`, the new node's id, and the number of lost wires.

    A wire goes to the port of the same name, else to the first free one that fits. Parameters of the same name and unit
    keep values that differ from the old node's defaults.
    """
    old = patch.node(id)
    new = patch.free_id(type)
    began = registry[old.type].initial
    kept = {
        name: value
        for name, value in old.parameters.items()
        if (name, value) not in began.items()
        and _accepts_value(registry[old.type].parameters[name], registry[type].parameters.get(name), value)
    }
    used: set[str] = set()
    wires, lost = [], 0
    for wire in patch.wires:
        moved = _moved(patch, registry, wire, id, PlacedNode(new, type), used)
        lost += moved is None
        wires += [moved] if moved else []
    node = replace(old, id=new, type=type, parameters={**registry[type].initial, **kept})
    nodes = tuple(node if other.id == id else other for other in patch.nodes)
    groups = renamed([_without_published(group, id) for group in patch.groups], {id: new})
    after = replace(patch, nodes=nodes, wires=tuple(wires), groups=groups)
    for target in (end for _, end in wires if node_id(end) == new):
        after = _waiting(after, registry, target)
    return after.check(registry), new, lost


def _without_published(group: Group, id: str) -> Group:
    if not group.published:
        return group
    kept = tuple(end for end in group.published if node_id(end) != id)
    return replace(group, published=kept)


def _accepts_value(old: Parameter, new: Parameter | None, value: object) -> bool:
    if new is None or new.kind != old.kind:
        return False
    if isinstance(old, Number) and isinstance(new, Number) and old.unit != new.unit:
        return False
    try:
        new.check(value)
    except BadValue:
        return False
    return True


def _moved(patch: Patch, registry: Registry, wire: Wire, id: str, new: PlacedNode, used: set[str]) -> Wire | None:
    """Return the wire with its end moved from node `id` to the new node; None if no port fits."""
    ends = list(wire)
    type = registry[new.type]
    for i, side in enumerate(("out", "in")):
        node, _, name = wire[i].partition(".")
        if node != id:
            continue
        other = port_of(patch, registry, wire[1 - i], "in" if side == "out" else "out")
        ports = type.output_ports if side == "out" else type.input_ports
        fits = [p for p in ports.values() if can_connect(*((p, other) if side == "out" else (other, p)))]
        open_ports = [p.name for p in fits if side == "out" or f"{new.id}.{p.name}" not in used]
        plain = [name for name in open_ports if name not in type.parameters]
        chosen = name if name in open_ports else next(iter(plain), "")
        if not chosen:
            return None
        ends[i] = f"{new.id}.{chosen}"
        if side == "in":
            used.add(ends[i])
    return ends[0], ends[1]
