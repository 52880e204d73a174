"""Where a block's time goes: every stage and node is there, what sleeps says so, and it all adds up."""

import json

import pytest

from underfoot.bench.block_stages import STAGES, block_stages
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

GRAVEL = preset_files.patches()["material-gravel-coarse"]


@pytest.fixture(scope="module")
def found():
    patch = Patch.load(GRAVEL, REGISTRY).add("tone", REGISTRY)
    return block_stages(patch, default_floor(2, 3), feet=2, simulated=True)


def test_stages_add_up_to_the_block_and_nodes_to_theirs(found):
    assert [stage.stage for stage in found.stages] == list(STAGES)
    assert sum(stage.ms for stage in found.stages) == pytest.approx(found.whole_ms)
    spent = {stage.stage: stage.ms for stage in found.stages}
    for stage in ("source", "rings, forces", "tracking", "signals", "nodes", "safety", "plates", "rings, vibration"):
        assert spent[stage] > 0.0, stage
    assert sum(node.ms for node in found.nodes) == pytest.approx(spent["nodes"])
    assert found.reading_ms > 0.0


def test_nodes_are_awake_where_feet_are_and_say_when_they_sleep(found):
    nodes = {node.node: node for node in found.nodes}
    assert (found.tiles, found.stood_on, found.left_out) == (6, 2, ("tone",))
    assert 1.0 < nodes["tile"].tiles_awake <= 2.0
    assert 0.0 < nodes["ring"].tiles_awake <= 2.0
    assert nodes["out"].sleeps == "acceleration is silent"
    assert nodes["ring"].sleeps == "no event has come, and it has rung out"


def test_an_empty_floor_costs_no_node_anything():
    found = block_stages(Patch.load(GRAVEL, REGISTRY), default_floor(1, 2), feet=0, block=64)
    assert {(node.ms, node.tiles_awake) for node in found.nodes} == {(0.0, 0.0)}


@pytest.mark.parametrize("wrong", [{"feet": 3}, {"feet": -1}, {"feet": 1, "block": 0}])
def test_feet_and_blocks_that_cannot_be_are_refused(wrong):
    with pytest.raises(BadValue, match="allowed"):
        block_stages(Patch(), default_floor(1, 2), **wrong)


def test_the_command_prints_it_as_words_and_as_data(underfoot, refused):
    said = underfoot("cost", GRAVEL, "--feet", 1, "--block", 256)
    assert said.status == 0
    for words in ("4 tiles, a foot on 1, block 256", *STAGES, "fibre-bundle", "sleeps when force is silent"):
        assert words in said.out
    data = json.loads(underfoot("cost", GRAVEL, "--json").out)
    assert data["stood_on"] == 4
    assert {"tile", "stones", "ring", "out"} <= {node["node"] for node in data["nodes"]}
    assert "feet is 9; allowed: 0 to 4" in refused("cost", GRAVEL, "--feet", 9)
    assert "nope.json" in refused("cost", "nope.json")
