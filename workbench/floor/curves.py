"""Conversion of readings to newtons: a monotonic curve through knots, and compensation of hysteresis and creep."""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.models.tile.fsr_curves import cubic_hermite
from underfoot.models.tile.fsr_hysteresis import MOST_CREEP, MOST_PLAYS, HysteresisModel, compensate

ABOVE, BELOW = 0.25, 0.10
"""Extrapolation beyond the knots, as a share of full scale: above the highest force, and below 0."""
_MOST, _MOST_N = 1e9, 1e6
"""Largest magnitude of a number in a curve, and of one in newtons."""


class Compensation(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Hysteresis and creep of one sensor, and the static curve to which their compensation is applied.

    `creep` is a share of the force a decade of time; `weights` are those of the force itself and of a play operator
    each `widths`: newtons, or shares of the force where `relative` (`fsr_hysteresis`). `error_percent` as in `Curve`.
    """

    readings: tuple[float, ...]
    forces_n: tuple[float, ...]
    slopes: tuple[float, ...]
    creep: float = 0.0
    relative: bool = False
    widths: tuple[float, ...] = ()
    weights: tuple[float, ...] = (1.0,)
    error_percent: float = 0.0

    def __post_init__(self) -> None:
        _require_knots(self.readings, self.forces_n, self.slopes)
        require(0.0 <= self.creep <= MOST_CREEP, "creep", self.creep, f"0 to {MOST_CREEP}")
        require(len(self.widths) <= MOST_PLAYS, "widths", len(self.widths), f"at most {MOST_PLAYS}")
        require(all(width > 0.0 for width in self.widths), "widths", self.widths, "numbers above 0")
        require(len(self.weights) == len(self.widths) + 1, "weights", len(self.weights), "one more than widths")
        require_numbers("weights", self.weights, 1e3)

    def model(self) -> HysteresisModel:
        """Return hysteresis and creep alone."""
        return HysteresisModel(self.creep, self.relative, np.array(self.widths), np.array(self.weights))


class Curve(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Newtons over readings: a cubic between knots with slopes. Readings rise; forces rise, or fall, throughout.

    `family` names what was fitted and `parameters` are its constants; the knots hold it as it is used.
    `unloaded_reading` is that of the empty tile, `full_scale_n` the highest force it was measured at. `error_percent`
    is the RMS error, % of full scale, on cycles that were not used to fit. `uncalibrated` says why a sensor has no
    curve; then all else is empty. In a file the compensation is "memory", the family "law" and the unloaded reading
    "rest".

    >>> line = Curve(family="linear", readings=(10, 110), forces_n=(0, 50), slopes=(0.5, 0.5), full_scale_n=50)
    >>> line.force([60.0, 1000.0])
    array([25. , 62.5])
    """

    family: str = msgspec.field(default="", name="law")
    parameters: dict[str, float] = msgspec.field(default_factory=dict)
    unloaded_reading: float = msgspec.field(default=0.0, name="rest")
    full_scale_n: float = 0.0
    error_percent: float = 0.0
    readings: tuple[float, ...] = ()
    forces_n: tuple[float, ...] = ()
    slopes: tuple[float, ...] = ()
    compensation: Compensation | None = msgspec.field(default=None, name="memory")
    uncalibrated: str = ""

    def __post_init__(self) -> None:
        if self.uncalibrated:
            return
        _require_knots(self.readings, self.forces_n, self.slopes)
        require(0.0 < self.full_scale_n <= _MOST_N, "full_scale_n", self.full_scale_n, f"above 0, up to {_MOST_N:g}")
        require_numbers("rest", (self.unloaded_reading,), _MOST)

    def force(self, readings: ArrayLike) -> NDArray[np.float64]:
        """Convert `readings`, any shape, to newtons; beyond the knots with the last slope, up to `ABOVE` and
        `BELOW`."""
        counts = np.asarray(readings, dtype=np.float64)
        if self.uncalibrated:
            return np.full(counts.shape, np.nan)
        return self._limited(_through_knots(self, counts))

    def force_over_time(
        self, readings: NDArray[np.float64], time_s: NDArray[np.float64], state: np.void
    ) -> NDArray[np.float64]:
        """Convert readings (n,) at `time_s` (n,) to newtons; hysteresis and creep are compensated if known.

        `state`, of `fsr_hysteresis.STATE`, is updated.
        """
        if self.compensation is None or self.uncalibrated:
            return self.force(readings)
        return self._limited(compensate(self.apparent(readings), time_s, self.compensation.model(), state))

    @property
    def over_time_error_percent(self) -> float:
        """Error of `force_over_time`, which a session uses: as `error_percent`."""
        return self.error_percent if self.compensation is None else self.compensation.error_percent

    def apparent(self, readings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert readings, any shape, to newtons before compensation, which the curve must have."""
        assert self.compensation is not None
        newtons = _through_knots(self.compensation, readings)
        return np.clip(newtons, -BELOW * self.full_scale_n, 2.0 * self.full_scale_n)

    @property
    def limits_n(self) -> tuple[float, float]:
        """Return the least and the greatest force that `force` returns."""
        return -BELOW * self.full_scale_n, (1.0 + ABOVE) * self.full_scale_n

    def _limited(self, newtons: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip(newtons, *self.limits_n)


def require_numbers(name: str, values: Sequence[float], largest: float) -> None:
    """Raise `BadValue` unless all values are numbers of at most this magnitude."""
    require(all(abs(value) <= largest for value in values), name, values, f"numbers from {-largest:g} to {largest:g}")


def _through_knots(curve: Curve | Compensation, counts: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, slope = (np.array(values, np.float64) for values in (curve.readings, curve.forces_n, curve.slopes))
    return cubic_hermite(x, y, slope, counts)


def _require_knots(readings: Sequence[float], forces_n: Sequence[float], slopes: Sequence[float]) -> None:
    count = len(readings)
    require(count >= 2, "readings", count, "at least two knots")
    require(bool(np.all(np.diff(readings) > 0.0)), "readings", readings, "readings that rise")
    for name, values in (("forces_n", forces_n), ("slopes", slopes)):
        require(len(values) == count, name, len(values), f"as many as readings, {count}")
    for name, values, largest in (
        ("readings", readings, _MOST),
        ("forces_n", forces_n, _MOST_N),
        ("slopes", slopes, _MOST),
    ):
        require_numbers(name, values, largest)
    steps = np.diff(forces_n)
    require(bool(np.all(steps >= 0.0) or np.all(steps <= 0.0)), "forces_n", forces_n, "forces that only rise or fall")
    direction = 1.0 if forces_n[-1] >= forces_n[0] else -1.0
    require(
        all(direction * slope >= 0.0 for slope in slopes), "slopes", slopes, "slopes of the sign that the forces have"
    )
