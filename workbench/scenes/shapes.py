"""What a scene is painted of: a few plain shapes in metres of the floor's frame, that any painter can paint.

Colours are "#rrggbb"; `opacity` is 0 to 1. Shapes are painted in their order, the last one on top.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MOST_SHAPES = 500
"""A scene shows at most so many shapes at once."""
MOST_LINES = 5000
"""All its `Lines` together have at most so many."""


@dataclass(frozen=True)
class Lines:
    """Straight lines from `ends_m` [n, 0] to `ends_m` [n, 1], shape (n, 2, 2), as wide as `width_m`.

    Many lines in one shape cost far less than many shapes.
    """

    ends_m: NDArray[np.float64]
    colour: str
    width_m: float = 0.003
    opacity: float = 1.0


@dataclass(frozen=True)
class Disc:
    """A filled circle, or with a `rim_m` above 0 a ring that is so wide, inwards."""

    x_m: float
    y_m: float
    radius_m: float
    colour: str
    opacity: float = 1.0
    rim_m: float = 0.0


@dataclass(frozen=True)
class Polygon:
    """A filled polygon with corners `points_m`, shape (n, 2)."""

    points_m: NDArray[np.float64]
    colour: str
    opacity: float = 1.0


@dataclass(frozen=True)
class Text:
    """Words around a place, whose capitals are `height_m` high; upright for who looks along the floor's y axis."""

    x_m: float
    y_m: float
    text: str
    height_m: float
    colour: str
    opacity: float = 1.0


Shape = Lines | Disc | Polygon | Text


def box(x_m: float, y_m: float, width_m: float, height_m: float, colour: str, opacity: float = 1.0) -> Polygon:
    """A rectangle around its middle.

    >>> box(0.0, 0.0, 0.2, 0.1, "#ffffff").points_m.tolist()
    [[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]]
    """
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    return Polygon(corners * (width_m, height_m) + (x_m, y_m), colour, opacity)
