"""Nodes as they are added by hand: what is felt first from each, alone on a tile, is not already in the limiter."""

import numpy as np
import pytest

from underfoot.engine.commands import Play
from underfoot.engine.levels import headroom_db
from underfoot.engine.loop import Loop
from underfoot.engine.preview import one_step
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE_HZ, STEP_S = 48_000, 1.2
SOURCES = {"N": "tile-force.force", "m": "contact.x"}
LEAST_ROOM_DB = 6.0
"""A step may be twice as strong as the adult one."""


def signals(unit):
    """Return (node, output) of all nodes that make a signal of this unit by themselves."""
    ends = [(name, port) for name, node in REGISTRY.items() if not node.is_sink for port in node.outputs]
    return [(name, port.name) for name, port in ends if port.kind == "signal" and port.unit == unit]


EVENTS = [(name, p.name) for name, node in REGISTRY.items() for p in node.outputs if p.kind == "event"]
RINGING = [
    (name, output)
    for name, output in signals("m/s^2")
    if any(port.kind == "event" and port.name == "strike" for port in REGISTRY[name].inputs)
]


def added(patch, name):
    """Add a node as the canvas does, with forces from the tile, places from the contact, events from footfalls."""
    patch = patch.add(name, REGISTRY, **REGISTRY[name].initial)
    id = patch.nodes[-1].id
    for port in REGISTRY[name].inputs:
        source = "footfall.onset" if port.kind == "event" else SOURCES.get(port.unit)
        if source is not None:
            feeder = source.partition(".")[0]
            if feeder not in {node.id for node in patch.nodes}:
                patch = added(patch, feeder)
            patch = patch.connect(source, f"{id}.{port.name}", REGISTRY)
    return patch


def room_db(patch, output):
    """Return the headroom of what a tile plays of this output on one adult step, in decibels."""
    patch = patch.add("tile-output", REGISTRY).connect(output, "tile-output.acceleration", REGISTRY)
    force_n, source = one_step(STEP_S, RATE_HZ)
    loop = Loop(patch, REGISTRY, source)
    loop.send(Play(True), 0)
    drive = loop.play(len(force_n))
    return headroom_db(float(np.abs(drive).max(initial=0.0)))


@pytest.mark.parametrize(("name", "output"), signals("m/s^2"))
def test_a_node_added_by_hand_leaves_room_for_a_stronger_step(name, output):
    assert room_db(added(Patch(), name), f"{name}.{output}") > LEAST_ROOM_DB


@pytest.mark.parametrize(("ringing", "ring"), RINGING)
@pytest.mark.parametrize(("name", "output"), EVENTS)
def test_what_a_node_added_by_hand_strikes_leaves_room_for_a_stronger_step(name, output, ringing, ring):
    patch = added(Patch(), name).add(ringing, REGISTRY, **REGISTRY[ringing].initial)
    patch = patch.connect(f"{name}.{output}", f"{ringing}.strike", REGISTRY)
    assert room_db(patch, f"{ringing}.{ring}") > LEAST_ROOM_DB


def test_a_file_that_leaves_a_value_out_has_the_old_one():
    for node in REGISTRY.values():
        for name in node.initial:
            assert node.values({})[name] == node.parameters[name].default
    assert REGISTRY["stick-slip"].values({})["level"] == 0.1
    assert REGISTRY["rhythm"].values({})["repeats"] == 3


def test_a_metronome_added_by_hand_does_not_end():
    patch = added(Patch(), "rhythm").disconnect([("footfall.onset", "rhythm.start")])
    program = Program(patch, REGISTRY, ("t1",), block=RATE_HZ, scopes=("rhythm.out",))
    for second in range(3):
        program.run(second * RATE_HZ, RATE_HZ)
    assert len(program.events("rhythm.out")) >= 6
