"""Force sensing resistors (section 4.3.2): a conductance that grows with force, softly at first, and remembers.

The thesis's parts (Interlink 402) are sold with these figures: up to 25 % from part to part (6 % within a batch), a
resistance 10 % lower when force falls than when it rises, under 5 % of drift a decade of time, 20 N at most. A part is
one side of a divider, read by a 16-bit converter.

The law is `R = Rs / Fe + R0`, with `Fe = F (F / 10 N)^(p-1) F / (F + Fs)`: conductance about proportional to force, a
soft start, and a series resistance that remains. Memory comes before the law: play operators whose width is a share
of the force (hysteresis), then a chain of lags, two a decade of time (creep).
"""

import math

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.signals.random import normal, stream_key, uniform

FULL_COUNTS = 65_535
"""The highest reading of 16 bits."""
RATED_N = 20.0
"""What a part may carry (data sheet)."""
_BEND_N = 10.0
_PLAYS = 4
_FIRST_LAG_S, _LAGS = 0.03, 12
_LAGS_A_DECADE = 2
_KEPT_S = 1.0
"""A load held for this long reads as the law says; sooner it reads less, later more."""


class Fsr(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A kind of part, its divider and its converter. Raises `BadValue` outside the ranges of `FSR_RANGES`.

    `spread` is how far a part's own values lie from these at most, as a share; `hysteresis` how much more force it
    seems to carry while force falls; `creep` how much more a decade of time. `noise_counts` is the deviation of a
    reading. `share` is the part of a corner's load that the tile's mechanics lets through to the sensor: a sixtieth
    keeps 1000 N on a tile's outermost corner (1147 N on that sensor, for the other side lifts) below 20 N.

    >>> Fsr(spread=2.0)
    Traceback (most recent call last):
    underfoot.errors.BadValue: spread is 2.0; allowed: 0 to 0.9
    """

    resistance_ohm_n: float = 10_000.0
    series_ohm: float = 200.0
    soft_start_n: float = 0.3
    exponent: float = 0.95
    divider_ohm: float = 2_000.0
    share: float = 1.0 / 60.0
    spread: float = 0.25
    hysteresis: float = 0.10
    creep: float = 0.05
    noise_counts: float = 3.0

    def __post_init__(self) -> None:
        for name, (low, high) in FSR_RANGES.items():
            value = getattr(self, name)
            require(low <= value <= high, name, value, f"{low:g} to {high:g}")

    def part(self, *names: object) -> "Fsr":
        """A part of this kind, drawn by `names` (seed, tile, sensor): its own law, hysteresis and creep.

        The exponent varies by a tenth of `spread`, the rest by all of it.

        >>> one = Fsr().part(1, "t1", 0)
        >>> one == Fsr().part(1, "t1", 0), one == Fsr().part(2, "t1", 0), one.spread
        (True, False, 0.0)
        """
        key = stream_key("fsr", *names)
        near = [1.0 + self.spread * (2.0 * uniform(key, draw) - 1.0) for draw in range(6)]
        return msgspec.structs.replace(
            self,
            resistance_ohm_n=self.resistance_ohm_n * near[0],
            series_ohm=self.series_ohm * near[1],
            soft_start_n=self.soft_start_n * near[2],
            exponent=self.exponent * (1.0 + 0.1 * (near[3] - 1.0)),
            hysteresis=self.hysteresis * near[4],
            creep=self.creep * near[5],
            spread=0.0,
        )

    def resistance_ohm(self, force_n: ArrayLike) -> NDArray[np.float64]:
        """The resistance under a force on the part, newtons; infinite at 0.

        >>> Fsr(soft_start_n=0.0, exponent=1.0).resistance_ohm([0.0, 1.0, 20.0])
        array([   inf, 10200.,   700.])
        """
        force = np.maximum(np.asarray(force_n, dtype=np.float64), 0.0)
        t = np.empty(tuning_size())
        tune(t, self, 1000.0)
        return _resistances(np.atleast_1d(force), t).reshape(force.shape)

    def counts(self, corner_n: ArrayLike) -> NDArray[np.float64]:
        """What the converter reads, not rounded, of a force that rises on a corner: no hysteresis, creep or noise.

        >>> Fsr().counts([0.0, 100.0, 1000.0]).round()
        array([    0., 15112., 46370.])
        """
        resistance = self.resistance_ohm(self.share * np.asarray(corner_n, dtype=np.float64))
        return FULL_COUNTS * self.divider_ohm / (self.divider_ohm + resistance)

    def corner_n(self, counts: ArrayLike) -> NDArray[np.float64]:
        """The inverse of `counts`, up to twice the force that a part is rated for.

        >>> Fsr().corner_n(Fsr().counts([0.0, 0.5, 100.0, 1000.0])).round(3)
        array([0.e+00, 5.e-01, 1.e+02, 1.e+03])
        """
        force = np.concatenate([[0.0], np.geomspace(1e-4, 2.0 * RATED_N, 16384)]) / self.share
        return np.interp(np.asarray(counts, dtype=np.float64), self.counts(force), force)


FSR_RANGES = {
    "resistance_ohm_n": (1.0, 1e7),
    "series_ohm": (0.0, 1e6),
    "soft_start_n": (0.0, 10.0),
    "exponent": (0.5, 1.5),
    "divider_ohm": (1.0, 1e7),
    "share": (1e-4, 1.0),
    "spread": (0.0, 0.9),
    "hysteresis": (0.0, 1.0),
    "creep": (0.0, 0.5),
    "noise_counts": (0.0, 1e4),
}
"""The allowed range of each of a sensor's parameters."""

_SHARE, _RESISTANCE, _SERIES, _SOFT, _BEND, _DIVIDER, _HYSTERESIS, _NOISE, _AT_ONCE, _EACH = range(10)
_LAG = 10


def state_size() -> int:
    """Numbers of a part's memory: plays, then lags."""
    return _PLAYS + _LAGS


def tuning_size() -> int:
    """Numbers of a part's tuning."""
    return _LAG + _LAGS


def tune(t: NDArray[np.float64], part: Fsr, rate_hz: float) -> None:
    """Write the coefficients of one part, read `rate_hz` times a second, into `t` (tuning_size(),)."""
    lags_s = _FIRST_LAG_S * 10.0 ** (np.arange(_LAGS) / _LAGS_A_DECADE)
    each = part.creep / _LAGS_A_DECADE
    t[:_LAG] = (
        part.share,
        part.resistance_ohm_n,
        part.series_ohm,
        part.soft_start_n,
        part.exponent - 1.0,
        part.divider_ohm,
        part.hysteresis,
        part.noise_counts,
        1.0 + each * float(np.expm1(-_KEPT_S / lags_s).sum()),
        each,
    )
    t[_LAG:] = -np.expm1(-1.0 / (rate_hz * lags_s))


@kernel
def settle(s, t, corner_n):
    """Put the memory where it is once `corner_n` newtons have risen on the corner and rested for ever."""
    force = max(corner_n, 0.0) * t[_SHARE]
    for i in range(len(s)):
        s[i] = force


@kernel
def sense(s, t, corner_n, counts, key, sample, n):
    """Readings (n,), whole numbers 0 to 65535, of the forces (n,) on one corner, newtons; below 0 counts as 0.

    `s` is the memory, `t` the tuning, `sample` the absolute number of the first reading, which with `key` decides the
    noise: the readings do not depend on how they are cut into calls.
    """
    for i in range(n):
        force = max(corner_n[i], 0.0) * t[_SHARE]
        felt = 0.0
        for k in range(_PLAYS):
            width = 2.0 * t[_HYSTERESIS] * (k + 0.5) / _PLAYS
            s[k] = min(max(s[k], force), (1.0 + width) * force)
            felt += s[k] / _PLAYS
        crept = t[_AT_ONCE] * felt
        for k in range(_LAGS):
            s[_PLAYS + k] += t[_LAG + k] * (felt - s[_PLAYS + k])
            crept += t[_EACH] * s[_PLAYS + k]
        reading = FULL_COUNTS * t[_DIVIDER] / (t[_DIVIDER] + _resistance(crept, t))
        if t[_NOISE] > 0.0:
            reading += t[_NOISE] * normal(key, sample + i)
        counts[i] = min(max(math.floor(reading + 0.5), 0.0), FULL_COUNTS)


@kernel
def sense_tile(s, t, keys, corners_n, counts, sample, n):
    """`sense` for the four sensors of a tile: forces and counts (n, 4), memories and tunings one a row, keys (4,)."""
    for sensor in range(4):
        sense(s[sensor], t[sensor], corners_n[:, sensor], counts[:, sensor], keys[sensor], sample, n)


@kernel
def _resistance(force, t):
    if force <= 0.0:
        return math.inf
    effective = force * force / (force + t[_SOFT]) * (force / _BEND_N) ** t[_BEND]
    return t[_RESISTANCE] / effective + t[_SERIES]


@kernel
def _resistances(force, t):
    out = np.empty_like(force)
    for i in range(force.size):
        out.ravel()[i] = _resistance(force.ravel()[i], t)
    return out
