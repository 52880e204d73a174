"""From one range to another, along a curve, without a step where the ranges move."""

from underfoot.clock import SPAN
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory

RANGES = Layout("ranges", "low", "high", "out_low", "out_high", "exponent")
"""What becomes of what: `low` of the input becomes `out_low`, `high` becomes `out_high`."""
STATE = Layout("mapped", "has_begun", "is_moving", before=RANGES, now=RANGES)
"""The ranges of the span before, those of this one, and whether they differ."""


@kernel
def curve(value: float, low: float, high: float, out_low: float, out_high: float, exponent: float) -> float:
    """A value in the other range, held within it; straight with exponent 1. A range of no width has all at its low end.

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
    """Write the ranges down."""
    ranges.low, ranges.high, ranges.out_low, ranges.out_high = low, high, out_low, out_high
    ranges.exponent = exponent


@kernel
def mapped(value: float, ranges: Memory) -> float:
    """A value by these ranges."""
    return curve(value, ranges.low, ranges.high, ranges.out_low, ranges.out_high, ranges.exponent)


@kernel
def run(signal: Floats, ranges: Memory, frame: int, state: Memory, out: Floats) -> None:
    """Map `signal` into `out`, from session frame `frame` on; along a span from the ranges before to moved ones."""
    if state.has_begun == 0.0:
        state.has_begun = 1.0
        state.before.values[:] = ranges.values
        state.now.values[:] = ranges.values
    for i in range(out.size):
        into = (frame + i) % SPAN
        if into == 0:
            state.before.values[:] = state.now.values
            state.now.values[:] = ranges.values
            state.is_moving = 0.0
            for k in range(ranges.values.size):
                if state.before.values[k] != state.now.values[k]:
                    state.is_moving = 1.0
        out[i] = mapped(signal[i], state.now)
        if state.is_moving != 0.0:
            before = mapped(signal[i], state.before)
            out[i] = before + (out[i] - before) * ((into + 1) / SPAN)


@kernel
def tail(state: Memory) -> float:
    """A bound of what the ranges of the last two spans make of zeros."""
    return max(abs(mapped(0.0, state.now)), abs(mapped(0.0, state.before)))
