"""Method of adjustment: its measures against closed forms and SciPy, and what simulated people have set."""

import math

import numpy as np
import pytest
from made_studies import TD, made_protocol
from scipy import stats

from underfoot.errors import BadValue
from underfoot.experiments.analysis import adjustment
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.table import with_levels

UP, DOWN = (1.0, 2.5, 1.5, 2.0), (3.0, 4.0, 2.5)
"""Ascending and descending settings, in dB; one of the latter is spoiled."""


def rows_of(person="P1", up=UP, down=DOWN, **cells):
    settings = [("ascending", value) for value in up] + [("descending", value) for value in down]
    return [
        {"participant": person, "stage": "main", "method": "adjustment", "trial": trial, "comparison": "TD",
         "other": "S", "series": series, "standard_at": 1.5, "level_db": value, **cells}
        for trial, (series, value) in enumerate(settings, 1)
    ]  # fmt: skip


def test_what_one_person_sets_is_estimated_as_by_scipy():
    pse, error, sd, start = adjustment.estimates(rows_of(), Settings())
    compared = stats.ttest_ind(UP, DOWN)  # of equal variances
    assert [one.name for one in (pse, error, sd, start)] == ["pse TD", "CE TD", "SD TD", "start TD"]
    assert (start.value, start.low, start.high) == pytest.approx(
        (np.mean(UP) - np.mean(DOWN), *compared.confidence_interval())
    )
    deviations = [*(np.array(UP) - np.mean(UP)), *(np.array(DOWN) - np.mean(DOWN))]
    squares = float(np.square(deviations).sum())
    assert sd.value == pytest.approx(math.sqrt(squares / 5.0))
    assert (sd.low, sd.high) == pytest.approx(tuple(np.sqrt(squares / stats.chi2.ppf([0.975, 0.025], 5))))
    x = np.array([0.5] * len(UP) + [-0.5] * len(DOWN))  # the mean of both series is the intercept of this line
    line = stats.linregress(x, [*UP, *DOWN])
    half = line.intercept_stderr * stats.t.ppf(0.975, 5)
    assert (pse.value, pse.low, pse.high) == pytest.approx(
        (line.intercept, line.intercept - half, line.intercept + half)
    )
    assert (error.value, error.low, error.high) == pytest.approx((pse.value - 1.5, pse.low - 1.5, pse.high - 1.5))


def test_over_people_means_have_students_interval_and_an_end_that_was_reached_is_told():
    protocol = made_protocol(
        "adjustment", {"followed": ["TD"], "standard": "S", "reach": [-30.0, 4.0], "above": [3.0, 4.0]},
        {"TD": TD, "S": {**TD, "level_m_s2": 0.5}},
    )  # fmt: skip
    people = [rows_of(f"P{k}", [value + k for value in (-1.0, -2.5)], [-1.0 - k, -0.5 - k]) for k in range(3)]
    people.append(rows_of("P9", down=(2.0, 4.0, 4.0)))
    people.append(rows_of("lone", up=(1.0,), down=()))
    (found,) = analysed([row for rows in people for row in rows], protocol, Settings())
    assert found.remarks == ["Set to an end of what can be set, beyond which the PSE may lie: P9 (TD 2 of 7)."]
    _, points, others = found.tables
    each = [[one.value for one in adjustment.estimates(rows, Settings())] for rows in people]
    for row, values in ((points.rows[0], [of[0] for of in each]), (others.rows[0], [of[1] for of in each])):
        low, high = stats.t.interval(0.95, 4, np.mean(values), stats.sem(values))
        assert row[2:5] == pytest.approx((np.mean(values), low, high))
    starts = [of[3] for of in each[:4]]  # the lone setting has none
    assert others.rows[2][1:3] == ("start TD", pytest.approx(np.mean(starts)))
    assert others.rows[2][-2:] == (pytest.approx(np.std(starts, ddof=1)), 4)
    assert [math.isnan(one.low) for one in adjustment.estimates(people[-1], Settings())] == [True] * 3


@pytest.mark.parametrize(("standard", "name"), [("S", "pse TD"), ("", "threshold TD")])
def test_intervals_of_simulated_people_hold_the_truth(standard, name):
    parameters = {"followed": ["TD"], "standard": standard, "blocks": 4}
    protocol = made_protocol("adjustment", parameters, {"TD": TD, "S": {**TD, "level_m_s2": 0.6}})
    held = dict.fromkeys((name, "SD TD", "start TD"), 0)
    for person in range(200):
        rows, simulated = simulated_rows(protocol, person, 3, {"error_share": 0.05} if standard else {})
        truths = simulated.observers["main"].truths()
        for one in adjustment.estimates(rows, Settings()):
            held[one.name] = held.get(one.name, 0) + one.covers(truths[one.name])
    assert truths[name] == pytest.approx(20.0 * math.log10(0.6 / 0.43) + 3.0 if standard else 0.5858, abs=1e-4)
    assert min(stats.binomtest(count, 200, 0.95).pvalue for count in held.values()) > 0.005


def test_another_number_than_the_level_keeps_its_own_unit_in_a_table_that_comes_back():
    sine = {"patch": "stimulus-sc", "scaled_by": "gain.gain", "measured_m_s2": 2.9, "level_m_s2": 1.0}
    given = {
        "parameter": "sine.frequency",
        "reach": [50, 400],
        "below": [60, 80],
        "above": [300, 380],
        "steps": [20, 2],
    }
    stimuli = {"C": sine, "S": {**sine, "settings": {"sine.frequency": 150.0}}}
    protocol = made_protocol("adjustment", {"followed": ["C"], "standard": "S", **given}, stimuli)
    rows, _ = simulated_rows(protocol, 0, 1, {"spread_share": 0.0, "start_share": 0.0, "error_share": 0.1})
    (found,) = analysed(with_levels(rows, protocol), protocol, Settings())
    values = {row[1]: (row[2], row[5]) for row in found.tables[0].rows}
    assert values["pse C"] == (pytest.approx(185.0), "")
    assert values["CE C"] == (pytest.approx(35.0), "")
    assert found.tables[0].note.startswith("Values of sine.frequency, in its own unit.")
    assert len(found.tables[1].rows) == 1  # in no m/s^2
    assert {row[5] for table in found.tables for row in table.rows} == {""}


def test_a_series_in_other_words_is_refused():
    with pytest.raises(BadValue, match="series is 'up'; allowed: ascending or descending"):
        analysed(rows_of(series="up"), None, Settings())
