"""Tests between conditions, by SciPy and statsmodels, with the figures that a paper reports.

Where all values are alike, or all differences between conditions, there is nothing to test against: statistic and p are
NaN.
"""

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_alike
from underfoot.errors import BadMeasurement, in_one_line
from underfoot.experiments.analysis.estimate import Estimate, mean_interval
from underfoot.experiments.analysis.libraries import statsmodels

DIFFERENCE = "difference"


@dataclass(frozen=True)
class Test:
    """A test: its subject, statistic by name, degrees of freedom, p, effect size by name, and with its interval what is
    tested, where that is one number: a mean difference over people, or a coefficient.
    """

    __test__ = False  # not a pytest class

    name: str
    statistic: str
    value: float
    df: tuple[float, ...]
    p: float
    effect: str = ""
    size: float = math.nan
    tested: Estimate | None = None


def one_way_anova(name: str, groups: Sequence[ArrayLike]) -> Test:
    """Test whether the means of groups of different people differ.

    >>> found = one_way_anova("set", [[1.0, 2.0, 3.0], [2.0, 3.0, 4.0]])
    >>> found.df, found.value, round(found.p, 3)
    ((1, 4), 1.5, 0.288)
    """
    from scipy import stats

    values = [np.asarray(group, np.float64) for group in groups]
    _require_groups(name, values, 2)
    vary = any(_vary(v, v) for v in values)
    statistic, p = stats.f_oneway(*values) if vary else (math.nan, math.nan)
    total = sum(map(len, values))
    mean = np.concatenate(values).mean()
    between = sum(len(v) * (v.mean() - mean) ** 2 for v in values)
    within = sum(((v - v.mean()) ** 2).sum() for v in values)
    size = float(between / (between + within)) if between + within else math.nan
    df = (len(values) - 1, total - len(values))
    return Test(name, "F", float(statistic), df, float(p), "eta squared", size)


def repeated_measures_anova(table: Sequence[Mapping[str, Any]], value: str, factors: Sequence[str]) -> list[Test]:
    """Test effects of within-subject factors and their interactions, with partial eta squared (statsmodels' AnovaRM).

    An effect with more than one degree of freedom is followed by its test with Greenhouse and Geisser's correction.
    `table` has rows with `participant`, the factors and `value`; several rows of one cell are averaged. Each person
    must have every cell.
    """
    from scipy.special import fdtrc

    pandas = _pandas()
    columns = ["participant", *factors, value]
    frame = pandas.DataFrame([{column: row[column] for column in columns} for row in table])
    if frame.empty or frame["participant"].nunique() < 2:
        raise BadMeasurement("an analysis of variance within people needs two or more of them")
    for column in columns[:-1]:
        frame[column] = pandas.factorize(frame[column], sort=True)[0]  # patsy takes the word nan for no value
    cells = frame.groupby(list(factors), observed=True).ngroups
    kept = [len(set(zip(*(part[f] for f in factors), strict=True))) for _, part in frame.groupby("participant")]
    if any(count != cells for count in kept):
        raise BadMeasurement("somebody lacks a condition: the analysis of variance needs all of them from each person")
    people = frame.pivot_table(index="participant", columns=list(factors), values=value).to_numpy()
    shifts = people - people.mean(axis=1, keepdims=True)
    if not any(_vary(shift, people) for shift in shifts.T):
        raise BadMeasurement(
            "the conditions differ alike for everybody: an analysis of variance has no error to compare"
        )
    anova = statsmodels("stats.anova").AnovaRM
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # from pandas, inside statsmodels
        model = anova(frame, value, "participant", within=list(factors), aggregate_func="mean")
        rows = model.fit().anova_table
    means = people.reshape(len(people), *(frame[factor].nunique() for factor in factors))
    found = []
    for name, row in rows.iterrows():
        contrasts = _contrasts(means, [factor in str(name).split(":") for factor in factors])
        vary = any(_vary(contrast, people) for contrast in contrasts.T)
        f, p = (float(row["F Value"]), float(row["Pr > F"])) if vary else (math.nan, math.nan)
        above, below = float(row["Num DF"]), float(row["Den DF"])
        size = f * above / (f * above + below)
        effect = str(name).replace(":", " x ")
        found.append(Test(effect, "F", f, (above, below), p, _PARTIAL, size))
        if vary and above > 1.0:
            epsilon = greenhouse_geisser(contrasts)
            df = (epsilon * above, epsilon * below)
            found.append(Test(f"{effect}, corrected", "F", f, df, float(fdtrc(*df, f)), "epsilon", epsilon))
    return found


def groups_compared(name: str, groups: Mapping[str, Mapping[str, float]]) -> list[Test]:
    """Test whether the means of groups differ, each with a value of each of its people.

    One-way ANOVA where everybody is in one group. Else what people have in common is no error: repeated measures of
    those who are in all.

    >>> one, other = {"P1": 0.9, "P2": 0.5, "P3": 0.2}, {"P1": 0.8, "P2": 0.45, "P3": 0.1}
    >>> (found,) = groups_compared("rate", {"A": one, "B": other})
    >>> found.df, round(found.p, 3), found.effect
    ((1.0, 2.0), 0.038, 'partial eta squared')
    """
    people = [who for group in groups.values() for who in group]
    if len(set(people)) == len(people):
        return [one_way_anova(name, [list(group.values()) for group in groups.values()])]
    table = [
        {"participant": who, "group": label, "value": value}
        for label, group in groups.items()
        for who, value in group.items()
        if people.count(who) == len(groups)
    ]
    if not table:
        raise BadMeasurement(f"{name}: some people have several of {', '.join(groups)}, and nobody has all")
    tests = repeated_measures_anova(table, "value", ["group"])
    return [replace(test, name=test.name.replace("group", name, 1)) for test in tests]


def _contrasts(means: NDArray[np.float64], is_within: Sequence[bool]) -> NDArray[np.float64]:
    """Return an effect's orthonormal contrasts of each person, [person, contrast]. `means` has an axis of people, and
    one for each factor; `is_within` says which of these the effect is of.
    """
    found = np.ones((1, 1))
    for count, within in zip(means.shape[1:], is_within, strict=True):
        steps = np.linalg.qr(np.eye(count)[:, 1:] - 1.0 / count)[0]  # orthonormal, and orthogonal to the mean
        found = np.kron(found, steps if within else np.full((count, 1), count**-0.5))
    return np.asarray(means.reshape(len(means), -1) @ found)


def greenhouse_geisser(contrasts: ArrayLike) -> float:
    """Return epsilon of orthonormal contrasts, [person, contrast]: 1 where all vary alike (Psychometrika 24, 1959).

    >>> round(greenhouse_geisser([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]), 9)
    1.0
    """
    spread = np.atleast_2d(np.cov(np.asarray(contrasts, np.float64), rowvar=False))
    return float(np.trace(spread) ** 2 / (len(spread) * (spread**2).sum()))


_PARTIAL = "partial eta squared"


def friedman(name: str, conditions: Sequence[ArrayLike]) -> Test:
    """Test whether three or more conditions, each measured on the same people, differ in rank."""
    from scipy import stats

    values = [np.asarray(condition, np.float64) for condition in conditions]
    _require_groups(name, values, 3)
    people, vary = len(values[0]), bool(np.ptp(values, axis=0).any())
    statistic, p = map(float, stats.friedmanchisquare(*values) if vary else (math.nan, math.nan))
    size = statistic / (people * (len(values) - 1))
    return Test(name, "chi squared", statistic, (len(values) - 1,), p, "Kendall's W", size)


def paired_t(conditions: Mapping[str, ArrayLike], against: str = "") -> list[Test]:
    """Test conditions measured on the same people with paired t tests; p is corrected by Bonferroni.

    All pairs of conditions are tested, or, with `against`, each condition against that one.
    """
    from scipy import stats

    values = {name: np.asarray(v, np.float64) for name, v in conditions.items()}
    pairs = [(value, against) for value in values if value != against] if against else list(combinations(values, 2))
    found = []
    for one, other in pairs:
        _require_groups(f"{one} - {other}", [values[one], values[other]], 2)
        difference = values[one] - values[other]
        vary = _vary(difference, [values[one], values[other]])
        statistic, p = stats.ttest_rel(values[one], values[other]) if vary else (math.nan, math.nan)
        size = float(difference.mean() / difference.std(ddof=1)) if vary else math.nan
        df = (float(len(difference) - 1),)
        mean = mean_interval(DIFFERENCE, difference.tolist())
        found.append(Test(f"{one} - {other}", "t", float(statistic), df, float(p), "Cohen's d", size, mean))
    corrected = statsmodels("stats.multitest").multipletests([one.p for one in found], method="bonferroni")[1]
    return [replace(one, p=float(p)) for one, p in zip(found, corrected, strict=True)]


def spearman(name: str, x: ArrayLike, y: ArrayLike) -> Test:
    """Test the rank correlation of two variables."""
    from scipy import stats

    require_alike(x=x, y=y)
    values = [np.asarray(x, np.float64), np.asarray(y, np.float64)]
    if len(values[0]) < 3 or min(np.ptp(v) for v in values) == 0.0:
        raise BadMeasurement(f"{name}: a correlation needs three or more people who differ")
    found = stats.spearmanr(values[0], values[1])
    return Test(name, "rho", float(found.statistic), (float(len(values[0]) - 2),), float(found.pvalue))


def fisher(name: str, counts: ArrayLike) -> Test:
    """Test a 2 x 2 table of counts with Fisher's exact test; the effect size is the odds ratio.

    >>> found = fisher("tea", [[3, 1], [1, 3]])
    >>> round(found.p, 4), found.size
    (0.4857, 9.0)
    """
    from scipy import stats

    found = stats.fisher_exact(np.asarray(counts))
    ratio = float(found.statistic)
    return Test(name, "odds ratio", ratio, (), float(found.pvalue), "odds ratio", ratio)


def shares_compared(name: str, conditions: Mapping[str, Mapping[str, tuple[int, int]]]) -> list[Test]:
    """Test whether a share differs between two conditions, each with (count, of) of each person.

    Trials of one person are alike, so people are what is tested: paired t of the shares of those with both conditions,
    one-way ANOVA where nobody has both. Of one person alone, trials are: Fisher's exact test.

    >>> one, other = {"P1": (9, 10), "P2": (7, 10), "P3": (6, 10)}, {"P1": (5, 10), "P2": (4, 10), "P3": (4, 10)}
    >>> (found,) = shares_compared("distance", {"far": one, "near": other})
    >>> found.name, found.statistic, found.df, round(found.p, 3)
    ('far - near', 't', (2.0,), 0.035)
    """
    one, other = ({who: counts for who, counts in part.items() if counts[1]} for part in conditions.values())
    both = [who for who in one if who in other]
    if both and len(one) == len(other) == 1:
        return [fisher(name, [(count, of - count) for count, of in (one[both[0]], other[both[0]])])]
    shares = [[part[who][0] / part[who][1] for who in (both or part)] for part in (one, other)]
    return paired_t(dict(zip(conditions, shares, strict=True))) if both else [one_way_anova(name, shares)]


def logistic_regression(success: ArrayLike, factors: Mapping[str, ArrayLike], people: Sequence[object]) -> list[Test]:
    """Regress success on numeric factors: one coefficient each, with its test; `size` is the odds ratio, of one more.

    `people` has whose trial each is. Trials of one person are alike: counted as independent, a fifth to a third of
    factors without effect had p < 0.05 in simulations in which people differ. So deviations of a coefficient are
    those between people (generalised estimating equations), without the bias of few people (Mancl and DeRouen,
    Biometrics 57, 2001), and Student's t of them has 3 to 6 %. Of one person alone: Wald's z.

    Factors with one value only are left out. Raises `BadMeasurement` if a factor separates success from failure
    perfectly, or all trials are alike.
    """
    from scipy import stats

    outcome = np.asarray(success, np.float64)
    columns = {name: np.asarray(values, np.float64) for name, values in factors.items() if np.ptp(values) > 0.0}
    if not columns or not 0.0 < outcome.sum() < len(outcome):
        raise BadMeasurement("all trials are alike; there is nothing to regress")
    design = np.column_stack([np.ones_like(outcome), *columns.values()])
    logit = statsmodels("discrete.discrete_model").Logit
    gee, binomial = statsmodels("genmod.generalized_estimating_equations").GEE, statsmodels("genmod.families").Binomial
    free = len(set(people)) - 1
    with warnings.catch_warnings():
        for of_the_data in (UserWarning, RuntimeWarning):  # as separation and failure to converge
            warnings.simplefilter("error", of_the_data)
        try:
            found = logit(outcome, design).fit(disp=0)
            if free:  # the same coefficients
                whole = gee(outcome, design, groups=np.asarray(people), family=binomial())
                found = whole.fit(start_params=found.params, cov_type="bias_reduced")
        except Exception as error:
            why = in_one_line(error) or type(error).__name__
            raise BadMeasurement(f"the logistic regression does not converge: {why}") from None
    statistic, df, distribution = ("t", (float(free),), stats.t(free)) if free else ("z", (), stats.norm)
    half = float(distribution.ppf(0.975)) * found.bse
    with np.errstate(over="ignore"):  # of a metre, where the factor is of millimetres
        odds = np.exp(found.params)
    return [
        Test(
            name,
            statistic,
            float(t),
            df,
            2.0 * float(distribution.sf(abs(t))),
            "odds ratio",
            float(ratio),
            Estimate("coefficient", float(b), float(b - h), float(b + h)),
        )
        for name, t, b, h, ratio in zip(("intercept", *columns), found.tvalues, found.params, half, odds, strict=True)
    ]


def _vary(values: ArrayLike, of: ArrayLike) -> bool:
    """Return whether `values`, computed from numbers `of`, differ by more than these numbers' rounding."""
    return bool(np.ptp(values) > 1e-12 * np.abs(of).max())


def _require_groups(name: str, values: Sequence[Any], least: int) -> None:
    if len(values) < least or any(len(v) < 2 for v in values):
        raise BadMeasurement(f"{name}: a test needs {least} or more conditions, with two or more values in each")


def _pandas() -> ModuleType:
    statsmodels("api")  # a requirement; reports in one line if it is missing
    import pandas

    return pandas
