"""Staircases: which of a person's trials count, and what is reported of them."""

import math
from collections import Counter

import pytest
from made_studies import TD, made_protocol, preset_protocol

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.analysis.staircase import staircases
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.study import Study
from underfoot.experiments.table import LEVEL, rows_of

pytest.importorskip("statsmodels")
PARAMETERS = {"followed": ["TD"], "catch_share": 0.3, "most_trials": 40}


def rows_with(false_alarms):
    """Return the protocol and the rows of one who feels what is above 2 dB, and nothing, at first, so many times."""
    protocol, left = made_protocol("staircases", PARAMETERS, {"TD": TD}), false_alarms
    study = Study(protocol, "P1")
    while not study.is_done:
        facts = study.page.trial.facts
        is_false = left > 0 and bool(facts.get("catch"))
        left -= is_false
        study.answer({"felt": "yes" if is_false or facts.get("level_db", -1000.0) > 2.0 else "no"})
    return protocol, rows_of(protocol, "P1", study.entries)


def test_what_was_answered_before_a_false_alarm_does_not_count():
    protocol, rows = rows_with(2)
    trials = [row for row in rows if row.get("staircase")]
    assert Counter(row["run"] for row in trials).keys() == {0, 1, 2}
    found = staircases(rows, Settings(given=PARAMETERS))
    for (_, _, which), run in found.items():
        assert run.levels_db == [row["level_db"] for row in trials if (row["staircase"], row["run"]) == (which, 2)]
        turns = zip(run.levels_db, run.levels_db[1:], run.levels_db[2:], strict=False)
        followed = [level for at, level in zip(run.turned_at, run.turns_db, strict=True) if run.levels_db[at + 1 :]]
        assert followed == [b for a, b, c in turns if (b - a) * (c - b) < 0.0]
    restarted = next(k for k, row in enumerate(rows, 1) if row.get("staircase") and row["run"] == 2)
    assert len(staircases(rows[:restarted], Settings(given=PARAMETERS))) == 1  # who leaves then has no other one left
    (result,) = analysed(rows, protocol, Settings(bootstrap=0))
    (drawing,) = result.drawings
    drawn = [(one.x.tolist(), one.y.tolist()) for one in drawing.series]
    for run, line, dots in zip(found.values(), drawn[::2], drawn[1::2], strict=True):
        assert line == (list(range(1, len(run.levels_db) + 1)), run.levels_db)
        assert dots == ([at + 1 for at in run.turned_at], run.turns_db)
    assert [(mark.axis, mark.at) for mark in drawing.lines] == [("y", result.tables[0].rows[0][2])]


def test_beside_silence_answers_are_right_and_the_thesis_asked_for_something_else():
    protocol = made_protocol("staircases", {"followed": ["TD"], "standard": "X", "down_after": 2, "pairs": 1})
    rows, _ = simulated_rows(protocol, 0, 1, {})
    each, over, *_ = analysed(rows, protocol, Settings())[0].tables
    assert each.note.endswith("The level tends to where 70.7 % of the answers are right.")
    assert over.note == ""


def test_who_guesses_up_to_the_highest_level_is_named_and_who_turns_there_as_it_is_felt_is_not():
    """Where half of the guesses are right, a staircase turns there, too: some dB below it was a threshold like any."""
    given = {"followed": ["TD"], "standard": "X", "down_after": 2, "highest_db": 18.0, "steps_db": [4.0, 1.0]}
    protocol = made_protocol("staircases", given)
    rows = simulated_rows(protocol, 0, 1, {})[0]
    for person, least_db in (("guesses", math.inf), ("feels", 17.5), ("finds", -math.inf)):
        study = Study(protocol, person)
        while not study.is_done:
            facts = study.page.trial.facts
            study.answer({"interval": facts["comparison_at"] if facts["level_db"] > least_db else "first"})
        rows += rows_of(protocol, person, study.entries)
    (found,) = analysed(rows, protocol, Settings())
    told = "Held by answers at the highest or lowest level, beyond which the threshold may lie"
    assert found.remarks == [f"{told}: guesses (TD), finds (TD)."]
    elsewhere = [row | {"level_db": row["level_db"] + 40.0} for row in rows]  # whose ends no protocol tells
    assert not any(told in remark for remark in analysed(elsewhere, None, Settings())[0].remarks)


def test_beside_a_standard_that_vibrates_the_point_of_equality_is_named_in_the_order_of_the_protocol():
    protocol = preset_protocol("intensity-equalisation")
    rows, _ = simulated_rows(protocol, 0, 1, {})
    each, over, *_ = analysed(rows, protocol, Settings())[0].tables
    assert each.title == "Points of subjective equality (PSE) of each person"
    assert each.note.endswith("The level tends to where 50 % of the answers name the comparison.")
    assert [row[1] for row in each.rows] == [f"pse {name}" for name in protocol.stimuli if name != "WC"]
    assert [row[0] for row in over.rows] == ["dB", "m/s^2"] * len(each.rows)
    unmeasured = [{name: value for name, value in row.items() if name != LEVEL} for row in rows]
    assert {row[0] for row in analysed(unmeasured, protocol, Settings())[0].tables[1].rows} == {"dB"}
    renamed = [row | {"comparison": row["comparison"].replace("TD", "mine")} for row in rows]  # as a table can have it
    (other, *_) = analysed(renamed, protocol, Settings())[0].tables
    assert [row[1] for row in other.rows] == [*(row[1] for row in each.rows if row[1] != "pse TD"), "pse mine"]


def test_false_alarms_are_counted_of_the_trials_without_a_stimulus():
    protocol, rows = rows_with(2)
    tables = {table.title: table for table in analysed(rows, protocol, Settings(bootstrap=0))[0].tables}
    assert tables["False alarms"].rows == (("P1", 2, sum(bool(row.get("catch")) for row in rows)),)
    assert tables["False alarms"].note == "Thesis 6.4.2: median 1.5."
    assert tables["Thresholds over people"].note == "Thesis 6.4.2: 0.46 m/s^2 peak, standard deviation 0.18."
