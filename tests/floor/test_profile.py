"""What calibration knows of a tile: its arithmetic, its file, and what it has against itself."""

import hashlib
import json
import math
from datetime import date

import msgspec
import numpy as np
import pytest
from made_curves import line

from underfoot.errors import BadFile, BadValue
from underfoot.floor.centroid_correction import CentroidCorrection, nearest_within
from underfoot.floor.curves import Compensation, Curve
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import (
    Centroid,
    Fsr,
    Latency,
    PlateStiffness,
    Profile,
    Response,
    load_for_tile,
    profiles_of,
)

SENSORS = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
TODAY = date(2024, 6, 1)


def fsr(*curves, **more):
    return Fsr(made="2024-05-01", sensors=curves or (line(),) * 4, **more)


def whole():
    centroid = Centroid(made="2024-05-02", sensors_m=SENSORS, error=4.0, error_allowed=20.0, error_unit="mm")
    response = Response(
        made="2024-05-03", frequencies_hz=(50.0, 100.0), magnitude=(10.0, 12.0), acceleration_per_unit=11.0,
        equaliser=((1.0, 0.1, 0.0, 1.0, -0.5, 0.2),), band_hz=(50.0, 750.0),
    )  # fmt: skip
    return Profile(tile="t1", serial="A7").with_part(fsr()).with_part(centroid).with_part(response)


# --- newtons ---


def test_readings_become_newtons_in_any_shape():
    profile = Profile(tile="t1", fsr=fsr())
    readings = np.random.default_rng(0).uniform(1000.0, 51000.0, (3, 5, 4))
    assert profile.force(readings) == pytest.approx(0.01 * (readings - 1000.0))
    assert profile.force(readings[0, 0]).shape == (4,)
    with pytest.raises(BadValue, match="last axis of 4"):
        profile.force(np.zeros((4, 3)))


def test_beyond_the_curve_it_goes_on_mildly_and_nan_stays():
    profile = Profile(tile="t1", fsr=fsr())
    assert profile.force([1000.0, 0.0, 65535.0, np.nan])[:3] == pytest.approx([0.0, -10.0, 625.0])
    assert np.isnan(profile.force([1000.0, 0.0, 65535.0, np.nan])[3])
    assert profile.force([np.inf, -np.inf, 0, 0])[:2] == pytest.approx([625.0, -50.0])


def test_a_falling_curve_is_as_good():
    falling = Curve(
        family="power",
        unloaded_reading=60000.0,
        full_scale_n=500.0,
        readings=(10000.0, 60000.0),
        forces_n=(500.0, 0.0),
        slopes=(-0.01, -0.01),
    )
    assert falling.force(np.array([60000.0, 35000.0, 0.0, 65000.0])) == pytest.approx([0.0, 250.0, 600.0, -50.0])


def test_between_knots_it_is_the_cubic_that_was_written_down():
    x = np.linspace(0.0, 1000.0, 6)
    curve = Curve(family="spline", full_scale_n=8.0, readings=tuple(x), forces_n=tuple((x / 500.0) ** 3),
                  slopes=tuple(3.0 * x**2 / 500.0**3))  # fmt: skip
    fine = np.linspace(0.0, 1000.0, 777)
    assert curve.force(fine) == pytest.approx((fine / 500.0) ** 3, abs=1e-12)


def test_an_uncalibrated_sensor_gives_no_number_and_the_others_do():
    profile = Profile(tile="t1", fsr=fsr(line(), Curve(uncalibrated="it is dead"), line(), line()))
    assert np.isnan(profile.force(np.full(4, 2000.0))).tolist() == [False, True, False, False]
    assert any("sensor 2 of t1 is not calibrated: it is dead" in flag for flag in profile.flags("t1", TODAY))


# --- hysteresis and creep ---


def compensated(creep=0.04, relative=True):
    knots = {"readings": (1000.0, 51000.0), "forces_n": (0.0, 500.0), "slopes": (0.01, 0.01)}
    return line(
        compensation=Compensation(
            **knots, creep=creep, relative=relative, widths=(0.05, 0.2), weights=(1.3, -0.2, -0.1)
        )
    )


def test_any_split_of_a_stream_gives_the_same_newtons():
    profile = Profile(tile="t1", fsr=fsr(*(compensated(),) * 4))
    draws = np.random.default_rng(1)
    readings = 1000.0 + 20000.0 * np.abs(np.cumsum(0.02 * draws.standard_normal((500, 4)), axis=0))
    time_s = np.cumsum(draws.uniform(0.0005, 0.01, 500))
    whole = profile.force_over_time(readings, time_s)
    states = profile.rested()
    pieces = [
        profile.force_over_time(readings[a:b], time_s[a:b], states) for a, b in ((0, 1), (1, 7), (7, 300), (300, 500))
    ]
    assert np.concatenate(pieces) == pytest.approx(whole, rel=1e-12, abs=1e-9)
    assert np.abs(whole - profile.force(readings)).max() > 1.0


def test_without_compensation_it_is_the_static_curve():
    profile = Profile(tile="t1", fsr=fsr())
    readings = np.random.default_rng(0).uniform(0.0, 65535.0, (50, 4))
    assert profile.force_over_time(readings, np.arange(50.0)) == pytest.approx(profile.force(readings))


@pytest.mark.parametrize(
    ("time_s", "states"),
    [
        (["soon"] * 3, None),
        ([[0.0], [0.1, 0.2], [0.3]], None),
        ([0.0, 0.1], None),
        ([0.0, 0.1, math.nan], None),
        ([0.0, 0.1, 0.2], np.zeros(4)),
        ([0.0, 0.1, 0.2], Profile.rested()[:2]),
    ],
)
def test_times_and_states_that_are_none_are_refused_in_a_line(time_s, states):
    profile = Profile(tile="t1", fsr=fsr(*(compensated(),) * 4))
    with pytest.raises(BadValue, match="allowed: "):
        profile.force_over_time(np.ones((3, 4)), time_s, states)


def test_a_reading_that_is_nan_leaves_the_state_as_it_was():
    profile = Profile(tile="t1", fsr=fsr(*(compensated(),) * 4))
    readings = np.full((6, 4), 20000.0)
    time_s = np.array([0.0, 0.1, 0.2, 0.2, 0.1, 0.3])
    kept = profile.force_over_time(readings[[0, 1, 5]], time_s[[0, 1, 5]])
    readings[2:5] = np.nan
    holes = profile.force_over_time(readings, time_s)
    assert np.isnan(holes[2:5]).all()
    assert holes[[0, 1, 5]] == pytest.approx(kept)


# --- places ---


def test_the_place_is_the_weighed_centroid_displaced():
    correction = CentroidCorrection(gains=(1.2, 0.8, 1.0, 1.0), powers=((0, 0), (1, 0), (1, 1)), scale_m=0.1,
                            displacement_m=((0.002, 0.0), (0.001, 0.003), (0.0, -0.004)),
                            area_m=((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))  # fmt: skip
    profile = Profile(tile="t1", centroid=Centroid(made="2024-05-01", sensors_m=SENSORS, correction=correction))
    forces = np.array([100.0, 50.0, 25.0, 75.0])
    weighed = forces * correction.gains
    plain = weighed @ np.array(SENSORS) / weighed.sum()
    u, v = plain / 0.1
    moved = plain + np.array([0.002 + 0.001 * u, 0.003 * u - 0.004 * u * v])
    assert profile.position(forces) == pytest.approx(moved)
    assert profile.position(np.tile(forces, (2, 3, 1))).shape == (2, 3, 2)


def test_below_the_least_force_there_is_no_place():
    profile = Profile(tile="t1", centroid=Centroid(made="2024-05-01", sensors_m=SENSORS, least_n=10.0))
    places = profile.position([[2.0, 2.0, 2.0, 3.9], [3.0, 3.0, 3.0, 3.0], [5.0, np.nan, 5.0, 5.0], [0.0] * 4])
    assert np.isfinite(places).all(axis=-1).tolist() == [False, True, False, False]
    with pytest.raises(BadValue, match="no centroid part"):
        Profile(tile="t1").position(np.ones(4))


def test_outside_the_area_the_nearest_point_counts():
    triangle = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]])
    found = [nearest_within(x, y, triangle) for x, y in ((0.5, 0.5), (2.0, 2.0), (-1.0, 1.0), (3.0, -1.0))]
    assert found == pytest.approx(np.array([[0.5, 0.5], [1.0, 1.0], [0.0, 1.0], [2.0, 0.0]]))


def test_over_time_has_a_correction_of_its_own():
    shifted = CentroidCorrection(powers=((0, 0),), displacement_m=((0.01, 0.0),))
    part = Centroid(made="2024-05-01", sensors_m=SENSORS, over_time=shifted)
    profile = Profile(tile="t1", centroid=part)
    assert profile.position(np.full(4, 50.0)) == pytest.approx([0.0, 0.0])
    assert profile.position(np.full(4, 50.0), over_time=True) == pytest.approx([0.01, 0.0])


# --- the file ---


def test_it_comes_back_from_its_file_as_it_was(tmp_path):
    profile = whole().with_part(fsr(*(compensated(),) * 4), TODAY)
    profile.save(tmp_path / "t1.json")
    back = Profile.load(tmp_path / "t1.json")
    assert back == profile
    assert back.equaliser.shape == (1, 6)
    assert back.acceleration_per_unit == 11.0
    written = json.loads((tmp_path / "t1.json").read_text())
    assert list(written)[:3] == ["format", "version", "tile"]


def test_an_error_names_file_place_value_and_what_is_allowed(tmp_path):
    raw = json.loads(whole().dumps())
    path = tmp_path / "t1.json"
    for place, value, said in (
        (("version",), 9, r"t1.json: \$.version is 9; allowed: 1"),
        (("tile",), 7, r"t1.json: \$.tile is 7; allowed: text"),
        (("fsr", "made"), "soon", r"t1.json: \$.fsr.*made is 'soon'; allowed: a date"),
        (("fsr", "sensors"), [], r"t1.json: \$.fsr.sensors"),
        (("centroid", "least"), 3, r"t1.json: \$.centroid.*least"),
        (("response", "acceleration_per_unit"), -1, r"acceleration_per_unit is -1.0; allowed: above 0"),
        (("response", "equaliser"), [[1, 0, 0, 1, 0, 2]], r"equaliser .* allowed: stable"),
    ):
        changed = json.loads(json.dumps(raw))
        inner = changed
        for key in place[:-1]:
            inner = inner[key]
        inner[place[-1]] = value
        path.write_text(json.dumps(changed))
        with pytest.raises(BadFile, match=said):
            Profile.load(path)
    path.write_text("{")
    with pytest.raises(BadFile, match="not JSON"):
        Profile.load(path)


def test_a_folder_has_a_profile_for_some_tiles(tmp_path):
    whole().save(tmp_path / "t1.json")
    assert list(profiles_of(tmp_path, default_floor(1, 2))) == ["t1"]
    assert profiles_of("", default_floor()) == profiles_of(None, default_floor()) == {}
    with pytest.raises(BadFile, match="not a folder"):
        profiles_of(tmp_path / "none", default_floor())


def test_a_part_never_goes_into_another_tile_s_file(tmp_path):
    whole().save(tmp_path / "t1.json")
    assert load_for_tile(tmp_path / "t1.json", "t1", "A7").serial == "A7"
    with pytest.raises(BadFile, match="profile of tile t1; allowed: t2"):
        load_for_tile(tmp_path / "t1.json", "t2")
    with pytest.raises(BadFile, match="serial A7; allowed: B8"):
        load_for_tile(tmp_path / "t1.json", "t1", "B8")


# --- its history and its flags ---


def test_a_replaced_part_is_kept_with_its_figures_and_restored():
    old = fsr(error=4.0, error_unit="% of full scale", figures={"noise_n": 1.0})
    new = fsr(error=2.0, error_unit="% of full scale", figures={"noise_n": 0.5, "more": 7.0})
    profile = Profile(tile="t1").with_part(old, TODAY).with_part(new, TODAY)
    assert [(one.kind, one.replaced) for one in profile.earlier] == [("fsr", "2024-06-01")]
    assert profile.earlier[0].fsr.measured == {"error_percent": 4.0, "noise_n": 1.0}
    assert profile.fsr.measured == {"error_percent": 2.0, "noise_n": 0.5, "more": 7.0}
    back = profile.restored(0, TODAY)
    assert back.fsr == old
    assert back.earlier[0].fsr == new
    with pytest.raises(BadValue, match="place is 1"):
        profile.restored(1)
    lags = Latency(made="2024-06-01", error=0.017, error_unit="ms", figures={"jitter_ms": 0.0171}, round_trip_ms=20.0)
    assert lags.measured == {"jitter_ms": 0.0171}  # once, and under its own name
    place = Centroid(made="2024-06-01", sensors_m=SENSORS, error=4.0, error_unit="mm", figures={"mean_after_mm": 4.01})
    flat = Response(
        made="2024-06-01", frequencies_hz=(), magnitude=(), error=0.2, error_unit="dB", figures={"snr_db": 70.0}
    )
    assert place.measured == {"mean_after_mm": 4.01}
    assert flat.measured == {"flatness_measured_db": 0.2, "snr_db": 70.0}
    flat = msgspec.structs.replace(flat, figures={"flatness_computed_db": 0.2})
    assert flat.measured == {"flatness_computed_db": 0.2}


def test_a_part_is_known_by_its_day_and_the_digest_of_what_its_file_has():
    lag = Latency(made="2024-06-01", software="0.1.0", round_trip_ms=20, figures={"jitter_ms": 0.0171})
    profile = Profile.loads(Profile(tile="t1", latency=lag).dumps())
    written = json.dumps(json.loads(profile.dumps())["latency"], separators=(",", ":"))
    assert profile.latency.identity == f"2024-06-01 {hashlib.sha256(written.encode()).hexdigest()[:12]}"
    assert lag.identity == profile.latency.identity == "2024-06-01 1194c49a4013"
    parts = [msgspec.structs.replace(whole().part(kind), software="0.1.0") for kind in ("fsr", "centroid", "response")]
    digests = [part.identity.split()[1] for part in parts]
    assert digests == ["bcd9e8c9045a", "3ad7d6584a3b", "e380c84b21ae"]  # as recordings name them
    slower = msgspec.structs.replace(lag, round_trip_ms=20.001)
    assert slower.identity != lag.identity


def test_what_speaks_against_a_profile_is_said():
    profile = whole()
    assert profile.flags("t1", TODAY) == ()
    assert "profile of t1 is used on t2" in profile.flags("t2", TODAY)
    late = profile.flags("t1", date(2024, 8, 2))
    assert late == (
        "Forces of t1: measured 93 days ago; measure again after 90",
        "Places of t1: measured 92 days ago; measure again after 90",
        "Vibration of t1: measured 91 days ago; measure again after 90",
    )
    assert "after today" in profile.flags("t1", date(2024, 5, 1))[0]
    assert profile.centroid is not None
    bad = msgspec.structs.replace(profile.centroid, error=31.0, good=False)
    said = Profile(tile="t1", centroid=bad).flags("t1", TODAY)
    assert said == ("Places of t1: errs by 31 mm; 20 allowed",)
    partly = msgspec.structs.replace(profile.centroid, error=3.0, good=False)
    said = Profile(tile="t1", centroid=partly).flags("t1", TODAY)
    assert said == ("Places of t1: errs by 3 mm; 20 allowed, but not all of it is good: read its verdict",)
    rehearsed = Profile(tile="t1", centroid=msgspec.structs.replace(profile.centroid, simulated=True))
    said = Profile.loads(rehearsed.dumps()).flags("t1", TODAY)
    assert said == ("Places of t1: measured on a simulated tile; measure this one",)
    assert rehearsed.flags("t1", TODAY, simulated=True) == ()


def test_places_measured_with_forces_that_were_replaced_are_told():
    """Their verdict stood there as before, of forces that a session does not have any more."""
    profile = whole()
    assert profile.fsr is not None
    by_these = f"presses at known places; forces calibrated {profile.fsr.identity}"
    profile = profile.with_part(msgspec.structs.replace(profile.centroid, reference=by_these), TODAY)
    again = profile.with_part(fsr(line(0.02), line(), line(), line()), TODAY)
    place = next(k for k, one in enumerate(again.earlier) if one.kind == "fsr")
    assert profile.flags("t1", TODAY) == again.restored(place, TODAY).flags("t1", TODAY) == ()
    assert again.flags("t1", TODAY) == (
        "Places of t1: measured with the forces of 2024-05-01, which others have replaced since; measure again",
    )


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("fsr", "sensors", 0, "slopes", 0), float("inf"), "slopes"),
        (("fsr", "sensors", 1, "slopes", 1), -0.01, "slopes of the sign that the forces have"),
        (("fsr", "sensors", 2, "forces_n", 1), 1e300, "forces_n"),
        (("fsr", "sensors", 0, "memory", "weights", 0), float("inf"), "weights"),
        (("fsr", "sensors", 0, "rest"), float("inf"), "rest"),
        (("centroid", "sensors_m", 2, 0), 1e15, "sensors_m"),
        (("centroid", "correction", "gains", 3), float("inf"), "gains"),
        (("centroid", "correction", "displacement_m", 0, 1), 1e15, "displacement_m"),
        (("centroid", "correction", "area_m", 0, 0), float("inf"), "area_m"),
        (("response", "equaliser", 0, 1), float("inf"), "equaliser"),
        (("response", "magnitude", 0), float("inf"), "magnitude"),
    ],
)
def test_numbers_that_cannot_be_are_refused_when_a_file_is_read(path, value, said):
    compensation = Compensation(readings=(1000.0, 51000.0), forces_n=(0.0, 500.0), slopes=(0.01, 0.01))
    correction = CentroidCorrection(
        powers=((0, 0),), displacement_m=((0.001, 0.002),), area_m=((-0.1, -0.1), (0.1, -0.1), (0.0, 0.1))
    )
    profile = whole().with_part(fsr(*[line(compensation=compensation)] * 4))
    profile = profile.with_part(Centroid(made="2024-05-02", sensors_m=SENSORS, correction=correction))
    document = json.loads(profile.dumps())
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(BadFile, match=said) as error:
        Profile.loads(json.dumps(document), "t1.json")
    assert "\n" not in str(error.value)


def test_a_part_that_is_in_use_is_not_replaced_by_itself():
    once = whole()
    assert once.with_part(fsr()) == once
    assert len(once.with_part(fsr(*(compensated(),) * 4)).earlier) == 1


def test_a_plate_is_a_part_like_any_other():
    soft, stiff = (
        PlateStiffness(made="2024-05-01", positions=(0.0, 1.0), stiffness_n_mm=(40.0, most)) for most in (150.0, 160.0)
    )
    profile = Profile.loads(whole().with_part(soft).with_part(stiff).dumps())
    assert profile.plate == stiff
    erring = msgspec.structs.replace(stiff, error=0.7, error_unit="%")
    assert erring.measured == {"mean_error_percent": 0.7}  # as in its result
    assert profile.restored(0).plate == soft
    with pytest.raises(BadValue, match="stiffness_n_mm is 1; allowed: as many as positions, 2"):
        PlateStiffness(made="2024-05-01", positions=(0.0, 1.0), stiffness_n_mm=(40.0,))
