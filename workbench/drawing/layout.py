"""Layout of a plot: title, legend, axes with ticks and labels, and the data.

There are two layouts: with title, legend and labels around the axes, for a report; or compact, in given margins, with
the unit at an axis's last tick and the legend over the data, if it fits. The painter measures text, and gets shapes in
pixels.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.drawing import Drawing, Range, Series
from underfoot.drawing.axes import Axis, fixed_axis, round_axis, span, unit_of
from underfoot.drawing.look import SMALL_PX, TITLE_PX
from underfoot.drawing.shapes import Backdrop, Box, HeatImage, Segments, Shape, Text, key_of, shapes_of
from underfoot.quantities import pretty_text, pretty_unit


class Measure(Protocol):
    """Returns the width in pixels of a text in the display's font."""

    def __call__(self, text: str, size_px: int, *, bold: bool = False) -> float: ...


AXIS_PX = 56
"""Width of a vertical axis with its texts; constant, so that stacked plots share a time axis."""
BELOW_PX = 20
"""Height of a horizontal axis with its texts."""
TICK_PX, COMPACT_TICK_PX = (72.0, 36.0), (48.0, 26.0)
"""Smallest distance of ticks, horizontally and vertically."""

_PAD, _RIGHT = 8.0, 16.0
_TITLE_LINE_PX, _LINE_PX = 20.0, 16.0
_KEY_PX, _KEY_GAP_PX, _KEYS_APART_PX = 16.0, 6.0, 16.0
_TEXT_GAP_PX = 6.0
_ROOM_PX = 14.0
"""Smallest margin with texts in it."""


class Margins(Struct, frozen=True):
    """Pixels around the axes of a compact plot. Texts of an axis are omitted if they do not fit."""

    left: float = AXIS_PX
    top: float = _PAD
    right: float = _RIGHT
    bottom: float = BELOW_PX


class Frame(Struct, frozen=True):
    """Plot without its data: the axes, the shapes of everything around and behind the data, and those over it."""

    area: Box
    x: Axis
    y: Axis
    right: Axis | None
    shapes: tuple[Shape, ...]
    above: tuple[Shape, ...] = ()


def frame_of(drawing: Drawing, width: float, height: float, measure: Measure, margins: Margins | None = None) -> Frame:
    """Return the frame of a drawing, compact if `margins` are given."""
    if margins is not None:
        area = _within(margins.left, margins.top, width - margins.right, height - margins.bottom)
        head: list[Shape] = []
    else:
        area, head = _head(drawing, width, height, measure)
    x, y, right = _axes(drawing, area, TICK_PX if margins is None else COMPACT_TICK_PX)
    if drawing.x_names:
        x = _named_axis(drawing.x_names, area, measure)
    shapes = [*head, *_grid(area, x, y), *_tick_texts(drawing, width, area, x, y, measure, margins)]
    if right is not None:
        shapes += _right_texts(drawing, area, right, margins)
    above = () if margins is None else tuple(_legend_inside(drawing, area, measure))
    return Frame(area, x, y, right, tuple(shapes), above)


def is_cut_off(drawing: Drawing) -> bool:
    """Return whether data may lie beyond the axes, because a range is given."""
    return not (drawing.x_range is None and drawing.y_range is None and drawing.right_range is None)


def content_of(drawing: Drawing, frame: Frame, measure: Measure) -> Iterator[Shape]:
    """Yield the shapes of a drawing's data in its frame, from bottom to top."""
    area, x, y = frame.area, frame.x, frame.y
    if drawing.heat is not None:
        (left, right), (bottom, top) = x.place(drawing.heat.x), y.place(drawing.heat.y)
        box = Box(float(left), float(top), float(right), float(bottom))
        yield HeatImage(drawing.heat.levels, drawing.heat.low, drawing.heat.high, box)
    marks = [line for line in drawing.lines if math.isfinite(line.at)]
    for line in marks:
        at = pixel_centre(float((x if line.axis == "x" else y).place(line.at)))
        ends = [(at, area.bottom), (at, area.top)] if line.axis == "x" else [(area.left, at), (area.right, at)]
        yield Segments(np.array([ends]), line.colour, line.dashed)
    for series in drawing.series:
        yield from shapes_of(series, x, frame.right if series.right and frame.right is not None else y)
        yield from _labels_of(series, x, y, area, measure)
    for line in marks:
        if line.name:
            top = float(y.place(line.at)) if line.axis == "y" else area.top
            wide = measure(line.name, SMALL_PX) + 8.0
            right = area.right if line.axis == "y" else min(float(x.place(line.at)) + wide + 2.0, area.right)
            yield Backdrop(Box(right - wide, top + 2.0, right, top + 2.0 + _LINE_PX))
            yield Text(line.name, right - 4.0, top + 14.0, "muted", "end")
    if not drawing.note:
        yield from frame.above
    else:
        yield from _note(drawing.note, area, measure)


def _labels_of(series: Series, x: Axis, y: Axis, area: Box, measure: Measure) -> Iterator[Shape]:
    """Yield the label of each point, to its right, or, at the right edge, to its left."""
    for label, across, up in zip(series.labels, x.place(series.x), y.place(series.y), strict=False):
        if math.isfinite(across) and math.isfinite(up):
            is_left = across + _PAD + measure(label, SMALL_PX) > area.right
            place = float(across) + (-_PAD if is_left else _PAD)
            yield Text(label, place, float(up) + 4.0, "text", "end" if is_left else "start")


def _note(note: str, area: Box, measure: Measure) -> Iterator[Shape]:
    """Yield a note in the middle of the axes, in as many lines as it needs there: what is wider would be cut off."""
    lines = _wrapped(note, area.width, lambda text: measure(text, SMALL_PX + 2))
    x_px, y_px = (area.left + area.right) / 2.0, (area.top + area.bottom) / 2.0
    half = max(measure(line, SMALL_PX + 2) for line in lines) / 2.0 + 4.0
    above = (len(lines) - 1) * _LINE_PX / 2.0
    yield Backdrop(Box(x_px - half, y_px - above - 9.0, x_px + half, y_px + above + 9.0))
    for number, line in enumerate(lines):
        yield Text(line, x_px, y_px - above + number * _LINE_PX + 4.0, "muted", "middle", SMALL_PX + 2)


def _legend_inside(drawing: Drawing, area: Box, measure: Measure) -> Iterator[Shape]:
    """Yield the legend of a compact plot, in one row at the upper right; the axis on the right has its data's colour.

    One series has none, and what is wider than two thirds of the axes is left out.
    """
    named = [series for series in drawing.series if series.has_key and not series.right]
    room = area.width * 2.0 / 3.0
    rows = _legend_rows(named, room, measure)
    if len(named) < 2 or len(rows) != 1:
        return
    left, last = rows[0][-1]
    wide = left + _KEY_PX + _KEY_GAP_PX + measure(pretty_text(last.name), SMALL_PX) + _PAD
    if wide > room:
        return
    begin = area.right - wide
    yield Backdrop(Box(begin, area.top, area.right, area.top + _LINE_PX))
    for left, one in rows[0]:
        yield from _legend_entry(one, begin + left, area.top)


def _within(left: float, top: float, right: float, bottom: float) -> Box:
    """Return the area of the axes: at least one pixel, however small the picture is."""
    return Box(left, top, max(right, left + 1.0), max(bottom, top + 1.0))


def pixel_centre(at: float) -> float:
    """Return the centre of a pixel, so that a line there is one pixel wide and sharp."""
    return math.floor(at) + 0.5


def _head(drawing: Drawing, width: float, height: float, measure: Measure) -> tuple[Box, list[Shape]]:
    """Return title, legend and labels, and the area that they leave for the axes."""
    shapes: list[Shape] = []
    room, top = width - 2.0 * _PAD, 0.0
    for line in _wrapped(pretty_text(drawing.title), room, lambda text: measure(text, TITLE_PX, bold=True)):
        shapes.append(Text(line, _PAD, top + 16.0, "text", "start", TITLE_PX, bold=True))
        top += _TITLE_LINE_PX
    for row in _legend_rows([series for series in drawing.series if series.has_key], room, measure):
        for left, one in row:
            shapes += _legend_entry(one, left, top)
        top += _LINE_PX
    right_margin = AXIS_PX if drawing.right else _RIGHT
    area = _within(AXIS_PX, top + _LINE_PX + _PAD, width - right_margin, height - BELOW_PX - _LINE_PX)
    shapes.append(Text(f"↑ {pretty_text(drawing.y)}", _PAD, top + 12.0, "muted"))
    along = _cut(pretty_text(drawing.x), area.right - _PAD - measure(" →", SMALL_PX), measure)
    shapes.append(Text(f"{along} →", area.right, height - 5.0, "muted", "end"))
    if drawing.right:
        label = f"{pretty_text(drawing.right)} ↑"
        shapes.append(Text(label, width - _PAD, top + 12.0, _right_colour(drawing), "end"))
    return area, shapes


def _cut(text: str, room: float, measure: Measure) -> str:
    """Return as much of a text as there is room for."""
    if measure(text, SMALL_PX) <= room:
        return text
    while text and measure(f"{text}…", SMALL_PX) > room:
        text = text[:-1]
    return f"{text}…"


def _wrapped(text: str, room: float, measure: Callable[[str], float]) -> list[str]:
    """Break a text into lines no wider than `room`, at spaces; an empty text has no lines."""
    lines: list[str] = []
    for word in text.split(" ") if text else []:
        if lines and measure(f"{lines[-1]} {word}") <= room:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return lines


def _legend_rows(named: Sequence[Series], room: float, measure: Measure) -> list[list[tuple[float, Series]]]:
    """Return the series of a legend in rows, each with its left edge."""
    rows: list[list[tuple[float, Series]]] = []
    left = 0.0
    for one in named:
        wide = _KEY_PX + _KEY_GAP_PX + measure(pretty_text(one.name), SMALL_PX)
        if not rows or left + wide > room + _PAD:
            rows.append([])
            left = _PAD
        rows[-1].append((left, one))
        left += wide + _KEYS_APART_PX
    return rows


def _legend_entry(one: Series, left: float, top: float) -> Iterator[Shape]:
    yield from key_of(one, left, top + 8.5, _KEY_PX)
    yield Text(pretty_text(one.name), left + _KEY_PX + _KEY_GAP_PX, top + 12.0, "text")


def _axes(drawing: Drawing, area: Box, tick_px: tuple[float, float]) -> tuple[Axis, Axis, Axis | None]:
    across, up = tick_px
    ends = [series.to for series in drawing.series if series.to is not None]
    mine = [series for series in drawing.series if not series.right]
    x_shown = drawing.x_range or span(
        _joined([series.x for series in drawing.series] + [to[:, 0] for to in ends]), log=drawing.x_log
    )
    y_shown = drawing.y_range or span(
        _joined([one.outline_y for one in mine] + [to[:, 1] for to in ends]), log=drawing.y_log
    )
    x_make = y_make = fixed_axis
    if drawing.equal and not (drawing.x_log or drawing.y_log):
        per_px = max((x_shown[1] - x_shown[0]) / area.width, (y_shown[1] - y_shown[0]) / area.height)
        x_shown, y_shown = _widened(x_shown, per_px * area.width), _widened(y_shown, per_px * area.height)
    else:
        x_make = fixed_axis if drawing.x_range else round_axis
        y_make = fixed_axis if drawing.y_range else round_axis
    x = x_make(x_shown, area.left, area.right, across, log=drawing.x_log)
    y = y_make(y_shown, area.bottom, area.top, up, log=drawing.y_log)
    if not drawing.right:
        return x, y, None
    right_shown = drawing.right_range or span(
        _joined([series.y for series in drawing.series if series.right]), log=False
    )
    right_make = fixed_axis if drawing.right_range else round_axis
    return x, y, right_make(right_shown, area.bottom, area.top, up, log=False)


def _named_axis(names: Sequence[str], area: Box, measure: Measure) -> Axis:
    """Return the horizontal axis with a name below each of 1, 2, …, as much of it as there is room for."""
    room = area.width / len(names) - 2.0 * _PAD
    ticks = tuple((float(place), _cut(pretty_text(name), room, measure)) for place, name in enumerate(names, 1))
    return Axis(0.5, len(names) + 0.5, False, area.left, area.right, ticks)


def _joined(values: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.concatenate([np.empty(0), *values])


def _widened(shown: Range, length: float) -> Range:
    """Return a range slightly longer than `length`, around the centre of another."""
    middle, half = (shown[0] + shown[1]) / 2.0, 0.53 * length
    return middle - half, middle + half


def _grid(area: Box, x: Axis, y: Axis) -> Iterator[Shape]:
    across, up = ([pixel_centre(at) for at in axis.place([value for value, _ in axis.ticks])] for axis in (x, y))
    upright = [((at, area.top), (at, area.bottom)) for at in across]
    level = [((area.left, at), (area.right, at)) for at in up]
    yield Segments(np.array([*upright, *level]).reshape(-1, 2, 2), "grid")
    left, bottom = pixel_centre(area.left), pixel_centre(area.bottom)
    yield Segments(np.array([[(left, bottom), (area.right, bottom)], [(left, area.top), (left, bottom)]]), "line")


def _tick_texts(
    drawing: Drawing, width: float, area: Box, x: Axis, y: Axis, measure: Measure, margins: Margins | None
) -> Iterator[Shape]:
    if margins is None or margins.bottom >= _ROOM_PX:
        *others, (last, with_unit) = _with_unit(x, drawing.x if margins else "")
        half = measure(with_unit, SMALL_PX) / 2.0 + 1.0
        middle = min(max(float(x.place(last)), half), width - half)
        end = middle - half - _PAD
        placed = []
        for at, text in others:
            wide = measure(text, SMALL_PX) + 2.0
            left = max(float(x.place(at)) - wide / 2.0, 0.0)
            placed.append((text, left + wide / 2.0, left + wide <= end))
        # The last is longer than they are, and moved to the left if it has no room: then every second has a text.
        step = 2 if not x.log and placed and not placed[-1][2] else 1
        for text, at, fits in placed[-step::-step][::-1]:
            if fits:
                yield Text(text, at, area.bottom + 15.0, "muted", "middle")
        yield Text(with_unit, middle, area.bottom + 15.0, "muted", "middle")
    if margins is None or margins.left >= _ROOM_PX:
        for at, text in _with_unit(y, drawing.y if margins else ""):
            yield Text(text, area.left - _TEXT_GAP_PX, float(y.place(at)) + 4.0, "muted", "end")


def _right_texts(drawing: Drawing, area: Box, right: Axis, margins: Margins | None) -> Iterator[Shape]:
    for at, text in _with_unit(right, drawing.right if margins else ""):
        yield Text(text, area.right + _TEXT_GAP_PX, float(right.place(at)) + 4.0, _right_colour(drawing))


def _right_colour(drawing: Drawing) -> str:
    """Return the colour of the data on the right axis."""
    return next((series.colour for series in drawing.series if series.right), "muted")


def _with_unit(axis: Axis, label: str) -> list[tuple[float, str]]:
    """Return ticks and their texts, the last with the unit of the label."""
    unit = pretty_unit(unit_of(label))
    *others, (last, text) = axis.ticks or ((axis.high, ""),)
    return [*others, (last, f"{text} {unit}" if unit and text else text)]
