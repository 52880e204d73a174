"""Explanations of why a patch is silent."""

from collections.abc import Callable, Mapping

from underfoot.parameters import Choice, FilePath, Number, Tiles
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import downstream, node_id, sources
from underfoot.widgets.controls.fields import value_text
from underfoot.widgets.design.rewiring import AT_EVENTS

ASLEEP_REPORTS = 8
"""Number of consecutive reports of costs, at 2 Hz, in which every node is asleep."""
_OPTIONAL = ("restart",)
"""Inputs without which a node runs."""


def why_silent(patch: Patch, registry: Registry, id: str, tile: str = "") -> str:
    """Return what silences a node, at it or before it, as text; "" if nothing does that can be seen without running it.

    That is a mark, an input without a wire, a factor of 0, a missing file, or that it is not for this `tile`.
    """
    soloed = [node for node in patch.nodes if node.soloed]
    is_sink = registry[patch.node(id).type].is_sink
    if is_sink and soloed and id not in downstream(patch.wires, {one.id for one in soloed}):
        return f"{soloed[0].name_in(registry)} is soloed"
    wired = sources(patch.wires)
    waiting, seen = [id], {id}
    while waiting:
        node = patch.node(waiting.pop(0))
        if why := _why_alone(node, registry, wired, tile, of=f" of {node.name_in(registry)}" if node.id != id else ""):
            return why
        type = registry[node.type]
        ports = dict.fromkeys([*(port.name for port in type.inputs), *type.muted_by])
        fed = [node_id(wired[end]) for end in (f"{node.id}.{port}" for port in ports) if end in wired]
        waiting += [source for source in dict.fromkeys(fed) if source not in seen]
        seen.update(fed)
    return ""


def _why_alone(node: PlacedNode, registry: Registry, wired: Mapping[str, str], tile: str, of: str) -> str:
    """Return what silences this node by itself; `of` says which node an input or a factor is of."""
    name, type = node.name_in(registry), registry[node.type]
    if node.muted:
        return f"{name} is muted"
    if node.bypassed:
        return ""  # its own factors and inputs do not count
    values = type.values(node.parameters)
    for one in type.parameters.values():
        value = values[one.name]
        if isinstance(one, FilePath) and not value:
            return f"{name} has no file"
        if isinstance(one, Tiles) and tile and not Tiles.has(value, tile):
            return f"{name} is not for {tile}"
        is_factor = one.name in type.muted_by or (isinstance(one, Number) and one.scale == "gain" and one.low == 0.0)
        if is_factor and value == 0.0 and f"{node.id}.{one.name}" not in wired:
            return f"{one.label.lower()}{of} is {value_text(one, value)}"
    begins = [one for one in type.parameters.values() if isinstance(one, Choice) and AT_EVENTS in one.options]
    runs_alone = any(values[one.name] != AT_EVENTS for one in begins)
    inputs = [port.name for port in type.inputs if port.name not in _OPTIONAL]
    free = [name for name in inputs if f"{node.id}.{name}" not in wired]
    missing = free if free == inputs and not runs_alone else [name for name in free if name in type.muted_by]
    waits = "".join(f", and {one.label.lower()} is {AT_EVENTS}" for one in begins if not runs_alone)
    return f"no wire leads to {' or '.join(missing)}{of}{waits}" if missing else ""


class SilenceHint:
    """Emits, once per start, what a patch waits for if it has not sounded for some seconds."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._reports: int | None = None

    def begin(self, playing: bool) -> None:
        """Note whether playback has begun or ended."""
        self._reports = 0 if playing else None

    def take(self, patch: Patch, registry: Registry, awake: Mapping[str, int]) -> None:
        """Process the current number of awake tiles of each node."""
        if self._reports is None or not patch.nodes:
            return
        self._reports = None if any(awake.values()) else self._reports + 1
        if self._reports == ASLEEP_REPORTS:
            self._reports = None
            why = self._why(patch, registry, is_played=any(node.id in awake for node in patch.nodes))
            if why:
                self._say(f"Nothing sounds: {why}")

    def _why(self, patch: Patch, registry: Registry, *, is_played: bool) -> str:
        """Return the reason; "" for a patch that is not played, as its file is gone, for which that was said."""
        sinks = [node for node in patch.nodes if registry[node.type].is_sink]
        if not sinks:
            return "a patch sounds through a Tile output"
        for sink in sinks:
            why = why_silent(patch, registry, sink.id)
            if why:
                return why
        if not is_played:
            return ""
        if any(registry[node.type].engine_signals for node in patch.nodes):
            return "no foot presses a tile. A click on the tile at the lower right strikes it"
        return "it has come to its end. P plays it from the start"
