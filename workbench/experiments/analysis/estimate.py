"""Estimates with intervals, of means and shares."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from underfoot.errors import require

Z_95 = NormalDist().inv_cdf(0.975)
"""Standard normal deviate with 2.5 % of the distribution above it: half a 95 % interval."""


@dataclass(frozen=True)
class Estimate:
    """A value of `name`, in `unit`, with the ends of its 95 % interval; NaN if missing."""

    name: str
    value: float
    low: float = math.nan
    high: float = math.nan
    unit: str = ""

    def covers(self, truth: float) -> bool:
        """Return whether the interval contains the value `truth`."""
        return self.low <= truth <= self.high


def mean_interval(name: str, values: Sequence[float], unit: str = "") -> Estimate:
    """Return the mean of values with Student's 95 % interval; no interval for fewer than two.

    >>> found = mean_interval("x", [1.0, 2.0, 3.0])
    >>> found.value, round(found.low, 3)
    (2.0, -0.484)
    """
    kept = [float(value) for value in values if math.isfinite(value)]
    if not kept:
        return Estimate(name, math.nan, unit=unit)
    mean = sum(kept) / len(kept)
    if len(kept) < 2:
        return Estimate(name, mean, unit=unit)
    return student_interval(name, mean, float(np.std(kept, ddof=1) / np.sqrt(len(kept))), len(kept) - 1, unit)


def student_interval(name: str, value: float, error: float, free: int, unit: str = "") -> Estimate:
    """Return a value with Student's 95 % interval of its standard error, which has `free` degrees of freedom; no
    interval for none.
    """
    half = error * _student(free) if free > 0 else math.nan
    return Estimate(name, value, value - half, value + half, unit)


def sd_interval(name: str, value: float, free: int, unit: str = "") -> Estimate:
    """Return a standard deviation with its 95 % interval by chi squared, of `free` degrees of freedom; none for none.

    >>> found = sd_interval("x", 1.0, 9)
    >>> round(found.low, 3), round(found.high, 3)
    (0.688, 1.826)
    """
    from scipy.special import chdtri  # as for Student's

    low, high = (math.sqrt(free / chdtri(free, beyond)) if free > 0 else math.nan for beyond in (0.025, 0.975))
    return Estimate(name, value, value * low, value * high, unit)


def mixed_share_interval(name: str, shares: Sequence[tuple[int, int]]) -> Estimate:
    """Return the mean of a share over parts with shares of their own, each (count, of). It varies less than Wilson's
    interval assumes, so the parts' Wilson intervals are combined (Zou and Donner, Statistics in Medicine 27, 2008).

    >>> one = mixed_share_interval("x", [(30, 40)])
    >>> whole, parts = share_interval("x", 30, 40), mixed_share_interval("x", [(20, 20), (10, 20)])
    >>> round(one.low - whole.low, 9), parts.value, parts.low > whole.low
    (0.0, 0.75, True)
    """
    total = sum(of for _, of in shares)
    parts = [(of / total, share_interval("", count, of)) for count, of in shares if of]
    value = sum(weight * one.value for weight, one in parts)
    below, above = (math.hypot(*(w * (getattr(one, end) - one.value) for w, one in parts)) for end in ("low", "high"))
    return Estimate(name, value, value - below, value + above) if parts else Estimate(name, math.nan)


def share_interval(name: str, count: int, of: int) -> Estimate:
    """Return a share with Wilson's 95 % interval.

    >>> found = share_interval("x", 8, 10)
    >>> found.value, round(found.low, 4), round(found.high, 4)
    (0.8, 0.4902, 0.9433)
    """
    require(0 <= count <= of, "count", count, f"0 to of, {of}")
    if of == 0:
        return Estimate(name, math.nan)
    return Estimate(name, count / of, *_wilson(count / of, of, Z_95))


PEOPLE_NOTE = "Over people: means of their shares, with Wilson's interval of as many answers as vary like these people."


def people_share_interval(name: str, shares: Iterable[tuple[int, int]]) -> Estimate:
    """Return the mean of people's shares, each (count, of), with a 95 % interval for all people; of one, Wilson's.

    People differ, so all answers together say less than as many independent ones. It is Wilson's interval of so many
    answers as would vary like the mean of these people, at most those that there are, with Student's quantile (Korn
    and Graubard, Survey Methodology 24, 1998; Dean and Pagano, J. Surv. Stat. Methodol. 3, 2015). It stays within 0
    and 1, as Student's does not.

    >>> alike, differ = (people_share_interval("x", of) for of in ([(5, 10)] * 8, [(1, 10), (9, 10)] * 4))
    >>> alike.value, differ.value, round(alike.low, 2), round(differ.low, 2)
    (0.5, 0.5, 0.37, 0.21)
    """
    of_people = [(count, of) for count, of in shares if of]
    if len(of_people) < 2:
        return share_interval(name, *(of_people or [(0, 0)])[0])
    each = [count / of for count, of in of_people]
    value, most = sum(each) / len(each), sum(of for _, of in of_people)
    variance = float(np.var(each, ddof=1)) / len(each)
    of = min(value * (1.0 - value) / variance, most) if variance > 0.0 else most
    return Estimate(name, value, *_wilson(value, of, _student(len(each) - 1)))


def _student(free: int) -> float:
    """Return the 97.5 % quantile of Student's distribution."""
    from scipy.special import stdtrit  # scipy.stats takes half a second to load, in each process that simulates people

    return float(stdtrit(free, 0.975))


def _wilson(share: float, of: float, z: float) -> tuple[float, float]:
    """Return the ends of Wilson's interval of a share of so many answers, `z` standard errors around it."""
    z2 = z * z
    middle = share + z2 / (2.0 * of)
    half = z * math.sqrt(share * (1.0 - share) / of + z2 / (4.0 * of * of))
    low = (middle - half) / (1.0 + z2 / of) if share > 0.0 else 0.0
    high = (middle + half) / (1.0 + z2 / of) if share < 1.0 else 1.0
    return low, high
