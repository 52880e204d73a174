"""Plausibility of reference forces: another unit, a mistyped weight, or a wrong order is refused.

The check uses the readings: a sensor under a larger force never reads less, apart from hysteresis and creep, which are
bounded.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.sensor_pairs import (
    HELD,
    direction_of,
    directions,
    is_timed,
    rank_correlation,
    smoothed,
)
from underfoot.errors import BadValue
from underfoot.kernels import Floats

_FORCES_N = (0.5, 20000.0)
"""Smallest and largest full scale of a floor's sensor."""
_STEP, _OPPOSITE = 0.09, 0.05
"""After a load step of the first share of the largest force, the reading may not change in the opposite direction by
the second share of its range."""
_APART_SHARE, _APART_FACTOR = 0.15, 1.5
"""Same for two loads with others between them: they differ by this share, and by this factor of the smaller one."""
_MOST_WRONG = 0.25
"""Share of contradicting loads above which the cause is not typing errors but a loose sensor."""
_LEAP, _TENTH, _NEAR = 4.0, 0.1, 1.5
"""Factor by which a mistyped largest force exceeds the next one, while its reading is near that of a tenth of it."""
_SPIKE = 0.3
"""Share of the largest force by which an outlier differs from its neighbours."""
_ALIKE = 6.0
"""Largest factor between forces of a tile's sensors at the same reading; parts differ by 25 %."""
_WEAK = 0.2
"""Share of the usual change of reading below which a sensor is not compared with the others."""


def require_plausible(sensors: list[tuple[Floats, Floats, Floats]]) -> None:
    """Raise `BadValue` for reference forces that contradict the readings; `sensors` are (time, reading, force) of each.

    Detects forces in another unit or of another sign, weights out of order, a mistyped weight, and a sensor whose
    forces are in another unit than the others'.
    """
    full = max((float(force.max(initial=0.0)) for _, _, force in sensors), default=0.0)
    for j, (_, _, force) in enumerate(sensors):
        if force.size and np.quantile(force, 0.01) < -0.1 * max(full, float(np.abs(force).max())):
            raise BadValue(
                f"sensor {j + 1}: force_n goes down to {force.min():.4g} N; tare the load cell, and count compression "
                "as positive"
            )
    if not _FORCES_N[0] <= full <= _FORCES_N[1]:
        low, high = _FORCES_N
        raise BadValue(f"the largest force_n is {full:.4g} N; allowed: {low:g} to {high:g} N; is it in newtons?")
    for j, (time_s, reading, force) in enumerate(sensors):
        if np.unique(force).size >= 3:
            order = np.argsort(time_s, kind="stable")
            problem = _contradiction(time_s[order], reading[order], force[order])
            if problem:
                raise BadValue(f"sensor {j + 1}: {problem}")
    _require_one_unit([(reading, force) for _, reading, force in sensors])


def _contradiction(time_s: Floats, reading: Floats, force_n: Floats) -> str:
    """Return how a sensor's readings contradict its forces, all in order of time; "" if they do not."""
    x = direction_of(reading, force_n) * reading
    x = x - x.min()
    timed = is_timed(time_s)
    return (_outlier(time_s, x, force_n) if timed else "") or _leap(x, force_n) or _disorder(time_s, x, force_n, timed)


def _outlier(time_s: Floats, x: Floats, force_n: Floats) -> str:
    """Find a single force far from its neighbours, without a change of the reading."""
    usual, out = force_outliers(x, force_n)
    if not out.any() or np.count_nonzero(out) > 0.01 * out.size:
        return ""
    at = int(np.argmax(out))
    return (
        f"force_n is {force_n[at]:.4g} N at {time_s[at]:.6g} s, between {usual[at]:.4g} N, and the reading does not "
        "jump there; correct that line or leave it out"
    )


def force_outliers(x: Floats, force_n: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the usual force at each sample (n,), and whether its own is far from it without a change of the reading.

    `x` (n,) is the reading, from any zero; samples are in order of time.
    """
    from scipy.ndimage import median_filter

    usual = median_filter(force_n, 5)
    full, span = float(usual.max()), float(np.ptp(x))
    out = (np.abs(force_n - usual) > _SPIKE * full) & (np.abs(x - median_filter(x, 5)) < 0.1 * span)
    return usual, out & ~(np.roll(out, 1) | np.roll(out, -1))


def _leap(x: Floats, force_n: Floats) -> str:
    """Find a largest force far above the others, which are close together, with the reading of a smaller one."""
    levels = np.unique(force_n[force_n > 0.0])
    for k in np.flatnonzero(levels[1:] >= _LEAP * levels[:-1]):
        below, above = levels[k], levels[k + 1]
        near = levels[(levels <= below) & (levels >= 0.1 * below)]
        over = force_n >= above
        if near.size < 3 or (near[1:] > 3.0 * near[:-1]).any():
            continue
        meant = _TENTH * above
        others = np.argsort(force_n[~over], kind="stable")
        reads = np.interp(meant, force_n[~over][others], x[~over][others]) * max(meant / below, 1.0)
        if np.count_nonzero(over) <= _MOST_WRONG * force_n.size and x[over].max() < _NEAR * reads:
            return (
                f"force_n is {above:.4g} N after {below:.4g} N and less, but its reading is that of a much smaller "
                f"one; was {meant:.4g} N meant?"
            )
    return ""


def _disorder(time_s: Floats, x: Floats, force_n: Floats, timed: bool) -> str:
    """Find two held loads whose readings are in the opposite order."""
    runs = _held_loads(time_s, force_n) if timed else [slice(k, k + 1) for k in range(force_n.size)]
    f, seen = (np.array([values[run].mean() for run in runs]) for values in (force_n, x))
    if not 3 <= f.size <= 400:
        return ""
    rises, responses = f[:, None] - f, seen[:, None] - seen
    lesser = np.minimum(f[:, None], f)
    full, span = float(force_n.max()), float(np.ptp(x))
    next_to = np.abs(np.arange(f.size)[:, None] - np.arange(f.size)) == 1
    clear = np.abs(rises) > np.where(next_to, _STEP * full, (_APART_FACTOR - 1.0) * lesser + _APART_SHARE * full)
    contradictory = clear & (np.abs(responses) > _OPPOSITE * span) & (rises * responses < 0.0)
    if not contradictory.any():
        return ""
    first, second = sorted(np.unravel_index(int(np.argmax(np.abs(rises) * contradictory)), contradictory.shape))
    wrong, left = 0, contradictory.copy()
    while left.any():
        worst = int(np.argmax(left.sum(axis=0)))
        left[worst], left[:, worst] = False, False
        wrong += 1
    if wrong > max(2.0, _MOST_WRONG * f.size):
        return ""
    one, two = (f"{f[k]:.4g} N at {time_s[runs[k].start]:.6g} s" for k in (first, second))
    return (
        f"force_n is {one} and {two}, but their readings are in the opposite order; "
        "weights out of order, or one mistyped?"
    )


def _held_loads(time_s: Floats, force_n: Floats) -> list[slice]:
    """Return the ranges of constant load. Forces are relative to the usual one, so a tenfold outlier is ignored."""
    usual = max(float(np.quantile(force_n, 0.75)), 1e-9)
    held = directions(smoothed(force_n, time_s), time_s, usual) == HELD
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    return [slice(int(a), int(b)) for a, b in list(pairwise(edges.tolist()))[::2] if np.ptp(force_n[a:b]) < 0.1 * usual]


def _require_one_unit(sensors: list[tuple[Floats, Floats]]) -> None:
    """Refuse a sensor whose forces are in another unit than the others', at the same distance from rest."""
    known: dict[int, tuple[Floats, Floats]] = {}
    for j, (reading, force) in enumerate(sensors):
        follows = rank_correlation(reading, force) if force.size >= 4 else 0.0
        if abs(follows) >= 0.5:
            x = reading if follows > 0.0 else -reading
            order = np.argsort(x, kind="stable")
            known[j] = (x[order] - x.min(), force[order])
    tops = {j: float(x[-1]) for j, (x, _) in known.items()}
    # A sensor that hardly responds is weak, regardless of its unit.
    known = {j: pair for j, pair in known.items() if tops[j] >= _WEAK * float(np.median(list(tops.values())))}
    if len(known) < 2:
        return
    common = 0.7 * min(float(x[-1]) for x, _ in known.values())
    at = {}
    for j, (x, force) in known.items():
        near = (x > 0.8 * common) & (x < 1.2 * common)
        at[j] = float(np.median(force[near])) if near.any() else float(np.interp(common, x, force))
    for j, mine in at.items():
        others = float(np.median([force for k, force in at.items() if k != j]))
        if mine > 0.0 and others > 0.0 and not 1.0 / _ALIKE < mine / others < _ALIKE:
            raise BadValue(
                f"sensor {j + 1}: force_n is {mine / others:.3g} times that of the others for the same reading; "
                "another unit? If the sensor is really so different, leave its lines out"
            )
