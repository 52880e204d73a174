"""Where a patch ends: the tile's shaker, and a channel for ears."""

from underfoot.parameters import Number, Tiles
from underfoot.patch.node import Input, Output, node


@node("tile-output", "Outputs")
class TileOutput:
    """What the tile plays: acceleration in m/s^2. Several outputs on one tile add."""

    accuracy = "exact: to 1e-12"
    acceleration = Input("m/s^2", doc="what the shaker is to do")
    level = Number(1.0, 0.0, 10.0, scale="gain", wire="audio", doc="factor on the way out")
    tiles = Tiles(doc="the tiles that play it")
    played = Output("m/s^2")
    muted_by = ("acceleration", "level")
    is_sink = True

    def run(acceleration, level, played):
        for i in range(played.size):
            played[i] = acceleration[i] * level[i]


@node("sound-output", "Outputs", "Sound")
class SoundOutput:
    """What is heard, not felt: loudspeakers or headphones on a channel for all tiles, which add. No shaker gets it."""

    accuracy = "exact: to 1e-12"
    sound = Input(doc="what is to be heard")
    level = Number(
        0.05, 0.0, 10.0, scale="gain", wire="audio", doc="factor to full scale: at 0.05 an input of 20 is full scale"
    )
    tiles = Tiles(doc="the tiles whose sound it is")
    heard = Output(doc="of full scale")
    muted_by = ("sound", "level")
    is_sink = True
    to_sound = True

    def run(sound, level, heard):
        for i in range(heard.size):
            heard[i] = sound[i] * level[i]
