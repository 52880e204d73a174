"""Axes: tick positions and texts, ends, and conversion between values and pixels."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.drawing import Range
from underfoot.quantities import number

_NEAR_TICK = 0.4
"""Distance beyond the data, as a share of a tick step, within which an axis ends at the next tick."""
_BEYOND = 0.04
"""Otherwise the axis extends beyond the data by this share of their span."""
_MOST_TICKS = 10.0
"""Approximate largest number of ticks."""
_NARROW = 4.0
"""Smallest ratio of the ends of a logarithmic axis; below it, ticks are evenly spaced."""


class Axis(Struct, frozen=True):
    """Range from `low` to `high`, drawn from pixel `start` to pixel `end`; `ticks` are values and their texts."""

    low: float
    high: float
    log: bool
    start: float
    end: float
    ticks: tuple[tuple[float, str], ...] = ()

    def place(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return the pixels of `values`, any shape; NaN at or below 0 on a logarithmic axis.

        >>> Axis(1.0, 100.0, True, 0.0, 200.0).place([1.0, 10.0, 100.0])
        array([  0., 100., 200.])
        """
        low, high = scaled(np.array([self.low, self.high]), log=self.log)
        return self.start + (scaled(values, log=self.log) - low) * ((self.end - self.start) / (high - low))

    def value(self, place_px: float) -> float:
        """Return the value at a pixel.

        >>> round(Axis(1.0, 100.0, True, 0.0, 200.0).value(100.0), 9)
        10.0
        """
        low, high = scaled(np.array([self.low, self.high]), log=self.log)
        at = float(low + (place_px - self.start) / (self.end - self.start) * (high - low))
        return 10.0**at if self.log else at


def scaled(values: ArrayLike, *, log: bool) -> NDArray[np.float64]:
    """Return `values` as spaced by an axis: log10 on a logarithmic one, NaN where undefined."""
    as_floats = np.asarray(values, np.float64)
    return np.log10(np.where(as_floats > 0.0, as_floats, np.nan)) if log else as_floats


def span(values: NDArray[np.float64], *, log: bool) -> Range:
    """Return the smallest and largest value that an axis can show, never equal.

    >>> span(np.array([2.0, np.nan, 5.0, -1.0]), log=True), span(np.array([2.0]), log=False)
    ((2.0, 5.0), (1.0, 3.0))
    >>> span(np.zeros(0), log=False)
    (0.0, 1.0)
    """
    shown = values[np.isfinite(values) & ((values > 0.0) | (not log))]
    if not shown.size:
        return (1.0, 10.0) if log else (0.0, 1.0)
    low, high = float(shown.min()), float(shown.max())
    if high - low > 1e-9 * max(abs(low), abs(high)):
        return low, high
    if log:
        return low / 1.5, high * 1.5
    room = 0.5 * abs(low) or 0.5
    return low - room, high + room


def round_axis(shown: Range, start: float, end: float, least_px: float, *, log: bool) -> Axis:
    """Return an axis for data over `shown` that ends at round ticks or slightly beyond the data; ticks at least
    `least_px` apart."""
    low, high = scaled(np.array(shown), log=log)
    places = _ticks(shown, start, end, least_px, log=log)
    first, last = scaled(np.array([places[0], places[-1]]), log=log)
    room, near = _BEYOND * (high - low), _NEAR_TICK * (last - first) / max(len(places) - 1, 1)
    begin = first if 0.0 <= low - first <= near else low - room
    finish = last if 0.0 <= last - high <= near else high + room
    ends = (10.0**begin, 10.0**finish) if log else (begin, finish)
    return _axis((float(ends[0]), float(ends[1])), start, end, places, log=log)


def fixed_axis(shown: Range, start: float, end: float, least_px: float, *, log: bool) -> Axis:
    """Return an axis with exactly this range; ticks at least `least_px` apart."""
    return _axis(shown, start, end, _ticks(shown, start, end, least_px, log=log), log=log)


def _ticks(shown: Range, start: float, end: float, least_px: float, *, log: bool) -> list[float]:
    return tick_values(*shown, min(abs(end - start) / least_px, _MOST_TICKS), log=log)


def _axis(ends: Range, start: float, end: float, places: Sequence[float], *, log: bool) -> Axis:
    slack = 1e-6 * (ends[1] - ends[0])
    inside = [
        at for at in places if ends[0] - min(slack, 1e-6 * abs(ends[0]) if log else slack) <= at <= ends[1] + slack
    ]
    return Axis(*ends, log, start, end, tuple(zip(inside, tick_texts(inside), strict=True)))


def tick_values(low: float, high: float, room: float, *, log: bool) -> list[float]:
    """Return round values from `low` or below to `high` or above, about as many as there is `room` for.

    A logarithmic axis has 1, 2 and 5 of each decade, or decades alone; one that spans less than a factor of 4 has even
    steps.

    >>> tick_values(0.3, 41.0, 5.0, log=False)
    [0.0, 10.0, 20.0, 30.0, 40.0, 50.0]
    >>> tick_values(1.0, 100.0, 3.0, log=True), tick_values(55.0, 800.0, 6.0, log=True)
    ([1.0, 10.0, 100.0], [50.0, 100.0, 200.0, 500.0, 1000.0])
    """
    room = max(room, 2.0)
    even = _even(low, high, room) if not log or high < _NARROW * low else []
    if even and (even[0] > 0.0 or not log):
        return even
    decades = math.log10(high / low)
    steps = (1, 2, 5) if 2.0 * decades <= room else (1,)
    exponents = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    every = [float(f"{step}e{exponent}") for exponent in exponents for step in steps]
    first = max((i for i, at in enumerate(every) if at <= low * (1 + 1e-6)), default=0)
    last = min((i for i, at in enumerate(every) if at >= high * (1 - 1e-6)), default=len(every) - 1)
    skip = max(1, round((last - first) / room))
    return every[first : last + skip : skip]


def _even(low: float, high: float, room: float) -> list[float]:
    step = (high - low) / room
    power = 10.0 ** math.floor(math.log10(step))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= step * (1.0 - 1e-9))
    return [k * step for k in range(math.floor(low / step + 1e-6), math.ceil(high / step - 1e-6) + 1)]


def tick_texts(values: Sequence[float]) -> list[str]:
    """Return the texts of ticks, with as many digits as distinguish them.

    >>> tick_texts([0.0, 20_000.0]), tick_texts([100_000.0, 100_000.2])
    (['0', '20\\u202f000'], ['100\\u202f000', '100\\u202f000.2'])
    """
    digits = 4
    if len(values) > 1:
        closest = min(abs(b - a) for a, b in pairwise(values))
        largest = max(abs(value) for value in values)
        digits = max(digits, 1 + math.floor(math.log10(largest) + 1e-9) - math.floor(math.log10(closest) + 1e-9))
    return [number(0.0 if abs(value) < 1e-12 * max(map(abs, values)) else value, digits) for value in values]


def unit_of(label: str) -> str:
    """Return the unit in an axis label "name, unit"; "" if it has none.

    >>> unit_of("acceleration, m/s^2"), unit_of("ratio")
    ('m/s^2', '')
    """
    return label.rpartition(", ")[2] if ", " in label else ""


def round_top(value: float) -> float:
    """Return the smallest 1, 2 or 5 times a power of ten that is not below `value`, as the end of an axis.

    >>> round_top(730.0), round_top(1200.0), round_top(0.0)
    (1000.0, 2000.0, 1.0)
    """
    if value <= 0.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(value))
    return next((step * power for step in (1.0, 2.0, 5.0) if value <= step * power * (1 + 1e-12)), 10.0 * power)
