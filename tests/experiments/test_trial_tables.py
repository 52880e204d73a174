"""Tables of trials from other programs: what they say is read, and what they cannot say is one line."""

import pytest
from made_studies import preset_protocol

from underfoot.errors import BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.trial_files import csv_text
from underfoot.studies.results import results_of

HEADER = "participant,method,trial"


def analysis_of(tmp_path, text):
    path = tmp_path / "trials.csv"
    path.write_text(text)
    return analysed(results_of([path]).rows, None, Settings(bootstrap=0))


@pytest.mark.parametrize(
    ("method", "columns", "cells", "said"),
    [
        (
            "absolute-identification",
            "number,correct",
            "x,2",
            "trial 1 of P1: number is 'x'; allowed: a whole number",
        ),
        (
            "absolute-identification",
            "number,correct",
            "0,2",
            "trial 1 of P1: number is 0; allowed: a whole number",
        ),
        ("rating", "stimulus,rating", "a,soft", "trial 1 of P1: rating is 'soft'; allowed: a number"),
        ("rating", "stimulus,rating", "a,nan", "trial 1 of P1: rating is nan; allowed: a number"),
        ("staircases", "staircase,comparison,level_db", "above,TD,", "columns is 'level_db'; allowed: a table of"),
    ],
)
def test_a_cell_that_cannot_be_is_named_with_its_trial(method, columns, cells, said, tmp_path):
    with pytest.raises(BadValue) as raised:
        analysis_of(tmp_path, f"{HEADER},{columns}\nP1,{method},1,{cells}\n")
    assert str(raised.value).startswith(said)


def test_a_row_that_lacks_what_the_others_have_is_one_line(tmp_path):
    with pytest.raises(BadValue, match=r"does not fit rating .* rows that all have stimulus, rating") as raised:
        analysis_of(tmp_path, f"{HEADER},stimulus,rating\nP1,rating,1,a,5\nP1,rating,2,a,\n")
    assert "\n" not in str(raised.value)


def test_words_that_look_like_numbers_stay_words(tmp_path):
    rows = "P1,free-labels,1,7,12\nP1,free-labels,2,hum,12\nP2,free-labels,1,7,twelve\n"
    (found,) = analysis_of(tmp_path, f"{HEADER},stimulus,label\n{rows}")
    assert found.tables[0].rows == (("7", "12, twelve"), ("hum", "12"))


def test_a_trial_that_two_files_have_counts_once(tmp_path):
    text = csv_text(simulated_rows(preset_protocol("identification-impact"), 0, 1, {})[0])
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in paths:
        path.write_text(text)
    with pytest.raises(BadValue, match=r"b\.csv: S1's trial 1 of main is in a file before it, too"):
        results_of(paths)
    paths[1].write_text(text.replace("S1,", "S2,"))
    assert len(results_of(paths).rows) == 2 * len(results_of(paths[:1]).rows)
