"""What is believed of a threshold, against what can be told beforehand."""

import numpy as np
import pytest
from made_studies import TD, made_protocol

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.analysis import bayesian
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods.bayesian import Bayesian, quest_of
from underfoot.experiments.simulation import simulated_rows


@pytest.fixture(autouse=True, scope="module")
def _questplus():
    """Loads pandas, too: not while tests are collected."""
    pytest.importorskip("questplus")


def test_before_the_first_answer_95_percent_of_all_levels_and_spreads_are_believed():
    """Levels of -2 to 2 dB by 1 reach half a step further; 13 spreads of 0.5 to 8 dB, a sixth of a doubling."""
    given = {"range_db": (-2.0, 2.0), "step_db": 1.0}
    threshold, spread = bayesian.estimates([], Settings(given))
    assert (threshold.low, threshold.high) == pytest.approx((-2.375, 2.375))
    left_out = 0.025 * 13 / 3.0
    ends = 0.5 * 2.0 ** (left_out - 1.0 / 6.0), 8.0 * 2.0 ** (1.0 / 6.0 - left_out)
    assert (spread.low, spread.high) == pytest.approx(ends)
    assert (threshold.value, spread.value) == pytest.approx((0.0, 2.0))
    steep = Bayesian.checked({"range_db": (-6.0, 6.0), "step_db": 4.5}, {"TD": None})
    assert quest_of(steep).stim_domain["intensity"].tolist() == [-6.0, -1.5, 3.0]  # 7.5 is above the highest
    with pytest.raises(BadFile, match="the lower first, 12 dB or more apart"):  # between the ends there is no other
        made_protocol("bayesian", {"range_db": [-6.0, 5.0], "step_db": 6.0}, {"TD": TD})


def test_thresholds_over_people_are_in_m_s2_too_and_answers_of_yes_to_nothing_are_counted():
    parameters = {"trials": 12, "range_db": [-6.0, 6.0], "step_db": 0.6, "catch_share": 0.3}
    protocol = made_protocol("bayesian", parameters, {"TD": TD})
    rows = [row for person in range(3) for row in simulated_rows(protocol, person, 1, {})[0]]
    (found,) = analysed(rows, protocol, Settings())
    person, over, alarms = found.tables
    assert sum(of for _, _, of in alarms.rows) == sum(bool(row.get("catch")) for row in rows) > 0
    values = [row[2] for row in person.rows if row[1] == "threshold TD"]
    assert [row[:2] for row in over.rows] == [("dB", "threshold TD"), ("m/s^2", "threshold TD")]
    levels = [TD["level_m_s2"] * 10.0 ** (value / 20.0) for value in values]
    assert [row[2] for row in over.rows] == pytest.approx([np.mean(values), np.mean(levels)], rel=1e-4)
    assert [row[-2] for row in over.rows] == pytest.approx([np.std(of, ddof=1) for of in (values, levels)], rel=1e-4)
    with pytest.raises(BadValue, match=r"level_db is .*; allowed: -24 to 24 by 1; `underfoot analyse --protocol` "):
        analysed(rows, None, Settings())


def test_who_answers_always_alike_has_no_threshold_and_is_in_no_mean():
    """It was the end of the levels, 24 dB, with an interval of 1 dB, and was in the mean over people."""
    protocol = made_protocol("bayesian", {"trials": 15}, {"TD": TD})
    rows = [row for person in range(2) for row in simulated_rows(protocol, person, 1, {})[0]]
    before = analysed(rows, protocol, Settings())[0].tables[1]
    alike = [
        {"participant": who, "stage": "main", "method": "bayesian", "trial": k, "block": 1, "comparison": "TD"}
        | {"level_db": level, "level_m_s2": 0.43 * 10.0 ** (level / 20.0), "felt": felt}
        for who, level, felt in (("P8", -24.0, "yes"), ("P9", 24.0, "no"))
        for k in range(1, 16)
    ]
    person, over = analysed([*rows, *alike], protocol, Settings())[0].tables[:2]
    lacking = [(who, name) for who in ("P8", "P9") for name in ("threshold TD", "spread")]
    assert [row[:2] for row in person.rows if np.isnan(row[2])] == lacking
    assert "anywhere beyond" in person.note
    assert over == before


def test_whose_interval_is_cut_by_the_highest_level_is_named():
    """A threshold that lay 1 dB below the highest level, with an interval of 2 dB, was in the mean without a word."""
    protocol = made_protocol("bayesian", {"range_db": [-6.0, 6.0], "step_db": 2.0}, {"TD": TD})
    trial = {"stage": "main", "method": "bayesian", "trial": 1, "block": 1, "comparison": "TD"}
    few, many = (
        {(6.0, "yes"): of[0], (6.0, "no"): of[1], (4.0, "yes"): of[2], (4.0, "no"): of[3], (2.0, "no"): of[4]}
        for of in ((6, 1, 2, 3, 4), (8, 1, 3, 4, 6))
    )
    rows = [
        {**trial, "participant": who, "level_db": level, "felt": felt}
        for who, answers in (("P8", many), ("P9", few))
        for (level, felt), count in answers.items()
        for _ in range(count)
    ]
    (found,) = analysed(rows, protocol, Settings())
    thresholds = [row[2] for row in found.tables[0].rows if row[0] in ("P8", "P9") and row[1] == "threshold TD"]
    assert thresholds == pytest.approx([4.0, 4.1], abs=0.1)
    assert [remark.partition(" reaches")[0] for remark in found.remarks] == ["The interval of P9"]


def test_who_answers_by_chance_is_named_since_their_threshold_counts_like_any_other():
    """A coin gives a threshold in the middle of the levels, as a careful person's, and nothing said so."""
    protocol = made_protocol("bayesian", {"trials": 30, "range_db": [-6.0, 6.0], "step_db": 2.0}, {"TD": TD})
    rows, _ = simulated_rows(protocol, 0, 1, {})
    random = np.random.default_rng(1)
    coin = [{**row, "participant": "P9", "felt": str(random.choice(["yes", "no"]))} for row in rows]
    (found,) = analysed([*rows, *coin], protocol, Settings())
    assert [remark for remark in found.remarks if "guesses" in remark] == [
        "The answers of P9 may be guesses: their threshold is where levels were tried, and counts over people."
    ]
