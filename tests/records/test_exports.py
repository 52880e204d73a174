"""Exports, read by other people's libraries, and read again by ours: they agree to the last digit of the format."""

import csv
import json
import re
import shutil
import struct
import sys
import tracemalloc
import zlib
from pathlib import Path

import ezc3d
import h5py
import numpy as np
import pytest
import soundfile
from click.testing import CliRunner
from long_recording import write_recording
from msgspec.structs import replace
from scipy.io import loadmat

from underfoot.__main__ import cli
from underfoot.errors import BadFile
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.floor.step_finder import find_steps
from underfoot.records.exports import VIBRATION, ExportSource, ExportStopped, format_of, formats, write_export
from underfoot.records.force_files import read_force_file
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

FLOOR, BEGUN = default_floor(1, 2), "2026-11-24T10:00:00"
CALIBRATIONS = {"t1": {"fsr": "2026-05-01 0f3c9a1b2d4e"}, "t2": {"response": "2026-05-02 a07be6c51f98"}}
IN_USE = ["t1 Forces 2026-05-01 0f3c9a1b2d4e", "t2 Vibration 2026-05-02 a07be6c51f98"]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    about = {"begun": BEGUN, "calibrations": json.dumps(CALIBRATIONS)}
    made = write_recording(tmp_path_factory.mktemp("exported") / "walk.underfoot", 4.0, FLOOR, about=about)
    with Recording(made) as recording:
        recording.add_mark(48_000, 'a "quoted" mark')
    return made


@pytest.fixture(scope="module")
def recorded(path):
    """Times, corner forces and steps of the recording."""
    with Recording(path) as recording:
        rows = recording.force_samples()
    time_s, force_n = rows[:, 0] / 48_000, rows[:, 2:].reshape(len(rows), -1, 4)
    steps = [step for found in find_steps([(time_s, force_n)], FLOOR, 1000.0) for step in found.steps]
    return time_s, force_n, steps


def contacts_of(recorded, column):
    """A column of the recording's contacts."""
    return np.concatenate([getattr(found.rows, column) for found in find_steps([recorded[:2]], FLOOR, 1000.0)])


def curves_of(recorded):
    """The force of each step at 0 to 100 % of its stance, from the table of contacts."""
    contact, time_s, force_n = (contacts_of(recorded, name) for name in ("contact", "time_s", "force_n"))
    own = ((np.linspace(step.start_s, step.end_s, 101), contact == step.contact) for step in recorded[2])
    return [np.interp(at_s, time_s[rows], force_n[rows]) for at_s, rows in own]


def export(path, output, *options):
    done = CliRunner().invoke(cli, ["export", str(path), "-o", str(output), *options])
    assert done.exception is None, done.exception
    assert done.stdout.startswith(f"{output} is written, as ")
    assert "NAME" not in done.stdout
    return output


def test_csv_is_read_again_to_the_last_bit_with_its_floor(path, recorded, tmp_path):
    output = export(path, tmp_path / "walk.csv")
    forces, floor = read_force_file(output)
    assert floor == FLOOR
    np.testing.assert_array_equal(forces.time_s, recorded[0])
    np.testing.assert_array_equal(forces.force_n, recorded[1])
    with (tmp_path / "walk.steps.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["tile"] for row in rows] == [step.tile for step in recorded[2]]
    with (tmp_path / "walk.marks.csv").open() as file:
        assert list(csv.DictReader(file)) == [{"time_s": "1.000000", "text": 'a "quoted" mark'}]
    assert len((tmp_path / "walk.contacts.csv").read_text().splitlines()) > 1000
    curves = np.loadtxt(tmp_path / "walk.curves.csv", delimiter=",", skiprows=1)
    assert curves[:, 0].tolist() == [step.step for step in recorded[2]]
    np.testing.assert_allclose(curves[:, 1:], curves_of(recorded), atol=0.051)
    used = (tmp_path / "walk.calibrations.csv").read_text().splitlines()
    assert used == ["tile,calibration,made,digest", *(line.replace(" ", ",") for line in IN_USE)]
    refused = CliRunner().invoke(cli, ["export", str(output), "-o", str(tmp_path / "again.c3d")]).exception
    assert isinstance(refused, BadFile)
    assert str(refused).startswith(f"{output} is not a recording; allowed: one (`underfoot monitor FILE --record")


@pytest.mark.parametrize("source", ["commanded", "measured"])
def test_wav_has_a_channel_for_each_tile(path, tmp_path, source):
    output = export(path, tmp_path / "walk.wav", "--vibration", source)
    samples, rate = soundfile.read(output, dtype="float32")
    assert rate == 48_000
    with Recording(path) as recording:
        np.testing.assert_array_equal(samples, recording.acceleration(source)[1])


def test_hdf5_has_all_of_it(path, recorded, tmp_path):
    with h5py.File(export(path, tmp_path / "walk.h5")) as file, Recording(path) as recording:
        np.testing.assert_array_equal(file["force/time_s"], recorded[0])
        np.testing.assert_array_equal(file["force/corners_n"], recorded[1])
        assert file["force/corners_n"].attrs["unit"] == "N"
        assert [file[f"vibration/{name}"].attrs["unit"] for name in VIBRATION] == ["m/s^2", "m/s^2", "of full scale"]
        units = {name: file[f"steps/{name}"].attrs["unit"] for name in ("peak1_n", "impulse_ns", "path_mm", "person")}
        assert units == {"peak1_n": "N", "impulse_ns": "N s", "path_mm": "mm", "person": ""}
        assert {
            file[name].attrs["unit"] for name in ("steps/start_s", "marks/time_s", "commands/time_s", "gaps_s")
        } == {"s"}
        for source in ("commanded", "measured"):
            np.testing.assert_array_equal(file[f"vibration/{source}"], recording.acceleration(source)[1])
        np.testing.assert_array_equal(file["vibration/vibration"], recording.vibration()[1])
        np.testing.assert_array_equal(file["steps/peak1_n"], [step.peak1_n for step in recorded[2]])
        assert [name.decode() for name in file["steps/tile"][:]] == [step.tile for step in recorded[2]]
        np.testing.assert_allclose(file["steps/stance_n"], curves_of(recorded), atol=0.051)
        assert file["steps/stance_n"].attrs["unit"] == "N"
        for name, column in file["contacts"].items():
            np.testing.assert_array_equal(column, contacts_of(recorded, name))
        assert file["contacts"].keys() == {"time_s", "contact", "x_m", "y_m", "force_n", "on_tile"}
        assert (file["marks/time_s"][0], file["marks/text"][0].decode()) == (1.0, 'a "quoted" mark')
        assert (file.attrs["rate_hz"], file.attrs["force_rate_hz"]) == (48_000.0, 1000.0)
        assert (file.attrs["floor"], file.attrs["patch"]) == (recording.about["floor"], recording.about["patch"])
        assert (file.attrs["begun"], file.attrs["calibrations"].tolist()) == (BEGUN, IN_USE)


def test_mat_has_forces_tables_and_one_vibration(path, recorded, tmp_path):
    content = loadmat(export(path, tmp_path / "walk.mat"), simplify_cells=True)
    np.testing.assert_array_equal(content["time_s"], recorded[0])
    np.testing.assert_array_equal(content["corners_n"], recorded[1])
    with Recording(path) as recording:
        np.testing.assert_array_equal(content["measured_m_s2"], recording.acceleration("measured")[1])
        assert (content["floor_json"], content["patch_json"]) == (recording.about["floor"], recording.about["patch"])
    np.testing.assert_array_equal(content["steps"]["contact_ms"], [step.contact_ms for step in recorded[2]])
    np.testing.assert_allclose(content["steps"]["stance_n"], curves_of(recorded), atol=0.051)
    for name, column in content["contacts"].items():
        np.testing.assert_array_equal(column, contacts_of(recorded, name))
    assert content["marks"] == {"time_s": 1.0, "text": 'a "quoted" mark'}
    assert (content["rate_hz"], content["force_rate_hz"]) == (48_000.0, 1000.0)
    assert content["tiles"].tolist() == ["t1", "t2"]
    assert (content["begun"], content["calibrations"].tolist()) == (BEGUN, IN_USE)


def test_tables_of_mat_have_a_row_for_each_of_what_they_list(path, recorded, tmp_path):
    """`struct2table` makes a table of fields with as many rows each."""
    content = loadmat(export(path, tmp_path / "walk.mat"))
    for name, rows in (("steps", len(recorded[2])), ("contacts", len(contacts_of(recorded, "time_s"))), ("marks", 1)):
        table = content[name][0, 0]
        assert {table[column].shape[0] for column in table.dtype.names} == {rows}


def test_elements_of_mat_end_at_eight_bytes_whatever_their_length(tmp_path):
    """So the format says, and MATLAB relies on it; SciPy does not."""
    made = write_recording(tmp_path / "one.underfoot", 0.2, default_floor(1, 1))
    output = export(made, tmp_path / "one.mat", "--to", str(3 / 48_000), "--vibration", "vibration")
    assert loadmat(output)["vibration"].shape == (3, 1)
    content, at, sizes = output.read_bytes(), 128, []
    while at < len(content):
        kind, length = struct.unpack_from("<II", content, at)
        element = zlib.decompress(content[at + 8 : at + 8 + length]) if kind == 15 else content[at : at + 8 + length]
        sizes.append((len(element) - 8, struct.unpack_from("<I", element, 4)[0]))
        at += 8 + length
    assert all(held == told and held % 8 == 0 for held, told in sizes)


@pytest.fixture(scope="module")
def of_36_tiles(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("exported") / "whole.underfoot", 4.0, default_floor(6, 6))


@pytest.mark.parametrize("suffix", [".h5", ".wav", ".mat"])
def test_vibration_need_not_fit_into_memory(path, of_36_tiles, tmp_path, suffix):
    export(path, tmp_path / f"first{suffix}")  # imports its libraries
    with Recording(of_36_tiles) as recording:
        tracemalloc.start()
        try:
            format_of(tmp_path / f"whole{suffix}").write(ExportSource(recording), tmp_path / f"whole{suffix}")
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert peak < 0.7 * 4 * 48_000 * 36 * 4


def test_c3d_is_plates_as_another_library_understands_them(path, recorded, tmp_path):
    output = export(path, tmp_path / "walk.c3d")
    content = ezc3d.c3d(str(output), extract_forceplat_data=True)
    _, force_n, steps = recorded
    for row, (tile, plate) in enumerate(zip(FLOOR.tiles, content["data"]["platform"], strict=True)):
        assert plate["unit_position"] == "mm"
        loads = force_n[:, row].sum(axis=1)
        np.testing.assert_allclose(plate["force"][2], loads, atol=2e-4)  # on the foot, upwards
        pressed = np.flatnonzero(loads > 100.0)
        centroid = tile.to_floor(force_n[pressed, row] @ np.array(tile.sensors_m) / loads[pressed, None])
        np.testing.assert_allclose(plate["center_of_pressure"][:2, pressed].T, 1e3 * centroid, atol=0.01)
        corners = {tuple(corner) for corner in plate["corners"][:2].T.round(3)}
        assert corners == {tuple(corner) for corner in (1e3 * tile.corners_m()).round(3)}
    events = content["parameters"]["EVENT"]
    strikes = [k for k, label in enumerate(events["LABELS"]["value"]) if label == "Foot Strike"]
    times = 60.0 * events["TIMES"]["value"][0] + events["TIMES"]["value"][1]
    np.testing.assert_allclose(sorted(times[strikes]), sorted(step.start_s for step in steps), atol=1e-5)
    subjects = [events["SUBJECTS"]["value"][k] for k in sorted(strikes, key=lambda k: times[k])]
    assert subjects == [f"Person {step.person}" for step in sorted(steps, key=lambda step: step.start_s)]
    assert content["parameters"]["SUBJECTS"]["NAMES"]["value"] == sorted(set(subjects))
    offs = [k for k, label in enumerate(events["LABELS"]["value"]) if label == "Foot Off"]
    np.testing.assert_allclose(
        sorted(times[offs]), sorted(step.start_s + step.contact_ms / 1000 for step in steps), atol=1e-5
    )
    (mark,) = (k for k, label in enumerate(events["LABELS"]["value"]) if label == "Mark")
    assert (events["USED"]["type"], events["USED"]["value"]) == (2, [2 * len(steps) + 1])  # 2: a whole number
    assert events["TIMES"]["value"][:, mark] == pytest.approx([0.0, 1.0])
    assert events["SUBJECTS"]["value"][mark] == ""
    own = content["parameters"]["UNDERFOOT"]
    assert (own["BEGUN"]["value"], own["CALIBRATIONS"]["value"]) == ([BEGUN], IN_USE)


def test_events_of_c3d_are_told_in_minutes_and_seconds(tmp_path):
    source = write_recording(tmp_path / "short.underfoot", 0.3, default_floor(1, 1), vibration=False)
    with Recording(source) as recording:
        recording.add_mark(round(75.5 * 48_000), "after a minute and a quarter")
    events = ezc3d.c3d(str(export(source, tmp_path / "short.c3d")))["parameters"]["EVENT"]
    assert events["TIMES"]["value"][:, 0] == pytest.approx([1.0, 15.5], abs=1e-3)


def test_a_long_mark_in_any_script_leaves_c3d_readable_for_others(tmp_path):
    """A hundred letters of three bytes each were longer than a text can be, and nothing could be read."""
    long = Floor((replace(FLOOR.tiles[0], id="t" * 300), FLOOR.tiles[1]), FLOOR.title)
    made = write_recording(tmp_path / "marked.underfoot", 1.0, long, people="")
    with Recording(made) as recording:
        recording.add_mark(0, "氷" * 100)
    found = ezc3d.c3d(str(export(made, tmp_path / "marked.c3d")))["parameters"]
    assert "氷" * 33 in found["EVENT"]["DESCRIPTIONS"]["value"]
    assert found["UNDERFOOT"]["TILES"]["value"] == ["t" * 100, FLOOR.ids[1]]


def test_readers_to_which_a_byte_tells_the_size_of_parameters_miss_no_time_of_an_event(tmp_path):
    """Ten minutes of a walker have more parameters than a byte can tell, and the times were the last of them."""
    made = write_recording(tmp_path / "marked.underfoot", 1.0, FLOOR, people="")
    writer = Writer(made, {}, resume=True)
    for frame in range(1500):
        writer.mark(frame, "x" * 100)
    writer.close()
    written = export(made, tmp_path / "marked.c3d").read_bytes()
    section = written[512 : 512 * (1 + written[514])]
    assert len(section) == 512 * 255
    assert written.count(b"DESCRIPTIONS6") > section.count(b"DESCRIPTIONS6")
    assert all(name in section for name in (b"TIMES6", b"LABELS6", b"CONTEXTS6", b"FIRST_S"))


def test_c3d_is_read_again_as_the_same_floor_and_the_same_forces(path, recorded, tmp_path):
    forces, floor = read_force_file(export(path, tmp_path / "walk.c3d"))
    np.testing.assert_array_equal(forces.force_n, recorded[1].astype(np.float32))
    np.testing.assert_allclose(forces.time_s, recorded[0] - recorded[0][0], atol=1e-9)
    assert floor.ids == FLOOR.ids
    for tile, own in zip(floor.tiles, FLOOR.tiles, strict=True):
        np.testing.assert_allclose(tile.sensors_m, own.sensors_m, atol=1e-7)
        np.testing.assert_allclose(tile.centre_m, own.centre_m, atol=1e-7)
        np.testing.assert_allclose(tile.size_m, own.size_m, atol=1e-7)
        assert tile.rotation_deg == pytest.approx(own.rotation_deg, abs=1e-5)


def test_c3d_has_more_than_255_channels_as_the_manual_says(tmp_path):
    whole = default_floor(6, 6)
    source = write_recording(tmp_path / "whole.underfoot", 0.3, whole, vibration=False)
    output = export(source, tmp_path / "whole.c3d")
    content = ezc3d.c3d(str(output), extract_forceplat_data=True)
    analog = content["parameters"]["ANALOG"]
    assert [len(analog[name]["value"]) for name in ("LABELS", "LABELS2")] == [255, 33]
    assert [analog[name]["value"] for name in ("UNITS", "UNITS2")] == [["N"] * 255, ["N"] * 33]
    assert [analog["DESCRIPTIONS"]["value"][k] for k in (0, 254)] == ["not measured", "vertical force"]
    assert content["data"]["analogs"].shape[1] == 288
    with Recording(source) as recording:
        corners = recording.force_samples()[:, 2:].reshape(-1, 36, 4)
    loads = np.stack([plate["force"][2] for plate in content["data"]["platform"]], axis=1)
    np.testing.assert_allclose(loads, corners.sum(axis=2), atol=2e-4)
    forces, floor = read_force_file(output)
    assert floor.ids == whole.ids
    np.testing.assert_array_equal(forces.force_n, corners.astype(np.float32))


@pytest.mark.skipif(sys.platform == "win32", reason="files have no limit there")
@pytest.mark.parametrize("suffix", formats())
def test_an_export_for_which_there_is_no_room_leaves_nothing_and_says_so(path, tmp_path, suffix):
    """A table of steps named the terminal as what could not be written, and a C3D file was cut without a word."""
    import resource

    whole = export(path, tmp_path / f"whole{suffix}")
    most = min(file.stat().st_size for file in (whole, *tmp_path.glob("whole.*.csv")) if file.stat().st_size > 1000)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    for share in (0.0, 0.5, 0.99):
        said = ""
        resource.setrlimit(resource.RLIMIT_FSIZE, (max(round(share * most), 1), hard))
        try:
            with Recording(path) as recording:
                format_of(whole).write(ExportSource(recording), tmp_path / f"cut{suffix}")
        except BadFile as refused:
            said = str(refused)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        assert re.search(r"cut\S* cannot be written: (file|only)", said), share
        assert "\n" not in said, share
        assert not [file.name for file in tmp_path.iterdir() if "cut" in file.name], share


def test_progress_is_told_of_what_is_still(tmp_path):
    shares = []
    with Recording(write_recording(tmp_path / "still.underfoot", 4.2, default_floor(1, 2), vibration=False)) as still:
        source = ExportSource(still, progress=lambda words, share: shares.append(share) is None)
        parts = list(source.frames("vibration", "Writing"))
    assert (sum(map(len, parts)), max(part.max() for part in parts)) == (source.end - source.first, 0.0)
    assert shares == pytest.approx([second / source.length_s for second in range(len(parts))])
    assert len(parts) == 5


@pytest.mark.parametrize("suffix", formats())
def test_an_export_that_is_stopped_at_any_of_its_parts_leaves_nothing(path, tmp_path, suffix):
    told = []
    with Recording(path) as recording:
        format_of(tmp_path / f"walk{suffix}").write(
            ExportSource(recording, progress=lambda words, share: told.append(words) is None),
            tmp_path / f"walk{suffix}",
        )
        for file in tmp_path.iterdir():
            file.unlink()
        for last in dict.fromkeys(told):
            with pytest.raises(ExportStopped):
                format_of(tmp_path / f"walk{suffix}").write(
                    ExportSource(recording, progress=lambda words, share, last=last: words != last),
                    tmp_path / f"walk{suffix}",
                )
            assert not list(tmp_path.iterdir()), last


@pytest.mark.parametrize(
    "name",
    ["csv", "floor.json", "steps.csv", "curves.csv", "contacts.csv", "marks.csv", "stretch.csv", "calibrations.csv"],
)
def test_a_csv_export_of_which_a_table_cannot_be_written_leaves_none_of_them(path, tmp_path, name):
    (tmp_path / f"walk.{name}").mkdir()
    with Recording(path) as recording, pytest.raises(BadFile, match=f"walk.{name} cannot be written: it is a folder"):
        format_of(tmp_path / "walk.csv").write(ExportSource(recording), tmp_path / "walk.csv")
    assert [file.name for file in tmp_path.iterdir()] == [f"walk.{name}"]


@pytest.mark.parametrize("suffix", formats())
def test_a_recording_that_is_being_written_is_exported_as_it_was_when_that_began(path, tmp_path, suffix):
    """Forces ended before the vibration, and contacts and events of steps came after the end."""
    path = Path(shutil.copy(path, tmp_path / "walk.underfoot"))
    writer = Writer(path, {}, resume=True)

    def go_on(text, share):
        first, count = writer.end("vibration"), writer.end("force")
        stamps = first + 48.0 * np.arange(100)
        writer.put("force", count, np.column_stack([stamps, stamps, np.full((100, 8), 50.0)]))
        for table in ("vibration", "commanded", "measured"):
            writer.put(table, first, np.ones((4800, 2), np.float32))
        writer.mark(first, "later")
        writer.commit()
        return True

    with Recording(path) as recording:
        write_export(ExportSource(recording), tmp_path / f"still{suffix}")
        write_export(ExportSource(recording, progress=go_on), tmp_path / f"grown{suffix}")
    writer.close()
    still = sorted(tmp_path.glob("still*"))
    assert [file.stat().st_size for file in still] == [
        file.with_name(file.name.replace("still", "grown")).stat().st_size for file in still
    ]


def test_what_a_format_cannot_carry_is_said(path, tmp_path):
    skewed = Tile("t1", (0.3, 0.3), (0.0, 0.0), 0.0, ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, 0.0)))
    odd = write_recording(tmp_path / "odd.underfoot", 0.5, Floor((skewed,)), people="")
    with Recording(odd) as recording, pytest.raises(BadFile, match="tile t1 is no plate of type 3"):
        format_of(tmp_path / "odd.c3d").write(ExportSource(recording), tmp_path / "odd.c3d")
    with pytest.raises(BadFile, match=r"allowed: .c3d, .csv"):
        format_of(tmp_path / "walk.xyz")
    said = CliRunner().invoke(cli, ["export", "--help"]).output
    assert all(suffix in said for suffix in formats())


@pytest.mark.parametrize("suffix", [".underfoot", ".c3d", ".csv"])
def test_forces_are_monitored_from_each_file_alike(path, recorded, tmp_path, suffix):
    source = path if suffix == ".underfoot" else export(path, tmp_path / f"walk{suffix}")
    said = CliRunner().invoke(cli, ["monitor", str(source), "--json"])
    assert said.exception is None
    starts = [json.loads(line)["start_s"] for line in said.stdout.splitlines() if line.startswith("{")]
    np.testing.assert_allclose(starts, [step.start_s for step in recorded[2]], atol=2e-3)
