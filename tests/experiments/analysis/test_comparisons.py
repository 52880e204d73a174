"""Tests between conditions: against hand-computed sums of squares, and examples that papers print."""

import warnings

import numpy as np
import pytest
from scipy import stats

from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.comparisons import (
    fisher,
    friedman,
    logistic_regression,
    one_way_anova,
    paired_t,
    repeated_measures_anova,
    shares_compared,
    spearman,
)

pytest.importorskip("statsmodels")


def test_partial_eta_squared_is_the_share_of_the_sums_of_squares():
    """One factor within people: sums of squares by hand."""
    random = np.random.default_rng(3)
    scores = random.normal(loc=(0.0, 0.5, 1.0), size=(10, 3))
    table = [{"participant": p, "level": k, "rating": scores[p, k]} for p in range(10) for k in range(3)]
    found, _ = repeated_measures_anova(table, "rating", ["level"])
    grand = scores.mean()
    effect = 10 * ((scores.mean(axis=0) - grand) ** 2).sum()
    error = ((scores - scores.mean(axis=0) - scores.mean(axis=1, keepdims=True) + grand) ** 2).sum()
    assert found.size == pytest.approx(effect / (effect + error))
    assert found.value == pytest.approx((effect / 2) / (error / 18))
    assert found.df == (2, 18)


def winers_epsilon(scores):
    """Epsilon from the covariances of the levels, by Winer's formula (Statistical Principles, 1971)."""
    spread, k = np.cov(scores, rowvar=False), scores.shape[1]
    above = k**2 * (np.diag(spread).mean() - spread.mean()) ** 2
    below = (spread**2).sum() - 2 * k * (spread.mean(axis=1) ** 2).sum() + k**2 * spread.mean() ** 2
    return above / ((k - 1) * below)


def test_where_differences_do_not_vary_alike_degrees_of_freedom_are_less():
    random = np.random.default_rng(5)
    scores = random.normal(size=(12, 2, 4)) * (1.0, 1.0, 1.0, 5.0) + (0.0, 0.0, 0.0, 3.0)
    table = [
        {"participant": p, "place": "ht"[k], "level": level, "rating": scores[p, k, level]}
        for p in range(12)
        for k in range(2)
        for level in range(4)
    ]
    found = {test.name: test for test in repeated_measures_anova(table, "rating", ["place", "level"])}
    assert list(found) == ["place", "level", "level, corrected", "place x level", "place x level, corrected"]
    sums = {"level": scores.mean(axis=1), "place x level": scores[:, 1] - scores[:, 0]}
    for name, of in sums.items():
        plain, corrected = found[name], found[f"{name}, corrected"]
        epsilon = winers_epsilon(of)
        assert 1 / 3 < epsilon < 0.7
        assert corrected.size == pytest.approx(epsilon)
        assert corrected.df == pytest.approx((3 * epsilon, 33 * epsilon))
        assert corrected.value == plain.value
        assert corrected.p == pytest.approx(stats.f.sf(plain.value, 3 * epsilon, 33 * epsilon))


def test_an_effect_that_is_the_same_in_everybody_has_no_statistic_beside_one_that_is_not():
    table = [
        {"participant": p, "level": k, "place": m, "rating": 0.1 * (k * p + m)}
        for p in range(4)
        for k in range(3)
        for m in range(3)
    ]
    found = {test.name: test.value for test in repeated_measures_anova(table, "rating", ["level", "place"])}
    assert found["level"] == pytest.approx(5.4)
    assert np.isnan([found["place"], found["level x place"]]).all()


def test_two_factors_have_the_degrees_of_freedom_that_the_errata_ask_for():
    """Twenty people, amplitude of two levels and waveform of three: (1, 19), (2, 38) and (2, 38)."""
    random = np.random.default_rng(4)
    table = [
        {"participant": p, "amplitude": a, "waveform": w, "rating": random.normal() + a}
        for p in range(20)
        for a in (0.5, 1.0)
        for w in ("S", "nan", "T")
        for _ in range(2)
    ]
    tests = repeated_measures_anova(table, "rating", ["amplitude", "waveform"])
    found = {test.name: test.df for test in tests if test.effect != "epsilon"}
    assert found == {"amplitude": (1, 19), "waveform": (2, 38), "amplitude x waveform": (2, 38)}
    with pytest.raises(BadMeasurement, match="lacks a condition"):
        repeated_measures_anova(table[:-2], "rating", ["amplitude", "waveform"])


def test_bonferroni_multiplies_by_the_number_of_tests_and_stops_at_one():
    values = {"a": [1.0, 2.0, 3.0, 4.0], "b": [1.5, 2.4, 3.6, 4.3], "X": [1.1, 2.0, 2.9, 4.1]}
    found = paired_t(values, against="X")
    assert [test.name for test in found] == ["a - X", "b - X"]
    plain = stats.ttest_rel(values["b"], values["X"])
    assert found[1].p == pytest.approx(2 * plain.pvalue)
    assert found[1].df == (3.0,)
    apart = np.subtract(values["b"], values["X"])
    assert found[1].size == pytest.approx(apart.mean() / apart.std(ddof=1))
    assert found[0].p <= 1.0
    between = plain.confidence_interval()
    difference = found[1].tested
    assert (difference.value, difference.low, difference.high) == pytest.approx((apart.mean(), *between))


def test_logistic_regression_finds_the_slopes_that_made_the_data():
    random, alone = np.random.default_rng(6), ["P1"] * 20_000
    w, d = random.uniform(4.5, 16.5, 20_000), random.uniform(15.0, 45.0, 20_000)
    success = random.random(20_000) < 1.0 / (1.0 + np.exp(-(0.2 + 0.36 * w - 0.062 * d)))
    tests = logistic_regression(success, {"w": w, "d": d}, alone)
    found = {test.name: test.tested.value for test in tests}
    for test in tests:
        error = test.tested.value / test.value  # Wald's z
        ends = test.tested.value - 1.959964 * error, test.tested.value + 1.959964 * error
        assert (test.tested.low, test.tested.high, test.size) == pytest.approx((*ends, np.exp(test.tested.value)))
    assert found["w"] == pytest.approx(0.36, rel=0.05)
    assert found["d"] == pytest.approx(-0.062, rel=0.15)
    of_m = logistic_regression(success, {"w": 3e-4 * w}, alone)[1]
    assert (of_m.size, of_m.tested.value) == (np.inf, pytest.approx(1200.0, rel=0.2)), "a ratio beyond all numbers"
    with_straight = logistic_regression(success, {"w": w, "d": d, "theta": np.zeros(20_000)}, alone)
    assert {test.name: test.tested.value for test in with_straight} == found  # buttons straight ahead only
    for outcome, factors in ((w > 10.0, {"w": w}), (success, {"theta": np.zeros(20_000)}), (w > 0.0, {"w": w})):
        with pytest.raises(BadMeasurement):
            logistic_regression(outcome, factors, alone)


def test_a_library_that_will_change_denies_no_regression_and_an_error_without_words_is_named(monkeypatch):
    from statsmodels.discrete.discrete_model import Logit

    success, w, fitted = [0, 1, 0, 1, 1, 0], [1.0, 1.0, 2.0, 2.0, 3.0, 3.0], Logit.fit
    expected = logistic_regression(success, {"w": w}, ["P1"] * 6)

    def deprecated(*given, **options):
        warnings.warn("another name from the next version on", FutureWarning, stacklevel=1)
        return fitted(*given, **options)

    monkeypatch.setattr(Logit, "fit", deprecated)
    with pytest.warns(FutureWarning, match="another name"):
        assert logistic_regression(success, {"w": w}, ["P1"] * 6) == expected

    def failed(*_given, **_options):
        raise ZeroDivisionError

    monkeypatch.setattr(Logit, "fit", failed)
    with pytest.raises(BadMeasurement, match="does not converge: ZeroDivisionError"):
        logistic_regression(success, {"w": w}, ["P1"] * 6)


def test_trials_of_people_who_differ_are_not_counted_as_independent():
    """Each person selects farther or nearer ones better, by chance; of all trials, a quarter of such studies had
    p < 0.05.
    """
    random, people, far = np.random.default_rng(3), 8, np.tile([0.0, 1.0], 40)
    who, hits = np.repeat(np.arange(people), len(far)), {"regression": 0, "shares": 0, "trials": 0}
    for _ in range(40):
        liking = 1.2 + 0.5 * random.standard_normal((people, 1)) + 0.7 * random.standard_normal((people, 1)) * far
        success = random.random((people, len(far))) < 1.0 / (1.0 + np.exp(-liking))
        of = len(far) // 2
        by_person = {
            name: {str(k): (int(one[far == at].sum()), of) for k, one in enumerate(success)}
            for name, at in (("near", 0.0), ("far", 1.0))
        }
        found = {
            "regression": logistic_regression(success.ravel(), {"far": np.tile(far, people)}, who.tolist())[1],
            "shares": shares_compared("distance", by_person)[0],
            "trials": fisher("", [[n := int(success[:, far == at].sum()), people * of - n] for at in (0.0, 1.0)]),
        }
        hits = {name: count + (found[name].p < 0.05) for name, count in hits.items()}
    assert max(hits["regression"], hits["shares"]) <= 4 < 8 < hits["trials"]  # of 40; 2 are expected
    last, student = found["regression"], stats.t(people - 1)
    assert (last.statistic, last.df, last.p) == ("t", (7.0,), pytest.approx(2.0 * student.sf(abs(last.value))))
    half = student.ppf(0.975) * last.tested.value / last.value
    assert last.tested.high - last.tested.value == pytest.approx(half)


def test_shares_are_compared_within_people_between_them_or_within_the_trials_of_one():
    one, other = {"P1": (9, 10), "P2": (7, 10), "P3": (0, 0)}, {"P1": (5, 10), "P2": (4, 10), "P3": (4, 10)}
    (paired,) = shares_compared("sort", {"A": one, "B": other})
    assert paired.p == pytest.approx(stats.ttest_rel([0.9, 0.7], [0.5, 0.4]).pvalue)  # who lacks one is left out
    (apart,) = shares_compared("sort", {"A": one, "B": {f"other {who}": of for who, of in other.items()}})
    assert apart.p == pytest.approx(stats.f_oneway([0.9, 0.7], [0.5, 0.4, 0.4]).pvalue)
    (alone,) = shares_compared("sort", {"A": {"P1": (9, 10)}, "B": {"P1": (5, 10)}})
    assert alone.p == stats.fisher_exact([[9, 1], [5, 5]]).pvalue


def test_friedman_spearman_and_one_way_of_plain_examples():
    ranks = [[1.0, 1.0, 1.0, 1.0], [2.0, 2.0, 2.0, 2.0], [3.0, 3.0, 3.0, 3.0]]
    assert friedman("level", ranks).value == pytest.approx(8.0)  # n (k - 1) where all agree
    assert friedman("level", ranks).size == pytest.approx(1.0)
    assert friedman("level", ranks).df == (2,)
    assert friedman("level", ranks).p == pytest.approx(np.exp(-4.0))  # chi squared of two degrees of freedom
    torn = friedman("level", [[1.0, 1.0, 2.0], [2.0, 3.0, 1.0], [3.0, 2.0, 3.0]])
    assert torn.size == pytest.approx(((4 - 6) ** 2 + (8 - 6) ** 2) / (9 * (27 - 3) / 12))  # Kendall's W of ranks
    assert spearman("x", [1, 2, 3, 4], [1, 4, 9, 16]).value == pytest.approx(1.0)
    assert spearman("x", [1, 2, 3, 4], [1, 4, 9, 16]).df == (2.0,)
    assert one_way_anova("set", [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]).value == pytest.approx(0.0)
    assert one_way_anova("set", [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]]).size == pytest.approx(1.5 / (1.5 + 4.0))
    assert fisher("tea", [[4, 0], [0, 4]]).p == pytest.approx(2 / 70)


def test_conditions_that_differ_alike_for_everybody_have_no_statistic():
    """There is no error to test against: a rounding error in its place made t infinite, or F negative."""
    alike = {"a": [50.1, 60.2, 70.3], "b": [40.1, 50.2, 60.3], "c": [45.1, 55.2, 69.3]}
    first, *others = paired_t(alike)
    assert np.isnan([first.value, first.p, first.size]).all()
    plain = stats.ttest_rel(alike["b"], alike["c"])
    assert (others[1].value, others[1].p) == pytest.approx((plain.statistic, 3 * plain.pvalue))
    same = friedman("same", [[1.0, 2.0, 3.0]] * 3)
    apart = one_way_anova("apart", [[0.3, 0.3], [0.6, 0.6]])
    assert np.isnan([same.value, same.p, same.size, apart.value, apart.p]).all()
    for step in (0.0, 10.1):
        table = [{"participant": p, "kind": k, "rating": 50.1 + p + step * k} for p in range(3) for k in range(4)]
        with pytest.raises(BadMeasurement, match="alike for everybody"):
            repeated_measures_anova(table, "rating", ["kind"])
