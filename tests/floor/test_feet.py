"""One foot or two: feet over seams and corners, turned tiles, gaps, noise, and two feet on one tile."""

import gc
import math

import msgspec
import numpy as np
import pytest
from made_walks import corner_forces, read, touching_floor, walk

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor import simulated_loads
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.foot_orientation import orientation
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.floor.loads import Load
from underfoot.floor.simulated_people import drawn_people
from underfoot.models import gait


def contacts_of(floor, time_s, force_n, rate_hz=1000.0, chunk=1000):
    tracker = ContactTracker(floor, rate_hz)
    parts = [tracker.feed(time_s[i : i + chunk], force_n[i : i + chunk]) for i in range(0, len(time_s), chunk)]
    parts.append(tracker.finish())
    return parts


def finished(parts):
    return [contact for part in parts for contact in part.finished]


def spaced(gap_m, degrees):
    """Tiles so far apart, each turned by a quarter more than the one before, on a floor that is turned; and a way back
    and forth over it."""
    turn = complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
    tiles = []
    for number, tile in enumerate(touching_floor(6, 6).tiles):
        place = turn * complex(*tile.centre_m) * (1.0 + gap_m / 0.3)
        turned = degrees + 90.0 * (number % 4)
        tiles.append(Tile(tile.id, tile.size_m, (place.real, place.imag), turned, tile.sensors_m))
    path = [turn * complex(*place) for place in ((0.45, 0.5), (1.4, 0.5), (1.4, 1.3), (0.45, 1.3), (0.45, 0.5))]
    return Floor(tuple(tiles)), [(place.real, place.imag) for place in path]


def walked(floor, seconds, footfalls=None, people=(), noise_n=0.5):
    """What noisy sensors read of people, or of given footfalls."""
    source = SimulatedFloor(floor, people=people)
    if footfalls is not None:
        source.footfalls = simulated_loads.footfall_table([footfalls])
    force, stamps = [], []
    for end in range(4800, round(seconds * 48_000), 4800):
        count = source.pull(end)
        force.append(source.forces[:count].copy())
        stamps.append(source.stamps[:count] / 48_000.0)
    time_s, force_n = np.concatenate(stamps), np.concatenate(force)
    return time_s, force_n + np.random.default_rng(1).normal(0.0, noise_n, force_n.shape)


@pytest.mark.parametrize(("gap_m", "degrees"), [(0.0, 30.0), (0.02, 0.0), (0.025, 17.0)])
def test_turned_tiles_and_gaps_do_not_matter(gap_m, degrees):
    floor, path = spaced(gap_m, degrees)
    walker = gait.Walker(foot_breadth_m=0.08)
    steps = gait.footfalls(walker, path, 60.0)
    found = finished(contacts_of(floor, *walked(floor, 12.0, steps)))[:-3]
    assert len(found) > 17
    began = np.array([(contact.start_s, step.start_s) for contact, step in zip(found, steps, strict=False)])
    ended = np.array([(one.end_s, step.start_s + step.duration_s) for one, step in zip(found, steps, strict=False)])
    for times in (began, ended):
        # A heel or toes that come down between tiles press on none.
        late = np.abs(times[:, 0] - times[:, 1])
        assert (late < 0.04).mean() > 0.9
        assert late.max() < 0.2


@pytest.mark.parametrize("half_ms", [1, 20])
def test_a_loose_wire_takes_no_more_time_the_longer_it_hums(half_ms):
    """Four tiles whose loads come and go for 2 s: this would take hours if each load were compared with all others."""
    time_s = np.arange(2000) / 1000.0
    hums = (time_s >= 0.5) & (np.arange(len(time_s)) // half_ms % 2 == 1)
    force_n = np.where(hums[:, None, None], 250.0, np.zeros((len(time_s), 4, 4)))
    parts, others = (contacts_of(default_floor(2, 2), time_s, force_n, chunk=chunk) for chunk in (1000, 37))
    assert set(np.concatenate([part.rows.time_s for part in parts])) <= set(time_s[hums])
    ids = [contact.id for contact in finished(parts)]
    assert len(set(ids)) == len(ids) > 0
    assert ids == [contact.id for contact in finished(others)]


@pytest.mark.parametrize("seed", [20, 23, 27])
def test_chunks_change_nothing_of_loads_that_come_and_go_at_random(seed):
    """Shorter than a foot's, beside each other and with short pauses: each may be a part of many others."""
    random = np.random.default_rng(seed)
    time_s, force_n = np.arange(3000) / 1000.0, np.zeros((3000, 4, 4))
    for tile in range(4):
        begin = 300 + int(random.integers(200))
        while begin < len(time_s):
            end = begin + 1 + int(random.exponential(25.0))
            force_n[begin:end, tile] = random.uniform(5.0, 300.0, 4)
            begin = end + 1 + int(random.exponential(30.0))
    expected, found = (contacts_of(default_floor(2, 2), time_s, force_n, chunk=chunk) for chunk in (1000, 13))
    assert len(finished(expected)) > 5
    for one, other in zip(finished(expected), finished(found), strict=True):
        np.testing.assert_equal(msgspec.structs.astuple(one), msgspec.structs.astuple(other))


def test_chunks_change_no_bit_where_feet_share_tiles():
    floor = default_floor(3, 3)
    time_s, force_n = walked(floor, 3.0, people=drawn_people(2, "random"), noise_n=0.0)
    expected = contacts_of(floor, time_s, force_n, chunk=256)
    assert len(finished(expected)) > 6
    for chunk in (1, 37, 100_000):
        found, said = contacts_of(floor, time_s, force_n, chunk=chunk), f"chunks of {chunk}"
        for name in ("time_s", "contact", "x_m", "y_m", "force_n", "on_tile"):
            both = (np.concatenate([getattr(p.rows, name) for p in ps]) for ps in (expected, found))
            np.testing.assert_array_equal(*both, err_msg=f"{name}, {said}")
        for one, other in zip(finished(expected), finished(found), strict=True):
            np.testing.assert_equal(msgspec.structs.astuple(one), msgspec.structs.astuple(other), said)


def direction_of_foot(floor, degrees, at, y_m):
    """Direction of a foot, by how much it is wrong and its error. A plain rectangle of a foot's breadth that stands
    over the edges of tiles of 0.3 m: statics, integrated point by point. It stands: which end is the toes nobody can
    say."""
    turn = math.radians(degrees)
    u, v = np.meshgrid((np.arange(120) + 0.5) / 120 - at, (np.arange(40) + 0.5) / 40 - 0.5)
    x = 0.3 + 0.26 * u * math.cos(turn) - 0.09 * v * math.sin(turn)
    y = y_m + 0.26 * u * math.sin(turn) + 0.09 * v * math.cos(turn)
    corners = np.zeros((len(floor.tiles), 4))
    for k, tile in enumerate(floor.tiles):
        on = (np.abs(x - tile.centre_m[0]) <= 0.15) & (np.abs(y - tile.centre_m[1]) <= 0.15)
        for sensor, (sx, sy) in enumerate(tile.sensors_m):
            split = 0.25 * (1 + (x[on] - tile.centre_m[0]) / sx) * (1 + (y[on] - tile.centre_m[1]) / sy)
            corners[k, sensor] = 600.0 / x.size * split.sum()
    time_s = np.arange(3000) / 1000.0
    standing = ((time_s > 1.0) & (time_s < 2.0))[:, None, None]
    force_n = standing * corners + np.random.default_rng(1).normal(0.0, 0.3, (3000, *corners.shape))
    (contact,) = finished(contacts_of(floor, time_s, force_n))
    heading, error = orientation(contact, floor)
    return abs((heading - turn + math.pi / 2) % math.pi - math.pi / 2), error


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, -30.0])
@pytest.mark.parametrize("at", [0.3, 0.5, 0.7])
def test_where_a_foot_across_an_edge_points_is_known_within_its_error(degrees, at):
    off, error = direction_of_foot(touching_floor(1, 2), degrees, at, 0.15)
    assert off < 2.0 * error
    assert math.degrees(error) < 12.0


def test_over_a_corner_the_direction_is_known_alike_however_the_foot_is_turned():
    for degrees in (10.0, 70.0, 80.0):
        off, error = direction_of_foot(touching_floor(2, 2), degrees, 0.5, 0.3)
        assert off < 2.0 * error
        assert math.degrees(error) < 5.0


def test_a_foot_that_shows_no_direction_has_none():
    floor = touching_floor(1, 1)
    time_s = np.arange(2000) / 1000.0
    force_n = np.where((time_s > 0.8) & (time_s < 1.5), 100.0, 0.0)[:, None, None] * np.ones((1, 4))
    (contact,) = finished(contacts_of(floor, time_s, force_n))
    assert all(math.isnan(angle) for angle in orientation(contact, floor))


@pytest.mark.parametrize("apart_m", [0.16, 0.21])
def test_the_feet_of_who_lands_beside_a_seam_with_both_are_two(apart_m):
    """They fit into a foot's box until they have rolled, and leave together."""
    floor = default_floor(1, 2)
    seam_m, middle_m = np.mean([tile.centre_m for tile in floor.tiles], axis=0)
    feet = [
        gait.Footfall(side, start_s, 0.45, seam_m + at_m, middle_m - 0.13, math.pi / 2, 0.26, 900.0, 700.0, 900.0)
        for side, start_s, at_m in (("left", 0.6, -apart_m / 2), ("right", 0.61, apart_m / 2))
    ]
    time_s, force_n = walked(floor, 1.8, feet)
    alone = time_s < 1.5
    found = finished(contacts_of(floor, time_s[alone], force_n[alone], chunk=100))
    assert [contact.tiles for contact in found] == [(0,), (1,)]


@pytest.mark.parametrize("valley_n", [390.0, 330.0])
def test_the_foot_of_who_walks_fast_is_one_over_a_seam(valley_n):
    """The faster, the less it bears while the other swings by: 0.38 of its first peak is measured at an ordinary pace,
    and was taken for two feet."""
    floor = default_floor(1, 2)
    seam_m, middle_m = np.mean([tile.centre_m for tile in floor.tiles], axis=0)
    foot = gait.Footfall("left", 0.6, 0.5, seam_m - 0.13, middle_m, 0.0, 0.26, 1000.0, valley_n, 900.0)
    time_s, force_n = walked(floor, 1.8, [foot])
    alone = time_s < 1.5
    (found,) = finished(contacts_of(floor, time_s[alone], force_n[alone]))
    assert found.tiles in {(0, 1), (1, 0)}


def test_the_heel_of_who_walks_slowly_is_one_over_a_seam_though_the_foot_before_is_still_on_it():
    """On one of its two tiles both stand for 0.4 s, as one load: its own begins there when the other has left."""
    floor, time_s = touching_floor(1, 6), np.arange(3000) / 1000.0
    feet = walk(2, start_s=0.3, heel_m=(0.85, 0.15), step_m=0.35, step_s=1.0, duration_s=1.5, length_m=0.2)
    found = finished(contacts_of(floor, time_s, read(corner_forces(floor, feet, time_s), 1000.0)))
    assert [contact.tiles for contact in found] == [(3, 2), (4, 3)]


# Footfalls that once were taken for others', as simulated people made them: (start, duration, heel x, y, heading,
# length, breadth, peaks and valley).
FEET_TAKEN_FOR_OTHERS = {
    "toes under the next heel": (
        (0.15, 0.57, 0.909, 1.071, 1.816, 0.202, 0.030, 463.0, 300.0, 460.0),
        (0.61, 0.568, 0.675, 1.527, 2.026, 0.202, 0.030, 459.0, 296.0, 449.0),
    ),
    "toes and a light heel over a gap": (
        (0.15, 0.586, 0.912, 1.068, 1.816, 0.206, 0.031, 490.0, 316.0, 476.0),
        (0.619, 0.565, 0.681, 1.542, 2.026, 0.206, 0.031, 470.0, 315.0, 475.0),
    ),
    "toes where the last foot's toes are": (
        (0.15, 0.684, 1.4, 1.256, 1.949, 0.260, 0.039, 771.0, 487.0, 769.0),
        (0.691, 0.677, 1.293, 1.281, 2.158, 0.260, 0.039, 770.0, 518.0, 772.0),
        (1.223, 0.69, 1.397, 1.54, 2.996, 0.260, 0.039, 778.0, 506.0, 761.0),
    ),
    "heel where the last foot leaves and toes on the next tile": (
        (0.15, 0.673, 1.365, 0.914, 4.961, 0.260, 0.039, 776.0, 502.0, 758.0),
        (0.703, 0.691, 1.453, 0.739, 4.511, 0.260, 0.039, 776.0, 494.0, 756.0),
    ),
    "a heel on two tiles beside the last toes": (
        (0.15, 0.676, 0.839, 1.066, 3.774, 0.260, 0.039, 760.0, 501.0, 745.0),
        (0.683, 0.682, 0.637, 0.919, 4.368, 0.260, 0.039, 769.0, 503.0, 747.0),
    ),
    "a tile that three feet touch": (
        (0.15, 0.66, 1.362, 1.16, 2.284, 0.260, 0.039, 751.0, 493.0, 740.0),
        (0.733, 0.648, 1.299, 1.335, 2.529, 0.260, 0.039, 779.0, 495.0, 777.0),
    ),
    "a foot on the toes of the last": (
        (0.15, 0.669, 0.711, 0.686, 4.145, 0.260, 0.039, 770.0, 504.0, 755.0),
        (0.68, 0.674, 0.571, 0.563, 4.514, 0.260, 0.039, 770.0, 505.0, 743.0),
    ),
    "both tiles pass on at once": (
        (0.15, 0.659, 1.12, 0.506, 3.187, 0.260, 0.039, 763.0, 506.0, 766.0),
        (0.709, 0.684, 0.938, 0.41, 3.397, 0.260, 0.039, 767.0, 508.0, 778.0),
    ),
    "a heel on three tiles": (
        (0.15, 0.667, 1.163, 0.845, 4.402, 0.260, 0.039, 768.0, 515.0, 775.0),
        (0.706, 0.681, 0.977, 0.63, 4.192, 0.260, 0.039, 759.0, 505.0, 758.0),
    ),
}


@pytest.mark.parametrize("feet", FEET_TAKEN_FOR_OTHERS.values(), ids=FEET_TAKEN_FOR_OTHERS)
def test_feet_that_turn_on_a_seam_are_told_from_those_still_there(feet):
    steps = [
        gait.Footfall("left", start_s, lasts_s, x_m, y_m, heading, length_m, *extremes_n, breadth_m=breadth_m)
        for start_s, lasts_s, x_m, y_m, heading, length_m, breadth_m, *extremes_n in feet
    ]
    time_s, force_n = walked(default_floor(6, 6), 3.0, steps, noise_n=0.3)
    alone = time_s < steps[-1].start_s + steps[-1].duration_s + 0.3
    found = finished(contacts_of(default_floor(6, 6), time_s[alone], force_n[alone]))[: len(steps)]
    for contact, step in zip(found, steps, strict=True):
        assert contact.force_n.max() == pytest.approx(max(step.peak1_n, step.peak2_n), abs=50.0)
        # Less than this another foot may press beside a gap on a tile that this one has left.
        told_s, true_s = contact.time_s[contact.force_n >= 60.0], time_s[step.force_n(time_s) >= 60.0]
        assert told_s[[0, -1]] == pytest.approx(true_s[[0, -1]], abs=0.015)


def test_where_somebody_always_stands_no_load_of_before_is_kept():
    """One foot after the other on a tile that is never empty, beside a bench that stays: each load kept the one before,
    and the bench all of them."""
    floor = default_floor(1, 2)
    time_s = np.arange(20_000) / 1000.0
    side = np.sign(np.sin(2.0 * math.pi * time_s / 1.6))
    x_m = np.array(floor.tiles[0].sensors_m)[:, 0]
    feet_n = 175.0 * (1.0 + 0.08 * side[:, None] * x_m / x_m**2)
    force_n = np.stack([np.full_like(feet_n, 75.0), feet_n], axis=1)
    force_n[:500] = 0.0

    def kept():
        return sum(type(one) is Load for one in gc.get_objects())

    before, tracker = kept(), ContactTracker(floor, 1000.0)
    assert len(tracker.feed(time_s, force_n).finished) > 15
    assert kept() - before < 10


def test_a_load_whose_first_rows_are_gone_is_not_divided():
    """A board that sends four times as fast as was said ended each tick of the window with an IndexError."""
    source = SimulatedFloor(default_floor(1, 2), seed=6)
    forces = np.concatenate([source.forces[: source.pull(end)].copy() for end in range(2400, 169_000, 2400)])
    tracker = ContactTracker(default_floor(1, 2), 1000.0)
    for begin in range(0, len(forces), 100):
        tracker.feed(np.arange(begin, begin + 100)[: len(forces) - begin] / 4000.0, forces[begin : begin + 100])
    assert tracker.finish().finished
