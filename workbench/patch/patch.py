"""Patch document: nodes and wires as plain data. Every edit returns a new patch; nothing in a file is executed."""

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec.structs import replace

from underfoot.arguments import choice, plain
from underfoot.documents import as_declared, parse, refusals
from underfoot.errors import BadValue, refusal, require
from underfoot.files import read_file, write_file
from underfoot.parameters import require_identifier
from underfoot.patch.custom_nodes import run_needed
from underfoot.patch.groups import (
    Group,
    Note,
    check_label,
    check_notes_and_groups,
    check_place,
    is_pair,
    renamed,
    without,
)
from underfoot.patch.node import NodeType, Registry, installed_nodes
from underfoot.patch.node_files import has_nodes
from underfoot.patch.wiring import Wire, node_id, renamed_end
from underfoot.quantities import counted

_T = TypeVar("_T")
FORMAT = "underfoot-patch"
VERSION = 1

LEAST_SCALE, MOST_SCALE = 0.01, 100.0
"""Range of the factor on all requested errors."""
_LEFT_OUT = ("notes", "groups", "author", "tags")
"""Fields that are omitted in the file when empty."""
_END = 'a node and a port, as "node.port"'
MARKS = ("muted", "bypassed", "soloed")
"""Marks that take a node, or everything else, out of the output (`underfoot.patch.effective`)."""


class PlacedNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Node of a patch: its id, its type, its position on the canvas, and the parameters that were set.

    `muted`, `bypassed` and `soloed` are marks. A mark that was never set is not in the file.
    """

    id: str
    type: str
    at: tuple[float, float] = (0.0, 0.0)
    parameters: Mapping[str, Any] = {}
    label: str = ""
    """Label on the canvas, in place of its type's name."""
    muted: bool | msgspec.UnsetType = msgspec.UNSET
    bypassed: bool | msgspec.UnsetType = msgspec.UNSET
    soloed: bool | msgspec.UnsetType = msgspec.UNSET

    @property
    def marks(self) -> tuple[str, ...]:
        """Return those of `MARKS` that are set."""
        return tuple(name for name in MARKS if getattr(self, name))

    def name_in(self, registry: Registry) -> str:
        """Return the name that it was given, or else that of its type."""
        return self.label or registry[self.type].label


CanvasItem = TypeVar("CanvasItem", PlacedNode, Note, Group)


class Patch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Patch document. `check` validates its nodes and wires; every edit keeps a valid patch valid.

    Where a method takes a `registry`, the default is all node types.

    >>> patch = Patch(title="Hum").add("tone", frequency=80.0).add("tile-output")
    >>> patch = patch.connect("tone.out", "tile-output.acceleration").set("tone", "amplitude", 2.0)
    >>> patch
    <Patch 'Hum': 2 nodes, 1 wire>
    >>> Patch.loads(patch.dumps()) == patch
    True
    >>> sand = Patch().add("modal-bank", modes=((90.0, 20.0, 1.0),))
    >>> Patch.loads(sand.dumps()) == sand
    True
    """

    format: str = FORMAT
    version: int = VERSION
    title: str = ""
    comment: str = ""
    seed: int = 0
    nodes: tuple[PlacedNode, ...] = ()
    wires: tuple[Wire, ...] = ()
    notes: tuple[Note, ...] = ()
    groups: tuple[Group, ...] = ()
    author: str = ""
    tags: tuple[str, ...] = ()
    error_scale: float = 1.0
    """Factor on the requested errors of its nodes (`underfoot.patch.effective`)."""

    def __post_init__(self) -> None:
        as_declared(self)

    def __repr__(self) -> str:
        return f"<Patch {self.title!r}: {counted(len(self.nodes), 'node')}, {counted(len(self.wires), 'wire')}>"

    @property
    def types(self) -> dict[str, str]:
        """Return the name of each node's type, by the node's id."""
        return {node.id: node.type for node in self.nodes}

    def node_types(self, registry: Registry) -> dict[str, NodeType]:
        """Return the declaration of each node's type, by the node's id."""
        return {node.id: registry[node.type] for node in self.nodes}

    def node(self, id: str) -> PlacedNode:
        """Return the node with this id; `BadValue` if there is none."""
        for node in self.nodes:
            if node.id == id:
                return node
        known = ", ".join(node.id for node in self.nodes)
        raise BadValue(f"there is no node {id!r}; allowed: {known or 'none, the patch is empty'}")

    def names(self, registry: Registry | None = None) -> dict[str, str]:
        """Return the name of each node that the canvas shows, by its id; of nodes that share one with the id.

        >>> Patch().add("gain").name("gain", "Kies").add("mix").add("mix").names()
        {'gain': 'Kies', 'mix': 'Mix (mix)', 'mix1': 'Mix (mix1)'}
        """
        types = _given_or_all(registry)
        names = {node.id: node.name_in(types) for node in self.nodes}
        shared = Counter(names.values())
        return {id: f"{name} ({id})" if shared[name] > 1 else name for id, name in names.items()}

    def group(self, id: str) -> Group:
        """Return the group with this id; `BadValue` if there is none."""
        for group in self.groups:
            if group.id == id:
                return group
        raise BadValue(f"there is no group {id!r}; allowed: {', '.join(g.id for g in self.groups) or 'none'}")

    def canvas_items(self) -> "tuple[PlacedNode | Note, ...]":
        """Return everything on the canvas: the nodes, then the notes."""
        return *self.nodes, *self.notes

    def ids(self) -> set[str]:
        """Return all ids in use: of nodes, notes and groups."""
        return {one.id for one in self.canvas_items()} | {group.id for group in self.groups}

    def free_id(self, stem: str) -> str:
        """Return `stem`, or `stem` with the first free number."""
        taken = self.ids()
        return next(name for name in (f"{stem}{i or ''}" for i in range(len(taken) + 1)) if name not in taken)

    # --- edits ---

    def add(
        self, type: str, registry: Registry | None = None, at: tuple[float, float] = (0.0, 0.0), **parameters: object
    ) -> "Patch":
        """Add a node of `type`; its id is the type's name with the first free number."""
        values = {name: _as_in_file(value) for name, value in parameters.items()}
        made = PlacedNode(self.free_id(type), type, at, values)
        return replace(self, nodes=(*self.nodes, made)).check(registry)

    def remove(self, ids: Iterable[str]) -> "Patch":
        """Remove these nodes and notes, and the wires at them; of a group, only the frame; `BadValue` for other ids."""
        gone = _ids_of(self, ids)
        return replace(
            self,
            nodes=tuple(node for node in self.nodes if node.id not in gone),
            wires=tuple(w for w in self.wires if not gone & {node_id(end) for end in w}),
            notes=tuple(note for note in self.notes if note.id not in gone),
            groups=without(self.groups, gone),
        )

    def connect(self, source: str, target: str, registry: Registry | None = None) -> "Patch":
        """Add a wire from an output to an input, unless it is here; it replaces another wire at the input."""
        for name, end in (("source", source), ("target", target)):
            require(isinstance(end, str), name, end, _END)
        if (source, target) in self.wires:
            return self.check(registry)
        wires = tuple(wire for wire in self.wires if wire[1] != target)
        return replace(self, wires=(*wires, (source, target))).check(registry)

    def disconnect(self, wires: Iterable[Wire]) -> "Patch":
        """Remove these wires; `BadValue` for one that is not here."""
        allowed = 'a list, such as [("tone.out", "gain.signal")]'
        gone = _set_of(wires, "wires", allowed)
        require(not any(isinstance(wire, str) for wire in gone), "wires", wires, allowed)
        if unknown := gone.difference(self.wires):
            known = ", ".join(map(str, self.wires)) or "none"
            raise BadValue(f"there is no wire {min(unknown, key=str)}; allowed: {known}")
        return replace(self, wires=tuple(wire for wire in self.wires if wire not in gone))

    def set(self, id: str, name: str, value: object, registry: Registry | None = None) -> "Patch":
        """Change one parameter of one node. Only this node is checked: a slider that is moved calls it all the time."""
        node = self.node(id)
        changed = replace(node, parameters={**node.parameters, name: _as_in_file(value)})
        # Whoever sets it knows its id, not its place in a file.
        _check_type(changed, id, _given_or_all(registry))
        return self.with_item(changed)

    def mark(self, ids: Iterable[str], name: str, *, on: bool) -> "Patch":
        """Set or clear one of `MARKS` on these nodes; `BadValue` for an id that is not here.

        >>> from underfoot.nodes import REGISTRY
        >>> Patch().add("tone", REGISTRY).mark(["tone"], "muted", on=True).node("tone").marks
        ('muted',)
        """
        choice("mark", name, MARKS)
        marked = _ids_of(self, ids)
        value = {name: True if on else msgspec.UNSET}
        nodes = tuple(replace(n, **value) if n.id in marked else n for n in self.nodes)
        return replace(self, nodes=nodes)

    def name(self, id: str, label: str) -> "Patch":
        """Change a node's label on the canvas; its id stays."""
        check_label(f"the name of {id}", label)
        return self.with_item(replace(self.node(id), label=label))

    def move(self, places: Mapping[str, tuple[float, float]]) -> "Patch":
        """Move nodes, notes and collapsed groups. Members of a group move with it; `BadValue` for an unknown id."""
        require(isinstance(places, Mapping), "places", places, 'places by their ids, such as {"tone": (0.0, 100.0)}')
        _ids_of(self, places)
        for id, place in places.items():
            require(is_pair(place), f"{id}.at", place, "two numbers")
        to = {id: (float(x), float(y)) for id, (x, y) in places.items()}
        groups = list(self.groups)
        for i, group in enumerate(groups):
            if group.id in to:
                by = (to[group.id][0] - group.at[0], to[group.id][1] - group.at[1])
                groups[i] = replace(group, at=to[group.id])
                inside = set(group.members)
                stands = {one.id: one.at for one in self.canvas_items() if one.id in inside}
                stands |= {g.id: g.at for g in groups[i + 1 :] if inside.issuperset(g.members)}
                to = {id: (x + by[0], y + by[1]) for id, (x, y) in stands.items()} | to
        for kind, ids in (
            ("nodes", [node.id for node in self.nodes]),
            ("notes", [note.id for note in self.notes]),
            ("groups", [group.id for group in groups]),
        ):
            for i, id in enumerate(ids):
                if id in to:
                    check_place(f"{kind}[{i}]", to[id])
        nodes = tuple(replace(n, at=to[n.id]) if n.id in to else n for n in self.nodes)
        notes = tuple(replace(n, at=to[n.id]) if n.id in to else n for n in self.notes)
        return replace(self, nodes=nodes, notes=notes, groups=tuple(groups))

    def paste(
        self, other: "Patch", registry: Registry | None = None, by: tuple[float, float] = (32.0, 32.0)
    ) -> "Patch":
        """Add the contents of `other`, with new ids where needed, shifted by `by`."""
        require(isinstance(other, Patch), "other", other, 'a Patch, such as open_patch("gravel")')
        require(is_pair(by), "by", by, "two numbers")
        taken = self.ids()
        names: dict[str, str] = {}
        theirs = [*(one.id for one in other.canvas_items()), *(group.id for group in other.groups)]
        for id in theirs:
            stem = id.rstrip("0123456789") or id
            candidates = (id, *(f"{stem}{i}" for i in range(1, len(taken) + len(theirs) + 2)))
            names[id] = next(name for name in candidates if name not in taken)
            taken.add(names[id])

        def moved(one: CanvasItem) -> CanvasItem:
            return replace(one, id=names[one.id], at=(one.at[0] + by[0], one.at[1] + by[1]))

        wires = tuple((renamed_end(a, names), renamed_end(b, names)) for a, b in other.wires)
        return replace(
            self,
            nodes=(*self.nodes, *map(moved, other.nodes)),
            wires=self.wires + wires,
            notes=(*self.notes, *map(moved, other.notes)),
            groups=(*self.groups, *map(moved, renamed(other.groups, names))),
        ).check(registry)

    def part(self, ids: Iterable[str]) -> "Patch":
        """Return only these nodes and notes, with the wires between them and the groups wholly among them, for copying.
        A group stands for what is in it; `BadValue` for an id that is not here."""
        kept = _ids_of(self, ids)
        kept.update(id for group in self.groups if group.id in kept for id in group.members)
        cut = {group.id for group in self.groups if not kept.issuperset(group.members)}
        return self.remove(({one.id for one in self.canvas_items()} - kept) | cut)

    def with_item(self, changed: "PlacedNode | Note | Group") -> "Patch":
        """Return the patch with this node, note or group in place of the one with its id. It is not checked."""
        field = {PlacedNode: "nodes", Note: "notes", Group: "groups"}[type(changed)]
        items = tuple(changed if one.id == changed.id else one for one in getattr(self, field))
        return replace(self, **{field: items})

    # --- checks ---

    def check(self, registry: Registry | None = None) -> "Patch":
        """Return this patch, or raise `BadValue` with the place, the value, and what is allowed."""
        registry = _given_or_all(registry)
        require(self.format == FORMAT, "format", self.format, FORMAT)
        require(self.version == VERSION, "version", self.version, str(VERSION))
        scale = self.error_scale
        require(LEAST_SCALE <= scale <= MOST_SCALE, "error_scale", scale, f"{LEAST_SCALE:g} to {MOST_SCALE:g}")
        seen: set[str] = set()
        for i, node in enumerate(self.nodes):
            place = f"nodes[{i}]"
            require_identifier(f"{place}.id", node.id)
            require(node.id not in seen, f"{place}.id", node.id, "an id that no other node has")
            seen.add(node.id)
            check_place(place, node.at)
            check_label(f"{place}.label", node.label)
            _check_type(node, place, registry)
        types = self.node_types(registry)
        targets: set[str] = set()
        for i, wire in enumerate(self.wires):
            _check_wire(f"wires[{i}]", wire, types)
            require(wire[1] not in targets, f"wires[{i}]", wire[1], "one wire to an input; use a Mix or a Join node")
            targets.add(wire[1])
        if self.notes or self.groups:
            parameters = {f"{id}.{name}" for id, type in types.items() for name in type.parameters}
            check_notes_and_groups(self.notes, self.groups, seen, parameters)
        self.order()
        return self

    def order(self) -> tuple[str, ...]:
        """Return the node ids, each after the nodes that its inputs come from; `BadValue` for a cycle."""
        sources: dict[str, list[str]] = {node.id: [] for node in self.nodes}
        for source, target in self.wires:
            sources[node_id(target)].append(node_id(source))
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
        """Return the patch as JSON, one line per parameter, in a fixed order, so that files can be compared.

        Empty names, notes, groups, author and tags are omitted, and so is an error factor of 1: older versions can read
        such files.
        """
        fields = msgspec.to_builtins(self)
        for node in fields["nodes"]:
            if not node["label"]:
                del node["label"]
        if fields["error_scale"] == 1.0:
            del fields["error_scale"]
        fields_set = {name: value for name, value in fields.items() if value or name not in _LEFT_OUT}
        return msgspec.json.format(msgspec.json.encode(fields_set), indent=1) + b"\n"

    @staticmethod
    def loads(text: bytes | str, registry: Registry | None = None, source: str = "patch") -> "Patch":
        """Parse the patch in `text`; `BadFile` names `source`, the place in it, the value and what is allowed."""
        raw = parse(text, source, FORMAT, VERSION)
        with refusals(source, raw):
            return msgspec.convert(raw, Patch).check(registry)

    @staticmethod
    def unchecked(text: bytes | str, source: str) -> "Patch":
        """Parse a patch but check only its form: nodes and wires may be any."""
        raw = parse(text, source, FORMAT, VERSION)
        with refusals(source, raw):
            return msgspec.convert(raw, Patch)

    @staticmethod
    def load(path: str | Path, registry: Registry | None = None) -> "Patch":
        """Load a patch file. Node files beside it are run if the user agreed to that; else `BadFile` names them."""
        text, file = read_file(path), Path(path)
        if has_nodes(file.parent):
            run_needed(Patch.unchecked(text, str(path)).types.values(), file)
        return Patch.loads(text, registry, str(path))

    def save(self, path: str | Path, registry: Registry | None = None) -> None:
        """Write the patch beside `path` and move it into place; `BadValue` for one that could not be opened again."""
        write_file(path, self.check(registry).dumps())


def _as_in_file(value: object) -> object:
    """Return a parameter's value with lists where a file has them: a patch is equal to its copy from a file."""
    value = plain(value)
    return [*map(_as_in_file, value)] if isinstance(value, list | tuple) else value


def _check_type(node: PlacedNode, place: str, registry: Registry) -> None:
    """Check that a node's type exists, and its parameters."""
    require(node.type in registry, f"{place}.type", node.type, "a node of `underfoot nodes`")
    type = registry[node.type]
    if type.missing:  # parameters are kept as they are
        return
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
        require("." in end, place, end, _END)
        id, _, port = end.partition(".")
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


def _ids_of(patch: Patch, ids: Iterable[str]) -> set[str]:
    """Return these ids; `BadValue` for one that the patch does not have, as where a script has a word misspelt."""
    chosen, known = _set_of(ids), patch.ids()
    if unknown := chosen - known:
        allowed = ", ".join(sorted(known)) or "none, the patch is empty"
        raise BadValue(f"there is no {min(unknown, key=str)!r}; allowed: {allowed}")
    return chosen


def _set_of(given: Iterable[_T], name: str = "ids", allowed: str = 'a list of ids, such as ["tone"]') -> set[_T]:
    require(isinstance(given, Iterable) and not isinstance(given, str), name, given, allowed)
    try:
        return set(given)
    except TypeError:  # of lists, say
        raise refusal(name, given, allowed) from None


def _given_or_all(registry: Registry | None) -> Registry:
    allowed = "a registry of node types; a parameter is given by its name, as frequency=80.0"
    require(registry is None or isinstance(registry, Mapping), "registry", registry, allowed)
    return installed_nodes() if registry is None else registry
