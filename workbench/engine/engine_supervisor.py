"""Supervision of the engine: restart its process when it dies, with a second one on standby to take over at once."""

import math
import time
from collections.abc import Callable

from underfoot.devices.outputs import outputs_of
from underfoot.engine.card_search import CardWatch
from underfoot.engine.child_process import ChildProcess, engine_process
from underfoot.engine.commands import Quit
from underfoot.engine.reports import SOUND_CARD, OutputChanged, Report, Started
from underfoot.engine.requests import CardsThere, Setup, StandBy
from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.status import Field

END_S = 1.0
"""Seconds that a process may take to end when asked to."""
STALL_S = 5.0
"""Seconds without a new frame after which the engine is considered stuck, and killed."""
REPORTED_S = 0.5
"""Seconds in which an engine that runs reports what took effect: it does so fifty times a second."""
_AWAY_S = 1.0  # between two looks, after which nothing is known of the time between
_LOOK_S = 0.001


class EngineSupervisor:
    """The running engine, at most one on standby, the last session frame played, and the search for missing cards.

    A card that comes may sound at once, and so is looked for only if one played before, or if the first engine was to
    play as it started: what a person begins in silence, no card that comes later lets sound.
    """

    def __init__(self, memory: SessionMemory, sound: str | None, standby: ChildProcess | None) -> None:
        self._memory, self._sound = memory, sound
        self._cards, self._awaits_cards = CardWatch(), False
        self._has_started = False
        self._engine: ChildProcess | None = None
        self._standby = standby
        self._played = self._moved = (time.perf_counter(), 0)  # time and frame last played; of the last change
        self._looked_s = -math.inf
        self._stalled = False  # whether the engine was killed because it stood still

    @property
    def pids(self) -> dict[str, int]:
        """Process ids by name."""
        named = (("engine", self._engine), ("standby", self._standby), ("card search", self._cards))
        return {name: child.pid for name, child in named if child is not None and child.pid is not None}

    @property
    def is_started(self) -> bool:
        """Whether there is an engine, besides one on standby."""
        return self._engine is not None

    @property
    def resume_point(self) -> tuple[int, float | None]:
        """Session frame to resume from, and the time at which it was played; None if nothing has been played yet."""
        when, frame = self._played
        return max(frame, self._memory.vibration.written), when if frame else None

    def start(self) -> None:
        """Take the engine on standby in place of one that died, or start one; it waits for its setup."""
        self._engine, self._standby = self._standby or engine_process(), None

    def stand_by(self, setup: Setup | None) -> None:
        """Start another engine process that has the present program's kernels loaded, for a faster takeover."""
        if self._standby is None:
            self._standby = engine_process()
            if setup is not None:
                self._standby.send(StandBy(setup))

    def send(self, message: object) -> None:
        """Send a message to the engine, if there is one."""
        if self._engine is not None:
            self._engine.send(message)

    def receive(self) -> list[Report]:
        """Return the engine's reports."""
        reports: list[Report] = self._engine.receive() if self._engine is not None else []
        for report in reports:
            if isinstance(report, Started):
                self._awaits_cards |= report.playing and not self._has_started
                self._has_started = True
            if isinstance(report, Started | OutputChanged):
                self._awaits_cards |= report.where == SOUND_CARD
        return reports

    def reported_frame(self, take: Callable[[], None], within_s: float) -> int:
        """Call `take` for the engine's reports; return the frame before which all commands are in them.

        Waits up to `within_s` until that is the frame which plays now.
        """
        status, until = self._memory.status, time.perf_counter() + within_s
        present = status.get(Field.FRAME)
        while True:
            frame = status.get(Field.REPORTED)  # what was reported before is in the connection
            take()
            if frame >= present or self._engine is None or self.has_died or time.perf_counter() >= until:
                return int(frame)
            time.sleep(_LOOK_S)

    def watch(self) -> None:
        """Note the present frame, look for missing cards; kill an engine that runs but plays no more frames.

        After a time in which nobody looked, all may have stood still: at Ctrl-Z, and while the machine slept.
        """
        status = self._memory.status
        now, frame = time.perf_counter(), int(status.get(Field.FRAME))
        running = bool(status.get(Field.RUNNING))
        if running and frame != self._played[1]:
            self._played = (now, frame)
        was_away, self._looked_s = now - self._looked_s > _AWAY_S, now
        if not running or frame != self._moved[1] or was_away:
            self._moved = (now, frame)
        elif now - self._moved[0] > STALL_S and self._engine is not None:
            self._engine.kill()
            self._stalled = True
        self._look_for_cards(is_missing=running and bool(status.get(Field.MISSING)))

    def _look_for_cards(self, *, is_missing: bool) -> None:
        """Tell the engine which cards are there, as long as some are missing."""
        looks = is_missing and self._awaits_cards and self._sound is not None
        names = tuple(output.name for output in outputs_of(self._sound or "")) if looks else ()
        if (found := self._cards.poll(names)) is not None:
            self.send(CardsThere(found))

    @property
    def has_died(self) -> bool:
        """Whether the engine's process has ended."""
        return self._engine is not None and not self._engine.is_alive

    def reap(self) -> str:
        """Release an engine that died, and return the reason."""
        assert self._engine is not None
        self._memory.status.stopped()
        reason = self._engine.end(END_S)
        if self._stalled:
            look = "the sound card and its server answer, and whether a node of your own ends"
            reason = f"nothing was played for {STALL_S:g} s; look whether {look}"
        self._engine, self._stalled = None, False
        return reason

    def close(self) -> None:
        """Ramp the engine down, and end all processes."""
        self._cards.close()
        if self._engine is not None:
            self._engine.send(Quit())
            self._engine.end(END_S if self._memory.status.get(Field.RUNNING) else 0.0)
        if self._standby is not None:
            self._standby.end(0.0)  # it has no unfinished work
