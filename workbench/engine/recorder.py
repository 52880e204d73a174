"""The recorder: a process of its own that reads the rings and writes the file, so that it outlives everything else."""

import signal
import sqlite3
import time
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from pathlib import Path

import msgspec

from underfoot.engine import messages
from underfoot.engine.messages import Command, Done, Swap
from underfoot.engine.rings import Reader, Ring, RingName
from underfoot.errors import BadFile, UnderfootError
from underfoot.records.recording import Writer

EVERY_S = 0.1
"""How often what came in is made safe."""


@dataclass(frozen=True)
class Say:
    """Something about the session that was not known beforehand."""

    key: str
    value: str


@dataclass(frozen=True)
class Stop:
    """The frame at which the recording is to end: all commands before it were told."""

    end: int


class Recorder:
    """The supervisor's end: starts the process, passes commands on, closes it."""

    def __init__(self, context: SpawnContext, path: Path, about: dict[str, str], force: Ring, vibration: Ring) -> None:
        if path.exists():
            raise BadFile(f"{path} is there already; choose another name for the recording")
        self.path = path
        self._context = context
        self._job = Job(str(path), about, force.where, vibration.where, force.written, vibration.written)
        self._start()

    def go_on(self) -> None:
        """Start the process again, where the one that died left the file."""
        self._job = replace(self._job, resume=True)
        self._start()

    def say(self, key: str, value: str) -> None:
        """Record something about the session that was not known beforehand."""
        self._send(Say(key, value))

    def note(self, done: Done) -> None:
        """Record a command with its frame."""
        self._send(done)

    def receive(self) -> list[str]:
        """What the recorder has to say, a line each."""
        lines = []
        try:
            while self._connection.poll():
                lines.append(self._connection.recv())
        except (EOFError, OSError):
            return lines
        return lines

    def gone(self) -> str | None:
        """None while the process lives; else why it ended, "" where it has said so itself."""
        if self._process.is_alive():
            return None
        self._connection.close()
        failed = self._process.exitcode != 0
        reason = end_process(self._process, 0.0)
        return reason if failed else ""

    def end(self, frame: int) -> None:
        """Let it write what there is before session frame `frame`, and close the file; nobody waits for that."""
        self._send(Stop(frame))
        self._connection.close()

    def ended(self, within_s: float = 0.0) -> bool:
        """After `end`: whether the file is closed. With `within_s`, wait; a process that takes longer is killed."""
        if within_s == 0.0 and self._process.is_alive():
            return False
        end_process(self._process, within_s)
        return True

    def _start(self) -> None:
        self._connection, theirs = self._context.Pipe()
        self._process = self._context.Process(
            target=run, args=(theirs, self._job), name="underfoot recorder", daemon=False
        )
        self._process.start()
        theirs.close()

    def _send(self, message: object) -> None:
        try:
            self._connection.send(message)
        except OSError:
            return  # the recorder died; `gone` tells


def end_process(process: BaseProcess, within_s: float) -> str:
    """Wait for a process, kill it if that takes too long, and say how it ended."""
    process.join(within_s)
    if process.is_alive():
        process.kill()
        process.join()
    code = process.exitcode
    process.close()
    return f"signal {-code}" if code is not None and code < 0 else f"exit status {code}"


@dataclass(frozen=True)
class Job:
    """What the process is given: the file, what is known beforehand, the rings and where to begin in them."""

    path: str
    about: dict[str, str]
    force: RingName
    vibration: RingName
    first_sample: int
    first_frame: int
    resume: bool = False


def run(connection: Connection, job: Job) -> None:
    """The process's main function: writes until the connection ends, then closes the file."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the session
    try:
        force_ring, vibration_ring = Ring.open(job.force), Ring.open(job.vibration)
        writer = Writer(Path(job.path), job.about, job.resume)
        forces = Reader(force_ring, start=writer.end("force") or job.first_sample)
        frames = Reader(vibration_ring, start=writer.end("vibration") or job.first_frame)
        _write(connection, writer, forces, frames)
        writer.close()
    except (UnderfootError, OSError, sqlite3.Error) as error:
        with suppress(OSError):
            connection.send(f"{job.path} is not recorded any further: {error}")
        return
    force_ring.close()
    vibration_ring.close()


def _write(connection: Connection, writer: Writer, forces: Reader, frames: Reader) -> None:
    end = None
    open_end = True
    while open_end:
        due = time.monotonic() + EVERY_S
        try:
            while connection.poll(max(due - time.monotonic(), 0.0)):
                match connection.recv():
                    case Done(frame, command):
                        writer.command(frame, *to_text(command))
                    case Say(key, value):
                        writer.say(key, value)
                    case Stop(frame):
                        end = frame
        except (EOFError, OSError):
            open_end = False  # whoever opened the session is done, or gone
        for reader, put in ((forces, writer.force), (frames, writer.vibration)):
            first, rows = reader.read()
            while len(rows):
                put(first, rows)
                first, rows = reader.read()
        writer.commit()
    if end is not None:
        writer.cut(end)


def to_text(command: Command) -> tuple[str, str]:
    """A command as its kind and JSON.

    >>> to_text(messages.Level(-20.0))
    ('Level', '{"db":-20.0}')
    """
    body = asdict(command)
    if isinstance(command, Swap):
        body["patch"] = command.patch.decode()
    return type(command).__name__, msgspec.json.encode(body).decode()


def from_text(kind: str, body: str) -> Command:
    """The command of `to_text`.

    >>> from_text("Level", '{"db":-20.0}')
    Level(db=-20.0)
    """
    values = msgspec.json.decode(body)
    if kind == "Swap":
        values["patch"] = values["patch"].encode()
    command: Command = msgspec.convert(values, getattr(messages, kind))
    return command
