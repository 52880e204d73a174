"""Sensitivity: d' of textbooks, its interval by simulation, and where it is said."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from underfoot.errors import BadValue
from underfoot.experiments.analysis.sensitivity import d_prime, sensitivity


def test_large_numbers_give_the_textbooks_d_prime():
    """Macmillan and Creelman (2005), chapter 1: hits 0.8 and false alarms 0.4 are d' = 1.095."""
    found, criterion = d_prime((800_000, 1_000_000), (400_000, 1_000_000))
    assert found.value == pytest.approx(1.095, abs=1e-3)
    assert criterion == pytest.approx(-0.5 * (0.842 - 0.253), abs=1e-3)


def test_the_interval_is_gourevitch_and_galanters_by_the_number_of_trials():
    found, _ = d_prime((8, 10), (4, 10))
    rates = (8.5 / 11.0, 4.5 / 11.0)
    deviation = math.sqrt(sum(p * (1.0 - p) / (10 * norm.pdf(norm.ppf(p)) ** 2) for p in rates))
    assert found.high - found.low == pytest.approx(2.0 * norm.ppf(0.975) * deviation)


@pytest.mark.parametrize(("truth", "criterion"), [(1.0, 0.0), (2.0, 0.4)])
def test_the_interval_holds_the_truth_of_95_in_100_people(truth, criterion):
    random, people = np.random.default_rng(1), 2000
    rates = norm.cdf([truth / 2 - criterion, -truth / 2 - criterion])
    counts = random.binomial(60, rates, (people, 2))
    held = sum(d_prime((h, 60), (f, 60))[0].covers(truth) for h, f in counts.tolist())
    assert 0.93 < held / people < 0.98


def test_who_is_never_wrong_has_a_finite_d_prime_and_other_answers_have_none():
    rows = [{"participant": "P1", "correct": word, "felt": word} for word in ("yes", "no") for _ in range(10)]
    (table,) = sensitivity(rows)
    assert table.rows[0][:3] == ("P1", 1.0, 0.0)
    assert table.rows[0][3] == pytest.approx(2.0 * norm.ppf(10.5 / 11.0))
    assert all(math.isfinite(cell) for cell in table.rows[0][1:])
    assert sensitivity([row for row in rows if row["correct"] == "yes"]) == []
    assert sensitivity([{"participant": "P1", "correct": "sand", "answer": "ice"}]) == []


@pytest.mark.parametrize("hits", [(12, 10), (-1, 10), (0, 0)])
def test_more_hits_than_trials_and_no_trials_are_refused(hits):
    with pytest.raises(BadValue, match=r"^count, of is \(.*\); allowed: a count of 0 to of, of at least 1$"):
        d_prime(hits, (1, 10))
