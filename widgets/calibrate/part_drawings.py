"""Drawings of a part of a profile: the one in use, and an earlier one dashed or grey."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, Series, series
from underfoot.drawing.look import CORNERS
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Centroid, Fsr, Part, PlateStiffness, Profile, Response

_POINTS = 200
_LOAD_N = 1000.0
_SIDE = 9
"""Points along each side of the tile at which the correction of the centroid is drawn."""


def drawings_of(tile: Tile, part: Part | None, earlier: Part | None = None) -> tuple[Drawing, ...]:
    """Return the drawings of a part in use, and of an `earlier` one of the same kind; empty without both.

    >>> from underfoot.floor.layout import default_floor
    >>> drawings_of(default_floor().tiles[0], None)
    ()
    """
    both = [(part, False), (earlier, True)]
    curves: list[Series] = []
    for one, is_old in both:
        match one:
            case Fsr():
                curves += _sensor_curves(one, is_old)
            case Centroid():
                curves += _moves(tile, one, is_old)
            case Response():
                curves.append(_curve(one.frequencies_hz, one.magnitude, "vibration", is_old))
            case PlateStiffness():
                curves.append(_curve(one.positions, one.stiffness_n_mm, "force", is_old))
    if not curves:
        return ()
    match part or earlier:
        case Fsr():
            return (Drawing("Force over reading", "reading, counts", "force, N", tuple(curves)),)
        case Centroid():
            return (Drawing("Correction of the centroid", "x, mm", "y, mm", tuple(curves), equal=True),)
        case PlateStiffness():
            title, y = "Stiffness over position", "stiffness, N/mm"
            return (Drawing(title, "position of the servo", y, tuple(curves), y_log=True),)  # as it is interpolated
        case _:
            title, y = "Acceleration of the plate at full scale", "acceleration, m/s^2"
            return (Drawing(title, "frequency, Hz", y, tuple(curves), x_log=True, y_log=True),)


def _sensor_curves(part: Fsr, is_old: bool) -> list[Series]:
    found = []
    for number, (curve, colour) in enumerate(zip(part.sensors, CORNERS, strict=True), 1):
        if curve.readings:
            readings = np.linspace(curve.readings[0], curve.readings[-1], _POINTS)
            name = "" if is_old else f"sensor {number}"
            found.append(series(name, readings, curve.force(readings), "dashed" if is_old else "line", colour))
    return found


def _moves(tile: Tile, part: Centroid, is_old: bool) -> list[Series]:
    """Draw arrows from the uncorrected centroid to the corrected position."""
    plain = Profile(tile=tile.id, centroid=Centroid(made=part.made, sensors_m=tile.sensors_m, least_n=0.0))
    forces_n = _loads(tile)
    begin = 1e3 * plain.position(forces_n)
    end = 1e3 * Profile(tile=tile.id, centroid=part).position(forces_n * _LOAD_N)
    x, y = begin.T
    return [series("earlier" if is_old else "in use", x, y, "arrows", "muted" if is_old else "contact", end)]


def _loads(tile: Tile) -> NDArray[np.float64]:
    """Return corner forces, as shares of the load, for positions all over the tile, by a bilinear split."""
    low, high = np.array(tile.sensors_m).min(axis=0), np.array(tile.sensors_m).max(axis=0)
    share = np.linspace(0.05, 0.95, _SIDE)
    across, up = (grid.ravel() for grid in np.meshgrid(share, share))
    middle = (low + high) / 2.0
    corners = [(np.array(at_m) > middle).astype(float) for at_m in tile.sensors_m]
    return np.column_stack([np.abs(1 - right - across) * np.abs(1 - top - up) for right, top in corners])


def _curve(x: Sequence[float], y: Sequence[float], colour: str, is_old: bool) -> Series:
    name, style, colour = ("earlier", "dashed", "muted") if is_old else ("in use", "line", colour)
    return series(name, x, y, style, colour)
