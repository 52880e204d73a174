"""What a sensor remembers, learned from the recording that its curve comes from."""

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.science.pairs import FALLING, RISING, Recording
from underfoot.calibration.science.sensor_figures import rms_percent
from underfoot.floor.curves import Compensation
from underfoot.models.tile import fsr_curves, fsr_hysteresis
from underfoot.models.tile.fsr_curves import FittedCurve
from underfoot.models.tile.fsr_hysteresis import HysteresisModel

Values = NDArray[np.float64]

_RATE_HZ = 100.0
_ROUNDS, _FOLDS = 4, 3
_MOST_CREEP = 0.15
_WORTH_PERCENT = 0.3
"""A static curve that errs by less leaves nothing that is worth a memory."""
_LIGHT = 0.1
_PIECES = 12
_GAIN = 0.9
"""A memory is kept where it leaves less than this share of the error, on loadings not used to learn it."""
_MOST_GAIN = 6.0
"""Weights that would make more than this of a change of force are noise that was learned."""


def learned(recording: Recording, static_percent: float) -> Compensation | None:
    """The memory that helps most on held-out loadings, or None where the recording shows none worth having."""
    ways = recording.direction
    both = bool(np.any(ways == RISING) and np.any(ways == FALLING))
    if not recording.timed or not both or static_percent < _WORTH_PERCENT:
        return None
    slow = _slower(recording)
    full = recording.full_scale_n
    best, least = "", static_percent
    creep = _best_creep(slow, "relative", full)
    for kind in fsr_hysteresis.KINDS:
        error = _held_out_percent(slow, kind, full, creep)
        if error < _GAIN * least:
            best, least = kind, error
    if not best:
        return None
    law, found, _ = _alternated(slow, slow.weight, best, full, creep)
    readings, forces, slopes = knots(recording, law)
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


def knots(recording: Recording, law: FittedCurve) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    """A law's knots over readings that rise: readings, newtons, slopes."""
    order = slice(None) if recording.sign > 0.0 else slice(None, None, -1)
    return (
        tuple(recording.reading(law.x)[order].tolist()),
        tuple(law.f[order].tolist()),
        tuple((recording.sign * law.slope)[order].tolist()),
    )


class _Slow:
    """A recording at a rate that is enough for what is remembered."""

    def __init__(self, time_s: Values, x: Values, force_n: Values, weight: Values, fold: NDArray[np.intp]) -> None:
        self.time_s, self.x, self.force_n, self.weight, self.fold = time_s, x, force_n, weight, fold


def _slower(recording: Recording) -> _Slow:
    period = float(np.median(np.diff(recording.time_s)))
    count = max(1, int(round(1.0 / (max(period, 1e-6) * _RATE_HZ))))
    ends = recording.x.size // count * count

    def mean(values: Values) -> Values:
        return np.asarray(values[:ends].reshape(-1, count).mean(axis=1))

    weight = np.where(recording.usable, recording.weight, 0.0)
    return _Slow(
        mean(recording.time_s),
        mean(recording.x),
        mean(recording.force_n),
        mean(weight),
        recording.fold[:ends:count] % _FOLDS,
    )


def _best_creep(slow: _Slow, kind: str, full: float) -> float:
    def left(creep: float) -> float:
        return _alternated(slow, slow.weight, kind, full, creep)[2]

    tried = np.linspace(0.0, _MOST_CREEP, 6)
    best = int(np.argmin([left(float(creep)) for creep in tried]))
    low, high = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, tried.size - 1)])
    for _ in range(6):
        one, two = high - 0.618 * (high - low), low + 0.618 * (high - low)
        low, high = (low, two) if left(one) < left(two) else (one, high)
    return 0.5 * (low + high)


def _held_out_percent(slow: _Slow, kind: str, full: float, creep: float) -> float:
    estimate, counts = np.empty(slow.x.size), slow.weight.copy()
    for one in np.unique(slow.fold):
        out = slow.fold == one
        law, found, _ = _alternated(slow, np.where(out, 0.0, slow.weight), kind, full, creep)
        if np.abs(found.weights).sum() > 2.0 * _MOST_GAIN:
            return np.inf
        estimate[out] = _recalled(slow, law, found, full)[out]
        counts[out & (slow.x > law.x[-1])] = 0.0
    return rms_percent(estimate - slow.force_n, counts, full) if counts.any() else np.inf


def _alternated(
    slow: _Slow, weight: Values, kind: str, full: float, creep: float
) -> tuple[FittedCurve, HysteresisModel, float]:
    """Curve and memory in turns, each fitted to what the other leaves, and the squares that both leave.

    A place comes of ratios of forces, so light loads count for more here than their newtons.
    """
    thin = max(1, slow.x.size // 2000)
    counts = weight / (_LIGHT + np.maximum(slow.force_n, 0.0) / full)
    law = fsr_curves.straight(slow.x, slow.force_n, weight)
    wanted = slow.force_n
    for _ in range(_ROUNDS):
        law = fsr_curves.spline(slow.x[::thin], wanted[::thin], counts[::thin], _PIECES) or law
        apparent = np.minimum(law.force(slow.x), 2.0 * full)
        found, left = fsr_hysteresis.fit(apparent, slow.time_s, slow.force_n, counts, full, kind, creep)
        wanted = apparent + slow.force_n - _recalled(slow, law, found, full)
    return law, found, left


def _recalled(slow: _Slow, law: FittedCurve, found: HysteresisModel, full: float) -> Values:
    apparent = np.minimum(law.force(slow.x), 2.0 * full)
    newtons = fsr_hysteresis.compensate(apparent, slow.time_s, found, np.zeros(1, fsr_hysteresis.STATE)[0])
    return np.clip(newtons, -0.1 * full, 1.25 * full)
