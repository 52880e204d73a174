"""Magnitude estimation: powers of the level are found, whatever numbers a person likes."""

import math

import numpy as np
import pytest
from made_studies import TD, made_protocol, walked
from scipy import stats

from underfoot.errors import BadValue
from underfoot.experiments.analysis import magnitudes
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.duration import usual_s
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.study import Study

LEVELS = (0.1, 0.2, 0.4, 0.8)


def numbers_of(person, random, exponents={"sand": 0.6}, modulus=1.0, spread=0.3, repeats=4):  # noqa: B006
    """Numbers that follow a power law, with a log-normal error."""
    return [
        {
            "participant": person,
            "method": "magnitude-estimation",
            "trial": 1,
            "stimulus": f"{texture}{level}",
            "texture": texture,
            "level_m_s2": level,
            "magnitude": modulus * level**exponent * math.exp(spread * random.standard_normal()),
        }
        for texture, exponent in exponents.items()
        for level in LEVELS
        for _ in range(repeats)
    ]


def table_of(found, title):
    (table,) = (table for table in found.tables if table.title == title)
    return table


def test_the_exponent_and_its_interval_are_those_of_a_line_through_logarithms():
    rows = numbers_of("P1", np.random.default_rng(1))
    (exponent,) = (one for one in magnitudes.estimates(rows, Settings()) if one.name == "exponent")
    expected = stats.linregress(*(np.log([row[name] for row in rows]) for name in ("level_m_s2", "magnitude")))
    half = expected.stderr * stats.t.ppf(0.975, len(rows) - 2)
    assert exponent.value == pytest.approx(expected.slope)
    assert (exponent.low, exponent.high) == pytest.approx((expected.slope - half, expected.slope + half))


def test_who_says_the_same_number_to_all_has_an_exponent_of_zero():
    """What rounding left of a mean had an interval without 0: all answers alike were an effect."""
    exponent, *_ = magnitudes.estimates(numbers_of("P1", np.random.default_rng(1), {"sand": 0.0}, 7.0, 0.0), Settings())
    assert (exponent.value, exponent.low, exponent.high) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["exponent", "magnitude sand0.1", "magnitude sand0.4"])
def test_intervals_of_one_person_hold_the_truth_as_often_as_they_say(name):
    random, held = np.random.default_rng(2), 0
    middle = math.exp(np.log(LEVELS).mean())
    truth = 0.6 if name == "exponent" else (float(name[-3:]) / middle) ** 0.6
    for _ in range(1000):
        found = magnitudes.estimates(numbers_of("P1", random, modulus=70.0), Settings())
        held += next(one for one in found if one.name == name).covers(truth)
    assert stats.binomtest(held, 1000, 0.95).pvalue > 0.01


def test_a_modulus_changes_nothing_and_the_geometric_mean_over_people_is_taken():
    random = np.random.default_rng(3)
    people = [numbers_of(f"P{k}", random) for k in range(8)]
    scaled = [[{**row, "magnitude": 10.0 ** (k - 3) * row["magnitude"]} for row in of] for k, of in enumerate(people)]
    over = []
    for rows in (people, scaled):
        (found,) = analysed([row for of in rows for row in of], None, Settings())
        over.append(table_of(found, "Magnitudes over people").rows)
    for one, other in zip(*over, strict=True):
        assert one[2:5] == pytest.approx(other[2:5])
    logs = np.array([[np.log([r["magnitude"] for r in of[k : k + 4]]).mean() for k in (0, 4, 8, 12)] for of in people])
    relative = logs - logs.mean(axis=1, keepdims=True)
    assert [row[2] for row in over[0][1:]] == pytest.approx(np.exp(relative.mean(axis=0)).tolist())
    low, high = stats.t.interval(0.95, 7, relative[:, 0].mean(), stats.sem(relative[:, 0]))
    assert over[0][1][3:5] == pytest.approx((math.exp(low), math.exp(high)))


def test_each_condition_has_an_exponent_and_they_are_compared():
    random = np.random.default_rng(4)
    rows = [row for k in range(10) for row in numbers_of(f"P{k}", random, {"sand": 0.5, "snow": 0.9})]
    (found,) = analysed(rows, None, Settings())
    over = {row[1]: row[2] for row in table_of(found, "Magnitudes over people").rows}
    assert (over["exponent sand"], over["exponent snow"]) == pytest.approx((0.5, 0.9), abs=0.1)
    (test,) = table_of(found, "Does texture change the exponent?").rows
    assert test[4] < 0.001
    assert [line.name for line in found.drawings[0].series if line.name] == ["sand texture", "snow texture"]


def test_what_is_not_felt_at_any_level_is_in_no_power_law():
    """A stimulus without vibration has a magnitude, and no place on an axis of logarithms."""
    random = np.random.default_rng(5)
    silent = {"stimulus": "X", "level_m_s2": 0.0, "magnitude": 0.01, "texture": "none"}
    rows = numbers_of("P1", random, spread=0.0)
    found = magnitudes.estimates([*rows, {**rows[0], **silent}], Settings())
    assert [one.name for one in found][:2] == ["exponent sand", "magnitude X"]
    assert found[0].value == pytest.approx(0.6)


def test_who_lacks_a_stimulus_is_named_and_left_out_of_magnitudes():
    random = np.random.default_rng(6)
    rows = [row for k in range(3) for row in numbers_of(f"P{k}", random)]
    (found,) = analysed(
        [row for row in rows if row["participant"] != "P1" or row["level_m_s2"] < 0.5], None, Settings()
    )
    assert found.remarks == ["Magnitudes over people are without P1, who lack a stimulus."]


def test_zero_is_no_magnitude():
    rows = [{**row, "magnitude": 0} for row in numbers_of("P1", np.random.default_rng(7))]
    with pytest.raises(BadValue, match=r"trial 1 of P1: magnitude is 0; allowed: a number above 0"):
        analysed(rows, None, Settings())


def test_simulated_people_answer_a_study_and_have_the_exponent_that_is_true():
    stimuli = {f"s{k}": {**TD, "level_m_s2": level} for k, level in enumerate(LEVELS)}
    protocol = made_protocol("magnitude-estimation", {"blocks": 6}, stimuli)
    rows = [row for k in range(12) for row in simulated_rows(protocol, k, 1, {"exponent": 0.8})[0]]
    (found,) = analysed(rows, protocol, Settings())
    _, name, value, low, high, _ = table_of(found, "Magnitudes over people").rows[0]
    assert name == "exponent"
    assert low < 0.8 < high
    assert value == pytest.approx(0.8, abs=0.05)
    study = Study(protocol, "P1")
    for answer in (0, -1.0, "much"):
        with pytest.raises(BadValue, match=r"magnitude is .*; allowed: a number above 0"):
            study.answer({"magnitude": answer})
    study.answer({"magnitude": 0.25})


def test_a_standard_comes_before_each_stimulus_and_is_judged_only_where_it_comes_after_itself():
    stimuli = {f"s{k}": {**TD, "level_m_s2": level} for k, level in enumerate(LEVELS)}
    protocol, free = (
        made_protocol("magnitude-estimation", {"blocks": 6, **standard}, stimuli)
        for standard in ({"standard": "s1"}, {})
    )
    intervals = [page.trial.intervals for page in walked(Study(protocol, "P1"))]
    rows, person = simulated_rows(protocol, 0, 1, {"numbers_spread": 0.0})
    assert [{row["stimulus"] for row in rows[k : k + 4]} for k in range(0, 24, 4)] == [set(stimuli)] * 6
    assert {row["other"] for row in rows} == {"s1"}
    found = {one.name: one.value for one in magnitudes.estimates(rows, Settings())}
    assert found == pytest.approx(person.observers["main"].truths())
    assert [first.stimulus for first, _ in intervals] == ["s1"] * 24
    twice = [usual_s(made, made.stage("main")) for made in (protocol, free)]
    assert twice[0] - twice[1] == pytest.approx(24 * (protocol.present_s + 0.5))
