"""Centroid of the load from corner forces, with the corrections of a centroid calibration."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.floor.curves import require_numbers
from underfoot.kernels import Floats, kernel

_MOST_M = 100.0
"""Largest length in a correction, in metres."""


class CorrectionArrays(NamedTuple):
    """A `CentroidCorrection` as kernels take it."""

    gains: Floats  # (4,)
    nonlinearity_scales_n: Floats  # (scales,)
    nonlinearity: Floats  # (4, 1 + scales); (0, 0) for none
    powers: NDArray[np.int64]  # (terms, 2)
    displacement_m: Floats  # (terms, 2)
    scale_m: float
    area_m: Floats  # (corners, 2)


class CentroidCorrection(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Correction of a centroid: each force is linearised, and the centroid displaced by a polynomial.

    A force is multiplied by its sensor's gain. Where there is `nonlinearity`, a row of it belongs to each sensor: the
    first coefficient is of the force where that is below 0 (a corner that lifts), the others of s (1 - exp(-force / s))
    above 0, for each s of `nonlinearity_scales_n`: what the sensor's curve gets wrong of light loads.

    The rows of `displacement_m` belong to the products x^i y^j of `powers`, x and y in units of `scale_m` about the
    tile's centre. Outside the convex `area_m` of the places that it was fitted to, the displacement is that of the
    nearest point of the area. In a file the nonlinearity is "bends" and its scales "bends_n".
    """

    gains: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    nonlinearity_scales_n: tuple[float, ...] = msgspec.field(default=(), name="bends_n")
    nonlinearity: tuple[tuple[float, ...], ...] = msgspec.field(default=(), name="bends")
    powers: tuple[tuple[int, int], ...] = ()
    displacement_m: tuple[tuple[float, float], ...] = ()
    scale_m: float = 0.1
    area_m: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        require(all(0.0 < gain <= 1e3 for gain in self.gains), "gains", self.gains, "four numbers above 0, up to 1000")
        scales_n, rows = self.nonlinearity_scales_n, self.nonlinearity
        require(all(scale > 0.0 for scale in scales_n), "bends_n", scales_n, "numbers above 0")
        shape = [len(scales_n) + 1] * 4 if rows else []
        require([len(row) for row in rows] == shape, "bends", rows, "four rows, one longer than bends_n")
        count = len(self.powers)
        require(
            len(self.displacement_m) == count, "displacement_m", self.displacement_m, f"{count} rows, as powers has"
        )
        require(all(0 <= i <= 8 for pair in self.powers for i in pair), "powers", self.powers, "whole numbers 0 to 8")
        require(0.001 <= self.scale_m <= _MOST_M, "scale_m", self.scale_m, f"0.001 to {_MOST_M:g}")
        for row in rows:
            require_numbers("bends", row, 1e3)
        for name, points in (("displacement_m", self.displacement_m), ("area_m", self.area_m)):
            for point in points:
                require_numbers(name, point, _MOST_M)

    def position(self, forces_n: Floats, sensors_m: Floats, least_n: float) -> Floats:
        """Return centroids (..., 2), m, of corner forces (..., 4) on sensors (4, 2); NaN for loads below `least_n`.

        >>> sensors = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
        >>> forces = np.array([[30.0, 10.0, 0.0, 40.0], [1.0, 0.0, 0.0, 0.0]])
        >>> CentroidCorrection().position(forces, sensors, 20.0).round(3) + 0.0
        array([[0.075, 0.   ],
               [  nan,   nan]])
        """
        linear = self.linearised(forces_n)
        out = np.empty((*linear.shape[:-1], 2))
        _centroids(linear.reshape(-1, 4), np.asarray(sensors_m, np.float64), least_n, self.arrays(), out.reshape(-1, 2))
        return out

    def linearised(self, forces_n: Floats) -> Floats:
        """Return corner forces (..., 4) corrected by gains and nonlinearity.

        >>> light = CentroidCorrection(nonlinearity_scales_n=(5.0,), nonlinearity=((0.5, 0.1),) * 4)
        >>> light.linearised(np.array([-2.0, 0.0, 5.0, 500.0])).round(2)
        array([ -3.  ,   0.  ,   5.32, 500.5 ])
        """
        forces = np.ascontiguousarray(forces_n, np.float64)
        out = np.empty_like(forces)
        _linearise_all(forces.reshape(-1, 4), self.arrays(), out.reshape(-1, 4))
        return out

    def arrays(self) -> CorrectionArrays:
        """Return the correction as kernels take it."""
        return CorrectionArrays(
            np.array(self.gains, np.float64),
            np.array(self.nonlinearity_scales_n, np.float64),
            np.array(self.nonlinearity, np.float64) if self.nonlinearity else np.zeros((0, 0)),
            np.array(self.powers, np.int64).reshape(-1, 2),
            np.array(self.displacement_m, np.float64).reshape(-1, 2),
            self.scale_m,
            np.array(self.area_m, np.float64).reshape(-1, 2),
        )


def nonlinear_terms(forces_n: Floats, scales_n: Sequence[float]) -> Floats:
    """Return the terms (..., 1 + scales) that the coefficients of a `CentroidCorrection`'s nonlinearity multiply."""
    above = np.maximum(forces_n, 0.0)
    return np.stack([np.minimum(forces_n, 0.0), *(scale * -np.expm1(-above / scale) for scale in scales_n)], axis=-1)


@kernel
def linearise(forces_n: Floats, c: CorrectionArrays, out: Floats) -> None:
    """Write four corner forces, corrected by gains and nonlinearity."""
    for j in range(4):
        force = forces_n[j]
        out[j] = force * c.gains[j]
        if c.nonlinearity.size > 0:
            out[j] += c.nonlinearity[j, 0] * min(force, 0.0)
            for k in range(c.nonlinearity_scales_n.size):
                scale_n = c.nonlinearity_scales_n[k]
                out[j] -= c.nonlinearity[j, k + 1] * scale_n * math.expm1(-max(force, 0.0) / scale_n)


@kernel
def centroid(linear_n: Floats, sensors_m: Floats, least_n: float, c: CorrectionArrays) -> tuple[float, float]:
    """Return the displaced centroid (x, y) of linearised corner forces on sensors (4, 2); NaN for loads below
    `least_n`."""
    total = linear_n[0] + linear_n[1] + linear_n[2] + linear_n[3]
    if not total >= max(least_n, 1e-9):
        return math.nan, math.nan
    x = y = 0.0
    for j in range(4):
        x += linear_n[j] * sensors_m[j, 0]
        y += linear_n[j] * sensors_m[j, 1]
    x /= total
    y /= total
    if len(c.powers) == 0:
        return x, y
    u, v = nearest_within(x, y, c.area_m)
    u /= c.scale_m
    v /= c.scale_m
    for k in range(len(c.powers)):
        term = u ** c.powers[k, 0] * v ** c.powers[k, 1]
        x += term * c.displacement_m[k, 0]
        y += term * c.displacement_m[k, 1]
    return x, y


@kernel
def nearest_within(x: float, y: float, area_m: Floats) -> tuple[float, float]:
    """Return the point nearest to (x, y) in a convex polygon, whose corners (k, 2) are counter-clockwise.

    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> [nearest_within(x, y, square) for x, y in ((0.5, 0.5), (2.0, 0.5), (2.0, 3.0))]
    [(0.5, 0.5), (1.0, 0.5), (1.0, 1.0)]
    """
    corners = len(area_m)
    inside = corners == 0 or corners >= 3
    nearest = math.inf
    at_x, at_y = x, y
    for k in range(corners):
        x0, y0 = area_m[k, 0], area_m[k, 1]
        x1, y1 = area_m[(k + 1) % corners, 0], area_m[(k + 1) % corners, 1]
        along_x, along_y = x1 - x0, y1 - y0
        inside = inside and along_x * (y - y0) - along_y * (x - x0) >= 0.0
        length = max(along_x * along_x + along_y * along_y, 1e-30)
        part = min(max(((x - x0) * along_x + (y - y0) * along_y) / length, 0.0), 1.0)
        foot_x, foot_y = x0 + part * along_x, y0 + part * along_y
        distance = (x - foot_x) ** 2 + (y - foot_y) ** 2
        if distance < nearest:
            nearest, at_x, at_y = distance, foot_x, foot_y
    if inside:
        return x, y
    return at_x, at_y


@kernel
def _centroids(linear_n: Floats, sensors_m: Floats, least_n: float, c: CorrectionArrays, out: Floats) -> None:
    for i in range(len(linear_n)):
        out[i, 0], out[i, 1] = centroid(linear_n[i], sensors_m, least_n, c)


@kernel
def _linearise_all(forces_n: Floats, c: CorrectionArrays, out: Floats) -> None:
    for i in range(len(forces_n)):
        linearise(forces_n[i], c, out[i])
