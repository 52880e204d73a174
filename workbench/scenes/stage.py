"""A scene on a running session: force samples in, cues to the engine, and the latencies of strikes."""

import math
from collections import deque
from collections.abc import Iterable
from itertools import chain

from underfoot.engine import commands
from underfoot.engine.reports import CommandApplied, PatchRefused, Report
from underfoot.engine.session import Session
from underfoot.engine.session_memory import ForceReader
from underfoot.errors import UnderfootError, kind_and_words
from underfoot.patch.patch import Patch
from underfoot.scenes.cues import Cue, Play, Say, Set, Strike, delay_of
from underfoot.scenes.moments import Moment, Moments
from underfoot.scenes.scene import Scene

KEPT = 500
"""Number of latencies that are kept."""

HOLD_S = 0.02
"""Delay of strikes that have a time of their own, so that the intervals between strikes of one moment are kept. A
strike without a time, or later than this already, is played at once."""


class Stage:
    """Plays a scene on a session, instead of the session's patch, which `close` restores.

    Call `tick` about sixty times a second, and pass the session's reports to `take`; neither waits. Exceptions of the
    scene are not caught; the caller then closes the stage.
    """

    def __init__(self, session: Session, scene: Scene) -> None:
        """Play the scene's patch at once; `BadFile` if it cannot be played."""
        self.session, self.scene = session, scene
        self.said: deque[str] = deque(maxlen=1000)
        """Lines from the scene; the caller removes them."""
        self.latencies_s: deque[float] = deque(maxlen=KEPT)
        """For each of the last strikes: from its time, or else the beginning of its moment, to its frame in the
        engine."""
        self._own = scene.patch(session.registry)
        self._forces = ForceReader(session.memory.force)
        self._moments = Moments(scene.floor, float(session.target.rate), session.force_rate_hz)
        self._sent: deque[tuple[commands.Strike, float]] = deque(maxlen=KEPT)
        self._before: Patch | None = session.patch
        session.edit(self._own)
        self.is_felt = session.is_compiled
        """Whether the scene's patch plays; also if it was refused."""

    def tick(self) -> list[Moment]:
        """Step the scene through the moments completed since the last call, and return these."""
        done: list[Moment] = []
        if self._before is None:
            return done
        now_s, samples = self.session.played_s, self._forces.read()  # in this order: the samples until then are there
        for moment in chain(self._moments.feed(*samples), self._moments.pass_time(now_s)):
            done.append(moment)
            for cue in self.scene.step(moment):
                self._perform(cue, moment)
        return done

    def take(self, reports: Iterable[Report]) -> None:
        """Take reports, for the frames at which strikes took effect, and whether the patch has."""
        rate = self.session.target.rate
        for report in reports:
            is_swap = isinstance(report, CommandApplied) and isinstance(report.command, commands.Swap)
            self.is_felt |= is_swap or isinstance(report, PatchRefused)
            if isinstance(report, CommandApplied) and isinstance(report.command, commands.Strike):
                while self._sent:
                    command, happened_s = self._sent.popleft()
                    if command == report.command:
                        self.latencies_s.append(report.frame / rate + command.delay_s - happened_s)
                        break

    def close(self) -> None:
        """End the scene, and play the earlier patch."""
        before, self._before = self._before, None
        if before is not None:
            self.session.edit(before)

    def _perform(self, cue: Cue, moment: Moment) -> None:
        """Carry out a cue."""
        session = self.session
        match cue:
            case Strike():
                if self._own.nodes:  # a scene without a patch is only seen
                    self._own.node(cue.node)
                strike = cue.command(self.scene.floor, delay_of(cue, session.played_s - HOLD_S))
                session.send(strike)
                self._sent.append((strike, cue.at_s if math.isfinite(cue.at_s) else moment.began_s))
            case Set(node, name, value):
                self._own = self._own.set(node, name, float(value), session.registry)
                session.send(commands.Set(node, name, float(value)))
            case Play():
                session.edit(cue.beside(self._own, self.scene.floor, session.registry))
            case Say(text):
                self.said.append(text)


def why_ended(error: Exception) -> str:
    """Return why a scene ends. A scene may be anybody's, and can raise anything: it ends, and nothing else."""
    return str(error) if isinstance(error, UnderfootError) else f"The scene was stopped: {kind_and_words(error)}"
