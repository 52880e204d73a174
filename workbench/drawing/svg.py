"""Drawings as self-contained SVG pictures for reports."""

import base64
import hashlib
import html
from collections.abc import Iterator
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, spoken
from underfoot.drawing.layout import content_of, frame_of, is_cut_off
from underfoot.drawing.look import AREA_OPACITY, BACKDROP_OPACITY, DASH_PX, DOT_PX, heat_colours, heat_table, palette
from underfoot.drawing.png import png_of_indices
from underfoot.drawing.shapes import Area, Backdrop, Box, Dots, HeatArea, HeatImage, Polyline, Segments, Shape, Text

WIDTH, HEIGHT = 640, 400
_EQUAL_HEIGHT = 640
"""Height of a picture with equal axes, e.g. a map: about square."""
_EM_SHARE = 0.56
"""Approximate width of a letter, in font sizes; the reader's system chooses the font."""
_CURVE_PX = 1.5
_HEAT_STOPS = 17


def height_of(drawing: Drawing) -> int:
    """Return the height of a drawing's picture, in pixels."""
    return _EQUAL_HEIGHT if drawing.equal else HEIGHT


def svg(drawing: Drawing, colours: str = "dark") -> str:
    """Return the drawing as an SVG picture, 640 x 400 (a map 640 x 640), in the "dark" or the "light" palette.

    To a screen reader it is one picture with a name, not a list of its ticks.

    >>> from underfoot.drawing import series
    >>> text = svg(Drawing("Creep", "time, s", "force, N", (series("held", [1, 10], [40, 41]),), x_log=True))
    >>> "time, s" in text and text.startswith("<svg")
    True
    """
    height = height_of(drawing)
    frame = frame_of(drawing, WIDTH, height, _width_px)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}"'
        f' font-family="sans-serif" role="img" aria-label="{html.escape(spoken(drawing))}">',
        f'<rect width="{WIDTH}" height="{height}" fill="{palette(colours)["ground"]}"/>',
        *(element for shape in frame.shapes for element in _elements(shape, colours)),
    ]
    content = [element for shape in content_of(drawing, frame, _width_px) for element in _elements(shape, colours)]
    return "\n".join([*parts, *(_cut_off(content, frame.area) if is_cut_off(drawing) else content), "</svg>\n"])


def _cut_off(elements: list[str], box: Box) -> list[str]:
    """Clip elements to a box. Readers that cannot clip show them whole; of a nested picture they showed nothing, and of
    a clip that is no definition the box in black."""
    place = f'x="{box.left:g}" y="{box.top:g}" width="{box.width:g}" height="{box.height:g}"'
    name = _name("area", place)
    clip = f'<defs><clipPath id="{name}"><rect {place}/></clipPath></defs>'
    return [clip, f'<g clip-path="url(#{name})">', *elements, "</g>"]


def _name(kind: str, what: str) -> str:
    """Return an id for `what`: the pictures of one page share a namespace."""
    return f"{kind}-{hashlib.sha256(what.encode()).hexdigest()[:12]}"


def _width_px(text: str, size_px: int, *, bold: bool = False) -> float:
    return _EM_SHARE * size_px * len(text) * (1.1 if bold else 1.0)


@singledispatch
def _elements(shape: Shape, colours: str) -> Iterator[str]:
    """Yield the SVG elements of a shape in a palette."""
    raise AssertionError(f"no picture of {type(shape).__name__}")


@_elements.register
def _(shape: Polyline, colours: str) -> Iterator[str]:
    stroke = _stroke(palette(colours)[shape.colour], _CURVE_PX, dashed=shape.dashed)
    yield f'<polyline points="{_pairs(shape.points)}" fill="none"{stroke}/>'


@_elements.register
def _(shape: Segments, colours: str) -> Iterator[str]:
    if len(shape.ends):
        path = "".join(f"M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}" for (x, y), (to_x, to_y) in shape.ends)
        yield f'<path d="{path}" fill="none"{_stroke(palette(colours)[shape.colour], 1.0, dashed=shape.dashed)}/>'


@_elements.register
def _(shape: Dots, colours: str) -> Iterator[str]:
    for x, y in shape.points:
        yield f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{DOT_PX / 2.0:g}" fill="{palette(colours)[shape.colour]}"/>'


@_elements.register
def _(shape: Area, colours: str) -> Iterator[str]:
    fill = palette(colours)[shape.colour]
    yield f'<polygon points="{_pairs(shape.points)}" fill="{fill}" fill-opacity="{AREA_OPACITY}"/>'


@_elements.register
def _(shape: HeatArea, colours: str) -> Iterator[str]:
    table = heat_table(colours)
    shares = np.linspace(0.0, 1.0, _HEAT_STOPS)
    stops = "".join(
        f'<stop offset="{share:.4f}" stop-color="#{bytes(table[round(255 * share)][:3]).hex()}"/>' for share in shares
    )
    ends = f'gradientUnits="userSpaceOnUse" x1="{shape.left:.1f}" x2="{shape.right:.1f}" y1="0" y2="0"'
    name = _name("heat", ends)
    yield f'<linearGradient id="{name}" {ends}>{stops}</linearGradient>'
    yield f'<polygon points="{_pairs(shape.points)}" fill="url(#{name})"/>'


@_elements.register
def _(shape: HeatImage, colours: str) -> Iterator[str]:
    data = base64.b64encode(png_of_indices(shape.levels[::-1], heat_colours(shape.low, shape.high, colours))).decode()
    box = shape.box
    yield (
        f'<image x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
        f'preserveAspectRatio="none" href="data:image/png;base64,{data}"/>'
    )


@_elements.register
def _(shape: Backdrop, colours: str) -> Iterator[str]:
    box = shape.box
    yield (
        f'<rect x="{box.left:.1f}" y="{box.top:.1f}" width="{box.width:.1f}" height="{box.height:.1f}" '
        f'fill="{palette(colours)["ground"]}" fill-opacity="{BACKDROP_OPACITY}"/>'
    )


@_elements.register
def _(shape: Text, colours: str) -> Iterator[str]:
    bold = ' font-weight="bold"' if shape.bold else ""
    yield (
        f'<text x="{shape.x:.1f}" y="{shape.y:.1f}" text-anchor="{shape.anchor}" font-size="{shape.size_px}"{bold} '
        f'fill="{palette(colours)[shape.colour]}">{html.escape(shape.text)}</text>'
    )


def _pairs(points: NDArray[np.float64]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _stroke(colour: str, width_px: float, *, dashed: bool) -> str:
    dash = f' stroke-dasharray="{DASH_PX[0]:g} {DASH_PX[1]:g}"' if dashed else ""
    return f' stroke="{colour}" stroke-width="{width_px:g}"{dash}'
