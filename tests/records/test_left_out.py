"""Steps that a person leaves out of a recording: kept in its file, told by exports, and passed over by means."""

import csv
import json
import sqlite3
import statistics
from contextlib import closing

import ezc3d
import h5py
import numpy as np
import pytest
from earlier_recordings import make_earlier
from long_recording import write_recording
from made_steps import STEP
from msgspec.structs import replace
from scipy.io import loadmat

from underfoot.errors import BadFile
from underfoot.floor.gait_summary import gait_of
from underfoot.floor.layout import default_floor
from underfoot.records.comparison import compared
from underfoot.records.recording import Recording
from underfoot.records.survey import Stance

WHY = 'stumbled, "a bit"'


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A recording of somebody who walks, of which nothing is left out."""
    return write_recording(tmp_path_factory.mktemp("walked") / "walk.underfoot", 8.0, default_floor(1, 2))


@pytest.fixture
def path(whole, folder):
    """A copy of it."""
    made = folder / "walk.underfoot"
    made.write_bytes(whole.read_bytes())
    return made


def listed(underfoot, path):
    return list(csv.DictReader(underfoot("steps", path).out.splitlines()))


def test_a_step_is_left_out_with_a_reason_and_taken_in_again(underfoot, refused, path, folder):
    before = listed(underfoot, path)
    assert underfoot("steps", path, "3", "4", "3", "--leave-out", f"  {WHY}\n").out == f"left out: 3, 4 ({WHY})\n"
    after = listed(underfoot, path)
    assert [line["left_out"] for line in after[:5]] == ["", "", WHY, WHY, ""]
    assert [{**line, "left_out": ""} for line in after] == before  # nothing that was measured is lost
    with Recording(path) as recording:
        first, second = recording.left_out()
        assert (first.tile, first.frame / 48_000) == (before[2]["tile"], pytest.approx(float(before[2]["start_s"])))
        assert (first.who, first.when[:2]) == (second.who, "20")
    underfoot("steps", path, "4", "--leave-out", "")
    assert [line["left_out"] for line in listed(underfoot, path)[2:4]] == [WHY, ""]
    assert "has no step 99; allowed: 1 to " in refused("steps", path, "3", "99", "--leave-out", WHY)
    assert "--leave-out needs the steps" in refused("steps", path, "--leave-out", WHY)
    (folder / "walk.csv").write_text("time_s,t1.1,t1.2,t1.3,t1.4\n")
    assert "is not a recording; allowed: one (`underfoot monitor" in refused("steps", folder / "walk.csv")


def test_exports_keep_a_step_that_is_left_out_and_say_why(underfoot, path, folder):
    underfoot("steps", path, "3", "--leave-out", WHY)
    for name in ("walk.csv", "walk.h5", "walk.mat", "walk.c3d"):
        underfoot("export", path, "-o", name, "--from", "1", "--to", "7")
    with (folder / "walk.steps.csv").open(newline="") as file:
        expected = {int(line["step"]): line["left_out"] for line in csv.DictReader(file)}
    assert {number: why for number, why in expected.items() if why} == {3: WHY}
    with h5py.File(folder / "walk.h5") as file:
        steps = file["steps"]
        assert dict(zip(steps["step"][:].tolist(), steps["left_out"].asstr()[:], strict=True)) == expected
    steps = loadmat(folder / "walk.mat", simplify_cells=True)["steps"]
    told = {int(k): str(why) if np.size(why) else "" for k, why in zip(steps["step"], steps["left_out"], strict=True)}
    assert told == expected
    events = ezc3d.c3d(str(folder / "walk.c3d"))["parameters"]["EVENT"]["DESCRIPTIONS"]["value"]
    assert [text for text in events if "left out" in text] == [f"step 3, tile t2, left out: {WHY}"] * 2


def test_a_comparison_passes_over_a_step_that_is_left_out_and_what_is_measured_from_it(underfoot, path, folder):
    other = folder / "other.underfoot"
    other.write_bytes(path.read_bytes())
    underfoot("steps", path, "3", "--leave-out", WHY)
    lines = listed(underfoot, path)
    first, second = json.loads(underfoot("compare", path, other, "--json").out)
    assert (first["steps"], second["steps"]) == (len(lines) - 1, len(lines))
    passed = {"peak1_n": {2}, "cadence_per_min": {2, 3}, "step_length_mm": {2, 3}, "swing_ms": {2, 4}}
    for measure, places in passed.items():
        known = [float(line[measure]) for k, line in enumerate(lines) if k not in places and line[measure]]
        assert first["measures"][measure]["count"] == len(known)
        assert first["measures"][measure]["mean"] == pytest.approx(statistics.mean(known), abs=1e-3)
    assert first["stance"]["count"] == len(lines) - 1


def test_steps_beside_one_that_is_left_out_are_no_neighbours():
    """Of 40 strides of 1.2 s one person hesitates at one step: two strides, of 1.7 s. Left out, nothing varies."""
    walked = [
        replace(STEP, step=k, start_s=0.6 * k, side=("left", "right")[k % 2], cadence_per_min=100.0) for k in range(42)
    ]
    walked[20] = replace(walked[20], cadence_per_min=60.0 / 1.1, contact_ms=1100.0)
    (gait,) = gait_of(walked)
    assert gait.stride_variation_percent > 5.0
    walked[20] = replace(walked[20], left_out=WHY)
    (gait,) = gait_of(walked)
    assert (gait.steps, gait.stance_ms) == (41, pytest.approx(STEP.contact_ms))
    assert gait.stride_variation_percent == pytest.approx(0.0, abs=1e-6)
    alone = [Stance(replace(STEP, side="left", left_out=WHY), ()), Stance(replace(STEP, side="right"), (1.0,) * 101)]
    assert [group.name for group in compared({"walk": alone}, "side")] == ["right"]


def test_a_file_of_an_earlier_version_takes_a_step_that_is_left_out_and_a_damaged_entry_is_named(path):
    make_earlier(path, 1)
    with Recording(path) as recording:
        assert recording.left_out() == []
        with Recording(path) as other:  # as of another window
            other.leave_out([(48_000, "t1")], "stumbled")
        assert [one.why for one in recording.left_out()] == ["stumbled"]
        recording.leave_out([(48_100, "t1")], "turned")  # the same step, as another version finds it
        assert [(one.frame, one.why) for one in recording.left_out()] == [(48_100, "turned")]
    with closing(sqlite3.connect(path)) as base, base:
        base.execute("update left_out set frame = 'soon'")
    with Recording(path) as recording, pytest.raises(BadFile, match="table left_out cannot be read"):
        recording.left_out()
