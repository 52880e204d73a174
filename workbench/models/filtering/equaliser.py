"""Equaliser design: an IIR filter that flattens the measured magnitude response of a tile (thesis 4.5.2).

The filter is a cascade of second-order sections, each a ratio of two quadratics

    q(s) = s^2 + 2 zeta w s + w^2,   s = (1 - z^-1) / (1 + z^-1)   (bilinear)

The free parameters are ln w and ln zeta of zeros and poles, and one gain. For all their values the filter is stable and
minimum-phase, and the derivatives of its log magnitude are closed forms. Damped Gauss-Newton steps minimise the p-norm
of the error in decibels, with p raised in stages (the least p-th norm of thesis 4.5.2). Sections are added one by one
where they help most, so that a higher order is never worse than a lower one.
"""

import math
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats

BAND_HZ = (50.0, 750.0)
"""Band to flatten (thesis 4.5.2)."""
MOST_ORDER = 24
"""Highest filter order."""
MOST_GAIN_DB = 24.0
"""Largest lift, relative to the level of the band, of a notch."""
OUTER_GAIN_DB = 3.0
"""Gain from an octave outside the band on, where nothing is measured or felt, above which it counts as error."""
LEAST_WIDTH_HZ = 2.0
"""Smallest bandwidth of a pole: its radius is at most exp(-pi width / rate)."""
EDGE_LOW, EDGE_HIGH = 1.2, 750.0 / 700.0
"""Factors from the band's ends (60 to 700 Hz of 50 to 750) outside which errors weigh less."""

_DB = 20.0 / math.log(10.0)
_STAGES = (2, 4, 8, 16)
_EDGE_WEIGHT, _OUTER_WEIGHT = 0.3, 1.0
_POINTS, _OUTER_POINTS, _PARTS = 240, 40, 4
_NOISE_DB, _MOST_SMOOTHED = 0.2, 16
_LEAST_ZETA, _MOST_ZETA = 0.004, 3.0
_LEAST_IN_BAND = 4
_KEPT = 48
"""Orders of curves that are kept: a wizard designs for one curve several times, and tests in every order."""


def design(
    frequencies_hz: ArrayLike,
    magnitude: ArrayLike,
    rate_hz: float,
    order: int = 14,
    band_hz: tuple[float, float] = BAND_HZ,
) -> Floats:
    """Return the equaliser of a response as second-order sections [b0, b1, b2, 1, a1, a2], shape (order / 2, 6).

    `magnitude` (linear, any scale, modulus of complex values) at `frequencies_hz`, in any order, must cover `band_hz`;
    noise is averaged over up to a quarter of an octave. Response times equaliser is flat over the band at the level of
    the response there, the mean of its decibels over log frequency; a point more than `MOST_GAIN_DB` below that is
    lifted by that amount only. Outside the band the gain falls within an octave to 3 dB, or little more where the order
    is high enough for the curve. `order` is even, 2 to 24; all poles and zeros lie within the unit circle. Raises
    `BadValue`.

    >>> f = np.geomspace(20.0, 2000.0, 400)
    >>> resonance = 1.0 / np.abs(1.0 - (f / 300.0) ** 2 + 0.2j * f / 300.0)
    >>> sections = design(f, resonance, 48000.0, 6)
    >>> flat = resonance * np.abs(gain(sections, f, 48000.0))
    >>> inside = (f > 60.0) & (f < 700.0)
    >>> sections.shape, bool(np.ptp(20.0 * np.log10(flat[inside])) < 0.3)
    ((3, 6), True)
    """
    low, high = _band(band_hz, rate_hz)
    require(
        isinstance(order, int | np.integer) and order % 2 == 0 and 2 <= order <= MOST_ORDER,
        "order",
        order,
        f"even numbers 2 to {MOST_ORDER}: a section is of second order",
    )
    wanted = _Wanted(*_curve(frequencies_hz, magnitude, low, high), rate_hz)
    return _sections(_grown(wanted, int(order) // 2)[1])


def gain(sections: ArrayLike, frequencies_hz: ArrayLike, rate_hz: float) -> NDArray[np.complex128]:
    """Return the complex gain of a cascade of second-order sections (n, 6) at frequencies in Hz, in their shape.

    >>> gain([[0.5, 0.0, 0.0, 1.0, 0.0, 0.0]], [100.0], 48000.0)
    array([0.5+0.j])
    """
    z = np.exp(-2j * math.pi * np.asarray(frequencies_hz, dtype=np.float64) / rate_hz)
    total = np.ones(z.shape, dtype=np.complex128)
    for b0, b1, b2, a0, a1, a2 in np.asarray(sections, dtype=np.float64).reshape(-1, 6):
        total *= (b0 + z * (b1 + z * b2)) / (a0 + z * (a1 + z * a2))
    return total


def level(frequencies_hz: ArrayLike, magnitude: ArrayLike) -> float:
    """Return the level of a response in `BAND_HZ`, on its own scale: the mean of its decibels over log frequency.

    >>> round(level([10.0, 100.0, 1000.0], [2.0, 2.0, 2.0]), 9)
    2.0
    """
    require(len(np.ravel(frequencies_hz)) >= 2, "frequencies_hz", frequencies_hz, "at least two")
    return math.exp(float(_curve(frequencies_hz, magnitude, *BAND_HZ, least=0)[1].mean()))


def _band(band_hz: tuple[float, float], rate_hz: float) -> tuple[float, float]:
    require(rate_hz > 0.0, "rate_hz", rate_hz, "above 0")
    require(len(band_hz) == 2, "band_hz", band_hz, "its lowest and highest frequency")
    low, high = float(band_hz[0]), float(band_hz[1])
    require(low >= 1.0 and 1.2 * low <= high, "band_hz", band_hz, "from at least 1 Hz up to at least 1.2 times that")
    require(high <= 0.45 * rate_hz, "band_hz", band_hz, f"up to 0.45 of the rate, {0.45 * rate_hz:g} Hz")
    return low, high


def _curve(
    frequencies_hz: ArrayLike, magnitude: ArrayLike, low: float, high: float, least: int = _LEAST_IN_BAND
) -> tuple[Floats, Floats]:
    """Return frequencies in equal log steps over the band, and the checked log magnitude there."""
    f, given = np.asarray(frequencies_hz, dtype=np.float64).ravel(), np.asarray(magnitude).ravel()
    require(given.size == f.size, "magnitude", given.size, f"as many as frequencies_hz, {f.size}")
    require(np.isrealobj(given) is False or bool(np.all(given >= 0.0)), "magnitude", magnitude, "numbers, at least 0")
    m = np.abs(given).astype(np.float64)
    require(bool(np.all(np.isfinite(m))) and bool(np.all(np.isfinite(f))), "magnitude", magnitude, "finite numbers")
    order = np.argsort(f, kind="stable")
    f, m = f[order], m[order]
    inside = (f >= low) & (f <= high)
    covered = f.size > 1 and f[0] <= 1.02 * low and f[-1] >= high / 1.02
    if not covered or inside.sum() < least:
        reach = f"{f[0]:g} to {f[-1]:g} Hz, {int(inside.sum())} of them inside" if f.size else "none"
        require(False, "frequencies_hz", reach, f"{low:g} to {high:g} Hz covered by at least {least} points")
    largest = float(m[inside].max()) if inside.any() else float(m.max())
    require(largest > 0.0, "magnitude", magnitude, "above 0 somewhere in the band")
    use = (f > 0.0) & ((f > 0.5 * low) & (f < 2.0 * high))
    f, m = np.log(f[use]), np.log(np.maximum(m[use] / largest, 1e-9)) + math.log(largest)
    grid = np.linspace(math.log(low), math.log(high), _POINTS)
    f, place = np.unique(f, return_inverse=True)
    m = np.bincount(place, m) / np.bincount(place)
    cell = np.rint((f - grid[0]) / (grid[1] - grid[0])).astype(np.int64)
    kept = (cell >= 0) & (cell < _POINTS)
    count = np.bincount(cell[kept], minlength=_POINTS)
    total = np.bincount(cell[kept], m[kept], minlength=_POINTS)
    # Cells with points take their mean, empty ones are interpolated.
    return np.exp(grid), _smoothed(np.where(count > 1, total / np.maximum(count, 1), np.interp(grid, f, m)))


def _smoothed(curve: Floats) -> Floats:
    """Return a curve without its noise: averaged over as many cells as its roughness requires."""
    noise = float(np.median(np.abs(np.diff(curve, 2)))) / (0.6745 * math.sqrt(6.0))
    cells = min(math.ceil((noise * _DB / _NOISE_DB) ** 2), _MOST_SMOOTHED)
    if cells < 2:
        return curve
    window = np.hanning(2 * cells + 1)[1:-1]
    return np.asarray(np.convolve(curve, window, "same") / np.convolve(np.ones(curve.size), window, "same"))


class _Wanted:
    """Target of the log gain: to be met in the band, an upper limit outside."""

    def __init__(self, band: Floats, log_magnitude: Floats, rate_hz: float) -> None:
        low, high = float(band[0]), float(band[-1])
        self._given = band.tobytes(), log_magnitude.tobytes(), rate_hz
        inverse = np.minimum(log_magnitude.mean() - log_magnitude, MOST_GAIN_DB / _DB)
        # Points are dense at the band's ends: otherwise a narrow peak just outside would fit a notch there.
        share = np.linspace(0.0, 1.0, _OUTER_POINTS + 1)[1:] ** 2
        below = low * (1.0 / 16.0) ** share
        above = high * (0.49 * rate_hz / high) ** share
        least = OUTER_GAIN_DB / _DB
        at_low, at_high = (max(float(inverse[end].max()), least) for end in (band < 1.1 * low, band > high / 1.1))
        falling = np.concatenate(
            [
                np.maximum(at_low * (1.0 - np.log2(low / below)), least),
                np.maximum(at_high * (1.0 - np.log2(above / high)), least),
            ]
        )
        self.logarithm = np.concatenate([inverse, falling])
        inner = (band >= EDGE_LOW * low) & (band <= high / EDGE_HIGH)
        self.weight = np.concatenate([np.where(inner, 1.0, _EDGE_WEIGHT), np.full(falling.size, _OUTER_WEIGHT)])
        self.at_most = np.arange(self.logarithm.size) >= band.size
        self.squared = np.tan(math.pi * np.concatenate([band, below, above]) / rate_hz) ** 2
        self.lowest = math.log(math.tan(math.pi * low / 8.0 / rate_hz))
        self.highest = math.log(math.tan(math.pi * min(8.0 * high, 0.45 * rate_hz) / rate_hz))
        self.narrowest = math.tan(0.5 * math.pi * LEAST_WIDTH_HZ / rate_hz)
        self.atoms = self._atoms(low, high, rate_hz)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Wanted) and self._given == other._given

    def __hash__(self) -> int:
        return hash(self._given)

    def _atoms(self, low: float, high: float, rate_hz: float) -> tuple[Floats, Floats]:
        """Return candidate sections (ln w, ln zeta), and the derivatives of the log gain by both and the gain."""
        f = np.geomspace(0.5 * low, min(1.5 * high, 0.45 * rate_hz), 60)
        w, zeta = np.meshgrid(np.log(np.tan(math.pi * f / rate_hz)), np.log([0.02, 0.08, 0.3, 1.0]))
        places = self.held(np.stack([w.ravel(), zeta.ravel()], axis=1))
        by_w, by_zeta = _Quadratics(places, self.squared).slopes()
        return places, np.stack([by_w, by_zeta, np.ones_like(by_w)], axis=1)

    def held(self, places: Floats) -> Floats:
        """Clip (ln w, ln zeta), shape (n, 2), to the allowed region."""
        w = np.clip(places[:, 0], self.lowest, self.highest)
        narrowest = np.maximum(_LEAST_ZETA, self.narrowest * (np.exp(w) + np.exp(-w)))
        return np.stack([w, np.clip(places[:, 1], np.log(narrowest), math.log(_MOST_ZETA))], axis=1)

    def error(self, found: Floats) -> "_Error":
        """Return the weighted error of parameters `found`."""
        quadratics = _Quadratics(found[:-1].reshape(-1, 2), self.squared)
        power, zeros = quadratics.power, len(quadratics.power) // 2
        logarithm = 0.5 * np.log(power[:zeros].prod(axis=0) / power[zeros:].prod(axis=0))
        error = (logarithm + found[-1] - self.logarithm) * self.weight
        counts = ~self.at_most | (error > 0.0)
        return _Error(np.where(counts, error, 0.0), self.weight * counts, quadratics)


class _Error:
    """Weighted error of some parameters, (points,)."""

    def __init__(self, values: Floats, weight: Floats, quadratics: "_Quadratics") -> None:
        self.values, self._weight, self._quadratics = values, weight, quadratics
        self._sizes = np.abs(values)
        self.largest = float(self._sizes.max())

    def norm(self, p: int) -> float:
        """Return the p-norm."""
        return self.largest * float(np.mean((self._sizes / self.largest) ** p)) ** (1.0 / p) if self.largest else 0.0

    def shares(self) -> Floats:
        """Return the sizes of the errors as shares of the largest."""
        return self._sizes / self.largest

    def slopes(self) -> Floats:
        """Return the derivatives by the parameters, (parameters, points)."""
        by_w, by_zeta = self._quadratics.slopes()
        slopes = np.ones((2 * len(by_w) + 1, self.values.size))
        slopes[0:-1:2], slopes[1:-1:2] = by_w, by_zeta
        slopes[len(by_w) : -1] *= -1.0
        slopes *= self._weight
        return slopes


class _Quadratics:
    """Squared moduli of quadratics (n, 2) at squared frequencies (k,): `power`, (n, k)."""

    def __init__(self, places: Floats, squared: Floats) -> None:
        self._w2 = np.exp(2.0 * places[:, :1])
        self._apart = self._w2 - squared
        self._damped = 4.0 * np.exp(2.0 * places[:, 1:]) * self._w2 * squared
        self.power = self._apart * self._apart + self._damped

    def slopes(self) -> tuple[Floats, Floats]:
        """Return the derivatives of ln |q| by ln w and by ln zeta, (n, k) each: only for a step that is taken."""
        by_zeta = self._damped / self.power
        return 2.0 * self._w2 * self._apart / self.power + by_zeta, by_zeta


@lru_cache(maxsize=_KEPT)
def _grown(wanted: _Wanted, sections: int) -> tuple[Floats, Floats]:
    """Return parameters with so many sections: zeros (ln w, ln zeta) of each, then poles, then the gain.

    The first have the least mean square, the second are the best.
    """
    if sections == 0:
        return np.zeros(1), np.zeros(1)
    # The mean square gives a smooth descent; its result is refined at higher p. In parallel the best lower order is
    # extended by one section, so that no order is worse than the one before.
    smooth, best = _grown(wanted, sections - 1)
    starts = [_with(smooth, place) for place in _places(wanted, smooth, 3)]
    smooth = min((_refined(wanted, start, 2, 12) for start in starts), key=lambda found: wanted.error(found).norm(2))
    smooth = sharp = _refined(wanted, smooth, 2, 25)
    for p in _STAGES[1:]:
        sharp = _refined(wanted, sharp, p, 15)
    grown = _refined(wanted, _with(best, _places(wanted, best, 1)[0]), _STAGES[-1], 15)
    unchanged = _with(best, wanted.atoms[0][0])
    return smooth, min((sharp, grown, unchanged), key=lambda found: wanted.error(found).largest)


def _with(found: Floats, place: Floats) -> Floats:
    """Add a section whose zeros and poles coincide."""
    half = (found.size - 1) // 2
    return np.concatenate([found[:half], place, found[half:-1], place, found[-1:]])


def _places(wanted: _Wanted, found: Floats, most: int) -> list[Floats]:
    """Return the positions where a further section reduces the squared error most, from the derivatives there."""
    error = wanted.error(found)
    places, atoms = wanted.atoms
    atoms = atoms * error.slopes()[-1]
    square = atoms @ atoms.transpose(0, 2, 1)
    square += 1e-9 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(3)
    toward = atoms @ error.values
    taken = np.sum(toward * np.linalg.solve(square, toward[:, :, None])[:, :, 0], axis=1)
    chosen: list[Floats] = []
    for k in np.argsort(-taken):
        if all(np.abs(places[k] - other).max() > 0.35 for other in chosen):
            chosen.append(places[k])
        if len(chosen) == most:
            break
    return chosen


def _refined(wanted: _Wanted, found: Floats, p: int, steps: int) -> Floats:
    """Minimise the p-norm from `found` by damped Gauss-Newton steps; it never rises."""
    error = wanted.error(found)
    norm, damping = error.norm(p), 1e-2
    for _ in range(steps):
        if norm < 1e-9:
            break
        slopes = error.slopes()
        weighted = slopes * (error.shares() + 1e-12) ** (p - 2)
        square, toward = _products(weighted, slopes), weighted @ error.values
        diagonal = np.diag(square)
        before = norm
        for _ in range(8):
            system = square + np.diag(damping * diagonal + 1e-9 * diagonal.max())
            moved = found - np.linalg.solve(system, toward) / (p - 1)
            moved[:-1] = wanted.held(moved[:-1].reshape(-1, 2)).ravel()
            tried = wanted.error(moved)
            if (least := tried.norm(p)) < norm:
                found, error, norm = moved, tried, least
                damping = max(damping / 5.0, 1e-9)
                break
            damping = min(4.0 * damping, 1e6)
        if norm > 0.995 * before:
            break
    return found


def _products(one: Floats, other: Floats) -> Floats:
    """Return one @ other.T in parts too small for BLAS to use threads, which stall on a busy machine."""
    cuts = np.linspace(0, one.shape[1], _PARTS + 1).astype(int).tolist()
    return np.asarray(np.sum([one[:, a:b] @ other[:, a:b].T for a, b in pairwise(cuts)], axis=0))


def _sections(found: Floats) -> Floats:
    """Convert parameters to second-order sections; the first one carries the gain."""
    w, zeta = np.exp(found[:-1].reshape(-1, 2)).T
    quadratics = np.stack([1.0 + 2.0 * zeta * w + w * w, 2.0 * (w * w - 1.0), 1.0 - 2.0 * zeta * w + w * w], axis=1)
    zeros, poles = np.split(quadratics, 2)
    sections = np.concatenate([zeros, poles], axis=1) / poles[:, :1]
    sections[0, :3] *= math.exp(found[-1])
    return np.ascontiguousarray(sections)
