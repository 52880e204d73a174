"""Confusions of stimuli that were told apart, by number or by word."""

from statistics import stdev

import numpy as np
import pytest
from made_studies import TD, made_protocol
from scipy.stats import f_oneway, ttest_rel

from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.identification import findings
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of

pandas = pytest.importorskip("pandas")
ols = pytest.importorskip("statsmodels.formula.api").ols


def findings_of(stimuli, parameters, answer, trials):
    """Return the findings of so many first trials, each answered by `answer(trial)`."""
    protocol = made_protocol("absolute-identification", parameters, stimuli)
    study = Study(protocol, "P1")
    for _ in range(trials):
        study.answer(answer(study.page.trial))
    return analysed(rows_of(protocol, "P1", study.entries), protocol, Settings(bootstrap=0))[0]


def confusions(findings):
    return next(table for table in findings.tables if "answers to each stimulus" in table.title)


def test_after_the_first_answers_all_stimuli_have_their_names_and_chance_is_of_all():
    names = tuple("abcdefgh")
    found = findings_of(dict.fromkeys(names, TD), {}, lambda trial: {"number": 1}, trials=4)
    table = confusions(found)
    assert table.columns == ("stimulus", *names)
    assert [row[0] for row in table.rows] == list(names)
    assert found.drawings[0].lines[0].at == 1 / 8


def test_a_number_is_counted_beside_the_stimulus_that_was_presented_and_rates_are_those_of_each_session():
    """In the first session everybody says the next number, in the second one the right one."""
    parameters = {"sessions": 2, "repeats": 1}
    found = findings_of(
        dict.fromkeys("abcd", TD),
        parameters,
        lambda trial: {"number": min(trial.correct + 1, 4) if trial.block == 1 else trial.correct},
        trials=8,
    )
    assert confusions(found).rows == (("a", 1, 1, 0, 0), ("b", 0, 1, 1, 0), ("c", 0, 0, 1, 1), ("d", 0, 0, 0, 2))
    (rates,) = (table for table in found.tables if table.title == "All")
    assert [row[2] for row in rates.rows[:3]] == [0.625, 0.25, 1.0]


def test_right_answers_in_words_are_on_the_diagonal_whatever_the_order_of_trials():
    words = ("sand", "snow", "ice", "wood", "leaf")
    stimuli = {f"s{place}": {**TD, "correct": word} for place, word in enumerate(reversed(words))}
    parameters = {"answers": words, "sessions": 1, "repeats": 2}
    table = confusions(findings_of(stimuli, parameters, lambda trial: {"answer": trial.correct}, trials=10))
    assert table.columns == ("stimulus", *words)
    assert table.rows == tuple(
        (f"s{4 - place}", *(2 if k == place else 0 for k in range(5))) for place in range(5)
    )  # the last stimulus is of the first word


def compared(rates, who):
    """Return the tests between sets of people with these numbers of right answers in ten; `who(set, k)` is the k-th."""
    rows = [
        {"participant": who(name, k), "set": name, "block": 1, "correct": 1, "number": 1 if trial < right else 2}
        for name, rights in rates.items()
        for k, right in enumerate(rights)
        for trial in range(10)
    ]
    found = findings(rows, Settings(given={"identified": ["a", "b"]}))
    for table in found.tables:
        if (name := table.title.removeprefix("Set ")) in rates:
            assert f"Standard deviation of people: {stdev(rates[name]) / 10:.3g}." in table.note
    (tests,) = (table for table in found.tables if table.title == "Do the sets differ?")
    return tests


def test_sets_that_other_people_were_given_are_tested_against_each_other():
    tests = compared({"A": (9, 8, 7), "B": (4, 3, 2)}, lambda name, k: f"{name}{k}")
    plain = f_oneway([0.9, 0.8, 0.7], [0.4, 0.3, 0.2])
    assert [row[0] for row in tests.rows] == ["all sessions", "session 1"]
    assert [row[2] for row in tests.rows] == [pytest.approx(plain.statistic)] * 2
    assert tests.note == ""


def test_sets_that_the_same_people_were_given_are_tested_within_these():
    """They were taken for different people, whose differences hid what the sets differ by."""
    tests = compared({"A": (9, 8, 5), "B": (7, 5, 4, 6)}, lambda name, k: f"P{k}")
    t = ttest_rel([0.9, 0.8, 0.5], [0.7, 0.5, 0.4])
    assert [row[1:5] for row in tests.rows] == [
        ("F", pytest.approx(t.statistic**2), "1, 2", pytest.approx(t.pvalue))
    ] * 2
    assert tests.note == "Repeated measures of who had all sets. Left out: P3."
    tests = compared(dict.fromkeys("ABC", (9, 8, 5)) | {"C": (4, 2, 3)}, lambda name, k: f"P{k}")
    assert [row[0] for row in tests.rows][:2] == ["all sessions", "all sessions, corrected"]


def rows_of_stages(rates):
    """Return ten trials of each person in each stage, of which so many are right."""
    return [
        {"participant": f"P{k}", "stage": stage, "method": "absolute-identification", "trial": trial, "block": 1,
         "stimulus": "a", "correct": 1, "number": 1 if trial < right else 2}
        for stage, rights in rates.items()
        for k, right in enumerate(rights)
        for trial in range(10)
    ]  # fmt: skip


def test_groups_are_compared_in_what_changed_from_the_first_stage_to_a_later_one():
    """Of a pretest and a posttest, the test of the change is that of the interaction of group and stage."""
    rates = {"pre": (4, 5, 3, 5, 4, 4), "post": (8, 9, 9, 6, 4, 5)}
    groups = ["trained"] * 3 + ["control"] * 3
    rows = [row | {"participant.group": groups[int(row["participant"][1:])]} for row in rows_of_stages(rates)]
    *_, found = analysed(rows, None, Settings())
    by_group, tests = found.tables[-2:]
    assert by_group.title == "Groups by group"
    assert by_group.rows[0] == ("rate, post - pre", "trained", 3, pytest.approx((0.4 + 0.4 + 0.6) / 3))
    data = {"rate": np.ravel([*rates.values()]) / 10, "who": [*range(6)] * 2}
    data |= {"post": np.repeat([0.0, 1.0], 6), "both": [0.0] * 6 + [float(one == "trained") for one in groups]}
    mixed = ols("rate ~ C(who) + post + both", pandas.DataFrame(data)).fit()
    t, p = mixed.tvalues["both"], mixed.pvalues["both"]
    test = next(row for row in tests.rows if row[0] == "rate, post - pre, group")
    assert test[:5] == ("rate, post - pre, group", "F", pytest.approx(t**2), "1, 4", pytest.approx(p))


def test_stages_that_the_same_people_did_are_compared_within_these():
    rows = rows_of_stages({"with": (9, 8, 5), "without": (7, 5, 4)})
    *_, found = analysed(rows, None, Settings())
    assert found.title == "Absolute identification: with, without compared"
    means, tests = found.tables
    assert means.rows[0] == ("rate", pytest.approx(2.2 / 3), pytest.approx(1.6 / 3))
    t = ttest_rel([0.9, 0.8, 0.5], [0.7, 0.5, 0.4])
    assert tests.rows[0][:5] == ("rate", "F", pytest.approx(t.statistic**2), "1, 2", pytest.approx(t.pvalue))
    alone = [row for row in rows if row["participant"] == "P0"]
    assert [one.title.partition(": ")[2] for one in analysed(alone, None, Settings())] == ["with", "without"]
