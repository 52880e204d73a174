"""The stress finds what is broken on purpose, names it, and cuts it down to the patch that shows it."""

import math

import numpy as np
import pytest
import soundfile

from underfoot.bench import stability
from underfoot.bench.stress_patches import isolated_patch, minimal_patch, random_patch, random_points
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node
from underfoot.patch.patch import Patch


@node("explosive", "Tests")
class Explosive:
    """Divides by its input's distance from full scale."""

    signal = Input()
    width = Number(0.0, 0.0, 1.0)
    out = Output()

    def run(signal, width, out):
        for i in range(out.size):
            out[i] = math.inf if signal[i] == 750.0 and width >= 0.5 else 0.0


WITH_EXPLOSIVE = {**REGISTRY, "explosive": Explosive}


@pytest.fixture
def sound(tmp_path):
    soundfile.write(tmp_path / "sound.wav", np.sin(np.arange(500) * 0.05), 44_100)
    return tmp_path / "sound.wav"


def test_a_broken_node_is_named_with_a_patch_that_shows_it(sound):
    registry = {type: WITH_EXPLOSIVE[type] for type in ("explosive", "gain", "tile-force")}
    found = stability.run(registry, sound, stability.Extent(corners=2, points=0, patches=0, seconds=0.0))
    assert [failure.what.split(" ")[0] for failure in found.failures] == ["explosive"]
    failure = found.failures[0]
    assert {placed.type for placed in failure.patch.nodes} <= {"explosive", "tile-force", "gain"}
    assert failure.patch.node("explosive").parameters == {"width": 1.0}
    again = Patch.loads(failure.patch.dumps(), WITH_EXPLOSIVE)
    assert stability.stress(again, WITH_EXPLOSIVE, failure.rate) == failure.what
    assert failure.patch.dumps().decode() in failure.line()


def test_the_smallest_patch_keeps_only_what_fails():
    patch = isolated_patch("explosive", WITH_EXPLOSIVE, {"width": 0.9}).add("noise", REGISTRY | WITH_EXPLOSIVE)
    less = minimal_patch(patch, lambda p: any(n.type == "explosive" and n.parameters for n in p.nodes))
    assert [(placed.type, placed.parameters) for placed in less.nodes] == [("explosive", {"width": 0.9})]
    assert less.wires == ()


@pytest.mark.parametrize("rate", stability.RATES)
def test_healthy_patches_withstand_everything(rate):
    patch = Patch()
    for type in ("tile-force", "low-pass", "tile-output", "strike", "modal-bank"):
        patch = patch.add(type, REGISTRY)
    for wire in (
        ("tile-force.force", "low-pass.signal"),
        ("low-pass.out", "tile-output.acceleration"),
        ("strike.out", "modal-bank.strike"),
    ):
        patch = patch.connect(*wire, REGISTRY)
    assert stability.stress(patch, REGISTRY, rate) == ""


def test_random_patches_are_patches_and_come_again_with_the_seed(sound):
    first, second = ([random_patch(REGISTRY, str(sound), rng) for _ in range(30)] for rng in rngs(7, 7))
    assert first == second
    assert all(patch.check(REGISTRY) is patch and len(patch.nodes) >= 4 for patch in first)
    assert sum(len(patch.wires) for patch in first) > 60


def test_every_parameter_drawn_is_allowed(sound):
    (rng,) = rngs(3)
    for type, declared in REGISTRY.items():
        for patch in random_points(type, REGISTRY, str(sound), 4, 10, rng):
            declared.values(patch.node(type).parameters)


def test_a_patch_endures_from_late_in_the_day():
    patch = Patch().add("noise", REGISTRY, amplitude=100.0).add("tile-output", REGISTRY)
    patch = patch.connect("noise.out", "tile-output.acceleration", REGISTRY)
    assert stability.run_long(patch, REGISTRY, 8_000, 1.0, 86_000 * 8_000) == ""


def rngs(*seeds):
    return [np.random.default_rng(seed) for seed in seeds]
