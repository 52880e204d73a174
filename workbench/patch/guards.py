"""Guards: signals that let a free-running source sleep, because they multiply its output by zero.

A free-running source (noise, a tone) is guarded if every path from it to a sink leads through a node that another of
its inputs can mute. While those other inputs are silent the source sleeps with them, and restarts when they wake.
"""

from collections.abc import Mapping, Sequence

from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import following, node_id, port_name, reached, sources


def guarded(
    patch: Patch, registry: Registry, needed: set[str], scopes: Sequence[str]
) -> tuple[tuple[str, ...], dict[str, list[str]]]:
    """Return the live nodes in an order with guards before the nodes they guard, and the guards ("node.port") of each.

    A node that is displayed by a scope is not guarded.
    """
    types = patch.node_types(registry)
    after = following(patch.wires)
    watched = {node_id(scope) for scope in scopes}
    wired = sources(patch.wires)
    guards: dict[str, list[str]] = {}
    for id in patch.order():
        type = types[id]
        ports = [*(port.name for port in type.inputs), *type.muted_by]
        stopped = type.engine_signals or type.is_struck or any(f"{id}.{port}" in wired for port in ports)
        if id not in needed or stopped:
            continue
        found = _guards(id, types, wired, patch.wires, needed, watched)
        if found and reached([id], after).isdisjoint(map(node_id, found)):
            for guard in found:
                after[node_id(guard)].add(id)
            guards[id] = found
    return tuple(id for id in _sorted(patch.order(), after) if id in needed), guards


def _guards(
    id: str,
    types: Registry,
    wired: Mapping[str, str],
    wires: Sequence[Sequence[str]],
    needed: set[str],
    watched: set[str],
) -> list[str] | None:
    """Return signals that must be nonzero for `id` to be audible; None if it may be audible at any time."""
    if id in watched or types[id].is_sink:
        return None
    found: list[str] = []
    for source, target in wires:
        if node_id(source) != id or node_id(target) not in needed:
            continue
        consumer, port = node_id(target), port_name(target)
        muting = types[consumer].muted_by
        others = [wired[f"{consumer}.{name}"] for name in muting if name != port and f"{consumer}.{name}" in wired]
        if port in muting and others and consumer not in watched:
            found.append(others[0])
            continue
        behind = _guards(consumer, types, wired, wires, needed, watched)
        if behind is None:
            return None
        found += behind
    return list(dict.fromkeys(found))


def _sorted(order: Sequence[str], after: Mapping[str, set[str]]) -> list[str]:
    """Sort nodes topologically, each after its predecessors in `after`; otherwise as in `order`."""
    waits = {id: sum(id in follow for follow in after.values()) for id in order}
    done: list[str] = []
    rest = list(order)
    while rest:
        id = next(id for id in rest if waits[id] == 0)
        rest.remove(id)
        done.append(id)
        for follower in after[id]:
            waits[follower] -= 1
    return done
