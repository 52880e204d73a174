"""The engine's thread that listens to the supervisor: commands are made ready here, and reported when they are done."""

import multiprocessing
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue

from underfoot.devices.device_floor import DeviceFloor
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.commands import Action, Command, Play, ProgramSwap, Quit
from underfoot.engine.reports import Costs, Fault, Notice
from underfoot.engine.status import Field
from underfoot.errors import UnderfootError

MOST_LOAD = 0.9
"""The load up to which an old program and a new one run beside each other."""
RAMP_DOWN_S = 0.060
"""Time for the ramp down before the process leaves, and for what a sound server holds beyond the latency it reports."""
_LISTEN_S, _COSTS_S = 0.02, 0.5  # how long it waits for a command, and how often it tells what nodes cost


@dataclass(frozen=True)
class _Until:
    """All that took effect before this frame stands before this among what is sent."""

    frame: int


class CommandListener:
    """Takes commands from `connection` until `Quit` or its end, then ramps down and sets `leave`.

    A thread of its own looks whether the supervisor's process lives: the one that takes commands may be building a
    program for seconds when it dies. Another one sends: were commands not taken while a report waits for room, both
    ends could wait for each other for ever.
    """

    def __init__(self, connection: Connection, runner: BlockRunner, leave: threading.Event) -> None:
        self.notices: deque[str] = deque()
        """Lines for the person, from any thread; they are told soon."""
        self._connection, self._runner, self._leave = connection, runner, leave
        self._loop, self._status = runner.loop, runner.memory.status
        self._costs: dict[str, float] = {}
        self._outbox: SimpleQueue[object] = SimpleQueue()

    def start(self) -> None:
        """Listen, in threads."""
        threading.Thread(target=self._listen, name="commands", daemon=True).start()
        threading.Thread(target=self._send, name="reports", daemon=True).start()
        threading.Thread(target=self._leave_with_supervisor, name="supervisor", daemon=True).start()

    def take(self, command: Command) -> None:
        """Make a command ready and put it into the next block; a patch that cannot be played is told instead."""
        try:
            action = command.prepared(self._loop)
        except UnderfootError as error:
            self._outbox.put(Notice(f"the patch is not played: {error}"))
            return
        if isinstance(action, ProgramSwap) and action.program.has_sound and self._loop.options.sound_channel == -1:
            self.notices.append("this patch's Sound has no channel; choose the sound card again to open one")
        self._runner.inbox.append(self._affordable(action) if isinstance(action, ProgramSwap) else action)

    def report(self) -> None:
        """Tell which commands took effect, and up to which frame this is all; let go of programs that were replaced."""
        frame = self._loop.frame
        while self._loop.applied:
            self._outbox.put(self._loop.applied.popleft())
        self._outbox.put(_Until(frame))
        while self.notices:
            self._outbox.put(Notice(self.notices.popleft()))
        self._loop.programs.retired.clear()

    def _listen(self) -> None:
        costs_told = 0.0
        try:
            while True:
                if self._connection.poll(_LISTEN_S):
                    command = self._connection.recv()
                    if isinstance(command, Quit):
                        break
                    self.take(command)
                self.report()
                now = time.monotonic()
                if now - costs_told > _COSTS_S:
                    costs_told = now
                    self._report_costs()
        except (EOFError, OSError):
            pass  # the supervisor is gone: leave as after Quit
        finally:
            self._outbox.put(None)
            self._ramp_down()

    def _send(self) -> None:
        try:
            while (message := self._outbox.get()) is not None:
                if isinstance(message, _Until):
                    self._status.put(Field.REPORTED, float(message.frame))
                else:
                    self._connection.send(message)
        except OSError:
            return  # the supervisor is gone, which the thread that listens finds, too

    def _leave_with_supervisor(self) -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            wait([parent.sentinel])
            self._ramp_down()

    def _ramp_down(self) -> None:
        """Let sound fade, and leave."""
        self._runner.inbox.append(Play(False))
        time.sleep(RAMP_DOWN_S + 4 * self._runner.block_s + self._status.get(Field.STREAM_LATENCY_S))
        self._leave.set()

    def _affordable(self, swap: ProgramSwap) -> Action:
        """The swap with both programs at once, or one after the other where that would cost too much."""
        # What a program costs is not known before it runs: the more nodes, the more.
        both = 1.0 + len(swap.program.node_ids) / max(len(self._loop.program.node_ids), 1)
        together = self._runner.load * both <= MOST_LOAD
        command = replace(swap.command, together=together) if swap.command is not None else None
        return replace(swap, together=together, command=command)

    def _report_costs(self) -> None:
        source = self._loop.source
        if isinstance(source, DeviceFloor):
            self._status.put(Field.LOST, float(source.counts.lost))
            self._status.put(Field.LATENCY_S, max(source.latency_s, self._runner.block_s))
            self._status.put(Field.HOLD_S, max(source.latency_s - self._runner.block_s, 0.0))
            for line in source.take_notices():
                self._outbox.put(Notice(line))
        program, load = self._loop.program, self._runner.load
        awake = program.awake()
        self._status.put(Field.AWAKE, float(max(awake.values(), default=0)))
        costs = {id: load * share for id, share in program.shares().items()}
        steady = {id: 0.5 * (cost + self._costs.get(id, cost)) for id, cost in costs.items()}  # of the last second
        self._costs = costs
        self._outbox.put(Costs(steady, awake))
        fault = program.fault()
        if fault is not None:
            self._outbox.put(Fault(*fault))
