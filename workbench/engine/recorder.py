"""The recorder: a process of its own that reads the rings and writes the file, so that it outlives everything else."""

import signal
import sqlite3
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.rings import Reader, Ring, RingName, load_reading
from underfoot.errors import BadFile, UnderfootError
from underfoot.records.recording import Writer

COMMIT_S = 0.1
"""How often what came in is made safe."""


@dataclass(frozen=True)
class RecordAbout:
    """Something about the session that was not known beforehand."""

    key: str
    value: str


@dataclass(frozen=True)
class RecordCommand:
    """A command that took effect at a session frame, as its kind and JSON text."""

    frame: int
    kind: str
    body: str


@dataclass(frozen=True)
class RecordMark:
    """A mark at a session frame."""

    frame: int
    text: str


@dataclass(frozen=True)
class EndRecording:
    """The session frame at which the recording is to end: all commands before it were sent."""

    frame: int


class Recorder:
    """The supervisor's end: starts the process, passes on what happens, closes it."""

    def __init__(self, path: Path, about: dict[str, str], rings: dict[str, Ring]) -> None:
        """`rings` by the names of the recording's tables."""
        if path.exists():
            raise BadFile(f"{path} is there already; choose another name for the recording")
        self.path = path
        self._job = Job(str(path), about, {table: (ring.where, ring.written) for table, ring in rings.items()})
        self._process = ChildProcess("recorder", __name__, self._job, daemon=False)

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    def restart(self) -> None:
        """Start the process again, where the one that died left the file."""
        self._job = replace(self._job, resume=True)
        self._process = ChildProcess("recorder", __name__, self._job, daemon=False)

    def send(self, message: RecordAbout | RecordCommand | RecordMark) -> None:
        """Let it record something."""
        self._process.send(message)

    def receive(self) -> list[str]:
        """What the recorder has to say, a line each."""
        return self._process.receive()

    def death(self) -> str | None:
        """None while the process lives; else why it died, "" where it has said so itself."""
        if self._process.is_alive:
            return None
        failed = self._process.has_failed
        reason = self._process.end(0.0)
        return reason if failed else ""

    def end(self, frame: int) -> None:
        """Let it write what there is before session frame `frame`, and close the file; nobody waits for that."""
        self._process.send(EndRecording(frame))
        self._process.hang_up()

    def has_ended(self, within_s: float = 0.0) -> bool:
        """After `end`: whether the file is closed. With `within_s`, wait; a process that takes longer is killed."""
        if within_s == 0.0 and self._process.is_alive:
            return False
        self._process.end(within_s)
        return True


@dataclass(frozen=True)
class Job:
    """What the process is given: the file, what is known beforehand, each table's ring and where to begin in it."""

    path: str
    about: dict[str, str]
    rings: dict[str, tuple[RingName, int]]
    resume: bool = False


def run(connection: Connection, job: Job) -> None:
    """The process's main function: writes until the connection ends, then closes the file."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the session
    load_reading()  # before there is a file: whoever sees that knows that nothing is missed from now on
    try:
        writer = Writer(Path(job.path), job.about, job.resume)
        readers = {
            table: Reader(Ring.open(where), start=writer.end(table) or first)
            for table, (where, first) in job.rings.items()
        }
        _write(connection, writer, readers)
        writer.close()
    except (UnderfootError, OSError, sqlite3.Error) as error:
        with suppress(OSError):
            connection.send(f"{job.path} is not recorded any further: {error}")
        return
    for reader in readers.values():
        reader.ring.close()


def _write(connection: Connection, writer: Writer, readers: dict[str, Reader]) -> None:
    end = None
    connected = True
    while connected:
        due = time.monotonic() + COMMIT_S
        try:
            while connection.poll(max(due - time.monotonic(), 0.0)):
                match connection.recv():
                    case RecordCommand(frame, kind, body):
                        writer.command(frame, kind, body)
                    case RecordMark(frame, text):
                        writer.mark(frame, text)
                    case RecordAbout(key, value):
                        writer.say(key, value)
                    case EndRecording(frame):
                        end = frame
        except (EOFError, OSError):
            connected = False  # whoever opened the session is done, or gone
        for table, reader in readers.items():
            first, rows = reader.read()
            while len(rows):
                writer.put(table, first, rows)
                first, rows = reader.read()
        writer.commit()
    if end is not None:
        writer.cut(end)
