"""Force sensing resistors to newtons (section 4.3.2): candidates, the choice among them, and what cannot be done.

A static curve is chosen by cross-validation over whole loadings. No curve can do better than the mean of rising and
falling loads; that bound is measured, too. Where a recording shows what a sensor remembers, a memory is learned besides
(`underfoot.models.tile.fsr_hysteresis`) and held to the same loadings.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from functools import partial

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.tables import Pairs
from underfoot.calibration.science.hysteresis import knots, learned
from underfoot.calibration.science.pairs import Recording, prepared
from underfoot.calibration.science.plausibility import require_right
from underfoot.calibration.science.sensor_figures import Figures, measured, rms_percent, spread_percent
from underfoot.errors import BadValue
from underfoot.floor.curves import ABOVE, BELOW, Curve
from underfoot.floor.profile import Fsr
from underfoot.models.tile import fsr_curves
from underfoot.models.tile.fsr_curves import FittedCurve

Values = NDArray[np.float64]
Fit = Callable[[Values, Values, Values], FittedCurve | None]

ALLOWED_PERCENT = 5.0
"""What the thesis reaches after calibration, of full scale (section 4.3.2)."""
_PIECES = (3, 5, 8, 12)
_SIMPLER, _AS_GOOD_PERCENT = 1.03, 0.01
"""A law with fewer constants is taken where it errs by no more than this times the best, or by so much more."""
_SEEN = 4000


@dataclass(frozen=True)
class Divider:
    """How a resistance is read: `resistance_ohm` in series, `full_counts` at no resistance; `falling` the other way."""

    resistance_ohm: float
    full_counts: float = 65535.0
    falling: bool = False

    def conductance(self, reading: Values) -> Values:
        """Siemens at a reading."""
        share = np.clip(reading / self.full_counts, 0.0, 1.0 - 1e-6)
        share = np.clip(1.0 - share, 0.0, 1.0 - 1e-6) if self.falling else share
        return np.asarray(share / ((1.0 - share) * self.resistance_ohm))


@dataclass(frozen=True)
class SensorFit:
    """What came of one sensor: its curve, its recording (None where it cannot be used), and its figures.

    `tried` is the held-out error of every candidate, % of full scale; `estimate_n` are held-out newtons of the samples
    `seen` of the recording.
    """

    curve: Curve
    recording: Recording | None = None
    figures: Figures | None = None
    tried: tuple[tuple[str, float], ...] = ()
    seen: NDArray[np.intp] | None = None
    estimate_n: Values | None = None

    def rows(self, sensor: int) -> Values:
        """Time, sensor from 1, reading and force of every pair: (n, 4)."""
        if self.recording is None:
            return np.empty((0, 4))
        one = self.recording
        number = np.full(one.time_s.size, sensor + 1.0)
        return np.stack([one.time_s, number, one.reading(one.x), one.force_n], axis=1)


@dataclass(frozen=True)
class Linearisation:
    """A tile's four sensors, and what may be said of them."""

    tile: str
    full_scale_n: float
    sensors: tuple[SensorFit, SensorFit, SensorFit, SensorFit]
    warnings: tuple[str, ...]

    @property
    def calibrated(self) -> tuple[int, ...]:
        """The sensors that have a curve, from 0."""
        return tuple(j for j, sensor in enumerate(self.sensors) if not sensor.curve.uncalibrated)

    @property
    def quantities(self) -> tuple[tuple[str, float, str], ...]:
        """Name, value and unit of all that was measured: means over the sensors, then each."""
        found = [sensor.figures for sensor in self.sensors if sensor.figures is not None]
        several: list[tuple[str, float, str]] = [
            ("full_scale_n", self.full_scale_n, "N"),
            ("sensors_calibrated", float(len(self.calibrated)), ""),
        ]
        for name, unit in Figures.units().items():
            values = [value for one in found if np.isfinite(value := getattr(one, name))]
            if values:
                several.append((name, float(np.mean(values)), unit))
        several.append(("spread_percent", spread_percent([self.sensors[j].curve for j in self.calibrated]), "%"))
        for j in self.calibrated:
            several.append((f"error_percent_{j + 1}", self.sensors[j].curve.error_percent, "%"))
        return tuple((name, value, unit) for name, value, unit in several if np.isfinite(value))

    @property
    def error_percent(self) -> float:
        """Held-out RMS error of the static curves, % of full scale, mean over the sensors that have one."""
        return float(np.mean([self.sensors[j].curve.error_percent for j in self.calibrated]))

    @property
    def good(self) -> bool:
        """Whether every sensor is calibrated over nearly all of full scale, and none errs by more than is allowed."""
        errors = [sensor.curve.error_percent for sensor in self.sensors]
        return len(self.calibrated) == 4 and max(errors) <= ALLOWED_PERCENT and not self._saturated()

    @property
    def verdict(self) -> str:
        """In plain words: what the readings are good for."""
        figures = {name: value for name, value, _ in self.quantities}
        missing = [
            f"sensor {j + 1}: {self.sensors[j].curve.uncalibrated}" for j in range(4) if j not in self.calibrated
        ]
        words = f"Newtons are true to {self.error_percent:.1f} % of full scale ({self.full_scale_n:.0f} N)"
        if "memory_error_percent" in figures:
            words += f", to {figures['memory_error_percent']:.1f} % with hysteresis and creep taken out"
        words += (
            "."
            if self.error_percent <= ALLOWED_PERCENT
            else f", which is worse than the {ALLOWED_PERCENT:.0f} % allowed."
        )
        bound = figures["bound_percent"]
        if self.error_percent <= 1.1 * bound and bound > 0.5:
            words += f" No static curve can do better than {bound:.1f} %: the sensors remember."
        worst = max(self.calibrated, key=lambda j: self.sensors[j].curve.error_percent)
        if self.sensors[worst].curve.error_percent > ALLOWED_PERCENT >= self.error_percent:
            words += f" Sensor {worst + 1} errs by {self.sensors[worst].curve.error_percent:.1f} %, too much."
        if self._saturated():
            words += f" Saturated: {', '.join(self._saturated())}; above that force their newtons are too few."
        if missing:
            words += f" Not calibrated: {'; '.join(missing)}."
        return words

    def _saturated(self) -> list[str]:
        ends = [(j, sensor.recording.saturates_n) for j, sensor in enumerate(self.sensors) if sensor.recording]
        return [f"sensor {j + 1} from {end:.3g} N on" for j, end in ends if end < 0.9 * self.full_scale_n]

    def part(self, reference: str, today: date | None = None) -> Fsr:
        """The profile's part."""
        first, second, third, fourth = (sensor.curve for sensor in self.sensors)
        return Fsr(
            made=(today or date.today()).isoformat(),
            reference=reference,
            error=round(self.error_percent, 4),
            error_allowed=ALLOWED_PERCENT,
            error_unit="% of full scale",
            good=self.good,
            verdict=self.verdict,
            figures={name: float(f"{value:.6g}") for name, value, _ in self.quantities},
            sensors=(first, second, third, fourth),
        )


def linearise(pairs: Pairs, divider: Divider | None = None, memories: bool = True) -> Linearisation:
    """Fit the four sensors of a tile; without `memories` the static curves only, which is quick.

    `BadValue` where no sensor can be calibrated, with the reasons, and for forces that cannot be what pressed
    (`underfoot.calibration.science.plausibility.require_right`).
    """
    mine = [pairs.sensor == j for j in range(4)]
    tables = [(pairs.time_s[one], pairs.reading[one], pairs.force_n[one]) for one in mine]
    require_right(tables)
    full = float(pairs.force_n.max())
    fits, warnings = [], []
    for j, table in enumerate(tables):
        recording = prepared(*table, full)
        fit = (
            SensorFit(Curve(uncalibrated=recording))
            if isinstance(recording, str)
            else _fitted(recording, divider, memories)
        )
        fits.append(fit)
        if fit.curve.uncalibrated:
            warnings.append(f"sensor {j + 1} is not calibrated: {fit.curve.uncalibrated}")
        elif fit.recording is not None:
            warnings += [f"sensor {j + 1}: {words}" for words in _doubts(fit.recording)]
    warnings += _other_ways([fit.recording for fit in fits])
    first, second, third, fourth = fits
    found = Linearisation(pairs.tile, full, (first, second, third, fourth), tuple(warnings))
    if not found.calibrated:
        raise BadValue("no sensor can be calibrated: " + "; ".join(warnings))
    return found


def candidates(recording: Recording, divider: Divider | None) -> list[tuple[str, Fit]]:
    """Laws to try, fewest constants first."""
    found: list[tuple[str, Fit]] = [("power", fsr_curves.power)]
    if divider is not None:
        at_rest = divider.conductance(np.array([recording.rest]))

        def conductance(x: Values) -> Values:
            return divider.conductance(recording.reading(x)) - at_rest

        found.append(("resistor", lambda x, f, w: fsr_curves.resistor(x, f, w, conductance)))
    found += [("rational", fsr_curves.rational), ("exponential", fsr_curves.exponential)]
    return found + [(f"spline of {n}", partial(fsr_curves.spline, pieces=n)) for n in _PIECES]


def _fitted(recording: Recording, divider: Divider | None, memories: bool) -> SensorFit:
    seen = np.flatnonzero(recording.usable)
    seen = seen[:: max(1, seen.size // _SEEN)]
    x, f, w = recording.x[seen], recording.force_n[seen], recording.weight[seen]
    full = recording.full_scale_n
    tried: list[tuple[str, float]] = []
    held: dict[str, Values] = {}
    fits = candidates(recording, divider)
    for name, fit in fits:
        estimate = _held_out(fit, x, f, w, recording.fold[seen])
        if estimate is not None:
            held[name] = np.clip(estimate, -BELOW * full, (1.0 + ABOVE) * full)
            tried.append((name, rms_percent(held[name] - f, w, full)))
    if not tried:
        return SensorFit(Curve(uncalibrated="its pairs allow no rising curve"))
    least = min(error for _, error in tried)
    chosen = next(name for name, error in tried if error <= max(_SIMPLER * least, least + _AS_GOOD_PERCENT))
    law = dict(fits)[chosen](x, f, w)
    if law is None or law.f[-1] <= 0.0:
        return SensorFit(Curve(uncalibrated="its pairs allow no rising curve"))
    readings, forces, slopes = knots(recording, law)
    curve = Curve(
        family=law.family,
        parameters={name: float(f"{value:.8g}") for name, value in law.parameters.items()},
        unloaded_reading=recording.rest,
        full_scale_n=full,
        error_percent=float(f"{dict(tried)[chosen]:.4g}"),
        readings=readings,
        forces_n=forces,
        slopes=slopes,
        compensation=learned(recording, dict(tried)[chosen]) if memories else None,
    )
    figures = measured(recording, curve, seen, held[chosen])
    return SensorFit(curve, recording, figures, tuple(tried), seen, held[chosen])


def _held_out(fit: Fit, x: Values, f: Values, w: Values, fold: NDArray[np.intp]) -> Values | None:
    """Newtons of every sample from a curve that was fitted to the other folds.

    Not from far beyond them: what only one loading reached is fitted by all, for there is nothing to hold it against.
    """
    whole = fit(x, f, w)
    if whole is None:
        return None
    estimate = whole.force(x)
    for one in np.unique(fold):
        out = fold == one
        law = fit(x[~out], f[~out], w[~out]) if not out.all() else None
        if law is None:
            return None
        known = out & (x <= law.x[-1])
        estimate[known] = law.force(x[known])
    return estimate


def _other_ways(recordings: Sequence[Recording | None]) -> list[str]:
    """Sensors whose readings go the other way than those of most."""
    signs = [0.0 if one is None else one.sign for one in recordings]
    return [
        f"sensor {j + 1}: its reading {'rises' if sign > 0.0 else 'falls'} with force, unlike the others'; wired the "
        "other way, or weights in reverse order?"
        for j, sign in enumerate(signs)
        if sign * (sum(signs) - sign) < 0.0
    ]


def _doubts(recording: Recording) -> list[str]:
    found = []
    if not recording.rested:
        found.append("no reading of the empty tile; its rest is extrapolated")
    top = float(recording.force_n.max())
    if top < 0.8 * recording.full_scale_n:
        found.append(f"pressed to {top:.3g} N only, of {recording.full_scale_n:.4g} N")
    if np.isfinite(recording.saturates_n):
        found.append(f"saturated from {recording.saturates_n:.3g} N on, of {recording.full_scale_n:.4g} N")
    if recording.timed and recording.cycles < 3:
        found.append(f"{recording.cycles} loadings only; three tell the curve from the chance of one")
    return found
