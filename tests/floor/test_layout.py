"""Floors: frames, distances and gaps of tiles, and their files."""

import json

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.errors import BadFile, BadValue
from underfoot.floor.layout import Floor, Tile, default_floor

SENSORS = ((0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))


def tile(id="a", centre=(0.0, 0.0), rotation=0.0, size=(0.3, 0.3)):
    return Tile(id, size, centre, rotation, SENSORS, 0.02)


def test_default_floor_has_the_tiles_of_the_thesis():
    floor = default_floor()
    assert floor.ids == ("t1", "t2", "t3", "t4")
    assert all(t.size_m == (0.305, 0.305) for t in floor.tiles)
    np.testing.assert_allclose(floor.tiles[3].corners_m().max(axis=0), [0.615, 0.615])
    assert np.abs(floor.sensors_m()).min() > 0.12
    assert len(default_floor(6, 6).tiles) == 36


def test_a_floor_of_arrays_and_lists_is_that_of_its_file(tmp_path):
    made = Tile("a", np.array([0.5, 1]), [1, 2], np.float32(90.0), np.array(SENSORS), 0, np.int64(3))
    floor = Floor([made])
    floor.save(tmp_path / "own.floor.json")
    assert Floor.load(tmp_path / "own.floor.json") == floor
    assert made == Tile("a", (0.5, 1.0), (1.0, 2.0), 90.0, SENSORS, 0.0, 3)
    assert len({floor, Floor((made,))}) == 1


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Tile("a", 0.3, (0, 0), 0.0, SENSORS), "size_m is 0.3; allowed: two lengths in metres"),
        (lambda: Tile("a", (0.3, 0.3), "here", 0.0, SENSORS), "centre_m is 'here'; allowed: two lengths in metres"),
        (lambda: Tile("a", (0.3, 0.3), (0, 0), 0.0, (1, 2, 3, 4)), "sensors_m is 1; allowed: two lengths in metres"),
        (lambda: Floor([1]), "tiles is (1,); allowed: Tiles"),
    ],
)
def test_what_is_no_tile_is_refused_in_a_line(make, said):
    with pytest.raises(BadValue) as refusal:
        make()
    assert str(refusal.value) == said


@pytest.mark.parametrize("rows", [0, 33])
def test_default_floor_refuses_sizes(rows):
    with pytest.raises(BadValue, match=f"rows is {rows}; allowed: a whole number, 1 to 32"):
        default_floor(rows)


@given(
    st.floats(-5, 5), st.floats(-5, 5), st.floats(-360, 360), st.floats(-1, 1), st.floats(-1, 1)
)  # fmt: skip
def test_frames_are_turned_and_shifted(x, y, degrees, along, across):
    one = tile(centre=(x, y), rotation=degrees)
    # Complex numbers turn counter-clockwise by their own rule.
    expected = complex(x, y) + complex(along, across) * np.exp(1j * np.radians(degrees))
    there = one.to_floor([along, across])
    np.testing.assert_allclose(there, [expected.real, expected.imag], atol=1e-12)
    np.testing.assert_allclose(one.to_tile(there), [along, across], atol=1e-12)


def test_distance_is_to_the_nearest_point_of_the_turned_tile():
    one = tile(centre=(1.0, 1.0), rotation=45.0)
    corner = 1.0 + 0.15 * np.sqrt(2.0)
    np.testing.assert_allclose(one.distance_m([[1.0, 1.1], [1.0, corner + 0.1]]), [0.0, 0.1], atol=1e-12)


def test_gaps_are_between_edges_whatever_the_rotation():
    floor = Floor((tile("a"), tile("b", (0.32, 0.0)), tile("c", (0.0, 0.5), 45.0), tile("d", (0.31, 0.33))))
    gaps = floor.gaps_m()
    np.testing.assert_allclose(gaps, gaps.T)
    np.testing.assert_allclose(gaps[0, 1], 0.02)
    np.testing.assert_allclose(gaps[0, 2], 0.35 - 0.15 * np.sqrt(2.0))
    np.testing.assert_allclose(gaps[0, 3], np.hypot(0.01, 0.03))


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"size_m": (0.3,)}, "size_m"),
        ({"centre_m": (0.0,) * 3}, "centre_m"),
        ({"sensors_m": ((0.1,),) * 4}, "sensors_m"),
    ],
)
def test_a_script_cannot_make_a_tile_of_points_that_are_none(changes, place):
    with pytest.raises(BadValue, match=f"{place} is .*allowed: two lengths"):
        msgspec.structs.replace(tile("a"), **changes)


def test_a_saved_floor_loads_as_it_was(tmp_path):
    floor = Floor((tile("a", (1.0, -2.0), -89.5), Tile("b", (0.4, 0.6), (0.0, 0.0), 0.0, SENSORS, 0.0, 3)), "two")
    floor.save(tmp_path / "a.floor.json")
    assert Floor.load(tmp_path / "a.floor.json") == floor
    document = json.loads((tmp_path / "a.floor.json").read_text())
    assert list(document)[:2] == ["format", "version"]
    assert "output" not in document["tiles"][0]
    assert [path.name for path in tmp_path.iterdir()] == ["a.floor.json"]


def test_optional_keys_may_be_absent():
    document = {"format": "underfoot-floor", "version": 1}
    document["tiles"] = [{"id": "a", "size_m": [1, 1], "centre_m": [0, 0], "sensors_m": SENSORS}]
    one = Floor.loads(json.dumps(document)).tiles[0]
    assert (one.rotation_deg, one.sensor_depth_m, one.output) == (0.0, 0.0, None)


def broken(change):
    document = json.loads(default_floor().dumps())
    change(document)
    return json.dumps(document)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda d: d.update(format="underfoot-patch"), "$.format is 'underfoot-patch'; allowed: 'underfoot-floor'"),
        (lambda d: d.update(version=2), "$.version is 2; allowed: 1 (a newer Underfoot may have written it)"),
        (lambda d: d.update(version=True), "$.version is true; allowed: 1"),
        (lambda d: d.update(tiles=[]), "$.tiles is (); allowed: at least one tile"),
        (lambda d: d.update(tiles={}), "$.tiles is {}; allowed: a list"),
        (lambda d: d["tiles"][1].update(id="t1"), "$.tiles[1].id is 't1'; allowed: an id that no other tile has"),
        (lambda d: d["tiles"][1].update(id="a.b"), "$.tiles[1].id is 'a.b'; allowed: letters, digits, - and _"),
        (lambda d: d["tiles"][1].pop("size_m"), "$.tiles[1]: object missing required field `size_m`"),
        (lambda d: d["tiles"][1].update(colour=1), "$.tiles[1]: object contains unknown field `colour`"),
        (
            lambda d: d["tiles"][2].update(size_m=[0.3, 0]),
            "$.tiles[2].size_m is (0.3, 0.0); allowed: two lengths above 0, up to 100 m",
        ),
        (lambda d: d["tiles"][2].update(size_m=[0.3, "x"]), "$.tiles[2].size_m[1] is 'x'; allowed: a number"),
        (
            lambda d: d["tiles"][0].update(centre_m=[float("nan"), 0]),
            "$.tiles[0].centre_m is (nan, 0.0); allowed: two lengths within 10 km of 0",
        ),
        (
            lambda d: d["tiles"][0].update(rotation_deg=float("inf")),
            "$.tiles[0].rotation_deg is inf; allowed: -3600 to 3600",
        ),
        (lambda d: d["tiles"][0].update(sensors_m=[[1, 1]]), "allowed: exactly four points"),
        (lambda d: d["tiles"][0].update(output=-1), "$.tiles[0].output is -1; allowed: a channel, 0 to 4095"),
        (lambda d: d["tiles"][0].update(output=10**400), "$.tiles[0].output"),
        (lambda d: d["tiles"][0].update(sensor_depth_m=10**400), "$.tiles[0].sensor_depth_m"),
    ],
)
def test_a_bad_floor_names_file_place_value_and_what_is_allowed(change, line):
    with pytest.raises(BadFile) as error:
        Floor.loads(broken(change), "a.floor.json")
    assert str(error.value).startswith("a.floor.json: $")
    assert line in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "{", b"\xff\xfe\x00", "[" * 100_000, '{"format": NaN'])
def test_what_is_not_json_is_a_bad_file(text):
    with pytest.raises(BadFile, match=r"^x is (not JSON|nested deeper than)"):
        Floor.loads(text, "x")


def test_a_missing_file_is_a_bad_file(tmp_path):
    with pytest.raises(BadFile, match="cannot be read"):
        Floor.load(tmp_path / "no.json")
