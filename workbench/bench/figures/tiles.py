"""Figure 4.10: the first bending modes of a tile."""

import math

import numpy as np

from underfoot.bench.figures.figure import Compared, Figure
from underfoot.drawing import Drawing, HeatMap
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import TileParameters

_BENDING_HZ = 500.0
"""Below lie the modes of the suspension."""
_POINTS = 96


def modes(quick: bool) -> Figure:
    """Figure 4.10: the two lowest modes in which the plate bends, and moves at the accelerometer or beside it."""
    tile, parameters = default_floor(1, 1).tiles[0], TileParameters()
    assembly = parameters.assembly(tile)
    own, vectors = assembly.undamped()
    hz = own / (2.0 * math.pi)
    half_m = 0.5 * tile.size_m[0]
    along = np.linspace(-half_m, half_m, _POINTS)
    places = np.stack(np.meshgrid(along, along), axis=-1)
    first = [int(k) for k in np.flatnonzero(hz > _BENDING_HZ)[:2]]
    drawings = []
    for k in first:
        moved = assembly.shape(places) @ vectors[:, k]
        levels = (255.0 * np.abs(moved) / np.abs(moved).max()).astype(np.uint8)
        cm = (-100.0 * half_m, 100.0 * half_m)
        drawings.append(
            Drawing(
                f"{hz[k]:.0f} Hz", "x, cm", "y, cm", x_range=cm, y_range=cm, heat=HeatMap(levels, cm, cm), equal=True
            )
        )
    ratio = hz[first[1]] / hz[first[0]]
    return Figure(
        "4.10",
        "The first two modes in which the plate bends",
        tuple(drawings),
        (
            Compared("first", "896 Hz", f"{hz[first[0]]:.0f} Hz"),
            Compared("second", "1032 Hz", f"{hz[first[1]]:.0f} Hz"),
            Compared("ratio", "1.15", f"{ratio:.2f}"),
        ),
        "The thesis's are of finite elements. Here a thin plate hangs by hinged edges in a stiff frame, the shaker a "
        "point mass at its middle. The ring that is the thesis's second mode needs edges that move: such a plate "
        "does not have it, and its next mode is far above the band.",
    )
