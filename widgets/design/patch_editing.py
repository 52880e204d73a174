"""Edits of a patch that several places offer: what they do to the document, without a screen."""

import re
from collections.abc import Iterable, Mapping

from underfoot.errors import BadFile, BadValue
from underfoot.parameters import Number
from underfoot.patch.node import Port, Registry
from underfoot.patch.patch import Patch, PlacedNode, Wire
from underfoot.quantities import pretty_text
from underfoot.widgets.theme import GRID

Place = tuple[float, float]
Sizes = Mapping[str, tuple[float, float]]


def snapped(x: float, y: float) -> Place:
    """The nearest place on the grid.

    >>> snapped(13.0, -3.0)
    (16.0, 0.0)
    """
    return float(round(x / GRID) * GRID), float(round(y / GRID) * GRID)


def copied(patch: Patch, ids: Iterable[str]) -> str:
    """These nodes and the wires between them as JSON text."""
    return patch.part(ids).dumps().decode()


def pasted(patch: Patch, text: str, registry: Registry, at: Place | None = None) -> tuple[Patch, list[str]]:
    """The patch with the nodes and notes in `text`, their top left corner at `at` or a little beside where they were
    copied from, and the new ones' ids; `BadFile` where the text is no patch."""
    if not text.strip():
        raise BadFile("the clipboard holds no text; copy nodes first")
    other = Patch.loads(text, registry, "the clipboard")
    if not other.nodes and not other.notes:
        raise BadFile("the clipboard holds a patch without nodes; copy nodes first")
    by = (4.0 * GRID, 4.0 * GRID)
    if at is not None:
        there = [one.at for one in other.canvas_items()]
        by = snapped(at[0] - min(x for x, _ in there), at[1] - min(y for _, y in there))
    after = patch.paste(other, registry, by)
    before = {one.id for one in patch.canvas_items()}
    return after, [one.id for one in after.canvas_items() if one.id not in before]


def aligned(places: Mapping[str, Place], side: str, sizes: Sizes) -> dict[str, Place]:
    """Places in line on one `side` ("left", "right", "top", "bottom"), or with equal gaps ("across", "down").
    `sizes` are the widths and heights as drawn."""
    if len(places) < 2:
        return dict(places)
    axis = 0 if side in ("left", "right", "across") else 1
    near = {id: at[axis] for id, at in places.items()}
    far = {id: near[id] + sizes[id][axis] for id in places}
    if side in ("left", "top"):
        moved = dict.fromkeys(places, min(near.values()))
    elif side in ("right", "bottom"):
        end = max(far.values())
        moved = {id: end - sizes[id][axis] for id in places}
    else:
        moved = _evenly_spaced(near, {id: sizes[id][axis] for id in places})
    return {id: snapped(*((moved[id], at[1]) if axis == 0 else (at[0], moved[id]))) for id, at in places.items()}


def _evenly_spaced(near: Mapping[str, float], lengths: Mapping[str, float]) -> dict[str, float]:
    order = sorted(near, key=near.__getitem__)
    room = near[order[-1]] - near[order[0]] - sum(lengths[id] for id in order[:-1])
    gap = max(room / (len(order) - 1), 2.0 * GRID)
    moved, place = {}, near[order[0]]
    for id in order:
        moved[id] = place
        place += lengths[id] + gap
    return moved


def can_connect(source: Port, target: Port) -> bool:
    """Whether two ports look as if a wire fits; `Patch.connect` has the last word."""
    return source.kind == target.kind and (not source.unit or not target.unit or source.unit == target.unit)


def refusal(patch: Patch, registry: Registry, source: str, target: str) -> str:
    """Why there can be no wire from `source` to `target`, in words; empty where there can be one."""
    try:
        patch.connect(source, target, registry)
    except BadValue as error:
        # Where in the file the wire would stand means nothing to a person who drags one.
        text = re.sub(r"^wires\[\d+\] is ", "", str(error))
        return pretty_text(text.replace("->", "→").replace("<-", "←").replace("'", ""))
    return ""


def drivers(patch: Patch) -> dict[str, dict[str, str]]:
    """For each node, the inputs that have a wire, and the output that it comes from."""
    found: dict[str, dict[str, str]] = {}
    for source, target in patch.wires:
        id, _, port = target.partition(".")
        found.setdefault(id, {})[port] = source
    return found


def downstream(patch: Patch, ids: Iterable[str]) -> set[str]:
    """These nodes and all that their outputs reach."""
    return _reached(((source, target) for source, target in patch.wires), ids)


def is_only_heard(patch: Patch, registry: Registry, id: str) -> bool:
    """Whether what this node does comes to ears, and to no tile."""
    reached = (registry[patch.node(one).type] for one in downstream(patch, [id]))
    to_sound = [type.to_sound for type in reached if type.is_sink]
    return bool(to_sound) and all(to_sound)


def upstream(patch: Patch, ids: Iterable[str]) -> set[str]:
    """These nodes and all that their inputs come from."""
    return _reached(((target, source) for source, target in patch.wires), ids)


def _reached(edges: Iterable[Wire], ids: Iterable[str]) -> set[str]:
    following: dict[str, list[str]] = {}
    for a, b in edges:
        following.setdefault(a.partition(".")[0], []).append(b.partition(".")[0])
    reached = set(ids)
    frontier = list(reached)
    while frontier:
        for id in following.get(frontier.pop(), []):
            if id not in reached:
                reached.add(id)
                frontier.append(id)
    return reached


def open_targets(patch: Patch, registry: Registry, source: str) -> list[str]:
    """The inputs that a wire from this output may go to: those without a wire, then those whose wire would give way."""
    id, _, port = source.partition(".")
    output = registry[patch.node(id).type].output_ports[port]
    behind = upstream(patch, [id])
    wired = {target for _, target in patch.wires}
    found = [
        f"{node.id}.{name}"
        for node in patch.nodes
        if node.id not in behind
        for name, target in registry[node.type].input_ports.items()
        if can_connect(output, target)
    ]
    return sorted(found, key=wired.__contains__)


def changed_nodes(before: Patch, after: Patch) -> set[str]:
    """Nodes that are new, or whose parameters or wires differ; those that only moved are not among them."""
    old = {node.id: node for node in before.nodes}
    changed = {node.id for node in after.nodes if node.id not in old or not _plays_same(old[node.id], node)}
    changed |= {target.partition(".")[0] for _, target in set(before.wires) ^ set(after.wires)}
    if before.seed != after.seed or _soloed(before) != _soloed(after):
        return {node.id for node in after.nodes}
    return changed & {node.id for node in after.nodes}


def _plays_same(a: PlacedNode, b: PlacedNode) -> bool:
    return a is b or (a.type == b.type and a.parameters == b.parameters and a.marks == b.marks)


def _soloed(patch: Patch) -> set[str]:
    return {node.id for node in patch.nodes if node.soloed}


def driven_parameters(registry: Registry, type: str, wired: Iterable[str]) -> tuple[str, ...]:
    """Those of the wired inputs that are parameters, in the order of declaration."""
    wired = set(wired)
    return tuple(
        name
        for name, parameter in registry[type].parameters.items()
        if isinstance(parameter, Number) and parameter.wire and name in wired
    )


def wire_at(patch: Patch, target: str) -> Wire | None:
    """The wire that ends at this input."""
    return next((wire for wire in patch.wires if wire[1] == target), None)
