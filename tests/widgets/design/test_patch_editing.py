"""Edits of a patch and its undo list, without a screen."""

import pytest
from design_samples import REGISTRY, sample
from msgspec.structs import replace

from underfoot.errors import BadFile
from underfoot.nodes import REGISTRY as NODES
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import downstream
from underfoot.widgets.design.patch_editing import (
    aligned,
    changed_nodes,
    is_only_heard,
    open_targets,
    pasted,
    refusal,
)
from underfoot.widgets.design.undo import Document


def test_undo_goes_back_and_steps_that_belong_together_are_one(qapp):
    document = Document(sample())
    seen = []
    document.changed.connect(seen.append)
    for value in (40.0, 50.0, 60.0):
        document.edit(document.patch.set("step", "threshold", value, REGISTRY), "Set", "drag 1")
    document.edit(document.patch.set("step", "threshold", 70.0, REGISTRY), "Set", "drag 2")
    assert document.stack.count() == 2
    document.stack.undo()
    assert document.patch.node("step").parameters == {"threshold": 60.0}
    document.stack.undo()
    assert document.patch == sample()
    assert len(seen) == 6
    document.edit(document.patch, "Nothing")
    assert document.stack.count() == 2


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


def test_only_what_is_downstream_of_a_change_is_rendered_again():
    patch = sample().connect("hum.out", "shaker.acceleration", REGISTRY)
    assert changed_nodes(patch, patch.move({"hum": (8.0, 8.0)})) == set()
    after = patch.set("hum", "frequency", 60.0, REGISTRY)
    assert downstream(after.wires, changed_nodes(patch, after)) == {"hum", "shaker"}
    assert changed_nodes(patch, patch.disconnect([("push.force", "step.force")])) == {"step"}
    for field, value in (("seed", 7), ("error_scale", 10.0)):
        assert changed_nodes(patch, replace(patch, **{field: value})) == {node.id for node in patch.nodes}
    assert changed_nodes(patch, replace(patch, title="Hum")) == set()


def test_what_reaches_ears_and_no_tile_is_only_heard():
    patch = Patch.load(preset_files.patches()["material-leaves"], NODES)
    heard = {node.type for node in patch.nodes if is_only_heard(patch, NODES, node.id)}
    assert heard == {"drawn-bank", "high-pass", "sound-output"}
    assert sum(is_only_heard(patch, NODES, node.id) for node in patch.nodes) == 3, "not the bank before the tile"
    assert not is_only_heard(Patch().add("noise", NODES), NODES, "noise")
