"""A plate's stiffness from footsteps whose truth is known: lines that come out, and an error of about a per cent."""

import json
import re
import runpy
import sys
from datetime import date

import msgspec
import numpy as np
import pytest
from scipy.stats import linregress

from underfoot.calibration.files.plate_profiles import read_plate_profiles, write_plate_file
from underfoot.calibration.results.plate import result_of
from underfoot.calibration.science import plate_stiffness
from underfoot.calibration.science.plate_stiffness import FootstepLine, line_of, plate_fit
from underfoot.devices.plate import PlateCalibration
from underfoot.errors import BadFile, BadMeasurement
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import PlateStiffness, Profile
from underfoot.models.gait import vertical_force
from underfoot.widgets.calibrate.part_drawings import drawings_of

TRUTH = {0.0: 40.0, 0.25: 62.0, 0.5: 90.0, 0.75: 122.0, 1.0: 160.0}


def footstep(stiffness_n_mm, random, samples=600):
    """Force of a step, and the displacement of a spring under it, with the spread of feet and sensors."""
    force = vertical_force(np.linspace(0.0, 1.0, samples), *random.uniform(500.0, 900.0, 3))
    true = stiffness_n_mm * random.normal(1.0, 0.01)
    displacement = force / true + random.normal(0.0, 0.02, samples)
    return force + random.normal(0.0, 3.0, samples), displacement


def footsteps(count=12, seed=1):
    random = np.random.default_rng(seed)
    return {(at, str(k)): footstep(k_true, random) for at, k_true in TRUTH.items() for k in range(count)}


def test_sixty_footsteps_give_the_stiffness_within_a_per_cent():
    fit = plate_fit([line_of(at, *samples) for (at, _), samples in footsteps().items()])
    found = np.array(fit.calibration.stiffness_n_mm) / list(TRUTH.values())
    assert len(fit.lines) == 60
    np.testing.assert_allclose(found, 1.0, atol=0.01)
    assert fit.calibration.error == pytest.approx(0.01, abs=0.005)
    assert fit.good


def test_a_line_is_that_of_scipy_and_is_fitted_without_what_takes_long_to_load(monkeypatch):
    force_n, displacement_mm = footstep(90.0, np.random.default_rng(1))
    expected = linregress(displacement_mm, force_n)
    monkeypatch.setitem(sys.modules, "scipy", None)
    line = runpy.run_path(plate_stiffness.__file__)["line_of"](0.5, force_n, displacement_mm)
    found = line.stiffness_n_mm, line.force_at_zero_n, line.r_squared
    assert found == pytest.approx((expected.slope, expected.intercept, expected.rvalue**2), rel=1e-12)


@pytest.mark.parametrize(("lag", "softer"), [(0, 0.0), (5, 0.01), (20, 0.07)])
def test_a_displacement_that_lags_is_warned_of(lag, softer):
    """Of 20 of 700 ms all footsteps were as much too soft, and the plate good."""
    given = {at: (force, np.roll(displacement, lag)) for at, (force, displacement) in footsteps(3).items()}
    result = result_of([line_of(at, *samples) for (at, _), samples in given.items()], [*given.values()], "made")
    found = np.array(result.part.stiffness_n_mm) / list(TRUTH.values())
    assert found == pytest.approx(np.full(5, 1.0 - softer), abs=0.03)
    assert [line[:20] for line in result.warnings] == ["displacement explain"] * (softer > 0.03)


def test_stiffness_that_falls_is_refused():
    x = np.linspace(0.0, 5.0, 100)
    lines = [line_of(0.0, 90.0 * x, x), line_of(0.5, 80.0 * x, x)]
    with pytest.raises(BadMeasurement, match=r"stiffness falls from 90\.0 to 80\.0 N/mm"):
        plate_fit(lines)
    with pytest.raises(BadMeasurement, match=r"from 90\.0 to 90\.0"):
        plate_fit([lines[0], line_of(0.5, 90.0 * x, x)])
    with pytest.raises(BadMeasurement, match="one position only"):
        plate_fit(lines[:1])
    with pytest.raises(BadMeasurement, match="are columns swapped"):
        line_of(0.5, -x, x)
    least = np.linspace(0.0, 0.2, 50)
    assert line_of(0.5, 90.0 * least, least).stiffness_n_mm == pytest.approx(90.0)
    with pytest.raises(BadMeasurement, match="49 samples over"):
        line_of(0.5, x[:49], x[:49])
    with pytest.raises(BadMeasurement, match=r"100 samples over 0\.19 mm"):
        line_of(0.5, 90.0 * x, 0.038 * x)
    with pytest.raises(BadMeasurement, match="0 samples over"):
        line_of(0.5, x[:0], x[:0])


def written(path, count):
    """The path of a table of so many footsteps at each position."""
    lines = ["position,footstep,force_n,displacement_mm"]
    for (at, k), (force, displacement) in footsteps(count).items():
        lines += [f"{at},{k},{f:.3f},{x:.5f}" for f, x in zip(force, displacement, strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_report_has_the_figures_of_earlier_calibrations_by_days(underfoot, tmp_path):
    profile, pages = tmp_path / "t1.json", []
    for day, count in enumerate((1, 2, 3), 1):
        table = written(tmp_path / "f.csv", count)
        underfoot("calibrate", "stiffness", "--footsteps", table, "--profile", profile, "--report", tmp_path / "report")
        pages.append((tmp_path / "report" / "plate.html").read_text())
        known = Profile.load(profile)
        made = msgspec.structs.replace(known.plate, made=f"2026-01-0{day}")
        msgspec.structs.replace(known, plate=made).save(profile)
    assert "Compared with" not in pages[0]
    head = re.search(r"ones before</h2>.*?<tr><th></th>((?:<th>[^<]*</th>)+)", pages[2], re.DOTALL)[1]
    assert re.findall("<th>(.*?)</th>", head) == ["2026-01-01", "2026-01-02", date.today().isoformat()]
    errors = re.search("ones before.*<tr><td>Mean error</td>(.*?)</tr>", pages[2], re.DOTALL)[1]
    assert re.fullmatch(r"<td>–</td>(<td>[\d.]+ %</td>){2}", errors)  # of a single footstep it is not known


def test_one_footstep_at_each_position_has_no_known_error(underfoot, tmp_path):
    table = written(tmp_path / "f.csv", 1)
    said = underfoot("plate", "--footsteps", table, "-o", tmp_path / "p.json", "--json")
    assert json.loads(said.out)["error"] is None
    assert not json.loads(said.out)["good"]
    assert PlateCalibration.load(tmp_path / "p.json").error is None
    assert "its error is not known" in underfoot("plate", "--footsteps", table).out
    said = underfoot("calibrate", "stiffness", "--footsteps", table, "--profile", tmp_path / "t1.json")
    assert "its error is not known" in said.out
    assert "Mean error" not in said.out
    profile = Profile.load(tmp_path / "t1.json")
    assert "Stiffness of t1: its error is not known" in profile.flags("t1", date.fromisoformat(profile.plate.made))
    assert "mean_error_percent" not in profile.plate.measured
    assert PlateCalibration.load(tmp_path / "t1.plate.json").error is None


def test_the_command_calibrates_from_a_table(underfoot, tmp_path):
    written(tmp_path / "f.csv", 3)
    said = underfoot(
        "plate", "--footsteps", tmp_path / "f.csv", "-o", tmp_path / "p.json", "--report", tmp_path / "r", "--json"
    )
    assert said.status == 0, said.error
    assert json.loads(said.out)["good"]
    assert PlateCalibration.load(tmp_path / "p.json").position(90.0) == pytest.approx(0.5, abs=0.02)
    assert (tmp_path / "r" / "plate.html").read_text().count("<svg") == 2
    assert "give --footsteps" in underfoot("plate").error


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ("0.5,1,x,2", "line 2: force_n is 'x'; allowed: a finite number"),
        ("\n0.5,1,600,inf", "line 3: displacement_mm is 'inf'; allowed: a finite number"),
        ("0.5,1,600,", "line 2: displacement_mm is ''; allowed: a finite number"),
        ("20,1,600,2", "line 2: position is 20; allowed: 0 to 1, the servo's whole way"),
    ],
)
def test_a_footstep_that_is_refused_says_what_was_given(rows, words, tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text(f"position,footstep,force_n,displacement_mm\n{rows}\n")
    with pytest.raises(BadFile) as refused:
        read_plate_profiles(path)
    assert str(refused.value) == f"{path}, {words}"


def test_a_table_of_footsteps_without_a_column_says_which(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("position,footstep,force,displacement_mm\n0.5,1,600,2\n")
    with pytest.raises(BadFile, match="has no column force_n; allowed: a CSV with the columns position, footstep"):
        read_plate_profiles(path)


@pytest.mark.parametrize(("stiffer", "good"), [(1.04, True), (1.06, False)])
def test_errors_are_told_in_percent_and_three_are_allowed(stiffer, good):
    """One of three lines is stiffer than two that agree: by the share, and those are off the mean of the others."""
    lines = [
        FootstepLine(at, stiffness * factor, 0.0, 1.0)
        for at, stiffness in ((0.0, 50.0), (1.0, 100.0)) for factor in (1.0, 1.0, stiffer)
    ]  # fmt: skip
    samples = [(np.linspace(0.0, 500.0, 20), np.linspace(0.0, 500.0, 20) / line.stiffness_n_mm) for line in lines]
    result = result_of(lines, samples, "a load cell")
    part = result.apply(Profile(tile="t1")).plate
    in_use = drawings_of(default_floor().tiles[0], part)[0]
    assert in_use.y_log, "as it is interpolated"
    assert result.drawings[0].y_log
    others = (stiffer - 1.0) / (0.5 + 0.5 * stiffer) / 2.0
    mean_percent = 100 * ((stiffer - 1.0) + 2.0 * others) / 3.0
    assert (part.error, part.error_allowed, part.good) == (pytest.approx(mean_percent, rel=0.02), 3.0, good)
    assert part.figures["worst_error_percent"] == pytest.approx(100 * (stiffer - 1.0), rel=0.01)
    assert ("That is more than 3 %" in result.verdict) is not good


def test_the_error_in_the_file_for_studies_is_a_share(tmp_path):
    positions, stiffness_n_mm = (0.0, 1.0), (40.0, 160.0)
    part = PlateStiffness(
        made="2024-05-01", error=1.2, error_unit="%", positions=positions, stiffness_n_mm=stiffness_n_mm
    )
    path = write_plate_file(Profile(tile="t1").with_part(part), tmp_path / "t1.json")
    assert PlateCalibration.load(path).error == pytest.approx(0.012)
