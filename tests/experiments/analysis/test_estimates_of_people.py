"""A table of people for statistics programs: what they were asked, and what came of their trials."""

import csv

import numpy as np
import pytest
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.experiments.trial_files import write_csv

pytest.importorskip("statsmodels")


def rating(person, trial, stimulus, value, **more):
    row = {"participant": person, "stage": "main", "method": "rating", "trial": trial, "stimulus": stimulus}
    return {**row, "rating": value, "participant.age": 20 + int(person[1:]), **more}


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
    write_csv(tmp_path / "trials.csv", [*rows, *aside])
    trials, people = str(tmp_path / "trials.csv"), str(tmp_path / "people.csv")
    done = CliRunner().invoke(cli, ["analyse", trials, "--estimates", people])
    assert done.exit_code == 0, done.exception
    header, *lines = csv.reader((tmp_path / "people.csv").read_text().splitlines())
    assert header == ["participant", "participant.age", "main.rating TD", "main.rating X"]
    assert [line[:2] for line in lines] == [["P1", "21"], ["P2", "22"], ["P3", "23"]]
    for person, *_, of_td, of_x in lines:
        for cell, name in ((of_td, "TD"), (of_x, "X")):
            of = [row["rating"] for row in rows if (row["participant"], row["stimulus"]) == (person, name)]
            assert (float(cell) == pytest.approx(np.mean(of))) if of else cell == ""
