"""Fit of a contact centroid's correction: gains or bends of the sensors, then a displacement of low order."""

import numpy as np
from msgspec.structs import replace

from underfoot.errors import require
from underfoot.floor.centroid_correction import CentroidCorrection, nonlinear_terms
from underfoot.kernels import Floats

FORMS = (
    ("none", "", 0),
    ("gains", "gains", 0),
    ("affine", "", 1),
    ("gains and affine", "gains", 1),
    ("gains and bilinear", "gains", 2),
    ("gains and quadratic", "gains", 3),
    ("gains and cubic", "gains", 4),
    ("bends and affine", "bends", 1),
    ("bends and quadratic", "bends", 3),
    ("bends and cubic", "bends", 4),
)
"""Models of a correction, simplest first: name, sensor parameters, and order of the displacement."""
BENDS = (1.0 / 75.0, 0.1)
"""Forces at which a sensor's curve may bend, as shares of the largest load."""
_SCALE_M = 0.1
_POWERS = {
    0: (),
    1: ((0, 0), (1, 0), (0, 1)),
    2: ((0, 0), (1, 0), (0, 1), (1, 1)),
    3: ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)),
    4: ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)),
}
_SENSOR_PARAMETERS = {"": 0, "gains": 4, "bends": 4 * (2 + len(BENDS))}
_GAIN_SPREAD = 0.25
"""Prior standard deviation of the gains between sensors."""
_STIFFNESS = 0.0075
"""Regularisation of gains and bends, relative to the RMS distance of the sensors from the centre."""


def parameter_count(sensed: str, order: int) -> int:
    """Return how many parameters a model fits: of the sensors, and of both components of the displacement.

    >>> parameter_count("gains", 1), parameter_count("bends", 4)
    (10, 36)
    """
    return 2 * len(_POWERS[order]) + _SENSOR_PARAMETERS[sensed]


def centroid(forces_n: Floats, sensors_m: Floats) -> Floats:
    """Return plain centroids (n, 2) of corner forces (n, 4): equation 5.3, tared."""
    forces_n, sensors_m = np.asarray(forces_n, dtype=np.float64), np.asarray(sensors_m, dtype=np.float64)
    require(sensors_m.shape == (4, 2), "sensors_m", sensors_m.shape, "shape (4, 2)")
    require(forces_n.shape[-1:] == (4,), "forces_n", forces_n.shape, "shape (n, 4)")
    return np.asarray((forces_n @ sensors_m) / forces_n.sum(axis=-1, keepdims=True))


def fit_correction(
    forces_n: Floats, at_m: Floats, sensors_m: Floats, sensed: str, order: int, bends_n: tuple[float, ...] = ()
) -> CentroidCorrection:
    """Fit the correction of one model (`FORMS`) by least squares, from corner forces (n, 4) of loads at (n, 2).

    `sensed` is "gains", whose mean is 1, "bends" for gains and bends at `bends_n`, or "" for neither; `order` selects
    the displacement.

    >>> sensors = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    >>> at = np.array([[0.05, 0.02], [-0.04, 0.06], [-0.07, -0.03], [0.08, -0.08], [0.0, 0.0]])
    >>> true = 25.0 * (1 + 10 * at @ sensors.T * 10 + at.prod(1, keepdims=True) * 100 * sensors.prod(1) * 100)
    >>> part = fit_correction(true / [1.1, 0.9, 1.0, 1.0], at, sensors, "gains", 0)
    >>> np.round(part.gains, 3)
    array([1.1, 0.9, 1. , 1. ])
    """
    gains: Floats = np.ones(4)
    bends: Floats = np.empty((0, 0))
    if sensed == "gains":
        gains = _fit_gains(forces_n, at_m, sensors_m)
    elif sensed == "bends":
        gains, bends = _fit_bends(forces_n, at_m, sensors_m, bends_n)
    one, two, three, four = (float(gain) for gain in gains)
    weighted = CentroidCorrection(
        gains=(one, two, three, four),
        nonlinearity_scales_n=bends_n if bends.size else (),
        nonlinearity=tuple(tuple(float(bend) for bend in row) for row in bends),
    )
    powers = _POWERS[order]
    if not powers:
        return weighted
    seemed = centroid(weighted.linearised(forces_n), sensors_m)
    rows = np.linalg.lstsq(_terms(seemed, powers), at_m - seemed, rcond=1e-9)[0]
    return replace(
        weighted,
        powers=powers,
        displacement_m=tuple((float(x), float(y)) for x, y in rows),
        scale_m=_SCALE_M,
        area_m=convex_hull(seemed),
    )


def convex_hull(points_m: Floats) -> tuple[tuple[float, float], ...]:
    """Return the corners of the convex hull of points (n, 2), counter-clockwise.

    >>> convex_hull(np.array([[0, 0], [2, 0], [1, 0.5], [2, 2], [0, 2.0]]))
    ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    """
    points = sorted({(float(x), float(y)) for x, y in points_m})

    def chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for x, y in ordered:
            while len(found) > 1 and _turn(found[-2], found[-1], (x, y)) <= 0.0:
                found.pop()
            found.append((x, y))
        return found[:-1]

    return tuple(chain(points) + chain(points[::-1]))


def _fit_gains(forces_n: Floats, at_m: Floats, sensors_m: Floats) -> Floats:
    """Fit gains that bring the centroids to the true positions; the larger the residual, the closer they stay to 1."""
    total = forces_n.sum(axis=1)
    pull = forces_n[:, :, None] * (sensors_m - at_m[:, None, :]) / total[:, None, None]
    rows = np.concatenate([pull[:, :, 0], pull[:, :, 1]])
    sought = -pull.sum(axis=1).T.ravel()
    stiff, change = 1e-4, np.zeros(4)
    for _ in range(2):
        terms = np.concatenate([rows, stiff * np.eye(4), np.ones((1, 4))])
        change = np.linalg.lstsq(terms, np.concatenate([sought, np.zeros(5)]), rcond=None)[0]
        stiff = max(1e-4, float(np.sqrt(np.mean((rows @ change - sought) ** 2))) / _GAIN_SPREAD)
    return np.asarray(np.clip(1.0 + change, 0.2, 5.0))


def _fit_bends(forces_n: Floats, at_m: Floats, sensors_m: Floats, bends_n: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Fit gains and bends of the sensors' curves, together with an affine displacement.

    The displacement keeps misplaced sensors from being taken for bent ones.
    """
    total = forces_n.sum(axis=1)
    learned = np.concatenate([forces_n[:, :, None], nonlinear_terms(forces_n, bends_n)], axis=2)
    arms = (sensors_m - at_m[:, None, :]) / total[:, None, None]
    n, each = len(at_m), learned.shape[2]
    plane = _terms(at_m, _POWERS[1])
    terms, missing = [], []
    for axis in range(2):
        pull = (learned * arms[:, :, axis, None]).reshape(n, 4 * each)
        terms.append(np.hstack([pull, *(plane if axis == other else 0.0 * plane for other in range(2))]))
        missing.append(-(forces_n * arms[:, :, axis]).sum(axis=1))
    count = terms[0].shape[1]
    stiff = _STIFFNESS * float(np.abs(sensors_m - sensors_m.mean(axis=0)).max()) * np.sqrt(n) * np.eye(count)
    stiff[4 * each :] *= 1e-3
    mean = np.zeros((1, count))
    mean[0, : 4 * each : each] = 1.0
    found = np.linalg.lstsq(
        np.concatenate([*terms, stiff, mean]), np.concatenate([*missing, np.zeros(count + 1)]), rcond=None
    )[0]
    weights = found[: 4 * each].reshape(4, each)
    return np.asarray(np.clip(1.0 + weights[:, 0], 0.2, 5.0)), np.asarray(weights[:, 1:])


def _terms(places_m: Floats, powers: tuple[tuple[int, int], ...]) -> Floats:
    """Return monomials of positions (n, 2), in units of `_SCALE_M`: (n, powers)."""
    return np.stack([np.prod((places_m / _SCALE_M) ** power, axis=1) for power in powers], axis=1)


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Return a number above 0 if the path from a over b to c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
