"""What a sensor does besides its curve: hysteresis, creep, repeatability, noise, and how parts differ."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.pairs import FALLING, RISING, STILL, STILL_S, Recording, level
from underfoot.floor.curves import Curve
from underfoot.models.tile.fsr_curves import rising

Values = NDArray[np.float64]

_HELD_S = 1.5
"""A load that rests for less says nothing of creep."""
_SETTLED_S = 0.1


@dataclass(frozen=True)
class Figures:
    """Measured on one sensor; NaN where the recording does not show it. All % are of full scale but creep's.

    `error_percent` is the RMS of held-out loadings, every force alike; `bound_percent` the least that any rising curve
    leaves; `memory_error_percent` as `error_percent`, with hysteresis and creep taken out. `hysteresis_percent` is the
    widest gap between falling and rising loads, `creep_percent_decade` how much a resting load grows a decade of time
    (% of itself), `repeatability_percent` the deviation from one loading to the next, `noise_n` of one reading at rest.
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
        """The figures and their units."""
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


def measured(recording: Recording, curve: Curve, seen: NDArray[np.intp], held_n: Values) -> Figures:
    """The figures of a sensor; `held_n` are held-out newtons of the samples `seen`."""
    f, w, full = recording.force_n[seen], recording.weight[seen], recording.full_scale_n
    order = np.argsort(recording.x[seen], kind="stable")
    best = rising(f[order], w[order]) - f[order]
    errors = np.abs(held_n - f)
    apparent = curve.force(recording.reading(recording.x))
    return Figures(
        error_percent=curve.error_percent,
        bound_percent=rms_percent(best, w[order], full),
        memory_error_percent=curve.compensation.error_percent if curve.compensation else np.nan,
        mean_error_percent=100.0 * float((w * errors).sum() / w.sum()) / full,
        worst_error_percent=100.0 * float(errors.max()) / full,
        hysteresis_percent=_hysteresis_percent(recording, apparent),
        creep_percent_decade=_creep_percent(recording, apparent),
        repeatability_percent=_repeatability_percent(recording, apparent),
        noise_n=_noise_n(recording, apparent),
    )


def rms_percent(errors_n: Values, weight: Values, full_scale_n: float) -> float:
    """Weighted RMS, % of full scale."""
    return 100.0 * float(np.sqrt((weight * errors_n**2).sum() / weight.sum())) / full_scale_n


def spread_percent(curves: Sequence[Curve]) -> float:
    """How far parts of a tile differ: half the range of their readings at half of full scale, % of their mean."""
    if len(curves) < 2:
        return float("nan")
    moved = []
    for curve in curves:
        x = np.linspace(curve.readings[0], curve.readings[-1], 2001)
        at = x[int(np.argmin(np.abs(curve.force(x) - 0.5 * curve.full_scale_n)))]
        moved.append(abs(float(at) - curve.unloaded_reading))
    return 100.0 * (max(moved) - min(moved)) / (2.0 * float(np.mean(moved)))


def creep_runs(recording: Recording) -> list[slice]:
    """Stretches over which a load above a fifth of full scale rests."""
    if not recording.timed:
        return []
    still = (recording.direction == STILL) & (recording.force_n > 0.2 * recording.full_scale_n)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    runs = [slice(int(a), int(b)) for a, b in pairwise(edges.tolist())][::2]
    return [run for run in runs if recording.time_s[run.stop - 1] - recording.time_s[run.start] >= _HELD_S]


def held_s(recording: Recording, run: slice) -> Values:
    """How long a load has rested; that it does is seen half of `STILL_S` late."""
    return np.asarray(recording.time_s[run] - recording.time_s[run.start] + 0.5 * STILL_S)


def _by_level(recording: Recording, values: Values, chosen: NDArray[np.bool_]) -> Values:
    """Mean of `values` at each step of force, NaN where there are none."""
    at = level(recording.force_n[chosen], recording.full_scale_n)
    total = np.bincount(at, values[chosen], minlength=48)
    count = np.bincount(at, minlength=48)
    return np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan))


def _hysteresis_percent(recording: Recording, apparent: Values) -> float:
    way, excess = recording.direction, apparent - recording.force_n
    usable = recording.usable
    gap = _by_level(recording, excess, usable & (way == FALLING)) - _by_level(
        recording, excess, usable & (way == RISING)
    )
    gap = gap[np.isfinite(gap)]
    return 100.0 * float(gap[np.argmax(np.abs(gap))]) / recording.full_scale_n if gap.size else np.nan


def _creep_percent(recording: Recording, apparent: Values) -> float:
    slopes, spans = [], []
    for run in creep_runs(recording):
        since = held_s(recording, run)
        later = since >= _SETTLED_S
        decades = np.log10(since[later])
        ratio = apparent[run][later] / recording.force_n[run][later]
        # Samples crowd at the end of a hold on a logarithmic axis; each decade counts alike.
        weight = 1.0 / np.sqrt(since[later])
        slopes.append(float(np.polyfit(decades, ratio, 1, w=weight)[0] / ratio.mean()))
        spans.append(float(np.ptp(decades)))
    return 100.0 * float(np.average(slopes, weights=spans)) if slopes else np.nan


def _repeatability_percent(recording: Recording, apparent: Values) -> float:
    if recording.cycles < 3:
        return np.nan
    excess = apparent - recording.force_n
    spreads = []
    for way in (RISING, FALLING):
        chosen = recording.usable & (recording.direction == way)
        means = np.array(
            [_by_level(recording, excess, chosen & (recording.fold == k)) for k in np.unique(recording.fold)]
        )
        enough = np.isfinite(means).sum(axis=0) >= 2
        if enough.any():
            spreads.append(np.nanvar(means[:, enough], axis=0, ddof=1))
    return 100.0 * float(np.sqrt(np.concatenate(spreads).mean())) / recording.full_scale_n if spreads else np.nan


def _noise_n(recording: Recording, apparent: Values) -> float:
    rest = np.abs(recording.force_n) <= 0.005 * recording.full_scale_n
    steps = np.diff(apparent)[rest[1:] & rest[:-1]]
    return float(np.std(steps)) / np.sqrt(2.0) if steps.size > 20 else np.nan
