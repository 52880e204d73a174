"""Ratings: of conditions with factors and without, such as materials, and of patches whose level is not known."""

import numpy as np
import pytest
from made_studies import TD, made_protocol
from scipy import stats

from underfoot.errors import BadFile
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.plan import plan_of
from underfoot.experiments.simulation import simulated_rows

pytest.importorskip("statsmodels")

MATERIALS = {name: {"patch": "snow"} for name in ("wool", "felt", "cork", "ash")}


def rated(stimuli, people=5):
    """A protocol of three blocks, and the answers of simulated people."""
    made = made_protocol("rating", {"blocks": 3, "rated": list(stimuli)}, stimuli)
    return made, [row for person in range(people) for row in simulated_rows(made, person, 1, {})[0]]


def test_a_patch_that_plays_as_it_is_has_no_level_unless_it_was_measured():
    """It was 0 in tables: the first by name was taken for the plate that does not vibrate."""
    as_it_is = {**MATERIALS, "paper": {"patch": "snow", "measured_m_s2": 1.5}}
    made, rows = rated({**as_it_is, "X": {}, "TD": TD})
    levels = {row["stimulus"]: row.get("level_m_s2") for row in rows}
    assert levels == {**dict.fromkeys(MATERIALS), "paper": 1.5, "X": 0.0, "TD": TD["level_m_s2"]}
    assert {line["level_m_s2"] for line in plan_of(made, "P1") if line["stimulus"] in MATERIALS} == {"not known"}
    (found,) = analysed(rows, made, Settings())
    assert [table.title for table in found.tables if table.title.startswith("Each")] == ["Each against X"]
    titles = [table.title for table in analysed(rated(as_it_is)[1], None, Settings())[0].tables]
    assert titles == ["Means over people", "Effects of stimulus", "Each against each"]
    with pytest.raises(BadFile, match=r"reaches 40 m/s\^2 with loud; allowed: up to limit_m_s2"):
        made_protocol("rating", {}, {"loud": {"patch": "snow", "measured_m_s2": 40.0}})


def test_conditions_without_factors_are_compared_with_each_other_in_the_order_of_the_protocol():
    """Sums of squares by hand."""
    made, rows = rated(MATERIALS)
    (found,) = analysed(rows, made, Settings())
    means, effects, pairs = found.tables
    assert [line[0] for line in means.rows] == list(MATERIALS)
    cells = [
        [row["rating"] for row in rows if (row["participant"], row["stimulus"]) == (f"S{k}", name)]
        for k in range(1, 6)
        for name in MATERIALS
    ]
    scores = np.mean(cells, axis=1).reshape(5, 4)
    people, conditions = scores.mean(axis=1, keepdims=True), scores.mean(axis=0)
    error = ((scores - people - conditions + scores.mean()) ** 2).sum()
    f = (5 * ((conditions - scores.mean()) ** 2).sum() / 3) / (error / 12)
    assert effects.title == "Effects of stimulus"
    assert effects.rows[0][:4] == ("stimulus", "F", pytest.approx(f), "3, 12")
    p = stats.ttest_rel(scores[:, 0], scores[:, 2]).pvalue
    assert (len(pairs.rows), *pairs.rows[1][:5:4]) == (6, "wool - cork", pytest.approx(6.0 * p))
    first = scores[:, 0]
    assert means.rows[0][2:] == (pytest.approx(first.mean()), *means.rows[0][3:6], pytest.approx(first.std(ddof=1)), 5)
    apart = stats.ttest_rel(first, scores[:, 2]).confidence_interval()
    assert pairs.rows[1][-3:] == pytest.approx(((first - scores[:, 2]).mean(), *apart))
    (drawing,) = found.drawings
    assert (drawing.title, drawing.x_names) == ("Rating by stimulus", ("wool", "felt", "cork", "ash"))


def test_ratings_of_some_combinations_say_why_their_factors_are_not_tested():
    cells = [("a", "heel", "soft"), ("b", "heel", "loud"), ("c", "toe", "soft"), ("d", "toe", "loud")]
    columns = ("participant", "method", "trial", "stimulus", "place", "force", "rating")
    for shown, remarks in ((cells, []), (cells[:3], ["Effects of place, force: the test needs all combinations"])):
        rows = [
            dict(zip(columns, (person, "rating", trial, *cell, 10 * person + person % 2 * trial), strict=True))
            for person in (1, 2, 3)
            for trial, cell in enumerate(shown)
        ]
        (found,) = analysed(rows, None, Settings())
        assert [remark.partition(" of their")[0] for remark in found.remarks] == remarks
        tested = [table.note for table in found.tables if table.title == "Effects of place, force"]
        assert len(tested) == 1 - len(remarks)
        assert all("sphericity" in note for note in tested)
