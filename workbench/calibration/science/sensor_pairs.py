"""Preparation of one sensor's pairs for the fit: sorted by time, zeroed at rest, split into loadings, weighted."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.measurements import LARGEST_READING
from underfoot.kernels import Floats

RISING, FALLING, HELD, UNKNOWN = 0, 1, 2, 3
"""Direction of the load at a sample."""
BINS = 48
"""Equal bins of force, from 0 to full scale."""
_SMOOTH_S = 0.05
HELD_S, _HELD_SHARE = 0.5, 0.05
"""Time for which, and share of full scale within which, a load must stay to be held; a hand is no better."""
_HELD_WEIGHT = 0.3
"""Weight of a sample of a held load: a recording dwells on it, and it creeps."""
_FOLDS = 6
UNLOADED = 0.005
"""Share of full scale up to which a sensor counts as unloaded."""
_RANGE = 50.0
"""Smallest range of a reading, in its smallest steps, that resolves forces."""
_SATURATED_SLOPE = 0.05
"""Slope of reading over force, relative to its usual slope, below which a reading is saturated."""


@dataclass(frozen=True)
class SensorPairs:
    """Pairs of one sensor, all (n,), in order of time.

    `x` is the reading's distance from `rest`, positive when pressed (`sign` is -1 if readings fall). `direction` is
    RISING, FALLING, HELD or UNKNOWN. `usable` excludes saturated samples; `weight` makes all forces count alike,
    however long the load stayed at them; `fold` is the cross-validation fold of a sample's loading. `timed` says
    whether times can be trusted, `cycles` is the number of loadings, `rested` whether the empty tile was read, and
    `saturates_n` the force above which the reading is saturated, infinite if it is not.
    """

    time_s: Floats
    x: Floats
    force_n: Floats
    weight: Floats
    direction: NDArray[np.intp]
    fold: NDArray[np.intp]
    usable: NDArray[np.bool_]
    sign: float
    rest: float
    full_scale_n: float
    timed: bool
    cycles: int
    rested: bool
    saturates_n: float

    @property
    def period_s(self) -> float:
        """Median time between two samples."""
        return float(np.median(np.diff(self.time_s)))

    @property
    def has_directions(self) -> bool:
        """Whether rising, falling and held loads can be told apart: samples that are too seldom all look held."""
        return not self.timed or self.period_s < HELD_S

    def reading(self, x: Floats) -> Floats:
        """Return readings at distances from rest."""
        return self.rest + self.sign * x


def prepare(time_s: Floats, reading: Floats, force_n: Floats, full_scale_n: float) -> SensorPairs | str:
    """Prepare a sensor's pairs, or return why they are unusable. `full_scale_n` is that of all sensors together."""
    problem = _insufficient(reading, force_n, full_scale_n)
    if problem:
        return problem
    order = np.argsort(time_s, kind="stable")
    time_s, reading, force_n = time_s[order], reading[order], force_n[order]
    timed = is_timed(time_s)
    own_full = float(force_n.max())
    unloaded = np.abs(force_n) <= UNLOADED * full_scale_n
    sign = direction_of(reading, force_n)
    rested = bool(np.count_nonzero(unloaded))
    rest = _rest(reading, force_n, unloaded, full_scale_n) if rested else _extrapolated_rest(reading, force_n, sign)
    x = sign * (reading - rest)
    problem = _unresponsive(x, force_n, rest, unloaded, full_scale_n)
    if problem:
        return problem
    smooth = smoothed(force_n, time_s) if timed else force_n
    direction = directions(smooth, time_s, full_scale_n) if timed else _weight_directions(force_n)
    usable, saturates_n = _unsaturated(x, reading, force_n, direction, full_scale_n)
    if saturates_n < 0.3 * full_scale_n:
        return f"its reading is saturated above {saturates_n:.3g} N, of {full_scale_n:.4g} N"
    fold, cycles = _folds(smooth, own_full, timed)
    return SensorPairs(
        time_s, x, force_n, _weights(force_n, direction, own_full), direction, fold, usable,
        sign, rest, full_scale_n, timed, cycles, rested, saturates_n,
    )  # fmt: skip


def force_bin(force_n: Floats, full_scale_n: float) -> NDArray[np.intp]:
    """Return the bin of force of each sample, of `BINS`."""
    return np.clip((force_n / full_scale_n * BINS).astype(np.intp), 0, BINS - 1)


def is_timed(time_s: Floats) -> bool:
    """Return whether times, in order, are those of a recording, and not of weights put on one by one."""
    return bool(time_s.size >= 100 and np.count_nonzero(np.diff(time_s) > 0.0) > 0.5 * time_s.size)


def direction_of(reading: Floats, force_n: Floats) -> float:
    """Return 1 if readings rise with force, -1 if they fall."""
    return -1.0 if rank_correlation(reading, force_n) < 0.0 else 1.0


def _insufficient(reading: Floats, force_n: Floats, full_scale_n: float) -> str:
    """Return why these pairs are too few, or too similar; "" if they are not."""
    if reading.size == 0:
        return "it has no pairs"
    distinct = len(set(zip(reading.tolist(), force_n.tolist(), strict=True)))  # NumPy would sort the pairs
    if distinct < 4:
        return f"it has only {distinct} different pairs; at least 4 are needed"
    if np.unique(force_n).size < 3:
        return "it was loaded with one force only; the empty tile and at least 2 forces are needed"
    if np.ptp(force_n) < 0.1 * full_scale_n:
        return f"its forces span only {np.ptp(force_n):.3g} N of {full_scale_n:.4g} N"
    return ""


def _unresponsive(x: Floats, force_n: Floats, rest: float, unloaded: NDArray[np.bool_], full_scale_n: float) -> str:
    """Return why the reading does not follow the force; "" if it does."""
    change = float(np.quantile(x[force_n >= 0.5 * force_n.max()], 0.9))
    # Before the first load: the after-effects of loads are not noise.
    quiet = x[unloaded & _before_loads(force_n, full_scale_n)]
    # By the median: where the reference lags, the first load begins in here.
    noise = 1.48 * float(np.median(np.abs(quiet - np.median(quiet)))) if quiet.size > 10 else 0.0
    step = _finest(x)
    seen = _without_waiting(unloaded)
    follows = rank_correlation(x[seen], force_n[seen]) >= 0.5
    if change <= max(8.0 * noise, 20.0 * step) and (follows or np.ptp(np.quantile(x, (0.01, 0.99))) < 200.0 * step):
        return f"it is dead: its reading stays within {max(change, 0.0):.3g} counts of {rest:.5g} under load"
    if not follows:
        return "its reading does not follow the force: loose, weights out of order, or another sensor was loaded"
    if change < _RANGE * step:
        return f"its range is too small: its reading changes by {change:.3g}, {change / step:.0f} of its smallest steps"
    return ""


def _without_waiting(unloaded: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the loaded samples, and at most as many unloaded ones: the noise of an empty tile has no order."""
    empty, loaded = np.flatnonzero(unloaded), np.flatnonzero(~unloaded)
    return np.sort(np.concatenate([empty[:: max(1, -(-empty.size // max(loaded.size, 1)))], loaded]))


def _finest(x: Floats) -> float:
    """Return the smallest step of a reading, at most one count; less for one in volts."""
    steps = np.diff(np.unique(x))
    return min(float(steps.min(initial=1.0)), 1.0)


def _before_loads(force_n: Floats, full_scale_n: float) -> NDArray[np.bool_]:
    first = int(np.argmax(force_n > 0.05 * full_scale_n))
    return np.asarray(np.arange(force_n.size) < first)


def rank_correlation(a: Floats, b: Floats) -> float:
    """Return Spearman's rank correlation of two series (n,); 0 if one is constant.

    >>> round(rank_correlation(np.array([1.0, 2.0, 2.0, 4.0]), np.array([1.0, 2.0, 3.0, 3.0])), 6)
    0.833333
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        return float(np.nan_to_num(np.corrcoef(_ranks(a), _ranks(b))[0, 1]))


def _ranks(values: Floats) -> Floats:
    """Return ranks, of equal values their mean: those of scipy.stats, which takes half a second to load."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * (counts - 1))[places])


def _rest(reading: Floats, force_n: Floats, unloaded: NDArray[np.bool_], full_scale_n: float) -> float:
    """Return the unloaded reading before the first load: afterwards hysteresis and creep remain."""
    before = unloaded & _before_loads(force_n, full_scale_n)
    return float(np.median(reading[before if np.count_nonzero(before) >= 5 else unloaded]))


def _extrapolated_rest(reading: Floats, force_n: Floats, sign: float) -> float:
    """Return the reading at 0 N, along the lowest tenth of the forces, limited to the converter's range."""
    order = np.argsort(force_n, kind="stable")[: max(3, force_n.size // 10)]
    if np.ptp(force_n[order]) == 0.0:
        return float(np.median(reading[order]))
    slope, at_zero = np.polyfit(force_n[order], reading[order], 1)
    if sign * slope < 0.0:
        at_zero = float(np.median(reading[order]))
    lowest = float((sign * reading).min()) * sign
    return float(np.clip(sign * min(sign * at_zero, sign * lowest), 0.0, LARGEST_READING))


def _unsaturated(
    x: Floats, reading: Floats, force_n: Floats, direction: NDArray[np.intp], full_scale_n: float
) -> tuple[NDArray[np.bool_], float]:
    """Return the samples that are not saturated, and the least saturating force (infinite if there is none).

    A reading saturates at the end of the converter's range, or where it stays constant under a rising load. Falling
    loads do not count: there hysteresis holds the reading, too.
    """
    top = float(x.max())
    noise = float(np.std(np.diff(x[x > 0.98 * top]))) if np.count_nonzero(x > 0.98 * top) > 20 else 0.0
    at_top = x >= top - max(0.5 * _finest(x), 4.0 * noise)
    at_end = at_top & ((reading <= 0.0) | (reading >= LARGEST_READING))
    for there, least in ((at_end, 0.02), (at_top & (direction != FALLING), 0.05)):
        forces = force_n[there]
        if forces.size < 3 or np.ptp(forces) <= least * full_scale_n:
            continue
        from_n = float(np.quantile(forces, 0.02))
        if there is at_end or _is_flat(x, force_n, (force_n >= from_n) & (direction != FALLING)):
            return ~at_top, from_n
    return np.ones(x.size, dtype=bool), np.inf


def _is_flat(x: Floats, force_n: Floats, above: NDArray[np.bool_]) -> bool:
    """Return whether the reading no longer rises with force over the samples `above`; noise alone can reach the top."""
    rise = float(np.polyfit(force_n[above], x[above], 1)[0])
    return rise < _SATURATED_SLOPE * float(x.max()) / float(force_n.max())


def smoothed(force_n: Floats, time_s: Floats) -> Floats:
    """Return a running mean of forces (n,) over 50 ms."""
    steps = np.diff(time_s)
    count = max(1, int(round(_SMOOTH_S / float(np.median(steps[steps > 0.0])))))
    padded = np.concatenate([np.full(count, force_n[0]), force_n, np.full(count, force_n[-1])])
    return np.convolve(padded, np.ones(count) / count, "same")[count:-count]


def directions(smooth: Floats, time_s: Floats, full_scale_n: float) -> NDArray[np.intp]:
    """Return RISING, FALLING or HELD at each sample (n,), from smoothed forces and their times."""
    from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

    steps = np.diff(time_s)
    count = max(3, int(round(HELD_S / float(np.median(steps[steps > 0.0])))))
    extent = maximum_filter1d(smooth, count) - minimum_filter1d(smooth, count)
    # Repeated times give meaningless slopes; the median over neighbours removes them.
    speed = median_filter(np.gradient(smooth, time_s + 1e-9 * np.arange(time_s.size)), size=5)
    held = extent < _HELD_SHARE * full_scale_n
    return np.where(held, HELD, np.where(speed > 0.0, RISING, FALLING)).astype(np.intp)


def _weight_directions(force_n: Floats) -> NDArray[np.intp]:
    """Return directions of weights put on one by one: RISING or FALLING; UNKNOWN if they are in random order."""
    steps = np.diff(force_n, prepend=force_n[0])
    steps = steps[np.maximum.accumulate(np.where(steps != 0.0, np.arange(steps.size), 0))]
    turns = np.count_nonzero(np.diff(np.sign(steps)))
    if turns > 0.4 * force_n.size:
        return np.full(force_n.size, UNKNOWN)
    return np.where(steps >= 0.0, RISING, FALLING).astype(np.intp)


def _folds(smooth: Floats, own_full: float, timed: bool) -> tuple[NDArray[np.intp], int]:
    """Return cross-validation folds, and the number of loadings.

    A fold holds whole loadings if there are three or more, else stretches of time, else every n-th force.
    """
    high, low = smooth > 0.5 * own_full, smooth < 0.2 * own_full
    state = np.where(high, 1, np.where(low, -1, 0))
    known = np.maximum.accumulate(np.where(state != 0, np.arange(state.size), 0))
    is_high = state[known] == 1
    ends = np.flatnonzero(is_high[:-1] & ~is_high[1:]) + 1
    starts = np.flatnonzero(~is_high[:-1] & is_high[1:]) + 1
    cycles = max(len(ends), len(starts)) if timed else 0
    if timed and len(starts) >= 3:
        cuts = []
        for end in ends:
            following = starts[starts > end]
            if following.size:
                cuts.append(int(end + np.argmin(smooth[end : following[0]])))
        number = np.searchsorted(np.array(cuts), np.arange(smooth.size), side="right")
        return np.asarray(number % _FOLDS, dtype=np.intp), cycles
    if timed:
        stretches = np.arange(smooth.size) * (2 * _FOLDS) // smooth.size
        return np.asarray(stretches % _FOLDS, dtype=np.intp), cycles
    _, group = np.unique(smooth, return_inverse=True)
    return np.asarray(group % min(_FOLDS, group.max() + 1), dtype=np.intp), cycles


def _weights(force_n: Floats, direction: NDArray[np.intp], own_full: float) -> Floats:
    cell = force_bin(force_n, own_full) + BINS * direction
    count = np.bincount(cell, minlength=4 * BINS)[cell]
    return np.asarray(np.where(direction == HELD, _HELD_WEIGHT, 1.0) / count)
