"""Tables of steps and contacts on disk: whole or not there."""

import csv
import math

import numpy as np
import pytest

from underfoot.errors import BadFile
from underfoot.floor.contacts import ContactRows
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import default_floor
from underfoot.records.tables import Table, contact_table, step_table

STEP = Step(1, "t1", "left", 0.2, 600.0, 760.0, 500.0, 740.0, 320.0, 7.25, 210.0, 200.0, spike=True)


def rows(*times):
    n = len(times)
    on_tile = np.tile([True, False, False, True], (n, 1))
    on_tile[:1, 3] = False
    places = np.linspace(0.1, 0.2, n)
    return ContactRows(np.array(times), np.arange(1, n + 1), places, -places, np.full(n, 123.4), on_tile)


def test_steps_are_written_under_the_columns_of_the_design(tmp_path):
    path = tmp_path / "steps.csv"
    with step_table(path) as write:
        write([STEP])
        write([])
        write([Step(2, "t4", "unknown", 0.75, 12.0, 1.0, 2.0, 3.0, 4.0, math.nan, 5.0, 6.0)])
    header, first, second = path.read_bytes().decode().split("\n")[:-1]
    known, _, added = header.partition(",person,")
    assert known == "step,tile,side,start_s,contact_ms,peak1_n,valley_n,peak2_n,impulse_ns,loading_kn_s,path_mm,net_mm"
    assert added == (
        "cadence_per_min,step_length_mm,step_width_mm,swing_ms,double_support_ms,heading_deg,heading_error_deg"
        ",spike,contact"
    )
    cells = dict(zip(header.split(","), first.split(","), strict=True))
    assert (cells["step"], cells["tile"], cells["side"]) == ("1", "t1", "left")
    assert [float(cells[name]) for name in ("start_s", "contact_ms", "valley_n", "loading_kn_s")] == [
        0.2,
        600,
        500,
        7.25,
    ]
    assert (cells["spike"], second.split(",")[-2:]) == ("1", ["0", "0"])
    assert second.split(",")[9] == ""


def test_words_of_a_table_come_back_as_they_were(tmp_path):
    columns = {
        "ground, wet": ["soft, wet", 'called "ice"', "of two\nlines", "of two\rlines"],
        "force_n": [1.0, 2.0, 3.0, 4.0],
    }
    Table("presses", columns).save(tmp_path / "presses.csv")
    with (tmp_path / "presses.csv").open(newline="") as file:
        header, *lines = csv.reader(file)
    assert header == [*columns]
    assert lines == [[word, f"{force:g}"] for word, force in zip(*columns.values(), strict=True)]


def test_contacts_are_written_a_line_for_each_contact_and_sample(tmp_path):
    path = tmp_path / "contacts.csv"
    with contact_table(path, default_floor()) as write:
        write(rows(0.001, 0.002))
        write(rows())
        write(rows(0.003))
    assert path.read_text().splitlines() == [
        "time_s,contact,x_m,y_m,force_n,tiles",
        "0.001000,1,0.100000,-0.100000,123.400,t1",
        "0.002000,2,0.200000,-0.200000,123.400,t1+t4",
        "0.003000,1,0.100000,-0.100000,123.400,t1",
    ]


def test_a_table_is_whole_or_not_there(tmp_path):
    path = tmp_path / "steps.csv"
    path.write_text("what was there")

    def broken_off():
        with step_table(path) as write:
            write([STEP])
            assert path.read_text() == "what was there"
            raise RuntimeError("stopped")

    with pytest.raises(RuntimeError, match="stopped"):
        broken_off()
    assert path.read_text() == "what was there"
    assert [file.name for file in tmp_path.iterdir()] == ["steps.csv"]
    with step_table(path) as write:
        write([STEP])
    assert path.read_text().startswith("step,tile")
    assert [file.name for file in tmp_path.iterdir()] == ["steps.csv"]


def test_a_live_table_is_there_with_all_its_lines_before_it_ends(tmp_path):
    """A process that is killed, or loses its power, leaves what it has written."""
    path = tmp_path / "steps.csv"
    path.write_text("what was there")
    with step_table(path, live=True) as write:
        write([STEP])
        lines = path.read_text().splitlines()
        assert [line.partition(",")[0] for line in lines] == ["step", str(STEP.step)]
        assert [file.name for file in tmp_path.iterdir()] == ["steps.csv"]


@pytest.mark.parametrize("name", ["no/steps.csv", "folder"])
def test_what_cannot_be_written_is_a_bad_file_that_leaves_nothing(tmp_path, name):
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadFile, match="cannot be written"), step_table(tmp_path / name) as write:
        write([STEP])
    assert [file.name for file in tmp_path.iterdir()] == ["folder"]


def test_an_error_of_the_block_is_not_taken_for_one_of_the_file(tmp_path):
    with pytest.raises(FileNotFoundError), step_table(tmp_path / "steps.csv"):
        (tmp_path / "missing").read_bytes()
