"""Plots as plain data: one declaration for a picture in a report and for a plot in the window.

A `Drawing` declares the content: axes with their units, lines, dots, arrows, a heat map. `underfoot.drawing.layout`
places title, legend, axes and ticks, `underfoot.drawing.shapes` places the data, and `underfoot.drawing.svg` or the
window's plot paints the result. In a notebook `underfoot.drawing.picture.Picture` shows drawings.
"""

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import choice
from underfoot.drawing.look import COLOURS
from underfoot.errors import require

STYLES = ("line", "dashed", "dots", "arrows", "stems", "heat", "band")
Range = tuple[float, float]
"""Low and high end of an axis, in its unit."""


class Series(Struct, frozen=True):
    """One set of points: `x` and `y` of equal length n; `to` [n, 2], the ends of arrows.

    - `name`: label in the legend, and in tables; "" leaves it out.
    - `style`: "line", "dashed" or "dots"; "arrows" from each point to its end; "stems" up to each point from the
      bottom of the plot; "heat" fills between the line and the left end of the x axis, in the colours of a heat map;
      "band" fills, faintly, what is up to `spread` [n] above and below the points.
    - `colour`: a name in `COLOURS`.
    - `right`: whether `y` belongs to the axis on the right.
    - `in_legend`: whether the legend has its name: of many alike it has none, while a table tells them apart.
    - `labels`: a text beside each point, or none.

    Points that are not finite are left out, and break a line; so are points at or below 0 on a logarithmic axis.
    """

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: str = "line"
    colour: str = "vibration"
    to: NDArray[np.float64] | None = None
    right: bool = False
    in_legend: bool = True
    spread: NDArray[np.float64] | None = None
    labels: tuple[str, ...] = ()

    @property
    def outline_y(self) -> NDArray[np.float64]:
        """`y`; of a band its upper edge and, from right to left, its lower one."""
        return self.y if self.spread is None else np.concatenate([self.y + self.spread, (self.y - self.spread)[::-1]])

    @property
    def has_key(self) -> bool:
        """Whether the legend names it."""
        return bool(self.name) and self.in_legend


class ReferenceLine(Struct, frozen=True):
    """Straight line across the plot: vertical `at` a value of the "x" axis, or horizontal at one of the "y" axis.

    `name` is written at its right end; for a vertical line at the top, beside it. It does not widen the range of the
    axis: a line outside of it is not drawn.
    """

    axis: str
    at: float
    colour: str = "muted"
    dashed: bool = False
    name: str = ""


class HeatMap(Struct, frozen=True):
    """Levels, uint8 [rows, columns], the lowest row first, over ranges of `x` and `y`.

    The colours go from level `low`, which has the background colour, to `high`. Rows and columns are equally spaced on
    the axes as drawn: on a logarithmic axis by a constant ratio.
    """

    levels: NDArray[np.uint8]
    x: Range
    y: Range
    low: float = 0.0
    high: float = 255.0


class Drawing(Struct, frozen=True):
    """Plot. `x`, `y` and `right` are the axes' labels, "name, unit"; `right` is "" without a right axis.

    A range of None is that of the data. `x_names` are those of 1, 2, … on the x axis, and of what is nearest. `equal`
    gives both axes the same scale. `note` is written in the centre if there is nothing else to show.
    """

    title: str
    x: str
    y: str
    series: tuple[Series, ...] = ()
    x_log: bool = False
    y_log: bool = False
    equal: bool = False
    x_range: Range | None = None
    x_names: tuple[str, ...] = ()
    y_range: Range | None = None
    right: str = ""
    right_range: Range | None = None
    lines: tuple[ReferenceLine, ...] = ()
    heat: HeatMap | None = None
    note: str = ""


def spoken(drawing: Drawing) -> str:
    """Return what a screen reader says of a drawing.

    >>> spoken(Drawing("Creep", "time, s", "force, N"))
    'Creep: force, N over time, s'
    """
    return f"{drawing.title}: {drawing.y} over {drawing.x}".removeprefix(": ")


def series(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    style: str = "line",
    colour: str = "vibration",
    to: ArrayLike | None = None,
) -> Series:
    """Return a checked set of points, as float64.

    `BadValue` if `x` and `y` differ in length, `style` or `colour` is unknown, or `to` is missing for arrows or given
    for anything else.

    >>> series("0.1", [0, 1], [0, 1], "dots").y
    array([0., 1.])
    >>> series("a", [0, 1], [0])
    Traceback (most recent call last):
    underfoot.errors.BadValue: y is 1 values; allowed: as many as x, 2
    """
    across, up = np.asarray(x, dtype=np.float64).ravel(), np.asarray(y, dtype=np.float64).ravel()
    require(across.size == up.size, "y", _Words(f"{up.size} values"), f"as many as x, {across.size}")
    choice("style", style, STYLES)
    choice("colour", colour, COLOURS)
    ends = None if to is None else np.asarray(to, dtype=np.float64).reshape(across.size, 2)
    require((ends is not None) == (style == "arrows"), "to", style, "ends for arrows, and for nothing else")
    return Series(name, across, up, style, colour, ends)


class _Words(str):
    """Text that an error shows without quotes."""

    def __repr__(self) -> str:
        return str(self)
