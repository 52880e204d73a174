"""Recordings, feet and persons compared."""

import csv
import json
import math
import statistics

import numpy as np
import pytest
from made_steps import SPIKE, STEP
from msgspec.structs import replace

from underfoot.floor.gait_summary import gait_of
from underfoot.records.comparison import compared, comparison_csv, comparison_drawing, stance_csv
from underfoot.records.survey import Stance


def walked(contact_ms, person=1, sides=("left", "right")):
    """Steps of one person, one after the other; their force is their number in newtons."""
    return [
        Stance(replace(STEP, contact_ms=ms, person=person, side=sides[k % len(sides)]), (float(k),) * 101)
        for k, ms in enumerate(contact_ms)
    ]


def test_figures_are_those_of_the_steps_in_which_a_measure_is_known():
    before, after = [600.0, 610.0, float("nan"), 650.0], [700.0, 720.0]
    first, second = compared({"before": walked(before), "after": walked(after)})
    known = [ms for ms in before if ms == ms]
    one, other = first.figures["contact_ms"], second.figures["contact_ms"]
    assert (one.count, first.steps, first.persons) == (3, 4, 1)
    assert one.mean == pytest.approx(statistics.mean(known))
    assert one.sd == pytest.approx(statistics.stdev(known))
    assert other.difference == pytest.approx(710.0 - 620.0)
    assert other.difference_percent == pytest.approx(100.0 * 90.0 / 620.0)
    np.testing.assert_allclose(first.stance.mean, 1.5)
    np.testing.assert_allclose(first.stance.sd, statistics.stdev(range(4)))
    # Contacts of 600 and 630 ms on average: the difference over their mean; too few strides for a variation.
    assert first.figures["stance_asymmetry_percent"].mean == pytest.approx(100.0 * 30.0 / 615.0)
    assert not first.figures["stride_variation_percent"].count
    assert np.isnan(second.figures["double_support_ms"].difference_percent)
    (heels,) = compared({"heels": [Stance(STEP, ()), Stance(SPIKE, ())]})
    loading = heels.figures["loading_kn_s"]
    assert (heels.steps, heels.figures["peak1_n"].count, loading.count, loading.mean) == (2, 2, 1, 8.61)


def test_feet_and_persons_of_each_recording_are_groups_and_who_is_not_known_is_left_out():
    steps = [*walked([600.0] * 4), *walked([650.0] * 2, person=2), *walked([900.0], 0, ("unknown",))]
    whole = {"a, b": steps, "c": walked([500.0])}
    assert [(group.name, group.steps) for group in compared(whole, "side")] == [
        ("a, b, left", 3), ("a, b, right", 3), ("c, left", 1)
    ]  # fmt: skip
    assert [group.name for group in compared({"a": steps}, "person")] == ["person 1", "person 2"]
    groups = compared(whole, "person")
    assert all(not group.figures["stance_asymmetry_percent"].count for group in compared(whole, "side"))
    head, *lines = csv.reader(comparison_csv(groups).splitlines())
    assert head[:5] == ["measure", "a, b, person 1 n", "a, b, person 1 mean", "a, b, person 1 SD",
                        "a, b, person 2 n"]  # fmt: skip
    assert next(line for line in lines if line[0] == "contact_ms") == [
        "contact_ms", "4", "600", "0", "2", "650", "0", "50", "8.33333", "1", "500", "", "-100", "-16.6667"
    ]  # fmt: skip
    assert stance_csv(groups).splitlines()[-1] == "100,1.5,1.29099,0.5,0.707107,0,"
    # A mean of one step has no band.
    drawn = comparison_drawing(groups).series
    assert [one.style for one in drawn] == ["band", "band", "line", "line", "line"]
    names = [group.name for group in groups]
    assert [one.name for one in drawn] == [*(f"{name} ± 1 SD" for name in names[:2]), *names]  # in saved data
    assert [one.name for one in drawn if one.has_key] == names
    np.testing.assert_array_equal([drawn[0].y, drawn[0].spread], [groups[0].stance.mean, groups[0].stance.sd])
    many = comparison_drawing([groups[0]] * 5)  # five bands would hide the means
    assert [one.style for one in many.series] == ["line"] * 5
    assert many.y == "mean force, N"


def test_length_and_width_are_those_of_steps_that_are_not_beside_a_turn():
    """Somebody who walks to and fro stops before each turn, and sets off wide after it."""
    way = [(650.0, 100.0), (650.0, 102.0), (650.0, 98.0), (90.0, 110.0), (math.nan, math.nan), (655.0, 200.0)]
    steps = [
        replace(
            one.step, start_s=0.5 * k, cadence_per_min=120.0, step_length_mm=way[k % 6][0], step_width_mm=way[k % 6][1]
        )
        for k, one in enumerate(walked([600.0] * 30))
    ]
    (group,) = compared({"walk": [Stance(step, ()) for step in steps]})
    length, width = group.figures["step_length_mm"], group.figures["step_width_mm"]
    assert (length.count, length.mean, length.sd) == (15, 650.0, 0.0)
    assert (width.count, width.mean) == (15, 100.0)
    (gait,) = gait_of(steps)
    assert (gait.step_length_mm, gait.step_width_mm) == pytest.approx((650.0, 100.0))
    assert group.figures["length_asymmetry_percent"].mean == gait.length_asymmetry_percent == 0.0
    counts = [
        compared({"walk": [Stance(step, ()) for step in some]})[0].figures["step_length_mm"].count
        for some in (steps[:6], steps[3:6])
    ]
    assert counts == [3, 2], "of three steps on the way, and of two beside a turn where there is no other"


@pytest.fixture
def heavier(walk, folder):
    """The walk again, with a load on the back: a tenth more force."""
    table = np.loadtxt(walk, delimiter=",", skiprows=1)
    table[:, 1:] *= 1.1
    path = folder / "loaded" / "walk.csv"
    path.parent.mkdir()
    np.savetxt(path, table, "%.6f", ",", header=walk.read_text().partition("\n")[0], comments="")
    (path.parent / "walk.floor.json").write_bytes((folder / "walk.floor.json").read_bytes())
    return path


def test_two_walks_are_compared_on_the_command_line(underfoot, walk, heavier, folder):
    said = underfoot("compare", walk, heavier, "--json", "-o", "both.csv")
    first, second = json.loads(said.out)
    assert [group["name"] for group in (first, second)] == [f"{folder.name}/walk", "loaded/walk"]
    assert (first["steps"], second["steps"]) == (2, 2)
    assert second["measures"]["peak1_n"]["difference_percent"] == pytest.approx(10.0, abs=0.05)
    assert max(second["stance"]["mean_n"]) == pytest.approx(1.1 * max(first["stance"]["mean_n"]), rel=1e-3)
    lines = csv.DictReader((folder / "both.csv").read_text().splitlines())
    shown = next(line for line in lines if line["measure"] == "peak1_n")
    assert float(shown["loaded/walk mean"]) == pytest.approx(second["measures"]["peak1_n"]["mean"], rel=1e-5)
    assert len((folder / "both.stance.csv").read_text().splitlines()) == 102
    head, *lines = underfoot("compare", walk, heavier, "corridor").out.splitlines()
    assert head.split() == [f"{folder.name}/walk", "loaded/walk", "corridor"]
    (line,) = (line for line in lines if line.startswith("peak1_n"))
    assert " +10.0 %  " in line


def test_what_cannot_be_compared_is_said_before_anything_is_written(refused, walk, heavier, folder):
    assert "is one recording; allowed: two or more, or --by side" in refused("compare", walk, "-o", "a.csv")
    assert "is given twice" in refused("compare", walk, folder / "loaded" / ".." / "walk.csv")
    assert "tables are CSV" in refused("compare", walk, heavier, "-o", "a.xlsx")
    assert "is given twice" in refused("compare", walk, heavier, "-o", walk)
    assert "--by person gives nothing to compare" in refused("compare", walk, "--by", "person", "-o", "a.csv")
