"""Linearisation of force sensing resistors (section 4.3.2): candidate curves to newtons, and their choice.

A static curve is chosen by cross-validation over whole loadings. No curve can be better than the mean of rising and
falling loads; that bound is measured, too. If the pairs show hysteresis and creep, a model of them
(`underfoot.models.tile.fsr_hysteresis`) is fitted as well, and judged on the same held-out loadings.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.measurements import LARGEST_READING, Pairs
from underfoot.calibration.science.foot_check import FootCheck
from underfoot.calibration.science.hysteresis import curve_knots, fit_hysteresis
from underfoot.calibration.science.pair_plausibility import require_plausible
from underfoot.calibration.science.reference_lag import reference_lag_s
from underfoot.calibration.science.sensor_characteristics import (
    SensorCharacteristics,
    characterise,
    rms_percent,
)
from underfoot.calibration.science.sensor_pairs import SensorPairs, prepare
from underfoot.errors import BadValue
from underfoot.floor.curves import ABOVE, BELOW, Curve
from underfoot.kernels import Floats
from underfoot.models.tile import fsr_curves
from underfoot.models.tile.fsr_curves import FittedCurve
from underfoot.quantities import counted

Fit = Callable[[Floats, Floats, Floats], FittedCurve | None]

ALLOWED_PERCENT = 5.0
"""Allowed RMS error, % of full scale: what the thesis reaches after calibration (section 4.3.2)."""
_PIECES = (3, 5, 8, 12)
_SIMPLER, _AS_GOOD_PERCENT = 1.03, 0.01
"""Largest factor in error, or excess in %, by which a curve with fewer constants may exceed the best one."""
_MOST_SAMPLES = 4000
_LIGHT_N = 150.0
"""Full scale below which the forces may be in kilograms: hardly anybody weighs more of them."""
_UNLIKE = 1.7
"""Factor from the force of the others to a sensor's, for the same reading, that is no spread of parts: these differ by
25 % (section 4.3.2)."""
_MOST_LAG_S = 0.015
"""Lag of the reference that makes sensors of simulated tiles err by twice as much."""


@dataclass(frozen=True)
class VoltageDivider:
    """Voltage divider: `resistance_ohm` in series, `full_counts` at zero resistance of the sensor.

    `falling` if the reading falls with force: the sensor is on the other side of the divider.
    """

    resistance_ohm: float
    full_counts: float = LARGEST_READING
    falling: bool = False

    def conductance(self, reading: Floats) -> Floats:
        """Return the conductance of the sensor at readings, siemens."""
        share = np.clip(reading / self.full_counts, 0.0, 1.0 - 1e-6)
        share = np.clip(1.0 - share, 0.0, 1.0 - 1e-6) if self.falling else share
        return np.asarray(share / ((1.0 - share) * self.resistance_ohm))


@dataclass(frozen=True)
class SensorFit:
    """Curve of one sensor, its pairs (None if unusable), and its characteristics.

    `tried` is the held-out error of every candidate, % of full scale; `estimate_n` are held-out newtons of the samples
    `seen` of the pairs.
    """

    curve: Curve
    pairs: SensorPairs | None = None
    characteristics: SensorCharacteristics | None = None
    tried: tuple[tuple[str, float], ...] = ()
    seen: NDArray[np.intp] | None = None
    estimate_n: Floats | None = None

    def rows(self, sensor: int) -> Floats:
        """Return time, sensor from 1, reading and force of every pair: (n, 4)."""
        if self.pairs is None:
            return np.empty((0, 4))
        one = self.pairs
        number = np.full(one.time_s.size, sensor + 1.0)
        return np.stack([one.time_s, number, one.reading(one.x), one.force_n], axis=1)


@dataclass(frozen=True)
class Linearisation:
    """Curves of a tile's four sensors, objections to them, and how far their sum is off if that was checked."""

    tile: str
    full_scale_n: float
    sensors: tuple[SensorFit, SensorFit, SensorFit, SensorFit]
    warnings: tuple[str, ...]
    foot: FootCheck | None = None

    @property
    def curves(self) -> list[Curve]:
        """Curves of the sensors."""
        return [sensor.curve for sensor in self.sensors]

    @property
    def calibrated(self) -> tuple[int, ...]:
        """Sensors that have a curve, from 0."""
        return tuple(j for j, sensor in enumerate(self.sensors) if not sensor.curve.uncalibrated)

    @property
    def error_percent(self) -> float:
        """Held-out RMS error of the static curves, % of full scale, mean over the sensors with a curve."""
        return float(np.mean([self.sensors[j].curve.error_percent for j in self.calibrated]))

    @property
    def over_time_errors_percent(self) -> dict[int, float]:
        """The same of each sensor with a curve, by the forces that a session uses: hysteresis and creep compensated."""
        return {j: self.curves[j].over_time_error_percent for j in self.calibrated}

    @property
    def good(self) -> bool:
        """Whether all sensors are calibrated over nearly full scale, within the allowed error, as is their sum.

        By the forces that a session uses.
        """
        errors = [*self.over_time_errors_percent.values(), *(() if self.foot is None else (self.foot.error_percent,))]
        return len(self.calibrated) == 4 and max(errors) <= ALLOWED_PERCENT and not self.saturated

    @property
    def saturated(self) -> tuple[tuple[int, float], ...]:
        """Sensors that saturate well below full scale, from 0, with the saturating force, newtons."""
        ends = [(j, sensor.pairs.saturates_n) for j, sensor in enumerate(self.sensors) if sensor.pairs]
        return tuple((j, end_n) for j, end_n in ends if end_n < 0.9 * self.full_scale_n)


def linearise(pairs: Pairs, divider: VoltageDivider | None = None, *, hysteresis: bool = True) -> Linearisation:
    """Fit the four sensors of a tile; without `hysteresis` only the static curves, which is fast.

    `BadValue` with reasons if no sensor can be calibrated, and for implausible forces
    (`underfoot.calibration.science.pair_plausibility.require_plausible`).
    """
    mine = [pairs.sensor == j for j in range(4)]
    tables = [(pairs.time_s[one], pairs.reading[one], pairs.force_n[one]) for one in mine]
    require_plausible(tables)
    full = float(pairs.force_n.max())
    fits, warnings = [], []
    for j, table in enumerate(tables):
        ready = prepare(*table, full)
        fit = SensorFit(Curve(uncalibrated=ready)) if isinstance(ready, str) else _fit(ready, divider, hysteresis)
        fits.append(fit)
        if fit.curve.uncalibrated:
            warnings.append(f"sensor {j + 1} is not calibrated: {fit.curve.uncalibrated}")
        elif fit.pairs is not None:
            warnings += [f"sensor {j + 1}: {text}" for text in _doubts(fit.pairs)]
    warnings += _opposite([fit.pairs for fit in fits]) + _unlike([fit.curve for fit in fits])
    lag_s = reference_lag_s([fit.pairs for fit in fits if fit.pairs is not None])
    if abs(lag_s) > _MOST_LAG_S:
        warnings.append(
            f"the reference force comes {abs(1e3 * lag_s):.0f} ms {'after' if lag_s > 0.0 else 'before'} the readings, "
            "which is taken for hysteresis: is the load cell filtered, slow, or its time late? Take a faster one, turn "
            "its filter off, or raise and lower the force more slowly"
        )
    if full < _LIGHT_N:
        warnings.append(
            f"full scale is {full:.3g} N, and what is above {(1.0 + ABOVE) * full:.3g} N is cut: a person's foot loads "
            "a sensor with more; are the forces in newtons, and not in kilograms?"
        )
    first, second, third, fourth = fits
    found = Linearisation(pairs.tile, full, (first, second, third, fourth), tuple(warnings))
    if not found.calibrated:
        raise BadValue("no sensor can be calibrated: " + "; ".join(warnings))
    return found


def candidates(pairs: SensorPairs, divider: VoltageDivider | None) -> list[tuple[str, Fit]]:
    """Return the curve families to try, fewest constants first."""
    found: list[tuple[str, Fit]] = [("power", fsr_curves.power)]
    if divider is not None:
        at_rest = divider.conductance(np.array([pairs.rest]))

        def conductance(x: Floats) -> Floats:
            return divider.conductance(pairs.reading(x)) - at_rest

        found.append(("resistor", lambda x, f, w: fsr_curves.resistor(x, f, w, conductance)))
    found += [("rational", fsr_curves.rational), ("exponential", fsr_curves.exponential)]
    return found + [(f"spline of {n}", partial(fsr_curves.spline, pieces=n)) for n in _PIECES]


def _fit(pairs: SensorPairs, divider: VoltageDivider | None, hysteresis: bool) -> SensorFit:
    seen = np.flatnonzero(pairs.usable)
    seen = seen[:: max(1, seen.size // _MOST_SAMPLES)]
    x, f, w = pairs.x[seen], pairs.force_n[seen], pairs.weight[seen]
    full = pairs.full_scale_n
    tried: list[tuple[str, float]] = []
    held: dict[str, Floats] = {}
    fits = candidates(pairs, divider)
    for name, fit in fits:
        estimate = _held_out(fit, x, f, w, pairs.fold[seen])
        if estimate is not None:
            held[name] = np.clip(estimate, -BELOW * full, (1.0 + ABOVE) * full)
            tried.append((name, rms_percent(held[name] - f, w, full)))
    if not tried:
        return SensorFit(Curve(uncalibrated="no rising curve fits its pairs"))
    least = min(error for _, error in tried)
    chosen = next(name for name, error in tried if error <= max(_SIMPLER * least, least + _AS_GOOD_PERCENT))
    fitted = dict(fits)[chosen](x, f, w)
    if fitted is None or fitted.f[-1] <= 0.0:
        return SensorFit(Curve(uncalibrated="no rising curve fits its pairs"))
    readings, forces, slopes = curve_knots(pairs, fitted)
    curve = Curve(
        family=fitted.family,
        parameters={name: float(f"{value:.8g}") for name, value in fitted.parameters.items()},
        unloaded_reading=pairs.rest,
        full_scale_n=full,
        error_percent=float(f"{dict(tried)[chosen]:.4g}"),
        readings=readings,
        forces_n=forces,
        slopes=slopes,
        compensation=fit_hysteresis(pairs, dict(tried)[chosen]) if hysteresis else None,
    )
    characteristics = characterise(pairs, curve, seen, held[chosen])
    return SensorFit(curve, pairs, characteristics, tuple(tried), seen, held[chosen])


def _held_out(fit: Fit, x: Floats, f: Floats, w: Floats, fold: NDArray[np.intp]) -> Floats | None:
    """Return newtons of every sample from a curve fitted to the other folds; None if one cannot be fitted.

    Beyond the other folds' readings, reached by one loading only, they come from the curve fitted to all.
    """
    whole = fit(x, f, w)
    if whole is None:
        return None
    estimate = whole.force(x)
    for one in np.unique(fold):
        out = fold == one
        curve = fit(x[~out], f[~out], w[~out]) if not out.all() else None
        if curve is None:
            return None
        known = out & (x <= curve.x[-1])
        estimate[known] = curve.force(x[known])
    return estimate


def _opposite(sensors: Sequence[SensorPairs | None]) -> list[str]:
    """Return messages on sensors whose readings change in the opposite direction to most."""
    signs = [0.0 if sensor is None else sensor.sign for sensor in sensors]
    return [
        f"sensor {j + 1}: its reading {'rises' if sign > 0.0 else 'falls'} with force, unlike the others'; wired the "
        "other way, or weights in reverse order?"
        for j, sign in enumerate(signs)
        if sign * (sum(signs) - sign) < 0.0
    ]


def _unlike(curves: Sequence[Curve]) -> list[str]:
    """Return messages on sensors that need far more or less force than the others for the same change of reading."""
    known = [(j, curve) for j, curve in enumerate(curves) if not curve.uncalibrated]
    if len(known) < 3:
        return []  # of two, either may be the unusual one
    ways = [max((end - curve.unloaded_reading for end in curve.readings), key=abs) for _, curve in known]
    change = 0.5 * min(map(abs, ways))
    forces = [
        float(curve.force(curve.unloaded_reading + np.copysign(change, way)))
        for (_, curve), way in zip(known, ways, strict=True)
    ]
    found = []
    for k, (j, _) in enumerate(known):
        times = forces[k] / max(float(np.median(forces[:k] + forces[k + 1 :])), 1e-9)
        if not 1.0 / _UNLIKE <= times <= _UNLIKE:
            found.append(
                f"sensor {j + 1}: it takes {times:.2g} times the force of the others for the same reading; another "
                "resistor or part, or does something else bear its load?"
            )
    return found


def _doubts(pairs: SensorPairs) -> list[str]:
    """Return doubts about the pairs of a sensor."""
    found = []
    if not pairs.has_directions:
        found.append(
            f"read every {pairs.period_s:.4g} s, too seldom to tell rising, falling and held forces apart; "
            "is time_s in seconds?"
        )
    if not pairs.rested:
        found.append("the empty tile was not read; its reading there is extrapolated")
    top = float(pairs.force_n.max())
    if top < 0.8 * pairs.full_scale_n:
        found.append(f"loaded up to {top:.3g} N only, of {pairs.full_scale_n:.4g} N")
    if np.isfinite(pairs.saturates_n):
        found.append(f"saturated above {pairs.saturates_n:.3g} N, of {pairs.full_scale_n:.4g} N")
    if pairs.timed and pairs.cycles < 3:
        found.append(f"{counted(pairs.cycles, 'loading')} only; three or more show how far they repeat")
    return found
