"""The floor that is measured is the one that was asked for."""

import numpy as np

from underfoot.bench import scale
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


def test_feet_stand_where_they_should_and_go_on_without_a_step():
    feet = scale.standing(5, 2, 4096)
    assert (feet["force_n"][:2] > 100.0).all()
    assert not any(signal[2:].any() for signal in feet.values())
    force = feet["force_n"][:2]
    assert np.abs(force[:, 0] - force[:, -1]).max() <= 1.5 * np.abs(np.diff(force)).max()


def test_every_floor_is_measured_at_every_block_size():
    found = scale.run({"gain": PATCH}, REGISTRY, tiles=3, repeats=1)
    assert [(cost.block, cost.stood_on) for cost in found] == [(b, n) for b in (1024, 64) for n in (3, 2, 0)]
    assert all(cost.times_real_time > 0.0 for cost in found)
    assert [cost.share for cost in found if cost.stood_on == 3] == [1.0, 1.0]
    assert found[0].data()["tiles"] == 3
