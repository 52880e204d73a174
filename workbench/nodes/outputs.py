"""Where a patch ends: the tile's shaker."""

from underfoot.parameters import Number, Tiles
from underfoot.patch.node import Input, Output, node, run_kernel


@node("tile-output", "Outputs")
class TileOutput:
    """What the tile plays: acceleration in m/s^2. Several outputs on one tile add."""

    acceleration = Input("m/s^2", doc="what the shaker is to do")
    level = Number(1.0, 0.0, 10.0, wire="audio", doc="factor on the way out")
    tiles = Tiles(doc="the tiles that play it")
    played = Output("m/s^2")
    muted_by = ("acceleration", "level")
    is_sink = True

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        acceleration, level, played = x[0], x[1], y[0]
        for i in range(n):
            played[i] = acceleration[i] * level[i]
