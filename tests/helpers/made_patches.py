"""Small patches for tests of the engine."""

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch


def patch_of(*wires, seed=3, **parameters):
    """Return a patch of the nodes that the wires name, each node's id being its type; `parameters` by id."""
    ids = dict.fromkeys(end.partition(".")[0] for wire in wires for end in wire)
    patch = Patch(seed=seed)
    for id in ids:
        patch = patch.add(id, REGISTRY, **parameters.get(id.replace("-", "_"), {}))
    for source, target in wires:
        patch = patch.connect(source, target, REGISTRY)
    return patch


def stepped_bank(**parameters):
    """Return a modal bank struck by footfalls and by hand: it rests, wakes, rings and falls asleep."""
    return patch_of(
        ("tile-force.force", "footfall.force"),
        ("footfall.onset", "join.a"),
        ("strike.out", "join.b"),
        ("join.out", "modal-bank.strike"),
        ("modal-bank.out", "tile-output.acceleration"),
        **parameters,
    )


def hum(**parameters):
    """Return a constant tone on every tile."""
    return patch_of(("tone.out", "tile-output.acceleration"), **parameters)


def rough_step():
    """Return noise in proportion to the load, and a push in proportion to the centroid's distance from the centre."""
    return patch_of(
        ("tile-force.force", "scale.signal"),
        ("scale.out", "noise.amplitude"),
        ("noise.out", "mix.a"),
        ("contact.x", "gain.signal"),
        ("gain.out", "mix.b"),
        ("mix.out", "tile-output.acceleration"),
        scale={"high": 500.0, "out_high": 3.0},
        gain={"gain": 20.0},
    )
