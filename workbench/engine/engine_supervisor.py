"""The supervisor's end of the engine: its process is kept running, and another stands by to take over at once."""

import time

from underfoot.engine.child_process import ChildProcess, engine_process
from underfoot.engine.commands import Quit
from underfoot.engine.requests import Setup, StandBy
from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.status import Field

END_S = 1.0
"""How long a process that is asked to end may take."""
STALL_S = 5.0
"""An engine from which no frame came for so long waits for something that will not come, and is killed."""


class EngineSupervisor:
    """One engine that runs, at most one that stands by, and the session frame that was last played."""

    def __init__(self, memory: SessionMemory, standby: ChildProcess | None = None) -> None:
        self._memory = memory
        self._engine: ChildProcess | None = None
        self._standby = standby
        self._played = self._moved = (time.monotonic(), 0)  # when which frame was played; when it last was another

    @property
    def pids(self) -> dict[str, int]:
        """The numbers of the processes, by name."""
        named = (("engine", self._engine), ("standby", self._standby))
        return {name: child.pid for name, child in named if child is not None}

    @property
    def resume_point(self) -> tuple[int, float | None]:
        """The session frame to go on from, and when it was that frame; None where nothing has been played yet."""
        when, frame = self._played
        return max(frame, self._memory.vibration.written), when if frame else None

    def start(self) -> None:
        """Have an engine's process, which waits for its setup."""
        self._engine, self._standby = self._standby or engine_process(), None

    def stand_by(self, setup: Setup | None) -> None:
        """Have another engine loaded, for what is played now, that takes over sooner than a new one could."""
        if self._standby is None:
            self._standby = engine_process()
            if setup is not None:
                self._standby.send(StandBy(setup))

    def send(self, message: object) -> None:
        """Tell the engine something, if there is one."""
        if self._engine is not None:
            self._engine.send(message)

    def receive(self) -> list[object]:
        """What the engine reports."""
        return self._engine.receive() if self._engine is not None else []

    def watch(self) -> None:
        """Note which frame it is; an engine that runs but plays no more frames is killed."""
        status = self._memory.status
        now, frame = time.monotonic(), int(status.get(Field.FRAME))
        running = bool(status.get(Field.RUNNING))
        if running and frame != self._played[1]:
            self._played = (now, frame)
        if not running or frame != self._moved[1]:
            self._moved = (now, frame)
        elif now - self._moved[0] > STALL_S and self._engine is not None:
            self._engine.kill()

    @property
    def has_died(self) -> bool:
        """Whether the engine's process ended."""
        return self._engine is not None and not self._engine.is_alive

    def bury(self) -> str:
        """Let go of an engine that died; why it did."""
        assert self._engine is not None
        reason = self._engine.end(END_S)
        self._engine = None
        return reason

    def replace(self) -> None:
        """Put the engine that stands by, or a new one, in the place of one that died."""
        self._memory.status.stopped()
        self._engine, self._standby = self._standby or engine_process(), None

    def close(self) -> None:
        """Let the engine ramp down, and end both processes."""
        if self._engine is not None:
            self._engine.send(Quit())
            self._engine.end(END_S if self._memory.status.get(Field.RUNNING) else 0.0)
        if self._standby is not None:
            self._standby.end(0.0)  # it has nothing to bring to an end
