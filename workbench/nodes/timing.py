"""When things happen: nodes that make and join events."""

from underfoot.models.signals import noise, rhythm
from underfoot.parameters import Choice, Count, Number, Rows
from underfoot.patch.node import NEVER, Input, Output, emit, frames, grow, node, rest_kernel, room, run_kernel


@node("strike", "Timing")
class Strike:
    """An event by hand: click the tile in the preview, or press its button."""

    strength = Number(1.0, 0.0, 10.0, doc="strength of a strike at full force")
    out = Output(kind="event")
    is_struck = True

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        struck = e[0]
        for i in range(struck[0]):
            emit(o[0], struck[3 * i + 1], struck[3 * i + 2] * c[0], struck[3 * i + 3])


@node("join", "Timing")
class Join:
    """The events of two wires on one; events in the same frame add."""

    a = Input(kind="event")
    b = Input(kind="event")
    out = Output(kind="event")

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        a, b = e[0], e[1]
        i = j = 0
        while i < a[0] or j < b[0]:
            if j >= b[0] or (i < a[0] and a[3 * i + 1] <= b[3 * j + 1]):
                emit(o[0], a[3 * i + 1], a[3 * i + 2], a[3 * i + 3])
                i += 1
            else:
                emit(o[0], b[3 * j + 1], b[3 * j + 2], b[3 * j + 3])
                j += 1


@node("poisson", "Timing", "Poisson events")
class Poisson:
    """Events at random moments, independent of one another. At strength exactly 0 the node sleeps."""

    interval = Number(0.02, 1e-3, 10.0, unit="s", scale="log", wire="span", doc="mean time from event to event")
    strength = Number(1.0, 0.0, 10.0, wire="audio", doc="strength of an event")
    out = Output(kind="event")
    muted_by = ("strength",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        events = room(o[0], n)
        count = noise.impulses(key, c[0], rate, frame, n, events)
        for i in range(count):
            events[3 * i + 1] *= x[0][int(events[3 * i]) - frame]
        grow(o[0], count)

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER


@node("rhythm", "Timing")
class Rhythm:
    """Notes on a bar of 24 steps, played a few times over; each note is an event with its amplitude and duration."""

    notes = Rows(
        ((0, 4, 1.0), (6, 4, 0.6), (12, 4, 0.6), (18, 4, 0.6)),
        (("step", 0, 23), ("length", 1, 24), ("amplitude", 0.0, 1.0)),
        most=24,
        doc="each note's step, length in whole steps and amplitude; of those on one step the loudest plays",
    )
    bar = Number(0.6, 0.1, 4.0, unit="s", doc="length of a bar; the thesis used 0.45 to 0.75 s")
    repeats = Count(3, 0, 1000, doc="how often the bar is played; 0: for ever")
    begin = Choice("at once", options=("at once", "at events"), doc="what starts it")
    start = Input(kind="event", doc="plays it from the first step, at the event's strength")
    out = Output(kind="event")
    state = 3  # session frame of the first bar, strength, 1 while playing or 2 when played out

    def prepare(values, rate):
        loudest = {}  # one note a step, on whole steps
        for step, length, loud in values["notes"]:
            loudest[round(step)] = max(loudest.get(round(step), (-1.0, 0.0)), (loud, round(length) / rhythm.STEPS))
        table = [(step / rhythm.STEPS, length, loud) for step, (loud, length) in sorted(loudest.items())]
        return [rhythm.NOTE_FLOATS * len(table), *(number for note in table for number in note)]

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        notes = frames(d, 1 + int(d[0]))[1:]
        bar, repeats, at_once, starts = c[0] * rate, int(c[1]), c[2] == 0.0, e[0]
        if at_once and s[2] == 0.0:
            s[0], s[1], s[2] = frame, 1.0, 1.0
        begin = frame
        for event in range(int(starts[0]) + 1):
            starting = event < starts[0]
            end = max(begin, int(starts[3 * event + 1])) if starting else frame + n
            if s[2] == 1.0:
                events = room(o[0], end - begin)
                count = rhythm.play(notes, bar, repeats, s[0], begin, end - begin, rate, events)
                for i in range(count):
                    events[3 * i + 1] *= s[1]
                grow(o[0], count)
            if starting:
                s[0], s[1], s[2] = starts[3 * event + 1], starts[3 * event + 2], 1.0
                begin = end
        if repeats > 0 and s[2] == 1.0 and frame + n > s[0] + repeats * bar:
            s[2] = 2.0

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER if s[2] == 1.0 else 0.0
