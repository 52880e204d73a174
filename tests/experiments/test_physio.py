"""Force and vibration of trials as BIDS recordings: names by BIDS's own validator, values as they were kept."""

import gzip
import json
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from made_studies import first_answers, made_protocol

from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.physio import write_physio
from underfoot.experiments.store import SessionFile
from underfoot.experiments.table import rows_of
from underfoot.experiments.trial_files import write_bids
from underfoot.studies.results import written_files

RNG = np.random.default_rng(3)
FORCE = np.abs(RNG.normal(300.0, 50.0, (40, 4)))
FORCE[3, 1] = np.nan  # a sample that was lost
VIBRATION = RNG.normal(0.0, 0.4, (960, 1))
CORNERS = tuple(f"t1.{k}" for k in range(1, 5))


@pytest.fixture
def exported(tmp_path):
    """The folder of a session of two trials, each with its recordings."""
    protocol = made_protocol("rating", {"blocks": 1})
    file = SessionFile.create(tmp_path / "p-1.session", protocol, "p-1")
    study = file.study(protocol)
    while not study.is_done:
        excerpts = [Excerpt("force", 0, 1.5, 1000.0, CORNERS, FORCE),
                     Excerpt("vibration", 0, 1.25, 48_000.0, ("t1",), VIBRATION),
                     Excerpt("vibration", 1, 2.25, 48_000.0, (), np.zeros((9, 0))),
                     Excerpt("measured", 1, 2.25, 48_000.0, ("t1",), 0.9 * VIBRATION)]  # fmt: skip
        file.add(study.answer(first_answers(study.page)), excerpts)
        file.add_note("calibrations in use: t1: Forces 2026-05-01 0f3c9a1b2d4e")  # as one went on another day
    write_bids(tmp_path / "b", rows_of(protocol, "p-1", file.entries()), "Two trials", protocol)
    assert not write_physio(tmp_path / "b", file, "Two trials")
    file.close()
    return tmp_path / "b"


def read(path):
    """A recording as BIDS readers do, and its sidecar."""
    sidecar = json.loads(path.with_name(path.name.replace(".tsv.gz", ".json")).read_text())
    text = gzip.decompress(path.read_bytes()).decode()
    assert "nan" not in text  # which Python reads, and BIDS does not know
    rows = [[np.nan if cell == "n/a" else float(cell) for cell in line.split("\t")] for line in text.splitlines()]
    return np.array(rows), sidecar


def test_every_name_is_one_that_bids_knows(exported):
    valid = pytest.importorskip("bids_validator").BIDSValidator()
    files = [path for path in exported.rglob("*") if path.is_file()]
    assert [path for path in files if not valid.is_bids(f"/{path.relative_to(exported)}")] == []


def test_recordings_are_what_was_kept_and_their_sidecars_say_what_they_are(exported):
    beh = exported / "sub-p1" / "beh"
    names = sorted(path.name.split("recording-")[1].split("_")[0] for path in beh.glob("*.gz"))
    assert names == ["commanded0001", "commanded0002", "force0001", "force0002", "measured0001b", "measured0002b"]
    force, about = read(beh / "sub-p1_task-Twotrials_recording-force0001_physio.tsv.gz")
    np.testing.assert_allclose(force, FORCE, rtol=1e-4)
    assert (about["SamplingFrequency"], about["StartTime"], about["Columns"]) == (1000.0, 1.5, list(CORNERS))
    assert (about["t1.1"]["Units"], about["PhysioType"]) == ("N", "generic")
    assert about["TaskName"] == "Two trials"
    assert "Calibrations" not in about
    measured, about = read(beh / "sub-p1_task-Twotrials_recording-measured0002b_stim.tsv.gz")
    np.testing.assert_allclose(measured, 0.9 * VIBRATION, atol=1e-4)
    assert (about["SamplingFrequency"], about["StartTime"], about["t1"]["Units"]) == (48_000.0, 2.25, "m/s^2")
    assert about["Calibrations"] == "t1: Forces 2026-05-01 0f3c9a1b2d4e"
    assert "PhysioType" not in about, "a stimulus is none"


@pytest.mark.parametrize(
    ("damage", "why"),
    [
        ("data = substr(data, 1, 99)", "a stretch is cut short, or too large"),
        ("part = 26", "Expected `int` <= 25 - at `$[0]`"),
        ("columns = '[]'", "a stretch has (4,) columns, and names 0"),
    ],
)
def test_a_damaged_recording_of_one_trial_takes_no_other_from_the_data_set(tmp_path, damage, why):
    protocol, path = made_protocol("rating", {"blocks": 1}), tmp_path / "p-1.session"
    with closing(SessionFile.create(path, protocol, "p-1")) as file:
        for _ in range(2):
            file.add(file.study(protocol).answer({"rating": 4}), [Excerpt("force", 0, 1.5, 1000.0, CORNERS, FORCE)])
    with closing(sqlite3.connect(path)) as base, base:
        base.execute(f"update stretch set {damage} where entry = 1")
    (told,) = written_files([path], "BIDS", tmp_path / "b", Settings(), protocol)
    assert told.remarks[1] == (
        f"Written without force and vibration of entry 1: {path}: table stretch cannot be read: {why}."
    )
    assert [found.name[28:37] for found in (tmp_path / "b").rglob("*.tsv.gz")] == ["force0002"]


def test_the_behavioural_file_says_which_recording_is_whose(exported):
    lines = (exported / "sub-p1" / "beh" / "sub-p1_task-Twotrials_beh.tsv").read_text().splitlines()
    place = lines[0].split("\t").index("entry")
    assert [line.split("\t")[place] for line in lines[1:]] == ["1", "2"]


def test_participants_are_listed_with_what_was_asked_of_them(tmp_path):
    rows = [
        {"participant": "P-1", "trial": 1, "participant.age": 31},
        {"participant": "P2", "trial": 1, "participant.age": 40, "participant.shoe_eu": 42.5},
        {"participant": "P2", "trial": 2, "participant.age": 40, "participant.shoe_eu": 42.5},
    ]
    write_bids(tmp_path, rows, "Two")
    listed = (tmp_path / "participants.tsv").read_text().splitlines()
    assert listed == ["participant_id\tage\tshoe_eu", "sub-P1\t31\tn/a", "sub-P2\t40\t42.5"]
