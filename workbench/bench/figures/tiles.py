"""Draw figure 4.10: the first bending modes of a tile, the second of which is a ring."""

import numpy as np

from underfoot.bench.figures.figure import Compared, Figure
from underfoot.drawing import Drawing, HeatMap
from underfoot.floor.layout import default_floor
from underfoot.floor.tile_parameters import TileParameters
from underfoot.models.tile.free_plate import FreeModes, free_modes

_POINTS = 96
_THESIS_HZ = 896.0, 1032.0
_LIGHTER_KG = 0.45
"""Mass at the middle with which the ratio of both frequencies is the thesis's."""


def modes(quick: bool) -> Figure:
    """Draw figure 4.10: the cross, which does not move the shaker, and the ring, which does. Free edges."""
    parameters, side_m = TileParameters(), default_floor(1, 1).tiles[0].size_m[0]
    found = _modes(parameters, side_m, parameters.shaker_kg)
    lighter = _modes(parameters, side_m, _LIGHTER_KG)
    (cross, ring), (light_cross, light_ring) = map(_cross_and_ring, (found, lighter))
    hz, light_hz = found.frequencies_hz, lighter.frequencies_hz
    first, second = _THESIS_HZ
    return Figure(
        "4.10",
        "The first two modes in which the plate bends",
        (_drawing(found, cross, "cross"), _drawing(found, ring, "ring")),
        (
            Compared("cross (1, 1)", f"{first:.0f} Hz", f"{hz[cross]:.0f} Hz"),
            Compared("ring (0, 2) + (2, 0)", f"{second:.0f} Hz", f"{hz[ring]:.0f} Hz"),
            Compared("ratio", f"{second / first:.2f}", f"{hz[ring] / hz[cross]:.2f}"),
            Compared(
                f"ratio, {_LIGHTER_KG:g} kg in the middle", "", f"{light_hz[light_ring] / light_hz[light_cross]:.2f}"
            ),
        ),
        "The thesis's are of finite elements, with bracket and rod. Here a thin plate with free edges and the "
        "textbook's stiffness has the shaker as a point mass at its middle. The shapes are the thesis's; the "
        "frequencies are those of a stiffer plate, without the core's shear. The mass brings the ring down to the "
        "cross: 1.1 kg all the way, 0.45 kg as far as in the thesis.",
    )


def _modes(parameters: TileParameters, side_m: float, middle_kg: float) -> FreeModes:
    plate = parameters.plate
    kg_m2 = plate.density_kg_m3 * plate.thickness_m
    return free_modes(side_m, plate.rigidity_nm(), kg_m2, middle_kg, plate.poisson)


def _cross_and_ring(found: FreeModes) -> tuple[int, int]:
    """Return the index of the lowest mode odd along both axes, and of the lowest mode equal along both."""
    quarter = 0.25 * found.side_m
    places = [[quarter, 0.0], [0.0, quarter], [quarter, quarter], [-quarter, quarter]]
    cross = ring = -1
    for k in range(len(found.frequencies_hz))[::-1]:
        right, top, corner, other = map(float, found.shape(places, k))
        if abs(corner + other) < 1e-3 and abs(right) < 1e-3:
            cross = k
        elif abs(corner - other) < 1e-3 and abs(right - top) < 1e-3 and abs(corner) > 1e-3:
            ring = k
    return cross, ring


def _drawing(found: FreeModes, mode: int, name: str) -> Drawing:
    half_m = 0.5 * found.side_m
    along = np.linspace(-half_m, half_m, _POINTS)
    moved = np.abs(found.shape(np.stack(np.meshgrid(along, along), axis=-1), mode))
    cm = (-100.0 * half_m, 100.0 * half_m)
    heat = HeatMap((255.0 * moved).astype(np.uint8), cm, cm)
    text = f"{name}: {found.frequencies_hz[mode]:.0f} Hz"
    return Drawing(text, "x, cm", "y, cm", x_range=cm, y_range=cm, heat=heat, equal=True)
