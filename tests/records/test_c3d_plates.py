"""Force plates of C3D files as other laboratories write them: floors and forces as another library reads them."""

from functools import partial

import ezc3d
import numpy as np
import pytest

from underfoot.errors import BadFile
from underfoot.records.force_files import read_force_file


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
