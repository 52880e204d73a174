"""Local load sharing against a fibre-by-fibre search, closed forms for two fibres, and order statistics."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from underfoot.errors import BadValue
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.fibre_bundle.local_load_sharing import draw_thresholds, ring


def searched(limits, locality):
    """The same ring one fibre at a time, by walks to each one's neighbours: loads and sizes of the avalanches."""
    size, intact, found, load = len(limits), set(range(len(limits))), [], 0.0
    while intact:
        carried = {}
        for i in intact:
            gaps = 0
            for step in (1, -1):
                j = (i + step) % size
                while j not in intact:
                    gaps, j = gaps + 1, (j + step) % size
            carried[i] = 1.0 + (1.0 - locality) * (size - len(intact)) / len(intact) + 0.5 * locality * gaps
        weakest = min(intact, key=lambda i: limits[i] / carried[i])
        needed = limits[weakest] / carried[weakest]
        if not found or needed > load * (1.0 + 1e-12):
            load = needed
            found.append([load * size, 0])
        found[-1][1] += 1
        intact.remove(weakest)
    return found


@given(
    st.lists(st.floats(0.1, 10.0), min_size=1, max_size=12, unique_by=lambda value: round(value, 3)),
    st.sampled_from([0.0, 0.3, 1.0]),
)
def test_avalanches_are_those_of_a_search_fibre_by_fibre(limits, locality):
    broken, wanted = ring(limits, locality=locality), searched(limits, locality)
    assert broken.fibres.tolist() == [size for _, size in wanted]
    np.testing.assert_allclose(broken.load, [load for load, _ in wanted], rtol=1e-12)
    assert broken.strength == broken.load[-1]


def test_without_locality_the_strength_is_that_of_the_order_statistics():
    limits = draw_thresholds(3000, seed=8)
    wanted = (np.arange(3000, 0, -1) * np.sort(limits)).max()
    assert ring(limits, 2.0, locality=0.0).strength == pytest.approx(2.0 * wanted, rel=1e-12)


def test_global_sharing_is_critical_at_2766_with_a_deviation_of_32():
    strengths = [ring(draw_thresholds(2000, seed=seed), locality=0.0).strength for seed in range(100)]
    assert np.mean(strengths) == pytest.approx(2766.0, abs=4.0 * 32.0 / 10.0)
    assert np.std(strengths) == pytest.approx(32.0, rel=0.3)
    assert np.mean(strengths) > FibreBundle(2000).critical_stress


def test_two_fibres_have_the_strength_that_harlow_and_phoenix_give():
    cdf = stats.weibull_min(4.0, scale=2.5).cdf
    strengths = np.array([ring(draw_thresholds(2, seed=seed)).strength / 2.0 for seed in range(4000)])
    assert stats.kstest(strengths, lambda x: 2.0 * cdf(x) * cdf(2.0 * x) - cdf(x) ** 2).pvalue > 0.01


def test_local_sharing_weakens_the_ring_and_the_more_so_the_larger_it_is():
    def strength(fibres, locality):
        return np.mean([ring(draw_thresholds(fibres, seed=i), locality=locality).strength for i in range(10)]) / fibres

    assert strength(2000, 1.0) < 0.95 * strength(200, 1.0) < 0.9 * strength(20, 1.0)
    assert strength(2000, 1.0) < 0.8 * strength(2000, 0.5) < 0.8 * strength(2000, 0.0)
    assert strength(2000, 0.0) == pytest.approx(strength(200, 0.0), rel=0.03)


@pytest.mark.parametrize("thresholds", ["weibull", "uniform"])
def test_drawn_thresholds_follow_their_distribution(thresholds):
    known = stats.weibull_min(4.0, scale=2.5).cdf if thresholds == "weibull" else stats.uniform(0.0, 2.5).cdf
    drawn = draw_thresholds(20000, seed=2, thresholds=thresholds)
    assert stats.kstest(drawn, known).pvalue > 0.01
    assert (drawn != draw_thresholds(20000, seed=3, thresholds=thresholds)).any()


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"thresholds": []}, "thresholds"),
        ({"thresholds": [1.0, 0.0]}, "thresholds"),
        ({"thresholds": [1.0, math.nan]}, "thresholds"),
        ({"stiffness": 0.0}, "stiffness"),
        ({"locality": 1.1}, "locality"),
    ],
)
def test_a_value_outside_its_range_is_named(changes, name):
    with pytest.raises(BadValue, match=name):
        ring(**{"thresholds": [1.0, 2.0], **changes})
