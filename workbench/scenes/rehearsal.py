"""A scene without a session: force samples in, what it does out, as fast as it goes. For tests, films and scripts."""

from collections.abc import Callable
from dataclasses import dataclass, field

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Command
from underfoot.floor.layout import Floor
from underfoot.scenes.cues import Cue, Say, Strike, delay_of
from underfoot.scenes.moments import MOMENT_S, Moment, Moments
from underfoot.scenes.scene import Scene

TimedPress = tuple[float, str, float, float, float]
"""When a hand presses: second, tile, x and y in metres of the tile's frame, and newtons; 0 lets go."""


@dataclass
class Rehearsed:
    """What a scene did: each cue with the time of its moment, in seconds, and the moments themselves."""

    cues: list[tuple[float, Cue]] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)

    @property
    def said(self) -> list[str]:
        """The lines that it said."""
        return [cue.text for _, cue in self.cues if isinstance(cue, Say)]

    @property
    def strikes(self) -> list[Strike]:
        """What it struck."""
        return [cue for _, cue in self.cues if isinstance(cue, Strike)]

    def commands(self, floor: Floor) -> tuple[tuple[int, Command], ...]:
        """The strikes as commands of the engine, each with its frame: what `render` takes."""
        return tuple(
            (round(RATE_HZ * time_s), cue.command(floor, delay_of(cue, time_s - MOMENT_S)))
            for time_s, cue in self.cues
            if isinstance(cue, Strike)
        )


def rehearse(scene: Scene, source: ForceSource, seconds: float, seen: Callable[[Moment], object] = id) -> Rehearsed:
    """Let a scene go through the first `seconds` of a source's forces; `seen` is called after each moment.

    >>> from underfoot.floor.layout import default_floor
    >>> from underfoot.scenes import discover
    >>> pond = discover()["frozen-pond"](default_floor())
    >>> done = rehearse(pond, SimulatedFloor(default_floor()), 1.5)
    >>> len(done.strikes) > 5
    True
    """
    done = Rehearsed()
    moments = Moments(source.floor, RATE_HZ, source.rate_hz)
    block = round(0.01 * RATE_HZ)
    for end in range(block, round(seconds * RATE_HZ) + 1, block):
        count = source.pull(end)
        for moment in moments.feed(source.stamps[:count], source.forces[:count]):
            done.moments.append(moment)
            done.cues += [(moment.time_s, cue) for cue in scene.step(moment)]
            seen(moment)
    return done


def rehearse_presses(
    scene: Scene, hands: "list[TimedPress]", seconds: float, seen: Callable[[Moment], object] = id
) -> Rehearsed:
    """The same under hands that press the simulated tiles and let go at given times, in order."""
    return rehearse(scene, _Hands(scene.floor, hands), seconds, seen)


class _Hands(SimulatedFloor):
    """A simulated floor that nobody walks on, with hands that press at their time."""

    def __init__(self, floor: Floor, hands: list[TimedPress]) -> None:
        super().__init__(floor, walking=False)
        self._due = sorted(hands, key=lambda hand: hand[0])

    def pull(self, end: int) -> int:
        while self._due and self._due[0][0] * RATE_HZ < end:
            _, tile, x_m, y_m, force_n = self._due.pop(0)
            self.press(self.floor.index(tile), x_m, y_m, force_n)
        return super().pull(end)
