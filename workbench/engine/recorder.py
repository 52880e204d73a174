"""The recorder: a process of its own that reads the rings and writes the file, so that it outlives everything else.

While it starts, or another starts in its place, the supervisor reads the rings, which hold a few seconds only, and
hands over what it has read.
"""

import os
import signal
import sqlite3
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from underfoot.engine.child_process import ChildProcess, wait_for_any
from underfoot.engine.rings import Reader, Ring, RingName
from underfoot.errors import BadFile, UnderfootError
from underfoot.records.recording import Writer

COMMIT_S = 0.05
"""How often what came in is made safe: half of what a kill may cost, since a busy machine is late."""
_LOOK_S, _SEEN_S = 0.02, 0.001


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


@dataclass(frozen=True)
class RecordRows:
    """Rows of a table, from number `first` on, that nobody else will read from its ring."""

    table: str
    first: int
    rows: NDArray[Any]


@dataclass(frozen=True)
class Begin:
    """What the process waits for once it is loaded: from which row on it reads each ring, what comes before these, and
    the numbers of the first message and of the first command that it is told."""

    starts: dict[str, int]
    missed: tuple[RecordRows, ...] = ()
    first_message: int = 0
    first_command: int = 0


@dataclass(frozen=True)
class Loaded:
    """The process can read, and waits for `Begin`."""


@dataclass(frozen=True)
class Kept:
    """How many messages are safe in the file, which is there."""

    messages: int


@dataclass(frozen=True)
class Job:
    """What the process is given: the file, what is known beforehand, each table's ring and where to begin in it."""

    path: str
    about: dict[str, str]
    rings: dict[str, tuple[RingName, int]]
    resume: bool = False


class Recorder:
    """The supervisor's end: starts the process, passes on what happens, closes it. `receive` is to be called often.

    What the process was told is kept here until it is safe, and told again to the one that takes its place.
    """

    def __init__(self, path: Path, about: dict[str, str], rings: dict[str, Ring]) -> None:
        """`rings` by the names of the recording's tables."""
        if os.path.exists(path):
            raise BadFile(f"{path} is there already; choose another name for the recording")
        self.path = path
        self.has_begun = False
        """Whether the file is there."""
        self._rings = rings
        for ring in rings.values():
            ring.keep(ring.written)
        self._job = Job(str(path), about, {table: (ring.where, ring.written) for table, ring in rings.items()})
        self._commands = 0
        self._safe = 0  # so many messages are in the file; those behind them are in `_unsafe`
        self._unsafe: deque[RecordAbout | RecordCommand | RecordMark] = deque()
        self._missed: list[RecordRows] = []
        self._end: EndRecording | None = None
        self._start()

    @property
    def pid(self) -> int:
        """The number of the process."""
        return self._process.pid

    def restart(self) -> None:
        """Start the process again, where the one that died left the file."""
        self._job = replace(self._job, resume=True)
        self._start()

    def send(self, message: RecordAbout | RecordCommand | RecordMark) -> None:
        """Let it record something."""
        self._unsafe.append(message)
        self._commands += isinstance(message, RecordCommand)
        if not self._readers:
            self._process.send(message)

    def receive(self) -> list[str]:
        """What the recorder has to say, a line each."""
        lines = []
        for message in self._process.receive():
            match message:
                case Loaded():
                    self._hand_over()
                case Kept(messages):
                    self.has_begun = True
                    while self._safe < messages:
                        self._unsafe.popleft()
                        self._safe += 1
                case _:
                    lines.append(message)
        self._collect()
        self._forget_what_is_kept()
        return lines

    def death(self) -> str | None:
        """None while the process lives; else why it died, "" where it has said so itself."""
        if self._process.is_alive:
            return None
        failed = self._process.has_failed
        reason = self._process.end(0.0)
        return reason if failed else ""

    def end(self, frame: int) -> None:
        """Let it write what there is before session frame `frame`, and close the file; nobody waits for that."""
        self._end = EndRecording(frame)
        if not self._readers:
            self._process.send(self._end)
            self._process.hang_up()

    def has_ended(self, within_s: float = 0.0) -> bool:
        """After `end`: whether the file is closed. With `within_s`, wait; a process that takes longer is killed.

        One that is not loaded yet has so long for that, and then as long again.
        """
        until = time.monotonic() + within_s
        while self._readers and self._process.is_alive:
            self.receive()
            if not self._readers or time.monotonic() >= until:
                break
            wait_for_any([self._process], _LOOK_S)
        if within_s == 0.0 and self._process.is_alive:
            return False
        self._process.end(within_s)
        return True

    def _start(self) -> None:
        """Start the process; until it is loaded, rows are read here."""
        self._forget_what_is_kept()
        ends = {missed.table: missed.first + len(missed.rows) for missed in self._missed}
        self._readers = {
            table: Reader(ring, start=max(ring.kept, ends.get(table, 0))) for table, ring in self._rings.items()
        }
        self._process = ChildProcess("recorder", __name__, self._job, daemon=False)

    def _collect(self) -> None:
        for table, reader in self._readers.items():
            self._missed += [RecordRows(table, first, rows) for first, rows in _seen(reader)]
            reader.look()

    def _forget_what_is_kept(self) -> None:
        self._missed = [one for one in self._missed if one.first + len(one.rows) > self._rings[one.table].kept]

    def _hand_over(self) -> None:
        """Let the process go on from here."""
        self._collect()
        first_command = self._commands - sum(isinstance(one, RecordCommand) for one in self._unsafe)
        starts = {table: reader.next for table, reader in self._readers.items()}
        self._readers = {}
        self._process.send(Begin(starts, tuple(self._missed), self._safe, first_command))
        for message in self._unsafe:
            self._process.send(message)
        if self._end is not None:
            self.end(self._end.frame)


def run(connection: Connection, job: Job) -> None:
    """The process's main function: writes until the connection ends, then closes the file."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the session
    begin = Begin({table: first for table, (_, first) in job.rings.items()})
    with suppress(EOFError, OSError):  # whoever opened the session is gone: what the rings have is kept
        connection.send(Loaded())
        begin = connection.recv()
    readers: dict[str, Reader] = {}
    try:
        writer = Writer(Path(job.path), job.about, job.resume)
        ends = {table: writer.end(table) or 0 for table in job.rings}
        for missed in begin.missed:
            done = max(ends[missed.table] - missed.first, 0)  # by the process that died
            writer.put(missed.table, missed.first + done, missed.rows[done:])
        for table, (where, _) in job.rings.items():
            readers[table] = Reader(Ring.open(where), start=max(begin.starts[table], ends[table]))
        _write(connection, writer, readers, begin)
        writer.close()
    except (UnderfootError, OSError, sqlite3.Error) as error:
        with suppress(OSError):
            connection.send(f"{job.path} is not recorded any further: {error}")
        return
    for reader in readers.values():
        reader.ring.close()


def _write(connection: Connection, writer: Writer, readers: dict[str, Reader], begin: Begin) -> None:
    messages, next_command, told = begin.first_message, begin.first_command, -1
    kept_commands, end, connected = writer.commands(), None, True
    while connected:
        due = time.monotonic() + COMMIT_S
        try:
            while connection.poll(max(due - time.monotonic(), 0.0)):
                message = connection.recv()
                messages += not isinstance(message, EndRecording)
                match message:
                    case RecordCommand(frame, kind, body):
                        if next_command >= kept_commands:  # or the process that died has kept it
                            writer.command(frame, kind, body)
                        next_command += 1
                    case RecordMark(frame, text):
                        writer.mark(frame, text)
                    case RecordAbout(key, value):
                        writer.say(key, value)
                    case EndRecording(frame):
                        end = frame
        except (EOFError, OSError):
            connected = False  # whoever opened the session is done, or gone
        for reader in readers.values():
            reader.look()
        time.sleep(_SEEN_S)
        for table, reader in readers.items():
            for first, rows in _seen(reader):
                writer.put(table, first, rows)
        writer.commit()
        for reader in readers.values():
            reader.ring.keep(reader.next)
        if messages != told:
            told = messages
            with suppress(OSError):
                connection.send(Kept(messages))
    if end is not None:
        writer.cut(end)


def _seen(reader: Reader) -> Iterator[tuple[int, NDArray[Any]]]:
    """What was there at the reader's last look, in pieces without a gap."""
    first, rows = reader.read_seen()
    while len(rows):
        yield first, rows
        first, rows = reader.read_seen()
