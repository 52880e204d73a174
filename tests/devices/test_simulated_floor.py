"""The simulated floor: its samples in time, its walker, hands, and an engine that takes over."""

import numpy as np
import pytest

from underfoot.devices.force_source import MAX_SAMPLES, SENSOR_HZ
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.models import gait

FLOOR = default_floor()


def pulled(source, end, step=480, begin=0):
    """Stamps and forces up to frame `end`."""
    stamps, forces = [], []
    for at in range(begin + step, end + step, step):
        count = source.pull(min(at, end))
        stamps.append(source.stamps[:count].copy())
        forces.append(source.forces[:count].copy())
    return np.concatenate(stamps), np.concatenate(forces)


def test_samples_come_at_1_khz_and_in_time():
    source = SimulatedFloor(FLOOR)
    stamps, _ = pulled(source, 48_000)
    np.testing.assert_array_equal(stamps, np.arange(1000) * 48.0)
    assert source.rate_hz == SENSOR_HZ == 1000.0
    count = source.pull(96_000)
    assert (source.arrivals[:count] <= source.stamps[:count]).all()


@pytest.mark.parametrize("step", [7, 333, 20_000])
def test_the_forces_do_not_depend_on_how_they_are_pulled(step):
    sources = [SimulatedFloor(FLOOR), SimulatedFloor(FLOOR)]
    for source in sources:
        source.press(1, 0.05, 0.03, 200.0)
    whole, parts = pulled(sources[0], 96_000)[1], pulled(sources[1], 96_000, step)[1]
    assert whole.tobytes() == parts.tobytes()


def test_the_seed_decides_the_walk():
    one, same, other = (pulled(SimulatedFloor(FLOOR, seed=seed), 96_000)[1] for seed in (1, 1, 2))
    assert one.tobytes() == same.tobytes()
    assert one.tobytes() != other.tobytes()


def test_a_walker_weighs_what_the_gait_model_says_and_begins_at_a_fifth_of_a_second():
    stamps, forces = pulled(SimulatedFloor(FLOOR), 20 * 48_000)
    total = forces.sum(axis=(1, 2))
    loaded = np.flatnonzero(total)
    assert stamps[loaded[0]] / 48_000 == pytest.approx(0.2, abs=0.002)
    weight = gait.Walker().weight_n
    assert 0.5 * weight < np.median(total[loaded]) < 1.5 * weight
    assert weight < total.max() < 2.5 * weight


def test_what_an_engine_that_takes_over_reads_is_what_it_would_have_read():
    stamps, forces = pulled(SimulatedFloor(FLOOR), 96_000)
    late = SimulatedFloor(FLOOR)
    late.skip(50_001)
    late_stamps, late_forces = pulled(late, 96_000, begin=50_001)
    np.testing.assert_array_equal(late_stamps, stamps[stamps >= 50_001])
    np.testing.assert_array_equal(late_forces, forces[stamps >= 50_001])


def test_nobody_walks_where_the_walker_stands_aside():
    source = SimulatedFloor(FLOOR, walking=False)
    assert not pulled(source, 96_000)[1].any()
    source.walk(on=True)
    assert pulled(source, 3 * 96_000, begin=96_000)[1].any()


@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_a_hand_presses_with_its_force_where_it_is(turn):
    tile = FLOOR.tiles[0]
    floor = Floor((Tile("a", tile.size_m, (2.0, 1.0), turn, tile.sensors_m),))
    source = SimulatedFloor(floor, walking=False)
    source.press(0, 0.06, -0.04, 250.0)
    _, forces = pulled(source, 48_000)
    last = forces[-1, 0]
    assert last.sum() == pytest.approx(250.0, rel=1e-6)
    np.testing.assert_allclose(last @ np.array(tile.sensors_m) / last.sum(), [0.06, -0.04], atol=1e-9)
    source.press(0, 0.0, 0.0, 0.0)
    _, forces = pulled(source, 3 * 48_000, begin=48_000)
    sums = forces[:, 0].sum(axis=1)
    assert (np.diff(sums) <= 0.0).all()
    assert sums[-1] == 0.0


def test_it_never_hands_over_more_than_there_is_room_for():
    source = SimulatedFloor(FLOOR)
    counts = []
    while not counts or counts[-1]:
        counts.append(source.pull(10 * 48_000))
    assert max(counts) <= MAX_SAMPLES
    assert sum(counts) == 10_000


def test_other_rates_keep_the_walk():
    _, slow = pulled(SimulatedFloor(FLOOR, 44_100), 44_100)
    _, fast = pulled(SimulatedFloor(FLOOR, 96_000), 96_000)
    np.testing.assert_allclose(slow, fast, atol=1e-6)
