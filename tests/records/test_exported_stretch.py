"""A stretch of a recording is exported to every format: its samples, and the steps and marks within, from 0 s on."""

import csv
import math
from dataclasses import replace

import ezc3d
import h5py
import numpy as np
import pytest
import soundfile
from click.testing import CliRunner
from long_recording import write_recording
from scipy.io import loadmat

from underfoot.__main__ import cli
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.step_finder import find_steps
from underfoot.records.exports import DECIDED_S, ExportSource, write_export
from underfoot.records.force_files import read_force_file
from underfoot.records.forces import read_forces
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer
from underfoot.records.survey import cache_survey, cached_files, survey

FLOOR = default_floor(1, 2)
SECONDS = 12.0
RATE = 48_000


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Somebody who walks, with a mark in each second."""
    made = write_recording(tmp_path_factory.mktemp("exported") / "walk.underfoot", SECONDS, FLOOR)
    with Recording(made) as recording:
        for second in range(12):
            recording.add_mark(second * RATE, f"second {second}")
    return made


@pytest.fixture(scope="module")
def recorded(path):
    """Times, corner forces and steps of the whole recording."""
    with Recording(path) as recording:
        rows = recording.force_samples()
    time_s, force_n = rows[:, 0] / RATE, rows[:, 2:].reshape(len(rows), -1, 4)
    steps = [step for found in find_steps([(time_s, force_n)], FLOOR, 1000.0) for step in found.steps]
    return time_s, force_n, steps


@pytest.fixture(scope="module")
def stretch(recorded):
    """From the middle of the third step to the end of the fifth, which is known by what comes after."""
    begin, end = round(recorded[2][2].start_s + 0.3, 2), math.ceil(100.0 * recorded[2][4].end_s) / 100.0
    assert end + DECIDED_S < SECONDS
    return begin, end


@pytest.fixture(scope="module")
def whole_steps(recorded, stretch):
    """The steps that begin and end in the stretch."""
    begin, end = stretch
    found = [step for step in recorded[2] if begin <= step.start_s and step.start_s + 1e-3 * step.contact_ms <= end]
    assert 2 <= len(found) < len(recorded[2])
    return found


@pytest.fixture
def exported(path, stretch, tmp_path):
    def export(name, *options):
        ends = ("--from", str(stretch[0]), "--to", str(stretch[1]))
        done = CliRunner().invoke(cli, ["export", str(path), "-o", str(tmp_path / name), *ends, *options])
        assert done.exception is None, done.exception
        return tmp_path / name

    return export


def within(recorded, stretch):
    """Times from the stretch's beginning, and forces."""
    time_s, force_n, _ = recorded
    kept = (time_s >= stretch[0]) & (time_s < stretch[1])
    return time_s[kept] - stretch[0], force_n[kept]


def test_csv(exported, recorded, stretch, whole_steps):
    output = exported("walk.csv")
    forces, _ = read_force_file(output)
    time_s, force_n = within(recorded, stretch)
    np.testing.assert_allclose(forces.time_s, time_s, atol=1e-9)
    np.testing.assert_array_equal(forces.force_n, force_n)
    with output.with_name("walk.steps.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["step"]) for row in rows] == [step.step for step in whole_steps]
    assert [row["side"] for row in rows] == [step.side for step in whole_steps]
    starts_s = [step.start_s - stretch[0] for step in whole_steps]
    np.testing.assert_allclose([float(row["start_s"]) for row in rows], starts_s, atol=1e-6)
    np.testing.assert_allclose([float(row["peak1_n"]) for row in rows], [s.peak1_n for s in whole_steps], atol=1e-3)
    with output.with_name("walk.marks.csv").open() as file:
        marks = [(float(row["time_s"]), row["text"]) for row in csv.DictReader(file)]
    seconds = [second for second in range(12) if stretch[0] <= second < stretch[1]]
    assert marks == [(pytest.approx(second - stretch[0], abs=1e-6), f"second {second}") for second in seconds]
    with output.with_name("walk.contacts.csv").open() as file:
        contacts = list(csv.DictReader(file))
    assert float(contacts[0]["time_s"]) == 0.0  # a contact that is cut has its samples in the stretch
    assert float(contacts[-1]["time_s"]) == pytest.approx(stretch[1] - stretch[0], abs=2e-3)
    with output.with_name("walk.stretch.csv").open() as file:
        [told] = csv.DictReader(file)
    assert float(told["from_s"]) == stretch[0]
    assert float(told["length_s"]) == pytest.approx(stretch[1] - stretch[0])


def test_a_script_reads_it_alone(path, recorded, stretch):
    forces = read_forces(path, stretch_s=stretch)
    rows = (recorded[0] >= stretch[0]) & (recorded[0] < stretch[1])
    np.testing.assert_array_equal(forces.time_s, recorded[0][rows])
    np.testing.assert_array_equal(forces.force_n, recorded[1][rows])
    with Recording(path) as recording:
        recording.note_body_weight(0, 700.0, "typed")
        recording.note_body_weight(1, 800.0, "typed")
    whole_n, stretch_n = (set(read_forces(path, stretch_s=s).steps()["body_weight_n"]) for s in (None, (0.0, 6.0)))
    assert (whole_n, stretch_n) == ({800.0}, {700.0})  # who is person 1 in the stretch can be another one
    with Recording(path) as recording:
        for person in (0, 1):
            recording.note_body_weight(person, math.nan, "")
    for other in ((2.0, 1.0), (1.0,), "soon", ((1.0, 2.0), (3.0, 4.0)), (math.nan, 2.0)):
        with pytest.raises(BadValue, match=r"stretch_s is .*; allowed: two seconds, the first below the second"):
            read_forces(path, stretch_s=other)


def test_wav(exported, path, stretch):
    with soundfile.SoundFile(exported("walk.wav", "--vibration", "commanded")) as file:
        samples = file.read(dtype="float32")
        assert file.comment == f"from_s={stretch[0]:g}: seconds of the recording before"
    first, end = (round(second * RATE) for second in stretch)
    with Recording(path) as recording:
        np.testing.assert_array_equal(samples, recording.acceleration("commanded")[1][first:end])


def test_hdf5_and_mat(exported, path, recorded, stretch, whole_steps):
    time_s, force_n = within(recorded, stretch)
    first, end = (round(second * RATE) for second in stretch)
    with h5py.File(exported("walk.h5")) as file, Recording(path) as recording:
        assert file.attrs["from_s"] == stretch[0]
        np.testing.assert_allclose(file["force/time_s"], time_s, atol=1e-9)
        assert np.isin(file["contacts/time_s"], file["force/time_s"]).all()
        np.testing.assert_array_equal(file["force/corners_n"], force_n)
        np.testing.assert_array_equal(file["vibration/vibration"], recording.vibration()[1][first:end])
        np.testing.assert_array_equal(file["steps/step"], [step.step for step in whole_steps])
        assert file["marks/time_s"].shape == file["marks/text"].shape
    content = loadmat(exported("walk.mat"), simplify_cells=True)
    assert content["from_s"] == stretch[0]
    np.testing.assert_array_equal(content["corners_n"], force_n)
    np.testing.assert_allclose(content["steps"]["contact_ms"], [step.contact_ms for step in whole_steps], rtol=1e-12)
    assert len(content["measured_m_s2"]) == end - first


def test_c3d(exported, recorded, stretch, whole_steps):
    content = ezc3d.c3d(str(exported("walk.c3d")))
    time_s, force_n = within(recorded, stretch)
    count = len(time_s) // 10 * 10
    sums = -content["data"]["analogs"][0].reshape(2, 8, -1)[:, 4:].sum(axis=1)
    np.testing.assert_allclose(sums.T, force_n[:count].sum(axis=2), atol=1e-3)
    events = content["parameters"]["EVENT"]
    times_s = 60.0 * events["TIMES"]["value"][0] + events["TIMES"]["value"][1]
    strikes_s = [at for at, label in zip(times_s, events["LABELS"]["value"], strict=True) if label == "Foot Strike"]
    np.testing.assert_allclose(strikes_s, [step.start_s - stretch[0] for step in whole_steps], atol=2e-3)
    assert content["parameters"]["UNDERFOOT"]["FIRST_S"]["value"][0] == pytest.approx(stretch[0], abs=1e-3)


def test_steps_of_a_survey_are_those_that_an_export_finds(path, stretch, tmp_path):
    """What is in a C3D file beside forces is known once it was looked for: of an hour that takes minutes."""
    with Recording(path) as recording:
        for file in cached_files(recording):
            file.unlink(missing_ok=True)
        source = ExportSource(recording, stretch_s=stretch)
        write_export(source, tmp_path / "found.c3d")
        made = survey(recording, lambda so_far: True)
        cache_survey(recording, made)
        told = []
        write_export(replace(source, progress=lambda text, share: told.append(text) or True), tmp_path / "known.c3d")
        assert (tmp_path / "known.c3d").read_bytes() == (tmp_path / "found.c3d").read_bytes()
        assert "Looking for steps" not in told
        for step in (one.step for one in made.steps):  # of which a step is chosen and exported
            [alone] = ExportSource(recording, stretch_s=(step.start_s, step.end_s)).steps("")
            assert alone.step == step.step
        cached_files(recording)[0].unlink()


def test_one_end_is_enough(path, tmp_path):
    for option, frames in (("--from=11.5", 24_000), ("--to=0.25", 12_000)):
        done = CliRunner().invoke(cli, ["export", str(path), "-o", str(tmp_path / "end.wav"), option])
        assert done.exception is None
        assert len(soundfile.read(tmp_path / "end.wav")[0]) == frames


@pytest.mark.parametrize(
    "ends", [(-1.0, 2.0), (3.0, 3.0), (4.0, 2.0), (2.0, 12.5), (float("nan"), 2.0), (1.0, 1.000001)]
)
def test_a_stretch_outside_is_refused_in_one_line(path, ends):
    with Recording(path) as recording, pytest.raises(BadValue, match=r"within the recording's 0 to 12 s$") as refused:
        ExportSource(recording, stretch_s=ends)
    assert str(refused.value).startswith("the stretch is from ")


def test_commands_and_gaps_are_those_within(tmp_path):
    about = {"floor": FLOOR.dumps().decode(), "rate": "48000", "force_rate": "1000", "patch": "{}"}
    writer = Writer(tmp_path / "gap.underfoot", about)
    for first in (0, 3 * RATE):
        writer.put("vibration", first, np.ones((RATE, 2), np.float32))
    for second in (0, 2, 3):
        writer.command(second * RATE, "play", f'{{"at": {second}}}')
    writer.close()
    with Recording(tmp_path / "gap.underfoot") as recording:
        export = ExportSource(recording, stretch_s=(1.5, 3.5))
        write_export(export, tmp_path / "gap.h5")
        frames = np.concatenate(list(export.frames("vibration", "")))
    with h5py.File(tmp_path / "gap.h5") as file:
        commands = zip(*(file[f"commands/{name}"][:].tolist() for name in ("time_s", "kind", "body")), strict=True)
        assert list(commands) == [(0.5, b"play", b'{"at": 2}'), (1.5, b"play", b'{"at": 3}')]
        assert file["gaps_s"][:].tolist() == [[0.0, 1.5]]
    assert len(frames) == 2 * RATE
    assert frames[: round(1.5 * RATE)].max() == 0.0
    assert frames[round(1.5 * RATE) :].min() == 1.0
