"""Colours and sizes of plots, in reports and in the window: one accent a kind of signal, the same everywhere."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

GROUND, LINE, TEXT, MUTED, FAINT = "#12151a", "#2c3540", "#dfe5ec", "#8d99a8", "#5b6674"


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255.

    >>> rgb("#ff6259")
    (255, 98, 89)
    """
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


COLOURS = {
    "force": "#f0a63c",
    "vibration": "#3fc1c9",
    "events": "#b693f2",
    "contact": "#7ed491",
    "alarm": "#ff6259",
    "muted": MUTED,
    "faint": FAINT,
    "onset": "#6c5a91",
    "corner 1": "#e0705a",
    "corner 2": "#d8bb54",
    "corner 3": "#a8794a",
    "corner 4": "#e3a7a0",
}
"""What each colour stands for. An onset is 55 % of an event's colour over the ground; the corners, in the order of a
tile's sensors, are neighbours of the amber of force."""

GRID = "#222831"
"""The lines at the ticks: 60 % of `LINE` over the ground."""

SMALL_PX, TITLE_PX = 11, 15
"""Sizes of the font: of everything in a plot, and of its title."""
DOT_PX = 4.0
DASH_PX = (6.0, 4.0)
BACKDROP_OPACITY = 0.6
AREA_OPACITY = 0.25


@cache
def heat_table() -> NDArray[np.uint8]:
    """Colours of a heat map, uint8 [256, 4]: from the ground over blue, teal and green to yellow."""
    stops = (GROUND, "#17324a", "#22617a", "#2f9a98", "#7ed491", "#f6e58d")
    places = (0.0, 0.2, 0.42, 0.64, 0.84, 1.0)
    colours = np.array([rgb(stop) for stop in stops])
    x = np.linspace(0.0, 1.0, 256)
    table = np.full((256, 4), 255, np.uint8)
    for channel in range(3):
        table[:, channel] = np.round(np.interp(x, places, colours[:, channel]))
    return table


def heat_colours(low: float, high: float) -> NDArray[np.uint8]:
    """Red, green, blue and opacity, uint8 [256, 4], of each level where the colours go from `low` to `high`.

    Levels up to `low` are transparent, so that the grid shows through.

    >>> heat_colours(100.0, 200.0)[[100, 101, 200, 255], 3].tolist()
    [0, 255, 255, 255]
    """
    places = np.clip((np.arange(256) - low) / (high - low), 0.0, 1.0)
    colours = heat_table()[np.round(255 * places).astype(np.intp)]
    colours[places <= 0.0] = 0
    return colours
