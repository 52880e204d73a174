"""Tables of measurements: what is read, what is written, and what is wrong with them."""

import numpy as np
import pytest

from underfoot.calibration.files.measurements import Pairs, Presses, read_pairs, read_presses, table
from underfoot.errors import BadFile, BadValue

PAIRS = "time_s,tile,sensor,reading,force_n\n"
PRESSES = "tile,x_m,y_m,force_n,r1,r2,r3,r4\n"


def refused(tmp_path, text, reader=read_pairs, **more):
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(BadFile) as error:
        reader(path, **more)
    assert "\n" not in str(error.value)
    return str(error.value).partition("table.csv")[2]


def test_columns_may_stand_in_any_order_beside_others(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("force_n,note,tile,sensor,reading,time_s\n10,a,t1,1,2000,0.5\n\n20,b,t1,4,3000,0.25\n")
    found = read_pairs(path)
    assert found.tile == "t1"
    assert found.rows().tolist() == [[0.5, 1.0, 2000.0, 10.0], [0.25, 4.0, 3000.0, 20.0]]


@pytest.mark.parametrize(
    "text",
    [
        "time_s;tile;sensor;reading;force_n\n0.5;t1;2;2000;10\n",
        "time_s\ttile\tsensor\treading\tforce_n\n0.5\tt1\t2\t2000\t10\n",
        '"Time_s","Tile","Sensor","Reading","Force_N","note"\n"0.5","t1","2","2000","10","a, b"\n',
        "# Monday, 3 o'clock\n" + PAIRS + "# a break\n0.5, t1, 2, 2000, 10\n",
    ],
)
def test_tables_as_spreadsheets_write_them(tmp_path, text):
    path = tmp_path / "pairs.csv"
    path.write_text(text)
    assert read_pairs(path).rows().tolist() == [[0.5, 2.0, 2000.0, 10.0]]


def test_what_is_wrong_of_another_tile_does_not_matter(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text(PAIRS + "0,t1,1,5,0\n0,t2,9,6,0\n")
    assert read_pairs(path, "t1").reading.tolist() == [5.0]
    assert "line 3, sensor is 9" in refused(tmp_path, path.read_text(), tile="t2")


def test_a_tile_is_picked(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text(PAIRS + "0,t1,1,5,0\n0,t2,2,6,0\n")
    assert read_pairs(path, "t2").reading.tolist() == [6.0]
    assert "2 tiles; name one with --tile: t1, t2" in refused(tmp_path, path.read_text())
    assert "has no tile t3; allowed: t1, t2" in refused(tmp_path, path.read_text(), tile="t3")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", ": line 1 has no column time_s"),
        (PAIRS, " has no line under its header"),
        ("time_s,tile,sensor,reading\n0,t1,1,3\n", ": line 1 has no column force_n"),
        (PAIRS + "0,t1,1,abc,0\n", ": line 2, reading is 'abc'; allowed: a number"),
        (PAIRS + "0,t1,1,1e10,0\n", ": line 2, reading is '1e10'; allowed: a number, -1e+09 to 1e+09"),
        (PAIRS + "0,t1,1,5,0\n1,t1,1,5,nan\n", ": line 3, force_n is 'nan'; allowed: a number"),
        (PAIRS + "0,t1,1,5,0\n1,t1,1,5\n", ": line 3 has 4 columns; allowed: 5 as in line 1"),
        (PAIRS + "0,t1,5,5,0\n", ": line 2, sensor is 5; allowed: 1 to 4"),
        (PAIRS + "0,t1,1,70000,0\n", ": line 2, reading is 70000; allowed: 0 to 65535"),
        (b"\xe9", " is not a table of measurements: it is not UTF-8 text; save it as CSV, UTF-8"),
        (b"time_s,tile,sensor,reading,force_n\n" + bytes(1000), "it is not UTF-8 text"),
        (
            PAIRS + f'0,t1,1,"{"5" * 140_000}",0\n',
            " is not a table of measurements: line 2: field larger than field limit",
        ),
    ],
)
def test_what_is_wrong_with_pairs_is_said_in_one_line(tmp_path, text, said):
    assert said in refused(tmp_path, text)


def test_presses_press(tmp_path):
    path = tmp_path / "presses.csv"
    rows = np.array([[0.01, -0.02, 100.0, 1.0, 2.0, 3.0, -4.0]])
    path.write_bytes(table("tile,x_m,y_m,force_n,r1,r2,r3,r4", rows, "t7"))
    found = read_presses(path)
    assert found.tile == "t7"
    assert np.array_equal(found.rows(), rows)
    assert "force_n is 0; allowed: above 0" in refused(tmp_path, PRESSES + "t1,0,0,0,1,2,3,4\n", read_presses)


@pytest.mark.parametrize("between", [";", "\t"])
def test_tables_may_have_decimal_commas(tmp_path, between):
    path = tmp_path / "pairs.csv"
    path.write_text(PAIRS.replace(",", between) + between.join(["0,099", "t1", "1", "782", "12,5"]) + "\n")
    assert read_pairs(path).rows().tolist() == [[0.099, 1.0, 782.0, 12.5]]


def test_a_script_may_give_lists_and_its_arrays_stay_as_they_are():
    sensor = np.array([0.0, 3.0])
    found = Pairs("t1", [0, 1], sensor, [2000, 3000], (10, 20))
    assert found.rows().tolist() == [[0.0, 1.0, 2000.0, 10.0], [1.0, 4.0, 3000.0, 20.0]]
    assert sensor.dtype == float
    assert Presses("t1", [[0, 0.1]], [50], [[1, 2, 3, 4]], [[5, 6, 7, 8]]).rows().shape == (1, 11)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"sensor": [1, 4]}, "sensor is 4; allowed: 0 to 3, for the sensors that files number 1 to 4"),
        ({"sensor": [0.5, 1.0]}, "sensor is 0.5; allowed: 0 to 3"),
        ({"reading": [2000.0]}, "the shape of reading is (1,); allowed: (2,)"),
        ({"reading": [[2000.0], [3000.0]]}, "the shape of reading is (2, 1); allowed: (2,)"),
        ({"reading": [2000.0, np.nan]}, "reading is array([2000., nan]); allowed: finite numbers"),
        ({"force_n": [10.0, np.inf]}, "force_n is array([10., inf]); allowed: finite numbers"),
        ({"force_n": ["ten", "twenty"]}, "force_n is no array of numbers"),
    ],
)
def test_pairs_of_a_script_that_are_none_are_refused(change, message):
    columns = {"time_s": [0.0, 1.0], "sensor": [0, 0], "reading": [2000.0, 3000.0], "force_n": [10.0, 20.0], **change}
    with pytest.raises(BadValue) as refusal:
        Pairs("t1", **columns)
    assert str(refusal.value).startswith(message)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"at_m": [0.0, 0.1]}, "the shape of at_m is (2,); allowed: (2, 2)"),
        ({"readings": [[1.0] * 4]}, "the shape of readings is (1, 4); allowed: (2, 4)"),
        ({"newtons": [[1.0] * 3] * 2}, "the shape of newtons is (2, 3); allowed: (2, 4) or (2, 8)"),
        ({"force_n": [50.0, np.nan]}, "force_n is array([50., nan]); allowed: finite numbers"),
    ],
)
def test_presses_of_a_script_that_are_none_are_refused(change, message):
    columns = {"at_m": [[0.0, 0.0], [0.1, 0.0]], "force_n": [50.0, 60.0], "readings": [[1.0] * 4] * 2, **change}
    with pytest.raises(BadValue) as refusal:
        Presses("t1", **columns)
    assert str(refusal.value) == message
