"""Where a patch ends: the tile's shaker."""

from underfoot.parameters import Number, Tiles
from underfoot.patch.node import Input, Output, node


@node("tile-output", "Outputs")
class TileOutput:
    """What the tile plays: acceleration in m/s^2. Several outputs on one tile add."""

    accuracy = "exact: rounding"
    acceleration = Input("m/s^2", doc="what the shaker is to do")
    level = Number(1.0, 0.0, 10.0, scale="gain", wire="audio", doc="factor on the way out")
    tiles = Tiles(doc="the tiles that play it")
    played = Output("m/s^2")
    muted_by = ("acceleration", "level")
    is_sink = True

    def run(acceleration, level, played):
        for i in range(played.size):
            played[i] = acceleration[i] * level[i]
