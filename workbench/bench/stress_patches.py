"""Patches for stress tests: a node at all values that it declares, nodes drawn at random, and less of what fails."""

from collections.abc import Callable, Iterator
from typing import Any

import msgspec
import numpy as np

from underfoot.errors import BadValue
from underfoot.parameters import Choice, Count, FilePath, Number, Numbers, Parameter, Rows
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def random_points(
    type: str, registry: Registry, sound: str, corners: int, points: int, rng: np.random.Generator
) -> Iterator[Patch]:
    """Yield patches with a node at the corners of its parameter box, then at random points, partly wired."""
    node = registry[type]
    numbers = {name: p for name, p in node.parameters.items() if isinstance(p, Number | Count)}
    whole = 2 ** len(numbers)
    chosen = range(whole) if whole <= corners else [0, whole - 1, *rng.integers(whole, size=corners - 2).tolist()]
    for corner in chosen:
        values = _values(type, registry, sound, rng)
        for i, (name, number) in enumerate(numbers.items()):
            high = min(number.high, 1_000_000) if isinstance(number, Count) else number.high
            values[name] = high if corner >> i & 1 else number.low
        yield isolated_patch(type, registry, values)
    drivable = [name for name in node.input_ports if name in node.parameters]
    for _ in range(points if node.parameters else 1):
        wired = tuple(name for name in drivable if rng.random() < 0.2)
        yield isolated_patch(type, registry, _values(type, registry, sound, rng), wired)


def random_patch(registry: Registry, sound: str, rng: np.random.Generator) -> Patch:
    """Draw a patch from the registry: up to a dozen nodes, most inputs wired to earlier ones, and an output."""
    patch = Patch(title="drawn at random", seed=int(rng.integers(1 << 30)))
    types = sorted(registry)
    sinks = [type for type in types if registry[type].is_sink]
    drawn = [types[i] for i in rng.integers(len(types), size=rng.integers(2, 12))]
    for type in ["tile-force", "strike", *drawn, sinks[int(rng.integers(len(sinks)))]]:
        before = patch
        patch = patch.add(type, registry, **_values(type, registry, sound, rng))
        id = patch.nodes[-1].id
        node = registry[type]
        for name, port in node.input_ports.items():
            sources = [
                f"{other.id}.{out}"
                for other in before.nodes
                for out, source in registry[other.type].output_ports.items()
                if source.kind == port.kind and port.unit in ("", source.unit or port.unit)
            ]
            if sources and rng.random() < (0.15 if name in node.parameters else 0.9):
                patch = _connected(patch, sources[int(rng.integers(len(sources)))], f"{id}.{name}", registry)
    return patch


def isolated_patch(type: str, registry: Registry, parameters: dict[str, Any], wired: tuple[str, ...] = ()) -> Patch:
    """Return a patch in which all inputs of a node, and the parameters `wired`, are driven by floor and hand."""
    node = registry[type]
    patch = Patch(seed=3, title=f"{type} under stress").add(type, registry, **parameters)
    ports = [*node.inputs, *(node.input_ports[name] for name in wired)]
    feeds: dict[str, str] = {}
    for port in ports:
        kind = "events" if port.kind == "event" else "m" if port.unit == "m" else "N" if port.unit in ("", "N") else ""
        if kind not in feeds:
            patch, feeds[kind] = _with_source(patch, registry, kind)
        patch = patch.connect(feeds[kind], f"{type}.{port.name}", registry)
    return patch


def minimal_patch(patch: Patch, fails: Callable[[Patch], bool]) -> Patch:
    """Return `patch` without the nodes, wires and settings that are not needed for the failure."""
    for id in [node.id for node in patch.nodes]:
        if len(patch.nodes) > 1 and fails(without := patch.remove([id])):
            patch = without
    for wire in patch.wires:
        if fails(without := patch.disconnect([wire])):
            patch = without
    for node in patch.nodes:
        for name in node.parameters:
            kept = {key: value for key, value in patch.node(node.id).parameters.items() if key != name}
            if fails(without := _with(patch, node.id, kept)):
                patch = without
    return patch


def _values(type: str, registry: Registry, sound: str, rng: np.random.Generator) -> dict[str, Any]:
    return {
        name: sound if isinstance(parameter, FilePath) else _value(parameter, rng)
        for name, parameter in registry[type].parameters.items()
    }


def _value(parameter: Parameter, rng: np.random.Generator) -> object:
    """Draw a value within the declaration; one in eight numbers is at an end of its range."""
    match parameter:
        case Number():
            place = rng.random()
            return parameter.value(float(round(place) if rng.random() < 0.125 else place))
        case Count():
            return int(parameter.low - 1 + (parameter.high - parameter.low + 1) ** rng.random())
        case Choice():
            return parameter.options[int(rng.integers(len(parameter.options)))]
        case Numbers():
            size = int(rng.integers(parameter.least, parameter.most + 1))
            return [float(value) for value in rng.uniform(parameter.low, parameter.high, size)]
        case Rows():
            size = int(parameter.most ** rng.random())
            return [[float(_log_uniform(low, high, rng)) for _, low, high in parameter.columns] for _ in range(size)]
    return parameter.default


def _log_uniform(low: float, high: float, rng: np.random.Generator) -> float:
    place = rng.random()
    value = low * (high / low) ** place if low > 0.0 else low + (high - low) * place
    return min(max(value, low), high)


def _with_source(patch: Patch, registry: Registry, kind: str) -> tuple[Patch, str]:
    """Add a source for inputs of a kind, and return its output: force, position, any unit, or footfalls and strikes."""
    ids = {node.type: node.id for node in patch.nodes[1:]}
    if kind == "m":
        patch = patch.add("contact", registry)
        return patch, f"{patch.nodes[-1].id}.x"
    if "tile-force" not in ids:
        patch = patch.add("tile-force", registry)
        ids["tile-force"] = patch.nodes[-1].id
    force = f"{ids['tile-force']}.force"
    if kind == "N":
        return patch, force
    if kind == "":
        patch = patch.add("gain", registry)
        gain = patch.nodes[-1].id
        return patch.connect(force, f"{gain}.signal", registry), f"{gain}.out"
    for type in ("footfall", "strike", "join"):
        patch = patch.add(type, registry)
    footfall, strike, join = (node.id for node in patch.nodes[-3:])
    patch = patch.connect(force, f"{footfall}.force", registry).connect(f"{footfall}.onset", f"{join}.a", registry)
    return patch.connect(f"{strike}.out", f"{join}.b", registry), f"{join}.out"


def _connected(patch: Patch, source: str, target: str, registry: Registry) -> Patch:
    try:
        return patch.connect(source, target, registry)
    except BadValue:
        return patch


def _with(patch: Patch, id: str, parameters: dict[str, Any]) -> Patch:
    nodes = tuple(msgspec.structs.replace(n, parameters=parameters) if n.id == id else n for n in patch.nodes)
    return msgspec.structs.replace(patch, nodes=nodes)
