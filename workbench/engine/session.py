"""The supervisor: starts, watches and restarts the engine, the compiler and the recorder of one running target.

It is a plain object in the process that opened the session. `poll` never waits: call it some sixty times a second.
"""

import atexit
import json
import math
import time
from collections import defaultdict
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from msgspec.structs import replace

from underfoot.devices.force_source import WITHOUT_HARDWARE
from underfoot.engine.calibrations import calibration_texts, calibrations_in_use, with_responses
from underfoot.engine.child_process import ChildProcess, RestartLimit
from underfoot.engine.commands import Command, Level, Play, Set, Start, Swap, TileEqualiser, Walk, equalisers_of
from underfoot.engine.compile_progress import CompileProgress
from underfoot.engine.compiler_supervisor import SHARED, CompilerSupervisor
from underfoot.engine.engine_supervisor import REPORTED_S, EngineSupervisor
from underfoot.engine.patch_edits import moved_numbers
from underfoot.engine.recorder import RecordAbout, record_of
from underfoot.engine.recorder_supervisor import RecorderSupervisor
from underfoot.engine.repeats import Repeats
from underfoot.engine.reports import (
    CommandApplied,
    Compiled,
    Compiling,
    Health,
    Notice,
    OutputChanged,
    PatchRefused,
    ProcessDied,
    RecordingFile,
    Report,
    Started,
    given_up,
)
from underfoot.engine.requests import CompileRequest, ErrorCurveRequest, OutlinesRequest, PreviewRequest, Setup
from underfoot.engine.rings import CLOSED, Reader
from underfoot.engine.session_memory import ForceReader, ResponseReader, SessionMemory
from underfoot.engine.status import Field
from underfoot.engine.target import Target, force_rate_hz, is_simulated, plates_of
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.layout import Tile
from underfoot.floor.profile import profiles_of, round_trip_frames
from underfoot.floor.profile_parts import InUse
from underfoot.floor.tile_parameters import simulation
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

FIRST_LEVEL_DB = -20.0
"""The level of a first start: low, whatever is connected."""
MOST_DEATHS, WITHIN_S = 4, 20.0
"""A process that dies more often than this is not started again."""
STANDBY_AFTER_S = 3.0
"""Time after the first engine's start at which a standby engine and the compiler are started, unless needed sooner.
Until then, the processor is free for what the user waits for.
"""


class Session:
    """A running target with the patch that it plays. Nothing starts before `start`; `close` ends all, and then whatever
    is asked of it is a `DeviceError`."""

    def __init__(
        self,
        target: Target,
        patch: Patch,
        registry: Registry,
        folder: Path | None = None,
        engine: ChildProcess | None = None,
        *,
        is_edited: bool = True,
    ) -> None:
        """Create the session; `engine` is a process started earlier (`engine_process`), which is ready sooner.

        If `is_edited` is false, the compiler is only started by an edit or a preview.
        """
        self.target, self.registry, self.folder = target, registry, folder
        self.patch = patch.check(registry)
        self.scopes: tuple[str, ...] = ()
        self.playing, self.level_db = True, FIRST_LEVEL_DB
        self.silence = ""
        """Which sound cards do not play that should; "" for none, and where a simulator has begun without one."""
        profiles = profiles_of(target.profiles, target.floor)
        is_of_the_card = target.kind != "simulator" or not is_simulated(target)  # or measured on the simulated tile
        if is_of_the_card and not target.round_trip_frames:
            self.target = replace(target, round_trip_frames=round_trip_frames(profiles, target.rate, target.block))
        self._equalisers = {equaliser.tile: equaliser for equaliser in equalisers_of(profiles)}
        self._calibrations = calibrations_in_use(self.target, profiles)  # once: a window waits for a recording's begin
        self.force_rate_hz = force_rate_hz(target)
        self.memory = SessionMemory.create(len(target.floor.tiles), target.rate, self.force_rate_hz)
        self.vibration, self.scope = Reader(self.memory.vibration), Reader(self.memory.scope)
        self.response = ResponseReader(self.memory.commanded, self.memory.measured)
        self.memory.status.put(Field.LEVEL_DB, self.level_db)
        self.memory.status.put(Field.PLAYING, self.playing)
        self.force = ForceReader(self.memory.force)
        self._engine = EngineSupervisor(self.memory, target.sound, engine)
        self._compiler = CompilerSupervisor()
        self._is_edited = is_edited
        self._recorder = RecorderSupervisor(self.memory.recorded)
        self._restarts = defaultdict[str, RestartLimit](lambda: RestartLimit(MOST_DEATHS, WITHIN_S))
        self._setup: Setup | None = None  # the program last sent to the engine; the first waits for a recorder's file
        self._started = False  # whether the engine plays it
        self._standby_due = math.inf
        self._plays: tuple[Patch, tuple[str, ...]] = (self.patch, self.scopes)  # as reported, with numbers set since
        self.is_compiled = True
        """Whether the present patch is not being compiled; the engine compiles the first one itself."""
        self._anew, self._settle_s = False, 0.0  # how it will be played, by all edits since what plays
        self._is_refused = False  # whether an earlier patch plays instead of the present one
        self._compile_progress = CompileProgress()
        self._reports: list[Report] = []
        self._closed = False
        self.repeats = Repeats(self.restart, self.send, target.rate)
        atexit.register(self.close)  # otherwise the interpreter would wait for the recorder forever

    # --- life ---

    def start(self) -> None:
        """Start the engine; returns at once. It plays as soon as it has loaded its kernels.

        Where it has to compile them, the compiler begins at the other end; otherwise that one starts afterwards.
        A session that is recorded plays once its file is there.
        """
        self._require_open()
        self._engine.start()
        self._start_engine()

    def close(self) -> list[str]:
        """Ramp down, end the processes, and release the shared memory; return what `stop_recording` does."""
        if self._closed:
            return []
        self._closed = True
        atexit.unregister(self.close)
        said = self.stop_recording()
        self._engine.close()
        self._compiler.close()
        self.memory.close()
        return said

    def poll(self) -> list[Report]:
        """Return the reports since the last call, and restart processes that have died."""
        if self._closed:
            return []
        self._handle_compiler_answers()
        self._handle_engine_reports()
        self._engine.watch()
        self._restart_engine()
        if self.playing:
            self.repeats.poll(int(self.memory.status.get(Field.FRAME)))
        if time.perf_counter() > self._standby_due:
            self._standby_due = math.inf
            self._engine.stand_by(self._setup)
            if self._is_edited:
                self._compiler.start()
        self._restart_compiler()
        self._restart_recorder()
        reports, self._reports = self._reports, []
        for report in reports:
            if isinstance(report, Started) and self.target.kind in WITHOUT_HARDWARE and not self.silence:
                continue  # without a card a simulator begins all the same
            if isinstance(report, Started | OutputChanged):
                self.silence = report.silence
        return reports

    @property
    def why_silent(self) -> str:
        """Why nothing is heard of what plays: "panic", "stopped", or as `silence`; "" if it is."""
        return self.silence if self.playing else "panic" if self.memory.status.panic else "stopped"

    def _require_open(self) -> None:
        if self._closed:
            raise DeviceError(CLOSED)

    @property
    def health(self) -> Health:
        """The state of the engine."""
        self._require_open()
        return self.memory.status.health()

    @property
    def played_s(self) -> float:
        """Elapsed time of the session in seconds; the samples until then are in the rings already."""
        return self.health.frame / self.target.rate

    @property
    def pids(self) -> dict[str, int]:
        """The numbers of the processes that run, by name: engine, standby, compiler, recorder."""
        return {**self._engine.pids, **self._compiler.pids, **self._recorder.pids}

    # --- playing ---

    def edit(self, patch: Patch, scopes: tuple[str, ...] = (), *, anew: bool = False, settle_s: float = 0.0) -> None:
        """Play this patch from now on: changed numbers are ramped; other changes build a program, which is faded in."""
        self._require_open()
        moved = self.moved_numbers(patch) if scopes == self.scopes and not anew else None
        self.patch, self.scopes = patch, scopes
        if moved is None:
            self._request_compile(anew=anew, settle_s=settle_s)
        else:
            for command in moved:
                self.send(command)
            self.patch = patch  # as given: `send` has written defaults out

    def moved_numbers(self, patch: Patch) -> list[Set] | None:
        """Return the numbers by which a patch differs from what plays; None if it needs a program of its own."""
        return None if self._is_refused else moved_numbers(self.patch, patch, self.registry)

    def send(self, command: Command) -> None:
        """Send one command to the engine; its settings are restored after a restart of the engine."""
        self._require_open()
        command.check(self.target.floor)
        match command:
            case Play(on):
                self.playing = on
                self.memory.status.put(Field.PLAYING, on)
            case Level(db):
                self.level_db = db
                self.memory.status.put(Field.LEVEL_DB, db)
            case Walk(on):
                self.target = replace(self.target, walker=on)
            case TileEqualiser(tile):
                self._equalisers[tile] = command
            case Set(node, name, value):
                self.patch = self.patch.set(node, name, value, self.registry)
                is_ramped = self.registry[self.patch.node(node).type].parameters[name].is_ramped
                if self._is_refused or not is_ramped:
                    self._request_compile()
                    return
                with suppress(BadValue):  # of a node that is only in the patch that is being compiled
                    self._plays = self._plays[0].set(node, name, value, self.registry), self._plays[1]
        if self._started:
            self._engine.send(command)

    def restart(self, tile: str, from_frame: int = 0) -> bool:
        """Play the patch from its start, with a step on a tile, as `Start`; whether it can, now.

        It cannot while a patch is compiled, and before the engine plays.
        """
        can_start = self._started and self.is_compiled
        if can_start:
            self.send(Start(self.patch.dumps(), self.scopes, tile=tile, from_frame=from_frame))
        return can_start

    def play(self) -> None:
        """Open the output, also after a panic."""
        self._require_open()
        self.memory.status.panic = False
        self.send(Play(True))

    def stop(self) -> None:
        """Ramp sound down; the session goes on."""
        self.send(Play(False))

    def panic(self) -> None:
        """Silence at once, past everything that waits in buffers, until `play`."""
        self._require_open()
        self.memory.status.panic = True
        self.send(Play(False))

    def preview(
        self, patch: Patch, node: str, seconds: float = 0.0, tile: Tile | None = None, *, distributions: bool = False
    ) -> int:
        """Request a node's response to one step; return the ticket of the `Preview`, which a newer request cancels."""
        self._require_open()
        on = tile or self.target.floor.tiles[0]
        through = tuple(equaliser for equaliser in self._equalisers.values() if equaliser.tile == on.id)
        ticket, rate = self._compiler.new_ticket(), self.target.rate
        return self._request_picture(
            PreviewRequest(ticket, patch.dumps(), node, on, seconds, rate, self.folder, distributions, through)
        )

    def outline(self, patch: Patch, nodes: Sequence[str], seconds: float = 0.0, tile: Tile | None = None) -> int:
        """Request small pictures of nodes' responses, until a preview is requested; return the ticket of `Outlines`."""
        self._require_open()
        on = tile or self.target.floor.tiles[0]
        ticket, rate = self._compiler.new_ticket(), self.target.rate
        return self._request_picture(
            OutlinesRequest(ticket, patch.dumps(), tuple(nodes), on, seconds, rate, self.folder)
        )

    def _request_picture(self, request: PreviewRequest | OutlinesRequest) -> int:
        self._compiler.request_picture(request)
        if self._started:
            self._compiler.start()
        return request.ticket

    def measure_errors(self, patch: Patch, node: str) -> int:
        """Measure the run time over error of a node: an `ErrorCurveDrawn` with this ticket comes after each point.

        Any other request stops it.
        """
        self._require_open()
        ticket = self._compiler.new_ticket()
        self._compiler.measure_errors(ErrorCurveRequest(ticket, patch.dumps(), node))
        return ticket

    # --- recording ---

    @property
    def recording(self) -> Path | None:
        """The file that is being recorded to."""
        return self._recorder.path

    def record(self, path: str | Path) -> None:
        """Record forces, vibration and commands to a new file, from now on, until `stop_recording`.

        Only what was recorded from before `start` on can be replayed.
        """
        self._require_open()
        self._reports.extend(Notice(text) for text in self.stop_recording())
        made_of, _ = simulation(self.target.simulation)
        about = {
            "patch": self.patch.dumps().decode(),
            "folder": str(self.folder or ""),
            "floor": self.target.floor.dumps().decode(),
            "rate": str(self.target.rate),
            "force_rate": repr(self.force_rate_hz),
            "target": self.target.kind,
            "begun": datetime.now().isoformat(timespec="seconds"),
            **calibration_texts(self._equalisers, self.calibrations),
            "simulation": made_of.dumps().decode() if made_of else "",
        }
        self._recorder.begin(Path(path), about)

    def stop_recording(self) -> list[str]:
        """End the recording at the present frame, and wait for its file; return what it lacks, one line each."""
        self.end_recording(within_s=REPORTED_S)
        return self._recorder.wait()

    def end_recording(self, within_s: float = 0.0) -> None:
        """End the recording at the frame that the engine has reported, the present one if it does within this time;
        the file is complete about 0.2 s later.
        """
        if self.recording is not None:
            self._recorder.end(self._engine.reported_frame(self._handle_engine_reports, within_s))

    def recording_files(self) -> list[RecordingFile]:
        """Return what has become of the files of recordings since the last `poll`; for a session that was closed."""
        return self._recorder.take_files()

    @property
    def calibrations(self) -> InUse:
        """The calibrations in use, by tile and part of its profile."""
        return with_responses(self._calibrations, self._equalisers)

    # --- the compiler ---

    def _request_compile(self, *, anew: bool = False, settle_s: float = 0.0) -> None:
        """Compile the kernels of the present patch; it is played as soon as they are ready."""
        if self._setup is not None:
            self.is_compiled = False
            self._anew, self._settle_s = self._anew or anew, max(self._settle_s, settle_s)
            self._compiler.compile(self._compile_request(self._compiler.new_ticket()))

    def _compile_request(self, ticket: int, *, from_end: bool = False) -> CompileRequest:
        return CompileRequest(ticket, self.patch.dumps(), self.target, self.folder, plates_of(self.target), from_end)

    def _handle_compiler_answers(self) -> None:
        for message in self._compiler.receive():
            match message:
                case Compiled(error=error):
                    if self._compile_progress.forget("compiler"):
                        self._reports.append(Compiling(1, 1))
                    if error:
                        self._is_refused = True
                        self._reports.append(PatchRefused.because(error))
                    else:
                        self._play_compiled()
                case Compiling():
                    if not (self._started and self.is_compiled):
                        self._reports += self._compile_progress.take("compiler", message)
                case _:
                    self._reports.append(message)

    def _play_compiled(self) -> None:
        """Play the present patch, whose kernels are compiled now."""
        self.is_compiled, self._is_refused = True, False
        if self._started:
            self._engine.send(Swap(self.patch.dumps(), self.scopes, anew=self._anew, settle_s=self._settle_s))
            self.repeats.resend()
        else:
            self._plays = self.patch, self.scopes
        self._anew, self._settle_s = False, 0.0

    def _restart_compiler(self) -> None:
        if not self._compiler.has_died:
            return
        self._handle_compiler_answers()
        if self._may_restart("compiler", self._compiler.reap()):
            (self._compiler.start if self.is_compiled else self._request_compile)()

    # --- the engine ---

    def _start_engine(self) -> None:
        """Send the waiting engine its configuration, after a requested recording has started."""
        if self._setup is None and self._recorder.awaits_file:
            return
        self._plays = patch, scopes = self._playable
        if self._setup is None:
            self._recorder.send(RecordAbout("patch", patch.dumps().decode()))
            for key, text in calibration_texts(self._equalisers, self.calibrations).items():
                self._recorder.send(RecordAbout(key, text))
        self._started = False
        frame, since = self._engine.resume_point
        self._setup = Setup(
            target=self.target,
            patch=patch.dumps(),
            scopes=scopes,
            folder=self.folder,
            memory=self.memory.names,
            frame=frame,
            equalisers=tuple(self._equalisers.values()),
            since=since,
        )
        self._engine.send(self._setup)

    def _catch_up(self, setup: Setup, started: Started) -> None:
        """Send the engine the changes made while it loaded, during which nothing could be sent."""
        self._started = True
        self._compile_progress.clear()
        if self.level_db != started.level_db:
            self._engine.send(Level(self.level_db))
        if self.playing != started.playing:
            self._engine.send(Play(self.playing))
        if self.target.walker != setup.target.walker:
            self._engine.send(Walk(self.target.walker))
        for equaliser in self._equalisers.values():
            if equaliser not in setup.equalisers:
                self._engine.send(equaliser)
        self._plays = patch, scopes = self._playable
        if (patch.dumps(), scopes) != (setup.patch, setup.scopes):
            self._engine.send(Swap(patch.dumps(), scopes))

    @property
    def _playable(self) -> tuple[Patch, tuple[str, ...]]:
        """The patch and scopes to play at once: what plays, while the present patch is compiled or if it is refused."""
        return (self.patch, self.scopes) if self.is_compiled and not self._is_refused else self._plays

    def _handle_engine_reports(self) -> None:
        for message in self._engine.receive():
            self.repeats.take_report(message)
            match message:
                case CommandApplied(frame, command):
                    if isinstance(command, Swap):
                        swapped = Patch.loads(command.patch, self.registry)
                        is_present = moved_numbers(swapped, self.patch, self.registry) is not None
                        self._plays = (self.patch if is_present else swapped), command.scopes  # with numbers set since
                    if self.recording is not None:
                        self._recorder.send(record_of(frame, command, self.target.rate))
                case Compiling():
                    if not self._compiler.is_started:
                        self._compiler.start(self._compile_request(SHARED, from_end=True))
                    self._reports += self._compile_progress.take("engine", message)
                    continue
                case PatchRefused():
                    self._is_refused = True
                case Started(channels=channels) as started:
                    self._recorder.send(RecordAbout("channels", json.dumps(channels)))
                    assert self._setup is not None
                    self._catch_up(self._setup, started)
                    self._standby_due = time.perf_counter() + (STANDBY_AFTER_S if self._setup.since is None else 0.0)
                    if self._compiler.awaits_picture:
                        self._compiler.start()
            self._reports.append(message)

    def _restart_engine(self) -> None:
        if not self._engine.has_died:
            return
        self._handle_engine_reports()
        if self._may_restart("engine", self._engine.reap()):
            self._engine.start()
            self._start_engine()

    # --- processes that died ---

    def _restart_recorder(self) -> None:
        has_died = self._recorder.has_died  # asked first: what it reported before it ended is then received
        self._reports.extend(Notice(text) for text in self._recorder.receive())
        if has_died:
            if (reason := self._recorder.reap()) and self._may_restart("recorder", reason):
                self._recorder.restart()
            else:
                self._recorder.give_up()
        self._reports.extend(self._recorder.take_files())
        if self._setup is None and self._engine.is_started:
            self._start_engine()

    def _may_restart(self, name: str, reason: str) -> bool:
        """Report that a process died, and say whether to start it again."""
        allowed = self._restarts[name].allows_after_death()
        self._reports.append(ProcessDied(name, reason, allowed))
        if not allowed:
            self._reports.append(given_up(name, reason, patch_waits=not self.is_compiled))
        return allowed
