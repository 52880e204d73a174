"""The patch that is played with cues: the floor's own and, on some tiles, presets instead, each at a gain.

It is a patch like any other, so the effect of a cue is swapped in, recorded and replayed like an edit. A preset is in
it once, for all tiles that play it; each gain has an output of its own.
"""

import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from underfoot.errors import BadValue, require
from underfoot.network.cues import ALL
from underfoot.parameters import IDENTIFIER, Tiles
from underfoot.patch import preset_files
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import port_name, renamed_end

SETTABLE = ("number", "count", "choice")
"""Kinds of parameters that a cue may set; none of them names a file."""


@dataclass(frozen=True)
class CuedChanges:
    """Changes requested by cues: preset and gain in decibels by tile, and values by node and parameter."""

    presets: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    values: Mapping[tuple[str, str], Any] = field(default_factory=dict)

    def playing(self, tiles: Iterable[str], preset: str, gain_db: float) -> "CuedChanges":
        """Return the changes with a preset on these tiles."""
        return replace(self, presets={**self.presets, **dict.fromkeys(tiles, (preset, gain_db))})

    def stopped(self, tiles: Iterable[str]) -> "CuedChanges":
        """Return the changes without presets on these tiles, and without values."""
        gone = set(tiles)
        return CuedChanges({tile: cue for tile, cue in self.presets.items() if tile not in gone})

    def setting(self, node: str, parameter: str, value: object) -> "CuedChanges":
        """Return the changes with a value of a parameter."""
        return replace(self, values={**self.values, (node, parameter): value})

    def without_values(self, ends: Iterable[tuple[str, str]]) -> "CuedChanges":
        """Return the changes without the values of these parameters, by node and name."""
        gone = set(ends)
        return replace(self, values={end: value for end, value in self.values.items() if end not in gone})


def with_cues(
    patch: Patch, cued: CuedChanges, tiles: tuple[str, ...], registry: Registry, own: Path | None = None
) -> Patch:
    """Return the patch to play on a floor of these `tiles`. Values of nodes that no longer exist are ignored.

    Presets are those of the program, and the patches in the folder `own`.
    """
    if cued.presets:
        patch = _on_tiles(patch, [tile for tile in tiles if tile not in cued.presets], tiles, registry)
        for preset in dict.fromkeys(preset for preset, _ in cued.presets.values()):
            by_gain: dict[float, list[str]] = {}
            for tile in tiles:
                name, gain_db = cued.presets.get(tile, ("", 0.0))
                if name == preset:
                    by_gain.setdefault(gain_db, []).append(tile)
            patch = _joined(patch, _preset_on(_named(preset, registry, own), by_gain, tiles, registry), registry)
    for (node, parameter), value in cued.values.items():
        if any(one.id == node for one in patch.nodes):
            patch = patch.set(node, parameter, value, registry)
    return patch


def require_settable(patch: Patch, node: str, parameter: str, value: object, registry: Registry) -> object:
    """Return the checked value of a parameter; `BadValue` for one that a cue may not set."""
    parameters = registry[patch.node(node).type].parameters
    allowed = [name for name, one in parameters.items() if one.kind in SETTABLE]
    require(parameter in allowed, "parameter", parameter, ", ".join(allowed) or f"none of {node}")
    return parameters[parameter].check(value)


def _named(preset: str, registry: Registry, own: Path | None) -> Patch:
    """Return the preset of this name; its files are found from everywhere.

    Its nodes' ids end with the name or, where an id cannot have it, with its checksum.
    """
    known = preset_files.patches(own)
    require(preset in known, "preset", preset, "the presets of Underfoot" + (f", and of {own}" if own else ""))
    loaded = with_files_kept(Patch.load(known[preset], registry), registry, known[preset].parent, None)
    suffix = preset if IDENTIFIER.fullmatch(preset) else f"{zlib.crc32(preset.encode()):08x}"
    names = {node.id: f"{node.id}--{suffix}" for node in loaded.nodes}
    nodes = [msgspec.structs.replace(node, id=names[node.id]) for node in loaded.nodes]
    wires = [tuple(renamed_end(end, names) for end in wire)
             for wire in loaded.wires]  # fmt: skip
    return msgspec.structs.replace(loaded, nodes=tuple(nodes), wires=tuple(wires))


def _preset_on(preset: Patch, by_gain: Mapping[float, list[str]], tiles: tuple[str, ...], registry: Registry) -> Patch:
    """Return a preset with an output for the tiles of each gain."""
    parts = _listening(preset, [tile for some in by_gain.values() for tile in some], tiles, registry)
    for gain_db, some in by_gain.items():
        parts = _with_outputs(parts, preset, gain_db, some, tiles, registry)
    return parts


def _listening(patch: Patch, some: list[str], tiles: tuple[str, ...], registry: Registry) -> Patch:
    """Return a patch without its outputs, with inputs from some tiles only."""
    kept = patch.remove(node.id for node in patch.nodes if registry[node.type].is_sink)
    nodes = (_for_tiles(node, some, tiles, registry) or node for node in kept.nodes)
    return msgspec.structs.replace(kept, nodes=tuple(nodes))


def _with_outputs(
    parts: Patch, preset: Patch, gain_db: float, some: list[str], tiles: tuple[str, ...], registry: Registry
) -> Patch:
    """Return a preset's nodes with its outputs for some tiles, at a gain."""
    nodes, wires = list(parts.nodes), list(parts.wires)
    for node in preset.nodes:
        kind = registry[node.type]
        wired = {target: source for source, target in preset.wires if target.startswith(f"{node.id}.")}
        output = _for_tiles(node, some, tiles, registry) if kind.is_sink else None
        if output is None or not wired:
            continue
        first = f"{node.id}.{kind.inputs[0].name}"
        output = msgspec.structs.replace(output, id=f"{node.id}--{some[0]}")
        gain = PlacedNode(f"gain--{output.id}", "gain", node.at, {"gain": 10.0 ** (gain_db / 20.0)})
        nodes += [gain, output]
        for target, source in wired.items():
            port = port_name(target)
            wires.append((source, f"{gain.id}.signal" if target == first else f"{output.id}.{port}"))
        wires.append((f"{gain.id}.out", f"{output.id}.{kind.inputs[0].name}"))
    return msgspec.structs.replace(parts, nodes=tuple(nodes), wires=tuple(wires))


def _on_tiles(patch: Patch, some: list[str], tiles: tuple[str, ...], registry: Registry) -> Patch:
    """Return a patch with its outputs restricted to some tiles; an output without tiles is removed."""
    changed = {node.id: _for_tiles(node, some, tiles, registry) for node in patch.nodes if registry[node.type].is_sink}
    kept = patch.remove(id for id, node in changed.items() if node is None)
    return msgspec.structs.replace(kept, nodes=tuple(changed.get(node.id) or node for node in kept.nodes))


def _for_tiles(node: PlacedNode, some: list[str], tiles: tuple[str, ...], registry: Registry) -> PlacedNode | None:
    """Return a node restricted to some of its tiles; None if none remain. A node for all rows is unchanged."""
    name = next((name for name, one in registry[node.type].parameters.items() if one.kind == "tiles"), "")
    if not name:
        return node
    before = registry[node.type].values(node.parameters)[name]
    left = [tile for tile in some if Tiles.has(before, tile)]
    if not left:
        return None
    return msgspec.structs.replace(
        node, parameters={**node.parameters, name: ALL if len(left) == len(tiles) else "+".join(left)}
    )


def _joined(patch: Patch, other: Patch, registry: Registry) -> Patch:
    """Return both patches as one; `BadValue` if they have common ids."""
    taken = {node.id for node in patch.nodes}
    both = [node.id for node in other.nodes if node.id in taken]
    if both:
        raise BadValue(f"the patch has a node {both[0]!r}, as a preset that is played; give it another id")
    return msgspec.structs.replace(patch, nodes=patch.nodes + other.nodes, wires=patch.wires + other.wires).check(
        registry
    )
