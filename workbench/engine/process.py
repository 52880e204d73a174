"""The engine's process: one thread takes commands, the output callback (or the clock) runs the loop."""

import gc
import os
import signal
import sys
import threading
import time
from collections import deque
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from underfoot.clock import next_span
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import ForceSource
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.sound import Stream, max_channels
from underfoot.engine import status as fields
from underfoot.engine.loop import InTurn, Loop, output_channels
from underfoot.engine.messages import Correct, Costs, Fault, Level, Notice, Play, Quit, Started, Swap
from underfoot.engine.rings import Ring, RingName, publish, write_rows
from underfoot.engine.status import Status
from underfoot.engine.target import Target, source_of
from underfoot.errors import DeviceError, UnderfootError
from underfoot.floor.layout import default_floor
from underfoot.kernels import kernel
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

SWITCH_S = 0.0002
"""How soon a thread of this process must let go of the interpreter."""
MOST_LOAD = 0.9
"""The load up to which an old program and a new one run beside each other."""
LEAVE_S = 0.060
"""Time for the ramp down before the process leaves, and for what a sound server holds beyond the latency it reports."""


@dataclass(frozen=True)
class Setup:
    """All that the engine's process is given: target, patch, the names of what it shares, and where to go on from.

    `since` is when it was `frame`, by `time.monotonic`; None at the session's beginning, which waits for the engine.
    """

    target: Target
    patch: bytes
    scopes: tuple[str, ...]
    folder: str
    status: str
    vibration: RingName
    force: RingName
    scope: RingName
    frame: int
    playing: bool
    level_db: float
    corrections: tuple[Correct, ...] = ()
    since: float | None = None


@dataclass(frozen=True)
class Prepare:
    """Load what every engine needs, and wait: a spare engine takes over sooner."""


def run(connection: Connection) -> None:
    """The process's main function: waits for its `Setup`; returns when the connection ends or `Quit` comes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the session
    # Numba looks for SciPy's BLAS when it loads its first kernel: half a second for what no kernel uses.
    sys.modules.setdefault("scipy", None)  # type: ignore[arg-type]
    try:
        setup = connection.recv()
        if isinstance(setup, Prepare):
            prepare()
            setup = connection.recv()
        if isinstance(setup, Setup):
            Engine(connection, setup).run()
    except UnderfootError as error:
        connection.send(Notice(f"the engine stopped: {error}"))
    except (EOFError, OSError):
        return  # the supervisor died; there is nobody to tell


def prepare() -> None:
    """Load the kernels that do not depend on the patch."""
    loop = Loop(Patch(), REGISTRY, SimulatedFloor(default_floor(1, 1)), block=128)
    loop.send(loop.build(Patch()))
    for _ in range(24):
        loop.run(128)


def load_kernels() -> None:
    """Load what the callback calls besides the loop."""
    header, rows, wide = np.zeros(3, np.int64), np.zeros((1, 1), np.float32), np.zeros((1, 6))
    write_rows(header, rows, rows, 0)
    _gather(rows, np.zeros(1, np.int64), rows, 0)
    _pack(header, wide, np.zeros(0), np.zeros(0), np.zeros((0, 1, 4)), 0)


class Engine:
    """The loop, what paces it, and the thread that listens to the supervisor."""

    def __init__(self, connection: Connection, setup: Setup) -> None:
        self._connection = connection
        self._setup = setup
        target = setup.target
        self._status = Status.open(setup.status)
        self._vibration, self._force = Ring.open(setup.vibration), Ring.open(setup.force)
        self._scope = Ring.open(setup.scope)
        self._channels = output_channels(target.floor)
        if target.sound is not None:
            most = max_channels(target.sound)
            self._channels = [channel if channel < most else -1 for channel in self._channels]
        patch = Patch.loads(setup.patch, REGISTRY)
        folder = Path(setup.folder) if setup.folder else None
        self._warm(patch, folder)
        passed_s = 0.0 if setup.since is None else time.monotonic() - setup.since
        frame = next_span(setup.frame + round(passed_s * target.rate))
        self._vibration.skip(frame)
        self._scope.skip(frame)
        self._loop = self._make(patch, source_of(target, frame), folder, frame)
        self._loop.send(Level(setup.level_db))
        if setup.playing:
            self._loop.send(Play(True))
        source = self._loop.source
        self._device_floor = source if isinstance(source, DeviceFloor) else None
        self._address = self._loop.out.ctypes.data
        self._seconds = target.block / target.rate
        self._played = np.zeros((target.block, len(target.floor.tiles)), np.float32)
        self._loop.intake.hear = self._keep_forces
        self._quit = threading.Event()
        self._panicked = self._silenced = False
        self._late = 0
        self._load = 0.0
        self._inbox: deque[object] = deque()
        self._notices: deque[Notice] = deque()
        self._stream: Stream | None = None
        if isinstance(source, SimulatedFloor):
            self._notices.extend(map(Notice, source.notices))

    def _make(self, patch: Patch, source: ForceSource, folder: Path | None, frame: int) -> Loop:
        target = self._setup.target
        return Loop(
            patch,
            REGISTRY,
            source,
            rate=target.rate,
            block=target.block,
            channels=self._channels,
            scopes=self._setup.scopes,
            folder=folder,
            frame=frame,
            corrections=self._setup.corrections,
        )

    def _warm(self, patch: Patch, folder: Path | None) -> None:
        """Load every kernel that the callback will call, on a loop that nobody hears."""
        target = self._setup.target
        other = self._make(patch, SimulatedFloor(target.floor, target.rate), folder, 0)
        other.send(other.build(patch, self._setup.scopes))
        for _ in range(2 + 4096 // target.block):
            other.run(target.block)
        load_kernels()

    # --- pacing ---

    def run(self) -> None:
        notice = self._open_stream()
        gc.collect()
        gc.freeze()
        gc.disable()
        sys.setswitchinterval(SWITCH_S)
        if self._device_floor is not None:
            self._device_floor.start()
        self._status.put(fields.RUNNING, 1.0)
        kind = "the simulator" if self._setup.target.kind == "simulator" else self._setup.target.kind
        where = f"{kind}, without sound" if self._stream is None else "sound card"
        self._connection.send(Started(where, notice, os.getpid(), tuple(self._channels)))
        threading.Thread(target=self._listen, name="commands", daemon=True).start()
        self._start_stream()
        while not self._quit.is_set():
            if self._stream is None or self._stream.finished:
                self._run_by_clock()
            else:
                self._quit.wait(0.05)
        self._leave()

    def _open_stream(self) -> str:
        """Open the sound card, if one is wanted; why there is none, otherwise."""
        target = self._setup.target
        self._stream = None
        if target.sound is None:
            return ""
        try:
            self._stream = Stream(
                target.sound,
                self._loop.out.shape[1],
                target.rate,
                target.block,
                self._fill,
                target.latency_s or "low",
            )
        except DeviceError as error:
            return f"{error}; going on without sound"
        self._status.put(fields.STREAM_LATENCY, self._stream.latency_s)
        silent = [t.id for t, c in zip(target.floor.tiles, self._channels, strict=True) if c < 0]
        return f"tiles without a channel: {', '.join(silent)}" if silent else ""

    def _start_stream(self) -> None:
        """Let the sound card play, or go on without it."""
        if self._stream is None:
            return
        try:
            self._stream.start()
        except DeviceError as error:
            self._stream.close()
            self._stream = None
            self._notices.append(Notice(f"{error}; going on without sound"))

    def _resume_stream(self, ended: Stream) -> None:
        """Play on in a new stream: PortAudio would wait for ever for one whose card has gone away."""
        self._late += ended.underruns
        ended.close()
        notice = self._open_stream()
        if self._stream is None:
            self._notices.append(Notice(notice))
        self._start_stream()

    def _run_by_clock(self) -> None:
        """Blocks at their own pace while no stream does it; after a panic, until sound is let out again."""
        due = time.monotonic()
        while not self._quit.is_set():
            if self._stream is not None and not self._status.panic and not self._silenced:
                self._resume_stream(self._stream)
                return
            self._block()
            due += self._seconds
            wait = due - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            elif wait < -0.05:
                self._late += 1
                due = time.monotonic()

    def _fill(self) -> int:
        """The stream's callback: the address of the next block, or 0 to end the stream and drop what is buffered."""
        if self._quit.is_set() or self._silenced:
            return 0
        self._block()
        return self._address

    def _block(self) -> None:
        began = time.perf_counter()
        loop, status, n = self._loop, self._status, self._setup.target.block
        panic = status.panic
        if panic and not self._panicked:
            loop.panic()
        self._panicked = panic
        while self._inbox:
            command = self._inbox.popleft()
            if not (panic and isinstance(command, Play) and command.on):  # it was sent before the panic
                loop.send(command)  # type: ignore[arg-type]
        loop.run(n)
        self._silenced = panic and loop.safety.closed(loop.frame)
        _gather(loop.out, loop.safety.channels, self._played, n)
        self._vibration.write(self._played, n)
        if loop.program.scope_names:
            self._scope.write(loop.scoped, n)
        spent = (time.perf_counter() - began) / self._seconds
        self._load += 0.01 * (spent - self._load)
        status.put(fields.LOAD, self._load)
        if spent > status.get(fields.WORST):
            status.put(fields.WORST, spent)
        status.put(fields.FRAME, float(loop.frame))
        status.put(fields.PEAK, loop.safety.peaks.max())
        status.put(fields.XRUNS, float(self._late + (self._stream.underruns if self._stream else 0)))
        status.put(fields.LATENCY, self._seconds + 32.0 / self._setup.target.rate)

    def _keep_forces(self, count: int) -> None:
        source = self._loop.source
        _pack(self._force.header, self._force.rows, source.stamps, source.arrivals, source.forces, count)

    def _leave(self) -> None:
        """Let go of the sound card; the ramp down is over."""
        if self._stream is not None and not self._stream.finished:
            self._stream.abort()
        self._status.put(fields.RUNNING, 0.0)
        if self._stream is not None:
            self._stream.close()
        if self._device_floor is not None:
            self._device_floor.close()

    # --- commands ---

    def _listen(self) -> None:
        """Take commands until the supervisor goes away; between them, tell what happened."""
        told = 0.0
        try:
            while True:
                if self._connection.poll(0.02):
                    command = self._connection.recv()
                    if isinstance(command, Quit):
                        break
                    self._take(command)
                self._report()
                now = time.monotonic()
                if now - told > 0.5:
                    told = now
                    self._tell()
        except (EOFError, OSError):
            pass  # the supervisor is gone: leave as after Quit
        finally:
            self._inbox.append(Play(False))
            time.sleep(LEAVE_S + 4 * self._seconds + self._status.get(fields.STREAM_LATENCY))
            self._quit.set()

    def _report(self) -> None:
        """Tell which commands took effect, and up to which frame this is all; let go of programs that were replaced."""
        frame = self._loop.frame
        while self._loop.done:
            self._connection.send(self._loop.done.popleft())
        self._status.put(fields.TOLD, float(frame))
        while self._notices:
            self._connection.send(self._notices.popleft())
        self._loop.retired.clear()

    def _take(self, command: object) -> None:
        if isinstance(command, Swap):
            try:
                program = self._loop.build(Patch.loads(command.patch, REGISTRY), command.scopes)
            except UnderfootError as error:
                self._connection.send(Notice(f"the patch is not played: {error}"))
                return
            # What a program costs is not known before it runs: the more nodes, the more.
            both = 1.0 + len(program.node_ids) / max(len(self._loop.program.node_ids), 1)
            together = self._load * both <= MOST_LOAD
            self._inbox.append(program if together else InTurn(program))
            self._inbox.append(replace(command, together=together))
        elif isinstance(command, Correct):
            self._inbox.append(self._loop.prepare(command))
        else:
            self._inbox.append(command)

    def _tell(self) -> None:
        if self._device_floor is not None:
            self._status.put(fields.LOST, float(self._device_floor.counts.lost))
            for line in self._device_floor.take_notices():
                self._connection.send(Notice(line))
        program = self._loop.program
        load = self._load
        awake = program.awake()
        self._status.put(fields.AWAKE, float(max(awake.values(), default=0)))
        self._connection.send(Costs({id: load * share for id, share in program.shares().items()}, awake))
        fault = program.fault()
        if fault is not None:
            self._connection.send(Fault(*fault))


@kernel
def _gather(out, channels, rows, n):
    """What each tile plays, from the channels that it goes to; 0 for a tile without one."""
    for i in range(n):
        for row in range(rows.shape[1]):
            rows[i, row] = out[i, channels[row]] if channels[row] >= 0 else 0.0


@kernel
def _pack(header, ring, stamps, arrivals, forces, n):
    """Force samples to their ring: stamp, arrival, then the corners, tile after tile."""
    at = header[0]
    for i in range(n):
        row = ring[(at + i) % ring.shape[0]]
        row[0], row[1] = stamps[i], arrivals[i]
        for tile in range(forces.shape[1]):
            for corner in range(4):
                row[2 + 4 * tile + corner] = forces[i, tile, corner]
    publish(header, at + n)
