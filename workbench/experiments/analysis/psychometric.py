"""Psychometric curves: a cumulative normal by probit regression, its point of subjective equality, and intervals.

The regression is a generalised linear model with the probit link. Lapses and guesses are estimated with the curve, by
the same scoring with damped steps. Intervals come from a parametric bootstrap: data are drawn from the fitted curve and
fitted again, all at once. The faster alternative is the regression's covariance: Wald's interval for slope and
intercept, and Fieller's (Some problems in interval estimation, 1954) for the PSE, which is a ratio. If the slope can be
0, the PSE has no bounds. Percentiles of ratios would then end at the draw whose slope is nearest to 0, and cover the
true value too rarely (no bounded interval can: Gleser and Hwang, Annals of Statistics 15, 1987). The plain ratio, minus
intercept over slope, is biased upwards by the few curves with a slope near 0. The unbiased PSE uses that the sign of
the slope is known (Andrews and Armstrong, Quantitative Economics 8, 2017).

Where right answers are guessed, as beside silence (2AFC detection), the curve begins at their share (Wichmann and Hill,
Percept. Psychophys. 63, 2001). Where some say yes to nothing, it begins at a share that is estimated with the rest: the
answers to nothing are part of the likelihood.

Where at most one level has both answers, and all beyond it are alike, the likelihood rises with the slope without end
(Silvapulle, J. R. Stat. Soc. B 43, 1981): there is a PSE, but no slope.
"""

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import numbers
from underfoot.errors import BadMeasurement, require
from underfoot.experiments.analysis.estimate import Z_95, Estimate
from underfoot.experiments.analysis.likelihood import Climb, bell, loss
from underfoot.kernels import Floats

MOST_LAPSES = 0.1
"""Upper bound of a fitted lapse rate; more is not a lapse but another curve (Wichmann and Hill, 2001, use up to
0.06).
"""

Guessed = float | tuple[int, int]
"""The share of "yes" answers where nothing is felt: known, or to be estimated from how many of how many trials of
nothing had one. 0: none, or as many as lapses.
"""
NAMES = ("pse", "slope", "intercept", "lapses")
"""Estimates of a curve; the last one with lapses only."""
_MOST_GUESSED = 0.5
"""Upper bound of an estimated share of guesses: who says yes to nothing more often than not feels nothing."""
_LEAST_DRAWS = 20
"""Least number of bootstrap draws for an interval."""
_CERTAIN = 6
"""Answers that are alike by chance in fewer than 2.5 % of cases, if one answer is no likelier than the other."""


@dataclass(frozen=True)
class Curve:
    """P(x) = low + (1 - lapse - low) Phi(intercept + slope x), where `low` is the share that is `guessed`, and for None
    the lapse. `pse` is where Phi is a half.
    """

    intercept: float
    slope: float
    lapse: float = 0.0
    covariance: tuple[tuple[float, float], tuple[float, float]] = ((math.nan, math.nan), (math.nan, math.nan))
    """Covariance of intercept and slope; NaN with lapses."""
    guessed: float | None = None

    @property
    def pse(self) -> float:
        """Point of subjective equality; NaN for a curve without slope.

        >>> Curve(-2.5, 0.025).pse
        100.0
        """
        return -self.intercept / self.slope if self.slope else math.nan

    def at(self, x: ArrayLike) -> Floats:
        """Return the probability at each of `x`."""
        from scipy.special import ndtr

        normal = ndtr(self.intercept + self.slope * np.asarray(x, np.float64))
        low = self.lapse if self.guessed is None else self.guessed
        return np.asarray(low + (1.0 - self.lapse - low) * normal)

    def unbiased_pse(self, middle: float) -> float:
        """Return the PSE without bias; the plain ratio if there is no covariance.

        For a normal slope with deviation s, Mills' ratio of slope / s, over s, has the mean 1 / true slope. The height
        of the curve at a `middle` of levels, minus its part correlated with the slope, is independent of the slope:
        their product is unbiased.
        """
        from scipy.special import erfcx

        (vii, vis), (_, vss) = self.covariance
        if not (math.isfinite(vii + vis) and 0.0 < vss < math.inf):
            return self.pse
        deviation, height = math.sqrt(vss), self.intercept + self.slope * middle
        mills = math.sqrt(0.5 * math.pi) * float(erfcx(abs(self.slope) / deviation / math.sqrt(2.0)))
        share = (vis + middle * vss) / vss
        return middle - math.copysign(mills / deviation, self.slope) * (height - share * self.slope) - share


def fit(x: ArrayLike, yes: ArrayLike, of: ArrayLike, *, with_lapses: bool = False, guessed: Guessed = 0.0) -> Curve:
    """Fit the curve of `yes` answers out of `of` at each level `x`; also of shares, with `of` 1.

    Raises `BadMeasurement` if all answers are alike, or fewer than two levels were presented, and `BadValue` for more
    answers than trials, or fewer than none.

    >>> x = [52, 64, 76, 90, 106, 124, 146]
    >>> round(fit(x, [0.034, 0.13, 0.33, 0.557, 0.64, 0.69, 0.77], np.ones(7)).pse, 1)
    100.6
    >>> detected = fit([-18, -12, -6, 0, 6, 12], [2, 2, 5, 15, 19, 20], np.full(6, 20), guessed=(2, 20))
    >>> round(detected.pse, 1), round(detected.guessed, 2)
    (-2.1, 0.09)
    """
    levels, counts, totals = numbers("x", x), numbers("yes", yes), numbers("of", of)
    alike = len(levels) == len(counts) == len(totals)
    require(alike, "yes", counts.tolist(), f"as many values as x, {len(levels)}, and as of, {len(totals)}")
    require(bool(((counts >= 0.0) & (counts <= totals)).all()), "yes", counts.tolist(), f"0 to of, {totals.tolist()}")
    if len(np.unique(levels[totals > 0])) < 2 or not 0.0 < counts.sum() < totals.sum():
        raise BadMeasurement("the answers are all alike, or of one level only; there is no curve to fit")
    counts, totals = _with_nothing(counts, totals, guessed)
    (curve,) = _fits(levels, counts[None], totals, with_lapses=with_lapses, guessed=guessed)
    return curve


def estimates(
    x: ArrayLike,
    yes: ArrayLike,
    of: ArrayLike,
    bootstrap: int = 399,
    seed: int = 1,
    *,
    with_lapses: bool = False,
    guessed: Guessed = 0.0,
) -> tuple[Estimate, ...]:
    """Estimate PSE, slope and intercept with 95 % intervals: from `bootstrap` draws, or for 0 from the covariance.

    Bootstrap curves that cannot be fitted are omitted; the slope of those that turn at once is endless. With lapses,
    their rate is the fourth estimate, and intervals need draws. Where the slope's interval holds 0, the PSE has no
    bounds. Where the answers turn at once, all but the PSE are NaN.

    >>> pse, _, _ = estimates([52, 64, 76, 90, 106, 124, 146], [4, 5, 5, 4, 6, 5, 5], [10] * 7, bootstrap=40)
    >>> pse.low, pse.high
    (-inf, inf)
    """
    curve = fit(x, yes, of, with_lapses=with_lapses, guessed=guessed)
    if (turn := _turn(curve, x, yes, of)) is not None:
        return turn, *(Estimate(name, math.nan) for name in NAMES[1 : 4 if with_lapses else 3])
    pse = curve.unbiased_pse(float(np.mean(np.asarray(x, np.float64))))
    if bootstrap == 0:
        plain, slope, intercept = _by_covariance(curve)
        rate = (Estimate(NAMES[3], curve.lapse),) if with_lapses else ()
        return replace(plain, value=pse), slope, intercept, *rate
    levels, totals = np.asarray(x, np.float64), np.asarray(of, np.int64)
    random = np.random.default_rng(seed)
    of_each = _with_nothing(yes, totals, guessed)[1].astype(np.int64)
    chance = _chances(curve, levels, guessed).round(12)  # of 0.5 and of its last bit more, NumPy draws other answers
    drawn = random.binomial(of_each, chance, (bootstrap, len(of_each)))
    said_yes = drawn[:, : len(levels)].sum(axis=1)
    drawn = drawn[(said_yes > 0) & (said_yes < totals.sum())]
    fits = _fits(levels, drawn.astype(np.float64), of_each.astype(np.float64), with_lapses=with_lapses, guessed=guessed)
    drawn = drawn[:, : len(levels)]
    again = [_figures(found, _turn(found, levels, one, totals)) for found, one in zip(fits, drawn, strict=True)]
    width = float(levels.std())
    units = (width, 1.0 / width, 1.0)
    bounded, slope, intercept = (
        Estimate(name, value, *_bias_corrected(value, [figures[k] for figures in again], units[k]))
        for k, (name, value) in enumerate(zip(NAMES[:3], _figures(curve, None)[:3], strict=True))
    )
    if slope.covers(0.0):
        bounded = replace(bounded, low=-math.inf, high=math.inf)
    rate = (Estimate(NAMES[3], curve.lapse, *_percentiles([one[3] for one in again])),) if with_lapses else ()
    return replace(bounded, value=pse), slope, intercept, *rate


def lapses_p(curves: Iterable[tuple[ArrayLike, ArrayLike, ArrayLike, Guessed]]) -> float:
    """Return p of all these (levels, yes, of, guessed) having no lapses: how much likelier curves with a rate are.

    A rate is at least 0, so that half of curves without lapses are not likelier with one: chi-bar-squared (Self and
    Liang, J. Am. Stat. Assoc. 82, 1987). Curves that cannot be fitted, or turn at once, say nothing.
    """
    from scipy.special import bdtr, chdtrc

    gain, count = 0.0, 0
    for x, yes, of, guessed in curves:
        with suppress(BadMeasurement):
            plain, lapsing = (fit(x, yes, of, with_lapses=lapses, guessed=guessed) for lapses in (False, True))
            if _turn(plain, x, yes, of) is None:
                answers = _with_nothing(yes, of, guessed)
                before, after = (loss(_chances(curve, x, guessed), *answers) for curve in (plain, lapsing))
                gain += 2.0 * max(float(before - after), 0.0)
                count += 1
    weights = [float(bdtr(k, count, 0.5) - (bdtr(k - 1, count, 0.5) if k else 0.0)) for k in range(count + 1)]
    return sum(weight * float(chdtrc(k, gain) if k else gain <= 0.0) for k, weight in enumerate(weights))


def _with_nothing(yes: ArrayLike, of: ArrayLike, guessed: Guessed) -> tuple[Floats, Floats]:
    """Return the answers and trials of each level and, where the share of guesses is estimated, of nothing."""
    counts, totals = np.asarray(yes, np.float64), np.asarray(of, np.float64)
    if isinstance(guessed, tuple):
        return np.append(counts, guessed[0]), np.append(totals, guessed[1])
    return counts, totals


def _chances(curve: Curve, x: ArrayLike, guessed: Guessed) -> Floats:
    """Return the chance of "yes" at each of them."""
    return np.append(curve.at(x), curve.guessed or 0.0) if isinstance(guessed, tuple) else curve.at(x)


def _turn(curve: Curve, x: ArrayLike, yes: ArrayLike, of: ArrayLike) -> Estimate | None:
    """Return the PSE of answers that turn between two levels, or at one; None if there is a slope.

    Its interval ends where six or more answers in a row of levels are alike.

    >>> _turn(Curve(0.0, 0.0), [60, 70, 80, 90, 100, 110], [0, 0, 0, 4, 10, 10], [10] * 6)
    Estimate(name='pse', value=90.0, low=80.0, high=100.0, unit='')
    """
    if (curve.guessed or 0.0) > _FLAT:
        return _turn_of_guesses(curve, x, yes, of)
    levels, counts, totals = (np.asarray(values, np.float64)[np.argsort(x)] for values in (x, yes, of))
    levels, counts, totals = levels[totals > 0], counts[totals > 0], totals[totals > 0]
    if counts[0] / totals[0] > counts[-1] / totals[-1]:
        counts = totals - counts
    last_no, first_yes = levels[counts < totals].max(), levels[counts > 0].min()
    if last_no > first_yes:
        return None

    def end(alike: NDArray[np.bool_], inwards: int, none: float) -> float:
        enough = levels[alike][::inwards][np.cumsum(totals[alike][::inwards]) >= _CERTAIN]
        return float(enough[0]) if enough.size else none

    low, high = end(counts == 0, -1, -math.inf), end(counts == totals, 1, math.inf)
    return Estimate("pse", 0.5 * float(last_no + first_yes), low, high)


def _figures(curve: Curve, turn: Estimate | None) -> tuple[float, float, float, float]:
    """Return PSE, slope, intercept and lapse rate; where the answers turn at once, of an endless slope at that PSE."""
    if turn is None:
        return curve.pse, curve.slope, curve.intercept, curve.lapse
    steep = math.copysign(math.inf, curve.slope)
    return turn.value, steep, -steep * turn.value, curve.lapse


def _by_covariance(curve: Curve) -> tuple[Estimate, Estimate, Estimate]:
    z = Z_95
    (vii, vis), (_, vss) = curve.covariance
    found = []
    for name, value, variance in (("slope", curve.slope, vss), ("intercept", curve.intercept, vii)):
        half = z * math.sqrt(variance) if variance >= 0.0 else math.nan
        found.append(Estimate(name, value, value - half, value + half))
    # Fieller: all x at which intercept + slope x is within z standard errors of 0.
    a, b, c = (
        curve.slope**2 - z * z * vss,
        curve.intercept * curve.slope - z * z * vis,
        curve.intercept**2 - z * z * vii,
    )
    root = b * b - a * c
    low, high = math.nan, math.nan
    if a > 0.0 and root >= 0.0:
        low, high = (-b - math.sqrt(root)) / a, (-b + math.sqrt(root)) / a
    elif not math.isnan(a):
        low, high = -math.inf, math.inf  # the slope may be 0: the PSE is not bounded by the data
    return Estimate("pse", curve.pse, low, high), found[0], found[1]


def _bias_corrected(value: float, drawn: list[float], unit: float) -> tuple[float, float]:
    """Return bias-corrected percentiles (Efron 1981); infinite where too many draws are. `unit` sets what is alike.

    Curves fitted to few trials are too steep, and bootstrapped ones more so.
    """
    from scipy.special import ndtr, ndtri

    kept = np.array([one for one in drawn if not math.isnan(one)])
    if len(kept) < _LEAST_DRAWS:
        return math.nan, math.nan
    alike = np.isclose(kept, value, rtol=1e-6, atol=1e-6 * unit)  # rounding would count these as below or not
    share = np.mean(np.where(alike, 0.5, kept < value))
    below = float(np.clip(share, 0.5 / len(kept), 1.0 - 0.5 / len(kept)))
    low, high = (100.0 * float(ndtr(2.0 * ndtri(below) + z)) for z in (-Z_95, Z_95))
    return float(np.percentile(kept, low, method="lower")), float(np.percentile(kept, high, method="higher"))


def _percentiles(drawn: list[float]) -> tuple[float, float]:
    """Return plain percentiles, for a rate: where it is 0, no draw is below it, and its bias cannot be known."""
    if len(drawn) < _LEAST_DRAWS:
        return math.nan, math.nan
    low, high = np.percentile(drawn, (2.5, 97.5))
    return float(low), float(high)


_MOST_ROUNDS, _SETTLED = 100, 1e-8
"""Rounds of scoring, and the change of the deviance that ends them, as in the GLM of statsmodels and R."""


def _probits(levels: Floats, counts: Floats, totals: Floats) -> list[Curve]:
    """Return the curve of the highest likelihood for each row of `counts` [row, level], with its covariance.

    Fisher's scoring (McCullagh and Nelder, Generalized Linear Models, 2nd ed., 2.5): each round is a line through the
    answers as normal deviates, weighted by what a level says there. All rows take hardly longer than one.
    """
    from scipy.special import ndtr, ndtri, xlogy

    used = totals > 0
    x, of = levels[used], totals[used]
    shares = counts[:, used] / of
    least = float(np.finfo(np.float64).eps)
    chance = 0.5 * (shares + 0.5)
    heights, deviance = ndtri(chance), np.full(len(shares), math.inf)
    lines, climbing = np.ones((5, len(shares))), np.full(len(shares), fill_value=True)
    with np.errstate(all="ignore"):  # where a step fits all: no level says anything about the slope in the end
        for _ in range(_MOST_ROUNDS):
            chance = np.clip(chance, least, 1.0 - least)
            misfit = xlogy(shares, shares / chance) + xlogy(1.0 - shares, (1.0 - shares) / (1.0 - chance))
            before, deviance = deviance, 2.0 * (misfit * of).sum(axis=1)
            climbing &= np.abs(deviance - before) > _SETTLED
            rise = bell(ndtri(chance))
            weights = of * rise**2 / (chance * (1.0 - chance))
            aims = heights + (shares - chance) / rise
            weight = weights.sum(axis=1)
            middle = (weights * x).sum(axis=1) / weight  # sums, which do not depend on the other rows as @ does
            around = x - middle[:, None]
            spread = (weights * around**2).sum(axis=1)
            slope = (weights * around * aims).sum(axis=1) / spread
            found = np.array([slope, (weights * aims).sum(axis=1) / weight, middle, spread, weight])
            climbing &= np.isfinite(found).all(axis=0)
            if not climbing.any():
                break
            lines[:, climbing] = found[:, climbing]
            heights = lines[1][:, None] + lines[0][:, None] * (x - lines[2][:, None])
            chance = ndtr(heights)
    return [
        Curve(
            height - slope * middle,
            slope,
            covariance=((1.0 / weight + middle**2 / spread, -middle / spread), (-middle / spread, 1.0 / spread)),
        )
        for slope, height, middle, spread, weight in lines.T.tolist()
    ]


_STARTS = ((1.0, 0.01), (4.0, 0.05), (16.0, 0.02))
"""Where the likelihood is climbed from: factor on the steepness of the curve without lapses, and lapse rate. From the
first alone, one of fifteen curves is left on a lower top.
"""


def _fits(levels: Floats, counts: Floats, totals: Floats, *, with_lapses: bool, guessed: Guessed) -> list[Curve]:
    """Return the curve of the highest likelihood for each row of `counts` [row, level], whose last column is of nothing
    where the share of guesses is estimated. All rows take hardly longer than one.
    """
    if not (with_lapses or guessed):
        return _probits(levels, counts, totals)
    is_estimated = isinstance(guessed, tuple)
    used = totals[: len(levels)] > 0
    counts, totals = (one[..., np.append(used, is_estimated)[: len(totals)]] for one in (counts, totals))
    n, middle, width = int(used.sum()), float(levels[used].mean()), float(levels[used].std())
    x = (levels[used] - middle) / width
    share = (counts[:, n] + 0.5) / (totals[n] + 1.0) if is_estimated else np.full(len(counts), guessed)
    share = np.minimum(share, _MOST_GUESSED)[:, None]
    felt = np.clip((counts[:, :n] / totals[:n] - share) / (1.0 - share), 0.05, 0.95)
    lines = np.array([(one.intercept, one.slope) for one in _probits(x, felt * totals[:n], totals[:n])])
    most = MOST_LAPSES if with_lapses else 0.0
    starts = [np.column_stack([k * lines, np.full(len(lines), min(lapse, most)), share]) for k, lapse in _STARTS]
    shares = (0.0, _MOST_GUESSED) if isinstance(guessed, tuple) else (guessed, guessed)
    bounds = [(-20.0, 20.0), (-50.0, 50.0), (0.0, most), shares]
    climb = Climb(x, np.tile(counts, (len(starts), 1)), totals, bounds, is_symmetric=not guessed)
    tops, losses = climb.tops(np.concatenate(starts))
    best = losses.reshape(len(starts), -1).argmin(axis=0) * len(counts) + np.arange(len(counts))
    covariances = np.full((len(best), 2, 2), math.nan) if with_lapses else climb.covariances(tops[best])
    shift = np.array([[1.0, -middle / width], [0.0, 1.0 / width]])
    both = zip(tops[best].tolist(), (shift @ covariances @ shift.T).tolist(), strict=True)
    return [
        Curve(a - b * middle / width, b / width, lapse, ((vii, vis), (vis, vss)), guessed=low if guessed else None)
        for (a, b, lapse, low), ((vii, vis), (_, vss)) in both
    ]


def _turn_of_guesses(curve: Curve, x: ArrayLike, yes: ArrayLike, of: ArrayLike) -> Estimate | None:
    """Return the PSE of a curve that rises between two levels, or at one; None if there is a slope.

    Its interval ends at levels whose answers alone are of less, or more, than the share at the PSE.
    """
    from scipy.special import bdtr, bdtrc

    levels, counts, totals = np.asarray(x, np.float64), np.asarray(yes, np.float64), np.asarray(of, np.int64)
    share = curve.guessed or 0.0
    felt = (curve.at(levels) - share) / (1.0 - share)
    on_flank = (felt > _FLAT) & (felt < 1.0 - _FLAT)
    if on_flank.sum() > 1:
        return None
    way = math.copysign(1.0, curve.slope)
    below, above = way * levels[felt <= _FLAT], way * levels[felt >= 1.0 - _FLAT]
    if on_flank.any():
        value = float(levels[on_flank][0])
    elif below.size and above.size:
        value = way * 0.5 * float(below.max() + above.min())
    else:  # all is as by guessing
        return Estimate("pse", math.nan, -math.inf, math.inf)
    middle = 0.5 * (1.0 + share)
    less = way * levels[bdtr(counts, totals, middle) < 0.025]
    more = way * levels[bdtrc(counts - 1.0, totals, middle) < 0.025]
    ends = (float(less.max()) if less.size else -math.inf, float(more.min()) if more.size else math.inf)
    low, high = sorted(way * end for end in ends)
    return Estimate("pse", value, low, high)


_FLAT = 1e-3
"""A level of which less is felt, or not felt, says nothing of the slope."""
