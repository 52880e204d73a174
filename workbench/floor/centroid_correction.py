"""Where a load stands, of corner forces and what a centroid calibration learned (`curves.Correction`): kernels."""

import math

from underfoot.kernels import kernel


@kernel
def weigh(forces_n, gains, bends_n, bends, out):
    """Four corner forces as they count for the centroid: times their gains, and bent."""
    for j in range(4):
        force = forces_n[j]
        out[j] = force * gains[j]
        if bends.size > 0:
            out[j] += bends[j, 0] * min(force, 0.0)
            for b in range(bends_n.size):
                out[j] -= bends[j, b + 1] * bends_n[b] * math.expm1(-max(force, 0.0) / bends_n[b])


@kernel
def place(weighed, sensors_m, least_n, powers, displacement_m, scale_m, area_m):
    """The place (x, y) of weighed corner forces on sensors (4, 2); NaN where the load is below `least_n`."""
    total = weighed[0] + weighed[1] + weighed[2] + weighed[3]
    if not total >= max(least_n, 1e-9):
        return math.nan, math.nan
    x = y = 0.0
    for j in range(4):
        x += weighed[j] * sensors_m[j, 0]
        y += weighed[j] * sensors_m[j, 1]
    x /= total
    y /= total
    if len(powers) == 0:
        return x, y
    u, v = nearest_within(x, y, area_m)
    u /= scale_m
    v /= scale_m
    for k in range(len(powers)):
        term = u ** powers[k, 0] * v ** powers[k, 1]
        x += term * displacement_m[k, 0]
        y += term * displacement_m[k, 1]
    return x, y


@kernel
def nearest_within(x, y, area_m):
    """A point of a convex area as it is, another moved to its edge; its corners (k, 2) counter-clockwise.

    >>> import numpy as np
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
def place_all(weighed, sensors_m, least_n, powers, displacement_m, scale_m, area_m, out):
    """The places (n, 2) of weighed corner forces (n, 4)."""
    for i in range(len(weighed)):
        out[i, 0], out[i, 1] = place(weighed[i], sensors_m, least_n, powers, displacement_m, scale_m, area_m)


@kernel
def weigh_all(forces_n, gains, bends_n, bends, out):
    """Corner forces (n, 4) as they count for the centroid."""
    for i in range(len(forces_n)):
        weigh(forces_n[i], gains, bends_n, bends, out[i])
