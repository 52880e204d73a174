"""Force CSVs: as written here, by spreadsheets and statistics, and with every kind of error."""

import numpy as np
import pytest
from measured import WALKS, needs_data, walk

from underfoot.errors import BadFile
from underfoot.floor.forces import load_floor_beside, read_forces
from underfoot.floor.layout import default_floor

FLOOR = default_floor(1, 2)
HEADER = "time_s,t1.1,t1.2,t1.3,t1.4,t2.1,t2.2,t2.3,t2.4"
ROWS = ["0,1,2,3,4,5,6,7,8", "0.001,1,2,3,4,5,6,7,-8.5", "0.002,1,2,3,4,5,6,7,8"]


def read(tmp_path, lines, end="\n"):
    path = tmp_path / "walk.csv"
    path.write_bytes(lines if isinstance(lines, bytes) else end.join(lines).encode())
    return read_forces(path, FLOOR)


def test_forces_come_tile_by_tile(tmp_path):
    forces = read(tmp_path, [HEADER, *ROWS])
    np.testing.assert_array_equal(forces.time_s, [0.0, 0.001, 0.002])
    np.testing.assert_array_equal(forces.force_n[1], [[1, 2, 3, 4], [5, 6, 7, -8.5]])
    assert forces.rate_hz == pytest.approx(1000.0)
    assert forces.force_n.flags.c_contiguous


def test_columns_may_stand_in_any_order(tmp_path):
    turned = [",".join(line.split(",")[::-1]) for line in [HEADER, *ROWS]]
    np.testing.assert_array_equal(read(tmp_path, turned).force_n, read(tmp_path, [HEADER, *ROWS]).force_n)


def test_a_table_that_memory_cannot_hold_is_refused_unread(tmp_path):
    """A terabyte that takes no room on the disk: zeros behind the first lines. Without a floor these are enough."""
    path = tmp_path / "walk.csv"
    path.write_text("\n".join([HEADER, *ROWS * 5000]))
    with path.open("ab") as file:
        file.truncate(1 << 40)
    with pytest.raises(BadFile, match=r"walk\.csv has 1099511627776 bytes; allowed: at most 536870912"):
        read_forces(path, FLOOR)
    with pytest.raises(BadFile, match="has no floor beside it"):
        load_floor_beside(path)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\n\n"])
def test_line_ends_and_blank_lines_do_not_matter(tmp_path, end):
    assert len(read(tmp_path, ["\ufeff" + HEADER, *ROWS, ""], end).time_s) == 3


def test_a_gap_stays_a_gap_and_does_not_change_the_rate(tmp_path):
    rows = [f"{time},1,2,3,4,5,6,7,8" for time in (0.0, 0.01, 0.02, 0.5, 0.51, 0.52)]
    forces = read(tmp_path, [HEADER, *rows])
    assert len(forces.time_s) == 6
    assert forces.rate_hz == pytest.approx(100.0)
    np.testing.assert_array_equal(forces.gaps(), [2])


@pytest.mark.parametrize(
    ("lines", "line"),
    [
        ([], "is empty; its first line must name the columns: time_s,t1.1,..."),
        ([HEADER], "has 0 samples; allowed: 2 or more"),
        ([HEADER, ROWS[0]], "has 1 sample; allowed: 2 or more"),
        ([HEADER.replace(",t2.4", ""), *ROWS], "line 1 has no column t2.4"),
        ([HEADER.replace("time_s", "t1.1"), *ROWS], "line 1 has no column time_s"),
        ([HEADER.replace("t2.4", "t2.3"), *ROWS], "line 1 has the column t2.3 2 times"),
        ([HEADER + ",t2.5", *ROWS], "line 1, column 10 is 't2.5'; allowed: t2.1 to t2.4, a tile has four sensors"),
        ([HEADER + ",t9.1", *ROWS], "line 1, column 10 is 't9.1'; allowed: tiles of the floor (t1, t2)"),
        ([HEADER, ROWS[0], ROWS[1].replace("3", "3x"), ROWS[2]], "line 3, column t1.3 is '3x'; allowed: a number"),
        ([HEADER, ROWS[0], "", ROWS[1].replace("3", "nan")], "line 4, column t1.3 is 'nan'; allowed: a number"),
        ([HEADER, ROWS[0], ROWS[1].replace("3", "1e999")], "line 3, column t1.3 is '1e999'; allowed: a number"),
        ([HEADER, ROWS[0], ROWS[1].replace("3", "1e13")], "t1.3 is '1e13'; allowed: a number, -1e+12 to 1e+12"),
        ([HEADER, ROWS[0], ROWS[1].replace("3", "1_0")], "line 3, column t1.3 is '1_0'; allowed: a number"),
        ([HEADER, ROWS[0], ROWS[1].replace("3", "")], "line 3, column t1.3 is ''; allowed: a number"),
        ([HEADER, ROWS[0], ROWS[1] + ",9"], "line 3 has 10 columns; allowed: 9 as in the first"),
        ([HEADER, ROWS[0], "0.001,1"], "line 3 has 2 columns; allowed: 9 as in the first"),
        ([HEADER, *(row + ",9" for row in ROWS)], "line 2 has 10 columns; allowed: 9 as in the first"),
        ([HEADER, ROWS[1], ROWS[2], ROWS[0]], "line 4, time_s is 0.0 after 0.002; allowed: a later time"),
        ([HEADER, ROWS[0], ROWS[0]], "line 3, time_s is 0.0 after 0.0; allowed: a later time"),
        ([HEADER, *(row.replace(",", ";") for row in ROWS)], "line 2 has 1 column; allowed: 9 as in the first"),
        ([HEADER, *(f"0,{n:03}{',1,5' * 8}" for n in range(3))],
         "line 2 has 18 columns; allowed: 9 as in the first (with decimal commas, semicolons or tabs between cells)"),
        ([HEADER.replace(",", " "), *(row.replace(",", " ") for row in ROWS)],
         "line 1 is a single cell; allowed: commas, semicolons or tabs between cells"),
        ([HEADER, *(f"{n},1,2,3,4,5,6,7,8" for n in range(3))],
         "time_s rises by 1 from line to line, 1 samples a second; allowed: 20 to 100000 a second, with time_s in"),
        (b"PK\x03\x04 a workbook", "is a workbook or another archive; save its sheet as CSV"),
        (b"\xff\xfea", "is not a force CSV: it is not UTF-8 text"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\xff", "is not a force CSV: it is not UTF-8 text"),
        (b"time_s,t1.1\0\n", "is not a force CSV: it is not UTF-8 text"),
    ],
)  # fmt: skip
def test_a_bad_file_names_the_place_in_one_line(tmp_path, lines, line):
    with pytest.raises(BadFile) as error:
        read(tmp_path, lines)
    assert str(error.value).startswith(str(tmp_path / "walk.csv"))
    assert line in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["no.csv", "."])
def test_what_cannot_be_read_is_a_bad_file(tmp_path, name):
    with pytest.raises(BadFile, match="cannot be read"):
        read_forces(tmp_path / name, FLOOR)


@needs_data
@pytest.mark.parametrize(
    ("name", "rate_hz"), [*zip(WALKS, (240, 240, 240, 1000, 1000), strict=True), ("floor14/floor", 160)]
)
def test_measured_walks_are_read_at_their_rates(name, rate_hz):
    floor, forces = walk(name)
    assert forces.rate_hz == pytest.approx(rate_hz, rel=2e-3)
    assert forces.force_n.shape[1:] == (len(floor.tiles), 4)
    assert (forces.force_n.min() < -4.0) == name.startswith(("adult", "floor14"))
    assert not len(forces.gaps())


@pytest.mark.parametrize("part", [",", ";", "\t"])
def test_files_as_people_have_them_say_the_same(tmp_path, part):
    """Remarks, further columns, empty lines, other marks between cells, and decimal commas beside these."""
    (tmp_path / "plain.csv").write_text("\n".join([HEADER, *ROWS]))
    lines = ["# walked on a Tuesday", part.join(["who", *HEADER.split(",")]), ""]
    for row in ROWS:
        cells = ["anna", *row.split(",")]
        lines += [part.join(cell if part == "," else cell.replace(".", ",") for cell in cells), "# half way"]
    (tmp_path / "theirs.csv").write_text("\n".join(lines))
    plain, theirs = (read_forces(tmp_path / name, FLOOR) for name in ("plain.csv", "theirs.csv"))
    np.testing.assert_array_equal(plain.time_s, theirs.time_s)
    np.testing.assert_array_equal(plain.force_n, theirs.force_n)


def decimal_commas(row, part):
    return part.join(cell.replace(".", ",") for cell in row.split(","))


THEIRS = {
    "Excel's first line": "\r\n".join(
        ['"# a; remark";;', "sep=;", HEADER.replace(",", ";"), *(decimal_commas(row, ";") for row in ROWS)]
    ),
    "a mark of their own": "\n".join(["sep=|", *(line.replace(",", "|") for line in [HEADER, *ROWS])]),
    "R's quotes": "\n".join([",".join(f'"{name}"' for name in HEADER.split(",")), *ROWS]),
    "decimal commas in quotes": "\n".join(
        [HEADER, *(",".join(f'"{cell.replace(".", ",")}"' for cell in row.split(",")) for row in ROWS)]
    ),
    "commas in names": "\n".join([f"{HEADER},who", *(f'{row},"Doe, Jane\t("' for row in ROWS)]),
    "a quote that does not end": "\n".join([f"{HEADER},who", *(f'{row},"Doe' for row in ROWS)]),
}


@pytest.mark.parametrize("name", THEIRS)
def test_files_of_spreadsheets_and_statistics_say_the_same(tmp_path, name):
    expected = read(tmp_path, [HEADER, *ROWS])
    found = read(tmp_path, THEIRS[name].encode())
    np.testing.assert_array_equal(found.time_s, expected.time_s)
    np.testing.assert_array_equal(found.force_n, expected.force_n)


@pytest.mark.parametrize("coding", ["utf-8-sig", "utf-16", "cp1252"])
def test_files_in_codes_of_other_programs_say_the_same(tmp_path, coding):
    text = "\n".join(["# gr\u00f6\u00dfer", f"{HEADER},Gr\u00f6\u00dfe", *(f"{row},1" for row in ROWS)])
    expected = read(tmp_path, [HEADER, *ROWS])
    np.testing.assert_array_equal(read(tmp_path, text.encode(coding)).force_n, expected.force_n)
