"""Muted, bypassed and soloed nodes: what is heard of a patch."""

import msgspec
import numpy as np
import pytest
from loops import loop_of, played
from made_patches import patch_of

from underfoot.engine.patch_edits import moved_numbers
from underfoot.errors import BadFile, BadValue
from underfoot.nodes import REGISTRY
from underfoot.patch.effective import effective_patch
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.program import Program

FRAMES = 9600


def two_tones(*, marks=()):
    """A tone of 50 Hz through a filter, and one of 300 Hz as loud as an envelope says, added."""
    patch = patch_of(
        ("tone.out", "low-pass.signal"),
        ("low-pass.out", "mix.a"),
        ("scale.out", "noise.amplitude"),
        ("noise.out", "mix.b"),
        ("mix.out", "tile-output.acceleration"),
        scale={"out_low": 2.0, "out_high": 2.0},
    )
    for id, mark in marks:
        patch = patch.mark([id], mark, on=True)
    return patch


def effective(patch):
    return played(loop_of(patch, walking=False), FRAMES)[:, 0]


def test_a_muted_branch_is_as_if_its_wire_were_not_there():
    without = two_tones().disconnect([("noise.out", "mix.b")])
    assert np.array_equal(effective(two_tones(marks=[("noise", "muted")])), effective(without))
    assert np.any(effective(without))


def test_a_muted_output_plays_nothing_and_can_still_be_looked_at():
    patch = two_tones(marks=[("tile-output", "muted")])
    assert not effective(patch).any()
    assert Program(patch, REGISTRY, ["t1"], scopes=["tile-output.played"]).scope_names == ("tile-output.played",)


def test_a_muted_envelope_silences_what_it_shapes_instead_of_letting_it_loose():
    patch = two_tones(marks=[("scale", "muted"), ("tone", "muted")])
    assert patch.node("noise").parameters == {}
    assert not effective(patch).any()


def test_what_is_muted_costs_nothing():
    program = Program(two_tones(marks=[("noise", "muted")]), REGISTRY, ["t1"])
    assert set(program.left_out) == {"noise", "scale"}


def test_wires_of_a_bypassed_node_start_at_the_source_of_its_input():
    straight = two_tones().connect("tone.out", "mix.a", REGISTRY)
    assert np.array_equal(effective(two_tones(marks=[("low-pass", "bypassed")])), effective(straight))
    twice = two_tones(marks=[("low-pass", "bypassed"), ("mix", "bypassed")])
    assert ("tone.out", "tile-output.acceleration") in effective_patch(twice, REGISTRY).wires


def test_a_bypassed_node_whose_inputs_do_not_fit_is_silent():
    struck = patch_of(("strike.out", "modal-bank.strike"), ("modal-bank.out", "tile-output.acceleration"))
    assert effective_patch(struck.mark(["modal-bank"], "bypassed", on=True), REGISTRY).wires == (
        ("strike.out", "modal-bank.strike"),
    )
    forced = patch_of(("tile-force.force", "gain.signal"), ("gain.out", "tile-output.acceleration"))
    assert effective_patch(forced.mark(["gain"], "bypassed", on=True), REGISTRY).wires == (
        ("tile-force.force", "gain.signal"),
    )


def test_a_bypassed_node_passes_on_the_first_wired_input_that_fits():
    patch = patch_of(
        ("tile-force.force", "mix.b"),
        ("tone.out", "mix.c"),
        ("noise.out", "mix.d"),
        ("mix.out", "tile-output.acceleration"),
    )
    past = effective_patch(patch.mark(["mix"], "bypassed", on=True), REGISTRY).wires
    assert past == (*patch.wires[:3], ("tone.out", "tile-output.acceleration"))


def test_a_soloed_branch_is_heard_alone_with_what_shapes_it():
    alone = two_tones().disconnect([("low-pass.out", "mix.a")])
    for id in ("noise", "scale"):
        assert np.array_equal(effective(two_tones(marks=[(id, "soloed")])), effective(alone))
    both = two_tones(marks=[("noise", "soloed"), ("tone", "soloed")])
    assert np.array_equal(effective(both), effective(two_tones()))
    assert not effective(two_tones(marks=[("noise", "soloed"), ("noise", "muted")])).any()


def test_what_shapes_a_soloed_signal_by_a_product_or_a_level_stays():
    patch = patch_of(
        ("noise.out", "mix.b"),
        ("tone.out", "multiply.a"),
        ("lfo.out", "multiply.b"),
        ("multiply.out", "mix.a"),
        ("value.out", "mix.level_a"),
        ("mix.out", "tile-output.acceleration"),
    )
    assert effective_patch(patch.mark(["tone"], "soloed", on=True), REGISTRY).wires == patch.wires[1:]


def test_of_several_outputs_the_one_that_plays_what_is_soloed_is_heard():
    patch = two_tones().add("tone", REGISTRY).add("tile-output", REGISTRY)
    patch = patch.connect("tone1.out", "tile-output1.acceleration", REGISTRY)
    first = effective_patch(patch.mark(["tone"], "soloed", on=True), REGISTRY)
    assert ("tone1.out", "tile-output1.acceleration") not in first.wires
    second = effective_patch(patch.mark(["tile-output1"], "soloed", on=True), REGISTRY)
    assert [target for _, target in second.wires if target.startswith("tile-output")] == ["tile-output1.acceleration"]


def test_a_mark_needs_a_new_program_and_a_number_that_nobody_hears_does_not():
    patch = two_tones()
    muted = patch.mark(["scale"], "muted", on=True)
    assert moved_numbers(patch, muted, REGISTRY) is None
    assert moved_numbers(muted, muted.set("noise", "amplitude", 3.0, REGISTRY), REGISTRY) == []


def test_another_seed_and_another_type_under_the_same_name_need_a_new_program():
    patch = two_tones()
    assert moved_numbers(patch, msgspec.structs.replace(patch, seed=patch.seed + 1), REGISTRY) is None
    low, high = (Patch(nodes=(PlacedNode("filter", type),)) for type in ("low-pass", "high-pass"))
    assert moved_numbers(low, high, REGISTRY) is None


def test_marks_are_in_the_file_only_where_they_were_set():
    patch = two_tones()
    assert b"muted" not in patch.dumps()
    marked = patch.mark(["tone", "mix"], "soloed", on=True)
    assert marked.dumps().count(b'"soloed": true') == 2
    assert Patch.loads(marked.dumps(), REGISTRY) == marked
    assert marked.mark(["tone", "mix"], "soloed", on=False).dumps() == patch.dumps()
    assert Patch.loads(marked.part(["tone"]).dumps(), REGISTRY).node("tone").marks == ("soloed",)


def test_a_mark_that_is_no_mark_is_refused():
    raw = msgspec.json.decode(two_tones().dumps())
    raw["nodes"][0]["muted"] = "yes"
    with pytest.raises(BadFile, match=r"nodes\[0\]\.muted"):
        Patch.loads(msgspec.json.encode(raw), REGISTRY)
    with pytest.raises(BadValue, match="muted, bypassed, soloed"):
        two_tones().mark(["tone"], "quiet", on=True)
