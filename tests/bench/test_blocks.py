"""The floor that is measured is the one that was asked for."""

import numpy as np
import pytest

from underfoot.bench import blocks
from underfoot.bench.timing import Timed
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

PATCH = (
    Patch()
    .add("tile-force", REGISTRY)
    .add("tile-output", REGISTRY)
    .add("gain", REGISTRY)
    .connect("tile-force.force", "gain.signal", REGISTRY)
    .connect("gain.out", "tile-output.acceleration", REGISTRY)
)


def test_feet_step_where_they_should_and_go_on_without_a_seam():
    floor = default_floor(1, 5)
    forces = blocks.stepping(floor, 2).force_n
    load_n = forces.sum(axis=2)
    assert (load_n[:, :2] > 20.0).mean(axis=0) == pytest.approx([blocks.CONTACT_S] * 2, abs=0.03)
    assert (abs(load_n[:, 2:]) < 10.0 * blocks.NOISE_N).all()
    assert (forces[:, 2:].std(axis=0) > 0.5 * blocks.NOISE_N).all()
    assert not any(np.array_equal(forces[:1000, 4], forces[k : k + 1000, 4]) for k in (1000, 2000))
    assert np.abs(load_n[0] - load_n[-1]).max() <= 1.5 * np.abs(np.diff(load_n, axis=0)).max()


def test_every_floor_is_a_scene_at_every_block_size():
    found = list(blocks.scenes("gain", PATCH, (4, 9), (64, 1024)))
    assert [(scene.tiles, scene.block, scene.feet) for scene in found] == [
        (tiles, block, feet) for tiles in (4, 9) for block in (64, 1024) for feet in (tiles, 2, 0)
    ]
    for scene in found:
        scene.run()
        assert 0.0 < scene.of_program < 1.0


def test_costs_are_told_by_the_second_of_sound_and_beside_a_foot_on_each():
    scenes = list(blocks.scenes("gain", PATCH, (4,), (1024,)))
    scenes[0].run()
    scenes[1].run()
    scenes[2].run()
    found = blocks.costs(scenes, [Timed(0.1, 1.0, 0.02), Timed(0.05, 2.0, 0.0), Timed(0.005, 1.0, 0.0)])
    assert [cost.times_real_time for cost in found] == pytest.approx([10.0, 20.0, 200.0])
    assert [cost.share for cost in found] == pytest.approx([1.0, 0.25, 0.05])
    assert all(cost.program_times_real_time > cost.times_real_time for cost in found)
    assert found[0].spread == 0.02
