"""Shapes of a plot: a few kinds in pixels, for any painter.

A shape has the name of its colour, which a palette of `underfoot.drawing.look` defines.
"""

from collections.abc import Iterator

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.drawing import Series
from underfoot.drawing.axes import Axis
from underfoot.drawing.look import SMALL_PX
from underfoot.drawing.thinning import extremes

_MOST_POINTS = 2000
"""Number of points above which a line is thinned to what its pixels can show."""
_KEY_AREA_PX = 9.0
"""Height of an area in a legend."""


class Box(Struct, frozen=True):
    """Rectangle in pixels, y downwards."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def width(self) -> float:
        """From left to right, in pixels."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """From top to bottom, in pixels."""
        return self.bottom - self.top


class Polyline(Struct, frozen=True):
    """Line through `points` [n, 2]."""

    points: NDArray[np.float64]
    colour: str
    dashed: bool = False


class Segments(Struct, frozen=True):
    """Straight lines from `ends` [n, 0] to `ends` [n, 1]; shape [n, 2, 2]."""

    ends: NDArray[np.float64]
    colour: str
    dashed: bool = False


class Dots(Struct, frozen=True):
    """Dots at `points` [n, 2]."""

    points: NDArray[np.float64]
    colour: str


class HeatArea(Struct, frozen=True):
    """Area with the outline `points` [n, 2], filled with the colours of a heat map from pixel `left` to `right`."""

    points: NDArray[np.float64]
    left: float
    right: float


class Area(Struct, frozen=True):
    """Area with the outline `points` [n, 2], filled faintly."""

    points: NDArray[np.float64]
    colour: str


class HeatImage(Struct, frozen=True):
    """Levels, uint8 [rows, columns], the lowest row first, over a box; colours go from level `low` to `high`."""

    levels: NDArray[np.uint8]
    low: float
    high: float
    box: Box


class Backdrop(Struct, frozen=True):
    """Translucent box in the background colour, behind a caption."""

    box: Box


class Text(Struct, frozen=True):
    """Text with its baseline at `y`; `anchor` gives the part of it at `x`: start, middle or end."""

    text: str
    x: float
    y: float
    colour: str
    anchor: str = "start"
    size_px: int = SMALL_PX
    bold: bool = False


Shape = Polyline | Segments | Dots | Area | HeatArea | HeatImage | Backdrop | Text


def shapes_of(one: Series, x: Axis, y: Axis) -> Iterator[Shape]:
    """Yield the shapes of a series on its axes."""
    colour = one.colour
    across = one.x if one.spread is None else np.concatenate([one.x, one.x[::-1]])
    points = np.column_stack([x.place(across), y.place(one.outline_y)])
    seen = _is_finite(points)
    if one.to is not None:
        ends = np.column_stack([x.place(one.to[:, 0]), y.place(one.to[:, 1])])
        seen &= _is_finite(ends)
        yield Segments(np.stack([points[seen], ends[seen]], axis=1), colour)
        yield Dots(_one_a_pixel(ends[seen]), colour)
    elif one.style == "dots":
        yield Dots(_one_a_pixel(points[seen]), colour)
    elif one.style == "stems":
        feet = np.column_stack([points[seen, 0], np.full(np.count_nonzero(seen), y.start)])
        yield Segments(np.stack([feet, points[seen]], axis=1), colour)
    elif one.style == "band":
        yield Area(points[seen], colour)
    else:
        for run in _runs(points, seen):
            if one.style == "heat":
                low = np.column_stack([np.full(2, x.start), run[[-1, 0], 1]])
                yield HeatArea(np.concatenate([run, low]), x.start, x.end)
            yield Polyline(_shown(run), colour, one.style == "dashed")


def key_of(one: Series, left: float, middle: float, width: float) -> Iterator[Shape]:
    """Yield the legend key of a series, `width` pixels wide: a piece of its line or band, an arrow, or a few dots."""
    colour = one.colour
    right = left + width
    if one.style == "band":
        top, bottom = middle - 0.5 * _KEY_AREA_PX, middle + 0.5 * _KEY_AREA_PX
        yield Area(np.array([[left, top], [right, top], [right, bottom], [left, bottom]]), colour)
    elif one.style != "dots":
        yield Polyline(np.array([[left, middle], [right, middle]]), colour, one.style == "dashed")
    if one.style in ("dots", "arrows"):
        places = np.linspace(left + 2.0, right - 2.0, 3) if one.style == "dots" else np.array([right])
        yield Dots(np.column_stack([places, np.full(places.size, middle)]), colour)


def _is_finite(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points [n, 2] have two finite coordinates."""
    return np.isfinite(points[:, 0]) & np.isfinite(points[:, 1])


def _runs(points: NDArray[np.float64], seen: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    """Return the pieces of a line between points that are not visible."""
    if seen.all():
        return [points] if len(points) else []
    pieces = np.split(points, np.flatnonzero(np.diff(seen)) + 1)
    return [piece for piece in pieces if np.isfinite(piece[0]).all()]


def _shown(run: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of a line that its pixels can show."""
    if len(run) <= _MOST_POINTS:
        return run
    if (np.diff(run[:, 0]) >= 0.0).all():
        x, y, _ = extremes(run[:, 0], run[:, 1:], 1.0)
        return np.column_stack([x, y])
    cells = np.round(2.0 * run).astype(np.int64)
    moved = (np.diff(cells, axis=0) != 0).any(axis=1)
    return run[np.concatenate([[True], moved])]


def _one_a_pixel(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return one dot per pixel, however many readings lie there."""
    cells = np.round(points).astype(np.int64)
    _, kept = np.unique(cells[:, 0] * (1 << 20) + cells[:, 1], return_index=True)
    return points[np.sort(kept)]
