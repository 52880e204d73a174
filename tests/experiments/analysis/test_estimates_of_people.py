"""A table of people for statistics programs: what they were asked, and what came of their trials."""

import csv
import math

import numpy as np
import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.experiments.trial_files import write_csv

pytest.importorskip("statsmodels")


def rating(person, trial, stimulus, value, **more):
    row = {"participant": person, "stage": "main", "method": "rating", "trial": trial, "stimulus": stimulus}
    asked = {"participant.age": 20 + int(person[1:])} | ({} if person == "P1" else {"participant.shoes": "soft"})
    return {**row, "rating": value, **asked, **more}


def setting(person, trial, level_db):
    row = {"participant": person, "stage": "set", "method": "adjustment", "trial": trial, "series": "ascending"}
    return {**row, "comparison": "TD", "level_db": level_db}


def test_who_has_estimates_is_a_row_and_an_estimate_that_is_lacking_an_empty_cell(tmp_path):
    """Means by hand; practice, spoiled trials, and sessions that were left out, count here no more than elsewhere."""
    random = np.random.default_rng(3)
    rows = [
        rating(f"P{person}", trial, name, float(random.integers(100)))
        for person in (1, 2, 3)
        for trial, name in enumerate(("TD", "X") * 3)
        if (person, name) != (3, "X")
    ]
    aside = [
        rating("P1", 9, "TD", 100.0, spoiled="telephone"),
        rating("P1", 10, "TD", 100.0, practice=True),
        rating("P4", 1, "TD", 100.0, spoiled="left out: loose shoe"),
    ]
    set_to = [setting("P1", 1, 2.0), setting("P2", 1, 2.0), setting("P2", 2, 4.0)]  # one alone has no deviation
    write_csv(tmp_path / "trials.csv", [*rows, *aside, *set_to])
    trials, people = str(tmp_path / "trials.csv"), str(tmp_path / "people.csv")
    done = CliRunner().invoke(cli, ["analyse", trials, "--estimates", people])
    assert done.exit_code == 0, done.exception
    header, *lines = csv.reader((tmp_path / "people.csv").read_text().splitlines())
    asked, estimates = ["age", "shoes"], ["main.rating TD", "main.rating X", "set.threshold TD (dB)", "set.SD TD (dB)"]
    assert header == ["participant", *(f"participant.{name}" for name in asked), *estimates]
    assert [line[:2] for line in lines] == [["P1", "21"], ["P2", "22"], ["P3", "23"]]
    assert [line[-2:] for line in lines] == [["2.0", ""], ["3.0", repr(math.sqrt(2.0))], ["", ""]]
    for person, _, _, of_td, of_x, *_ in lines:
        for cell, name in ((of_td, "TD"), (of_x, "X")):
            of = [row["rating"] for row in rows if (row["participant"], row["stimulus"]) == (person, name)]
            assert (float(cell) == pytest.approx(np.mean(of))) if of else cell == ""
