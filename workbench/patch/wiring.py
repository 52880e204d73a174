"""Wires between nodes: their ends, "node.port", and the nodes that they lead to."""

from collections import defaultdict
from collections.abc import Iterable, Mapping

Wire = tuple[str, str]
"""Wire from "node.port" to "node.port"."""


def node_id(end: str) -> str:
    """Return the node of a wire's end.

    >>> node_id("tone.out"), port_name("tone.out")
    ('tone', 'out')
    """
    return end.partition(".")[0]


def port_name(end: str) -> str:
    """Return the port of a wire's end."""
    return end.partition(".")[2]


def renamed_end(end: str, names: Mapping[str, str]) -> str:
    """Return a wire's end at the new name of its node; a node without one keeps its own.

    >>> renamed_end("tone.out", {"tone": "hum"})
    'hum.out'
    """
    return f"{names.get(node_id(end), node_id(end))}.{port_name(end)}"


def sources(wires: Iterable[Wire]) -> dict[str, str]:
    """Return the output that each wired input takes.

    >>> sources([("tone.out", "gain.signal")])
    {'gain.signal': 'tone.out'}
    """
    return {target: source for source, target in wires}


def following(wires: Iterable[Wire]) -> defaultdict[str, set[str]]:
    """Return the nodes that each node feeds."""
    found = defaultdict[str, set[str]](set)
    for source, target in wires:
        found[node_id(source)].add(node_id(target))
    return found


def reached(ids: Iterable[str], following: Mapping[str, Iterable[str]]) -> set[str]:
    """Return these nodes and all that follow them.

    >>> sorted(reached(["b"], {"a": ["b"], "b": ["c"]}))
    ['b', 'c']
    """
    found = set(ids)
    frontier = list(found)
    while frontier:
        fresh = set(following.get(frontier.pop(), ())) - found
        found |= fresh
        frontier += fresh
    return found


def downstream(wires: Iterable[Wire], ids: Iterable[str]) -> set[str]:
    """Return these nodes and all that they feed."""
    return reached(ids, following(wires))


def upstream(wires: Iterable[Wire], ids: Iterable[str]) -> set[str]:
    """Return these nodes and all that feed them."""
    return reached(ids, following((target, source) for source, target in wires))
