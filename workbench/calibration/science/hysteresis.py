"""Fit of a sensor's hysteresis and creep to the pairs of its curve."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.sensor_characteristics import rms_percent
from underfoot.calibration.science.sensor_pairs import FALLING, RISING, SensorPairs
from underfoot.floor.curves import Compensation
from underfoot.kernels import Floats
from underfoot.models.golden_section import least_at
from underfoot.models.tile import fsr_curves, fsr_hysteresis
from underfoot.models.tile.fsr_curves import FittedCurve
from underfoot.models.tile.fsr_hysteresis import HysteresisModel

_RATE_HZ = 100.0
"""Sample rate that is sufficient for hysteresis and creep."""
_ROUNDS, _FOLDS = 4, 3
_CREEPS = (0.0, 0.03, 0.06, 0.09, 0.12, 0.15, 0.2, 0.3)
_LEAST_PERCENT = 0.3
"""Error of a static curve below which no hysteresis model is needed."""
_LIGHT = 0.1
"""Forces well below this share of full scale have equal weight; above it, weight falls with force."""
_PIECES = 12
_LEAST_GAIN = 0.9
"""Largest share of the error on held-out loadings that a hysteresis model may leave."""
_MOST_WEIGHT = 6.0
"""Largest amplification of a change of force by the weights; above it they have fitted noise."""


def fit_hysteresis(pairs: SensorPairs, static_percent: float) -> Compensation | None:
    """Return the model with the least error on held-out loadings; None if it is no better than the static curve.

    `static_percent` is the static curve's error on held-out loadings, % of full scale.
    """
    both = bool(np.any(pairs.direction == RISING) and np.any(pairs.direction == FALLING))
    if not pairs.timed or not both or static_percent < _LEAST_PERCENT:
        return None
    slow = _decimated(pairs)
    best, least = "", static_percent
    creep = _best_creep(slow, "relative")
    for kind in fsr_hysteresis.KINDS:
        error = _held_out_percent(slow, kind, creep)
        if error < _LEAST_GAIN * least:
            best, least = kind, error
    if not best:
        return None
    curve, found, _, _ = _fit_in_turns(slow, best, creep)
    readings, forces, slopes = curve_knots(pairs, curve)
    return Compensation(
        readings=readings,
        forces_n=forces,
        slopes=slopes,
        creep=float(found.creep),
        relative=found.relative,
        widths=tuple(found.widths.tolist()),
        weights=tuple(found.weights.tolist()),
        error_percent=float(f"{least:.4g}"),
    )


def curve_knots(
    pairs: SensorPairs, curve: FittedCurve
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """Return the knots of a curve over rising readings: readings, newtons, slopes."""
    order = slice(None) if pairs.sign > 0.0 else slice(None, None, -1)
    return (
        tuple(pairs.reading(curve.x)[order].tolist()),
        tuple(curve.f[order].tolist()),
        tuple((pairs.sign * curve.slope)[order].tolist()),
    )


@dataclass(frozen=True)
class _Decimated:
    """Pairs of a sensor, all (n,), at a rate sufficient for hysteresis and creep; and what all fits to them share."""

    time_s: Floats
    x: Floats
    force_n: Floats
    weight: Floats
    fold: NDArray[np.intp]
    full_scale_n: float

    @cached_property
    def counts(self) -> Floats:
        """Weights of a fit: a centroid depends on ratios of forces, so light loads have more than their newtons."""
        return np.asarray(self.weight / (_LIGHT + np.maximum(self.force_n, 0.0) / self.full_scale_n))

    @cached_property
    def first(self) -> FittedCurve:
        """The static curve, with which every fit begins."""
        return self.curve(self.force_n) or fsr_curves.straight(self.x, self.force_n, self.weight)

    @cached_property
    def folds(self) -> "list[tuple[NDArray[np.bool_], _Decimated]]":
        """The samples of each fold, and the pairs without them."""
        outs = [self.fold == one for one in np.unique(self.fold)]
        return [(out, replace(self, weight=np.where(out, 0.0, self.weight))) for out in outs]

    def curve(self, force_n: Floats) -> FittedCurve | None:
        """Return the curve from the readings to these forces (n,); None if they do not determine one."""
        thin = slice(None, None, max(1, self.x.size // 2000))
        return fsr_curves.spline(self.x[thin], force_n[thin], self.counts[thin], _PIECES)


def _decimated(pairs: SensorPairs) -> _Decimated:
    """Return the pairs averaged down to `_RATE_HZ`, or slightly above."""
    count = max(1, int(round(1.0 / (max(pairs.period_s, 1e-6) * _RATE_HZ))))
    ends = pairs.x.size // count * count

    def mean(values: Floats) -> Floats:
        return np.asarray(values[:ends].reshape(-1, count).mean(axis=1))

    weight = np.where(pairs.usable, pairs.weight, 0.0)
    return _Decimated(
        mean(pairs.time_s),
        mean(pairs.x),
        mean(pairs.force_n),
        mean(weight),
        pairs.fold[:ends:count] % _FOLDS,
        pairs.full_scale_n,
    )


def _best_creep(slow: _Decimated, kind: str) -> float:
    """Return the creep, a share of the force per decade, with least squares: a scan, then golden-section search."""

    def left(creep: float) -> float:
        return _fit_in_turns(slow, kind, creep)[3]

    return least_at(left, np.append(_CREEPS, fsr_hysteresis.MOST_CREEP), 6)


def _held_out_percent(slow: _Decimated, kind: str, creep: float) -> float:
    """Return the RMS error on held-out loadings, % of full scale; infinite for models that have fitted noise."""
    estimate, counts = np.empty(slow.x.size), slow.weight.copy()
    for out, others in slow.folds:
        curve, found, newtons, _ = _fit_in_turns(others, kind, creep)
        if np.abs(found.weights).sum() > 2.0 * _MOST_WEIGHT:
            return np.inf
        estimate[out] = newtons[out]
        counts[out & (slow.x > curve.x[-1])] = 0.0
    return rms_percent(estimate - slow.force_n, counts, slow.full_scale_n) if counts.any() else np.inf


def _fit_in_turns(slow: _Decimated, kind: str, creep: float) -> tuple[FittedCurve, HysteresisModel, Floats, float]:
    """Fit curve and hysteresis model in turns, each to the residual of the other.

    Return both, newtons (n,) by them, and the squared residual.
    """
    curve, wanted, full = slow.first, slow.force_n, slow.full_scale_n
    for turn in range(_ROUNDS):
        curve = (slow.curve(wanted) if turn else None) or curve
        apparent = np.minimum(curve.force(slow.x), 2.0 * full)
        found, newtons, left = fsr_hysteresis.fit(apparent, slow.time_s, slow.force_n, slow.counts, full, kind, creep)
        newtons = np.clip(newtons, -0.1 * full, 1.25 * full)
        wanted = apparent + slow.force_n - newtons
    return curve, found, newtons, left
