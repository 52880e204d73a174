"""Transmitted information: closed forms, and little bias where the plug-in estimate has much."""

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import entropy

from underfoot.errors import BadValue
from underfoot.experiments.analysis.information import information, transmitted_bits
from underfoot.experiments.observers import uniform_guess_bits


def confusions(rate, stimuli=8):
    return np.where(np.eye(stimuli) == 1.0, rate, (1.0 - rate) / (stimuli - 1))


def drawn(chances, trials, random):
    return np.array([random.multinomial(trials, row) for row in chances])


def near(stimuli=8):
    """Stimuli in a row, confused with their neighbours."""
    chances = np.exp(-np.abs(np.subtract.outer(np.arange(stimuli), np.arange(stimuli))) / 0.75)
    return chances / chances.sum(axis=1, keepdims=True)


def plug_in_bits(counts):
    """Mutual information as the sum of three entropies of the observed shares."""
    by_stimulus, by_answer, both = (
        entropy(x, base=2) for x in (counts.sum(axis=1), counts.sum(axis=0), counts.ravel())
    )
    return by_stimulus + by_answer - both


@pytest.mark.parametrize("chances", [confusions(0.61), near()])
def test_twelve_trials_a_stimulus_are_enough_within_a_twentieth_of_a_bit(chances):
    random = np.random.default_rng(1)
    truth = plug_in_bits(chances)
    found = [drawn(chances, 12, random) for _ in range(300)]
    plain = np.mean([plug_in_bits(counts) for counts in found])
    assert plain - truth > 0.2
    assert np.mean([transmitted_bits(counts) for counts in found]) == pytest.approx(truth, abs=0.05)


def test_the_estimate_of_very_many_trials_is_the_closed_form():
    assert transmitted_bits(np.round(confusions(0.61) * 1e9)) == pytest.approx(0.940, abs=1e-3)
    assert uniform_guess_bits(0.61, 8) == pytest.approx(0.940, abs=1e-3)
    assert uniform_guess_bits(1.0, 8) == 3.0


def rate_of(bits, stimuli):
    """The rate at which people who else guess evenly transmit so much."""
    return brentq(lambda rate: uniform_guess_bits(rate, stimuli) - bits, 1.0 / stimuli, 1.0) if bits else 1.0 / stimuli


@pytest.mark.parametrize(
    ("bits", "stimuli", "trials"), [(0.0, 8, 12), (0.05, 4, 20), (0.94, 8, 12), (2.0, 8, 12), (2.5, 8, 12)]
)
def test_its_interval_holds_the_truth_as_often_as_it_says(bits, stimuli, trials):
    random, chances = np.random.default_rng(2), confusions(rate_of(bits, stimuli), stimuli)
    held = [information(drawn(chances, trials, random)).covers(bits) for _ in range(40)]
    assert np.mean(held) == pytest.approx(0.95, abs=0.04)


def test_who_confuses_nothing_may_transmit_all_there_is_and_whom_one_answer_suits_nothing():
    assert information(20 * np.eye(4)).high == pytest.approx(2.0)
    assert information([[5, 0], [7, 0]]).high == 0.0


def test_a_matrix_without_trials_is_refused():
    with pytest.raises(BadValue, match="a matrix of counts"):
        information(np.zeros((8, 8)))
