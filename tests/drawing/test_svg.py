"""Drawings as pictures of a report."""

import base64
import math
import struct
import zlib
from xml.etree import ElementTree

import numpy as np
import pytest

from underfoot.drawing import Drawing, HeatMap, ReferenceLine, Series, series
from underfoot.drawing.layout import frame_of
from underfoot.drawing.look import heat_colours, palette
from underfoot.drawing.png import png_of_indices
from underfoot.drawing.svg import HEIGHT, WIDTH, svg

SVG = "{http://www.w3.org/2000/svg}"


def parsed(drawing):
    return ElementTree.fromstring(svg(drawing))


def test_words_are_written_as_they_are():
    root = parsed(Drawing("a < b & c", "time, s", "y", (series("x > 1", [1, 2], [1, 2]),)))
    words = [element.text for element in root.iter(f"{SVG}text")]
    assert {"a < b & c", "x > 1", "time, s →"} <= set(words)
    assert (root.get("role"), root.get("aria-label")) == ("img", "a < b & c: y over time, s")


def test_dots_are_where_the_axes_say():
    drawing = Drawing("a", "x", "y", (series("", [1.0, 10.0, 100.0], [1.0, 2.0, 3.0], "dots"),), x_log=True)
    frame = frame_of(drawing, WIDTH, HEIGHT, lambda text, size_px, *, bold=False: 0.0)
    found = [(float(one.get("cx")), float(one.get("cy"))) for one in parsed(drawing).iter(f"{SVG}circle")]
    expected = np.column_stack([frame.x.place([1.0, 10.0, 100.0]), frame.y.place([1.0, 2.0, 3.0])])
    np.testing.assert_allclose(found, expected, atol=0.05)


def test_what_is_beyond_a_given_range_is_cut_off():
    line = (series("", [0.0, 10.0], [0.0, 10.0]),)
    assert parsed(Drawing("a", "x", "y", line)).find(f"{SVG}defs") is None
    drawing = Drawing("a", "x", "y", line, x_range=(0.0, 5.0), y_range=(0.0, 5.0))
    root, area = parsed(drawing), frame_of(drawing, WIDTH, HEIGHT, lambda text, size_px, *, bold=False: 0.0).area
    clip = root.find(f"{SVG}defs/{SVG}clipPath")  # elsewhere, readers that cannot clip paint it
    bounds = clip.find(f"{SVG}rect")
    inside = root.find(f"{SVG}g")
    assert inside.get("clip-path") == f"url(#{clip.get('id')})"
    assert inside.find(f"{SVG}polyline") is not None
    assert float(bounds.get("y")) == pytest.approx(area.top)
    assert float(bounds.get("height")) == pytest.approx(area.height)


def test_every_kind_of_shape_has_a_picture():
    heat = HeatMap(np.arange(12, dtype=np.uint8).reshape(3, 4), (0.0, 1.0), (0.0, 1.0), 3.0, 9.0)
    styles = ("line", "dashed", "dots", "stems", "heat")
    shown = tuple(series(style, [0.1, 0.9], [0.2, 0.8], style) for style in styles)
    arrow = series("arrows", [0.1], [0.1], "arrows", to=[[0.5, 0.5]])
    right = Series("right", np.array([0.0, 1.0]), np.array([0.0, 9.0]), right=True)
    lines = (ReferenceLine("x", 0.5), ReferenceLine("y", 0.5, dashed=True, name="half"))
    drawing = Drawing("a", "x", "y", (*shown, arrow, right), right="r, N", lines=lines, heat=heat, note="note")
    tags = {element.tag.removeprefix(SVG) for element in parsed(drawing).iter()}
    assert {"polyline", "path", "circle", "polygon", "linearGradient", "image", "rect", "text"} <= tags


def test_a_heat_map_is_a_picture_whose_first_row_is_below():
    levels = np.array([[0, 100], [200, 255]], np.uint8)
    drawing = Drawing("a", "x", "y", heat=HeatMap(levels, (0.0, 1.0), (0.0, 1.0), 100.0, 255.0))
    image = next(parsed(drawing).iter(f"{SVG}image"))
    data = base64.b64decode(image.get("href").partition("base64,")[2])
    pixels = decoded(data)
    assert pixels[1, 0].tolist() == [0, 0, 0, 0]
    assert pixels[0, 1].tolist() == heat_colours(100.0, 255.0)[255].tolist()
    assert pixels[0, 1, 3] == 255


def decoded(data):
    """Pixels [rows, columns, 4] of a PNG file with a palette, whose lines have no filter."""
    at, chunks = 8, {}
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length]) == (zlib.crc32(kind + body),)
        chunks[kind] = body
        at += 12 + length
    columns, rows, depth, colours, *_ = struct.unpack(">IIBBBBB", chunks[b"IHDR"])
    assert (depth, colours) == (8, 3)
    lines = np.frombuffer(zlib.decompress(chunks[b"IDAT"]), np.uint8).reshape(rows, columns + 1)
    assert not lines[:, 0].any()
    palette = np.column_stack(
        [np.frombuffer(chunks[b"PLTE"], np.uint8).reshape(-1, 3), np.frombuffer(chunks[b"tRNS"], np.uint8)]
    )
    return palette[lines[:, 1:]]


def test_a_png_is_as_large_as_its_levels():
    pixels = decoded(png_of_indices(np.full((5, 7), 200, np.uint8), heat_colours(0.0, 255.0)))
    assert pixels.shape == (5, 7, 4)


def test_a_long_line_makes_a_small_file():
    x = np.linspace(0.0, 1.0, 200_000)
    assert len(svg(Drawing("a", "x", "y", (series("", x, np.sin(1000.0 * x)),)))) < 40_000


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_nothing_that_is_not_finite_is_written(value):
    text = svg(Drawing("a", "x", "y", (series("", [0.0, 1.0, 2.0], [1.0, value, 2.0]),)))
    assert "nan" not in text
    assert "inf" not in text
    assert palette("dark")["ground"] in text
