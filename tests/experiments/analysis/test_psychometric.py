"""Psychometric curves against what is not them: the thesis's table, SciPy's likelihood, and curves that are known."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import chi2, norm, ttest_rel

from underfoot.errors import BadMeasurement, BadValue
from underfoot.experiments.analysis import constant, psychometric, thesis
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.table import LEVEL

pytest.importorskip("statsmodels")
X = np.array(thesis.STIFFNESS_N_MM)
TWENTY = np.full(7, 20)


@pytest.mark.parametrize(("level", "pse"), [(0.0, 100.6), (0.43, 133.9), (0.86, 161.5)])
def test_pses_of_table_6_2_are_those_of_the_errata(level, pse):
    found = psychometric.fit(X, thesis.JUDGED_STIFFER[level], np.ones(7))
    assert found.pse == pytest.approx(pse, abs=0.05)


def test_the_fit_is_where_scipys_likelihood_is_largest():
    yes = np.array([1, 3, 7, 12, 13, 15, 19])

    def loss(p):
        chance = norm.cdf(p[0] + p[1] * X / 100.0)
        return -(yes * np.log(chance) + (20 - yes) * np.log(1.0 - chance)).sum()

    best = minimize(loss, [-2.0, 2.0], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-12})
    found = psychometric.fit(X, yes, TWENTY)
    assert (found.intercept, found.slope) == pytest.approx((best.x[0], best.x[1] / 100.0), rel=1e-5)


@pytest.mark.parametrize(
    ("yes", "of"),
    [
        ([1, 3, 7, 12, 13, 15, 19], [20] * 7),
        ([0, 2, 0, 3, 0, 9, 1], [3, 8, 0, 3, 2, 9, 2]),
        ([9, 11, 10, 9, 9, 11, 10], [20] * 7),
    ],
)
def test_the_fit_and_its_covariance_are_those_of_statsmodels(yes, of):
    import statsmodels.api as sm  # here: all processes of the tests read this file

    shares, design = np.array(yes) / np.maximum(of, 1), sm.add_constant(X)
    expected = sm.GLM(shares, design, sm.families.Binomial(sm.families.links.Probit()), freq_weights=of).fit()
    found = psychometric.fit(X, yes, of)
    assert (found.intercept, found.slope) == pytest.approx(tuple(expected.params), rel=1e-7)
    np.testing.assert_allclose(found.covariance, expected.cov_params(), rtol=1e-6)


def test_the_likelihood_with_lapses_is_climbed_to_its_highest_top():
    """A lapse looks like a shallow curve: there is a lower top, without lapses. SciPy's on a grid knows the highest."""
    yes, six = np.array([0, 1, 0, 6, 6, 6, 6]), np.full(7, 6)

    def likelihood(pse, slope, lapse):
        chance = np.clip(lapse + (1.0 - 2.0 * lapse) * norm.cdf(slope * (X - pse)), 1e-12, 1.0 - 1e-12)
        return (yes * np.log(chance) + (six - yes) * np.log(1.0 - chance)).sum()

    tops = [
        likelihood(pse, slope, lapse)
        for pse in np.linspace(70.0, 110.0, 41)
        for slope in np.geomspace(0.01, 3.0, 30)
        for lapse in (0.0, 0.02, 0.04, 0.08)
    ]
    found = psychometric.fit(X, yes, six, with_lapses=True)
    assert likelihood(found.pse, found.slope, found.lapse) > max(tops) - 0.01


def test_the_analysis_says_where_answers_look_like_lapses():
    """Of six people, each with a level far above at which two of twenty answers are no."""
    levels = (-6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0)

    def rows(yes):
        for person in "abcdef":
            for level, count in zip(levels, yes, strict=True):
                for k in range(20):
                    answer = {"felt": "yes" if k < count else "no"}
                    yield {"participant": person, "stimulus": str(level), "db": level, **answer}

    for yes, is_said in (((0, 0, 3, 10, 17, 20, 20), False), ((2, 1, 3, 10, 17, 19, 18), True)):
        for with_lapses in (False, True):
            found = constant.findings(list(rows(yes)), Settings(bootstrap=0, with_lapses=with_lapses))
            said = [remark for remark in found.remarks if "look like lapses" in remark]
            assert len(said) == (is_said and not with_lapses)
            assert ("a lapse rate" in found.tables[0].note) == with_lapses
            assert [row[1] for row in found.tables[0].rows[: 5 if with_lapses else 4]][3:] == [
                "intercept",
                *(["lapses"] if with_lapses else []),
            ]
            assert (found.drawings[0].series[1].y[-1] < 0.96) == (is_said and with_lapses)  # the curve as it is fitted
    assert psychometric.lapses_p([]) == 1.0  # nothing is known


def test_the_p_of_no_lapses_is_half_of_chi_squareds_for_one_curve_and_mixes_them_for_two():
    """Self and Liang (1987): of k rates that are at least 0, as many gain as heads fall of k coins."""
    yes, of = np.array([1, 0, 1, 12, 18, 19, 19]), np.full(7, 20)

    def loss(values, most):
        a, b, lapse = values[0], values[1], most * norm.cdf(values[2])
        chance = lapse + (1.0 - 2.0 * lapse) * norm.cdf(a + b * (X - 90.0) / 30.0)
        return -(yes * np.log(chance) + (of - yes) * np.log1p(-chance)).sum()

    tops = [minimize(loss, [0.0, 3.0, -0.5], args=(most,), method="Nelder-Mead").fun for most in (0.0, 0.1)]
    gain = 2.0 * (tops[0] - tops[1])
    assert 3.0 < gain < 20.0
    curve = (X, yes, of, 0.0)
    assert psychometric.lapses_p([curve]) == pytest.approx(0.5 * chi2.sf(gain, 1), rel=0.01)
    assert psychometric.lapses_p([curve] * 2) == pytest.approx(
        0.5 * chi2.sf(2.0 * gain, 1) + 0.25 * chi2.sf(2.0 * gain, 2), rel=0.01
    )


def test_who_may_have_guessed_or_taken_keys_for_each_other_is_named_since_the_estimate_counts_like_any_other():
    """Of b, whose every level has ten of twenty answers, it is the middle of the levels, 0 dB: no mean shows it."""
    rising = (0, 0, 1, 4, 9, 16, 20)
    counts = {"a": rising, "b": (10,) * 7, "d": rising, "e": rising[::-1]}
    rows = [
        {"participant": who, "stimulus": str(db), "db": float(db), "felt": "yes" if k < yes else "no"}
        for who, of in counts.items()
        for db, yes in zip(range(-6, 8, 2), of, strict=True)
        for k in range(20)
    ]
    rows += [
        {"participant": "c", "stimulus": str(db), "db": db, "felt": "yes" if db > 0.0 else "no"}  # few, and no guesses
        for db in (-4.0, -2.0, 2.0, 4.0)
        for _ in range(2)
    ]
    found = constant.findings(rows, Settings(bootstrap=0))
    said = (
        "The answers of b may be guesses: their threshold is drawn to the middle of the levels, and counts over people"
        "; so does their JND, which may be any: medians hardly change."
    )
    around = "The answers of e go the other way than most, and count: keys or question may be mistaken."
    assert found.remarks == [said, around]
    (alone,) = constant.findings([row for row in rows if row["participant"] == "e"], Settings(bootstrap=0)).remarks
    assert alone == "The curves of e fall with db: question, keys or judged_more may be mistaken."
    (of_few,) = (row for row in found.tables[0].rows if row[:2] == ("c", "threshold"))
    assert of_few[2:5] == (pytest.approx(0.0), -math.inf, math.inf)


def test_three_conditions_are_compared_in_ranks_and_then_in_pairs():
    """As in the thesis's table 6.3. Where all people rank them alike, Friedman's statistic is n (k - 1)."""
    rows = [
        {
            "participant": who,
            "stimulus": f"{db} {load}",
            "db": float(db),
            "load": load,
            "felt": "yes" if k < yes else "no",
        }
        for who, reach in (("a", 3.0), ("b", 2.4), ("c", 3.3), ("d", 2.0))
        for condition, load in enumerate(("none", "bag", "cart"))
        for db in range(-6, 8, 2)
        for k, yes in ((k, round(20 * norm.cdf((db - condition * reach + 3.0) / 3.0))) for k in range(20))
    ]
    tables = {table.title: table.rows for table in constant.findings(rows, Settings(bootstrap=0)).tables}
    ranks, *pairs = tables["Does load change the threshold?"]
    assert (ranks[1:4], ranks[4]) == (("chi squared", pytest.approx(8.0), "2"), pytest.approx(np.exp(-4.0)))
    halves = [
        [row[2] for row in tables["Curves of each person"] if row[1] == f"threshold {load}"] for load in ("bag", "none")
    ]
    assert len(pairs) == 3
    assert any(abs(pair[2]) == pytest.approx(abs(ttest_rel(*halves).statistic)) for pair in pairs)


def test_lapses_are_found_where_there_are_some():
    """The best curve of exact shares is the one that they come from."""
    fine = np.linspace(20.0, 200.0, 30)
    truth = psychometric.Curve(-5.0, 0.05, 0.05)
    many = np.full(30, 10_000)
    yes = truth.at(fine) * many
    found = psychometric.fit(fine, yes, many, with_lapses=True)
    assert (found.pse, found.slope, found.lapse) == pytest.approx((100.0, 0.05, 0.05), rel=1e-3)
    assert psychometric.fit(fine, yes, many).slope < 0.04
    *_, rate = psychometric.estimates(fine, yes, many, bootstrap=40, with_lapses=True)
    assert rate.name == "lapses"
    assert rate.value == pytest.approx(0.05, rel=1e-3)
    assert 0.04 < rate.low < rate.value < rate.high < 0.06


def test_intervals_of_bootstrap_and_of_covariance_agree_where_there_are_many_trials():
    yes = np.array([20, 60, 140, 240, 260, 300, 380])
    by_draws = psychometric.estimates(X, yes, TWENTY * 20, bootstrap=200)
    ask_nothing = psychometric.estimates(X, yes, TWENTY * 20, bootstrap=0)
    for one, other in zip(by_draws, ask_nothing, strict=True):
        width = other.high - other.low
        assert (one.name, one.value) == (other.name, other.value)
        assert (one.low, one.high) == pytest.approx((other.low, other.high), abs=0.15 * width)


def test_intervals_of_few_trials_are_corrected_for_curves_that_are_drawn_too_steep():
    """Efron's formula over 4000 curves that SciPy's BFGS fits to drawn answers; plain percentiles are 0.202, 0.720."""
    _, slope, _ = psychometric.estimates([-6, -4, -2, 0, 2, 4, 6], [0, 1, 1, 3, 4, 5, 6], [6] * 7, bootstrap=999)
    assert (slope.value, slope.low, slope.high) == pytest.approx((0.3144, 0.1785, 0.5627), rel=0.04)


@pytest.mark.parametrize(
    ("yes", "first", "unit"),
    [
        ([0, 2, 2, 5, 6], 1.0, 3.0),
        ([0, 0, 3, 5, 6], 1.0, 0.7),
        ([0, 1, 3, 4, 6], 1.0, 0.7),
        ([1, 2, 3, 4, 5], -2.0, 0.1),  # alike on both sides of a level of 0, as of decibels: PSE and intercept are 0
        ([0, 2, 3, 4, 6], 5.0, 0.7),  # a half at a level
    ],
)
def test_an_interval_of_few_trials_does_not_hang_on_the_unit_of_the_levels(yes, first, unit):
    """One draw in twenty is as the answers were: rounding said whether it lies below them."""
    levels = np.arange(first, first + 5.0)
    found, other = (psychometric.estimates(x, yes, np.full(5, 6), bootstrap=199) for x in (levels, unit * levels))
    for one, its, factor in zip(found, other, (unit, 1.0 / unit, 1.0), strict=True):
        assert (factor * one.low, factor * one.high) == pytest.approx((its.low, its.high), rel=1e-5)


def test_fiellers_interval_of_the_pse_holds_it_as_often_as_it_says():
    random = np.random.default_rng(5)
    truth = psychometric.Curve(-2.52, 0.025)
    held = 0
    for _ in range(400):
        pse, _, _ = psychometric.estimates(X, random.binomial(TWENTY, truth.at(X)), TWENTY, bootstrap=0)
        held += pse.covers(truth.pse)
    assert held / 400 == pytest.approx(0.95, abs=0.035)


def test_the_pse_has_no_bias_where_the_slope_is_known_to_rise():
    """Over normal intercepts and slopes, added up on a grid, its mean is the true ratio; the plain one's is not."""
    slope, pse, middle, deviation = 0.018, 151.6, 94.0, 0.005
    covariance = ((0.25, -0.0023), (-0.0023, deviation**2))
    steps = np.linspace(-6.0, 6.0, 2401)
    means = {"plain": 0.0, "unbiased": 0.0}
    weights = np.exp(-0.5 * steps**2) / np.exp(-0.5 * steps**2).sum()
    for step, weight in zip(steps, weights, strict=True):
        found = slope + deviation * step
        if found <= 0.0:
            continue  # a curve that falls: one in 6000
        mean_intercept = -slope * pse + covariance[0][1] / deviation**2 * (found - slope)
        curve = psychometric.Curve(mean_intercept, found, covariance=covariance)  # both are linear in the intercept
        means["plain"] += weight * curve.pse
        means["unbiased"] += weight * curve.unbiased_pse(middle)
    assert means["unbiased"] == pytest.approx(pse, abs=0.1)
    assert abs(means["plain"] - pse) > 2.0


@pytest.mark.parametrize("with_lapses", [False, True])
@pytest.mark.parametrize(
    ("yes", "is_bounded"), [([9, 11, 10, 10, 9, 11, 10], False), ([1, 3, 7, 12, 13, 15, 19], True)]
)
def test_draws_bound_the_pse_only_if_the_slope_is_not_none(yes, is_bounded, with_lapses):
    """As Fieller's interval does, which is bounded where the slope differs from 0."""
    drawn, slope, *_ = psychometric.estimates(X, yes, TWENTY, bootstrap=60, with_lapses=with_lapses)
    by_covariance, _, _ = psychometric.estimates(X, yes, TWENTY, bootstrap=0)
    assert slope.covers(0.0) is not is_bounded
    for pse in (drawn, by_covariance):
        assert (pse.low, pse.high) == (-np.inf, np.inf) if not is_bounded else 60.0 < pse.low < pse.high < 140.0


def test_a_level_beside_silence_is_found_though_half_of_what_is_not_felt_is_guessed():
    """From 0.5 on, shares were taken for a shallow curve, with a threshold far below all levels."""
    random, held, found = np.random.default_rng(8), [], []
    levels, of = np.arange(-9.0, 10.0, 1.5), np.full(13, 25)
    truth = psychometric.Curve(-0.5, 0.5, guessed=0.5)
    assert (truth.pse, truth.at(1.0), truth.at(-50.0)) == (1.0, 0.75, 0.5)
    for _ in range(100):
        three = psychometric.estimates(levels, random.binomial(of, truth.at(levels)), of, bootstrap=0, guessed=0.5)
        held.append([one.covers(value) for one, value in zip(three, (1.0, 0.5, -0.5), strict=True)])
        found.append([one.value for one in three])
    assert np.mean(held, axis=0) == pytest.approx([0.95] * 3, abs=0.05)
    assert np.nanmedian(found, axis=0) == pytest.approx([1.0, 0.5, -0.5], abs=0.1)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25])
def test_who_says_yes_to_nothing_has_the_threshold_and_the_interval_of_their_curve(share):
    """As if nobody did, a threshold of 2 was found at -0.1 and -4.5, with intervals that ended below 1."""
    levels, of = np.array([-12.0, -6.0, 0.0, 6.0, 12.0]), 10_000
    truth = np.array([-0.4, 0.2, share])

    def chances(values):
        a, b, guessed = values
        return np.append(guessed + (1.0 - guessed) * norm.cdf(a + b * levels), guessed)

    *yes, to_nothing = np.round(of * chances(truth)).astype(int).tolist()
    with_rate, slope, _ = psychometric.estimates(levels, yes, [of] * 5, bootstrap=0, guessed=(to_nothing, of))
    curve = psychometric.fit(levels, yes, [of] * 5, guessed=(to_nothing, of))
    assert (with_rate.value, slope.value, curve.guessed) == pytest.approx((2.0, 0.2, share), abs=2e-3)
    if share:  # at 0 the rate is at its bound
        by = np.array([(chances(truth + h) - chances(truth - h)) / 2e-5 for h in 1e-5 * np.eye(3)])
        chance = chances(truth)
        expected = np.linalg.inv((by * of / (chance * (1.0 - chance))) @ by.T)[:2, :2]
        np.testing.assert_allclose(curve.covariance, expected, rtol=0.01)


def test_answers_to_nothing_are_drawn_anew_with_the_others():
    """Where levels begin at the threshold, these tell where the curve begins; kept, they halve the interval."""
    levels, yes, of = np.arange(0.0, 13.0, 3.0), [179, 272, 349, 387, 398], np.full(5, 400)
    by_covariance, drawn = (psychometric.estimates(levels, yes, of, draws, guessed=(10, 50))[0] for draws in (0, 199))
    assert drawn.high - drawn.low == pytest.approx(by_covariance.high - by_covariance.low, rel=0.1)


@pytest.mark.parametrize("factors", [{}, {"place": "toe"}])
def test_trials_of_nothing_say_where_a_curve_of_detection_begins(factors):
    """They were in no curve, or at 0 m/s^2 of one that begins at 0, whose threshold was 3 dB too low."""
    levels, truth = np.arange(-15.0, 16.0, 5.0), psychometric.Curve(0.4, 0.2, guessed=0.2)
    rows = [{"participant": "P1", "stimulus": "nothing", LEVEL: 0.0, "felt": "yes", **factors}] * 8
    rows += [{**rows[0], "felt": "no"}] * 32
    for level, share in zip(levels.tolist(), truth.at(levels), strict=True):
        row = {"participant": "P1", "stimulus": f"at{level}", LEVEL: 10.0 ** (level / 20.0), "db": level}
        yes = round(40 * share)
        rows += [{**row, "felt": "yes", **factors}] * yes + [{**row, "felt": "no", **factors}] * (40 - yes)
    rows += [{**row, "place": "heel"} for row in rows] * bool(factors)
    (threshold, slope, *_), found = (of(rows, Settings(bootstrap=0)) for of in (constant.estimates, constant.findings))
    drawn, *_ = constant.estimates(rows, Settings(bootstrap=20))
    assert threshold.low < drawn.low < threshold.value < drawn.high < threshold.high + 2.0
    assert (threshold.value, slope.value) == pytest.approx((-2.0, 0.2), abs=0.1)
    assert threshold.name == " ".join(("threshold", *(["heel"] if factors else [])))
    assert "in no curve" not in " ".join(found.remarks)
    assert "JND: from there to where three quarters of the rest are" in found.tables[0].note
    (alarms,) = (table.rows for table in found.tables if table.title == "False alarms")
    assert alarms == (("P1", 16, 80) if factors else ("P1", 8, 40),)
    assert found.drawings[0].lines == ()  # half of all is not where half of the rest is
    in_si = [{name: value for name, value in row.items() if name != "db"} for row in rows]
    assert {float(row[LEVEL]) for row in constant.prepared(in_si)[0]} == {10.0 ** (level / 20.0) for level in levels}


def test_one_level_beside_nothing_has_shares_and_no_curve():
    """Its curve was empty in all tables, since trials of nothing are no level of it."""
    rows = [
        {"participant": "P1", "stimulus": name, LEVEL: level, "felt": "yes" if k < yes else "no"}
        for name, level, yes in (("nothing", 0.0, 2), ("faint", 0.2, 14))
        for k in range(20)
    ]
    found = constant.findings(rows, Settings(bootstrap=0))
    shares = {one.name: one.value for one in constant.estimates(rows, Settings())}
    assert shares == {"share faint": 0.7, "share nothing": 0.1}
    assert "two levels beside nothing" in " ".join(found.remarks)
    assert not any("Curves" in table.title for table in found.tables)


@pytest.mark.parametrize(
    ("yes", "pse", "low", "high"),
    [
        ([10, 11, 9, 20, 20], 4.5, 3.0, 6.0),
        ([10, 11, 9, 10, 20], 7.5, 6.0, 9.0),
        ([9, 10, 9, 10, 10], np.nan, -np.inf, np.inf),
    ],
)
def test_right_answers_that_turn_beside_silence_have_a_threshold_between_and_no_slope(yes, pse, low, high):
    levels = np.array([0.0, 1.5, 3.0, 6.0, 9.0])
    found, slope, _ = psychometric.estimates(levels, yes, np.full(5, 20), bootstrap=0, guessed=0.5)
    assert (found.value, found.low, found.high) == pytest.approx((pse, low, high), nan_ok=True)
    assert np.isnan(slope.value)


@pytest.mark.parametrize(("x", "yes"), [(X, np.zeros(7)), (X, TWENTY), ([90.0] * 7, TWENTY // 2)])
def test_what_has_no_curve_is_refused(x, yes):
    with pytest.raises(BadMeasurement, match="no curve to fit"):
        psychometric.fit(x, yes, TWENTY)


@pytest.mark.parametrize("yes", [TWENTY + 1, [-1, 3, 7, 12, 13, 15, 19], [0, 3, 7, 12, 13, 15, 20.5], [0, 3, 7]])
def test_more_answers_than_trials_or_fewer_than_none_or_than_levels_are_refused(yes):
    with pytest.raises(BadValue, match=r"^yes is \[.*; allowed: (0 to of, \[20\.0|as many values as x, 7, )"):
        psychometric.estimates(X, yes, TWENTY)


def test_a_steep_slope_has_no_upper_bound_where_answers_drawn_from_it_turn_at_once():
    """Of such answers to a curve as steep as this one, many have both answers at one level alone, or at none."""
    pse, slope, intercept = psychometric.estimates(X, [0, 0, 1, 6, 10, 10, 10], [10] * 7, bootstrap=100)
    assert (slope.high, intercept.low) == (np.inf, -np.inf)
    assert 0.05 < slope.low < slope.value < 0.2
    assert X[2] <= pse.low < pse.value < pse.high <= X[4]


@pytest.mark.parametrize("bootstrap", [0, 60])
@pytest.mark.parametrize("with_lapses", [False, True])
@pytest.mark.parametrize(
    ("yes", "of", "pse"),
    [
        ([0, 0, 0, 10, 10, 10, 10], 10, (83.0, 76.0, 90.0)),
        ([10, 10, 10, 10, 0, 0, 0], 10, (98.0, 90.0, 106.0)),
        ([0, 0, 0, 1, 10, 10, 10], 10, (90.0, 76.0, 106.0)),
        ([0, 0, 0, 3, 3, 3, 3], 3, (83.0, 64.0, 106.0)),
        ([0, 0, 0, 1, 1, 1, 1], 1, (83.0, -np.inf, np.inf)),
    ],
)
def test_answers_that_turn_at_once_have_a_pse_and_no_slope(yes, of, pse, bootstrap, with_lapses):
    """The steeper the curve the likelier they are, without end: a slope would be where the iterations stop."""
    of = np.full(7, of)
    chances = [np.exp(-loss_of(slope, pse[0], yes, of)) for slope in (0.1, 1.0, 10.0)]
    assert chances == sorted(chances)
    found, *others = psychometric.estimates(X, yes, of, bootstrap, with_lapses=with_lapses)
    assert (found.value, found.low, found.high) == pse
    assert all(np.isnan([one.value, one.low, one.high]).all() for one in others)


def loss_of(slope, pse, yes, of):
    """The loss of the best of the curves with this slope that pass a half near the PSE."""
    half = np.linspace(pse - 2.0 / slope, pse + 2.0 / slope, 4001)[:, None]
    sign = np.sign(yes[-1] - yes[0])
    chance = sign * slope * (X - half)
    return -(yes * norm.logcdf(chance) + (of - yes) * norm.logcdf(-chance)).sum(axis=1).max()


def test_the_pse_of_steep_curves_is_held_as_often_as_the_interval_says():
    random = np.random.default_rng(6)
    held, turned = 0, 0
    for _ in range(150):
        truth = psychometric.Curve(-0.2 * (half := random.uniform(85.0, 110.0)), 0.2)
        of = np.full(7, 8)
        pse, slope, _ = psychometric.estimates(X, random.binomial(of, truth.at(X)), of, bootstrap=0)
        held, turned = held + pse.covers(half), turned + np.isnan(slope.value)
    assert turned > 75
    assert held / 150 > 0.93
