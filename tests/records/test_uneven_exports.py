"""C3D files of recordings with lost samples, odd rates and many frames: as even as the format wants them, and whole."""

import ezc3d
import h5py
import numpy as np
import pytest
from click.testing import CliRunner
from long_recording import walked

from underfoot.__main__ import cli
from underfoot.devices.force_source import SENSOR_HZ
from underfoot.errors import BadFile
from underfoot.floor.layout import default_floor
from underfoot.floor.step_finder import find_steps
from underfoot.patch.patch import Patch
from underfoot.records.even_samples import even_forces, even_rate
from underfoot.records.exports import ExportSource, formats
from underfoot.records.force_files import read_force_file
from underfoot.records.forces import read_forces
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

FLOOR = default_floor(1, 2)


def recording_of(path, stamps, force_n, rate_hz, floor=FLOOR):
    """A recording of these samples, with stamps in frames of 1/48000 s."""
    said = {"patch": Patch(title="Made").dumps().decode(), "folder": "", "floor": floor.dumps().decode()}
    writer = Writer(path, said | {"rate": "48000", "force_rate": repr(rate_hz), "target": "simulator"})
    for first in range(0, len(stamps), 1000):
        part = slice(first, first + 1000)
        writer.put(
            "force", first, np.column_stack([stamps[part], stamps[part], force_n[part].reshape(len(force_n[part]), -1)])
        )
    writer.commit()
    writer.close()
    return path


def steps_of(time_s, force_n, rate_hz=SENSOR_HZ):
    return [step for found in find_steps([(time_s, force_n)], FLOOR, rate_hz) for step in found.steps]


def export(path, output):
    done = CliRunner().invoke(cli, ["export", str(path), "-o", str(output)])
    assert done.exception is None, done.exception
    return output


@pytest.fixture(scope="module")
def walk():
    """Stamps and corner forces of a walker at 1 kHz, of which a tenth is lost: whole samples, and those of one tile."""
    rows = walked(FLOOR, 6.0)
    force_n = rows[:, 2:].reshape(len(rows), 2, 4)
    rng = np.random.default_rng(1)
    lost = rng.random((len(rows), 2)) < 0.05
    force_n = np.where(lost[:, :, None], np.nan, force_n)
    kept = rng.random(len(rows)) > 0.05
    return rows[kept, 0], force_n[kept], rows


def test_lost_samples_of_a_stance_are_bridged_and_its_steps_stay_whole(walk, tmp_path):
    stamps, force_n, rows = walk
    forces, _ = read_force_file(export(recording_of(tmp_path / "lossy.underfoot", stamps, force_n, 1000.0),
                                       tmp_path / "lossy.c3d"))  # fmt: skip
    whole = rows[:, 2:].reshape(len(rows), 2, 4)
    assert np.abs(forces.force_n[: len(whole)] - whole).mean() < 0.1
    found, expected = steps_of(forces.time_s, forces.force_n), steps_of(rows[:, 0] / 48_000, whole)
    assert len(expected) >= 6
    np.testing.assert_allclose([s.contact_ms for s in found], [s.contact_ms for s in expected], atol=6.0)
    np.testing.assert_allclose([s.impulse_ns for s in found], [s.impulse_ns for s in expected], atol=0.5)


def test_a_gap_of_contacts_is_0_n_and_no_line():
    time_s = np.array([0.0, 0.010, 0.020, 0.120, 0.130])
    even = np.concatenate(list(even_forces([(time_s, np.full((5, 1, 4), 100.0))], 100.0)))[:, 0, 0]
    assert even.tolist() == [100.0] * 3 + [0.0] * 9 + [100.0] * 2


@pytest.mark.parametrize("rate_hz", [128.0, 240.0, 333.333, 512.0, 999.0, 1024.0, 1000.0])
def test_c3d_holds_every_sample_at_any_rate(tmp_path, rate_hz):
    """ezc3d divides the two rates, and cuts: where the quotient was 9.99999, every tenth sample was missing."""
    rng = np.random.default_rng(2)
    force_n = rng.uniform(0.0, 500.0, (500, 2, 4)).astype(np.float32)
    stamps = np.arange(500) * 48_000.0 / rate_hz
    forces, _ = read_force_file(export(recording_of(tmp_path / "odd.underfoot", stamps, force_n, rate_hz),
                                       tmp_path / "odd.c3d"))  # fmt: skip
    assert forces.rate_hz == pytest.approx(rate_hz, rel=1e-6)
    np.testing.assert_array_equal(forces.force_n, force_n)


def test_a_foot_that_stands_at_the_end_of_a_recording_stands_to_the_end_of_its_c3d_file(tmp_path):
    """The last frame was filled up with zeros: read again, a foot went off there, and a short step was counted."""
    force_n = np.full((506, 2, 4), 200.0, np.float32)
    forces, _ = read_force_file(export(recording_of(tmp_path / "cut.underfoot", 48.0 * np.arange(506), force_n, 1000.0),
                                       tmp_path / "cut.c3d"))  # fmt: skip
    assert forces.force_n.shape == (510, 2, 4)
    assert (forces.force_n == 200.0).all()


def test_the_rate_is_that_of_the_samples_where_the_named_one_would_slip(tmp_path):
    force_n = np.random.default_rng(3).uniform(0.0, 500.0, (4000, 2, 4)).astype(np.float32)
    stamps = np.arange(4000) * 48.0 * 1000.0 / 995.0
    forces, _ = read_force_file(export(recording_of(tmp_path / "slow.underfoot", stamps, force_n, 1000.0),
                                       tmp_path / "slow.c3d"))  # fmt: skip
    assert forces.rate_hz == pytest.approx(995.0, rel=1e-6)
    np.testing.assert_array_equal(forces.force_n, force_n)
    assert even_rate(np.arange(4000) / 1000.0001, 1000.0) == 1000.0


def test_c3d_of_more_frames_than_a_header_can_tell_is_whole(tmp_path):
    count = 655_345  # of 10 samples a frame 65,535 frames, which stand for more
    force_n = np.zeros((count, 1, 4), np.float32)
    force_n[:, 0, 0] = np.arange(count) % 7  # no foot
    stamps = 48.0 * np.arange(count)
    made = recording_of(tmp_path / "long.underfoot", stamps, force_n, 1000.0, default_floor(1, 1))
    output = export(made, tmp_path / "long.c3d")
    assert int.from_bytes(output.read_bytes()[8:10], "little") < 65_535
    forces, _ = read_force_file(output)
    np.testing.assert_array_equal(forces.force_n[:count], force_n)
    assert ezc3d.c3d(str(output))["parameters"]["ANALOG"]["RATE"]["value"] == [1000.0]


def test_c3d_and_mat_of_more_than_a_header_can_tell_are_refused(tmp_path):
    floor = default_floor(15, 17)
    said = {"patch": Patch(title="Made").dumps().decode(), "folder": "", "floor": floor.dumps().decode()}
    writer = Writer(tmp_path / "day.underfoot", said | {"rate": "48000", "force_rate": "1000.0", "target": "simulator"})
    for number, stamp in enumerate((0.0, 48.0, 48_000.0 * 86_400)):
        row = np.zeros((1, 2 + 4 * 255))
        row[:, :2] = stamp
        writer.put("force", number, row)
    writer.commit()
    writer.close()
    with Recording(tmp_path / "day.underfoot") as recording, pytest.raises(BadFile, match="allowed: 2097 s"):
        formats()[".c3d"].write(ExportSource(recording), tmp_path / "day.c3d")
    with Recording(tmp_path / "day.underfoot") as recording, pytest.raises(BadFile, match=r"allowed: 2\.1 GB"):
        formats()[".mat"].write(ExportSource(recording), tmp_path / "day.mat")
    assert [file.name for file in tmp_path.iterdir()] == ["day.underfoot"]


@pytest.mark.parametrize("suffix", [".csv", ".h5", ".mat", ".c3d", ".wav"])
def test_a_recording_of_nothing_is_refused_in_one_line(tmp_path, suffix):
    made = recording_of(tmp_path / "empty.underfoot", np.zeros(0), np.zeros((0, 2, 4)), 1000.0)
    done = CliRunner().invoke(cli, ["export", str(made), "-o", str(tmp_path / f"empty{suffix}")])
    assert "holds nothing to export: it was ended before its first frame" in str(done.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["empty.underfoot"]


@pytest.mark.parametrize("to_ms", [0.0, 3_500.0])  # also to a time that was there: its samples would be written over
def test_c3d_of_a_clock_that_was_put_back_is_refused_in_one_line(tmp_path, to_ms):
    stamps = 48.0 * np.concatenate([np.arange(3_000.0, 4_000.0), to_ms + np.arange(1_000.0)])
    made = recording_of(tmp_path / "back.underfoot", stamps, np.zeros((2000, 2, 4)), 1000.0)
    done = CliRunner().invoke(cli, ["export", str(made), "-o", str(tmp_path / "back.c3d")])
    assert isinstance(done.exception, BadFile)
    assert "export it as .csv or .h5" in str(done.exception)
    assert not (tmp_path / "back.c3d").exists()


def test_hdf5_without_force_samples_has_the_tables_of_force_all_the_same(tmp_path):
    made = recording_of(tmp_path / "silent.underfoot", np.zeros(0), np.zeros((0, 2, 4)), 1000.0)
    writer = Writer(made, {}, resume=True)
    writer.put("vibration", 0, np.zeros((4800, 2), np.float32))
    writer.commit()
    writer.close()
    with h5py.File(export(made, tmp_path / "silent.h5")) as file:
        assert file["force/time_s"].shape == (0,)
        assert file["force/corners_n"].shape == (0, 2, 4)
        assert file["force/corners_n"].attrs["unit"] == "N"


def test_hdf5_has_a_mark_with_a_sign_at_which_its_texts_end(tmp_path):
    made = recording_of(tmp_path / "marked.underfoot", np.arange(2) * 48.0, np.zeros((2, 2, 4)), 1000.0)
    with Recording(made) as recording:
        recording.add_mark(0, "left\0foot")
    with h5py.File(export(made, tmp_path / "marked.h5")) as file:
        assert file["marks/text"].asstr()[:].tolist() == ["left foot"]


@pytest.mark.parametrize(("rate_hz", "digits"), [(240.0, 3), (240.0, 5), (120.0, 3), (59.94, 6), (1000.0, 3)])
def test_the_rate_of_a_file_is_right_though_its_times_are_rounded(tmp_path, rate_hz, digits):
    time_s = np.round(np.arange(2000) / rate_hz, digits)
    rows = [",".join([repr(float(at)), *["1.0"] * 8]) for at in time_s]
    names = [f"t{tile}.{corner}" for tile in (1, 2) for corner in (1, 2, 3, 4)]
    (tmp_path / "walk.csv").write_text("\n".join([",".join(["time_s", *names]), *rows]) + "\n")
    assert read_forces(tmp_path / "walk.csv", FLOOR).rate_hz == pytest.approx(rate_hz, rel=1e-6)
