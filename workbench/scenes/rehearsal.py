"""A scene without a session, as fast as it runs: from force samples to cues, for tests, films and scripts."""

from dataclasses import dataclass, field

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.engine.commands import Command
from underfoot.floor.layout import Floor
from underfoot.scenes.cues import Cue, Say, Strike, delay_of
from underfoot.scenes.moments import MOMENT_S, Moment, Moments
from underfoot.scenes.scene import Scene


@dataclass
class Rehearsed:
    """Result of a rehearsal: each cue with the time of its moment, in seconds, and the moments."""

    cues: list[tuple[float, Cue]] = field(default_factory=list)
    moments: list[Moment] = field(default_factory=list)

    @property
    def said(self) -> list[str]:
        """Lines for the experimenter."""
        return [cue.text for _, cue in self.cues if isinstance(cue, Say)]

    @property
    def strikes(self) -> list[Strike]:
        """All strikes."""
        return [cue for _, cue in self.cues if isinstance(cue, Strike)]

    def commands(self, floor: Floor) -> tuple[tuple[int, Command], ...]:
        """Return the strikes as commands of the engine with their frames, for `render`."""
        return tuple(
            (round(RATE_HZ * time_s), cue.command(floor, delay_of(cue, time_s - MOMENT_S)))
            for time_s, cue in self.cues
            if isinstance(cue, Strike)
        )


def rehearse(scene: Scene, source: ForceSource, seconds: float) -> Rehearsed:
    """Run a scene on the first `seconds` of a source's forces.

    >>> from underfoot.devices.simulated_floor import SimulatedFloor
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
    return done
