"""Exports, read by other people's libraries, and read again by ours: they agree to the last digit of the format."""

import csv
import json
import re
import shutil
import sys
import tracemalloc
from functools import partial
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
from underfoot.records.exports import ExportSource, ExportStopped, format_of, formats, write_export
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
        assert file["marks/text"][0].decode() == 'a "quoted" mark'
        assert json.loads(file.attrs["floor"])["tiles"][0]["id"] == "t1"
        assert (file.attrs["begun"], file.attrs["calibrations"].tolist()) == (BEGUN, IN_USE)


def test_mat_has_forces_steps_and_one_vibration(path, recorded, tmp_path):
    content = loadmat(export(path, tmp_path / "walk.mat"), simplify_cells=True)
    np.testing.assert_array_equal(content["time_s"], recorded[0])
    np.testing.assert_array_equal(content["corners_n"], recorded[1])
    with Recording(path) as recording:
        np.testing.assert_array_equal(content["measured_m_s2"], recording.acceleration("measured")[1])
    np.testing.assert_array_equal(content["steps"]["contact_ms"], [step.contact_ms for step in recorded[2]])
    assert content["tiles"].tolist() == ["t1", "t2"]
    assert (content["begun"], content["calibrations"].tolist()) == (BEGUN, IN_USE)


@pytest.fixture(scope="module")
def of_36_tiles(tmp_path_factory):
    return write_recording(tmp_path_factory.mktemp("exported") / "whole.underfoot", 4.0, default_floor(6, 6))


@pytest.mark.parametrize(("suffix", "most"), [(".h5", 0.7), (".wav", 0.7), (".mat", 1.7)])
def test_vibration_need_not_fit_into_memory_more_than_once(path, of_36_tiles, tmp_path, suffix, most):
    export(path, tmp_path / f"first{suffix}")  # imports its libraries
    with Recording(of_36_tiles) as recording:
        tracemalloc.start()
        try:
            format_of(tmp_path / f"whole{suffix}").write(ExportSource(recording), tmp_path / f"whole{suffix}")
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert peak < most * 4 * 48_000 * 36 * 4


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


def plates_of(path, kind, corners_mm, origin_mm, channels, calibration=None, units=(), length="mm"):
    """A C3D file with one plate, as a laboratory's system would write it."""
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    made["parameters"]["POINT"]["UNITS"]["value"] = [length]
    made["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = [f"c{k}" for k in range(len(channels))]
    made["parameters"]["ANALOG"]["UNITS"]["value"] = list(units)
    made["data"]["points"] = np.zeros((4, 0, channels.shape[1] // 10))
    made["data"]["analogs"] = channels[None]
    group = made["parameters"]["FORCE_PLATFORM"]
    group["USED"]["value"], group["TYPE"]["value"], group["ZERO"]["value"] = [1], [kind], [0, 0]
    group["CORNERS"]["value"] = np.array(corners_mm, float).T[:, :, None]
    group["ORIGIN"]["value"] = np.array(origin_mm, float)[:, None]
    group["CHANNEL"]["value"] = np.arange(1, len(channels) + 1)[:, None]
    if calibration is not None:
        group["CAL_MATRIX"]["value"] = calibration[:, :, None]
    made.write(str(path))
    return path


DOWN = [(500, 0, 0), (0, 0, 0), (0, 400, 0), (500, 400, 0)]
"""Corners of a plate whose z points into the floor."""


@pytest.mark.parametrize("kind", [2, 4])
@pytest.mark.parametrize("corners", [DOWN, DOWN[::-1]], ids=["z down", "turned"])
@pytest.mark.parametrize("moment", ["", "Nmm", "N.m"])
@pytest.mark.parametrize("origin", [(1.0, -2.0, -40.0), (-1.0, 2.0, 40.0)], ids=["", "as Vicon has it"])
def test_plates_that_tell_moments_press_where_another_library_says(tmp_path, kind, corners, moment, origin):
    rng = np.random.default_rng(kind)
    channels = np.zeros((6, 100))
    channels[2] = rng.uniform(200.0, 900.0, 100)
    channels[:2] = rng.uniform(-50.0, 50.0, (2, 100))
    channels[3:5] = rng.uniform(-80.0, 80.0, (2, 100)) * 1000.0
    calibration = np.diag([2.0, 2.0, 2.0, 1.0, 1.0, 1.0]) if kind == 4 else None
    if kind == 4:  # crosstalk: a channel says something of another one's force, and not the other way round
        calibration[2, 1], calibration[3, 4], calibration[4, 3] = 0.3, 0.1, -0.2
    lab = partial(plates_of, kind=kind, corners_mm=corners, origin_mm=origin, calibration=calibration)
    in_nmm = lab(tmp_path / "nmm.c3d", channels=channels)
    channels[3:] *= 1e-3 if moment == "N.m" else 1.0
    path = lab(tmp_path / "lab.c3d", channels=channels, units=["N"] * 3 + [moment] * 3 if moment else ())
    forces, floor = read_force_file(path)
    theirs = ezc3d.c3d(str(in_nmm), extract_forceplat_data=True)["data"]["platform"][0]
    tile, loads = floor.tiles[0], forces.force_n[:, 0].sum(axis=1)
    np.testing.assert_allclose(loads, np.abs(theirs["force"][2]), rtol=1e-5)
    centroid = tile.to_floor(forces.force_n[:, 0] @ np.array(tile.sensors_m) / loads[:, None])
    np.testing.assert_allclose(1e3 * centroid, theirs["center_of_pressure"][:2].T, atol=0.02)


@pytest.mark.parametrize("kind", [1, 2, 3])
@pytest.mark.parametrize(
    ("force", "moment", "newtons"),
    [
        ("kN", "kN.m", 1000.0),
        ("lbf", "in-lbf", 4.4482216152605),
        ("lbs", "ft lbs", 4.4482216152605),
        ("kgf", "kgf mm", 9.80665),
    ],
)
def test_plates_in_other_units_are_as_heavy_as_those_in_newtons(tmp_path, kind, force, moment, newtons):
    arm_mm = {"kN.m": 1000.0, "in-lbf": 25.4, "ft lbs": 304.8, "kgf mm": 1.0}[moment]
    channels = np.random.default_rng(kind).uniform(100.0, 200.0, (8 if kind == 3 else 6, 20))
    forces, moments = slice(0, 8 if kind == 3 else 3), slice(3, 6 if kind == 2 else 3)
    lab = partial(plates_of, kind=kind, corners_mm=DOWN, origin_mm=(120.0, 200.0, -40.0))
    units = ["N"] * 3 + (["mm"] * 3 if kind == 1 else ["Nmm"] * 3 if kind == 2 else ["N"] * 5)
    in_n, _ = read_force_file(lab(tmp_path / "n.c3d", channels=channels, units=units))
    scaled = channels.copy()
    scaled[forces] /= newtons
    scaled[moments] /= newtons * arm_mm
    named = [{"N": force, "Nmm": moment}.get(unit, unit) for unit in units]
    other, _ = read_force_file(lab(tmp_path / "other.c3d", channels=scaled, units=named))
    np.testing.assert_allclose(other.force_n, in_n.force_n, atol=1e-3)


def test_a_plate_that_tells_its_centre_of_pressure(tmp_path):
    channels = np.zeros((6, 20))
    channels[2], channels[3], channels[4] = 500.0, 30.0, -20.0
    forces, floor = read_force_file(plates_of(tmp_path / "one.c3d", 1, DOWN, (0, 0, 0), channels))
    tile = floor.tiles[0]
    centroid = forces.force_n[0, 0] @ np.array(tile.sensors_m) / 500.0
    np.testing.assert_allclose(tile.to_floor(centroid), (0.28, 0.22), atol=1e-6)  # the plate's y is against the floor's


@pytest.mark.parametrize("up", ["x", "y"])
def test_plates_of_a_laboratory_with_another_axis_upwards_are_the_same_floor(tmp_path, up):
    channels = np.random.default_rng(1).uniform(20.0, 90.0, (8, 20))
    expected, floor = read_force_file(plates_of(tmp_path / "z.c3d", 3, DOWN, (120, 200, -40), channels))
    corners = np.roll(DOWN, {"x": -2, "y": -1}[up], axis=1)  # its axes are still a right hand's
    found, theirs = read_force_file(plates_of(tmp_path / f"{up}.c3d", 3, corners, (120, 200, -40), channels))
    assert theirs.tiles == floor.tiles
    np.testing.assert_array_equal(found.force_n, expected.force_n)


@pytest.mark.parametrize("length", ["m", "meters", "mete", "Metres"])
def test_plates_in_metres_are_as_large_as_those_in_millimetres(tmp_path, length):
    channels, corners, origin = np.full((8, 20), 50.0), np.array(DOWN) * 1e-3, np.array((120, 200, -40)) * 1e-3
    _, floor = read_force_file(plates_of(tmp_path / "m.c3d", 3, corners, origin, channels, length=length))
    assert floor.tiles[0].size_m == (0.5, 0.4)


def test_a_plate_whose_corners_are_measured_is_level_within_some_millimetres(tmp_path):
    channels = np.full((8, 20), 50.0)
    corners = np.array(DOWN) + np.array([(0, 0, 0.6), (0, 0, 0.6), (0, 0, 2.1), (0, 0, -2.0)])
    forces, floor = read_force_file(plates_of(tmp_path / "lab.c3d", 3, corners, (120, 200, -40), channels))
    assert floor.tiles[0].size_m == (0.5, 0.4)
    assert forces.force_n == pytest.approx(50.0)


def test_a_channel_beside_the_plates_need_not_be_finite(tmp_path):
    channels = np.full((7, 20), 50.0)
    channels[6] = np.nan  # such as of an electromyograph
    forces, _ = read_force_file(plates_of(tmp_path / "lab.c3d", 2, DOWN, (0, 0, 0), channels))
    assert forces.force_n.sum(axis=2) == pytest.approx(50.0)
    channels[2, 7] = np.nan
    with pytest.raises(BadFile, match="plate 1 has samples that are not finite"):
        read_force_file(plates_of(tmp_path / "lost.c3d", 2, DOWN, (0, 0, 0), channels))


def test_what_cannot_be_a_floor_is_said_in_a_line(tmp_path):
    (tmp_path / "no.c3d").write_bytes(b"not a C3D file")
    channels = np.zeros((6, 20))
    ramp = [(500, 0, 0), (0, 0, 40), (0, 400, 40), (500, 400, 0)]
    made = ezc3d.c3d(str(plate := plates_of(tmp_path / "zero.c3d", 2, DOWN, (0, 0, 0), channels)))
    made["parameters"]["FORCE_PLATFORM"]["CHANNEL"]["value"] = np.arange(6)[:, None]
    made.write(str(plate))
    for path, words in (
        (tmp_path / "no.c3d", "no C3D file"),
        (plates_of(tmp_path / "ramp.c3d", 2, ramp, (0, 0, 0), channels), "does not lie level"),
        (plates_of(tmp_path / "lost.c3d", 2, [*DOWN[:3], (500, 400, np.nan)], (0, 0, 0), channels), "not finite"),
        (plates_of(tmp_path / "inches.c3d", 2, DOWN, (0, 0, 0), channels, length="in"), "UNITS is 'in'; allowed: mm"),
        (plates_of(tmp_path / "seven.c3d", 7, DOWN, (0, 0, 0), channels), "type 7"),
        (plate, "plate 1 has channels 0 to 5; allowed: 1 to 6"),
        (plates_of(tmp_path / "six.c3d", 3, DOWN, (120, 200, -40), channels), "plate 1 is not described"),
        (plates_of(tmp_path / "middle.c3d", 3, DOWN, (0, 0, -40), np.zeros((8, 20))), "sensors at one place"),
    ):
        with pytest.raises(BadFile, match=words):
            read_force_file(path)


def test_plates_at_a_rate_that_no_floor_has_are_said_in_a_line(tmp_path):
    made = ezc3d.c3d(str(plates_of(tmp_path / "slow.c3d", 2, DOWN, (0, 0, 0), np.zeros((6, 20)))))
    made["parameters"]["POINT"]["RATE"]["value"], made["parameters"]["ANALOG"]["RATE"]["value"] = [1.0], [10.0]
    made.write(str(tmp_path / "slow.c3d"))
    with pytest.raises(BadFile, match=r"slow\.c3d: ANALOG:RATE is 10; allowed: 20 to 100000 Hz"):
        read_force_file(tmp_path / "slow.c3d")


def test_a_c3d_file_that_is_cut_is_refused_instead_of_read_in_part(tmp_path):
    path = plates_of(tmp_path / "lab.c3d", 2, DOWN, (0, 0, 0), np.ones((6, 2000)))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(BadFile, match=r"ends after \d+ of its 200 frames; allowed: a whole file"):
        read_force_file(path)


@pytest.mark.parametrize("name", ["TYPE", "CORNERS", "ORIGIN", "CHANNEL"])
def test_a_plate_that_is_not_described_is_said_in_a_line(tmp_path, name):
    path = plates_of(tmp_path / "lab.c3d", 2, DOWN, (0, 0, 0), np.zeros((6, 20)))
    made = ezc3d.c3d(str(path))
    made["parameters"]["FORCE_PLATFORM"][name]["value"] = made["parameters"]["FORCE_PLATFORM"][name]["value"][..., :0]
    made.write(str(path))
    with pytest.raises(BadFile, match="allowed: TYPE, CORNERS, ORIGIN and CHANNEL") as refused:
        read_force_file(path)
    assert "\n" not in str(refused.value)


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
    "name", ["csv", "floor.json", "steps.csv", "contacts.csv", "marks.csv", "stretch.csv", "calibrations.csv"]
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
