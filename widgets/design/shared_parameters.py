"""Parameters that several nodes have in common, and that can be set for all together. Without Qt."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from underfoot.errors import BadValue
from underfoot.parameters import Count, Number, Parameter, ask
from underfoot.patch.node import NodeType, Registry
from underfoot.patch.patch import Patch


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
