"""Edits of a patch and its undo list, without a screen."""

from itertools import pairwise

import pytest
from design_samples import REGISTRY, sample
from msgspec.structs import replace

from underfoot.errors import BadFile
from underfoot.nodes import REGISTRY as NODES
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch, PlacedNode
from underfoot.patch.wiring import downstream
from underfoot.widgets.design.node_geometry import FIRST_PORT
from underfoot.widgets.design.patch_editing import (
    aligned,
    changed_nodes,
    is_only_heard,
    open_targets,
    outputs_with_wired_units,
    pasted,
    refusal,
    with_wired_unit,
)
from underfoot.widgets.design.placing import layered_places
from underfoot.widgets.design.rewiring import inserted
from underfoot.widgets.design.undo import Document


def test_undo_goes_back_and_steps_that_belong_together_are_one(qapp):
    document = Document(sample())
    seen = []
    document.changed.connect(lambda *patches: seen.append(patches))
    for value in (40.0, 50.0, 60.0):
        document.edit(document.patch.set("step", "threshold", value, REGISTRY), "Set", "drag 1")
    document.edit(document.patch.set("step", "threshold", 70.0, REGISTRY), "Set", "drag 2")
    for value in (80.0, 70.0):
        document.edit(document.patch.set("step", "threshold", value, REGISTRY), "Set", "drag 3")
    assert document.stack.count() == 2, "a drag that ended where it began is no step"
    document.stack.undo()
    assert document.patch.node("step").parameters == {"threshold": 60.0}
    document.stack.undo()
    assert document.patch == sample()
    assert len(seen) == 8
    assert [before for before, _ in seen] == [sample(), *(after for _, after in seen[:-1])]
    document.edit(document.patch, "Nothing")
    assert document.stack.count() == 2


def test_what_is_edited_is_told_apart_from_what_is_opened_with_what_was_there_before(qapp):
    document, seen = Document(Patch(title="a")), []
    for told, name in ((document.changed, "changed"), (document.edited, "edited")):
        told.connect(lambda before, after, name=name: seen.append((name, before.title, after.title)))
    document.load(Patch(title="b"))
    document.switch("B", Patch(title="c"))
    document.edit(Patch(title="d"), "Edit")
    document.stack.undo()
    document.switch("A", Patch(title="b"))
    steps = [("c", "d"), ("d", "c")]
    told = [(name, *step) for step in steps for name in ("changed", "edited")]
    assert seen == [("changed", "a", "b"), ("changed", "b", "c"), *told, ("changed", "c", "b")]


def test_what_is_put_into_the_other_slot_is_undone_to_what_was_there_and_no_further(qapp):
    document, opened, copied = Document(sample()), Patch(title="opened there"), Patch(title="copied")
    document.switch("B", sample())
    document.edit(Patch(title="edited"), "Edit")
    document.switch("A", sample())
    document.edit_other(opened, copied, "Copy to B")
    document.switch("B", copied)
    assert document.stack.count() == 1
    document.stack.undo()
    assert document.patch == opened


def test_pasting_beside():
    text = sample().part(["push", "step"]).dumps().decode()
    after, ids = pasted(sample(), text, REGISTRY)
    assert ids == ["push1", "step1"]
    assert after.node("push1").at == (32.0, 32.0)
    mail = "Look:\n" + "\n".join(f"> {line.replace(' ', chr(160), 1)}" for line in text.splitlines()) + "\n> Kim"
    assert pasted(sample(), mail, REGISTRY) == (after, ids)
    for nonsense in ("", "[]", Patch().dumps().decode()):
        with pytest.raises(BadFile, match="clipboard"):
            pasted(sample(), nonsense, REGISTRY)
    with pytest.raises(BadFile, match="a type that is not installed: squeak; install its package, or"):
        pasted(sample(), text.replace('"push"', '"squeak"'), REGISTRY)


def test_aligning_one_node_changes_nothing():
    assert aligned({"hum": (3.0, 160.0)}, "left", {"hum": (136.0, 80.0)}) == {"hum": (3.0, 160.0)}


def test_nodes_are_spread_evenly_between_the_first_and_the_last():
    places = {"b": (120.0, 8.0), "c": (640.0, 16.0), "a": (0.0, 24.0)}
    sizes = {"a": (96.0, 80.0), "b": (160.0, 80.0), "c": (96.0, 80.0)}
    assert aligned(places, "across", sizes) == {**places, "b": (288.0, 8.0)}, "192 between a and b, and b and c"


def test_a_signal_has_the_unit_of_all_that_it_drives_and_none_where_they_differ():
    """A Map between them takes any: it has that unit, too, as does what drives an end of what drives."""
    patch = Patch()
    for type in ("value", "tone", "delay", "low-pass", "lfo", "map"):
        patch = patch.add(type, NODES)
    patch = patch.connect("lfo.out", "tone.frequency", NODES)
    for end, unit in (("map.signal", ""), ("low-pass.cutoff", "Hz"), ("lfo.low", "Hz"), ("delay.time", "")):
        patch = patch.connect("value.out", end, NODES)
        assert [port.unit for port in outputs_with_wired_units(patch, NODES, "value")] == [unit]
        assert with_wired_unit(patch, NODES, "map", NODES["map"].parameters["low"]).unit == unit


@pytest.mark.parametrize(
    ("source", "target", "ends"),
    [
        ("tile-force.force", "tone.amplitude", [0.0, 750.0, 0.0, 1.0]),
        ("tile-force.force", "stick-slip.force", [0.0, 750.0, 0.0, 750.0]),
        ("value.out", "tone.amplitude", [270.0, 330.0, 0.0, 1.0]),
        ("value.out", "low-pass.cutoff", [270.0, 330.0, 270.0, 330.0]),
    ],
)
def test_a_map_that_is_put_into_a_wire_takes_what_comes_by_it(source, target, ends):
    """At 0 to 1, force and a knob's hertz stood at its upper end: the knob did nothing, as the canvas had advised."""
    patch = Patch().add("value", NODES, low=270.0, high=330.0).add("map", NODES).add("tone", NODES)
    for type in ("tile-force", "stick-slip", "low-pass"):
        patch = patch.add(type, NODES)
    patch = patch.connect("value.out", "tone.frequency", NODES).connect(source, target, NODES)
    found = inserted(patch, NODES, "map", (source, target)).node("map").parameters
    assert [found[name] for name in ("low", "high", "out_low", "out_high")] == ends
    by_hand = patch.set("map", "high", 2.0, NODES)
    assert inserted(by_hand, NODES, "map", (source, target)).node("map").parameters == {"high": 2.0}


def test_a_map_behind_a_plug_in_that_has_one_end_only_keeps_its_range():
    numbers = {name: number for name, number in NODES["value"].parameters.items() if name != "low"}
    patch = Patch().add("value", NODES).add("map", NODES).add("low-pass", NODES)
    patch = patch.connect("value.out", "low-pass.cutoff", NODES)
    nodes = {**NODES, "value": replace(NODES["value"], parameters=numbers)}
    found = inserted(patch, nodes, "map", ("value.out", "low-pass.cutoff"))
    assert found.node("map").parameters == {}


def test_offers_are_never_refused_and_what_is_not_offered_is_or_is_there():
    patch = sample().connect("hum.out", "shaker.acceleration", REGISTRY).add("through", REGISTRY)
    outputs = [f"{n.id}.{port}" for n in patch.nodes for port in REGISTRY[n.type].output_ports]
    inputs = [f"{n.id}.{port}" for n in patch.nodes for port in REGISTRY[n.type].input_ports]
    for source in outputs:
        offered = open_targets(patch, REGISTRY, source)
        assert [refusal(patch, REGISTRY, source, target) for target in offered] == [""] * len(offered)
        there = {target for one, target in patch.wires if one == source}
        assert not there & {*offered}
        assert all(refusal(patch, REGISTRY, source, target) for target in {*inputs} - {*offered} - there)


def test_offers_are_free_inputs_then_free_parameters_then_what_is_wired():
    patch = Patch().add("lfo", NODES).add("gain", NODES).add("mix", NODES)
    patch = patch.connect("gain.out", "mix.a", NODES).connect("lfo.out", "mix.level_d", NODES)
    levels = ["mix.level_a", "mix.level_b", "mix.level_c"]
    free = ["gain.signal", "mix.b", "mix.c", "mix.d", "gain.gain", *levels]
    assert open_targets(patch, NODES, "lfo.out") == [*free, "mix.a"]


def test_only_what_is_downstream_of_a_change_is_rendered_again():
    patch = sample().connect("hum.out", "shaker.acceleration", REGISTRY)
    assert changed_nodes(patch, patch.move({"hum": (8.0, 8.0)})) == set()
    after = patch.set("hum", "frequency", 60.0, REGISTRY)
    assert downstream(after.wires, changed_nodes(patch, after)) == {"hum", "shaker"}
    assert changed_nodes(patch, patch.disconnect([("push.force", "step.force")])) == {"step"}
    for field, value in (("seed", 7), ("error_scale", 10.0)):
        assert changed_nodes(patch, replace(patch, **{field: value})) == {node.id for node in patch.nodes}
    assert changed_nodes(patch, replace(patch, title="Hum")) == set()
    assert changed_nodes(patch, patch.mark(["hum"], "muted", on=True)) == {"hum"}
    assert changed_nodes(patch, patch.mark(["hum"], "soloed", on=True)) == {node.id for node in patch.nodes}
    one, other = (Patch(nodes=(PlacedNode("filter", type),)) for type in ("low-pass", "high-pass"))
    assert changed_nodes(one, other) == {"filter"}


def test_what_reaches_ears_and_no_tile_is_only_heard():
    patch = Patch.load(preset_files.patches()["material-leaves"], NODES)
    heard = {node.type for node in patch.nodes if is_only_heard(patch, NODES, node.id)}
    assert heard == {"drawn-bank", "high-pass", "sound-output"}
    assert sum(is_only_heard(patch, NODES, node.id) for node in patch.nodes) == 3, "not the bank before the tile"
    assert not is_only_heard(Patch().add("noise", NODES), NODES, "noise")


@pytest.mark.parametrize("between", ["b", "bc", "bcd"])
@pytest.mark.parametrize("high", [80.0, 120.0])
def test_a_wire_that_is_tidied_up_does_not_pass_behind_the_nodes_beside_it(between, high):
    """It looked as if it ended there, as that of a force to a product with a curve over the same force."""
    chain = f"a{between}z"
    places = layered_places(dict.fromkeys(chain, (136.0, high)), [*pairwise(chain), ("a", "z")])
    ends_px = [places[id][1] + FIRST_PORT for id in "az"]
    for id in between:
        top = places[id][1]
        assert max(ends_px) < top or min(ends_px) > top + high
