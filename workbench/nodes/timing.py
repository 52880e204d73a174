"""Nodes that generate and merge events."""

import math

from underfoot.kernels import kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.signals import noise, rhythm
from underfoot.models.signals.events import AT_ONCE, STARTS, emit
from underfoot.parameters import Choice, Count, Number, Rows
from underfoot.patch.node import Input, Output, node, prepared_columns


@node("strike", "Timing")
class Strike:
    """Event by hand: click the tile in the preview, or press its button."""

    also_called = "bang, trigger"
    accuracy = "exact: between frames, to 1e-12"
    strength = Number(1.0, 0.0, 10.0, scale="gain", doc="strength of a strike at full force")
    by_hand = Input(kind="event", from_engine=True)
    out = Output(kind="event")

    def run(by_hand, strength, out):
        for k in range(len(by_hand)):
            emit(out, by_hand.time[k], by_hand.strength[k] * strength, by_hand.duration[k])


@node("join", "Timing")
class Join:
    """Merge two event streams; events in the same frame add."""

    accuracy = "exact: to 1e-12"
    a = Input(kind="event")
    b = Input(kind="event")
    out = Output(kind="event")
    is_sum = True

    def run(a, b, out):
        i = j = 0
        while i < len(a) or j < len(b):
            if j >= len(b) or (i < len(a) and a.time[i] <= b.time[j]):
                emit(out, a.time[i], a.strength[i], a.duration[i])
                i += 1
            else:
                emit(out, b.time[j], b.strength[j], b.duration[j])
                j += 1


_MOST_WAITING = 4000
"""Events that wait at once: a bundle of 2000 fibres breaks within a step."""


@node("event-delay", "Timing")
class EventDelay:
    """Events, each handed on after a time, as a rattle or a drip. Past 4000 that wait, more are lost.

    A time that changes counts for the events that come from then on.
    """

    also_called = "pipe, wait, later, after, echo"
    accuracy = "exact: to 1e-6 frames after an hour"
    strike = Input(kind="event", doc="strength and duration stay as they are")
    time = Number(0.1, 0.0, 10.0, unit="s", scale="amplitude", wire="span", doc="time until an event is handed on")
    out = Output(kind="event")
    state = Layout("event_delay", "count", due=_MOST_WAITING, strength=_MOST_WAITING, duration=_MOST_WAITING)

    def lasts(values):
        return values["time"]

    def run(strike, time, rate, end, state, out):
        for k in range(len(strike)):
            _hand_on(state, strike.time[k], out)
            _keep(state, strike.time[k] + time * rate, strike.strength[k], strike.duration[k])
        _hand_on(state, float(end), out)

    def tail(state):
        return math.inf if state.count > 0.0 else 0.0


@kernel
def _keep(waiting: Memory, due: float, strength: float, duration: float) -> None:
    """Put an event among those that wait: a binary heap, in which no event is due before its parent, (at - 1) // 2."""
    at = int(waiting.count)
    if at == _MOST_WAITING:
        return
    waiting.count += 1.0
    while at > 0 and waiting.due[(at - 1) // 2] > due:
        _move(waiting, (at - 1) // 2, at)
        at = (at - 1) // 2
    waiting.due[at], waiting.strength[at], waiting.duration[at] = due, strength, duration


@kernel
def _hand_on(waiting: Memory, until: float, out: Memory) -> None:
    """Emit the events that are due before session frame `until`, in order of time."""
    while waiting.count > 0.0 and waiting.due[0] < until:
        emit(out, waiting.due[0], waiting.strength[0], waiting.duration[0])
        waiting.count -= 1.0
        last, at, child = int(waiting.count), 0, 1
        while child < last:
            if child + 1 < last and waiting.due[child + 1] < waiting.due[child]:
                child += 1
            if waiting.due[last] <= waiting.due[child]:
                break
            _move(waiting, child, at)
            at, child = child, 2 * child + 1
        _move(waiting, last, at)


@kernel
def _move(waiting: Memory, source: int, target: int) -> None:
    waiting.due[target], waiting.strength[target] = waiting.due[source], waiting.strength[source]
    waiting.duration[target] = waiting.duration[source]


@node("poisson", "Timing", "Poisson events")
class Poisson:
    """Poisson process: independent events at random times. At strength exactly 0 the node sleeps.

    Events of one frame are one, of their added strength: at an interval of 1 ms and 48 kHz, one in a hundred.
    """

    also_called = "dust, Geiger, impulse, click"
    accuracy = "exact in distribution: exponential intervals, by Kolmogorov-Smirnov at 0.1 %, down to a frame"
    interval = Number(0.02, 1e-3, 10.0, unit="s", scale="log", wire="span", doc="mean time between events")
    strength = Number(1.0, 0.0, 10.0, scale="gain", wire="audio", doc="strength of an event")
    out = Output(kind="event")
    muted_by = ("strength",)
    tail = math.inf

    def distributions(values):
        from underfoot.models.signals.interval_drawings import interval_drawings

        return interval_drawings(values["interval"])

    def run(interval, strength, key, rate, frame, end, out):
        first = len(out)
        noise.impulses(key, interval, rate, frame, end, out)
        for k in range(first, len(out)):
            out.strength[k] *= strength[int(out.time[k]) - frame]


@node("rhythm", "Timing")
class Rhythm:
    """Sequencer, or metronome: notes on a bar of 24 steps, repeated.

    Each note is an event with its amplitude and duration. A wire to the bar sets the pace as it plays.
    """

    also_called = "clock, metro, tempo, BPM, beat, pulse, heartbeat, euclid"
    accuracy = "exact: an onset is off by at most 1e-6 frames after an hour"
    notes = Rows(
        ((0, 4, 1.0), (6, 4, 0.6), (12, 4, 0.6), (18, 4, 0.6)),
        (("step", 0, 23), ("length", 1, 24), ("amplitude", 0.0, 1.0)),
        most=24,
        doc="step, length in whole steps and amplitude of each note; on one step the loudest note plays",
    )
    bar = Number(0.6, 0.1, 4.0, unit="s", wire="span", doc="length of a bar; thesis: 0.45 to 0.75 s")
    repeats = Count(3, 0, 1000, added=0, doc="number of bars played; 0 is endless")
    begin = Choice("at once", options=STARTS, doc="what starts it")
    start = Input(kind="event", doc="starts at the first step; strength scales the notes")
    out = Output(kind="event")
    state = Layout("rhythm", "has_begun", "is_playing", "start", "strength", "bar")

    def lasts(values):
        return values["bar"] * (values["repeats"] or 10)  # ten bars show what an endless one does

    @prepared_columns
    def table(values, rate):
        loudest = {}  # one note per step, on whole steps
        for step, length, loud in values["notes"]:
            loudest[round(step)] = max(loudest.get(round(step), (-1.0, 0.0)), (loud, round(length) / rhythm.STEPS))
        return [(step / rhythm.STEPS, length, loud) for step, (loud, length) in sorted(loudest.items())]

    def run(table, bar, repeats, begin, start, rate, frame, end, state, out):
        bar *= rate
        if bar != state.bar:  # what is left of the rhythm goes on from here at the new pace
            if state.bar != 0.0:
                state.start = frame - (frame - state.start) * (bar / state.bar)
            state.bar = bar
        if begin == AT_ONCE and state.has_begun == 0.0:
            state.has_begun = state.is_playing = state.strength = 1.0
            state.start = frame
        now = frame
        for k in range(len(start) + 1):
            is_restart = k < len(start)
            until = max(now, int(start.time[k])) if is_restart else end
            if state.is_playing == 1.0:
                first = len(out)
                rhythm.play(table, bar, repeats, state.start, now, until, rate, out)
                for note in range(first, len(out)):
                    out.strength[note] *= state.strength
            if is_restart:
                state.has_begun = state.is_playing = 1.0
                state.start, state.strength = start.time[k], start.strength[k]
                now = until
        if repeats > 0 and state.is_playing == 1.0 and end > state.start + repeats * bar:
            state.is_playing = 0.0

    def tail(state):
        return math.inf if state.is_playing == 1.0 else 0.0
