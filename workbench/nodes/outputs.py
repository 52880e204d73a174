"""Outputs of a patch: the shaker of a tile, and a sound channel."""

from underfoot.parameters import Number, Tiles
from underfoot.patch.node import Input, Output, node


@node("tile-output", "Outputs")
class TileOutput:
    """Acceleration of the tile, in m/s^2. Several outputs on one tile add."""

    also_called = "DAC, shaker, pan, route, send"
    accuracy = "exact: to 1e-12"
    acceleration = Input("m/s^2", doc="acceleration that the shaker shall produce")
    level = Number(1.0, 0.0, 10.0, scale="gain", wire="audio", doc="factor on the acceleration")
    tiles = Tiles(doc="tiles that play it")
    played = Output("m/s^2")
    muted_by = ("acceleration", "level")
    is_sink = True

    def run(acceleration, level, played):
        for i in range(played.size):
            played[i] = acceleration[i] * level[i]


@node("sound-output", "Outputs", "Sound")
class SoundOutput:
    """Sound for loudspeakers or headphones, summed over all tiles on a channel that no shaker plays."""

    also_called = "speaker, headphones"
    accuracy = "exact: to 1e-12"
    sound = Input(doc="sound signal")
    level = Number(
        0.05, 0.0, 10.0, scale="gain", wire="audio", doc="factor to full scale: at 0.05, an input of 20 is full scale"
    )
    tiles = Tiles(doc="tiles whose sound is played")
    heard = Output(doc="sound, in full scale")
    muted_by = ("sound", "level")
    is_sink = True
    to_sound = True

    def run(sound, level, heard):
        for i in range(heard.size):
            heard[i] = sound[i] * level[i]
