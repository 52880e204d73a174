"""The walker against what walking is: the weight carried, the shape of real footsteps, forces that split exactly."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate

from underfoot.errors import BadValue
from underfoot.models.gait import Walker, corner_forces, footfalls, mean_force, roll, vertical_force

DATA = Path(__file__).resolve().parents[2] / "../shared/data"
CORNERS = np.array([[0.15, 0.15], [-0.15, 0.15], [-0.15, -0.15], [0.15, -0.15]])
LINE = [(0.0, 0.0), (5.0, 0.0)]

forces = st.floats(0.9, 2.0)


@settings(max_examples=50)
@given(forces, st.floats(0.2, 0.85), forces)
def test_the_force_has_its_three_extremes_and_no_others(peak1, valley, peak2):
    p = np.linspace(0, 1, 10001)
    f = vertical_force(p, peak1, valley, peak2)
    assert f[0] == f[-1] == 0.0
    assert f.min() == 0.0
    assert f[:5000].max() == pytest.approx(peak1, abs=1e-12)
    assert f[5000:].max() == pytest.approx(peak2, abs=1e-12)
    assert f[2200:7700].min() == pytest.approx(valley, abs=1e-12)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(f))))
    np.testing.assert_allclose(p[turns + 1], [0.22, 0.5, 0.77], atol=2e-4)
    slope = np.diff(f) / 1e-4
    assert np.abs(np.diff(slope)).max() < 0.05 * max(peak1, peak2)


def test_outside_the_contact_there_is_no_force():
    np.testing.assert_array_equal(vertical_force([-10.0, -1e-9, 1.0 + 1e-9, 10.0], 1.1, 0.7, 1.1), 0.0)


@settings(max_examples=20)
@given(forces, st.floats(0.2, 0.9), forces)
def test_the_mean_force_is_the_integral(peak1, valley, peak2):
    area, _ = integrate.quad(vertical_force, 0, 1, (peak1, valley, peak2), epsabs=1e-10, points=[0.22, 0.5, 0.77])
    assert mean_force(peak1, valley, peak2) == pytest.approx(area, abs=1e-9)


def test_the_foot_rolls_from_heel_to_toe_and_never_back():
    along = roll(np.linspace(-1, 2, 3001))
    assert along[0] == 0.05
    assert along[-1] == pytest.approx(0.95)
    assert (np.diff(along) >= 0).all()


def test_a_steady_walk_carries_the_body_weight():
    steps = footfalls(Walker(weight_n=812.0, variation=0.0), LINE, 60.0)
    t = np.arange(10.0, 50.0, 0.001)
    total = sum(step.force_n(t) for step in steps)
    whole = 2 * Walker().step_s
    in_period = t < 10.0 + 30 * whole
    assert total[in_period].mean() == pytest.approx(812.0, rel=2e-3)


def test_both_feet_are_down_for_a_part_of_each_step_and_at_least_one_always():
    walker = Walker(variation=0.0)
    assert 0.58 < walker.contact_s / (2 * walker.step_s) < 0.65


def test_a_footfall_looks_like_those_of_the_table():
    """Within the ranges of the eleven measured steps, without the one impact spike, widened by a hundredth."""
    step = footfalls(Walker(weight_n=740.0, variation=0.0), LINE, 0.3)[0]
    t = np.arange(0.0, 1.2, 0.001)
    f = step.force_n(t)
    down = np.flatnonzero(f >= 20.0)
    assert 0.57 <= t[down[-1]] - t[down[0]] <= 0.675
    assert 764 <= f.max() <= 1074
    assert 309 <= f[(t > 0.4) & (t < 0.7)].min() <= 577
    assert 301 <= f.sum() * 0.001 <= 423
    peak = f[:600].max()
    low, high = np.argmax(f >= 0.2 * peak), np.argmax(f >= 0.8 * peak)
    assert 5.3 <= (f[high] - f[low]) / (high - low) <= 13.1


def test_feet_alternate_beside_the_path_at_the_walkers_pace():
    walker = Walker(variation=0.0, toe_out_deg=0.0)
    steps = footfalls(walker, LINE, 4.0)
    assert [step.side for step in steps[:4]] == ["left", "right", "left", "right"]
    np.testing.assert_allclose(np.diff([step.start_s for step in steps]), 60 / 110, rtol=1e-12)
    np.testing.assert_allclose(np.diff([step.heel_x_m for step in steps]), 0.66, rtol=1e-12)
    np.testing.assert_allclose([step.heel_y_m for step in steps[:2]], [0.05, -0.05], atol=1e-12)
    assert steps[0].start_s == 0.2
    x, y = steps[0].centre_m([steps[0].start_s, steps[0].start_s + steps[0].duration_s])
    np.testing.assert_allclose(x - steps[0].heel_x_m, [0.05 * 0.26, 0.95 * 0.26])
    np.testing.assert_allclose(y, 0.05)


def test_toes_point_outwards():
    left, right = footfalls(Walker(variation=0.0), LINE, 1.0)[:2]
    assert left.heading_rad == pytest.approx(np.radians(6.0))
    assert right.heading_rad == pytest.approx(-np.radians(6.0))


def test_the_walker_turns_round_at_the_end_and_walks_round_a_closed_path():
    walker = Walker(variation=0.0, toe_out_deg=0.0, step_width_m=0.0, step_length_m=0.5, foot_length_m=0.1)
    there_and_back = footfalls(walker, [(0.0, 0.0), (1.2, 0.0)], 5.0)
    middles = [step.heel_x_m + 0.05 * np.cos(step.heading_rad) for step in there_and_back]
    np.testing.assert_allclose(middles[:7], [0.0, 0.5, 1.0, 0.9, 0.4, 0.1, 0.6], atol=1e-12)
    assert np.cos(there_and_back[3].heading_rad) == pytest.approx(-1.0)
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    headings = [round(np.degrees(step.heading_rad)) % 360 for step in footfalls(walker, square, 5.0)]
    assert headings[:9] == [0, 0, 90, 90, 180, 180, 270, 270, 0]


def test_repeated_points_and_a_single_point_are_walked():
    walker = Walker(variation=0.0)
    for path in ([(0.3, 0.2)], [(0.3, 0.2), (0.3, 0.2)], [(0.0, 0.0), (0.0, 0.0), (1.0, 0.0), (1.0, 0.0)]):
        assert all(np.isfinite(step.heel_x_m) for step in footfalls(walker, path, 10.0))


def test_the_same_seed_walks_the_same_and_a_longer_walk_begins_alike():
    walk = footfalls(Walker(), LINE, 10.0, seed=5)
    assert walk == footfalls(Walker(), LINE, 10.0, seed=5)
    assert walk == footfalls(Walker(), LINE, 30.0, seed=5)[: len(walk)]
    assert walk != footfalls(Walker(), LINE, 10.0, seed=6)


def test_variation_is_as_large_as_it_says():
    walk = footfalls(Walker(variation=0.03), LINE, 2000.0)
    peaks = np.array([step.peak1_n for step in walk])
    assert peaks.std() / peaks.mean() == pytest.approx(0.03, rel=0.08)
    late = np.diff([step.start_s for step in walk])
    assert late.std() / late.mean() == pytest.approx(0.03 * np.sqrt(2), rel=0.08)


points = st.floats(-0.3, 0.3)


@settings(max_examples=100)
@given(points, points, st.floats(-500, 2000), st.floats(0, 2 * np.pi), st.floats(0.3, 3.0), st.permutations(range(4)))
def test_corner_forces_add_up_and_balance_at_the_place(x, y, force, angle, shape, order):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    sensors = ((CORNERS * [1.0, shape]) @ turn.T + [0.1, -0.2])[order]
    corners = corner_forces(force, x, y, sensors)
    assert corners.sum() == pytest.approx(force, abs=1e-9)
    np.testing.assert_allclose(corners @ sensors, [force * x, force * y], atol=1e-9)


def test_the_split_is_bilinear_and_takes_arrays():
    u, v = np.meshgrid(np.linspace(-0.15, 0.15, 4), np.linspace(-0.15, 0.15, 3))
    corners = corner_forces(1.0, u, v, CORNERS)
    assert corners.shape == (3, 4, 4)
    np.testing.assert_allclose(corners[..., 0], (u + 0.15) * (v + 0.15) / 0.09, atol=1e-15)
    assert corner_forces(np.ones(5), np.zeros(5), np.zeros(5), CORNERS).shape == (5, 4)


SKEWED = np.array([[0.25, 0.15], [-0.15, 0.15], [-0.15, -0.15], [0.15, -0.15]])


@pytest.mark.parametrize("sensors", [CORNERS[:3], CORNERS * [1, 0], SKEWED, np.zeros((4, 2))])
def test_sensors_that_are_no_rectangle_are_refused(sensors):
    with pytest.raises(BadValue, match=r"^sensors_m is "):
        corner_forces(1.0, 0.0, 0.0, sensors)


def test_a_foot_rolls_from_where_and_as_far_as_its_walker_says():
    walker = Walker(roll_start=0.3, roll_reach=0.5, toe_out_deg=0.0, variation=0.0, foot_length_m=0.2)
    step = footfalls(walker, LINE, 0.3)[0]
    x, _ = step.centre_m([step.start_s, step.start_s + 0.5 * step.duration_s, step.start_s + step.duration_s])
    np.testing.assert_allclose(x - step.heel_x_m, 0.2 * np.array([0.3, 0.55, 0.8]), atol=1e-12)


def test_no_foot_rolls_beyond_its_toes():
    with pytest.raises(BadValue, match=r"^roll_reach is 0.9; allowed: at most 0.8, to the toes$"):
        Walker(roll_start=0.2)


@pytest.mark.parametrize(
    ("path", "seconds", "name"), [([], 1.0, "path"), ([(0, np.nan)], 1.0, "path"), (LINE, np.inf, "seconds")]
)
def test_bad_walks_are_named(path, seconds, name):
    with pytest.raises(BadValue, match=f"^{name} is "):
        footfalls(Walker(), path, seconds)


def recorded(walk):
    """Measured steps: for each tile its sensors and its tared corner forces where it carries more than 100 N."""
    if not DATA.is_dir():
        pytest.skip("no recorded footsteps beside the checkout (../shared/data)")
    with (DATA / f"{walk}.csv").open() as file:
        rows = list(csv.reader(file))
    columns, values = rows[0], np.array(rows[1:], dtype=float)
    for tile in json.loads((DATA / f"{walk}.floor.json").read_text())["tiles"]:
        corners = values[:, [columns.index(f"{tile['id']}.{i}") for i in range(1, 5)]]
        corners = corners - np.median(corners[:50], axis=0)
        yield np.array(tile["sensors_m"]), corners[corners.sum(axis=1) > 100.0]


@pytest.mark.parametrize("walk", ["adult/walk1", "adult/walk2", "adult/walk3"])
def test_the_split_fits_measured_plates(walk):
    for sensors, corners in recorded(walk):
        force = corners.sum(axis=1)
        x, y = (corners @ sensors / force[:, None]).T
        residual = corner_forces(force, x, y, sensors) - corners
        balance = np.vstack([np.ones(4), sensors.T])
        least = np.stack([force, force * x, force * y], axis=1) @ np.linalg.pinv(balance).T - corners
        assert np.sqrt((residual**2).mean()) < 0.028 * force.max()
        assert np.linalg.norm(residual) < 0.5 * np.linalg.norm(least)


@pytest.mark.parametrize("walk", ["three-steps/walk", "adult/walk1", "adult/walk2"])
def test_the_force_shape_is_that_of_measured_steps(walk):
    for _, corners in recorded(walk):
        force = corners.sum(axis=1)
        phase = np.linspace(0, 1, force.size)
        half = force.size // 2
        peak1, peak2 = force[:half].max(), force[half:].max()
        valley = force[force[:half].argmax() : half + force[half:].argmax()].min()
        model = vertical_force(0.03 + 0.94 * phase, peak1, valley, peak2)
        assert np.linalg.norm(model - force) / np.linalg.norm(force) < 0.15
        # Trimming at 100 N leaves the fullest part, so the model's own mean is compared over the same part.
        assert model.mean() == pytest.approx(force.mean(), rel=0.08)
