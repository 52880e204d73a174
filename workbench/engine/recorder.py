"""The recorder: a process that reads the rings and writes the file, and so survives crashes of the others.

While it starts or restarts, the supervisor reads the rings, which hold only a few seconds, and hands the rows over.
"""

import os
import sqlite3
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.engine.child_process import ChildProcess, leave_to_session, wait_for_any
from underfoot.engine.rings import Reader, Ring, RingName
from underfoot.errors import BadFile, UnderfootError
from underfoot.records.recording_writer import Writer, keeps_name, require_free

if TYPE_CHECKING:
    from underfoot.engine.commands import Command

COMMIT_S = 0.05
"""Interval in seconds between commits: half of the allowed loss at a kill, because a busy machine is late."""
_LOOK_S, _SEEN_S = 0.02, 0.001
"""Time between two looks at a recorder that ends; and for which rows wait until every processor sees them."""
_TOO_SLOW = "it was not written as fast as it was played; record to a faster disk, or end other programs"


class RecordAbout(Struct, frozen=True):
    """An entry about the session that was not known at the start."""

    key: str
    value: str


class RecordCommand(Struct, frozen=True):
    """A command applied at a session frame, as its kind and JSON text."""

    frame: int
    kind: str
    body: str


class RecordMark(Struct, frozen=True):
    """A mark at a session frame."""

    frame: int
    text: str


RecordMessage = RecordAbout | RecordCommand | RecordMark


def record_of(frame: int, command: "Command", rate: int) -> RecordCommand | RecordMark:
    """Return what a recording stores of a command that took effect."""
    from underfoot.engine.commands import Mark, to_text  # which the recorder's process need not load

    if isinstance(command, Mark):
        return RecordMark(command.frame(frame, rate), command.text)
    return RecordCommand(frame, *to_text(command))


class EndRecording(Struct, frozen=True):
    """End the recording at this session frame: all commands before it have been sent."""

    frame: int


class RecordRows(Struct, frozen=True):
    """Rows of a table, from number `first` on, that no longer need be read from its ring."""

    table: str
    first: int
    rows: NDArray[Any]


class Begin(Struct, frozen=True):
    """Starts a loaded process: the row to read each ring from, the rows before those, the numbers of the first message
    and the first command to follow, and whether rows were lost before, which has been said.
    """

    starts: dict[str, int]
    missed: tuple[RecordRows, ...] = ()
    first_message: int = 0
    first_command: int = 0
    has_lost: bool = False


class Loaded(Struct, frozen=True):
    """The process has opened the file and waits for `Begin`."""


class Kept(Struct, frozen=True):
    """Number of messages that are safe in the file; also shows that the file exists."""

    messages: int


class Job(Struct, frozen=True):
    """Arguments of the process: the file, entries about the session, and each table's ring and first row."""

    path: str
    about: dict[str, str]
    rings: dict[str, tuple[RingName, int]]
    resume: bool = False


class Recorder:
    """The supervisor's end: starts the process, forwards messages, closes it. Call `receive` often.

    Messages are kept here until they are safe in the file, and repeated to a process that replaces a dead one.
    """

    def __init__(self, path: Path, about: dict[str, str], rings: dict[str, Ring]) -> None:
        """Create the recorder; the keys of `rings` are the names of the recording's tables."""
        require_free(path)
        self.path = path
        self.has_begun = False
        """Whether the file exists."""
        self.last_notices: list[str] = []
        """What `has_ended` received, one line each."""
        self._rings = rings
        for ring in rings.values():
            ring.keep(ring.written)
        self._job = Job(str(path), about, {table: (ring.where, ring.written) for table, ring in rings.items()})
        self._commands = 0
        self._safe = 0  # messages in the file; later ones are in `_unsafe`
        self._unsafe: deque[RecordMessage] = deque()
        self._missed: list[RecordRows] = []
        self._has_lost = False
        self._end: EndRecording | None = None
        self._start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def restart(self) -> None:
        """Restart the process; it continues the file of the one that died."""
        self._job = replace(self._job, resume=True)
        self._start()

    def send(self, message: RecordMessage) -> None:
        """Send a message to be recorded."""
        self._unsafe.append(message)
        self._commands += isinstance(message, RecordCommand)
        if not self._readers:
            self._process.send(message)

    def receive(self) -> list[str]:
        """Return the recorder's notices, one line each."""
        lines, had_lost = [], self._has_lost
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
        self._read_rings()
        self._forget_what_is_kept()
        return lines + [f"{self.path} has gaps: {_TOO_SLOW}"] * (self._has_lost and not had_lost)

    @property
    def has_died(self) -> bool:
        """Whether the process has ended."""
        return not self._process.is_alive

    def reap(self) -> str:
        """Release a process that died, and return the reason; "" if it has reported that itself."""
        return self._process.reap()

    def end(self, frame: int) -> None:
        """Write everything before session frame `frame` and close the file, without waiting."""
        self._end = EndRecording(frame)
        if not self._readers:
            self._process.send(self._end)

    def has_ended(self, within_s: float = 0.0) -> bool:
        """Return whether the file is closed, after `end`. Wait up to `within_s`; a process that is not ready then gets
        as long again to close the file, and is killed.
        """
        until, is_alive = time.perf_counter() + within_s, True
        while is_alive:
            is_alive = self._process.is_alive  # before its last messages are taken
            self.last_notices += self.receive()
            if time.perf_counter() >= until:
                break
            wait_for_any([self._process], _LOOK_S)
        if within_s == 0.0 and is_alive:
            return False
        reason = self._process.end(within_s)
        if reason != "exit status 0":
            self.last_notices.append(f"{self.path} is not recorded to the end: the recorder was lost: {reason}")
        return True

    def _start(self) -> None:
        """Start the process; until it is loaded, rows are read here."""
        self._forget_what_is_kept()
        ends = {missed.table: missed.first + len(missed.rows) for missed in self._missed}
        self._readers = {
            table: Reader(ring, start=max(ring.kept, ends.get(table, 0))) for table, ring in self._rings.items()
        }
        self._process = ChildProcess("recorder", __name__, self._job, daemon=False)

    def _read_rings(self) -> None:
        for table, reader in self._readers.items():
            self._missed += [RecordRows(table, first, rows) for first, rows in _seen(reader)]
            reader.look()
            self._has_lost |= reader.lost > 0

    def _forget_what_is_kept(self) -> None:
        self._missed = [one for one in self._missed if one.first + len(one.rows) > self._rings[one.table].kept]

    def _hand_over(self) -> None:
        """Hand the reading of the rings over to the process."""
        self._read_rings()
        first_command = self._commands - sum(isinstance(one, RecordCommand) for one in self._unsafe)
        starts = {table: reader.next for table, reader in self._readers.items()}
        self._readers = {}
        self._process.send(Begin(starts, tuple(self._missed), self._safe, first_command, self._has_lost))
        for message in self._unsafe:
            self._process.send(message)
        if self._end is not None:
            self.end(self._end.frame)


def run(connection: Connection, job: Job) -> None:
    """Write until the recording or the connection ends, then close the file; the main function of the process.

    A recording that was ended before the first frame leaves no file.
    """
    leave_to_session("SIGINT", "SIGHUP", "SIGTERM")  # it ends with its connection, and then the file is whole
    begin = Begin({table: first for table, (_, first) in job.rings.items()})
    readers: dict[str, Reader] = {}
    writer = None
    try:
        writer = Writer(Path(job.path), job.about, resume=job.resume)  # may wait: until then the supervisor reads rings
        with suppress(EOFError, OSError):  # the session's process is gone: keep what the rings hold
            connection.send(Loaded())
            begin = connection.recv()
        ends = {table: writer.end(table) or 0 for table in job.rings}
        for missed in begin.missed:
            done = max(ends[missed.table] - missed.first, 0)  # rows written by the process that died
            writer.put(missed.table, missed.first + done, missed.rows[done:])
        for table, (where, _) in job.rings.items():
            readers[table] = Reader(Ring.open(where), start=max(begin.starts[table], ends[table]))
        has_ended = _write(connection, writer, readers, begin)
        is_empty = writer.is_empty
        writer.close()
        if has_ended and is_empty:
            os.unlink(job.path)
    except (UnderfootError, OSError, sqlite3.Error) as error:
        why = str(error).replace(f"{job.path} ", "it ")
        log = writer.abandon() if writer is not None else None
        if log is not None:
            why += f"; what was recorded is in it and {log.name} together, until it is opened where its disk has room"
        with suppress(OSError):
            if keeps_name(job.path):
                os.unlink(job.path)
        with suppress(OSError):
            connection.send(f"{job.path} is not recorded any further: {why}")
        return
    for reader in readers.values():
        reader.ring.close()


def _write(connection: Connection, writer: Writer, readers: dict[str, Reader], begin: Begin) -> bool:
    """Write until the recording or the connection ends; return whether it was the recording."""
    messages, next_command, messages_sent = begin.first_message, begin.first_command, -1
    kept_commands, end, goes_on, has_lost = writer.commands(), None, True, begin.has_lost
    while goes_on:
        due = time.perf_counter() + COMMIT_S
        try:
            while goes_on and connection.poll(max(due - time.perf_counter(), 0.0)):
                message = connection.recv()
                messages += not isinstance(message, EndRecording)
                match message:
                    case RecordCommand(frame, kind, body):
                        if next_command >= kept_commands:  # otherwise the process that died has stored it
                            writer.command(frame, kind, body)
                        next_command += 1
                    case RecordMark(frame, text):
                        writer.mark(frame, text)
                    case RecordAbout(key, value):
                        writer.set_about(key, value)
                    case EndRecording(frame):
                        end, goes_on = frame, False
        except (EOFError, OSError):
            goes_on = False  # the session has ended, or its process is gone
        for reader in readers.values():
            reader.look()
        time.sleep(_SEEN_S)
        # All are taken before any is written: after a standstill that takes a while, in which others are overwritten.
        seen = [(table, first, rows) for table, reader in readers.items() for first, rows in _seen(reader)]
        for table, first, rows in seen:
            writer.put(table, first, rows)
        if not has_lost and any(reader.lost for reader in readers.values()):
            has_lost = True  # said once: what was too slow is so again
            with suppress(OSError):
                connection.send(f"{writer.path} has gaps: {_TOO_SLOW}")
        writer.commit()
        if writer.is_gone:
            writer.close()
            raise BadFile("the file was moved, removed or replaced")
        for reader in readers.values():
            reader.ring.keep(reader.next)
        if messages != messages_sent:
            messages_sent = messages
            with suppress(OSError):
                connection.send(Kept(messages))
    if end is not None:
        writer.cut(end)
    return end is not None


def _seen(reader: Reader) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield the rows present at the reader's last look, in pieces without gaps."""
    first, rows = reader.read_seen()
    while len(rows):
        yield first, rows
        first, rows = reader.read_seen()
