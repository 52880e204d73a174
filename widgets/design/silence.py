"""Explanations of why a patch is silent."""

from collections import defaultdict
from collections.abc import Callable, Mapping

from underfoot.parameters import FilePath
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import node_id

ASLEEP_REPORTS = 8
"""Number of consecutive reports of costs, at 2 Hz, in which every node is asleep."""
_ALONE = {"begin": "at once", "pace": "at its frequency", "mode": "loop"}
"""Choices by which a node needs no events to run."""


def why_silent(patch: Patch, registry: Registry, id: str) -> str:
    """Return the node, at or before this one, that is muted, has unwired inputs or no file, as text; "" if there is
    none.
    """
    sources = defaultdict(list)
    for source, target in patch.wires:
        sources[target].append(node_id(source))
    waiting, seen = [id], {id}
    while waiting:
        here = waiting.pop(0)
        node = patch.node(here)
        type = registry[node.type]
        if node.muted:
            return f"{node.name_in(registry)} is muted"
        fed = [source for port in type.inputs for source in sources[f"{here}.{port.name}"]]
        values = type.values(node.parameters)
        if any(isinstance(one, FilePath) and not values[name] for name, one in type.parameters.items()):
            return f"{node.name_in(registry)} has no file"
        runs_alone = any(values.get(name) == choice for name, choice in _ALONE.items())
        if type.inputs and not fed and not runs_alone:
            inputs = " or ".join(port.name for port in type.inputs)
            return f"nothing comes to {inputs}" + (f" of {node.name_in(registry)}" if here != id else "")
        waiting += [source for source in dict.fromkeys(fed) if source not in seen]
        seen.update(fed)
    return ""


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
