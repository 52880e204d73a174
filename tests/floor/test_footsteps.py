"""Figures of footsteps: of measured walks beside a table, and of made ones beside what they were made with."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest
from made_walks import Foot, corner_forces, read, touching_floor, walk
from measured import WALKS, needs_data, reference_steps
from measured import walk as measured_walk

from underfoot.errors import BadValue
from underfoot.floor.contacts import Contact, ContactTracker
from underfoot.floor.footsteps import is_step, measure
from underfoot.floor.step_finder import find_steps
from underfoot.floor.walks import WalkTracker

FLOOR = touching_floor(6, 12)


def count_steps(floor, time_s, force_n, rate_hz, chunk=200):
    tracker, counter, steps = ContactTracker(floor, rate_hz), WalkTracker(floor), []
    for i in range(0, len(time_s), chunk):
        times = time_s[i : i + chunk]
        steps += counter.feed(tracker.feed(times, force_n[i : i + chunk]).finished, times[-1])
    return steps + counter.feed(tracker.finish().finished, time_s[-1]) + counter.finish()


def steps_of(feet, seconds=5.0, rate_hz=500.0, floor=FLOOR, chunk=200, **sensors):
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    return count_steps(floor, time_s, read(corner_forces(floor, feet, time_s), rate_hz, **sensors), rate_hz, chunk)


def contact(time_s, force_n, x_m=None, y_m=None, **changes):
    """A contact of this curve that began a sample after an empty tile."""
    time_s, force_n = np.asarray(time_s, float), np.asarray(force_n, float)
    zeros = np.zeros(len(time_s))
    x_m, y_m = (zeros if places is None else np.asarray(places, float) for places in (x_m, y_m))
    lead_s = 2 * time_s[0] - time_s[1]
    whole = Contact(1, time_s[0], time_s[-1], (0,), False, lead_s, 0.0, time_s, force_n, x_m, y_m)
    return msgspec.structs.replace(whole, **changes)


# --- figures ---


@needs_data
@pytest.mark.parametrize("tare_n", [0.0, 12.0])
@pytest.mark.parametrize("name", WALKS)
def test_figures_of_measured_steps_are_those_of_the_table(name, tare_n):
    floor, forces = measured_walk(name)
    tare = tare_n * np.random.default_rng(1).uniform(0.8, 1.25, forces.force_n.shape[1:])
    steps = count_steps(floor, forces.time_s, forces.force_n + tare, forces.rate_hz)
    expected = reference_steps(name)
    assert {step.tile for step in steps} == set(expected)
    for step in steps:
        contact_ms, *figures, loading = expected[step.tile]
        assert abs(step.contact_ms - contact_ms) <= 2e3 / forces.rate_hz
        measured = [step.peak1_n, step.valley_n, step.peak2_n, step.impulse_ns]
        np.testing.assert_allclose(measured, figures, rtol=0.01)
        assert step.loading_kn_s == pytest.approx(loading, rel=0.02)
        assert step.spike == (name == "adult/walk3" and step.tile == "p1")
        assert step.net_mm <= step.path_mm < 1.6 * step.net_mm


@needs_data
@pytest.mark.parametrize(
    ("name", "sides"),
    [
        ("three-steps/walk", ["left", "right", "left"]),
        *((name, ["right", "left"]) for name in WALKS if name != "three-steps/walk"),
    ],
)
def test_sides_of_measured_steps_follow_from_where_they_lie(name, sides):
    floor, forces = measured_walk(name)
    steps = count_steps(floor, forces.time_s, forces.force_n, forces.rate_hz)
    assert [step.side for step in steps] == sides
    assert [step.step for step in steps] == list(range(1, len(sides) + 1))
    assert all(100.0 < step.cadence_per_min < 130.0 for step in steps[1:])


@pytest.mark.parametrize("rate_hz", [240.0, 500.0, 1000.0])
def test_figures_of_a_made_walk_are_those_it_was_made_with(rate_hz):
    kind = {"peak1_n": 900.0, "valley_n": 480.0, "peak2_n": 820.0}
    feet = walk(3, start_s=1.0, step_s=0.8, heel_m=(0.15, 1.2), **kind)
    steps = steps_of(feet, 4.0, rate_hz, touching_floor(1, 1, side_m=2.4), tare_n=12.0, drift_n_s=0.1)
    assert len(steps) == 3
    fine = np.linspace(0.0, 0.65, 100_001)
    force = feet[0].force_n(feet[0].start_s + fine)
    borne_s = fine[force >= 10.0][-1] - fine[force >= 20.0][0]
    rise_s = fine[(force >= 720.0).argmax()] - fine[(force >= 180.0).argmax()]
    for step in steps:
        assert step.contact_ms == pytest.approx(1e3 * borne_s, abs=2e3 / rate_hz)
        assert [step.peak1_n, step.valley_n, step.peak2_n] == pytest.approx([900.0, 480.0, 820.0], rel=0.01)
        assert step.impulse_ns == pytest.approx(np.trapezoid(force, fine), rel=0.01)
        assert step.loading_kn_s == pytest.approx(0.54 / rise_s, rel=0.05)
        assert not step.spike


def test_a_step_of_which_few_samples_were_lost_is_whole_and_40_ms_without_any_cut_it():
    floor, time_s = touching_floor(1, 1, side_m=2.4), np.arange(4000) / 1000.0
    force_n = corner_forces(floor, walk(3, start_s=1.0, step_s=0.8, heel_m=(0.15, 1.2)), time_s)
    few, many = force_n.copy(), force_n.copy()
    few[[1100, 1101, 1300, 1301, 1302]] = many[1300:1400] = np.nan
    whole, concealed, broken = (
        [step for found in find_steps([(time_s, force)], floor, 1000.0) for step in found.steps]
        for force in (force_n, few, many)
    )
    assert len(whole) == len(concealed) == 3
    for step, other in zip(whole, concealed, strict=True):
        assert (other.start_s, other.contact_ms) == (step.start_s, step.contact_ms)
        assert (other.peak1_n, other.impulse_ns) == pytest.approx((step.peak1_n, step.impulse_ns), rel=5e-3)
    assert [step.start_s for step in broken] == [step.start_s for step in whole[1:]]


def test_a_step_across_two_tiles_has_the_figures_of_the_whole_foot():
    (step,) = steps_of([Foot(1.0, (0.58, 0.45), (0.72, 0.45))], 3.0, 1000.0)
    assert step.tile == "t15"
    assert [step.peak1_n, step.valley_n, step.peak2_n] == pytest.approx([800.0, 550.0, 780.0], rel=0.01)
    assert step.net_mm == pytest.approx(140.0 * 0.9, rel=0.05)


def test_loading_is_interpolated_from_the_sample_before_the_contact_and_not_guarded():
    # From 0 through 20 % at 2 ms and 80 % at 8 ms: 600 N in 6 ms.
    step = measure(contact([0.01, 0.02, 0.3, 0.6], [1000.0, 900.0, 500.0, 30.0], lead_s=0.0), FLOOR)
    assert step.loading_kn_s == pytest.approx(100.0)
    assert step.spike
    slower = measure(contact([0.05, 0.06, 0.3, 0.6], [1000.0, 900.0, 500.0, 30.0], lead_s=0.0), FLOOR)
    assert slower.loading_kn_s == pytest.approx(20.0)
    at_samples = contact([0.01, 0.02, 0.03, 0.3, 0.6], [200.0, 800.0, 1000.0, 500.0, 30.0], lead_s=0.0)
    assert measure(at_samples, FLOOR).loading_kn_s == pytest.approx(60.0)
    assert math.isnan(measure(contact([0.01, 0.02, 0.3], [1000.0, 900.0, 30.0], lead_n=math.nan), FLOOR).loading_kn_s)


@pytest.mark.parametrize(("peak_s", "expected"), [(0.037, True), (0.0385, False)])
def test_a_heel_whose_force_reaches_80_percent_within_30_ms_is_a_spike(peak_s, expected):
    assert measure(contact([0.0, peak_s, 0.3, 0.6], [30.0, 1000.0, 500.0, 30.0]), FLOOR).spike is expected


def test_peaks_are_of_the_halves_of_the_contact_and_the_valley_lies_between():
    force = [30, 700, 650, 400, 480, 500, 600, 20]
    step = measure(contact(np.arange(8) / 10.0, force), FLOOR)
    assert (step.peak1_n, step.valley_n, step.peak2_n) == (700.0, 400.0, 600.0)
    assert step.impulse_ns == pytest.approx((sum(force) - 25.0) / 10.0)
    assert not step.spike


def test_noise_of_the_centroid_is_no_path():
    time_s = np.arange(650) / 1000.0
    rng = np.random.default_rng(4)
    wide = 0.2 * time_s / time_s[-1] + rng.normal(0.0, 1e-3, 650)
    step = measure(contact(time_s, np.full(650, 700.0), wide, rng.normal(0.0, 1e-3, 650)), FLOOR)
    assert step.net_mm == pytest.approx(200.0, abs=4.0)
    # Taken from sample to sample it would be over 1000 mm.
    assert step.path_mm == pytest.approx(200.0, rel=0.07)


def test_the_path_follows_a_foot_that_sways():
    """Over 2 cm, to and fro in 0.2 s, while it rolls."""
    time_s = np.arange(601) / 1000.0
    x_m, y_m = 0.2 * time_s / 0.6, 0.01 * np.sin(2.0 * np.pi * time_s / 0.2)
    fine = np.linspace(0.0, 0.6, 100_001)
    speed_m_s = np.hypot(0.2 / 0.6, 0.01 * 2.0 * np.pi / 0.2 * np.cos(2.0 * np.pi * fine / 0.2))
    step = measure(contact(time_s, np.full(601, 700.0), x_m, y_m), FLOOR)
    assert step.path_mm == pytest.approx(1e3 * np.trapezoid(speed_m_s, fine), rel=0.03)


def test_the_path_leaves_out_what_is_below_50_newtons():
    force = np.array([20.0, 30.0, *[500.0] * 20, 30.0])
    x = np.array([0.3, 0.2, *np.linspace(0.0, 0.1, 20), -0.4])
    step = measure(contact(np.arange(23) / 100.0, force, x), FLOOR)
    assert (step.path_mm, step.net_mm) == (pytest.approx(100.0), pytest.approx(100.0))
    assert math.isnan(measure(contact([0.0, 0.1, 0.2], [30.0, 40.0, 20.0]), FLOOR).path_mm)


def test_a_curve_of_two_samples_has_no_figures_and_is_no_step():
    assert not is_step(contact([0.0, 0.1], [100.0, 100.0]))
    with pytest.raises(BadValue, match="curve is 2; allowed: 3 or more"):
        measure(contact([0.0, 0.1], [100.0, 100.0]), FLOOR)


# --- which contacts are steps ---


@pytest.mark.parametrize(
    ("seconds", "newtons", "changes", "expected"),
    [
        (0.6, 700.0, {}, True),
        (0.079, 700.0, {}, False),
        (0.081, 700.0, {}, True),
        (4.99, 700.0, {}, True),
        (5.01, 700.0, {}, False),
        (0.6, 49.9, {}, False),
        (0.6, 50.0, {}, True),
        (0.6, 700.0, {"cut": True}, False),
    ],
)
def test_a_step_is_whole_bears_weight_and_is_no_standing(seconds, newtons, changes, expected):
    time_s = np.linspace(0.0, seconds, 50)
    assert is_step(contact(time_s, np.full(50, newtons), **changes)) is expected


@pytest.mark.parametrize(("from_s", "to_s", "whole"), [(0.0, 5.0, 4), (0.3, 5.0, 3), (0.0, 1.9, 2)])
def test_a_step_that_the_recording_cuts_is_left_out(from_s, to_s, whole):
    time_s = np.arange(2500) / 500.0
    force_n = read(corner_forces(FLOOR, walk(4, start_s=0.1, step_s=0.6), time_s), 500.0)
    inside = (time_s >= from_s) & (time_s < to_s)
    assert len(count_steps(FLOOR, time_s[inside], force_n[inside], 500.0)) == whole


# --- sides, walkers, order ---


def turned(feet, degrees):
    """The same feet after a turn of the walk about the floor's middle."""
    turn, middle = np.exp(1j * np.radians(degrees)), complex(1.8, 0.9)

    def place(point):
        moved = middle + turn * (complex(*point) - middle)
        return moved.real, moved.imag

    return [dataclasses.replace(foot, heel_m=place(foot.heel_m), ball_m=place(foot.ball_m)) for foot in feet]


@pytest.mark.parametrize("degrees", [0.0, 20.0, 180.0, 200.0])
def test_sides_are_seen_along_the_walk_whatever_its_direction(degrees):
    steps = steps_of(turned(walk(5, heel_m=(0.55, 0.9)), degrees), 4.5, tare_n=11.0)
    assert [step.side for step in steps] == ["left", "right", "left", "right", "left"]
    assert [step.step for step in steps] == [1, 2, 3, 4, 5]
    assert [step.cadence_per_min for step in steps[1:]] == pytest.approx([60.0 / 0.54] * 4, rel=0.02)
    assert math.isnan(steps[0].cadence_per_min)


def test_two_people_have_sides_of_their_own():
    one = walk(5, heel_m=(0.15, 0.45), start_s=0.6)
    other = turned(walk(5, heel_m=(0.25, 0.45), start_s=0.85, step_s=0.5), 180.0)
    steps = steps_of(one + other, 4.5, chunk=20)
    assert [step.step for step in steps] == list(range(1, 11))
    near = {step.contact: step.side for step in steps if int(step.tile[1:]) <= 36}
    far = {step.contact: step.side for step in steps if int(step.tile[1:]) > 36}
    assert list(near.values()) == list(far.values()) == ["left", "right", "left", "right", "left"]


def test_a_single_step_has_no_side_and_comes_when_no_other_has_come():
    tracker, counter = ContactTracker(FLOOR, 500.0), WalkTracker(FLOOR)
    time_s = np.arange(2100) / 500.0
    force_n = read(corner_forces(FLOOR, walk(1), time_s), 500.0)
    came = [
        (time_s[i], counter.feed(tracker.feed(time_s[i : i + 1], force_n[i : i + 1]).finished, time_s[i]))
        for i in range(2100)
    ]
    ((when_s, (step,)),) = [(now_s, steps) for now_s, steps in came if steps]
    assert step.side == "unknown"
    assert when_s == pytest.approx(0.6 + 0.65 + 2.8, abs=0.02)


def test_the_first_step_of_who_makes_40_a_minute_has_a_side():
    assert [step.side for step in steps_of(walk(2, step_s=1.5, duration_s=1.0), 5.0)] == ["left", "right"]


def test_steps_far_apart_are_not_one_walk():
    feet = [*walk(2, step_m=0.6), *walk(2, heel_m=(2.65, 0.75), start_s=1.68, step_m=0.6)]
    steps = steps_of(feet, 4.0)
    assert [step.side for step in steps] == ["left", "right"] * 2
    assert [math.isnan(step.cadence_per_min) for step in steps] == [True, False, True, False]


def test_stepping_on_the_spot_has_no_sides():
    steps = steps_of(walk(4, heel_m=(1.0, 0.75), step_m=0.0, width_m=0.5), 4.0)
    assert [step.side for step in steps] == ["unknown"] * 4


@needs_data
def test_chunks_do_not_change_the_sides_of_measured_steps_long_after_each_other():
    floor, forces = measured_walk("floor14/floor")
    expected, *others = (
        [(step.side, step.person) for step in count_steps(floor, forces.time_s, forces.force_n, forces.rate_hz, chunk)]
        for chunk in (50, 400, 10_000)
    )
    assert len(expected) == 16
    assert others == [expected, expected]


def test_chunks_do_not_change_the_steps():
    feet = (
        walk(4, heel_m=(0.15, 0.45))
        + walk(1, heel_m=(2.0, 1.35), start_s=0.7)
        + walk(3, heel_m=(0.4, 1.35), start_s=2.0)
    )
    expected = [msgspec.structs.astuple(s) for s in steps_of(feet, 5.5, 240.0, chunk=100, tare_n=12.0)]
    assert len(expected) == 8
    for chunk in (1, 7, 10_000):
        steps = [msgspec.structs.astuple(s) for s in steps_of(feet, 5.5, 240.0, chunk=chunk, tare_n=12.0)]
        np.testing.assert_equal(steps, expected, f"chunks of {chunk}")
