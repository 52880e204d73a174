"""Where a load stands: presses of a robot that errs in known ways, and what the correction makes of them."""

import dataclasses

import made_sensors
import msgspec
import numpy as np
import pytest
from exact_hand import Hand
from made_curves import line

from underfoot.calibration.files.measurements import Presses
from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.centroid import CentroidProcedure, places
from underfoot.calibration.results.centroid import drawings_of, part_of, quantities_of, result_of, verdict_of
from underfoot.calibration.science.centroid import SHEAR_SHARE, assess, best_static_forces
from underfoot.calibration.science.centroid_fit import centroid, convex_hull, fit_correction
from underfoot.calibration.science.press_plausibility import load_groups, plausible_presses
from underfoot.errors import BadValue
from underfoot.floor.curves import Compensation, Curve
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Fsr, Profile

TILE = default_floor(1, 1).tiles[0]
SENSORS = np.array(TILE.sensors_m)


def presses(**errors):
    at, load, forces = made_sensors.Robot(SENSORS, **errors).presses()
    return Presses("t1", at, load, forces)


def test_a_perfect_tile_needs_no_correction():
    found = assess(presses(), TILE)
    assert found.form == "none"
    assert found.errors_mm(found.after_m).max() < 1e-9
    assert found.correction.gains == (1.0, 1.0, 1.0, 1.0)
    assert found.good


def test_a_place_is_within_the_uncertainty_that_is_stated():
    """Of presses that miss their marks by 1.5 mm (k = 2 in 2-D: 3.7), at places that no fit has seen."""
    draws, table = np.random.default_rng(2), presses(moved_m=0.004)
    missed = dataclasses.replace(table, at_m=table.at_m + draws.normal(0.0, 0.0015, table.at_m.shape))
    found = dataclasses.replace(assess(missed, TILE), reference_mm=3.7)
    off_mm = found.errors_mm(found.after_m)
    assert found.expanded_mm == pytest.approx(np.hypot(np.sort(off_mm)[int(0.95 * off_mm.size)], 3.7), rel=0.02)
    part = part_of(found, "a robot")
    assert part.figures["expanded_mm"] == pytest.approx(found.expanded_mm, rel=1e-5)
    assert f"A place is uncertain by {found.expanded_mm:.1f} mm (95 %)." in part.verdict
    fresh_at, _, fresh = made_sensors.Robot(SENSORS, rows=6, inset_m=0.03, moved_m=0.004).presses()
    off = Profile(tile="t1").with_part(part).position(fresh) - fresh_at
    assert np.mean(1e3 * np.hypot(*off.T) < found.expanded_mm) > 0.95
    assert "expanded_mm" not in {name for name, _, _ in quantities_of(assess(table, TILE))}


def test_wrong_gains_are_found_to_a_thousandth():
    gains = np.array([1.2, 0.85, 1.0, 0.95])
    found = assess(presses(gains=gains), TILE)
    learned = np.array(found.correction.gains)
    assert learned / learned.mean() == pytest.approx(1.0 / gains / np.mean(1.0 / gains), rel=1e-3)
    assert found.errors_mm(found.before_m).mean() > 5.0
    assert found.errors_mm(found.after_m).max() < 0.2


def test_curves_that_are_wrong_of_light_loads_are_bent_right():
    """A soft start that a curve missed, another at each sensor, and corners that lift and read half of it."""
    table = presses(moved_m=0.004)

    def misread(forces):
        soft = np.array([6.0, -4.0, 8.0, 3.0]) * -np.expm1(-np.maximum(forces, 0.0) / 20.0)
        return np.where(forces < 0.0, 0.5, 1.0) * forces - soft

    found = assess(Presses("t1", table.at_m, table.force_n, misread(table.readings)), TILE)
    assert found.form.startswith("bends")
    plain = dict(found.tried)["gains and affine"]
    assert dict(found.tried)[found.form] < 0.4 * plain
    assert found.errors_mm(found.after_m).max() < 0.2 * found.errors_mm(found.before_m).max()
    profile = Profile(tile="t1").with_part(part_of(found, "a robot"))
    again = Profile.loads(profile.dumps())
    fresh_at, _, fresh = made_sensors.Robot(SENSORS, rows=6, inset_m=0.03, moved_m=0.004).presses()
    off = again.position(misread(fresh)) - fresh_at
    assert 1e3 * np.hypot(*off.T).mean() < 1.5 * found.errors_mm(found.after_m).mean() + 0.2


def test_the_best_static_curves_straighten_bends_but_not_hysteresis():
    table = presses()
    bent = 40.0 * np.cbrt(table.readings)
    np.testing.assert_allclose(best_static_forces(bent, table.readings), table.readings, atol=1e-9)
    remembering = table.readings * np.where(np.arange(len(bent)) % 2, 1.05, 1.0)[:, None]
    left = (best_static_forces(remembering, table.readings) - table.readings) / np.maximum(table.readings, 30.0)
    # Half the gap at most, and less where few presses have both.
    assert 0.003 < np.sqrt(np.mean(left**2)) < 0.025


@pytest.mark.parametrize(
    "errors", [{"moved_m": 0.012}, {"moved_m": 0.008, "twist": 0.03, "gains": np.array([1.15, 0.9, 1.0, 1.05])}]
)
def test_misplaced_sensors_and_a_warped_plate_are_corrected_on_places_left_out(errors):
    found = assess(presses(noise_n=0.1, **errors), TILE)
    before, after = found.errors_mm(found.before_m), found.errors_mm(found.after_m)
    assert after.mean() < 0.2 * before.mean()
    assert after.max() < 5.0
    fresh_at, _, fresh = made_sensors.Robot(SENSORS, rows=6, inset_m=0.03, noise_n=0.1, seed=0, **errors).presses()
    place = found.correction.position(fresh, SENSORS, 0.0)
    assert 1e3 * np.hypot(*(place - fresh_at).T).mean() < 1.5 * after.mean() + 0.2


def test_nothing_is_extrapolated():
    found = assess(presses(moved_m=0.012, inset_m=0.07, noise_n=0.2), TILE)
    assert found.correction.powers
    corners = np.eye(4) * 300.0
    moved = found.correction.position(corners, SENSORS, 0.0) - centroid(corners * found.correction.gains, SENSORS)
    inside = np.array(found.correction.area_m)
    sums = [found.correction.position(f, SENSORS, 0.0) for f in np.full((1, 4), 100.0)]
    assert np.isfinite(sums).all()
    at_edge = moved_at(found.correction, inside)
    assert np.hypot(*moved.T).max() <= np.hypot(*at_edge.T).max() + 1e-9


def moved_at(correction, points_m):
    """The displacement at points, from the polynomial as it is written down."""
    u = points_m / correction.scale_m
    terms = np.array([u[:, 0] ** i * u[:, 1] ** j for i, j in correction.powers])
    return terms.T @ np.array(correction.displacement_m)


def test_noise_is_not_made_worse():
    found = assess(presses(noise_n=15.0), TILE)
    after, before = found.errors_mm(found.after_m).mean(), found.errors_mm(found.before_m).mean()
    assert after <= before


def test_errors_are_told_by_load_edge_and_shear():
    figures = {name: value for name, value, _ in quantities_of(assess(presses(bias_n=3.0), TILE))}
    # A constant error of forces moves the place by as much less as the load is larger.
    by_load = [figures[f"mean_after_mm_at_{load}_n"] for load in (100, 200, 400)]
    assert by_load[0] > by_load[1] > 0.0
    assert figures["shear_mm"] == pytest.approx(1e3 * SHEAR_SHARE * TILE.sensor_depth_m)
    assert {"mean_after_mm_0_to_3_cm_from_edge", "mean_after_mm_over_10_cm_from_edge"} <= figures.keys()
    assert (figures["presses"], figures["places"]) == (147.0, 49.0)


def test_lengths_are_told_in_millimetres_and_centimetres():
    """A tile of 30.5 cm, its sensors 13.35 cm from its middle and 2 cm deep; presses, and where they seemed to be."""
    tile = msgspec.structs.replace(TILE, sensor_depth_m=0.02)
    found = assess(presses(gains=(1.2, 0.85, 1.0, 0.95)), tile)
    edge, sensors, pressed, arrows = drawings_of(found)[0].series
    for drawn, reach_mm in ((edge, 152.5), (sensors, 133.5), (pressed, 132.5)):
        assert [np.abs(drawn.x).max(), np.abs(drawn.y).max()] == pytest.approx([reach_mm, reach_mm])
    np.testing.assert_allclose(np.column_stack([arrows.x, arrows.y]), 1000 * found.at_m)
    np.testing.assert_allclose(arrows.to, 1000 * found.before_m)
    assert "20 mm below the surface" in verdict_of(found)
    assert "mean_after_mm_6_to_10_cm_from_edge" in {name for name, *_ in quantities_of(found)}


@pytest.mark.parametrize(
    ("static_m", "compensated_m", "good"),
    [(0.018, None, True), (0.022, None, False), (0.018, 0.022, False), (0.022, 0.018, True)],
)
def test_twenty_millimetres_on_average_are_good_enough(static_m, compensated_m, good):
    """What the thesis found typical of one calibrated tile (section 5.4), of the forces that a session uses."""
    found = assess(presses(), TILE)
    static, compensated = (
        off_m and dataclasses.replace(found, after_m=found.at_m + np.array([off_m, 0.0]))
        for off_m in (static_m, compensated_m)
    )
    part = part_of(dataclasses.replace(static, over_time=compensated), "a robot")
    expected_mm = 1000 * (compensated_m or static_m)
    assert (part.good, part.error, part.error_allowed) == (good, pytest.approx(expected_mm), 20.0)
    assert ("; 20 mm on average is allowed." in part.verdict) is not good


def test_readings_go_through_the_profile_s_curves():
    table = presses()
    curve = line(rest=500.0)
    profile = Profile(tile="t1", fsr=Fsr(made="2024-05-01", sensors=(curve, curve, curve, curve)))
    counts = Presses("t1", table.at_m, table.force_n, 500.0 + 100.0 * table.readings)
    found = assess(counts, TILE, profile)
    assert found.errors_mm(found.after_m).max() < 0.1
    silent = Profile(tile="t1", fsr=Fsr(made="2024-05-01", sensors=(curve, curve, Curve(uncalibrated="dead"), curve)))
    with pytest.raises(BadValue, match="sensor 3 has no curve"):
        assess(counts, TILE, silent)


def test_without_a_load_cell_the_force_of_a_press_is_the_compensated_one():
    """It was the static curves', on the page, where nobody could press as asked for, and in the result."""
    memory = Compensation(readings=(2000, 22000), forces_n=(0, 1000), slopes=(0.05, 0.05))
    curve = line(slope=0.035, rest=2000.0, full=700.0, compensation=memory)
    profile = Profile(tile="t1", fsr=Fsr(made="2024-05-01", sensors=(curve,) * 4))
    found = run(CentroidProcedure(TILE, profile), Hand(force=False), {"form": "quick", "loads_n": (150.0, 300.0)})
    assert found.warnings == ()
    assert found.raw[0][2][:, 2] == pytest.approx(np.tile([150.0, 300.0], 9), rel=0.03)


def test_presses_are_left_out_by_the_forces_that_a_session_uses():
    """A good tile was refused where static curves read too little at times; what they do not feel has no place."""
    table = presses()
    static, compensated = table.readings.copy(), table.readings * [1.2, 0.85, 1.0, 0.95]
    static[::3], static[40], static[60] = 0.4 * static[::3], 0.0, static[60, [1, 0, 3, 2]]
    compensated[100] = compensated[100, [1, 0, 3, 2]]
    both = Presses("t1", table.at_m, table.force_n, table.readings, np.hstack([static, compensated]))
    part = part_of(found := assess(both, TILE), "a robot")
    assert [line.split(":")[0] for line in found.left_out] == ["press 41 left out", "press 101 left out"]
    assert (part.figures["presses"], part.error) == (145.0, pytest.approx(0.0, abs=0.2))
    assert part.figures["worst_over_time_mm"] < 0.2 < 50.0 < part.figures["worst_after_mm"]
    assert found.form == "none"
    assert "none is made" not in part.verdict
    assert min(drawings_of(found)[-1].series[0].y) < 0.2


def test_a_corner_that_lifts_does_not_clip():
    """Who pressed a good tile at its edge was told to press less hard there: without a load a sensor reads 0."""
    hand = Hand(lambda corners: np.maximum(500.0 + 20.0 * corners, 0.0), reach=1.3)
    profile = Profile(tile="t1", fsr=Fsr(made="2024-05-01", sensors=(line(slope=0.05, rest=500.0, full=1000.0),) * 4))
    found = run(CentroidProcedure(TILE, profile), hand, {"form": "quick", "loads_n": (300.0,)})
    assert len(found.raw[0][2]) == 9


def test_another_tile_s_profile_is_refused_before_and_after():
    other = Profile(tile="t2")
    with pytest.raises(BadValue, match="the profile's tile is 't2'; allowed: t1, which was pressed"):
        assess(presses(), TILE, other)
    with pytest.raises(BadValue, match="the measured tile is 't1'; allowed: t2, whose profile this is"):
        result_of(assess(presses(), TILE), presses()).apply(other)


@pytest.mark.parametrize(("share", "is_out"), [(0.55, True), (0.65, False), (1.55, False), (1.65, True)])
def test_a_press_is_left_out_whose_force_is_far_from_the_one_given(share, is_out):
    table = presses()
    _, lines = plausible_presses(table, table.readings * np.where(np.arange(147) == 40, share, 1.0)[:, None], SENSORS)
    assert [line.split(":")[0] for line in lines] == ["press 41 left out"] * is_out


def test_what_cannot_be_right_is_refused_or_left_out():
    table = presses()
    swapped = Presses("t1", table.at_m, table.force_n, table.readings[:, [1, 0, 2, 3]])
    with pytest.raises(BadValue, match="sensors 1 and 2 look swapped"):
        assess(swapped, TILE)
    with pytest.raises(BadValue, match="allowed: on tile t1"):
        assess(Presses("t1", table.at_m * 10.0, table.force_n, table.readings), TILE)
    with pytest.raises(BadValue, match="at least 6"):
        assess(Presses("t1", table.at_m[:4], table.force_n[:4], table.readings[:4]), TILE)
    with pytest.raises(BadValue, match="at least 4 different"):
        assess(Presses("t1", table.at_m[:9], table.force_n[:9], table.readings[:9]), TILE)
    force = table.force_n.copy()
    force[7] *= 10.0
    found = assess(Presses("t1", table.at_m, force, table.readings), TILE)
    assert found.left_out == (f"press 8 left out: {force[7]:.4g} N given, {force[7] / 10.0:.4g} N measured",)
    force[::2] *= 10.0
    with pytest.raises(BadValue, match="do not fit their force"):
        assess(Presses("t1", table.at_m, force, table.readings), TILE)


def test_nine_places_allow_gains_and_a_plane_at_most():
    found = assess(presses(rows=3, moved_m=0.01), TILE)
    assert {name for name, _ in found.tried} <= {"none", "gains", "affine", "gains and affine"}
    assert found.errors_mm(found.after_m).mean() < found.errors_mm(found.before_m).mean()


def test_loads_near_each_other_are_one_load():
    found = load_groups(np.array([100.0, 103.0, 97.0, 200.0, 210.0, 400.0]))
    assert [round(load) for load, _ in found] == [100, 205, 400]
    assert [int(chosen.sum()) for _, chosen in found] == [3, 2, 1]


def test_the_hull_holds_every_point():
    points = np.random.default_rng(3).standard_normal((60, 2))
    corners = np.array(convex_hull(points))
    edges = np.roll(corners, -1, axis=0) - corners
    across = edges[:, 0] * (points[:, None, 1] - corners[:, 1]) - edges[:, 1] * (points[:, None, 0] - corners[:, 0])
    assert across.min() > -1e-12


def test_gains_are_the_same_from_any_units():
    at, _, forces = made_sensors.Robot(SENSORS, gains=np.array([1.1, 0.9, 1.0, 1.0])).presses()
    once, thousand = (fit_correction(scale * forces, at, SENSORS, "gains", 0).gains for scale in (1.0, 1000.0))
    assert once == pytest.approx(thousand, rel=1e-9)


def felt_by():
    """A profile of sensors that read 60 counts a newton."""
    curve = line(slope=1 / 60, rest=0.0, full=1000.0)
    return Profile(tile="t1", fsr=Fsr(made="2024-05-01", sensors=(curve, curve, curve, curve)))


@pytest.mark.parametrize("factor", [1.0 / 9.81, 10.0])
def test_loads_in_another_unit_are_told_by_calibrated_sensors(factor):
    table = presses()
    counts = 60.0 * table.readings
    assert assess(Presses("t1", table.at_m, table.force_n, counts), TILE, felt_by()).good
    with pytest.raises(BadValue, match="is it in newtons"):
        assess(Presses("t1", table.at_m, factor * table.force_n, counts), TILE, felt_by())


def test_a_place_that_was_mistyped_is_left_out_and_named():
    table = presses(gains=np.array([1.1, 0.9, 1.0, 1.0]), noise_n=0.3)
    at_m = table.at_m.copy()
    at_m[4] = -at_m[4]
    found = assess(Presses("t1", at_m, table.force_n, table.readings), TILE)
    assert len(found.left_out) == 1
    assert found.left_out[0].startswith("press 5 left out: (")
    assert found.form == assess(table, TILE).form
    assert found.mean_mm < 0.3 * found.errors_mm(found.before_m).mean()


def test_dead_sensors_and_lines_out_of_order_are_refused():
    table = presses(noise_n=0.1)
    dead = table.readings.copy()
    dead[:, 2] = 0.0
    with pytest.raises(BadValue, match="sensor 3 gives 0 N at every press: is it dead"):
        assess(Presses("t1", table.at_m, table.force_n, dead), TILE)
    with pytest.raises(BadValue, match="add up to 0 N"):
        assess(Presses("t1", table.at_m, table.force_n, 0.0 * dead), TILE)
    loads_apart = np.concatenate([np.flatnonzero(table.force_n == load) for load in (100.0, 200.0, 400.0)])
    mixed = np.empty(loads_apart.size, dtype=int)
    draws = np.random.default_rng(5)
    for part in np.split(loads_apart, 3):
        mixed[part] = draws.permutation(part)
    with pytest.raises(BadValue, match="do not depend on the places"):
        assess(Presses("t1", table.at_m, table.force_n, table.readings[mixed]), TILE)


def test_a_corner_says_nothing_of_the_rest_and_the_middle_only_of_the_sensors():
    errors = {"gains": np.array([1.1, 0.92, 1.0, 1.05]), "twist": 0.02, "bias_n": 2.0, "noise_n": 0.3}
    table = presses(rows=9, **errors)
    fresh_at, _, fresh = made_sensors.Robot(SENSORS, rows=6, seed=9, **errors).presses()
    before = np.hypot(*(centroid(fresh, SENSORS) - fresh_at).T)
    for chosen, form in ((table.at_m.min(axis=1) > 0.02, "none"), (np.abs(table.at_m).max(axis=1) < 0.05, "gains")):
        found = assess(Presses("t1", table.at_m[chosen], table.force_n[chosen], table.readings[chosen]), TILE)
        assert found.form == form
        after = np.hypot(*(found.correction.position(fresh, SENSORS, 0.0) - fresh_at).T)
        assert after.mean() <= before.mean()
        assert after.max() <= 1.05 * before.max()


def test_what_hardly_helps_is_not_made():
    found = assess(presses(noise_n=10.0, seed=4), TILE)
    assert found.form == "none"
    assert "none is made" in verdict_of(found)


def test_places_lie_on_the_tile_apart_from_each_other_and_are_drawn_by_the_seed():
    for count in (9, 50):
        for seed in (None, 4):
            found = places(TILE, count, seed)
            assert found.shape == (count, 2)
            assert np.abs(found).max() <= TILE.size_m[0] / 2.0 - 0.02 + 1e-4
            apart = np.hypot(*(found[:, None] - found[None]).T) + 9.0 * np.eye(count)
            assert apart.min() > 0.003
    assert not np.array_equal(places(TILE, 50, 1), places(TILE, 50, 2))


@pytest.mark.parametrize(("least_n", "dead_n", "warned"), [(150.0, 0.0, 0), (150.0, 10.0, 1), (10.0, 0.5, 0)])
def test_sensors_that_do_not_feel_light_loads_are_named_under_those(least_n, dead_n, warned):
    """Of all loads together the sum was 7 % off, and passed; of 10 N a good tile is 2 N off, and was named."""
    at, load, forces = made_sensors.Robot(SENSORS, rows=3, loads=least_n * np.array([1.0, 2.0, 4.0])).presses()
    felt = np.maximum(forces - dead_n, 0.0)
    pressed = Presses("t1", at, load, felt, np.hstack([felt, felt]))
    said = [line for line in result_of(assess(pressed, TILE), pressed).warnings if "do all sensors feel" in line]
    assert [line.partition("(")[2][:16] for line in said] == ["median of 150 N)"] * warned


@pytest.mark.parametrize(("aside_m", "named"), [(0.0, 0), (0.05, 1)])
def test_a_place_that_was_pressed_elsewhere_is_named(aside_m, named):
    """Of nine it made the uncertainty 51 mm, and nothing said which to press again."""
    at, load, forces = made_sensors.Robot(SENSORS, rows=3, loads=(150.0, 300.0, 600.0)).presses()
    at[np.hypot(*at.T) < 0.01] = aside_m, 0.0
    pressed = Presses("t1", at, load, forces)
    said = [line for line in result_of(assess(pressed, TILE), pressed).warnings if "another one pressed" in line]
    assert [line[:29] for line in said] == ["the place at x 50 mm, y 0 mm "] * named


@pytest.mark.parametrize(("aside_m", "said"), [(0.0, []), (0.003, []), (0.012, ["x -12 mm, y +0 mm"])])
def test_places_that_are_all_off_alike_are_told_by_calibrated_forces(aside_m, said):
    """The correction makes up for it, so that whoever marked the tile from another edge was told 3 mm."""
    at, load, forces = made_sensors.Robot(SENSORS, rows=3, loads=(150.0, 300.0, 600.0)).presses()
    pressed = Presses("t1", at + np.array([aside_m, 0.0]), load, forces, np.hstack([forces, forces]))
    calibrated = Fsr(made="2026-01-01", sensors=(line(),) * 4, figures={"foot_expanded_percent": 5.0})
    lines = result_of(assess(pressed, TILE), pressed, None, calibrated).warnings
    assert [line[35:52] for line in lines if line.startswith("all places are found off alike")] == said
