"""What the floor tells: force, the place of contact, and footfalls."""

from underfoot.parameters import Number, Tiles
from underfoot.patch.node import NEVER, Input, Output, emit, node, rest_kernel, run_kernel


@node("tile-force", "Floor")
class TileForce:
    """The force on each tile, tared, in newtons; exactly 0 while nobody stands on it."""

    brought = Input("N", host="force_n")
    tiles = Tiles(doc="the tiles that are listened to")
    force = Output("N", doc="compression is positive")
    muted_by = ("force_n",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        for i in range(n):
            y[0][i] = x[0][i]


@node("contact", "Floor")
class Contact:
    """Where on the tile the contact is: the centroid in the tile's frame, in metres; 0 while nobody stands on it."""

    brought_x = Input("m", host="x_m")
    brought_y = Input("m", host="y_m")
    tiles = Tiles(doc="the tiles that are listened to")
    x = Output("m", doc="along the tile's x axis, 0 in the middle")
    y = Output("m", doc="along the tile's y axis, 0 in the middle")

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        for i in range(n):
            y[0][i] = x[0][i]
            y[1][i] = x[1][i]


@node("footfall", "Floor")
class Footfall:
    """An event as a foot comes down: when the force rises through the threshold, and again only after it fell to half.

    The event comes a short wait later, so that its strength can say how fast the foot was loaded: 1 at the reference.
    """

    force = Input("N", doc="usually from Tile force")
    threshold = Number(30.0, 1.0, 1000.0, unit="N", scale="log", doc="force at which a foot is down")
    wait = Number(0.005, 0.0005, 0.05, unit="s", scale="log", doc="time over which the loading is measured")
    reference = Number(8000.0, 100.0, 200_000.0, unit="N/s", scale="log", doc="loading rate of an event of strength 1")
    onset = Output(kind="event", doc="strength: the loading rate over the reference, at most 10")
    state = 4  # force one frame ago, down or not, time of the event to come or 0, force at the threshold

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        force, onset = x[0], o[0]
        threshold, wait, reference = c[0], max(1.0, c[1] * rate), c[2]
        for i in range(n):
            now, before = force[i], s[0]
            if s[1] == 0.0 and now >= threshold:
                s[1] = 1.0
                rise = now - before
                crossed = (threshold - before) / rise if rise > 0.0 else 1.0
                s[2] = frame + i - 1 + min(max(crossed, 0.0), 1.0) + wait
                s[3] = threshold
            elif s[1] != 0.0 and now < 0.5 * threshold:
                s[1] = 0.0
            if s[2] != 0.0 and s[2] < frame + i + 1:
                loading = max(now - s[3], 0.0) * rate / wait
                emit(onset, max(s[2], float(frame + i)), min(loading / reference, 10.0), 0.0)
                s[2] = 0.0
            s[0] = now

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER if s[2] != 0.0 else 0.0
