"""Edits of a patch, shared by several parts of the window. Without Qt."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from msgspec import structs

from underfoot.errors import BadFile, BadValue
from underfoot.parameters import FilePath, Number, Parameter, ask
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.groups import LONGEST_LABEL
from underfoot.patch.node import Port, Registry, can_connect
from underfoot.patch.patch import FORMAT, Patch, PlacedNode
from underfoot.patch.wiring import Wire, downstream, node_id, port_name, upstream
from underfoot.quantities import counted, pretty_text, pretty_unit
from underfoot.widgets.theme import GRID

Place = tuple[float, float]
Sizes = Mapping[str, tuple[float, float]]


def snapped(x: float, y: float) -> Place:
    """Return the nearest position on the grid.

    >>> snapped(13.0, -3.0)
    (16.0, 0.0)
    """
    return float(round(x / GRID) * GRID), float(round(y / GRID) * GRID)


def pasted(patch: Patch, text: str, registry: Registry, folder: Path | None = None) -> tuple[Patch, list[str]]:
    """Return the patch with the nodes and notes in `text` added, slightly beside the original, and the new ids; raise
    `BadFile` if the text has no patch.

    Paths of files in `folder` become relative to it.
    """
    if not text.strip():
        raise BadFile("the clipboard holds no text; copy nodes first")
    text = _without_mail(text)
    if not text.startswith("{") or FORMAT not in text:
        raise BadFile("the clipboard holds no patch, but other text; copy nodes first, or the whole text of a patch")
    unknown = sorted(set(Patch.unchecked(text, "the clipboard").types.values()) - set(registry))
    if unknown:
        raise BadFile(
            f"the clipboard has nodes of a type that is not installed: {', '.join(unknown)}; "
            "install its package, or put its file into nodes beside the patch"
        )
    other = with_files_kept(Patch.loads(text, registry, "the clipboard"), registry, None, folder)
    if not other.nodes and not other.notes:
        raise BadFile("the clipboard holds a patch without nodes; copy nodes first")
    after = patch.paste(other, registry, (4.0 * GRID, 4.0 * GRID))
    before = {one.id for one in patch.canvas_items()}
    return after, [one.id for one in after.canvas_items() if one.id not in before]


def readers(registry: Registry, path: Path) -> Iterator[tuple[str, str]]:
    """Yield the node types that are for files such as this one, each with the parameter that names it.

    >>> from underfoot.nodes import REGISTRY
    >>> list(readers(REGISTRY, Path("Heel.WAV")))
    [('wav-player', 'file')]
    """
    for type in registry.values():
        for name, parameter in type.parameters.items():
            if isinstance(parameter, FilePath) and path.suffix.lower() in parameter.suffixes:
                yield type.type, name


def name_of_file(path: Path) -> str:
    """Return what a node is called that reads this file; its name may have spaces and marks that a label cannot have.

    >>> name_of_file(Path("steps/Heel\u202f1 \u200e(left).wav")), name_of_file(Path())
    ('Heel 1 (left)', '')
    """
    return "".join(filter(str.isprintable, " ".join(path.stem.split())))[:LONGEST_LABEL]


def _without_mail(text: str) -> str:
    """Return the patch in a text, without what a mail puts before its lines, as marks of a quote, and around it.

    >>> _without_mail('Look:\\n> {"format": "underfoot-patch",\\n>  "version": 1}\\n> Yours')
    '{"format": "underfoot-patch",\\n"version": 1}'
    """
    text = re.sub(r"^[>\s\ufeff]+", "", text, flags=re.MULTILINE)
    found = re.search(rf'\{{\s*"format":\s*"{FORMAT}".*\}}', text, re.DOTALL)
    return found[0] if found else text


def aligned(places: Mapping[str, Place], side: str, sizes: Sizes) -> dict[str, Place]:
    """Return positions aligned on `side` ("left", "right", "top", "bottom") or with equal gaps ("across", "down").

    `sizes` are the drawn widths and heights, in pixels.
    """
    if len(places) < 2:
        return dict(places)
    axis = 0 if side in ("left", "right", "across") else 1
    starts = {id: at[axis] for id, at in places.items()}
    lengths = {id: sizes[id][axis] for id in places}
    if side in ("left", "top"):
        moved = dict.fromkeys(places, min(starts.values()))
    elif side in ("right", "bottom"):
        end = max(starts[id] + lengths[id] for id in places)
        moved = {id: end - lengths[id] for id in places}
    else:
        moved = _evenly_spaced(starts, lengths)
    return {id: snapped(*((moved[id], at[1]) if axis == 0 else (at[0], moved[id]))) for id, at in places.items()}


def _evenly_spaced(starts: Mapping[str, float], lengths: Mapping[str, float]) -> dict[str, float]:
    order = sorted(starts, key=starts.__getitem__)
    room = starts[order[-1]] - starts[order[0]] - sum(lengths[id] for id in order[:-1])
    gap = max(room / (len(order) - 1), 2.0 * GRID)
    moved, place = {}, starts[order[0]]
    for id in order:
        moved[id] = place
        place += lengths[id] + gap
    return moved


def disconnection(wires: int) -> str:
    """Return the name of the undo step that removes this many wires."""
    return f"Disconnect {counted(wires, 'wire')}" if wires > 1 else "Disconnect"


def refusal(patch: Patch, registry: Registry, source: str, target: str) -> str:
    """Return the reason why a wire from `source` to `target` is not allowed; "" if it is allowed."""
    try:
        patch.connect(source, target, registry)
    except BadValue as error:
        # The wire's place in the file would mean nothing to the user.
        text = re.sub(r"^wires\[\d+\] is ", "", with_names(patch, registry, str(error)))
        return pretty_text(text.replace("->", "→").replace("<-", "←").replace("'", ""))
    return ""


def unit_hint(patch: Patch, registry: Registry, source: str, target: str) -> str:
    """Return what to put into a wire that brings a force, a place or a speed to a parameter without a unit, or to one
    unit what drives a parameter of another; "" for any other wire, as that of a sound, which may be a factor.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tile-force", REGISTRY).add("tone", REGISTRY)
    >>> unit_hint(patch, REGISTRY, "tile-force.force", "tone.amplitude").partition(". ")[0]
    'Tile force brings N; amplitude is a plain number'
    >>> patch = patch.add("value", REGISTRY).connect("value.out", "tone.frequency", REGISTRY)
    >>> patch = patch.connect("value.out", "tone.amplitude", REGISTRY)
    >>> unit_hint(patch, REGISTRY, "value.out", "tone.amplitude").partition(". ")[0]
    'Value brings Hz, for frequency; amplitude is a plain number'
    """
    parameter, own = _driven(patch, registry, target), port_of(patch, registry, source, "out").unit
    if parameter is None or own == "m/s^2" or (own and parameter.unit):
        return ""
    brings, remedy = pretty_unit(own), "Force envelope or a Map" if own == "N" else "Map"
    if not own:
        driven = [_driven(patch, registry, end) for start, end in patch.wires if start == source]
        other = next((one for one in driven if one is not None and one.unit != parameter.unit), None)
        if other is None:
            return ""
        brings, remedy = f"{pretty_unit(other.unit) or 'plain numbers'}, for {other.label.lower()}", "Map"
    wants = f"is in {pretty_unit(parameter.unit)}" if parameter.unit else "is a plain number"
    name = patch.node(node_id(source)).name_in(registry)
    return f"{name} brings {brings}; {parameter.label.lower()} {wants}. Double-click the wire for a {remedy} between"


def map_hint(patch: Patch, registry: Registry, source: str, target: str) -> str:
    """Return how a wire that brings one unit to a parameter in another gets a Map between; "" for any other wire.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tile-force", REGISTRY).add("tone", REGISTRY)
    >>> map_hint(patch, REGISTRY, "tile-force.force", "tone.frequency").partition(". ")[0]
    'Tile force brings N; frequency is in Hz'
    """
    parameter, own = _driven(patch, registry, target), port_of(patch, registry, source, "out")
    if parameter is None or own.kind != "signal" or "" in (own.unit, parameter.unit) or own.unit == parameter.unit:
        return ""
    brings, wants = pretty_unit(own.unit), f"{parameter.label.lower()} is in {pretty_unit(parameter.unit)}"
    name = patch.node(node_id(source)).name_in(registry)
    return f"{name} brings {brings}; {wants}. Let it go with Shift, and a Map goes between"


def _driven(patch: Patch, registry: Registry, end: str) -> Number | None:
    """Return the number that a wire to this end drives, in its wired unit; None for one that has none yet."""
    declared = registry[patch.node(node_id(end)).type].parameters.get(port_name(end))
    known = with_wired_unit(patch, registry, node_id(end), declared) if declared is not None else None
    return known if isinstance(known, Number) and (known.unit or not known.unit_of) else None


def with_names(patch: Patch, registry: Registry, text: str) -> str:
    """Return a message with the names that the canvas shows instead of ids, which it does not; of nodes that share a
    name with both.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("gain", REGISTRY).name("gain", "Kies").add("mix", REGISTRY).add("mix", REGISTRY)
    >>> with_names(patch, REGISTRY, "gain.a; allowed: the inputs of gain: gain")
    'Kies.a; allowed: the inputs of Kies: gain'
    >>> with_names(patch, REGISTRY, "gain <- mix1 <- gain; take one away")
    'Kies <- Mix (mix1) <- Kies; take one away'
    """
    names = patch.names(registry)
    ids = "|".join(map(re.escape, names))
    return re.sub(rf"(?<![\w.-])(?:{ids})(?=\.\w| <-|[:;])", lambda found: names[found[0]], text) if ids else text


def drivers(patch: Patch) -> dict[str, dict[str, str]]:
    """Return, for each node, its wired inputs with the outputs that feed them."""
    found: dict[str, dict[str, str]] = {}
    for source, target in patch.wires:
        id, _, port = target.partition(".")
        found.setdefault(id, {})[port] = source
    return found


def with_wired_unit(patch: Patch, registry: Registry, id: str, parameter: Parameter) -> Parameter:
    """Return a parameter of node `id` in the unit that its wires give it; unchanged if they give none, or several."""
    if not isinstance(parameter, Number) or not parameter.unit_of:
        return parameter
    unit = _wired_unit(patch, registry, f"{id}.{parameter.unit_of}")
    return ask(parameter.name, replace(parameter, unit=unit)) if unit else parameter


def outputs_with_wired_units(patch: Patch, registry: Registry, id: str) -> tuple[Port, ...]:
    """Return the outputs of node `id`; a signal without a unit has that of the inputs to which its wires go."""
    return tuple(
        port
        if port.unit or port.kind == "event"
        else structs.replace(port, unit=_wired_unit(patch, registry, f"{id}.{port.name}"))
        for port in registry[patch.node(id).type].outputs
    )


def _wired_unit(patch: Patch, registry: Registry, end: str) -> str:
    """Return the unit of what is wired to a port, "" for none or several. An input that takes any unit gives none."""
    units = set[str | None]()
    for source, target in patch.wires:
        if source == end:
            number = _driven(patch, registry, target)
            units.add(number.unit if number else port_of(patch, registry, target, "in").unit or None)
        elif target == end:
            others = patch.disconnect([(source, target)])  # and never back here, by a parameter with this input's unit
            units.add(port_of(patch, registry, source, "out").unit or _wired_unit(others, registry, source))
    units.discard(None)
    return (units.pop() or "") if len(units) == 1 else ""


def port_of(patch: Patch, registry: Registry, end: str, side: str) -> Port:
    """Return the port "node.port" on the side "in" or "out"."""
    id, _, name = end.partition(".")
    type = registry[patch.node(id).type]
    return (type.input_ports if side == "in" else type.output_ports)[name]


def is_only_heard(patch: Patch, registry: Registry, id: str) -> bool:
    """Return whether the output of this node reaches only audio outputs, and no tile."""
    reached = (registry[patch.node(one).type] for one in downstream(patch.wires, [id]))
    to_sound = [type.to_sound for type in reached if type.is_sink]
    return bool(to_sound) and all(to_sound)


def open_targets(patch: Patch, registry: Registry, source: str) -> list[str]:
    """Return the inputs that an output can be wired to and is not: unwired ones first, then unwired parameters, then
    those whose wire would be replaced.
    """
    id, _, port = source.partition(".")
    output = registry[patch.node(id).type].output_ports[port]
    behind = upstream(patch.wires, [id])
    wired = {target for _, target in patch.wires}
    found = [
        (end in wired, name in registry[node.type].parameters, end)
        for node in patch.nodes
        if node.id not in behind
        for name, target in registry[node.type].input_ports.items()
        if can_connect(output, target) and (source, end := f"{node.id}.{name}") not in patch.wires
    ]
    return [end for *_, end in sorted(found, key=lambda one: one[:2])]


def targets_by_map(patch: Patch, registry: Registry, source: str) -> list[str]:
    """Return the unwired parameters in other units than that of an output, which drives them through a Map.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tile-force", REGISTRY).add("tone", REGISTRY)
    >>> targets_by_map(patch, REGISTRY, "tile-force.force")
    ['tone.frequency']
    """
    behind = upstream(patch.wires, [node_id(source)])
    wired = {target for _, target in patch.wires}
    nodes = [node for node in patch.nodes if node.id not in behind] if "map" in registry else []
    ends = (f"{node.id}.{port.name}" for node in nodes for port in registry[node.type].drivable_ports)
    return [end for end in ends if end not in wired and map_hint(patch, registry, source, end)]


def changed_nodes(before: Patch, after: Patch) -> set[str]:
    """Return the ids of nodes that are new, or whose parameters or wires differ; moved nodes are not included."""
    old = {node.id: node for node in before.nodes}
    changed = {node.id for node in after.nodes if node.id not in old or not _plays_same(old[node.id], node)}
    changed |= {node_id(target) for _, target in set(before.wires) ^ set(after.wires)}
    if _of_all_nodes(before) != _of_all_nodes(after):
        return {node.id for node in after.nodes}
    return changed & {node.id for node in after.nodes}


def _plays_same(a: PlacedNode, b: PlacedNode) -> bool:
    return a is b or (a.type == b.type and a.parameters == b.parameters and a.marks == b.marks)


def _of_all_nodes(patch: Patch) -> tuple[int, float, set[str]]:
    """Return what any node's signal may depend on: the seed, the factor on errors, and which nodes are soloed."""
    return patch.seed, patch.error_scale, {node.id for node in patch.nodes if node.soloed}


def driven_parameters(registry: Registry, type: str, wired: Iterable[str]) -> tuple[str, ...]:
    """Return the wired inputs that are parameters, in the order of declaration."""
    wired = set(wired)
    return tuple(port.name for port in registry[type].drivable_ports if port.name in wired)


def wire_at(patch: Patch, target: str) -> Wire | None:
    """Return the wire that ends at this input; None if there is none."""
    return next((wire for wire in patch.wires if wire[1] == target), None)
