"""Parameters that several nodes or sub-patches have in common, and that can be set for all together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from underfoot.errors import BadValue
from underfoot.parameters import Count, Number, Parameter, ask
from underfoot.patch.groups import Group
from underfoot.patch.node import NodeType, Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import node_id, port_name
from underfoot.widgets.design.patch_editing import with_wired_unit


class Shared(NamedTuple):
    """A parameter, the name that its control has, and the nodes that it is set in."""

    parameter: Parameter
    label: str
    ids: Sequence[str]


def shared_by(patch: Patch, registry: Registry, ids: Sequence[str], groups: Sequence[Group]) -> list[Shared]:
    """Return what these sub-patches show alike; if nothing, or without sub-patches, what these nodes have in common."""
    types = [registry[patch.node(id).type] for id in ids]
    own = [Shared(parameter, parameter.label, ids) for parameter in shared_parameters(types).values()]
    return (groups and _shown_alike(patch, registry, groups)) or own


def _shown_alike(patch: Patch, registry: Registry, groups: Sequence[Group]) -> list[Shared]:
    """Return the parameters that all of these sub-patches show, as copies of one do: of the first of the nodes of a
    type in each, of the second, and so on.
    """
    types = patch.types

    def shown(group: Group) -> dict[tuple[str, int, str], str]:
        found = {}
        for end in group.published:
            id, type = node_id(end), types[node_id(end)]
            alike = [member for member in group.members if types.get(member) == type]
            found[type, alike.index(id), port_name(end)] = id
        return found

    first, *others = map(shown, groups)
    shared = []
    for key in [key for key in first if all(key in other for other in others)]:
        ids = [first[key], *(other[key] for other in others)]
        own = registry[key[0]].parameters[key[2]]
        common, *rest = (with_wired_unit(patch, registry, id, own) for id in ids)
        if all(other == common for other in rest):
            label = f"{patch.node(ids[0]).name_in(registry)}: {own.label.lower()}"
            shared.append(Shared(common, label, ids))
    return shared


def shared_parameters(types: Sequence[NodeType]) -> dict[str, Parameter]:
    """Return the parameters with the same name, kind and unit in all types; ranges are intersected."""
    first, *others = types
    found = {}
    for name, parameter in first.parameters.items():
        common: Parameter | None = parameter
        for other in others:
            common = _common(common, other.parameters.get(name))
        if common is not None:
            found[name] = common
    return found


def _common(a: Parameter | None, b: Parameter | None) -> Parameter | None:
    if a is None or b is None or type(a) is not type(b):
        return None
    if isinstance(a, Number | Count) and isinstance(b, Number | Count):
        low, high = max(a.low, b.low), min(a.high, b.high)
        if a.unit != b.unit or low >= high or getattr(a, "scale", "") != getattr(b, "scale", ""):
            return None
        if (low, high) == (a.low, a.high):
            return a
        default = min(max(a.default, low), high)
        # Ranges of two counts are whole numbers, and so are these ends.
        return ask(a.name, replace(a, low=low, high=high, default=default))  # type: ignore[arg-type]
    alike = replace(b, default=a.default, doc=a.doc, label=a.label) == a
    return a if alike else None


def values_of(
    patch: Patch, registry: Registry, ids: Sequence[str], name: str, instead: Mapping[tuple[str, str], object]
) -> list[Any]:
    """Return the distinct values of a parameter in these nodes, in their order; `instead`, by node and parameter, stand
    for the patch's own.
    """
    found: list[Any] = []
    there = {node.id: node for node in patch.nodes}
    for id in ids:
        node = there[id]
        parameter = registry[node.type].parameters[name]
        own = node.parameters.get(name, parameter.default)
        value = shown_value(parameter, [instead.get((id, name), own), own])
        if value not in found:
            found.append(value)
    return found


def shown_value(parameter: Parameter, values: Sequence[Any]) -> object:
    """Return the first of these values that all nodes allow."""
    for value in values:
        try:
            return parameter.check(value)
        except BadValue:
            continue
    return parameter.default
