"""Marks of a patch applied to it: muted, bypassed and soloed nodes become wiring, so that no node needs to know.

- A *muted* node outputs zeros and no events. A muted output plays nothing.
- A *bypassed* node passes its input on: each of its wires starts instead at the source of its first connected input
  that fits. If none fits, it outputs nothing. An output cannot be bypassed, because nothing follows it.
- If any node is *soloed*, sums keep only what passes through a soloed node: at a Mix, a Join, and among the outputs.
  Signals that shape it, such as an envelope, stay.

Requested errors of nodes are multiplied by the patch's error factor: the result is the patch as built, not as drawn.
"""

from functools import cache

import msgspec
from msgspec.structs import replace

from underfoot.parameters import Choice, Number, Parameter
from underfoot.patch.node import NodeType, Port, Registry, can_connect
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire, downstream, node_id, port_name, sources


def effective_patch(patch: Patch, registry: Registry) -> Patch:
    """Return the patch to build in place of a checked `patch`: the same nodes, without marks.

    A parameter that loses its wire becomes 0, or as near to 0 as its range allows: its own value, which was overridden,
    may be loud.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tone", REGISTRY).add("low-pass", REGISTRY).add("tile-output", REGISTRY)
    >>> patch = patch.connect("tone.out", "low-pass.signal", REGISTRY)
    >>> patch = patch.connect("low-pass.out", "tile-output.acceleration", REGISTRY)
    >>> effective_patch(patch.mark(["low-pass"], "bypassed", on=True), REGISTRY).wires
    (('tone.out', 'low-pass.signal'), ('tone.out', 'tile-output.acceleration'))
    """
    patch = _with_scaled_errors(patch, registry)
    if not any(node.marks for node in patch.nodes):
        return patch
    types = patch.node_types(registry)
    wires = _soloed(patch, types, _bypassed(patch, types, _unmuted(patch, types)))
    return _silenced(patch, types, wires)


def without_missing(patch: Patch, registry: Registry) -> "Patch":
    """Return the patch without nodes that only stand in for missing ones: its playable part.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tone", REGISTRY)
    >>> without_missing(patch, REGISTRY) is patch
    True
    """
    gone = [placed.id for placed in patch.nodes if registry[placed.type].missing]
    return patch.remove(gone) if gone else patch


def scaled_error(parameter: Parameter, value: float | str, scale: float) -> float | str:
    """Return a requested error times the patch's factor, limited to the parameter's range.

    Of a choice, return the largest option that is not above it, or the smallest option if all are.

    >>> scaled_error(Number(1e-3, 1e-7, 0.1), 1e-3, 1000.0)
    0.1
    >>> [scaled_error(Choice("1", options=("1", "0.3", "0.1")), "1", scale) for scale in (2.0, 0.5, 0.05)]
    ['1', '0.3', '0.1']
    """
    wanted = float(value) * scale
    if isinstance(parameter, Number):
        return min(max(wanted, parameter.low), parameter.high)
    assert isinstance(parameter, Choice)
    options = [option for option in parameter.options if float(option) <= wanted * (1.0 + 1e-9)]
    return max(options, key=float) if options else min(parameter.options, key=float)


def _with_scaled_errors(patch: Patch, registry: Registry) -> Patch:
    """Return the patch with each requested error multiplied by its factor, and a factor of 1."""
    if patch.error_scale == 1.0:
        return patch
    nodes = []
    for node in patch.nodes:
        error = registry[node.type].parameters.get("error")
        if error is not None:
            value = scaled_error(error, node.parameters.get("error", error.default), patch.error_scale)
            node = replace(node, parameters={**node.parameters, "error": value})
        nodes.append(node)
    return replace(patch, nodes=tuple(nodes), error_scale=1.0)


def can_be_bypassed(type: NodeType) -> bool:
    """Return whether a node of this type can be bypassed.

    >>> from underfoot.nodes import REGISTRY
    >>> [can_be_bypassed(REGISTRY[type]) for type in ("low-pass", "tone", "modal-bank", "tile-output")]
    [True, False, False, False]
    """
    kinds = {port.kind for port in type.inputs}
    return not type.is_sink and any(port.kind in kinds for port in type.outputs)


def _unmuted(patch: Patch, types: dict[str, NodeType]) -> list[Wire]:
    """Return the wires that neither start at a muted node nor end at a muted output."""
    muted = {node.id for node in patch.nodes if node.muted}
    sinks = {id for id in muted if types[id].is_sink}
    return [wire for wire in patch.wires if node_id(wire[0]) not in muted and node_id(wire[1]) not in sinks]


def _bypassed(patch: Patch, types: dict[str, NodeType], wires: list[Wire]) -> list[Wire]:
    """Reroute wires from bypassed nodes to their inputs; wires for which nothing fits are left out."""
    past = {node.id for node in patch.nodes if node.bypassed and not types[node.id].is_sink}
    wired = sources(wires)

    @cache
    def origin(source: str, target: str) -> str:
        id = node_id(source)
        if id not in past:
            return source if _fits(source, target, types) else ""
        for port in types[id].inputs:
            before = wired.get(f"{id}.{port.name}", "")
            found = origin(before, target) if before and port.kind == _output(source, types).kind else ""
            if found:
                return found
        return ""

    moved = [(origin(source, target), target) for source, target in wires]
    return [wire for wire in moved if wire[0]]


def _soloed(patch: Patch, types: dict[str, NodeType], wires: list[Wire]) -> list[Wire]:
    """Remove the wires into sums that come through no soloed node."""
    soloed = {node.id for node in patch.nodes if node.soloed}
    if not soloed:
        return wires
    carrying = downstream(wires, soloed)

    def stays(wire: Wire) -> bool:
        source, target = node_id(wire[0]), node_id(wire[1])
        if target in soloed:
            return True
        if types[target].is_sink:
            return target in carrying
        adds = types[target].is_sum and port_name(wire[1]) not in types[target].parameters
        return not adds or target not in carrying or source in carrying

    return [wire for wire in wires if stays(wire)]


def _silenced(patch: Patch, types: dict[str, NodeType], wires: list[Wire]) -> Patch:
    """Return the patch with these wires; parameters that lost theirs are as near to 0 as their range allows."""
    kept = {target for _, target in wires}
    lost = [target for _, target in patch.wires if target not in kept]
    values: dict[str, dict[str, float]] = {}
    for target in lost:
        id, _, name = target.partition(".")
        parameter = types[id].parameters.get(name)
        if isinstance(parameter, Number):
            values.setdefault(id, {})[name] = min(max(0.0, parameter.low), parameter.high)
    nodes = tuple(
        replace(
            node,
            parameters={**node.parameters, **values.get(node.id, {})},
            muted=msgspec.UNSET,
            bypassed=msgspec.UNSET,
            soloed=msgspec.UNSET,
        )
        for node in patch.nodes
    )
    return replace(patch, nodes=nodes, wires=tuple(wires))


def _fits(source: str, target: str, types: dict[str, NodeType]) -> bool:
    return can_connect(_output(source, types), types[node_id(target)].input_ports[port_name(target)])


def _output(source: str, types: dict[str, NodeType]) -> Port:
    return types[node_id(source)].output_ports[port_name(source)]
