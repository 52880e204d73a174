"""Direction of a foot: from the spread of its load over several tiles, or from the direction in which it rolled.

A foot across an edge has a centroid on each tile, and their difference points along the foot (thesis 5.4). On three or
four tiles it is the principal axis of the centroids about the foot's. The breadth of a foot turns this axis towards the
edge's normal: a rectangle of length L and breadth w that an edge cuts in the middle, at the angle a from its normal,
has centroids that lie

    tan(e) = (w^2 tan(a) / 6 L) / (L / 4 - w^2 tan(a)^2 / 12 L)

off its axis. This, for a foot's usual breadth, is part of the standard error that is returned.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import Contact
from underfoot.floor.layout import Floor
from underfoot.floor.shared_loads import LOADED_N

BREADTH_RATIO = 0.35
"""Breadth of a foot over its length."""

UNSURE_RAD = math.radians(4.0)
"""Standard deviation of the direction across an edge, because feet press unevenly."""

OFF_AXIS_RAD, WHOLE_ROLL_M = math.radians(8.0), 0.15
"""Standard deviation between the path of the centre of pressure and the axis of the foot; it grows for paths shorter
than `WHOLE_ROLL_M`."""

SHORT_M, NARROW_M = 0.03, 0.06
"""Shortest roll, and shortest spread over tiles, from which a direction is taken."""

_CORNER = 0.75
"""A tile that lies as far along an edge as this share of how far it lies across it is beyond a corner."""


def orientation(contact: Contact, floor: Floor) -> tuple[float, float]:
    """Return the direction of a foot in the floor's frame, and its standard error, both in radians.

    Both are NaN if it cannot be determined: on one tile, without a roll.

    >>> from underfoot.floor.layout import default_floor
    >>> time_s = np.linspace(0.0, 0.6, 61)
    >>> contact = Contact(1, 0.0, 0.6, (0,), False, -0.01, 0.0, time_s, 500.0 + 0 * time_s, time_s / 3, time_s / 3)
    >>> [round(math.degrees(angle)) for angle in orientation(contact, default_floor())]
    [45, 8]
    """
    loaded = np.flatnonzero(contact.force_n >= LOADED_N)
    if not len(loaded):
        return math.nan, math.nan
    first, last = loaded[0], loaded[-1]
    roll = np.array([contact.x_m[last] - contact.x_m[first], contact.y_m[last] - contact.y_m[first]])
    rolled_m = float(np.hypot(*roll))
    rolled_error = OFF_AXIS_RAD * max(1.0, WHOLE_ROLL_M / max(rolled_m, 1e-9))
    xx, xy, yy = contact.spread_m2
    spread_m = 2.0 * math.sqrt(max(xx + yy, 0.0))
    if spread_m < NARROW_M or len(contact.tiles) < 2:
        return (math.atan2(roll[1], roll[0]), rolled_error) if rolled_m >= SHORT_M else (math.nan, math.nan)
    axis = 0.5 * math.atan2(2.0 * xy, xx - yy)
    towards = np.array([math.cos(axis), math.sin(axis)])
    if float(towards @ roll) < 0.0:
        axis, towards = axis + math.pi, -towards
    compressed = compressed_rad(_from_normal_rad(towards, contact, floor))
    return math.atan2(towards[1], towards[0]), math.hypot(UNSURE_RAD, compressed)


def compressed_rad(from_normal_rad: float) -> float:
    """Return the angle of a foot's axis from the line through the centroids of its parts on two tiles.

    `from_normal_rad` is the angle of its axis from the normal of the edge between them.

    >>> [round(math.degrees(compressed_rad(math.radians(angle))), 1) for angle in (0.0, 30.0, 60.0)]
    [0.0, 2.7, 9.2]
    """
    # At larger angles the edge crosses the ends of the foot, not its sides.
    steep = min(abs(math.tan(from_normal_rad)), 1.0 / BREADTH_RATIO)
    square = BREADTH_RATIO**2
    return math.atan2(square * steep / 6.0, 0.25 - square * steep**2 / 12.0)


def _from_normal_rad(towards: NDArray[np.float64], contact: Contact, floor: Floor) -> float:
    """Return the angle of a foot's axis from the normal of the edge between the two tiles with the largest impulse;
    where they meet at a corner only, from the nearer one of its two edges' normals, as that edge cuts the foot."""
    one, other = (floor.tiles[k] for k in contact.tiles[:2])
    beyond = np.abs(one.to_tile(other.centre_m)) / one.size_m
    crossed = one.axes[beyond >= _CORNER * beyond.max()]
    return math.acos(min(float(np.abs(crossed @ towards).max()), 1.0))
