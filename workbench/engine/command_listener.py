"""The engine's thread that receives commands from the supervisor, prepares them, and reports those that took effect."""

import multiprocessing
import threading
import time
from collections import deque
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue

from msgspec import Struct
from msgspec.structs import replace

from underfoot.devices.device_floor import DeviceFloor
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.commands import Action, Command, Play, ProgramSwap, Quit
from underfoot.engine.pacing import Pacer
from underfoot.engine.reports import Costs, Fault, Notice, PatchRefused, SensorFaults
from underfoot.engine.requests import CardsThere
from underfoot.engine.status import Field
from underfoot.errors import UnderfootError

MOST_LOAD = 0.9
"""Highest load at which an old and a new program run at the same time."""
_LISTEN_S, _COSTS_S = 0.02, 0.5  # timeout for a command, and interval between cost reports, in seconds


class _Until(Struct, frozen=True):
    """Marks, among the messages to send, that everything before this frame has been reported."""

    frame: int


class CommandListener:
    """Receives commands from `connection` until `Quit` or its end, then ramps down and has `pacer` leave.

    A second thread watches the supervisor's process, because this one may spend seconds building a program when that
    process dies. A third thread sends: if receiving stopped while a report waits for room in the pipe, both ends could
    wait for each other for ever.
    """

    def __init__(self, connection: Connection, runner: BlockRunner, pacer: Pacer) -> None:
        self.notices: deque[Notice] = deque()
        """Notices from any thread; sent with the next report."""
        self._connection, self._runner, self._pacer = connection, runner, pacer
        self._loop, self._status = runner.loop, runner.memory.status
        self._costs: dict[str, float] = {}
        self._told_no_sound = False
        self._outbox: SimpleQueue[object] = SimpleQueue()

    def start(self) -> None:
        """Start the threads."""
        threading.Thread(target=self._listen, name="commands", daemon=True).start()
        threading.Thread(target=self._send, name="reports", daemon=True).start()
        threading.Thread(target=self._leave_with_supervisor, name="supervisor", daemon=True).start()

    def take(self, command: Command) -> None:
        """Prepare a command and queue it for the next block; send a notice instead if a patch cannot be played."""
        try:
            action = command.prepared(self._loop)
        except UnderfootError as error:
            self._outbox.put(PatchRefused.because(error))
            return
        if isinstance(action, ProgramSwap):
            if action.program.lacks_sound and not self._told_no_sound:
                self._told_no_sound = True
                self.notices.append(
                    Notice("this patch's Sound has no channel; choose the sound card again to open one")
                )
            action = self._affordable(action)
        self._runner.inbox.append(action)

    def report(self) -> None:
        """Report the commands that took effect, and up to which frame; release programs that were replaced."""
        frame = self._loop.frame
        while self._loop.applied:
            self._outbox.put(self._loop.applied.popleft())
        self._outbox.put(_Until(frame))
        while self.notices:
            self._outbox.put(self.notices.popleft())
        self._loop.programs.retired.clear()

    def _listen(self) -> None:
        costs_told = 0.0
        try:
            while True:
                if self._connection.poll(_LISTEN_S):
                    command = self._connection.recv()
                    if isinstance(command, Quit):
                        break
                    if isinstance(command, CardsThere):
                        self._pacer.there = command.names
                    else:
                        self.take(command)
                self.report()
                now = time.perf_counter()
                if now - costs_told > _COSTS_S:
                    costs_told = now
                    self._report_costs()
        except (EOFError, OSError):
            pass  # the supervisor is gone: exit as after Quit
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
            return  # the supervisor is gone; the listening thread notices too

    def _leave_with_supervisor(self) -> None:
        parent = multiprocessing.parent_process()
        if parent is not None:
            wait([parent.sentinel])
            self._ramp_down()

    def _ramp_down(self) -> None:
        """Fade out and exit."""
        self._runner.inbox.append(Play(False))
        time.sleep(self._pacer.ramp_down_s)
        self._pacer.leave.set()

    def _affordable(self, swap: ProgramSwap) -> Action:
        """Return the swap with both programs at once, or one after the other if both would cost too much."""
        # A program's cost is unknown before it runs: estimate it by the number of nodes.
        both = 1.0 + len(swap.program.node_ids) / max(len(self._loop.program.node_ids), 1)
        together = self._runner.load * both <= MOST_LOAD
        return replace(swap, command=replace(swap.command, together=together))

    def _report_costs(self) -> None:
        source = self._loop.source
        if isinstance(source, DeviceFloor):
            self._status.put(Field.LOST, float(source.lost))
            latency_s, block_s = source.latency_s, self._runner.block_s
            self._status.put(Field.LATENCY_S, max(latency_s, block_s))
            self._status.put(Field.HOLD_S, max(latency_s - block_s, 0.0))
            for line in source.take_notices():
                self._outbox.put(Notice(line))
            self._outbox.put(SensorFaults(source.sensor_faults, source.silence))
        program, load = self._loop.program, self._runner.load
        awake = program.awake()
        self._status.put(Field.AWAKE, float(max(awake.values(), default=0)))
        costs = {id: load * share for id, share in program.shares().items()}
        steady = {id: 0.5 * (cost + self._costs.get(id, cost)) for id, cost in costs.items()}  # mean of the last second
        self._costs = costs
        self._outbox.put(Costs(steady, awake, program.left_out))
        for fault in program.faults():
            self._outbox.put(Fault(*fault))
