"""Colours and sizes of plots, in reports and in the window: one accent per kind of signal."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

PALETTES = ("dark", "light")

_SURFACES = {
    "ground": ("#12151a", "#ffffff"),
    "grid": ("#222831", "#e3e7eb"),
    "line": ("#2c3540", "#cbd2da"),
    "text": ("#dfe5ec", "#1a2027"),
}
_CURVES = {
    "force": ("#f0a63c", "#8a5300"),
    "vibration": ("#3fc1c9", "#006d78"),
    "events": ("#b693f2", "#6a44b5"),
    "contact": ("#7ed491", "#1b6f36"),
    "measured": ("#d75f7d", "#7d0037"),
    "alarm": ("#ff6259", "#bd2318"),
    "muted": ("#98a3b1", "#4d5966"),
    "faint": ("#707c8b", "#727d8a"),
    "onset": ("#6c5a91", "#9a85c6"),
    "corner 1": ("#f2806d", "#c94d5b"),
    "corner 2": ("#e8ce77", "#a28e00"),
    "corner 3": ("#996b37", "#332210"),
    "corner 4": ("#fbe0e4", "#742147"),
}
COLOURS = tuple(_CURVES)
"""Names of the colours of curves, by meaning."""
CORNERS = ("corner 1", "corner 2", "corner 3", "corner 4")
"""Colours of a tile's sensors, wherever they are drawn: neighbours of the amber of force that who sees no red or no
green tells apart, and of five lightnesses with it, for who sees no colour or prints in grey."""

_HEAT_STOPS = (
    ("#12151a", "#17324a", "#22617a", "#2f9a98", "#7ed491", "#f6e58d"),
    ("#ffffff", "#cfe7ea", "#86c8c8", "#2f9a98", "#1d5f80", "#241f52"),
)
_HEAT_PLACES = (0.0, 0.2, 0.42, 0.64, 0.84, 1.0)


@cache
def palette(name: str = "dark") -> dict[str, str]:
    """Return the colours of a palette, "dark" or "light", by name: those of curves, background, grid, line and text.

    >>> palette("dark")["ground"], palette("light")["ground"]
    ('#12151a', '#ffffff')
    """
    return {colour: both[PALETTES.index(name)] for colour, both in {**_SURFACES, **_CURVES}.items()}


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 to 255.

    >>> rgb("#ff6259")
    (255, 98, 89)
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


SMALL_PX, TITLE_PX = 11, 15
"""Font sizes: of texts in a plot, and of its title."""
DOT_PX = 4.0
DASH_PX = (6.0, 4.0)
BACKDROP_OPACITY = 0.6
AREA_OPACITY = 0.25


@cache
def heat_table(name: str = "dark") -> NDArray[np.uint8]:
    """Return the colours of a heat map in a palette, uint8 [256, 4]: from the background over blue, teal and green to
    yellow, or, on a light background, over teal to dark blue."""
    colours = np.array([rgb(stop) for stop in _HEAT_STOPS[PALETTES.index(name)]])
    x = np.linspace(0.0, 1.0, 256)
    table = np.full((256, 4), 255, np.uint8)
    for channel in range(3):
        shade = np.interp(x, _HEAT_PLACES, colours[:, channel])
        table[:, channel] = np.round(shade)
    return table


def heat_colours(low: float, high: float, name: str = "dark") -> NDArray[np.uint8]:
    """Return red, green, blue and opacity, uint8 [256, 4], of each level for colours from `low` to `high`.

    Levels up to `low` are transparent, so that the grid shows through.

    >>> heat_colours(100.0, 200.0)[[100, 101, 200, 255], 3].tolist()
    [0, 255, 255, 255]
    """
    places = np.clip((np.arange(256) - low) / (high - low), 0.0, 1.0)
    colours = heat_table(name)[np.round(255 * places).astype(np.intp)]
    colours[places <= 0.0] = 0
    return colours
