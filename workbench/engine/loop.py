"""The block loop from force to vibration, shared by the live engine and the offline renderer."""

from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ, next_span
from underfoot.devices.force_source import ForceSource
from underfoot.engine.commands import Action, CancelStart, Command, Panic, ProgramStart, ProgramSwap, Set, TileEqualiser
from underfoot.engine.equaliser_bank import EqualiserBank
from underfoot.engine.intake import Intake
from underfoot.engine.program_fade import ProgramFader
from underfoot.engine.reports import CommandApplied
from underfoot.engine.safety import Limits, Safety
from underfoot.engine.tile_pulse import TilePulse
from underfoot.floor.simulated_plates import PlateOutput, SimulatedPlates
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import block_kernel
from underfoot.patch.controls import on_ramp
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

Takes = Mapping[str, Callable[[NDArray[np.float32]], None]]
"""Functions that take an output block by block, by the names of `Loop.outputs`."""
_PART = 1024  # frames run at once, so that a source never has more samples waiting than it has room for


class LoopOptions(Struct, frozen=True):
    """Settings of a loop: rate, largest block, first session frame, and the following.

    `limits` are per tile, by default the usual ones; `equalisers` are those of the tiles' profiles. `channels` is the
    output channel of each tile, by default the floor's. `sound_channel` is that of patches' Sound, -1 for none, by
    default the one after the tiles' if the first patch has sound. The output has `outputs` channels at least. `scopes`
    are displayed outputs ("node.port"). `folder` holds the patch's sound files. `seed` replaces the patch's own.
    `plates` says where the acceleration of simulated plates is measured, if anywhere, and `simulation` what they are
    made of, by default the usual. With `measures`, the command is kept without plates, too: for accelerometers.
    """

    rate_hz: float = RATE_HZ
    block: int = 1024
    limits: tuple[Limits, ...] = ()
    equalisers: tuple[TileEqualiser, ...] = ()
    channels: tuple[int, ...] | None = None
    sound_channel: int | None = None
    outputs: int = 0
    scopes: tuple[str, ...] = ()
    folder: Path | None = None
    seed: int | None = None
    frame: int = 0
    plates: tuple[PlateOutput, ...] = ()
    simulation: TileParameters | None = None
    measures: bool = False


class Loop:
    """Runs `patch` on the force of `source`, block by block.

    After `run(n)`, `out` holds n frames, float32 [frame, channel], within full scale (1), and `scope_frames` the same
    frames of the program's first scope, float32 [frame, tile]. With `plates`, `commanded` holds the commanded
    acceleration and `plates[...].out` the measured one, both m/s^2, float32 [frame, tile]. Commands take effect on the
    next span edge, anywhere within a block, and are reported in `applied` with their frame.
    """

    def __init__(
        self, patch: Patch, registry: Registry, source: ForceSource, options: LoopOptions | None = None
    ) -> None:
        self.options = options = options or LoopOptions()
        self.registry, self.source = registry, source
        self.rate_hz, self.block, self.frame = float(options.rate_hz), options.block, options.frame
        floor, rows = source.floor, len(source.floor.tiles)
        self.channels = list(floor.channels if options.channels is None else options.channels)
        self.intake = Intake(source, self.rate_hz, self.block)
        self.programs = ProgramFader(self.build(patch, options.scopes))
        self.pulse = TilePulse(rows, self.rate_hz)
        limits = list(options.limits or (Limits(),) * rows)
        coefficients = {}
        for equaliser in options.equalisers:
            row = floor.index(equaliser.tile)
            limits[row] = replace(limits[row], acceleration_per_unit=equaliser.acceleration_per_unit)
            coefficients[row] = equaliser.coefficients(self.rate_hz)
        self.equalisers = EqualiserBank(rows, coefficients)
        width, sound_channel = max(self.channels, default=0) + 1, options.sound_channel
        if sound_channel is None:
            sound_channel = width if self.program.has_sound else -1
        width = max(width, sound_channel + 1, options.outputs)
        self.safety = Safety(limits, self.channels, self.rate_hz, self.block, width, sound_channel)
        self.out = self.safety.out
        self.scope_frames = np.zeros((self.block, rows), np.float32)
        self.measures = bool(options.plates) or options.measures
        self.commanded = np.zeros((self.block if self.measures else 0, rows), np.float32)
        self.plates = {
            plate_output: SimulatedPlates(
                floor, options.simulation, self.channels, self.rate_hz, self.block, plate_output
            )
            for plate_output in options.plates
        }
        self.applied: deque[CommandApplied] = deque(maxlen=4096)
        self._waiting: deque[tuple[int, Action]] = deque()
        self._start: ProgramStart | None = None  # waits for its frame, apart from the others
        self._set_since: list[Set] = []  # numbers set after its program was built
        on_ramp(0.0, 0.0, 0)  # load the kernel now, so that it does not delay the first command
        _copy_scope(np.zeros((1, 1, 1)), self.scope_frames, 0, 0)
        TileEqualiser("").coefficients(self.rate_hz)
        if self.measures:
            self.safety.commanded(np.zeros((0, 0)), np.zeros(0, np.uint8), self.commanded, 0, 0, 0)

    @property
    def program(self) -> Program:
        """The running program."""
        return self.programs.current

    def build(self, patch: Patch, scopes: tuple[str, ...] = ()) -> Program:
        """Build the program of a patch for this loop. Allocates and loads kernels: never in the callback."""
        program = Program(
            patch if self.options.seed is None else replace(patch, seed=self.options.seed),
            self.registry,
            {tile.id: tile.centre_m for tile in self.source.floor.tiles},
            rate=self.rate_hz,
            block=min(self.block, _PART),  # with more room the tiles' signals are too far apart for the cache
            scopes=scopes,
            folder=self.options.folder,
            with_sound=self.options.sound_channel != -1,
        )
        program.signals = self.intake.signals, self.intake.zero_rows
        return program

    def send(self, action: Action, frame: int | None = None) -> None:
        """Apply a command, or a prepared action, at the first span edge from `frame` (default: now) on.

        Commands take effect in the order in which they were sent. A command that is not `prepared` yet is built and
        loaded here, so only prepared actions may be sent from the callback. Raises `BadValue` for an invalid command.
        """
        if isinstance(action, Command):
            action = action.prepared(self)
        if isinstance(action, ProgramStart) and frame is None and action.command.from_frame > self.frame:
            self._await_start(action)
            return
        if self._start is not None and isinstance(action, Set):
            self._set_since.append(action)
        elif isinstance(action, (ProgramSwap, CancelStart)):
            self._await_start(None)
        self._waiting.append((next_span(self.frame if frame is None else frame), action))

    def panic(self) -> None:
        """Close the outputs from the next span edge on, before all commands already sent."""
        self._waiting.appendleft((next_span(self.frame), Panic()))

    def run(self, n: int) -> None:
        """Run the next `n` frames, at most `block`. Allocates nothing between commands."""
        at = 0
        while at < n:
            now = self.frame + at
            self.programs.update(now)
            stop = self._apply_due(now, min(self.frame + n, now + _PART))
            stop = self.programs.stretch(stop)
            self._run_part(now, at, stop - now)
            at = stop - self.frame
        self.frame += n

    @property
    def outputs(self) -> dict[str, NDArray[np.float32]]:
        """The arrays that `run` fills, by name: "" is `out`; the others are in m/s^2."""
        plates = {plate_output: plates.out for plate_output, plates in self.plates.items()}
        return {"": self.out} | ({"commanded": self.commanded} | plates if self.measures else {})

    def play(self, frames: int) -> NDArray[np.float32]:
        """Run the next `frames` frames, in blocks, and return them: float32 [frame, channel]."""
        return self.play_all(frames)[""]

    def play_all(self, frames: int, takes: Takes = MappingProxyType({})) -> dict[str, NDArray[np.float32]]:
        """Do as `play`, and return all `outputs` by name, without those that one of `takes` takes block by block.

        Those of `measures`, what was `commanded`, and measured at `plates`, are float32 [frame, tile], m/s^2.
        """
        outputs = self.outputs
        kept = {
            name: np.empty((frames, out.shape[1]), np.float32) for name, out in outputs.items() if name not in takes
        }
        for at in range(0, frames, self.block):
            n = min(self.block, frames - at)
            self.run(n)
            for name, out in outputs.items():
                if name in takes:
                    takes[name](out[:n])
                else:
                    kept[name][at : at + n] = out[:n]
        return kept

    def _await_start(self, start: ProgramStart | None) -> None:
        """Delay a start until its frame, instead of any other delayed start; None cancels it."""
        if self._start is not None:
            self.programs.retired.append(self._start.program)
        self._start = start
        self._set_since.clear()

    def _begin_start(self) -> None:
        """Queue the start whose frame has come, followed by the numbers set since its program was built."""
        assert self._start is not None
        self._waiting.append((self.frame, self._start))
        self._waiting.extend((self.frame, moved) for moved in self._set_since)
        self._start = None

    def _apply_due(self, now: int, stop: int) -> int:
        """Apply what is due at frame `now`; return the frame up to which nothing more is due, at most `stop`."""
        if self._start is not None:
            due = next_span(self._start.command.from_frame)
            if due <= now:
                self._begin_start()
            else:
                stop = min(stop, due)
        while self._waiting:
            due, action = self._waiting[0]
            due = max(due, action.free_from(self))
            if due > now or now != next_span(now):
                return min(stop, max(due, next_span(now)))
            self._waiting.popleft()
            action.apply(self, now)
            command = action.reported()
            if command is not None:
                self.applied.append(CommandApplied(now, command))
        return stop

    def _run_part(self, frame: int, at: int, n: int) -> None:
        """Run `n` frames into `out` from its row `at` on; due commands have been applied."""
        self.intake.take(frame + n)
        self.intake.fill(frame, n, with_centroid=bool(self.plates) or self.programs.read_centroid)
        program = self.programs.run(frame, n)
        output, zero_rows = program.output, program.tables.silent
        self.pulse.apply(output, zero_rows, frame, n)
        if self.measures:
            self.safety.commanded(output, zero_rows, self.commanded, frame, at, n)
        self.equalisers.apply(output, zero_rows, frame, n)
        self.safety.apply(program.played, program.zero_rows, frame, at, n)
        for plates in self.plates.values():
            plates.apply(self.out, self.safety.sounding, self.safety.silent_since, self.intake.signals, frame, at, n)
        if program.scope_names:
            _copy_scope(program.tables.scope, self.scope_frames, at, n)


@block_kernel
def _copy_scope(scope: NDArray[np.float64], rows: NDArray[np.float32], at: int, n: int) -> None:
    """Copy the first scope's frames, [scope, row, frame], into `rows` [frame, row] from `at` on."""
    for i in range(n):
        for row in range(rows.shape[1]):
            rows[at + i, row] = scope[0, row, i]
