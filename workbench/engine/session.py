"""The supervisor: starts, watches and restarts the engine, the compiler and the recorder of one running target.

It is a plain object in the process that opened the session. `poll` never waits: call it some sixty times a second.
"""

import atexit
import json
import math
import multiprocessing
import time
from dataclasses import replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path

import msgspec
import numpy as np

from underfoot.engine import compiler, process
from underfoot.engine import status as fields
from underfoot.engine.compiler import Look, Ready, Warm
from underfoot.engine.correction import corrections_of
from underfoot.engine.messages import (
    Command,
    Correct,
    Done,
    Health,
    Level,
    Lost,
    Notice,
    Play,
    Press,
    Preview,
    Pulse,
    Quit,
    Report,
    Set,
    Started,
    Strike,
    Swap,
    Walk,
)
from underfoot.engine.process import Prepare, Setup
from underfoot.engine.recorder import Recorder, end_process
from underfoot.engine.rings import Reader, Ring
from underfoot.engine.status import Status
from underfoot.engine.target import Target, force_rate_hz
from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.floor.profile import profiles_of
from underfoot.models.filtering.cascade import checked
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

FIRST_LEVEL_DB = -20.0
"""The level of a first start: low, whatever is connected."""
_RING_S = 4.0
_MOST_DEATHS, _WITHIN_S = 4, 20.0  # a process that dies more often than this is not started again
_PATIENCE_S = 1.0
_RECORDER_S = 10.0
_STUCK_S = 5.0  # an engine from which no frame came for so long waits for something that will not come

__all__ = ["Session", "Target"]


class Session:
    """One running target with the patch that it plays. Nothing starts before `start`; `close` ends all."""

    def __init__(self, target: Target, patch: Patch, registry: Registry, folder: Path | None = None) -> None:
        self.target, self.registry, self.folder = target, registry, folder
        self.patch = patch.check(registry)
        self.scopes: tuple[str, ...] = ()
        self.playing, self.level_db = True, FIRST_LEVEL_DB
        known = profiles_of(target.profiles, target.floor) if target.profiles else {}
        self._corrections = {correction.tile: correction for correction in corrections_of(known)}
        tiles = len(target.floor.tiles)
        self.force_rate_hz = force_rate_hz(target)
        self._status = Status.create()
        self._vibration = Ring.create(tiles, round(_RING_S * target.rate))
        self._force = Ring.create(2 + 4 * tiles, round(_RING_S * max(2000.0, self.force_rate_hz)), "float64")
        self._scope = Ring.create(tiles, round(_RING_S * target.rate))
        self._rings = (self._vibration, self._force, self._scope)
        self.vibration, self.scope = VibrationReader(self._vibration), VibrationReader(self._scope)
        self.force = ForceReader(self._force)
        self._context = multiprocessing.get_context("spawn")
        self._engine: _Child | None = None
        self._spare: _Child | None = None
        self._compiler: _Child | None = None
        self._seen = self._stuck = (time.monotonic(), 0)
        self._recorder: Recorder | None = None
        self._ending: list[Recorder] = []
        self._look: Look | None = None
        self._running = False
        self._playable: tuple[Patch, tuple[str, ...]] = (self.patch, self.scopes)  # what the compiler passed last
        self._passed = False
        self._ticket = 0
        self._wanted = 0
        self._reports: list[Report] = []
        self._deaths: list[float] = []
        self._closed = False
        atexit.register(self.close)  # or the interpreter would wait for the recorder for ever

    # --- life ---

    def start(self) -> None:
        """Start compiler and engine; returns at once. The engine plays as soon as the kernels are in the cache."""
        self._compiler = self._spawn("compiler", compiler.run)
        self._engine = self._spawn("engine", process.run)
        self._warm()

    def close(self) -> None:
        """Ramp down, end the processes, and let go of the shared memory."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        self.stop_recording()
        if self._engine is not None:
            self._engine.send(Quit())
            self._engine.end(_PATIENCE_S)
        for child in (self._spare, self._compiler):
            if child is not None:
                child.end(0.0)  # they have nothing to bring to an end
        for ring in self._rings:
            ring.close()
        self._status.close()

    def poll(self) -> list[Report]:
        """What happened since the last call; processes that died are started again."""
        if self._closed:
            return []
        for child in (self._compiler, self._engine):
            self._listen(child)
        self._watch()
        self._revive()
        self._ending = [recorder for recorder in self._ending if not recorder.ended()]
        reports, self._reports = self._reports, []
        return reports

    @property
    def health(self) -> Health:
        """How the engine is."""
        return self._status.health()

    # --- playing ---

    def edit(self, patch: Patch, scopes: tuple[str, ...] = ()) -> None:
        """Play this patch from now on: moved numbers go in ramps, anything else is built beside and faded in."""
        moved = _moved_numbers(self.patch, patch, self.registry) if scopes == self.scopes else None
        self.patch, self.scopes = patch, scopes
        if moved is None:
            self._warm()
        else:
            for command in moved:
                self.send(command)

    def send(self, command: Command) -> None:
        """Send one command to the engine; what it sets outlives the engine.

        Raises `BadValue` for a tile that the floor does not have and for a number that is not finite: nothing of that
        kind may reach the engine.
        """
        _check(command, self.target.floor)
        match command:
            case Play(on):
                self.playing = on
            case Level(db):
                self.level_db = db
            case Walk(on):
                self.target = replace(self.target, walker=on)
            case Correct(tile):
                self._corrections[tile] = command
            case Set(node, name, value):
                self.patch = self.patch.set(node, name, value, self.registry)
                if self.registry[self.patch.node(node).type].parameters[name].kind != "number":
                    self._warm()
                    return
        if self._running and self._engine is not None:
            self._engine.send(command)

    def play(self) -> None:
        """Let sound out, also after a panic."""
        self._status.panic = False
        self.send(Play(True))

    def stop(self) -> None:
        """Ramp sound down; the session goes on."""
        self.send(Play(False))

    def panic(self) -> None:
        """Silence at once, past everything that waits in buffers, until `play`."""
        self._status.panic = True
        self.playing = False
        self.send(Play(False))

    @property
    def panicked(self) -> bool:
        """Whether a panic holds."""
        return self._status.panic

    def preview(self, patch: Patch, node: str, seconds: float = 0.9, tile: str = "") -> int:
        """Ask what a node does in one step: a `Preview` with this ticket follows, unless a newer one is asked for."""
        self._ticket += 1
        if self._compiler is not None:
            tile = tile or self.target.floor.tiles[0].id
            folder = str(self.folder or "")
            self._look = Look(self._ticket, patch.dumps(), node, tile, seconds, self.target.rate, folder)
            self._compiler.send(self._look)
        return self._ticket

    # --- recording ---

    @property
    def recording(self) -> Path | None:
        """The file that is being recorded to."""
        return self._recorder.path if self._recorder is not None else None

    def record(self, path: str | Path) -> None:
        """Record forces, vibration and commands to a new file, from now on, until `stop_recording`.

        Only what was recorded from before `start` on can be replayed.
        """
        self.stop_recording()
        about = {
            "patch": self.patch.dumps().decode(),
            "folder": str(self.folder or ""),
            "floor": self.target.floor.dumps().decode(),
            "rate": str(self.target.rate),
            "force_rate": repr(self.force_rate_hz),
            "target": self.target.kind,
            "corrections": self._corrections_text(),
        }
        self._recorder = Recorder(self._context, Path(path), about, self._force, self._vibration)

    def stop_recording(self) -> None:
        """Close the recording and wait until the file is whole."""
        self.end_recording()
        while self._ending:
            self._ending.pop().ended(_RECORDER_S)

    def end_recording(self) -> None:
        """Close the recording; the file is whole some 0.2 s later, for which nobody waits.

        It ends where the engine last told of all commands: some 20 ms ago.
        """
        if self._recorder is not None:
            told = int(self._status.get(fields.TOLD))
            self._listen(self._engine)
            self._recorder.end(told)
            self._ending.append(self._recorder)
            self._recorder = None

    def _corrections_text(self) -> str:
        return msgspec.json.encode(tuple(self._corrections.values())).decode()

    # --- processes ---

    def _spawn(self, name: str, function: object) -> "_Child":
        ours, theirs = self._context.Pipe()
        child = self._context.Process(target=function, args=(theirs,), name=f"underfoot {name}", daemon=True)  # type: ignore[arg-type]
        child.start()
        theirs.close()
        return _Child(name, child, ours)

    def _warm(self) -> None:
        self._ticket += 1
        self._wanted, self._passed = self._ticket, False
        if self._compiler is not None:
            self._compiler.send(Warm(self._ticket, self.patch.dumps(), self.target, str(self.folder or "")))

    def _listen(self, child: "_Child | None") -> None:
        if child is not None:
            for message in child.receive():
                self._hear(message)

    def _hear(self, message: object) -> None:
        match message:
            case Ready(ticket, error) if ticket == self._wanted:
                if error:
                    self._reports.append(Notice(f"the patch is not played: {error}"))
                    return
                self._playable, self._passed = (self.patch, self.scopes), True
                if self._running and self._engine is not None:
                    self._engine.send(Swap(self.patch.dumps(), self.scopes))
                else:
                    self._go()
            case Ready():
                pass
            case _:
                if isinstance(message, Preview) and self._look is not None and message.ticket == self._look.ticket:
                    self._look = None
                if isinstance(message, Done) and self._recorder is not None:
                    self._recorder.note(message)
                if isinstance(message, Started):
                    if self._recorder is not None:
                        self._recorder.say("channels", json.dumps(message.channels))
                    if self._spare is None:
                        self._spare = self._spawn("engine", process.run)
                        self._spare.send(Prepare())
                self._reports.append(message)  # type: ignore[arg-type]

    def _go(self) -> None:
        """Give the engine, which waits, all that it needs to run."""
        if self._engine is None:
            return
        patch, scopes = (self.patch, self.scopes) if self._passed else self._playable
        if self._recorder is not None and not self._running:
            self._recorder.say("patch", patch.dumps().decode())
            self._recorder.say("corrections", self._corrections_text())
        self._running = True
        self._engine.send(
            Setup(
                target=self.target,
                patch=patch.dumps(),
                scopes=scopes,
                folder=str(self.folder or ""),
                status=self._status.name,
                vibration=self._vibration.where,
                force=self._force.where,
                scope=self._scope.where,
                frame=max(self._seen[1], self._vibration.written),
                playing=self.playing,
                level_db=self.level_db,
                corrections=tuple(self._corrections.values()),
                since=self._seen[0] if self._seen[1] else None,
            )
        )

    def _watch(self) -> None:
        """Note which frame it is; an engine that runs but plays no more frames is killed, and so started again."""
        now, frame = time.monotonic(), int(self._status.get(fields.FRAME))
        running = bool(self._status.get(fields.RUNNING))
        if running and frame != self._seen[1]:
            self._seen = (now, frame)
        if not running or frame != self._stuck[1]:
            self._stuck = (now, frame)
        elif now - self._stuck[0] > _STUCK_S and self._engine is not None:
            self._engine.process.kill()

    def _revive(self) -> None:
        for child in (self._engine, self._compiler):
            if child is None or child.process.is_alive():
                continue
            self._listen(child)
            child.end(_PATIENCE_S)
            if not self._may_revive(child.name, child.reason):
                self._engine = None if child is self._engine else self._engine
                self._compiler = None if child is self._compiler else self._compiler
            elif child is self._engine:
                self._status.stopped()
                self._engine, self._spare = self._spare or self._spawn("engine", process.run), None
                if self._running:
                    self._go()
            else:
                self._compiler = self._spawn("compiler", compiler.run)
                self._warm()
                if self._look is not None:
                    self._compiler.send(self._look)
        recorder = self._recorder
        if recorder is not None:
            self._reports.extend(Notice(text) for text in recorder.receive())
            reason = recorder.gone()
            if reason is None:
                return
            if reason and self._may_revive("recorder", reason):
                recorder.go_on()
            else:
                self._recorder = None

    def _may_revive(self, name: str, reason: str) -> bool:
        """Tell that a process was lost, and say whether to start it again."""
        self._reports.append(Lost(name, reason))
        now = time.monotonic()
        self._deaths = [when for when in self._deaths if now - when < _WITHIN_S] + [now]
        if len(self._deaths) > _MOST_DEATHS:
            self._reports.append(Notice(f"the {name} fails again and again; it is not started any more"))
        return len(self._deaths) <= _MOST_DEATHS


class _Child:
    """A process and the connection to it."""

    def __init__(self, name: str, process: BaseProcess, connection: Connection) -> None:
        self.name, self.process, self._connection = name, process, connection
        self.reason = ""

    def send(self, message: object) -> None:
        try:
            self._connection.send(message)
        except OSError:
            return  # it died; `poll` starts it again with all that it must know

    def receive(self) -> list[object]:
        messages = []
        try:
            while self._connection.poll():
                messages.append(self._connection.recv())
        except (EOFError, OSError):
            return messages  # it died; what it said before counts
        return messages

    def end(self, within_s: float) -> None:
        self._connection.close()
        self.reason = end_process(self.process, within_s)


class VibrationReader:
    """What each tile plays: `read` gives the first new session frame, and float32 [frame, tile], of full scale."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[int, np.ndarray]:
        return self._reader.read()


class ForceReader:
    """Force samples: `read` gives session frames, float64 [n], and corner forces, float64 [n, tile, 4], not tared."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        _, rows = self._reader.read()
        return rows[:, 0].copy(), rows[:, 2:].reshape(len(rows), rows.shape[1] // 4, 4).copy()


def _moved_numbers(old: Patch, new: Patch, registry: Registry) -> list[Set] | None:
    """The numbers that differ between two patches; None if they differ in anything else that is heard."""
    if old.wires != new.wires or old.seed != new.seed or len(old.nodes) != len(new.nodes):
        return None
    moved = []
    for before, after in zip(old.nodes, new.nodes, strict=True):
        if (before.id, before.type) != (after.id, after.type):
            return None
        if before.parameters == after.parameters:
            continue
        type = registry[after.type]
        was, now = type.values(before.parameters), type.values(after.parameters)
        for name, parameter in type.parameters.items():
            if was[name] != now[name]:
                if parameter.kind != "number":
                    return None
                moved.append(Set(after.id, name, now[name]))
    return moved


def _check(command: Command, floor: Floor) -> None:
    if isinstance(command, Strike | Press | Pulse):
        floor.index(command.tile)
    if isinstance(command, Correct):
        floor.index(command.tile)
        require(command.acceleration_per_unit > 0.0, "acceleration_per_unit", command.acceleration_per_unit, "above 0")
        checked(command.sections)
    for name, value in vars(command).items():
        require(not isinstance(value, float) or math.isfinite(value), name, value, "a finite number")
