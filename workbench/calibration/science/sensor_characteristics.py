"""Characteristics of a sensor besides its curve: hysteresis, creep, repeatability, noise, and spread of parts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.sensor_pairs import (
    BINS,
    FALLING,
    HELD,
    HELD_S,
    RISING,
    UNLOADED,
    SensorPairs,
    force_bin,
)
from underfoot.floor.curves import Curve
from underfoot.kernels import Floats
from underfoot.models.tile.fsr_curves import rising

_LEAST_HOLD_S = 1.5
"""Shortest hold of a load whose creep is drawn."""


@dataclass(frozen=True)
class SensorCharacteristics:
    """Characteristics of one sensor; NaN if its pairs do not show them. % are of full scale, except for creep.

    `error_percent` is the RMS error on held-out loadings, all forces weighted alike; `bound_percent` the smallest error
    of any rising curve on the same data; `memory_error_percent` as `error_percent`, with hysteresis and creep
    compensated. `hysteresis_percent` is the widest gap between falling and rising loads, `creep_percent_decade` the
    growth of a held load's reading per decade of time (% of itself), by the compensation, `repeatability_percent` the
    standard deviation between loadings, `noise_n` that of one reading of the empty tile.

    A held load alone does not tell creep: the rise took seconds, earlier loads are still felt, and what a trembling
    hand lets go, hysteresis keeps. The compensation is fitted to all of this at once.
    """

    error_percent: float
    bound_percent: float
    memory_error_percent: float
    mean_error_percent: float
    worst_error_percent: float
    hysteresis_percent: float
    creep_percent_decade: float
    repeatability_percent: float
    noise_n: float

    @staticmethod
    def units() -> dict[str, str]:
        """Return names and units."""
        return {
            "error_percent": "% of full scale",
            "bound_percent": "% of full scale",
            "memory_error_percent": "% of full scale",
            "mean_error_percent": "% of full scale",
            "worst_error_percent": "% of full scale",
            "hysteresis_percent": "% of full scale",
            "creep_percent_decade": "% a decade",
            "repeatability_percent": "% of full scale",
            "noise_n": "N",
        }


def characterise(pairs: SensorPairs, curve: Curve, seen: NDArray[np.intp], estimate_n: Floats) -> SensorCharacteristics:
    """Return the characteristics of a sensor; `estimate_n` are the held-out newtons of the samples `seen`."""
    f, w, full = pairs.force_n[seen], pairs.weight[seen], pairs.full_scale_n
    order = np.argsort(pairs.x[seen], kind="stable")
    best = rising(f[order], w[order]) - f[order]
    errors = np.abs(estimate_n - f)
    apparent = curve.force(pairs.reading(pairs.x))
    return SensorCharacteristics(
        error_percent=curve.error_percent,
        bound_percent=rms_percent(best, w[order], full),
        memory_error_percent=curve.compensation.error_percent if curve.compensation else np.nan,
        mean_error_percent=100.0 * float((w * errors).sum() / w.sum()) / full,
        worst_error_percent=100.0 * float(errors.max()) / full,
        hysteresis_percent=_hysteresis_percent(pairs, apparent),
        creep_percent_decade=100.0 * curve.compensation.creep if curve.compensation else np.nan,
        repeatability_percent=_repeatability_percent(pairs, apparent),
        noise_n=_noise_n(pairs, apparent),
    )


def rms_percent(errors_n: Floats, weight: Floats, full_scale_n: float) -> float:
    """Return the weighted RMS, % of full scale."""
    return 100.0 * float(np.sqrt((weight * errors_n**2).sum() / weight.sum())) / full_scale_n


def spread_percent(curves: Sequence[Curve]) -> float:
    """Return the spread of a tile's sensors: half the range of the forces at which they read the same, % of their mean.

    The reading is the one at which they carry half of full scale on average. Spread of readings would mislead: a
    divider compresses them, and parts that differ by 8 % in force differ by 3 % there.
    """
    if len(curves) < 2:
        return float("nan")
    ways = [max((end - curve.unloaded_reading for end in curve.readings), key=abs) for curve in curves]
    moved = np.linspace(0.0, min(map(abs, ways)), 2001)  # distance of a reading from the unloaded one
    forces = np.array(
        [
            curve.force(curve.unloaded_reading + math.copysign(1.0, way) * moved)
            for curve, way in zip(curves, ways, strict=True)
        ]
    )
    half = 0.5 * float(np.mean([curve.full_scale_n for curve in curves]))
    at = int(np.argmin(np.abs(forces.mean(axis=0) - half)))
    return 100.0 * float(np.ptp(forces[:, at])) / (2.0 * float(forces[:, at].mean()))


def creep_runs(pairs: SensorPairs) -> list[slice]:
    """Return stretches over which a load above a fifth of full scale is held: they show creep."""
    if not pairs.timed:
        return []
    held = (pairs.direction == HELD) & (pairs.force_n > 0.2 * pairs.full_scale_n)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    runs = [slice(int(a), int(b)) for a, b in pairwise(edges.tolist())][::2]
    runs = [_at_one_load(pairs, run) for run in runs]
    return [run for run in runs if pairs.time_s[run.stop - 1] - pairs.time_s[run.start] >= _LEAST_HOLD_S]


def _at_one_load(pairs: SensorPairs, run: slice) -> slice:
    """Return the part of a stretch that is at its commonest load: one that rises slowly is held at each moment."""
    level = force_bin(pairs.force_n[run], pairs.full_scale_n)
    there = np.flatnonzero(level == np.bincount(level).argmax())
    return slice(run.start + int(there[0]), run.start + int(there[-1]) + 1)


def held_s(pairs: SensorPairs, run: slice) -> Floats:
    """Return how long a load has been held at each sample of a stretch; a hold is detected half of `HELD_S` late."""
    return np.asarray(pairs.time_s[run] - pairs.time_s[run.start] + 0.5 * HELD_S)


def _by_level(pairs: SensorPairs, values: Floats, chosen: NDArray[np.bool_]) -> Floats:
    """Return the mean of the chosen `values` in each bin of force, NaN for empty bins."""
    at = force_bin(pairs.force_n[chosen], pairs.full_scale_n)
    total = np.bincount(at, values[chosen], minlength=BINS)
    count = np.bincount(at, minlength=BINS)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def hysteresis_gap_percent(pairs: SensorPairs, apparent: Floats) -> Floats:
    """Return how far falling loads are above rising ones where both are known, by force, % of full scale."""
    way, excess = pairs.direction, apparent - pairs.force_n
    usable = pairs.usable
    gap = _by_level(pairs, excess, usable & (way == FALLING)) - _by_level(pairs, excess, usable & (way == RISING))
    return np.asarray(100.0 * gap[np.isfinite(gap)] / pairs.full_scale_n)


def _hysteresis_percent(pairs: SensorPairs, apparent: Floats) -> float:
    gap = hysteresis_gap_percent(pairs, apparent)
    return float(gap[np.argmax(np.abs(gap))]) if gap.size else np.nan


def _repeatability_percent(pairs: SensorPairs, apparent: Floats) -> float:
    if pairs.cycles < 3:
        return np.nan
    excess = apparent - pairs.force_n
    spreads = []
    for way in (RISING, FALLING):
        chosen = pairs.usable & (pairs.direction == way)
        means = np.array([_by_level(pairs, excess, chosen & (pairs.fold == k)) for k in np.unique(pairs.fold)])
        enough = np.isfinite(means).sum(axis=0) >= 2
        if enough.any():
            spreads.append(np.nanvar(means[:, enough], axis=0, ddof=1))
    return 100.0 * float(np.sqrt(np.concatenate(spreads).mean())) / pairs.full_scale_n if spreads else np.nan


def _noise_n(pairs: SensorPairs, apparent: Floats) -> float:
    rest = np.abs(pairs.force_n) <= UNLOADED * pairs.full_scale_n
    steps = np.diff(apparent)[rest[1:] & rest[:-1]]
    return float(np.std(steps)) / np.sqrt(2.0) if steps.size > 20 else np.nan
