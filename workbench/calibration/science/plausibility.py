"""Forces beside readings that cannot be what pressed: other units, a weight mistyped, an order mixed up.

Readings contradict them: a sensor that feels more never reads less, but for hysteresis and creep, which have bounds.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.pairs import STILL, direction_of, directions, is_timed, rank_correlation, smoothed
from underfoot.errors import BadValue

Values = NDArray[np.float64]

_FORCES_N = (0.5, 20000.0)
"""Largest reference forces that a floor's sensor may be given."""
_STEP, _OTHER_WAY = 0.09, 0.05
"""A step of the load, in parts of the largest, after which the reading may not go the other way, in parts
of its range."""
_FURTHER, _APART = 0.15, 1.5
"""As `_STEP`, and times the lesser load, for loads with others between them: hysteresis and creep are less."""
_MOST_WRONG = 0.25
"""More contradictions than come from this share of the loads are no slips of a pen, but a loose sensor."""
_LEAP, _TENTH, _NEAR = 4.0, 0.1, 1.5
"""A largest force this many times the next one is mistyped where its reading is near that of a tenth of it."""
_SPIKE = 0.3
_ALIKE = 6.0
"""Sensors of one tile take the same force for the same reading within this factor; parts differ by 25 %."""
_WEAK = 0.2


def require_right(sensors: list[tuple[Values, Values, Values]]) -> None:
    """Refuse forces that cannot be what pressed, by what the readings say; (time, reading, force) of each sensor.

    `BadValue` for forces of another unit or sign, weights out of order, one that is mistyped, and a sensor whose forces
    are of another unit than the others'.
    """
    full = max((float(force.max(initial=0.0)) for _, _, force in sensors), default=0.0)
    for j, (_, _, force) in enumerate(sensors):
        if force.size and np.quantile(force, 0.01) < -0.1 * max(full, float(np.abs(force).max())):
            raise BadValue(
                f"sensor {j + 1}: force_n goes down to {force.min():.4g} N; tare the load cell, and count a force that "
                "presses as positive"
            )
    if not _FORCES_N[0] <= full <= _FORCES_N[1]:
        low, high = _FORCES_N
        raise BadValue(f"the largest force_n is {full:.4g} N; allowed: {low:g} to {high:g} N; is it in newtons?")
    for j, (time_s, reading, force) in enumerate(sensors):
        if np.unique(force).size >= 3:
            order = np.argsort(time_s, kind="stable")
            trouble = _mistaken(time_s[order], reading[order], force[order])
            if trouble:
                raise BadValue(f"sensor {j + 1}: {trouble}")
    _require_alike([(reading, force) for _, reading, force in sensors])


def _mistaken(time_s: Values, reading: Values, force_n: Values) -> str:
    """What one sensor's readings, in order of time, hold against its forces."""
    x = direction_of(reading, force_n) * reading
    x = x - x.min()
    timed = is_timed(time_s)
    return (_spike(time_s, x, force_n) if timed else "") or _leap(x, force_n) or _disordered(time_s, x, force_n, timed)


def _spike(time_s: Values, x: Values, force_n: Values) -> str:
    """A single force far from those before and after it, to which the reading does not answer."""
    from scipy.ndimage import median_filter

    usual = median_filter(force_n, 5)
    full, moved = float(usual.max()), float(np.ptp(x))
    out = (np.abs(force_n - usual) > _SPIKE * full) & (np.abs(x - median_filter(x, 5)) < 0.1 * moved)
    out &= ~(np.roll(out, 1) | np.roll(out, -1))
    if not out.any() or np.count_nonzero(out) > 0.01 * out.size:
        return ""
    at = int(np.argmax(out))
    return (
        f"force_n is {force_n[at]:.4g} N at {time_s[at]:.6g} s, between {usual[at]:.4g} N, and the reading shows no "
        "such jump; correct that line or leave it out"
    )


def _leap(x: Values, force_n: Values) -> str:
    """A largest force far above all others, where the others lie close and the reading is that of a lesser one."""
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
                f"force_n is {above:.4g} N after {below:.4g} N and less, but its reading is that of a far lesser one; "
                f"was {meant:.4g} N meant?"
            )
    return ""


def _disordered(time_s: Values, x: Values, force_n: Values, timed: bool) -> str:
    """Loads at rest of which readings tell another order."""
    runs = _resting(time_s, force_n) if timed else [slice(k, k + 1) for k in range(force_n.size)]
    f, seen = (np.array([values[run].mean() for run in runs]) for values in (force_n, x))
    if not 3 <= f.size <= 400:
        return ""
    rises, answers = f[:, None] - f, seen[:, None] - seen
    lesser = np.minimum(f[:, None], f)
    full, moved = float(force_n.max()), float(np.ptp(x))
    next_to = np.abs(np.arange(f.size)[:, None] - np.arange(f.size)) == 1
    clear = np.abs(rises) > np.where(next_to, _STEP * full, (_APART - 1.0) * lesser + _FURTHER * full)
    against = clear & (np.abs(answers) > _OTHER_WAY * moved) & (rises * answers < 0.0)
    if not against.any():
        return ""
    first, second = sorted(np.unravel_index(int(np.argmax(np.abs(rises) * against)), against.shape))
    wrong, left = 0, against.copy()
    while left.any():
        worst = int(np.argmax(left.sum(axis=0)))
        left[worst], left[:, worst] = False, False
        wrong += 1
    if wrong > max(2.0, _MOST_WRONG * f.size):
        return ""
    one, two = (f"{f[k]:.4g} N at {time_s[runs[k].start]:.6g} s" for k in (first, second))
    return f"force_n is {one} and {two}, but the readings say the opposite; weights out of order, or one mistyped?"


def _resting(time_s: Values, force_n: Values) -> list[slice]:
    """Where a load rests, in parts of what was usual: a force ten times too large makes no others small."""
    usual = max(float(np.quantile(force_n, 0.75)), 1e-9)
    still = directions(smoothed(force_n, time_s), time_s, usual) == STILL
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    return [slice(int(a), int(b)) for a, b in list(pairwise(edges.tolist()))[::2] if np.ptp(force_n[a:b]) < 0.1 * usual]


def _require_alike(sensors: list[tuple[Values, Values]]) -> None:
    """Refuse a sensor whose forces are of another unit than those of the others, at the same distance from rest."""
    told: dict[int, tuple[Values, Values]] = {}
    for j, (reading, force) in enumerate(sensors):
        if force.size >= 4 and abs(rank_correlation(reading, force)) >= 0.5:
            x = direction_of(reading, force) * reading
            order = np.argsort(x, kind="stable")
            told[j] = (x[order] - x.min(), force[order])
    tops = {j: float(x[-1]) for j, (x, _) in told.items()}
    # A sensor that hardly answers is a weak one, whatever the unit.
    told = {j: pair for j, pair in told.items() if tops[j] >= _WEAK * float(np.median(list(tops.values())))}
    if len(told) < 2:
        return
    common = 0.7 * min(float(x[-1]) for x, _ in told.values())
    at = {}
    for j, (x, force) in told.items():
        near = (x > 0.8 * common) & (x < 1.2 * common)
        at[j] = float(np.median(force[near])) if near.any() else float(np.interp(common, x, force))
    for j, mine in at.items():
        others = float(np.median([force for k, force in at.items() if k != j]))
        if mine > 0.0 and others > 0.0 and not 1.0 / _ALIKE < mine / others < _ALIKE:
            raise BadValue(
                f"sensor {j + 1}: force_n is {mine / others:.3g} times that of the others for the same reading; "
                "another unit? If the sensor is really so different, leave its lines out"
            )
