"""The recorder: a process of its own that reads the rings and writes the file, so that it outlives everything else."""

import time
from dataclasses import asdict
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from pathlib import Path

import msgspec

from workbench.engine import messages
from workbench.engine.messages import Command, Done, Swap
from workbench.engine.rings import Reader, Ring, RingName
from workbench.engine.target import Target
from workbench.errors import BadFile, UnderfootError
from workbench.patch.patch import Patch
from workbench.records.recording import Writer

EVERY_S = 0.1
"""How often what came in is made safe."""


class Recorder:
    """The supervisor's end: starts the process, passes commands on, closes it."""

    def __init__(
        self,
        context: SpawnContext,
        path: Path,
        target: Target,
        patch: Patch,
        force_rate_hz: float,
        force: RingName,
        vibration: RingName,
    ) -> None:
        if path.exists():
            raise BadFile(f"{path} is there already; choose another name for the recording")
        self.path = path
        about = {
            "patch": patch.dumps().decode(),
            "floor": target.floor.dumps().decode(),
            "rate": str(target.rate),
            "force_rate": repr(force_rate_hz),
            "target": target.kind,
        }
        self._connection, theirs = context.Pipe()
        self._process = context.Process(
            target=run, args=(theirs, str(path), about, force, vibration), name="underfoot recorder", daemon=False
        )
        self._process.start()
        theirs.close()

    def note(self, done: Done) -> None:
        """Record a command with its frame."""
        try:
            self._connection.send(done)
        except OSError:
            return  # the recorder died; `receive` tells

    def receive(self) -> list[str]:
        """What the recorder has to say, a line each."""
        lines = []
        try:
            while self._connection.poll():
                lines.append(self._connection.recv())
        except (EOFError, OSError):
            return lines
        return lines

    def close(self) -> None:
        """Let it write what there is, and wait until the file is closed."""
        self._connection.close()
        self._process.join(10.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._process.close()


def run(connection: Connection, path: str, about: dict[str, str], force: RingName, vibration: RingName) -> None:
    """The process's main function: writes until the connection ends, then closes the file."""
    try:
        force_ring, vibration_ring = Ring.open(force), Ring.open(vibration)
        writer = Writer(Path(path), about)
    except (UnderfootError, OSError) as error:
        connection.send(f"nothing is recorded: {error}")
        return
    forces = Reader(force_ring, start=0)
    frames = Reader(vibration_ring, start=0)
    open_end = True
    while open_end:
        due = time.monotonic() + EVERY_S
        try:
            while connection.poll(max(due - time.monotonic(), 0.0)):
                done = connection.recv()
                writer.command(done.frame, *to_text(done.command))
        except (EOFError, OSError):
            open_end = False  # whoever opened the session is done, or gone
        writer.force(*forces.read())
        writer.vibration(*frames.read())
        writer.commit()
    writer.close()
    force_ring.close()
    vibration_ring.close()


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
        values = {"patch": values["patch"].encode(), "scopes": tuple(values["scopes"])}
    return getattr(messages, kind)(**values)
