"""Accelerometers, on inputs of the sound card that plays, or on the tiles' own converters and read over the link."""

import math

from msgspec import Struct

from underfoot.arguments import choice
from underfoot.errors import BadValue, require
from underfoot.floor.layout import Floor

FORM = "TILE:CHANNEL:M_S2 or TILE:link:M_S2, as t1:0:98.1"
"""Text form of an accelerometer: its tile, its input (from 0) or `link`, and the m/s^2 of full scale."""
LINK = -1
"""Channel of an accelerometer whose samples come over the link."""
MOST_INPUTS = 32


class Accelerometer(Struct, frozen=True):
    """An accelerometer of a tile, on input `channel` (from 0) or over the `LINK`; `m_s2_per_unit` is full scale."""

    tile: str
    channel: int
    m_s2_per_unit: float

    def __post_init__(self) -> None:
        require(LINK <= self.channel < MOST_INPUTS, "channel", self.channel, f"0 to {MOST_INPUTS - 1}, or link")
        within = math.isfinite(self.m_s2_per_unit) and 1e-3 <= self.m_s2_per_unit <= 1e6
        require(within, "m_s2_per_unit", self.m_s2_per_unit, "0.001 to 1e6 m/s^2 at full scale")


def accelerometers_of(text: str, floor: Floor) -> tuple[Accelerometer, ...]:
    """Parse accelerometers separated by spaces; raise `BadValue` for an unknown form or tile.

    >>> from underfoot.floor.layout import default_floor
    >>> accelerometers_of("t1:0:98.1 t2:1:50", default_floor())[1]
    Accelerometer(tile='t2', channel=1, m_s2_per_unit=50.0)
    >>> accelerometers_of("t1:link:98.1", default_floor())[0].channel == LINK
    True
    >>> accelerometers_of("t1:x:9", default_floor())
    Traceback (most recent call last):
    underfoot.errors.BadValue: accelerometer is 't1:x:9'; allowed: TILE:CHANNEL:M_S2 or TILE:link:M_S2, as t1:0:98.1
    """
    found: list[Accelerometer] = []
    for word in text.split():
        tile, _, rest = word.partition(":")
        channel, _, sensitivity = rest.partition(":")
        try:
            one = Accelerometer(tile, LINK if channel == "link" else int(channel), float(sensitivity))
        except ValueError as error:
            if isinstance(error, BadValue):
                raise
            raise BadValue(f"accelerometer is {word!r}; allowed: {FORM}") from None
        choice("tile of an accelerometer", tile, floor.ids)
        require(tile not in {known.tile for known in found}, "accelerometer", word, "one for each tile")
        inputs = {known.channel for known in found if known.channel != LINK}
        require(one.channel not in inputs, "accelerometer", word, "an input of its own for each")
        found.append(one)
    some = {one.channel == LINK for one in found}
    require(len(some) < 2, "accelerometers", text, "all on inputs of the card, or all over the link")
    return tuple(found)
