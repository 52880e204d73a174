"""Shapes of which a scene is painted, in metres of the floor's frame; simple enough for any painter.

Colours are "#rrggbb"; `opacity` is 0 to 1. Shapes are painted in their order, the last one on top.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MOST_SHAPES = 500
"""Most shapes of a scene at once."""
MOST_LINES = 5000
"""Most lines in all its `Lines` together."""


@dataclass(frozen=True)
class Lines:
    """Straight lines from `ends_m` [n, 0] to `ends_m` [n, 1], shape (n, 2, 2), of width `width_m`.

    Many lines in one shape cost far less than many shapes, and opaque ones a fifth of others, which show twice where
    they meet.
    """

    ends_m: NDArray[np.float64]
    colour: str
    width_m: float = 0.003
    opacity: float = 1.0


@dataclass(frozen=True)
class Disc:
    """A filled circle or, with a `rim_m` above 0, a ring whose rim has this width, inwards."""

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
    """Text centred on a place, with capitals of `height_m`; upright for a viewer who looks along the floor's y axis."""

    x_m: float
    y_m: float
    text: str
    height_m: float
    colour: str
    opacity: float = 1.0


Shape = Lines | Disc | Polygon | Text


def box(x_m: float, y_m: float, width_m: float, height_m: float, colour: str, opacity: float = 1.0) -> Polygon:
    """Return a rectangle by its centre.

    >>> box(0.0, 0.0, 0.2, 0.1, "#ffffff").points_m.tolist()
    [[-0.1, -0.05], [0.1, -0.05], [0.1, 0.05], [-0.1, 0.05]]
    """
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    return Polygon(corners * (width_m, height_m) + (x_m, y_m), colour, opacity)
