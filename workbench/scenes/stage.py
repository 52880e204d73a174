"""A scene on a running session: force samples in, its cues out to the engine, and how late these took effect."""

import math
from collections import deque
from collections.abc import Iterable

from underfoot.engine import commands
from underfoot.engine.reports import CommandApplied, Report
from underfoot.engine.session import Session
from underfoot.engine.session_memory import ForceReader
from underfoot.patch.patch import Patch
from underfoot.scenes.cues import Cue, Play, Say, Set, Strike, delay_of
from underfoot.scenes.moments import Moment, Moments
from underfoot.scenes.scene import Scene

KEPT = 500
"""Latencies that are kept: of the last strikes."""

HOLD_S = 0.02
"""A strike that says when it happened comes so much later: found together, they keep the time between them. One that
is later than this already, or says nothing, comes at once."""


class Stage:
    """Lets a scene play on a session, whose patch it changes until `close`, which plays the one from before again.

    Call `tick` some sixty times a second, and give `take` what the session reports. Neither waits. What a scene raises
    goes through: whoever holds the stage closes it then.
    """

    def __init__(self, session: Session, scene: Scene) -> None:
        """Puts the scene's patch in at once; `BadFile` for one that cannot be played."""
        self.session, self.scene = session, scene
        self.said: deque[str] = deque(maxlen=1000)
        """What the scene said and nobody took yet."""
        self.latencies_s: deque[float] = deque(maxlen=KEPT)
        """Of the last strikes: from the beginning of its moment, or from when it says, to its frame in the engine."""
        self._own = scene.patch(session.registry)
        self._forces = ForceReader(session.memory.force)
        self._moments = Moments(scene.floor, float(session.target.rate), session.force_rate_hz)
        self._sent: deque[tuple[commands.Strike, float]] = deque(maxlen=KEPT)
        self._before: Patch | None = session.patch
        session.edit(self._own)

    def tick(self) -> list[Moment]:
        """Let the scene go through what came in since the last call: the moments that were complete."""
        done: list[Moment] = []
        if self._before is None:
            return done
        for moment in self._moments.feed(*self._forces.read()):
            done.append(moment)
            for cue in self.scene.step(moment):
                self._perform(cue, moment)
        return done

    def take(self, reports: Iterable[Report]) -> None:
        """Hear which strikes took effect when."""
        rate = self.session.target.rate
        for report in reports:
            if isinstance(report, CommandApplied) and isinstance(report.command, commands.Strike):
                while self._sent:
                    command, happened_s = self._sent.popleft()
                    if command == report.command:
                        self.latencies_s.append(report.frame / rate + command.delay_s - happened_s)
                        break

    def close(self) -> None:
        """End the scene: play what played before."""
        before, self._before = self._before, None
        if before is not None:
            self.session.edit(before)

    def _perform(self, cue: Cue, moment: Moment) -> None:
        """Do what a cue says."""
        session = self.session
        match cue:
            case Strike():
                now_s = session.health.frame / session.target.rate
                strike = cue.command(self.scene.floor, delay_of(cue, now_s - HOLD_S))
                session.send(strike)
                self._sent.append((strike, cue.at_s if math.isfinite(cue.at_s) else moment.began_s))
            case Set(node, name, value):
                self._own = self._own.set(node, name, float(value), session.registry)
                session.send(commands.Set(node, name, float(value)))
            case Play():
                session.edit(cue.beside(self._own, self.scene.floor, session.registry))
            case Say(text):
                self.said.append(text)
