"""From readings to newtons, by a rising curve through knots, and from newtons to a place, by a polynomial."""

from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.floor.centroid_correction import place_all, weigh_all

MOST_PLAYS = 12
"""As many plays as the state of `force_over_time` has room for."""
ABOVE, BELOW = 0.25, 0.10
"""How far a curve goes on beyond its knots, in parts of full scale: above the highest force, and below 0."""
_MOST, _MOST_N, _MOST_M = 1e9, 1e6, 100.0
"""No number of a curve or correction is larger: in itself, in newtons, in metres."""


class Memory(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What a sensor remembers of its past, and a curve of its own to which that comes.

    `creep` is a share of the force a decade of time; `weights` are those of the force itself and of a play operator
    each `widths`: newtons, or shares of the force where `relative` (`fsr_hysteresis`). `error_percent` as
    in `Curve`.
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
        require(0.0 <= self.creep <= 0.5, "creep", self.creep, "0 to 0.5")
        require(len(self.widths) <= MOST_PLAYS, "widths", len(self.widths), f"at most {MOST_PLAYS}")
        require(all(width > 0.0 for width in self.widths), "widths", self.widths, "numbers above 0")
        require(len(self.weights) == len(self.widths) + 1, "weights", len(self.weights), "one more than widths")
        require_numbers("weights", self.weights, 1e3)


class Curve(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Newtons over readings: a cubic between knots, each with its slope; readings rise, forces never turn back.

    `law` names what was fitted and `parameters` are its constants; the knots hold it as it is used. `rest` is the
    reading of the empty tile, `full_scale_n` the highest force it was measured at. `error_percent` is the RMS error, %
    of full scale, on cycles that were not used to fit. `uncalibrated` says why a sensor has no curve; then all else is
    empty.

    >>> line = Curve(law="linear", readings=(10, 110), forces_n=(0, 50), slopes=(0.5, 0.5), full_scale_n=50)
    >>> line.force([60.0, 1000.0])
    array([25. , 62.5])
    """

    law: str = ""
    parameters: dict[str, float] = msgspec.field(default_factory=dict)
    rest: float = 0.0
    full_scale_n: float = 0.0
    error_percent: float = 0.0
    readings: tuple[float, ...] = ()
    forces_n: tuple[float, ...] = ()
    slopes: tuple[float, ...] = ()
    memory: Memory | None = None
    uncalibrated: str = ""

    def __post_init__(self) -> None:
        if self.uncalibrated:
            return
        _require_knots(self.readings, self.forces_n, self.slopes)
        require(0.0 < self.full_scale_n <= _MOST_N, "full_scale_n", self.full_scale_n, f"above 0, up to {_MOST_N:g}")
        require_numbers("rest", (self.rest,), _MOST)

    def force(self, readings: ArrayLike) -> NDArray[np.float64]:
        """Newtons of `readings`, any shape; beyond the knots along the last slope, to `ABOVE` and `BELOW` at most."""
        counts = np.asarray(readings, dtype=np.float64)
        if self.uncalibrated:
            return np.full(counts.shape, np.nan)
        return self._limited(along(self.readings, self.forces_n, self.slopes, counts))

    def force_over_time(
        self, readings: NDArray[np.float64], time_s: NDArray[np.float64], state: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Newtons of readings (n,) at `time_s` (n,), with what the sensor remembers taken out where that is known."""
        memory = self.memory
        if memory is None or self.uncalibrated:
            return self.force(readings)
        from underfoot.models.tile.fsr_hysteresis import recall

        widths, weights = np.array(memory.widths), np.array(memory.weights)
        apparent = self.apparent(readings)
        return self._limited(recall(apparent, time_s, memory.creep, memory.relative, widths, weights, state))

    def apparent(self, readings: NDArray[np.float64]) -> NDArray[np.float64]:
        """Newtons of readings, any shape, before what the sensor remembers is taken out; it must have a memory."""
        memory = self.memory
        assert memory is not None
        newtons = along(memory.readings, memory.forces_n, memory.slopes, readings)
        return np.clip(newtons, -BELOW * self.full_scale_n, 2.0 * self.full_scale_n)

    @property
    def limits_n(self) -> tuple[float, float]:
        """The least and the most force that it tells."""
        return -BELOW * self.full_scale_n, (1.0 + ABOVE) * self.full_scale_n

    def _limited(self, newtons: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip(newtons, *self.limits_n)


def along(
    readings: Sequence[float], forces_n: Sequence[float], slopes: Sequence[float], counts: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The cubic through knots with slopes, any shape; beyond the knots along the last slope. NaN stays NaN."""
    x, y, slope = np.array(readings, np.float64), np.array(forces_n, np.float64), np.array(slopes, np.float64)
    at = np.clip(np.searchsorted(x, counts, side="right") - 1, 0, x.size - 2)
    width = x[at + 1] - x[at]
    t = np.clip((counts - x[at]) / width, 0.0, 1.0)
    s = 1.0 - t
    newtons = s * s * (1.0 + 2.0 * t) * y[at] + t * t * (3.0 - 2.0 * t) * y[at + 1]
    newtons = newtons + width * t * s * (s * slope[at] - t * slope[at + 1])
    return np.asarray(newtons + np.minimum(counts - x[0], 0.0) * slope[0] + np.maximum(counts - x[-1], 0.0) * slope[-1])


class Correction(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """From corner forces to a place: each force times its gain, or bent, and the centroid displaced by a polynomial.

    Where there are `bends`, a row of them belongs to each sensor: the first times the force where that is below 0 (a
    corner that lifts), and one for each of `bends_n`, newtons, times s (1 - exp(-force / s)) above: what a curve of its
    own got wrong of light loads.

    The rows of `displacement_m` belong to the products x^i y^j of `powers`, x and y in units of `scale_m` about the
    tile's centre. Outside the convex `area_m` of the places that it was learned from, it is held as at the nearest
    point of that area.
    """

    gains: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bends_n: tuple[float, ...] = ()
    bends: tuple[tuple[float, ...], ...] = ()
    powers: tuple[tuple[int, int], ...] = ()
    displacement_m: tuple[tuple[float, float], ...] = ()
    scale_m: float = 0.1
    area_m: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        require(all(0.0 < gain <= 1e3 for gain in self.gains), "gains", self.gains, "four numbers above 0, up to 1000")
        require(all(bend > 0.0 for bend in self.bends_n), "bends_n", self.bends_n, "numbers above 0")
        shape = [len(self.bends_n) + 1] * 4 if self.bends else []
        require([len(row) for row in self.bends] == shape, "bends", self.bends, "four rows, one longer than bends_n")
        count = len(self.powers)
        require(
            len(self.displacement_m) == count, "displacement_m", self.displacement_m, f"{count} rows, as powers has"
        )
        require(all(0 <= i <= 8 for pair in self.powers for i in pair), "powers", self.powers, "whole numbers 0 to 8")
        require(0.001 <= self.scale_m <= _MOST_M, "scale_m", self.scale_m, f"0.001 to {_MOST_M:g}")
        for row in self.bends:
            require_numbers("bends", row, 1e3)
        for name, points in (("displacement_m", self.displacement_m), ("area_m", self.area_m)):
            for point in points:
                require_numbers(name, point, _MOST_M)

    def place(
        self, forces_n: NDArray[np.float64], sensors_m: NDArray[np.float64], least_n: float
    ) -> NDArray[np.float64]:
        """Places (..., 2), metres, of corner forces (..., 4) on sensors (4, 2); NaN where the load is below `least_n`.

        >>> sensors = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
        >>> Correction().place(np.array([[30.0, 10.0, 0.0, 40.0], [1.0, 0.0, 0.0, 0.0]]), sensors, 20.0).round(3) + 0.0
        array([[0.075, 0.   ],
               [  nan,   nan]])
        """
        weighed = self.weighed(forces_n)
        out = np.empty((*weighed.shape[:-1], 2))
        place_all(weighed.reshape(-1, 4), np.asarray(sensors_m, np.float64), least_n, *self.terms(), out.reshape(-1, 2))
        return out

    def weighed(self, forces_n: NDArray[np.float64]) -> NDArray[np.float64]:
        """Corner forces (..., 4) as they count for the centroid.

        >>> Correction(bends_n=(5.0,), bends=((0.5, 0.1),) * 4).weighed(np.array([-2.0, 0.0, 5.0, 500.0])).round(2)
        array([ -3.  ,   0.  ,   5.32, 500.5 ])
        """
        forces = np.ascontiguousarray(forces_n, np.float64)
        out = np.empty_like(forces)
        weigh_all(forces.reshape(-1, 4), *self.weights(), out.reshape(-1, 4))
        return out

    def weights(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Gains (4,), bends_n (k,) and bends (4, 1 + k), or (0, 0) without any, as kernels take them."""
        bends = np.array(self.bends, np.float64) if self.bends else np.zeros((0, 0))
        return np.array(self.gains, np.float64), np.array(self.bends_n, np.float64), bends

    def terms(self) -> tuple[NDArray[np.int64], NDArray[np.float64], float, NDArray[np.float64]]:
        """Powers (k, 2), displacements (k, 2), their scale and the area's corners (m, 2), as kernels take them."""
        powers = np.array(self.powers, np.int64).reshape(-1, 2)
        displacement = np.array(self.displacement_m, np.float64).reshape(-1, 2)
        return powers, displacement, self.scale_m, np.array(self.area_m, np.float64).reshape(-1, 2)


def bent(forces_n: NDArray[np.float64], bends_n: Sequence[float]) -> NDArray[np.float64]:
    """What the bends of a `Correction` stand for, shape (..., 1 + bends)."""
    above = np.maximum(forces_n, 0.0)
    return np.stack([np.minimum(forces_n, 0.0), *(bend * -np.expm1(-above / bend) for bend in bends_n)], axis=-1)


def require_numbers(name: str, values: Sequence[float], largest: float) -> None:
    """Raise `BadValue` unless all values are numbers up to `largest`, either way."""
    require(all(abs(value) <= largest for value in values), name, values, f"numbers from {-largest:g} to {largest:g}")


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
    way = 1.0 if forces_n[-1] >= forces_n[0] else -1.0
    require(all(way * slope >= 0.0 for slope in slopes), "slopes", slopes, "slopes that go the way the forces go")
