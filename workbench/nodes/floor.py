"""Signals from the floor: force, contact position and footfalls."""

import math

from underfoot.layouts import Layout
from underfoot.models.signals.events import emit
from underfoot.parameters import Number, Tiles
from underfoot.patch.node import Input, Output, node


@node("tile-force", "Floor")
class TileForce:
    """Tared force on each tile, its load, in newtons; exactly 0 while nobody stands on it."""

    also_called = "pressure, weight, foot, input, ADC, sensor"
    accuracy = "exact: linear between force samples, to 1e-12"
    force_n = Input("N", from_engine=True)
    tiles = Tiles(doc="tiles whose force is read")
    force = Output("N", doc="compression is positive")
    muted_by = ("force_n",)

    def run(force_n, force):
        for i in range(force.size):
            force[i] = force_n[i]


@node("contact", "Floor")
class Contact:
    """Centroid of the contact (centre of pressure) in the tile's frame, in metres; 0 while nobody stands on it."""

    also_called = "COP, position, XY"
    accuracy = "exact: linear between force samples, to 1e-12"
    x_m = Input("m", from_engine=True)
    y_m = Input("m", from_engine=True)
    tiles = Tiles(doc="tiles whose contact is read")
    x = Output("m", doc="along the tile's x axis; 0 at its centre")
    y = Output("m", doc="along the tile's y axis; 0 at its centre")

    def run(x_m, y_m, x, y):
        for i in range(x.size):
            x[i] = x_m[i]
            y[i] = y_m[i]


@node("tile-place", "Floor")
class TilePlace:
    """Place of the tile's centre on the floor, and its distance from a point.

    What happens on all tiles at once, as notes of a rhythm, reaches one after the other behind an Event delay whose
    time a Map makes of the distance.
    """

    also_called = "distance, position, XY, spread, wave, ripple, object info, texture coordinate"
    accuracy = "exact: to 1e-12"
    centre_x_m = Input("m", of_tile=True)
    centre_y_m = Input("m", of_tile=True)
    from_x = Number(0.0, -20.0, 20.0, unit="m", wire="audio", doc="x of the point on the floor")
    from_y = Number(0.0, -20.0, 20.0, unit="m", wire="audio", doc="y of the point on the floor")
    distance = Output("m", doc="from the point to the tile's centre")
    x = Output("m", doc="of the centre, along the floor's x axis")
    y = Output("m", doc="of the centre, along the floor's y axis")
    tail = math.inf

    def run(centre_x_m, centre_y_m, from_x, from_y, distance, x, y):
        for i in range(distance.size):
            x[i], y[i] = centre_x_m[i], centre_y_m[i]
            along, across = x[i] - from_x[i], y[i] - from_y[i]
            distance[i] = math.sqrt(along * along + across * across)


SURE_N = 100.0
"""Load from which the place of a contact is sure. Noise of the sensors moves that of a lighter one: as a foot left one
measured plate, it went at 15 m/s; weighed by its load, at 3.
"""


@node("contact-speed", "Floor")
class ContactSpeed:
    """Speed of the contact's centroid over the tile: of a foot that rolls, twists or slides.

    A foot that lands begins at 0. Where it has left, the speed dies away with the time constant.
    """

    also_called = "velocity"
    accuracy = "exact: SciPy's one-pole of the differences between frames, from 100 N on to 1e-9"
    force_n = Input("N", from_engine=True)
    x_m = Input("m", from_engine=True)
    y_m = Input("m", from_engine=True)
    cut = Input(from_engine=True)
    tiles = Tiles(doc="tiles whose contact is read")
    time = Number(0.02, 0.001, 1.0, unit="s", scale="log", doc="time constant of smoothing; longer below 100 N of load")
    speed = Output("m/s", doc="in any direction; a foot rolls at 0.2 to 0.4 m/s, lands and leaves at 1")
    state = Layout("contact_speed", "is_down", "x", "y", "along", "across")
    coefficients = Layout("contact_speed_coefficients", "new")

    def design(time, rate, coefficients):
        coefficients.new = -math.expm1(-1.0 / (time * rate))

    def run(force_n, x_m, y_m, cut, rate, coefficients, state, speed):
        for i in range(speed.size):
            is_down = 1.0 if force_n[i] > 0.0 and cut[i] == 0.0 else 0.0
            moves = is_down * state.is_down * rate  # 0 at a landing: the centroid comes from anywhere
            new = coefficients.new * (min(force_n[i] / SURE_N, 1.0) if is_down else 1.0)
            state.along += new * (moves * (x_m[i] - state.x) - state.along)
            state.across += new * (moves * (y_m[i] - state.y) - state.across)
            state.is_down, state.x, state.y = is_down, x_m[i], y_m[i]
            speed[i] = math.sqrt(state.along * state.along + state.across * state.across)

    def tail(state):
        return math.hypot(state.along, state.across)


@node("footfall", "Floor")
class Footfall:
    """Events when a foot lands and when it lifts off: when the force rises through the threshold, and falls below half.

    The event of a landing is delayed by the wait, over which the loading rate is measured; the strength is 1 at the
    reference rate. A foot that already stands on the tile when the session or the patch starts does not land, nor one
    that stood there before a gap in the samples, if what is between Tile force and here delays by less than 0.1 s; nor
    does a force that rises from exactly 0 to the threshold within one frame, which looks alike; of two rises within the
    wait the second does. All of them lift off, and so does a foot in a gap.
    """

    also_called = "footstep, step, trigger, edge, threshold, onset, heel strike, release, leave, toe off"
    accuracy = "exact: landing on the line between samples, to 1e-6 frames; loading to 1e-6; lift-off to a frame"
    force = Input("N", doc="usually from Tile force")
    cut = Input(from_engine=True)
    threshold = Number(30.0, 1.0, 1000.0, unit="N", scale="log", doc="force above which a foot is down")
    wait = Number(0.005, 0.0005, 0.05, unit="s", scale="log", doc="time over which the loading rate is measured")
    reference = Number(8000.0, 100.0, 200_000.0, unit="N/s", scale="log", doc="loading rate that gives strength 1")
    onset = Output(kind="event", doc="footfalls; strength is loading rate over reference, at most 10")
    lift_off = Output(kind="event", doc="feet that leave the tile; strength is 1")
    state = Layout("footfall", "force_before", "is_down", "due", "waits", "crossed_at")

    def run(cut, force, threshold, wait, reference, rate, frame, state, onset, lift_off):
        wait = max(1.0, wait * rate)
        for i in range(force.size):
            now, before = force[i], state.force_before
            if now >= threshold and (before == 0.0 or cut[i] != 0.0):
                state.is_down = 1.0
            elif state.is_down == 0.0 and now >= threshold:
                state.is_down = 1.0
                rise = now - before
                crossed = (threshold - before) / rise if rise > 0.0 else 1.0
                state.due = frame + i - 1 + min(max(crossed, 0.0), 1.0) + wait
                state.waits = wait  # the one that is set may be another when the event is due
                state.crossed_at = threshold
            elif state.is_down != 0.0 and now < 0.5 * threshold:
                state.is_down = 0.0
                emit(lift_off, float(frame + i), 1.0)
            if state.due != 0.0 and state.due < frame + i + 1:
                since = max(frame + i - (state.due - state.waits), 1.0)  # the force is that of this frame
                loading = max(now - state.crossed_at, 0.0) * rate / since
                emit(onset, max(state.due, float(frame + i)), min(loading / reference, 10.0))
                state.due = 0.0
            state.force_before = now

    def tail(state):
        return math.inf if state.due != 0.0 or state.is_down != 0.0 else 0.0
