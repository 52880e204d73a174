"""Tables that people have, from spreadsheets and from a text editor."""

import pytest

from underfoot.csv_tables import read_csv_table
from underfoot.errors import BadFile
from underfoot.experiments.trial_files import read_csv

EXCEL = ["sep=;", "participant;method;trial;rating", "P1;rating;1;40,5", ";;;", '"P;2";rating;2;7']


@pytest.mark.parametrize(("coding", "end"), [("utf-8-sig", "\r\n"), ("utf-16", "\r\n"), ("utf-8", "\r")])
def test_a_table_is_read_as_excel_saves_it(tmp_path, coding, end):
    (tmp_path / "trials.csv").write_bytes(end.join(EXCEL).encode(coding))
    first, second = read_csv(tmp_path / "trials.csv")
    assert (first["rating"], second["participant"], second["rating"]) == (40.5, "P;2", 7)


def test_lines_keep_the_numbers_that_an_editor_shows(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text('"# a, remark",\n\na,b\n1,"two\nlines"\n# "5",\n3,4\n5\n')
    with pytest.raises(BadFile, match="line 8 has 1 column; allowed: 2 as in line 3"):
        read_csv_table(path, "a table", "#")
    path.write_text(path.read_text().removesuffix("5\n"))
    assert read_csv_table(path, "a table", "#").rows == [(5, ["1", "two\nlines"]), (7, ["3", "4"])]
    path.write_text('"a, in N";"b, in N"\n1,5;2\n')
    assert read_csv_table(path, "a table").names == ["a, in N", "b, in N"]
    path.write_text('a,b\n1,2\n"3"5,4\n')
    with pytest.raises(BadFile, match="is not a table: line 3: ',' expected after"):
        read_csv_table(path, "a table")
