"""Features of a patch that a file of another program may not preserve."""

import inspect
from collections.abc import Iterable, Mapping

from underfoot.nodes import REGISTRY
from underfoot.parameters import FilePath, Tiles
from underfoot.patch.node import NodeType
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.quantities import first_of

KEPT: Mapping[str, str] = {
    "force": "the answer to the foot: it plays as for the steps that were rendered",
    "hand": "strikes by hand",
    "chance": "chance: what was drawn at random is the same at each playing",
    "tiles": "which tiles play",
    "sound": "what is for ears",
    "files": "the files that nodes play",
    "title": "title",
    "comment": "comment",
    "author": "author",
    "tags": "tags",
    "notes": "notes",
    "groups": "groups and sub-patches",
    "names": "names that nodes were given",
    "seed": "seed",
    "unit": "the unit: m/s^2 becomes a share of full scale",
    "waveform": "the waveform: within a band it is one oscillation, of which amplitude and frequency are kept",
    "spectrum": "the spectrum: all becomes one oscillation, whose frequency is the middle of what is there",
    "frequency": "frequencies beyond the format's range, which are set to its ends",
    "range": "what lies below or above the format's bands, which is left out",
    "onsets": "what is faster than 5 ms in the envelope",
    "parameters": "nodes, wires and parameters, so that it can be edited on",
}
"""Features that can be preserved, and what their loss means."""

ALWAYS = ("unit", "waveform", "spectrum", "frequency", "range", "onsets")
"""Features of every patch."""
MOST_NODES = 8
"""Nodes that are named in one line."""


def losses(patch: Patch, carries: Iterable[str]) -> tuple[str, ...]:
    """Return the losses of a patch in a format that carries these of `KEPT`: one line each, with the nodes concerned,
    of many the first.

    >>> losses(Patch().add("sound-output", REGISTRY), KEPT.keys() - {"sound"})
    ('what is for ears: sound-output',)
    """
    has = features(patch)
    missing = [name for name in KEPT if name in has and name not in set(carries)]
    return tuple(": ".join(filter(None, (KEPT[name], ", ".join(first_of(has[name], MOST_NODES))))) for name in missing)


def features(patch: Patch) -> dict[str, list[str]]:
    """Return the features in `KEPT` that a patch has, with the nodes that have them, and the names of parameters."""
    found: dict[str, list[str]] = {name: [] for name in ALWAYS}
    for node in patch.nodes:
        type = REGISTRY[node.type]
        for name in _features(node, type):
            text = node.id
            if name == "parameters" and type.parameters:
                text += f" ({', '.join(type.parameters)})"
            found.setdefault(name, []).append(text)
    for name in ("title", "comment", "author", "tags", "notes", "groups", "seed"):
        if getattr(patch, name):
            found[name] = []
    return found


def _features(node: PlacedNode, type: NodeType) -> Iterable[str]:
    values = type.values(node.parameters)
    yield "parameters"
    if node.label:
        yield "names"
    if type.engine_signals:
        yield "force"
    if type.is_struck:
        yield "hand"
    if "key" in inspect.signature(type.binding.functions["run"]).parameters:
        yield "chance"
    if type.to_sound:
        yield "sound"
    if any(isinstance(p, Tiles) and values[name] != "all" for name, p in type.parameters.items()):
        yield "tiles"
    if any(isinstance(p, FilePath) and values[name] for name, p in type.parameters.items()):
        yield "files"
