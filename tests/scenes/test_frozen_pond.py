"""Cracks: as the thesis grows them, and one slip, one strike, one growth."""

import math

import numpy as np
import pytest
from timed_presses import TimedPress, rehearse_presses

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.drawing.look import rgb
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import default_floor
from underfoot.models.elasto_plastic import Ground
from underfoot.scenes import discover
from underfoot.scenes.frozen_pond import LEAST_J, MOST_FRESH, MOST_J
from underfoot.scenes.frozen_pond.cracks import Cracks
from underfoot.scenes.moments import Moment
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.shapes import Lines

FLOOR = default_floor()
POND = discover()["frozen-pond"]


def sheet(most=1000, size_m=100.0):
    return Cracks((-size_m, -size_m), (size_m, size_m), most)


def test_seeds_have_two_to_six_fronts_evenly_and_each_grows_as_often_as_one():
    counts, grown = [], 0
    draws = SeededRandom(1)
    for _ in range(3000):
        cracks = sheet(100)
        cracks.grow((0.0, 0.0), 0.01, 0.1, 0.3, draws)
        seed = cracks.seeds[0]
        counts.append(len(seed.fronts))
        angles = np.sort([math.atan2(front.way[1], front.way[0]) for front in seed.fronts])
        assert np.diff(angles) == pytest.approx(2 * math.pi / len(angles))
        cracks.grow((0.05, 0.0), 0.01, 0.1, 0.3, draws)
        grown += cracks.count
    assert np.bincount(counts)[2:] == pytest.approx(600, abs=5 * math.sqrt(600 * 0.8))
    assert grown == pytest.approx(3000, abs=5 * math.sqrt(3000))  # the mean of n fronts at 1 / n each


def test_a_front_turns_by_a_normal_draw_of_a_unit_vector():
    cracks, draws = sheet(20_000, 1e9), SeededRandom(2)
    for _ in range(6000):
        cracks.grow((0.0, 0.0), 1.0, 1e9, 0.3, draws)
    assert len(cracks.seeds) == 1
    ends = cracks.lines_m
    ways = ends[:, 1] - ends[:, 0]
    assert np.hypot(*ways.T) == pytest.approx(1.0)
    following = {tuple(line[0].round(6)): way for line, way in zip(ends, ways, strict=True)}
    turns = []
    for line, way in zip(ends, ways, strict=True):
        after = following.get(tuple(line[1].round(6)))
        if after is not None:
            turns.append((way[0] * after[1] - way[1] * after[0]) / (way @ after))
    assert len(turns) > 5000
    assert np.mean(turns) == pytest.approx(0.0, abs=0.02)
    assert np.std(turns) == pytest.approx(0.3, rel=0.05)  # tan of the turn is beta


def test_cracks_stay_on_the_sheet_and_the_oldest_close():
    cracks, draws = sheet(50, 0.3), SeededRandom(3)
    for k in range(500):
        cracks.grow((0.02 * (k % 10), 0.0), 0.05, 0.05, 0.3, draws)
    assert cracks.count > 50
    assert len(cracks.lines_m) == 50
    assert np.abs(cracks.lines_m).max() <= 0.3
    assert len(cracks.latest_m(cracks.count - 3)) == 3


def test_each_slip_is_one_strike_at_its_time_with_its_energy():
    pond = POND(FLOOR, {"spread": 0.0})
    done = rehearse(pond, SimulatedFloor(FLOOR), 5.0)
    assert len(done.strikes) == pond.slips > 50
    for time_s, strike in done.cues:
        assert time_s - 0.01 - 1e-9 <= strike.at_s <= time_s + 1e-9
        assert math.sqrt(LEAST_J / MOST_J) - 1e-9 <= strike.strength <= 1.0


def test_slips_are_those_of_the_ground_model():
    pond = POND(FLOOR, {"spread": 0.0, "threshold_n": 150.0})
    done = rehearse_presses(pond, [TimedPress(0.3, "t1", 0.0, 0.0, 900.0)], 1.0)
    contacts = [moment.contacts[0].force_n if moment.contacts else 0.0 for moment in done.moments]
    on = next(k for k, force in enumerate(contacts) if force)
    force = np.interp(np.arange(1, 10 * len(contacts) + 1) / 10.0, np.arange(len(contacts) + 1), [0.0, *contacts])
    ground = Ground(threshold_n=150.0, least_j=LEAST_J, most_j=MOST_J)
    slips = ground.response(force[10 * on :], 1000.0)
    # The draws are others, so energies differ; the first slip does not depend on them, nor how far all together go.
    assert done.strikes[0].at_s == pytest.approx(0.01 * on + slips.time_s[0], abs=1e-9)
    spent = sum(MOST_J * strike.strength**2 for strike in done.strikes)
    assert spent == pytest.approx(slips.energy_j.sum(), rel=0.2)
    assert ", 1 seed, " in pond.state


def test_another_seed_cracks_otherwise():
    cracks = [POND(FLOOR, seed=seed) for seed in (1, 1, 2)]
    for pond in cracks:
        rehearse(pond, SimulatedFloor(FLOOR), 3.0)
    same, again, other = (pond.cracks.lines_m for pond in cracks)
    assert np.array_equal(same, again)
    assert not np.array_equal(same, other)


def test_cracks_sink_into_the_ice_before_they_close():
    pond = POND(FLOOR, {"most_lines": 100})
    rehearse(pond, SimulatedFloor(FLOOR), 8.0)
    assert pond.cracks.count > 100
    glow, *aged, fresh = [shape for shape in pond.shapes() if isinstance(shape, Lines)]
    assert np.array_equal(np.concatenate([shape.ends_m for shape in aged]), pond.cracks.lines_m)
    assert np.array_equal(aged[-1].ends_m, pond.cracks.latest_m(pond.cracks.count - 6))
    assert [len(shape.ends_m) for shape in aged] == [50, 25, 19, 6]
    bright = [sum(rgb(shape.colour)) for shape in (*aged, fresh)]
    assert bright == sorted(set(bright))
    assert 0 < len(fresh.ends_m) < 20
    assert np.array_equal(fresh.ends_m, pond.cracks.lines_m[-len(fresh.ends_m) :])
    assert np.array_equal(glow.ends_m, fresh.ends_m)


def test_of_the_cracks_of_a_crowd_the_latest_are_bright():
    pond = POND(FLOOR, {"threshold_n": 10.0, "spacing_m": 1.0})
    for k in range(1, 11):
        feet = (OngoingContact(id, 0.01 * id, 0.1, 200.0 * k, (0,), 0.0) for id in range(1, 13))
        list(pond.step(Moment(0.01 * k, tuple(feet))))
    assert pond.cracks.count > MOST_FRESH
    assert np.array_equal(list(pond.shapes())[-1].ends_m, pond.cracks.lines_m[-MOST_FRESH:])
