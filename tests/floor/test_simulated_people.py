"""People on the simulated floor: where they go, that they give way, and that it is known whose foot is where."""

import numpy as np
import pytest
from msgspec.structs import replace

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.errors import BadValue
from underfoot.floor import simulated_loads
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.simulated_people import CLEARANCE_M, PATHS, Person, drawn_people, people_footfalls, people_of
from underfoot.models.gait import Footfall, Walker

FLOOR = default_floor(6, 6)


def middles(steps):
    """Where the feet are, by their middles: shape (n, 2)."""
    half = np.array([[np.cos(step.heading_rad), np.sin(step.heading_rad)] for step in steps]) * steps[0].length_m / 2.0
    return np.array([(step.heel_x_m, step.heel_y_m) for step in steps]) + half


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("count", [1, 3])
def test_everybody_stays_on_the_floor_and_steps_left_and_right_in_turn(path, count):
    walks = people_footfalls(drawn_people(count, path), FLOOR, 60.0)
    assert len(walks) == count
    for person, steps in zip(drawn_people(count, path), walks, strict=True):
        assert [step.side for step in steps[:4]] == ["left", "right"] * 2
        assert len(steps) == pytest.approx(60.0 / person.walker.step_s, abs=3)
        assert (np.abs(middles(steps) - 0.93) < 0.93 + 0.1).all()
        spread = np.ptp(middles(steps), axis=0).max()
        assert (spread < 0.4) == (path == "in-place")


def test_nobody_steps_onto_somebody_else():
    walks = people_footfalls(drawn_people(4, "random"), FLOOR, 120.0)
    feet = [(step.start_s, step.start_s + step.duration_s, who, place)
            for who, steps in enumerate(walks) for step, place in zip(steps, middles(steps), strict=True)]  # fmt: skip
    near = [
        np.hypot(*(foot[3] - other[3]))
        for foot in feet
        for other in feet
        if foot[2] < other[2] and foot[0] < other[1] and other[0] < foot[1]
    ]
    # Bodies keep their clearance; feet stand half a step width beside them, more where they turn.
    assert np.quantile(near, 0.01) > CLEARANCE_M - 0.2


def test_a_walk_does_not_depend_on_how_long_it_is():
    short, long = (people_footfalls(drawn_people(2, "crossing"), FLOOR, seconds) for seconds in (10.0, 20.0))
    for one, other in zip(short, long, strict=True):
        assert other[: len(one)] == one


def test_the_simulator_knows_whose_foot_is_where():
    people = (Person(Walker(weight_n=500.0), "turn"), Person(Walker(weight_n=900.0), "straight"))
    floor = SimulatedFloor(FLOOR, people=people)
    count = floor.pull(24_000)
    time_s = floor.stamps[:count] / 48_000.0
    down = simulated_loads.feet_down(floor.footfalls, floor.curves, time_s)
    assert set(down.person.tolist()) == {0, 1}
    # All force on the tiles is the feet's, and all of the feet's is on the tiles.
    on_tiles = floor.forces[:count].sum(axis=(1, 2))
    of_feet = np.bincount(np.searchsorted(time_s, down.time_s), weights=down.force_n, minlength=count)
    np.testing.assert_allclose(on_tiles, of_feet, atol=1e-6)
    heavier = [down.force_n[down.person == person].max() for person in (0, 1)]
    assert heavier[1] / heavier[0] == pytest.approx(900.0 / 500.0, rel=0.1)


def pressed(floor, x_m, y_m):
    """The load of each tile, and its centre, under a foot of 100 N that is so small that it is a point."""
    point = Footfall("left", 0.0, 1.0, x_m, y_m, 0.0, 1e-12, 100.0, 100.0, 100.0, 0.4, 0.0)
    source = SimulatedFloor(floor)
    source.footfalls = simulated_loads.footfall_table([[point]])
    source.curves = simulated_loads.gait_curves([Walker()])
    count = source.pull(24_001)
    forces_n = source.forces[count - 1]
    sensors_m = np.array([tile.to_floor(tile.sensors_m) for tile in floor.tiles])
    return forces_n.sum(axis=1), np.einsum("tk,tkd->d", forces_n, sensors_m) / max(forces_n.sum(), 1e-9)


@pytest.mark.parametrize(
    ("x_m", "y_m", "loads_n"),
    [
        (0.304, 0.1, (100.0, 0.0, 0.0, 0.0)),
        (0.306, 0.1, (80.0, 20.0, 0.0, 0.0)),  # over the gap of 5 mm, 1 mm from the first tile
        (0.2, 0.3075, (50.0, 0.0, 50.0, 0.0)),
        (0.306, 0.308, (32.0, 8.0, 48.0, 12.0)),  # over the crossing of two gaps
        (0.306, -0.001, (0.0, 0.0, 0.0, 0.0)),  # before the floor
    ],
)
@pytest.mark.parametrize("turned", [0.0, 90.0, 270.0])
def test_a_sole_spans_the_gap_between_tiles_as_a_beam_does(x_m, y_m, loads_n, turned):
    tiles = (replace(tile, rotation_deg=turned * (row % 2)) for row, tile in enumerate(default_floor().tiles))
    found_n, centre_m = pressed(Floor(tuple(tiles)), x_m, y_m)
    np.testing.assert_allclose(found_n, loads_n, atol=1e-6)
    if sum(loads_n):
        np.testing.assert_allclose(centre_m, (x_m, y_m), atol=1e-9)


def test_a_sole_does_not_span_a_wide_gap():
    tiles = [replace(tile, centre_m=(1.5 * tile.centre_m[0], tile.centre_m[1])) for tile in default_floor(1, 2).tiles]
    assert not pressed(Floor(tuple(tiles)), 0.4, 0.1)[0].any()


def test_people_of_a_target_are_described_in_a_line():
    people = people_of("people=3,path=turn,seed=2")
    assert [person.path for person in people] == ["turn"] * 3
    assert len({person.walker.weight_n for person in people}) == 3
    assert people == people_of("people=3,path=turn,seed=2")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("people=9", "people is 9; allowed: a whole number, 1 to 8"),
        ("people=two", "people is 'two'; allowed: a whole number"),
        ("walkers=2", "simulator option is 'walkers=2'; allowed: people=1 to 8"),
    ],
)
def test_other_descriptions_are_refused(text, message):
    with pytest.raises(BadValue, match=message):
        people_of(text)
