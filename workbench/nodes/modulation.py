"""Modulators: slow signals that drive the parameters of other nodes, in their unit."""

import math

from underfoot.layouts import Layout
from underfoot.models.signals import low_frequency, polyline, random_walk, ranges, steps
from underfoot.models.signals.glide import glided
from underfoot.nodes.shapes import FARTHEST, Mapped
from underfoot.parameters import Choice, Number, Numbers, Rows
from underfoot.patch.node import Input, Output, node, prepared, prepared_columns

AT_EVENTS = 1
"""Index of "at events" in the options of `pace`."""


def _low(wire: str = "audio") -> Number:
    return Number(
        0.0, -FARTHEST, FARTHEST, wire=wire, unit_of="out", doc="lower end, in the unit of the driven parameter"
    )


def _high(wire: str = "audio") -> Number:
    return Number(
        1.0,
        -FARTHEST,
        FARTHEST,
        wire=wire,
        unit_of="out",
        doc="upper end, in the unit of the driven parameter; below the lower end it inverts the signal",
    )


@node("lfo", "Modulation", "LFO")
class Lfo:
    """Low-frequency oscillator between low and high. Its phase counts from the start of the session, or from an event.

    Edges of saw and square, and restarts, take 1 ms, so that they do not click.
    """

    also_called = "phasor, vibrato"
    accuracy = "exact: the closed form, to 1e-9 after ten seconds"
    restart = Input(kind="event", doc="restarts the wave at its phase")
    shape = Choice("sine", options=low_frequency.SHAPES, doc="waveform")
    frequency = Number(1.0, 0.01, 50.0, unit="Hz", scale="log", wire="span", doc="frequency of the wave")
    phase = Number(0.0, 0.0, 1.0, doc="start phase in periods: 0.25 is a quarter")
    low, high = _low(), _high()
    out = Output(doc="from low to high")
    state = low_frequency.STATE
    tail = math.inf

    def run(restart, shape, frequency, phase, low, high, rate, frame, state, out):
        low_frequency.run(restart, shape, frequency, phase, rate, frame, state, out)
        for i in range(out.size):
            out[i] = low[i] + (high[i] - low[i]) * (0.5 + 0.5 * out[i])


@node("random-walk", "Modulation")
class RandomWalk:
    """Ornstein-Uhlenbeck process: a random value that reverts to its mean, independent on each tile."""

    also_called = "drunk, drift, wander"
    accuracy = "exact in distribution at every 32nd frame, by Kolmogorov-Smirnov at 0.1 %; linear between"
    time = Number(1.0, 0.01, random_walk.LONGEST_S, unit="s", scale="log", wire="span", doc="correlation time, to 1/e")
    centre = Number(
        0.0, -FARTHEST, FARTHEST, wire="audio", unit_of="out", doc="mean, in the unit of the driven parameter"
    )
    deviation = Number(
        1.0, 0.0, FARTHEST, wire="audio", unit_of="out", doc="standard deviation: two thirds of the time it is less"
    )
    out = Output()
    state, coefficients = random_walk.STATE, random_walk.COEFFICIENTS
    tail = math.inf

    def design(time, rate, coefficients):
        random_walk.design(time, rate, coefficients)

    def run(centre, deviation, key, frame, coefficients, state, out):
        random_walk.run(key, frame, coefficients, state, out)
        for i in range(out.size):
            out[i] = centre[i] + deviation[i] * out[i]


@node("step-sequence", "Modulation")
class StepSequence:
    """Sequencer of values: a list that is played in a loop, at a frequency or one value per event."""

    also_called = "table, coll, counter"
    accuracy = "exact: to 1e-12"
    advance = Input(kind="event", doc="next step (at events), or first step (at its frequency)")
    values = Numbers((1.0, 0.5, 0.0, 0.5), 0.0, 1.0, most=64, doc="value of each step, from 0 (low) to 1 (high)")
    pace = Choice("at its frequency", options=("at its frequency", "at events"), doc="what advances the sequence")
    frequency = Number(4.0, 0.01, 50.0, unit="Hz", scale="log", wire="span", doc="steps per second")
    glide = Number(0.005, 0.0, 2.0, unit="s", scale="amplitude", doc="transition time between values; 0 is a jump")
    low, high = _low(), _high()
    out = Output(doc="from low to high")
    state = steps.SEQUENCE
    tail = math.inf

    @prepared
    def held(values, rate):
        return values["values"]

    def run(advance, held, pace, frequency, glide, low, high, rate, frame, state, out):
        steps_a_frame = 0.0 if pace == AT_EVENTS else frequency / rate
        steps.play(held, steps_a_frame, advance, glide * rate, frame, state, out)
        for i in range(out.size):
            out[i] = low[i] + (high[i] - low[i]) * out[i]


@node("stance-curve", "Modulation")
class StanceCurve:
    """Curve over the stance of a foot, from heel to toes: 0 % at its landing, 100 % after the duration.

    The last value is held until the foot leaves; then the curve returns to its start. Jumps take 5 ms.
    """

    also_called = "function, roll"
    accuracy = "exact: linear between points, to 1e-9"
    force = Input("N", doc="usually from Tile force; the foot is down while the force is above 0")
    curve = Rows(
        ((0.0, 0.0), (50.0, 1.0), (100.0, 0.0)),
        (("stance %", 0.0, 100.0), ("value", 0.0, 1.0)),
        most=64,
        doc="points of the curve, linear between: 0 is low, 1 is high",
    )
    duration = Number(0.7, 0.05, 10.0, unit="s", scale="log", doc="expected duration of a stance")
    low, high = _low(wire=""), _high(wire="")
    out = Output(doc="from low to high")
    state = Layout("stance_curve", "has_begun", "share", "value", "low", "high")

    @prepared_columns
    def points(values, rate):
        return polyline.table([(0.01 * share, value) for share, value in values["curve"]])

    def run(force, points, duration, low, high, rate, frame, state, out):
        fastest = 1.0 / (0.005 * rate)
        if state.has_begun == 0.0:
            state.has_begun, state.value = 1.0, polyline.value_at(points, 0.0)
            state.low, state.high = low, high
        for i in range(out.size):
            # The share is accumulated, so that a change of the duration does not move it.
            state.share = state.share + 1.0 / (duration * rate) if force[i] > 0.0 else 0.0
            way = polyline.value_at(points, state.share) - state.value
            state.value += min(max(way, -fastest), fastest)
            state.low, state.high = glided(state.low, low, frame + i), glided(state.high, high, frame + i)
            out[i] = state.low + (state.high - state.low) * state.value

    def tail(points, low, high, state):
        rest = polyline.value_at(points, 0.0)
        at_rest = abs(low + (high - low) * rest)
        if state.has_begun == 0.0 or (state.value == rest and state.low == low and state.high == high):
            return at_rest
        return max(at_rest, abs(low), abs(high), abs(state.low), abs(state.high))


@node("map", "Modulation")
class Map(Mapped):
    """Map a signal from one range to another along a power curve, clipped at its ends: 0 to 700 N to 100 to 900 Hz."""

    also_called = (
        "map range, color ramp, colour ramp, curve, clamp, limiter, saturate, threshold, compare, min, max, >, math"
    )
    exponent = Number(1.0, 0.1, 10.0, scale="log", doc="exponent of the curve: 1 linear, 2 late rise, 0.5 early rise")

    def design(low, high, out_low, out_high, exponent, coefficients):
        ranges.design(low, high, out_low, out_high, exponent, coefficients)

    def tail(low, high, out_low, out_high, exponent, state):
        return max(abs(ranges.curve(0.0, low, high, out_low, out_high, exponent)), ranges.tail(state))


@node("sample-and-hold", "Modulation", "Sample and hold")
class SampleAndHold:
    """Value of the signal at the last event, held until the next; 0 before the first."""

    also_called = "S&H, SAH, samphold, latch, snapshot"
    accuracy = "exact: the frame of the event, to 1e-12"
    signal = Input(doc="any unit")
    trigger = Input(kind="event", doc="samples the signal")
    glide = Number(0.005, 0.0, 2.0, unit="s", scale="amplitude", doc="transition time between values; 0 is a jump")
    out = Output()
    state = steps.HELD

    def run(signal, trigger, glide, rate, frame, state, out):
        steps.sample(signal, trigger, glide, rate, frame, state, out)

    def tail(state):
        return max(abs(state.begin), abs(state.target))


@node("value", "Modulation")
class Value:
    """Constant that is set by hand, from low to high: one knob or slider for several parameters."""

    also_called = "number, float, dial, macro, constant"
    accuracy = "exact: to 1e-12"
    position = Number(0.5, 0.0, 1.0, wire="audio", doc="0 is low, 1 is high")
    low, high = _low(), _high()
    out = Output(doc="from low to high")
    tail = math.inf

    def run(position, low, high, out):
        for i in range(out.size):
            out[i] = low[i] + (high[i] - low[i]) * position[i]
