"""Curve families that map a force sensing resistor's reading to newtons, and their fits.

Each fit takes `x`, the reading above that of the unloaded sensor (0 or more, shape (n,)), the force `f` in newtons and
a weight `w`, and returns a `FittedCurve` through 0: knots with slopes, cubic between; or None where the data do not
determine one. Errors are squared in newtons, as the curve is used: a log-log fit to logarithms is best for the lightest
touch and errs where forces are large.
"""

from collections.abc import Callable

import numpy as np
from msgspec import Struct

from underfoot.arguments import require_alike
from underfoot.kernels import Floats
from underfoot.models.golden_section import least_at

_KNOTS = 49
_COARSE = 4


class FittedCurve(Struct, frozen=True):
    """Fitted curve: its family, its constants, and knots `x`, `f` with slopes, all rising from (0, 0)."""

    family: str
    parameters: dict[str, float]
    x: Floats
    f: Floats
    slope: Floats

    def force(self, x: Floats) -> Floats:
        """Return newtons at readings `x` above that of the unloaded sensor; linear beyond the knots."""
        return cubic_hermite(self.x, self.f, self.slope, x)


def cubic_hermite(x: Floats, y: Floats, slope: Floats, at: Floats) -> Floats:
    """Evaluate the cubic Hermite spline through knots (`x`, `y`) with slopes at points of any shape. NaN stays NaN.

    It is extrapolated along the first and the last slope.

    >>> cubic_hermite(np.array([0.0, 1.0]), np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.array([-1.0, 0.5, 2.0]))
    array([0.  , 0.25, 3.  ])
    """
    require_alike(x=x, y=y, slope=slope)
    k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, x.size - 2)
    width = x[k + 1] - x[k]
    t = np.clip((at - x[k]) / width, 0.0, 1.0)
    s = 1.0 - t
    inside = s * s * (1.0 + 2.0 * t) * y[k] + t * t * (3.0 - 2.0 * t) * y[k + 1]
    inside = inside + width * t * s * (s * slope[k] - t * slope[k + 1])
    below, above = np.minimum(at - x[0], 0.0), np.maximum(at - x[-1], 0.0)
    return np.asarray(inside + below * slope[0] + above * slope[-1])


def straight(x: Floats, f: Floats, w: Floats) -> FittedCurve:
    """Fit F = a x to readings `x`, forces `f` in N and weights `w`, each (n,), as the first approximation.

    >>> x = np.linspace(0.0, 100.0, 11)
    >>> straight(x, 0.3 * x, np.ones(11)).parameters
    {'factor': 0.3}
    """
    require_alike(x=x, f=f, w=w)
    a = max(float((w * f * x).sum() / max((w * x * x).sum(), 1e-300)), 1e-12)
    ends = np.array([0.0, float(x.max())])
    return FittedCurve("straight", {"factor": a}, ends, a * ends, np.full(2, a))


def power(x: Floats, f: Floats, w: Floats) -> FittedCurve | None:
    """Fit F = a x^b, a straight line in log-log, weighted so that errors count in newtons.

    >>> x = np.linspace(0.0, 1000.0, 50)
    >>> curve = power(x, 1e-3 * x**1.5, np.ones(50))
    >>> round(curve.parameters["exponent"], 6)
    1.5
    """
    require_alike(x=x, f=f, w=w)
    good = (x > 0.0) & (f > 0.0)
    if np.count_nonzero(good) < 2 or np.ptp(x[good]) == 0.0:
        return None
    logs, weight = np.log(x[good]), np.sqrt(w[good]) * f[good]
    slopes = np.stack([np.ones_like(logs), logs], axis=1)
    (log_a, b), *_ = np.linalg.lstsq(slopes * weight[:, None], np.log(f[good]) * weight, rcond=None)
    a, b = float(np.exp(log_a)), float(np.clip(b, 0.2, 8.0))
    return _sampled("power", {"factor": a, "exponent": b}, lambda v: a * v**b, float(x.max()))


def rational(x: Floats, f: Floats, w: Floats) -> FittedCurve | None:
    """Fit F = a x / (1 - x / c): conductance proportional to force, read across a divider. c is above all readings.

    >>> x = np.linspace(0.0, 900.0, 50)
    >>> curve = rational(x, 0.01 * x / (1.0 - x / 1200.0), np.ones(50))
    >>> round(curve.parameters["ceiling"])
    1200
    """
    require_alike(x=x, f=f, w=w)
    top = float(x.max())

    def shape(s: float) -> tuple[dict[str, float], Callable[[Floats], Floats]]:
        return {"ceiling": top / max(s, 1e-9)}, lambda v: v / (1.0 - v / top * s)

    # 1/c = s / top: s from 0 (linear) towards 1 (the ceiling is just above the largest reading).
    return _best_of("rational", x, f, w, 1.0 - np.geomspace(1.0, 1e-3, 60), shape)


def exponential(x: Floats, f: Floats, w: Floats) -> FittedCurve | None:
    """Fit F = a (exp(x / c) - 1): a reading proportional to the logarithm of the force.

    >>> x = np.linspace(0.0, 900.0, 50)
    >>> curve = exponential(x, 0.5 * np.expm1(x / 250.0), np.ones(50))
    >>> round(curve.parameters["scale"])
    250
    """
    require_alike(x=x, f=f, w=w)
    top = float(x.max())

    def shape(s: float) -> tuple[dict[str, float], Callable[[Floats], Floats]]:
        return {"scale": top / s}, lambda v: np.expm1(v / top * s)

    return _best_of("exponential", x, f, w, np.geomspace(0.05, 14.0, 80), shape)


def resistor(x: Floats, f: Floats, w: Floats, conductance: Callable[[Floats], Floats]) -> FittedCurve | None:
    """Fit R = Rs / F + R0 for a known divider: `conductance` gives siemens above those of the unloaded sensor.

    >>> x = np.linspace(1.0, 900.0, 50)
    >>> siemens = lambda v: v / (1e4 * (1000.0 - v))
    >>> curve = resistor(x, 3e4 / (1.0 / siemens(x) - 200.0), np.ones(50), siemens)
    >>> round(curve.parameters["rs_ohm_n"]), round(curve.parameters["r0_ohm"])
    (30000, 200)
    """
    require_alike(x=x, f=f, w=w)
    good = (x > 0.0) & (f > 0.0)
    if np.count_nonzero(good) < 2:
        return None
    g = conductance(x[good])
    # Rs G + R0 F G = F is linear in both constants, with errors in newtons.
    terms, weight = np.stack([g, f[good] * g], axis=1), np.sqrt(w[good])
    (rs, r0), *_ = np.linalg.lstsq(terms * weight[:, None], f[good] * weight, rcond=None)
    r0 = max(float(r0), 0.0)
    if r0 == 0.0:
        rs = float((weight**2 * g * f[good]).sum() / (weight**2 * g * g).sum())
    top = float(x.max())
    if rs <= 0.0 or r0 * float(conductance(np.array([top]))[0]) >= 0.98:
        return None

    def force(v: Floats) -> Floats:
        siemens = conductance(v)
        return np.asarray(rs * siemens / (1.0 - r0 * siemens))

    return _sampled("resistor", {"rs_ohm_n": float(rs), "r0_ohm": r0}, force, top)


def spline(x: Floats, f: Floats, w: Floats, pieces: int) -> FittedCurve | None:
    """Fit a monotone cubic spline of `pieces` pieces: I-splines with non-negative weights (Ramsay 1988).

    Pieces are short in newtons where forces are small: a centroid is made of ratios of forces, and a sensor starts
    softly. It is monotone by construction.

    >>> x = np.linspace(0.0, 1.0, 200)
    >>> curve = spline(x, 10.0 * x**3, np.ones(200), 6)
    >>> bool(np.abs(curve.force(x) - 10.0 * x**3).max() < 0.02)
    True
    """
    require_alike(x=x, f=f, w=w)
    from scipy.interpolate import BSpline
    from scipy.optimize import nnls

    x, f, w = x[w > 0.0], f[w > 0.0], w[w > 0.0]
    if x.size < 3:
        return None
    knots = _knots(x, f, w, pieces)
    if knots.size < 3:
        return None
    # Integrals of the quadratic B-splines, each rising from 0 to 1.
    padded = np.concatenate([[knots[0]] * 3, knots, [knots[-1]] * 3])
    count = padded.size - 4
    basis = BSpline(padded, np.tri(count, count - 1, -1), 3)
    terms = basis(np.clip(x, knots[0], knots[-1]))
    # A little smoothing, so that a weight without readings follows its neighbours.
    smoothing = np.diff(np.eye(count - 1), 2, axis=0) * 1e-3 * np.sqrt(w.sum() / max(1, count - 3))
    left = np.concatenate([terms * np.sqrt(w)[:, None], smoothing])
    right = np.concatenate([f * np.sqrt(w), np.zeros(len(smoothing))])
    weights, _ = nnls(left, right)
    y = sum(c * one for c, one in zip(weights, basis(knots).T, strict=True))
    slope = sum(c * one for c, one in zip(weights, basis.derivative()(knots).T, strict=True))
    y, slope = np.maximum.accumulate(np.asarray(y)), np.maximum(np.asarray(slope), 0.0)
    return FittedCurve("spline", {"pieces": float(knots.size - 1)}, knots, y, slope)


def rising(values: Floats, weights: Floats) -> Floats:
    """Return the nearest non-decreasing sequence: isotonic regression by weighted least squares.

    >>> rising(np.array([1.0, 3.0, 2.0, 4.0]), np.ones(4))
    array([1. , 2.5, 2.5, 4. ])
    """
    require_alike(values=values, weights=weights)
    from scipy.optimize import isotonic_regression

    return np.asarray(isotonic_regression(values, weights=weights).x)


def _best_of(
    family: str,
    x: Floats,
    f: Floats,
    w: Floats,
    shapes: Floats,
    made: Callable[[float], tuple[dict[str, float], Callable[[Floats], Floats]]],
) -> FittedCurve | None:
    """Return the best F = a h(x) over one shape constant: a is linear, so a scan and one golden-section search do.

    The scan is of every fourth of `shapes` and the last, and then of those around the best one.
    """

    def error(s: float) -> tuple[float, float]:
        h = made(s)[1](x)
        weighted = w * h
        square = float(weighted @ h)
        a = float(weighted @ f) / square if square > 0.0 else 0.0
        left = f - a * h
        return float((w * left) @ left), a

    coarse = np.append(np.arange(0, shapes.size - 1, _COARSE), shapes.size - 1)
    near = coarse[np.argmin([error(float(one))[0] for one in shapes[coarse]])]
    s = least_at(lambda s: error(s)[0], shapes[max(near - _COARSE, 0) : near + _COARSE + 1], 40)
    _, a = error(s)
    if a <= 0.0:
        return None
    constants, h = made(s)
    return _sampled(family, {"factor": a, **constants}, lambda v: a * h(v), float(x.max()))


def _sampled(family: str, parameters: dict[str, float], force: Callable[[Floats], Floats], top: float) -> FittedCurve:
    """Sample a closed-form curve at knots, dense where it bends: evenly in force and reading together."""
    fine = top * np.linspace(0.0, 1.0, 4001) ** 2
    y = force(fine)
    length = fine / fine[-1] + y / y[-1]
    at = np.interp(np.linspace(0.0, 1.0, _KNOTS) ** 1.5 * length[-1], length, fine)
    f, step = force(at), 1e-6 * top
    slope = (force(at + step) - force(np.maximum(at - step, 0.0))) / (at + step - np.maximum(at - step, 0.0))
    # A cubic through rising points is monotone if no slope exceeds three times its secants (Fritsch and Carlson 1980).
    secants = np.diff(f) / np.diff(at)
    most = 3.0 * np.minimum(np.r_[secants[0], secants], np.r_[secants, secants[-1]])
    return FittedCurve(family, parameters, at, f, np.clip(slope, 0.0, most))


def _knots(x: Floats, f: Floats, w: Floats, pieces: int) -> Floats:
    """Return readings at which a smoothed, rising curve reaches equal steps of force, and half the first step."""
    order = np.argsort(x, kind="stable")
    curve = rising(f[order], w[order])
    levels = curve[-1] * np.linspace(0.0, 1.0, pieces + 1) ** 2
    places = np.interp(levels[1:-1], curve + 1e-9 * np.arange(curve.size), x[order])
    top = float(x.max())
    inside = places[(places > 0.002 * top) & (places < 0.998 * top)]
    kept = [0.0]
    for place in inside:
        if place - kept[-1] > 0.002 * top:
            kept.append(float(place))
    return np.array([*kept, top])
