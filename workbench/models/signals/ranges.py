"""Mapping from one range to another along a curve, without jumps when the ranges change."""

from underfoot.clock import SPAN
from underfoot.kernels import Floats, copy, kernel
from underfoot.layouts import Layout, Memory

RANGES = Layout("ranges", "low", "high", "out_low", "out_high", "exponent")
"""Input `low` maps to `out_low`, input `high` to `out_high`."""
STATE = Layout("mapped", "has_begun", "is_moving", before=RANGES, now=RANGES)
"""Ranges of the previous span, those of this one, and whether they differ."""


@kernel
def curve(value: float, low: float, high: float, out_low: float, out_high: float, exponent: float) -> float:
    """Map a value to the other range and clip it; linear with exponent 1. An empty range maps all to its low end.

    >>> [curve(force_n, 0.0, 700.0, 100.0, 900.0, 2.0) for force_n in (350.0, -1.0, 999.0)]
    [300.0, 100.0, 900.0]
    """
    slope = 0.0 if high == low else 1.0 / (high - low)
    share = min(max((value - low) * slope, 0.0), 1.0)
    if exponent != 1.0:
        share **= exponent
    return out_low + share * (out_high - out_low)


@kernel
def design(low: float, high: float, out_low: float, out_high: float, exponent: float, ranges: Memory) -> None:
    """Store the ranges."""
    ranges.low, ranges.high, ranges.out_low, ranges.out_high = low, high, out_low, out_high
    ranges.exponent = exponent


@kernel
def run(signal: Floats, ranges: Memory, frame: int, state: Memory, out: Floats) -> None:
    """Map `signal` into `out`, from session frame `frame` on; changed ranges are interpolated over a span."""
    if state.has_begun == 0.0:
        state.has_begun = 1.0
        copy(ranges.values, state.before.values)
        copy(ranges.values, state.now.values)
    i = 0
    while i < out.size:
        into = (frame + i) % SPAN
        if into == 0:
            copy(state.now.values, state.before.values)
            copy(ranges.values, state.now.values)
            state.is_moving = not _same(state.before, state.now)
        is_steady = state.is_moving == 0.0 and _same(state.now, ranges)
        end = out.size if is_steady else min(out.size, i + SPAN - into)
        _map(signal[i:end], state.now, out[i:end])
        if state.is_moving != 0.0:
            for j in range(i, end):
                before = mapped(signal[j], state.before)
                out[j] = before + (out[j] - before) * ((into + 1 + j - i) / SPAN)
        i = end


@kernel
def mapped(value: float, ranges: Memory) -> float:
    """Map a value by these ranges."""
    return curve(value, ranges.low, ranges.high, ranges.out_low, ranges.out_high, ranges.exponent)


@kernel
def _map(signal: Floats, ranges: Memory, out: Floats) -> None:
    low, high, out_low, out_high = ranges.low, ranges.high, ranges.out_low, ranges.out_high
    if ranges.exponent == 1.0:
        for i in range(out.size):
            out[i] = curve(signal[i], low, high, out_low, out_high, 1.0)
    else:
        for i in range(out.size):
            out[i] = mapped(signal[i], ranges)


@kernel
def _same(a: Memory, b: Memory) -> bool:
    same = True
    for k in range(a.values.size):
        same &= a.values[k] == b.values[k]
    return same


@kernel
def tail(state: Memory) -> float:
    """Return a bound of |output| for zero input, with the ranges of the last two spans."""
    return max(abs(mapped(0.0, state.now)), abs(mapped(0.0, state.before)))
