"""Guards: sources that sleep while what multiplies them is silent, and those that may not."""

from made_patches import patch_of

from underfoot.nodes import REGISTRY
from underfoot.patch.program import Program

SQUARED = (
    ("tone.out", "multiply.a"),
    ("tone.out", "multiply.b"),
    ("multiply.out", "mix.a"),
    ("mix.out", "tile-output.acceleration"),
)
ENVELOPED = (("tile-force.force", "multiply.b"), SQUARED[0], *SQUARED[2:])


def unloaded(wires, *scopes):
    program = Program(patch_of(*wires), REGISTRY, ["t1"], block=4800, scopes=scopes)
    program.run(0, 4800)
    return program


def test_a_source_does_not_sleep_where_it_is_heard_past_its_envelope_or_is_its_own_or_is_displayed():
    asleep = unloaded(ENVELOPED)
    assert asleep.awake()["tone"] == 0
    assert not asleep.output.any()
    assert unloaded((*ENVELOPED, ("tone.out", "mix.b"))).output.any()
    assert unloaded(SQUARED).output.any()
    assert unloaded(ENVELOPED, "tone.out").scope["tone.out"].any()


def test_what_no_output_needs_guards_nothing():
    assert unloaded((*ENVELOPED, ("tone.out", "gain.signal"), ("lfo.out", "gain.gain"))).awake()["tone"] == 0
