"""Plots as plain data: what a report writes as SVG, a window draws on its screen.

Whoever measures says what is to be seen, once: a `Drawing` of lines, dots and arrows in named units. `svg` makes a
picture of it for a page; the window hands the same drawing to its plots.
"""

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require

WIDTH, HEIGHT = 640, 400
_LEFT, _RIGHT, _TOP, _BOTTOM = 76, 24, 40, 52
_LEGEND = 180  # how wide
GROUND, LINE, TEXT, MUTED = "#12151a", "#2c3540", "#dfe5ec", "#8d99a8"
COLOURS = {
    "force": "#f0a63c",
    "vibration": "#3fc1c9",
    "events": "#b693f2",
    "contact": "#7ed491",
    "alarm": "#ff6259",
    "muted": MUTED,
}
"""The accents of the house, by what they stand for."""
STYLES = ("line", "dashed", "dots", "arrows")
_MOST_POINTS = 2000
"""A line of more points than this is drawn by the lowest and highest of each stretch."""


@dataclass(frozen=True)
class Series:
    """One set of points of a drawing: `x` and `y` of equal length n; `to` (n, 2) where arrows end.

    `name` stands in the legend; "" leaves it out. Points that are not finite are left out, and break a line.
    """

    name: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: str = "line"
    colour: str = "vibration"
    to: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Drawing:
    """A plot: axes with their units in the labels, and what is on them. `equal` gives both axes the same scale."""

    title: str
    x: str
    y: str
    series: tuple[Series, ...]
    x_log: bool = False
    y_log: bool = False
    equal: bool = False


def series(
    name: str,
    x: ArrayLike,
    y: ArrayLike,
    style: str = "line",
    colour: str = "vibration",
    to: ArrayLike | None = None,
) -> Series:
    """A set of points, checked: `style` is line, dashed, dots or arrows, `colour` a name in `COLOURS`.

    >>> series("0.1", [0, 1], [0, 1], "dots").y
    array([0., 1.])
    >>> series("a", [0, 1], [0])
    Traceback (most recent call last):
    underfoot.errors.BadValue: y is 1 values; allowed: as many as x, 2
    """
    across, up = np.asarray(x, dtype=np.float64).ravel(), np.asarray(y, dtype=np.float64).ravel()
    if across.size != up.size:
        require(False, "y", _Words(f"{up.size} values"), f"as many as x, {across.size}")
    require(style in STYLES, "style", style, ", ".join(STYLES))
    require(colour in COLOURS, "colour", colour, ", ".join(COLOURS))
    ends = None if to is None else np.asarray(to, dtype=np.float64).reshape(across.size, 2)
    require((ends is not None) == (style == "arrows"), "to", style, "ends for arrows, and for nothing else")
    return Series(name, across, up, style, colour, ends)


def svg(drawing: Drawing) -> str:
    """The drawing as an SVG picture, 640 x 400.

    >>> text = svg(Drawing("Creep", "time, s", "force, N", (series("held", [1, 10], [40, 41]),), x_log=True))
    >>> "time, s" in text and text.startswith("<svg")
    True
    """
    across, up = _axes(drawing)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
        f' font-family="sans-serif" font-size="12" fill="{TEXT}">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="{GROUND}"/>',
        _label(_LEFT, 22, drawing.title, size=14),
        _label((_LEFT + WIDTH - _RIGHT) / 2, HEIGHT - 12, drawing.x, anchor="middle", fill=MUTED),
        f'<g transform="translate(16 {(_TOP + HEIGHT - _BOTTOM) / 2}) rotate(-90)">'
        f"{_label(0, 0, drawing.y, anchor='middle', fill=MUTED)}</g>",
    ]
    for value in across.ticks():
        x = across.place(value)
        parts.append(_stroke([(x, _TOP), (x, HEIGHT - _BOTTOM)], LINE))
        parts.append(_label(x, HEIGHT - _BOTTOM + 18, across.words(value), anchor="middle", fill=MUTED))
    for value in up.ticks():
        y = up.place(value)
        parts.append(_stroke([(_LEFT, y), (WIDTH - _RIGHT, y)], LINE))
        parts.append(_label(_LEFT - 8, y + 4, up.words(value), anchor="end", fill=MUTED))
    for one in drawing.series:
        parts += _drawn(one, across, up)
    return "\n".join([*parts, *_legend(drawing, across, up), "</svg>\n"])


def page(title: str, body: Sequence[str]) -> str:
    """A page of HTML around `body`, in the colours of the house; it needs no other file."""
    return "\n".join(
        [
            f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>',
            f"<style>body{{background:{GROUND};color:{TEXT};font-family:sans-serif;margin:24px}}svg{{margin:8px}}"
            f"td,th{{text-align:left;padding:2px 16px 2px 0}}th{{color:{MUTED};font-weight:normal}}</style>",
            f"<h1>{html.escape(title)}</h1>",
            *body,
            "</html>\n",
        ]
    )


class _Words(str):
    """Text that an error shows as it is."""

    def __repr__(self) -> str:
        return str(self)


@dataclass(frozen=True)
class _Axis:
    low: float
    high: float
    log: bool
    start: float
    end: float

    def place(self, value: float) -> float:
        if self.log:
            value, low, high = math.log10(value), math.log10(self.low), math.log10(self.high)
        else:
            low, high = self.low, self.high
        return self.start + (value - low) / (high - low) * (self.end - self.start)

    def ticks(self) -> list[float]:
        if self.log:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            if last - first >= 1:
                return [10.0**k for k in range(first, last + 1, 1 + (last - first) // 9)]
            return [self.low, math.sqrt(self.low * self.high), self.high]
        raw = (self.high - self.low) / 6.0
        unit = 10.0 ** math.floor(math.log10(raw))
        step = next(k * unit for k in (1.0, 2.0, 5.0, 10.0) if k * unit >= raw * (1.0 - 1e-9))
        return [k * step for k in range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)]

    def words(self, value: float) -> str:
        return f"{value:.4g}" if abs(value) > 1e-12 * (self.high - self.low) or self.log else "0"


def _axes(drawing: Drawing) -> tuple[_Axis, _Axis]:
    x_low, x_high = _range([s.x for s in drawing.series] + [to[:, 0] for to in _ends(drawing)], drawing.x_log)
    y_low, y_high = _range([s.y for s in drawing.series] + [to[:, 1] for to in _ends(drawing)], drawing.y_log)
    if drawing.equal:
        ratio = ((x_high - x_low) / (WIDTH - _LEFT - _RIGHT)) / ((y_high - y_low) / (HEIGHT - _TOP - _BOTTOM))
        if ratio < 1.0:
            x_low, x_high = _widened(x_low, x_high, 1.0 / ratio)
        else:
            y_low, y_high = _widened(y_low, y_high, ratio)
    return (
        _Axis(x_low, x_high, drawing.x_log, _LEFT, WIDTH - _RIGHT),
        _Axis(y_low, y_high, drawing.y_log, HEIGHT - _BOTTOM, _TOP),
    )


def _ends(drawing: Drawing) -> list[NDArray[np.float64]]:
    return [one.to for one in drawing.series if one.to is not None]


def _range(values: Sequence[NDArray[np.float64]], log: bool) -> tuple[float, float]:
    every = np.concatenate([np.empty(0), *values])
    every = every[np.isfinite(every) & ((every > 0.0) | (not log))]
    if not every.size:
        return (1.0, 10.0) if log else (0.0, 1.0)
    low, high = float(every.min()), float(every.max())
    if log:
        return (low, high) if high > 1.01 * low else (low / 1.5, high * 1.5)
    return _widened(low, high, 1.06) if high > low else (low - 0.5, high + 0.5)


def _widened(low: float, high: float, times: float) -> tuple[float, float]:
    more = 0.5 * (times - 1.0) * (high - low)
    return low - more, high + more


def _drawn(one: Series, across: _Axis, up: _Axis) -> list[str]:
    colour = COLOURS[one.colour]
    good = _shown(one, across, up)
    if one.to is not None:
        return [
            f'<line x1="{across.place(x):.1f}" y1="{up.place(y):.1f}" x2="{across.place(to[0]):.1f}" '
            f'y2="{up.place(to[1]):.1f}" stroke="{colour}"/>'
            f'<circle cx="{across.place(to[0]):.1f}" cy="{up.place(to[1]):.1f}" r="2.5" fill="{colour}"/>'
            for x, y, to in zip(one.x[good], one.y[good], one.to[good], strict=True)
        ]
    if one.style == "dots":
        return [
            f'<circle cx="{across.place(x):.1f}" cy="{up.place(y):.1f}" r="2.5" fill="{colour}"/>'
            for x, y in zip(one.x[good], one.y[good], strict=True)
        ]
    strokes = []
    for run in np.split(np.arange(one.x.size), np.flatnonzero(np.diff(good)) + 1):
        if run.size and good[run[0]]:
            kept = _thinned(one.y[run]) + run[0]
            strokes.append(_stroke([(across.place(one.x[i]), up.place(one.y[i])) for i in kept], colour, 2, one.style))
    return strokes


def _legend(drawing: Drawing, across: _Axis, up: _Axis) -> list[str]:
    """The names of the series, in the corner where they cover least; the upper right one if it can be."""
    named = [one for one in drawing.series if one.name]
    if not named:
        return []
    tall = 16 * len(named)
    x, y = np.concatenate([_seen(one, across, up) for one in drawing.series]).T
    covered = {}
    for top in (_TOP + 16, HEIGHT - _BOTTOM - tall + 4):
        for left in (WIDTH - _RIGHT - _LEGEND, _LEFT + 12):
            inside = (x > left - 8) & (x < left + _LEGEND) & (y > top - 16) & (y < top + tall)
            covered[left, top] = np.count_nonzero(inside)
    left, top = min(covered, key=covered.__getitem__)
    parts = []
    for k, one in enumerate(named):
        middle = top + 16 * k - 4
        parts.append(_stroke([(left, middle), (left + 20, middle)], COLOURS[one.colour], 2, one.style))
        parts.append(_label(left + 26, middle + 4, one.name))
    return parts


def _seen(one: Series, across: _Axis, up: _Axis) -> NDArray[np.float64]:
    """Places [n, 2] on the picture where a series can be seen; on a line of few points, between them too."""
    shown = np.flatnonzero(_shown(one, across, up))
    shown = shown[:: 1 + shown.size // _MOST_POINTS]
    places = np.array([(across.place(one.x[i]), up.place(one.y[i])) for i in shown]).reshape(-1, 2)
    if one.style in ("line", "dashed") and len(places) > 1:
        between = np.linspace(0.0, len(places) - 1.0, _MOST_POINTS)
        places = np.column_stack([np.interp(between, np.arange(len(places)), column) for column in places.T])
    return places


def _shown(one: Series, across: _Axis, up: _Axis) -> NDArray[np.bool_]:
    """Which points of a series can be drawn."""
    good = np.isfinite(one.x) & np.isfinite(one.y)
    return good & ((one.x > 0.0) | (not across.log)) & ((one.y > 0.0) | (not up.log))


def _thinned(y: NDArray[np.float64]) -> NDArray[np.intp]:
    """Which points of a line to draw: all, or the lowest and highest of each stretch."""
    if y.size <= _MOST_POINTS:
        return np.arange(y.size)
    edges = np.linspace(0, y.size, _MOST_POINTS // 2 + 1).astype(int)
    kept = [(a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))) for a, b in pairwise(edges)]
    return np.unique(np.array(kept))


def _stroke(points: Sequence[tuple[float, float]], colour: str, width: int = 1, style: str = "line") -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dash = ' stroke-dasharray="6 4"' if style == "dashed" else ' stroke-dasharray="2 4"' if style == "dots" else ""
    return f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"{dash}/>'


def _label(x: float, y: float, words: str, *, anchor: str = "start", size: int = 12, fill: str = TEXT) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}" fill="{fill}">'
        f"{html.escape(words)}</text>"
    )
