"""Variants of a patch for listening: one output alone, or all outputs attenuated."""

from msgspec import Struct

from underfoot.parameters import Number
from underfoot.patch.node import Port, Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import downstream, sources
from underfoot.quantities import quantity

LEVEL_M_S2 = 1.0
"""Peak acceleration of an auditioned output that is not itself an acceleration."""
CARRIER_HZ = 200.0
"""Frequency of its tone: where a bare sole is most sensitive (Kowalzik et al. 1996)."""
_TICK_S = 0.02
"""Duration of the tick that an event is played as."""


class Audition(Struct, frozen=True):
    """Patch in which one output is played alone, and a description of how."""

    patch: Patch
    text: str


def auditioned(
    patch: Patch, registry: Registry, node: str, port: str = "", tile: str = "", peak: float = 1.0
) -> Audition:
    """Return the patch in which only one output of a node is played, by default its first; on one tile, or on all.

    - An acceleration is played as it is.
    - Another signal sets the amplitude of a tone of `CARRIER_HZ`: `LEVEL_M_S2` at its largest magnitude, `peak`.
    - Events strike what they lead to; those that lead to no output are ticks, `LEVEL_M_S2` at the strength `peak`.

    `BadValue` for an unknown node or output.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tile-force", REGISTRY)
    >>> auditioned(patch, REGISTRY, "tile-force", peak=700.0).text
    'as the loudness of a tone of 200 Hz, 1 m/s² at 700 N'
    """
    type = registry[patch.node(node).type]
    output = type.output_ports[port] if port in type.output_ports else type.outputs[0]
    source = f"{node}.{output.name}"
    plain = patch.mark([one.id for one in patch.nodes], "soloed", on=False).mark([node], "muted", on=False)
    if type.is_sink:
        return Audition(_only(plain, registry, {node}), "as it is")
    if output.kind == "event":
        if _leads_to_a_sink(plain, registry, node):
            return Audition(plain.mark([node], "soloed", on=True), "through what its events strike")
        return Audition(_ticks(plain, registry, source, tile, peak), "its events as ticks")
    if unit_of(patch, registry, node, output) == "m/s^2":
        return Audition(_played(plain, registry, source, tile), "as it is, in m/s²")
    largest = quantity(peak, output.unit, 3) if output.unit else f"{peak:.3g}"
    text = f"as the loudness of a tone of {CARRIER_HZ:g} Hz, {quantity(LEVEL_M_S2, 'm/s^2')} at {largest}"
    return Audition(_as_loudness(plain, registry, source, tile, peak), text)


def attenuated(patch: Patch, registry: Registry, factor: float) -> Patch:
    """Return the patch with its outputs multiplied by `factor`, 0 to 1, as a comparison plays it."""
    if factor == 1.0:
        return patch
    wired = sources(patch.wires)
    for node in patch.nodes:
        type = registry[node.type]
        if not type.is_sink:
            continue
        into = f"{node.id}.{type.inputs[0].name}"
        if source := wired.get(into, ""):
            patch = patch.add("gain", registry, gain=factor)
            gain = patch.nodes[-1].id
            patch = patch.connect(source, f"{gain}.signal", registry).connect(f"{gain}.out", into, registry)
    return patch


def unit_of(patch: Patch, registry: Registry, node: str, output: Port) -> str:
    """Return the unit of an output; if it takes any unit, that of the first input signal of any unit.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("tone", REGISTRY).add("low-pass", REGISTRY)
    >>> low_pass = REGISTRY["low-pass"].outputs[0]
    >>> unit_of(patch.connect("tone.out", "low-pass.signal", REGISTRY), REGISTRY, "low-pass", low_pass)
    'm/s^2'
    """
    if output.unit or output.kind != "signal":
        return output.unit
    type, wired = registry[patch.node(node).type], sources(patch.wires)
    for port in type.inputs:
        if port.kind == "signal" and not port.unit:
            source = wired.get(f"{node}.{port.name}", "")
            id, _, name = source.partition(".")
            found = unit_of(patch, registry, id, registry[patch.node(id).type].output_ports[name]) if source else ""
            if found:
                return found
    return ""


def _played(patch: Patch, registry: Registry, source: str, tile: str) -> Patch:
    """Play a signal on one tile or all, and nothing else."""
    patch = _only(patch, registry, set())
    patch = patch.add("tile-output", registry)
    output = patch.nodes[-1].id
    if tile:
        patch = patch.set(output, "tiles", tile, registry)
    return patch.connect(source, f"{output}.acceleration", registry)


def _as_loudness(patch: Patch, registry: Registry, source: str, tile: str, peak: float) -> Patch:
    """Play a signal as the amplitude of a tone."""
    declared = registry["tone"].parameters["amplitude"]
    assert isinstance(declared, Number)
    amplitude = min(LEVEL_M_S2 / peak, declared.high) if peak > 0.0 else LEVEL_M_S2
    patch = patch.add("tone", registry, frequency=CARRIER_HZ, harmonics=(1.0,), amplitude=amplitude)
    tone = patch.nodes[-1].id
    patch = patch.add("multiply", registry)
    product = patch.nodes[-1].id
    patch = patch.connect(source, f"{product}.a", registry).connect(f"{tone}.out", f"{product}.b", registry)
    return _played(patch, registry, f"{product}.out", tile)


def _ticks(patch: Patch, registry: Registry, source: str, tile: str, peak: float) -> Patch:
    """Play each event as a short note of the tone."""
    patch = patch.add("attack-decay", registry, attack=0.002, decay=_TICK_S / 2, duration=_TICK_S)
    note = patch.nodes[-1].id
    return _as_loudness(patch.connect(source, f"{note}.strike", registry), registry, f"{note}.out", tile, peak)


def _only(patch: Patch, registry: Registry, outputs: set[str]) -> Patch:
    """Mute all outputs but these."""
    sinks = {node.id for node in patch.nodes if registry[node.type].is_sink}
    return patch.mark(sinks - outputs, "muted", on=True).mark(outputs, "muted", on=False)


def _leads_to_a_sink(patch: Patch, registry: Registry, node: str) -> bool:
    return any(registry[patch.node(id).type].is_sink for id in downstream(patch.wires, [node]))
