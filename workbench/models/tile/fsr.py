"""Force sensing resistors (section 4.3.2): conductance rises with force, with a soft start, hysteresis and creep.

Data sheet of the thesis's part (Interlink 402): up to 25 % spread from part to part (6 % within a batch), resistance
10 % lower on falling than on rising force, under 5 % drift per decade of time, 20 N at most. A part is one side of a
voltage divider, read by a 16-bit converter.

The static model is `R = Rs / Fe + R0`, with `Fe = F (F / 10 N)^(p-1) F / (F + Fs)`: conductance about proportional to
force, a soft start, and a residual series resistance. It is preceded by play operators whose width is a share of the
force (hysteresis), then first-order lags in parallel, two per decade of time (creep).
"""

import math
from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_within
from underfoot.kernels import allocating, kernel
from underfoot.models.signals.random import normal, stream_key, uniform
from underfoot.models.tile.fsr_hysteresis import MOST_CREEP
from underfoot.models.tile.variation import varied

FULL_COUNTS = 65_535
"""Highest 16-bit reading."""
RATED_N = 20.0
"""Largest rated force of a part (data sheet)."""
_BEND_N = 10.0
_PLAYS = 4
_FIRST_LAG_S, _LAGS = 0.03, 12
_LAGS_A_DECADE = 2
_REFERENCE_S = 1.0
"""Time after which a constant load reads as the static model; earlier it reads less, later more."""


class Fsr(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Type of sensor with its divider and converter. Raises `BadValue` outside the ranges.

    `spread` is the largest relative deviation of an individual part from these values; `hysteresis` the relative excess
    of apparent force while force falls; `creep` that per decade of time. `noise_counts` is the standard deviation of a
    reading. `share` is the part of a corner's load that the tile's mechanics passes to the sensor: a sixtieth keeps
    1000 N on a tile's outermost corner (1147 N on that sensor, because the other side lifts) below 20 N.

    >>> Fsr(spread=2.0)
    Traceback (most recent call last):
    underfoot.errors.BadValue: spread is 2.0; allowed: 0 to 0.9
    """

    resistance_ohm_n: Annotated[float, (1.0, 1e7)] = 10_000.0
    series_ohm: Annotated[float, (0.0, 1e6)] = 200.0
    soft_start_n: Annotated[float, (0.0, 10.0)] = 0.3
    exponent: Annotated[float, (0.5, 1.5)] = 0.95
    divider_ohm: Annotated[float, (1.0, 1e7)] = 2_000.0
    share: Annotated[float, (1e-4, 1.0)] = 1.0 / 60.0
    spread: Annotated[float, (0.0, 0.9)] = 0.25
    hysteresis: Annotated[float, (0.0, 1.0)] = 0.10
    creep: Annotated[float, (0.0, MOST_CREEP)] = 0.05
    noise_counts: Annotated[float, (0.0, 1e4)] = 3.0

    def __post_init__(self) -> None:
        require_within(self)

    def part(self, *names: object) -> "Fsr":
        """Return an individual part, drawn by `names` (seed, tile, sensor): static model, hysteresis and creep.

        The exponent varies by a tenth of `spread`, the rest by all of it; none beyond its range.

        >>> one = Fsr().part(1, "t1", 0)
        >>> one == Fsr().part(1, "t1", 0), one == Fsr().part(2, "t1", 0), one.spread
        (True, False, 0.0)
        """
        key = stream_key("fsr", *names)
        near = [1.0 + self.spread * (2.0 * uniform(key, draw) - 1.0) for draw in range(6)]
        one = varied(
            self,
            resistance_ohm_n=near[0],
            series_ohm=near[1],
            soft_start_n=near[2],
            exponent=1.0 + 0.1 * (near[3] - 1.0),
            hysteresis=near[4],
            creep=near[5],
        )
        return replace(one, spread=0.0)

    def resistance_ohm(self, force_n: ArrayLike) -> NDArray[np.float64]:
        """Return the resistance under a force on the part, newtons; infinite at 0.

        >>> Fsr(soft_start_n=0.0, exponent=1.0).resistance_ohm([0.0, 1.0, 20.0])
        array([   inf, 10200.,   700.])
        """
        force = np.maximum(np.asarray(force_n, dtype=np.float64), 0.0)
        found: NDArray[np.float64] = _resistances(force.ravel(), coefficients([self], 1000.0)[0])
        return found.reshape(force.shape)

    def counts(self, corner_n: ArrayLike) -> NDArray[np.float64]:
        """Return the unrounded reading for rising corner forces, without hysteresis, creep or noise.

        >>> Fsr().counts([0.0, 100.0, 1000.0]).round()
        array([    0., 15112., 46370.])
        """
        resistance = self.resistance_ohm(self.share * np.asarray(corner_n, dtype=np.float64))
        return FULL_COUNTS * self.divider_ohm / (self.divider_ohm + resistance)

    def corner_n(self, counts: ArrayLike) -> NDArray[np.float64]:
        """Return corner forces from readings: the inverse of `counts`, up to twice the rated force of a part.

        >>> Fsr().corner_n(Fsr().counts([0.0, 0.5, 100.0, 1000.0])).round(3)
        array([0.e+00, 5.e-01, 1.e+02, 1.e+03])
        """
        force = np.concatenate([[0.0], np.geomspace(1e-4, 2.0 * RATED_N, 16384)]) / self.share
        return np.interp(np.asarray(counts, dtype=np.float64), self.counts(force), force)


STATE = np.dtype([("plays", np.float64, (_PLAYS,)), ("lags", np.float64, (_LAGS,))], align=True)
"""Memory of a part, newtons: outputs of its play operators and of its lags."""

COEFFICIENTS = np.dtype(
    [
        ("share", np.float64),
        ("resistance_ohm_n", np.float64),
        ("series_ohm", np.float64),
        ("soft_start_n", np.float64),
        ("exponent_less_1", np.float64),
        ("divider_ohm", np.float64),
        ("hysteresis", np.float64),
        ("noise_counts", np.float64),
        ("at_once", np.float64),
        ("each_lag", np.float64),
        ("lag_steps", np.float64, (_LAGS,)),
    ],
    align=True,
)
"""Coefficients of a part for kernels. Of a steady force, the share `at_once` acts without delay and `each_lag` after
each lag, whose one-pole steps are `lag_steps`; the other fields are as in `Fsr`."""


def coefficients(parts: Sequence[Fsr], rate_hz: float) -> NDArray[np.void]:
    """Return the coefficients of parts read at `rate_hz`: shape (parts,) of `COEFFICIENTS`.

    >>> c, = coefficients([Fsr(creep=0.0)], 1000.0)
    >>> float(c["at_once"]), float(c["each_lag"])  # without creep a force acts at once
    (1.0, 0.0)
    """
    lags_s = _FIRST_LAG_S * 10.0 ** (np.arange(_LAGS) / _LAGS_A_DECADE)
    found = np.zeros(len(parts), COEFFICIENTS)
    for c, fsr in zip(found, parts, strict=True):
        for name in ("share", "resistance_ohm_n", "series_ohm", "soft_start_n", "divider_ohm"):
            c[name] = getattr(fsr, name)
        c["hysteresis"], c["noise_counts"] = fsr.hysteresis, fsr.noise_counts
        c["exponent_less_1"] = fsr.exponent - 1.0
        each = fsr.creep / _LAGS_A_DECADE
        c["at_once"], c["each_lag"] = 1.0 + each * float(np.expm1(-_REFERENCE_S / lags_s).sum()), each
        c["lag_steps"] = -np.expm1(-1.0 / (rate_hz * lags_s))
    return found


@kernel
def settle(states: NDArray[np.void], coefficients: NDArray[np.void], corner_n: float) -> None:
    """Set the states (parts,) to those after `corner_n` newtons have risen on each corner and acted indefinitely."""
    for j in range(len(states)):
        state = states[j]
        force = max(corner_n, 0.0) * coefficients[j].share
        for k in range(_PLAYS):
            state.plays[k] = force
        for k in range(_LAGS):
            state.lags[k] = force


@kernel
def sense(
    states: NDArray[np.void],
    coefficients: NDArray[np.void],
    keys: NDArray[np.uint64],
    corners_n: NDArray[np.float64],
    counts: NDArray[np.float64],
    sample: int,
    n: int,
) -> None:
    """Write n readings `counts` (n, parts), whole numbers 0 to 65535, of the corner forces (n, parts), newtons.

    Forces below 0 count as 0; the two arrays may be the same. `sample` is the absolute index of the first reading;
    with `keys` (parts,) it determines the noise, so that readings do not depend on how they are split into calls.
    """
    for j in range(len(states)):
        _sense_part(states[j], coefficients[j], keys[j], corners_n[:, j], counts[:, j], sample, n)


@kernel
def _sense_part(
    state: np.record,
    c: np.record,
    key: np.uint64,
    corner_n: NDArray[np.float64],
    counts: NDArray[np.float64],
    sample: int,
    n: int,
) -> None:
    for i in range(n):
        force = max(corner_n[i], 0.0) * c.share
        apparent_n = 0.0
        for k in range(_PLAYS):
            width = 2.0 * c.hysteresis * (k + 0.5) / _PLAYS
            state.plays[k] = min(max(state.plays[k], force), (1.0 + width) * force)
            apparent_n += state.plays[k] / _PLAYS
        crept_n = c.at_once * apparent_n
        for k in range(_LAGS):
            state.lags[k] += c.lag_steps[k] * (apparent_n - state.lags[k])
            crept_n += c.each_lag * state.lags[k]
        reading = FULL_COUNTS * c.divider_ohm / (c.divider_ohm + _resistance(crept_n, c))
        if c.noise_counts > 0.0:
            reading += c.noise_counts * normal(key, sample + i)
        counts[i] = min(max(math.floor(reading + 0.5), 0.0), FULL_COUNTS)


@kernel
def _resistance(force_n: float, c: np.record) -> float:
    if force_n <= 0.0:
        return math.inf
    effective = force_n * force_n / (force_n + c.soft_start_n) * (force_n / _BEND_N) ** c.exponent_less_1
    return c.resistance_ohm_n / effective + c.series_ohm


@allocating
@kernel
def _resistances(force_n: NDArray[np.float64], c: np.record) -> NDArray[np.float64]:
    out = np.empty_like(force_n)
    for i in range(force_n.size):
        out[i] = _resistance(force_n[i], c)
    return out
