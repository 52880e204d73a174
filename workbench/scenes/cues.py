"""Cues of a scene: strike a node of its patch, set a number, play a patch on a tile, print a line.

They go to the engine as commands, so they are recorded with their frames and replay to the same bytes.
"""

import math
from dataclasses import dataclass

from underfoot.engine import commands
from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


@dataclass(frozen=True)
class Strike:
    """Event for the strike node `node` of the scene's patch, on the tile nearest to a place on the floor.

    `strength` is 0 to 1; the patch determines the effect of 1. `at_s` is the time of the event in the present moment;
    NaN: its beginning. `BadValue` for any other strength.
    """

    node: str
    x_m: float
    y_m: float
    strength: float = 1.0
    at_s: float = math.nan

    def __post_init__(self) -> None:
        require(0.0 <= self.strength <= 1.0, "strength", self.strength, "0 to 1")
        place = (self.x_m, self.y_m)
        require(all(map(math.isfinite, place)), "place", place, "two finite lengths")

    def command(self, floor: Floor, delay_s: float) -> commands.Strike:
        """Return the engine's command; the event comes `delay_s` after it."""
        tile = nearest_tile(floor, self.x_m, self.y_m)
        delay = min(max(float(delay_s), 0.0), commands.MOST_DELAY_S)
        return commands.Strike(self.node, tile, float(self.strength), delay)  # plain numbers, as recordings keep them


@dataclass(frozen=True)
class Set:
    """Set a number of a node of the scene's patch, on all tiles."""

    node: str
    name: str
    value: float


@dataclass(frozen=True)
class Play:
    """Play a patch besides the scene's own, on one tile ("all": on every tile), at a gain of 0 to 1.

    It replaces the one played before; None ends that.
    """

    patch: Patch | None
    tile: str = "all"
    gain: float = 1.0

    def __post_init__(self) -> None:
        require(0.0 <= self.gain <= 1.0, "gain", self.gain, "0 to 1")

    def beside(self, own: Patch, floor: Floor, registry: Registry) -> Patch:
        """Return a patch with the scene's own nodes and these."""
        if self.patch is None:
            return own
        if self.tile != "all":
            floor.index(self.tile)
        limited = self.patch
        for node in self.patch.nodes:
            type = registry[node.type]
            if type.is_sink:
                level = type.values(node.parameters)["level"] * self.gain
                limited = limited.set(node.id, "level", level, registry).set(node.id, "tiles", self.tile, registry)
        return own.paste(limited, registry)


@dataclass(frozen=True)
class Say:
    """A line for the experimenter."""

    text: str


Cue = Strike | Set | Play | Say


def delay_of(cue: Strike, began_s: float) -> float:
    """Return the time of a strike after `began_s`; 0 if it has none."""
    return max(cue.at_s - began_s, 0.0) if math.isfinite(cue.at_s) else 0.0


def nearest_tile(floor: Floor, x_m: float, y_m: float) -> str:
    """Return the id of the tile nearest to a place in the floor's frame; the first of several.

    >>> from underfoot.floor.layout import default_floor
    >>> nearest_tile(default_floor(1, 2), 10.0, 0.0)
    't2'
    """
    return min(floor.tiles, key=lambda tile: float(tile.distance_m((x_m, y_m)))).id
