"""Body weights that are noted in recordings: typed, or of a standing phase, and forces in percent of them."""

import csv
import json
import sqlite3
from contextlib import closing

import h5py
import pytest
from stood_and_walked import FIRST_STEP_S, PEAK, stood_and_walked

from underfoot import read_forces
from underfoot.errors import BadFile
from underfoot.records.recording import Recording


@pytest.fixture
def paths(folder):
    """Recordings of two people of 500 and 800 N, who walk alike."""
    return [stood_and_walked(folder / f"{name}.underfoot", weight_n) for name, weight_n in (("ann", 500), ("bo", 800))]


def listed(underfoot, path):
    return list(csv.DictReader(underfoot("steps", path).out.splitlines()))


def test_people_of_different_weight_are_compared_in_percent_of_it(underfoot, paths, folder):
    said = underfoot("steps", paths[0], "--body-weight", "standing").out
    assert said.startswith("body weight of who walks: 500.")
    stood_s = float(said.partition("standing at ")[2].partition(" ")[0])
    assert 0.3 <= stood_s <= FIRST_STEP_S - 2.0
    underfoot("steps", paths[1], "--body-weight", "81.577 kg")
    with Recording(paths[1]) as recording:
        (noted,) = recording.body_weights()
        assert (noted.person, noted.weight_n, noted.source) == (0, pytest.approx(800.0, abs=0.01), "typed")
    groups = json.loads(underfoot("compare", *paths, "-o", "both.csv", "--json").out)
    one, other = (group["measures"] for group in groups)
    assert other["peak1_n"]["difference_percent"] == pytest.approx(60.0, abs=0.2)
    for measure in ("peak1_percent_bw", "valley_percent_bw", "impulse_percent_bw_s", "loading_percent_bw_per_s"):
        assert one[measure]["count"] == other[measure]["count"] == 8
        assert other[measure]["difference_percent"] == pytest.approx(0.0, abs=0.5)
    assert one["peak1_percent_bw"]["mean"] == pytest.approx(100.0 * PEAK, rel=0.01)
    assert one["impulse_percent_bw_s"]["mean"] == pytest.approx(100.0 * one["impulse_ns"]["mean"] / 500.0, rel=0.005)
    assert one["loading_percent_bw_per_s"]["mean"] == pytest.approx(
        1e5 * one["loading_kn_s"]["mean"] / 500.0, rel=0.005
    )
    with (folder / "both.stance.csv").open(newline="") as file:
        middle = list(csv.DictReader(file))[50]
    assert float(middle["ann mean_percent_bw"]) == pytest.approx(float(middle["bo mean_percent_bw"]), rel=0.005)
    assert float(middle["bo mean_n"]) == pytest.approx(8.0 * float(middle["bo mean_percent_bw"]), rel=1e-4)


def test_every_table_of_a_recording_has_what_is_noted_of_its_steps(underfoot, paths, folder):
    path = paths[0]
    underfoot("steps", path, "--body-weight", "500 N")
    underfoot("steps", path, "2", "--leave-out", "stumbled")
    table = underfoot("steps", path).out
    told = underfoot("monitor", path, "--steps", "told.csv")
    for name in ("ann.csv", "ann.h5"):
        underfoot("export", path, "-o", name)
    assert (folder / "told.csv").read_text() == (folder / "ann.steps.csv").read_text() == table
    lines = list(csv.DictReader(table.splitlines()))
    of_script = read_forces(path).steps()
    assert ([*of_script], of_script["left_out"].tolist()) == ([*lines[0]], [line["left_out"] for line in lines])
    impulse = [float(line["impulse_percent_bw_s"]) for line in lines]
    assert impulse == pytest.approx([float(line["impulse_ns"]) / 5.0 for line in lines], abs=0.01)
    assert of_script["impulse_percent_bw_s"] == pytest.approx(impulse, abs=0.01)
    with h5py.File(folder / "ann.h5") as file:
        peaks = file["steps/peak1_percent_bw"]
        assert (peaks[:], peaks.attrs["unit"]) == (pytest.approx(100.0 * PEAK, rel=0.01), "% of body weight")
    assert told.out.splitlines()[1].endswith("  left out: stumbled")
    assert told.error.startswith("underfoot: person 2: 6 steps, ")  # as in the window, not 7
    figures = json.loads(underfoot("monitor", path, "--json").out.splitlines()[1])
    assert ([*figures], figures["left_out"], figures["body_weight_n"]) == ([*lines[0]], "stumbled", 500.0)
    assert underfoot("steps", path, "--body-weight", " ").out == "no body weight is noted\n"
    assert {line["body_weight_n"] for line in listed(underfoot, path)} == {""}


def test_feet_that_stand_too_briefly_for_no_step_are_left_out_with_the_weight_they_give(underfoot, folder):
    path = stood_and_walked(folder / "ann.underfoot", 500, stands_s=3.0, stops_s=2.5)
    assert len(listed(underfoot, path)) == 12
    said = underfoot("steps", path, "--body-weight", "standing").out
    assert said.startswith("left out: 1, 2, 11, 12 (standing)\nbody weight of who walks: 500.")
    assert [line["left_out"] for line in listed(underfoot, path)] == ["standing"] * 2 + [""] * 8 + ["standing"] * 2


def test_a_weight_of_a_person_stands_before_that_of_all(underfoot, paths):
    underfoot("steps", paths[0], "--body-weight", "700 N")
    underfoot("steps", paths[0], "--body-weight", "500 N", "--person", "2")
    found = {(line["person"], line["body_weight_n"]) for line in listed(underfoot, paths[0])}
    assert found == {("1", "700.0"), ("2", "500.0")}  # whoever stood counts as another
    told = underfoot("steps", paths[0], "--body-weight", "").out
    assert told == "body weight of person 2: 500.0 N (typed)\n"  # which still counts


def test_a_weight_that_cannot_be_is_refused_with_what_is_allowed(underfoot, refused, paths):
    assert listed(underfoot, paths[0])  # what has to be compiled is told, beside an error
    steps = "steps", paths[0]
    assert "'75'; allowed: with its unit, such as 71.4 kg" in refused(*steps, "--body-weight", "75")
    assert "'750 kg'; allowed: 3 to 500 kg" in refused(*steps, "--body-weight", "750 kg")
    assert "has no person 3; allowed: 1, 2" in refused(*steps, "--body-weight", "75 kg", "--person", "3")
    assert "allowed: --body-weight, also with --person, and no STEP" in refused(*steps, "--person", "1")
    assert "and no STEP" in refused(*steps, "2", "--body-weight", "75 kg")
    walked = stood_and_walked(paths[0].with_name("walked.underfoot"), 500, stands_s=1.5)
    assert listed(underfoot, walked)  # nor does the search for its steps add a line, on a busy machine
    assert "nobody stands still for 2 s in " in refused("steps", walked, "--body-weight", "standing")
    with Recording(paths[0]) as recording:
        recording.note_body_weight(0, 700.0, "typed")
    with closing(sqlite3.connect(paths[0])) as base, base:
        base.execute("update body_weight set weight_n = 0.0")
    with Recording(paths[0]) as recording, pytest.raises(BadFile, match="table body_weight cannot be read"):
        recording.notes()
