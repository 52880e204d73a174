"""The document: nodes and wires as pure data. Every edit gives a new patch; nothing in a file is ever executed."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from underfoot.documents import parse, refusals
from underfoot.errors import BadValue, require
from underfoot.files import read_file, write_file
from underfoot.parameters import IDENTIFIER
from underfoot.patch.node import NodeType, Registry, installed_nodes

FORMAT = "underfoot-patch"
VERSION = 1

FURTHEST = 1e6
"""Pixels from the canvas's middle beyond which nothing stands."""


class PlacedNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A node of a patch: its id, its type, where it stands on the canvas, and the parameters that were set."""

    id: str
    type: str
    at: tuple[float, float] = (0.0, 0.0)
    parameters: Mapping[str, Any] = {}


Wire = tuple[str, str]
"""From "node.port" to "node.port"."""


class Patch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A patch. `check` says whether its nodes and wires fit the node types; every edit keeps a checked patch checked.

    Where a method takes a `registry` and none is given, that is every node type there is.

    >>> patch = Patch(title="Hum").add("tone", frequency=80.0).add("tile-output")
    >>> patch = patch.connect("tone.out", "tile-output.acceleration").set("tone", "amplitude", 2.0)
    >>> patch
    <Patch 'Hum': 2 nodes, 1 wire>
    >>> Patch.loads(patch.dumps()) == patch
    True
    """

    format: str = FORMAT
    version: int = VERSION
    title: str = ""
    comment: str = ""
    seed: int = 0
    nodes: tuple[PlacedNode, ...] = ()
    wires: tuple[Wire, ...] = ()

    def __repr__(self) -> str:
        nodes, wires = len(self.nodes), len(self.wires)
        counted = f"{nodes} node{'s' * (nodes != 1)}, {wires} wire{'s' * (wires != 1)}"
        return f"<Patch {self.title!r}: {counted}>"

    def node(self, id: str) -> PlacedNode:
        """The node with this id; `BadValue` where there is none."""
        for node in self.nodes:
            if node.id == id:
                return node
        known = ", ".join(node.id for node in self.nodes)
        raise BadValue(f"there is no node {id!r}; allowed: {known or 'none, the patch is empty'}")

    # --- edits ---

    def add(
        self, type: str, registry: Registry | None = None, at: tuple[float, float] = (0.0, 0.0), **parameters: Any
    ) -> "Patch":
        """With a new node of `type`; its id is the type's name and the first number that is free."""
        taken = {node.id for node in self.nodes}
        id = next(name for name in (f"{type}{i or ''}" for i in range(len(taken) + 1)) if name not in taken)
        return msgspec.structs.replace(self, nodes=(*self.nodes, PlacedNode(id, type, at, parameters))).check(registry)

    def remove(self, ids: Iterable[str]) -> "Patch":
        """Without these nodes and the wires at them."""
        gone = set(ids)
        return msgspec.structs.replace(
            self,
            nodes=tuple(node for node in self.nodes if node.id not in gone),
            wires=tuple(w for w in self.wires if not gone & {end.partition(".")[0] for end in w}),
        )

    def connect(self, source: str, target: str, registry: Registry | None = None) -> "Patch":
        """With a wire from an output to an input; a wire that was there at the input gives way."""
        wires = tuple(wire for wire in self.wires if wire[1] != target)
        return msgspec.structs.replace(self, wires=(*wires, (source, target))).check(registry)

    def disconnect(self, wires: Iterable[Wire]) -> "Patch":
        """Without these wires."""
        gone = set(wires)
        return msgspec.structs.replace(self, wires=tuple(wire for wire in self.wires if wire not in gone))

    def set(self, id: str, name: str, value: Any, registry: Registry | None = None) -> "Patch":
        """With one parameter of one node changed."""
        node = self.node(id)
        changed = msgspec.structs.replace(node, parameters={**node.parameters, name: value})
        return self._with(changed).check(registry)

    def move(self, places: Mapping[str, tuple[float, float]]) -> "Patch":
        """With nodes at other places."""
        nodes = tuple(
            msgspec.structs.replace(n, at=(float(places[n.id][0]), float(places[n.id][1]))) if n.id in places else n
            for n in self.nodes
        )
        for i, node in enumerate(nodes):
            _check_place(f"nodes[{i}]", node)
        return msgspec.structs.replace(self, nodes=nodes)

    def paste(
        self, other: "Patch", registry: Registry | None = None, by: tuple[float, float] = (32.0, 32.0)
    ) -> "Patch":
        """With the nodes and wires of `other` added, under new ids where theirs are taken, moved `by`."""
        taken = {node.id for node in self.nodes}
        names: dict[str, str] = {}
        for node in other.nodes:
            stem = node.id.rstrip("0123456789") or node.id
            candidates = (node.id, *(f"{stem}{i}" for i in range(1, len(taken) + len(other.nodes) + 2)))
            names[node.id] = next(name for name in candidates if name not in taken)
            taken.add(names[node.id])
        nodes = tuple(
            msgspec.structs.replace(n, id=names[n.id], at=(n.at[0] + by[0], n.at[1] + by[1])) for n in other.nodes
        )
        wires = tuple((_rename(a, names), _rename(b, names)) for a, b in other.wires)
        return msgspec.structs.replace(self, nodes=self.nodes + nodes, wires=self.wires + wires).check(registry)

    def part(self, ids: Iterable[str]) -> "Patch":
        """Only these nodes and the wires between them: what is copied."""
        return self.remove({node.id for node in self.nodes} - set(ids))

    def _with(self, changed: PlacedNode) -> "Patch":
        return msgspec.structs.replace(self, nodes=tuple(changed if n.id == changed.id else n for n in self.nodes))

    # --- checks ---

    def check(self, registry: Registry | None = None) -> "Patch":
        """This patch, or `BadValue`: the place in it, the value, and what is allowed."""
        if registry is None:
            registry = installed_nodes()
        require(self.format == FORMAT, "format", self.format, FORMAT)
        require(self.version == VERSION, "version", self.version, str(VERSION))
        seen: set[str] = set()
        for i, node in enumerate(self.nodes):
            place = f"nodes[{i}]"
            require(bool(IDENTIFIER.fullmatch(node.id)), f"{place}.id", node.id, "letters, digits, - and _")
            require(node.id not in seen, f"{place}.id", node.id, "an id that no other node has")
            seen.add(node.id)
            require(node.type in registry, f"{place}.type", node.type, "a node of `underfoot nodes`")
            _check_place(place, node)
            _check_parameters(registry[node.type], node, place)
        types = {node.id: registry[node.type] for node in self.nodes}
        targets: set[str] = set()
        for i, wire in enumerate(self.wires):
            _check_wire(f"wires[{i}]", wire, types)
            require(wire[1] not in targets, f"wires[{i}]", wire[1], "one wire to an input; use a Mix or a Join node")
            targets.add(wire[1])
        self.order()
        return self

    def order(self) -> tuple[str, ...]:
        """Node ids, each behind the nodes that its inputs come from; `BadValue` for a cycle."""
        sources: dict[str, list[str]] = {node.id: [] for node in self.nodes}
        for source, target in self.wires:
            sources[target.partition(".")[0]].append(source.partition(".")[0])
        order: dict[str, None] = {}
        for start in sources:
            path: dict[str, Any] = {}
            stack = [(start, iter(sources[start]))] if start not in order else []
            while stack:
                id, rest = stack[-1]
                path[id] = None
                for source in rest:
                    if source in path:
                        loop = [*list(path)[list(path).index(source) :], source]
                        raise BadValue(f"wires make a cycle: {' <- '.join(loop)}; take one of these wires away")
                    if source not in order:
                        stack.append((source, iter(sources[source])))
                        break
                else:
                    order[id] = None
                    del path[id]
                    stack.pop()
        return tuple(order)

    # --- files ---

    def dumps(self) -> bytes:
        """The patch as JSON: one line a parameter, in a fixed order, so that files can be compared."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"

    @staticmethod
    def loads(text: bytes | str, registry: Registry | None = None, source: str = "patch") -> "Patch":
        """The patch in `text`; `BadFile` names `source`, the place in it, the value and what is allowed."""
        raw = parse(text, source, FORMAT, VERSION)
        with refusals(source, raw):
            return msgspec.convert(raw, Patch).check(registry)

    @staticmethod
    def load(path: str | Path, registry: Registry | None = None) -> "Patch":
        """The patch in a file."""
        return Patch.loads(read_file(path), registry, str(path))

    def save(self, path: str | Path) -> None:
        """Write the patch beside `path` and move it into place."""
        write_file(path, self.dumps())


def _check_place(place: str, node: PlacedNode) -> None:
    near = all(abs(way) <= FURTHEST for way in node.at)
    require(near, f"{place}.at", node.at, f"two numbers, each -{FURTHEST:g} to {FURTHEST:g}")


def _check_parameters(type: NodeType, node: PlacedNode, place: str) -> None:
    for name, value in node.parameters.items():
        where = f"{place}.parameters"
        known = ", ".join(type.parameters) or "none"
        require(name in type.parameters, where, name, f"the parameters of {node.type}: {known}")
        try:
            type.parameters[name].check(value)
        except BadValue as error:
            raise BadValue(f"{where}.{error}") from None


def _check_wire(place: str, wire: Wire, types: Mapping[str, NodeType]) -> None:
    ports = []
    for end, side in zip(wire, ("output_ports", "input_ports"), strict=True):
        id, dot, port = end.partition(".")
        require(bool(dot), place, end, 'a node and a port, as "node.port"')
        require(id in types, place, end, f"nodes of this patch ({', '.join(types) or 'none'})")
        known = getattr(types[id], side)
        what = side.replace("_ports", "s")
        require(port in known, place, end, f"the {what} of {id}: {', '.join(known) or 'none'}")
        ports.append(known[port])
    source, target = ports
    text = " -> ".join(wire)
    require(source.kind == target.kind, place, text, f"{target.kind}s only, and {wire[0]} gives {source.kind}s")
    if source.unit and target.unit and source.unit != target.unit:
        raise BadValue(f"{place} is {text!r}; allowed: {target.unit}, not {source.unit}; put a Scale node between")


def _rename(end: str, names: Mapping[str, str]) -> str:
    id, _, port = end.partition(".")
    return f"{names[id]}.{port}"
