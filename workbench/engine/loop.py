"""Force in, vibration out: what the live engine and the offline renderer both run, block after block."""

import time
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from underfoot.clock import FADE, RATE_HZ, next_span
from underfoot.devices.force_source import ForceSource
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.correction import Correction, tuning_of
from underfoot.engine.intake import Intake
from underfoot.engine.messages import Command, Correct, Done, Level, Panic, Play, Press, Pulse, Set, Strike, Tare, Walk
from underfoot.engine.safety import Limits, Safety
from underfoot.errors import BadValue
from underfoot.floor.layout import Floor
from underfoot.kernels import kernel
from underfoot.patch import driver
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import HOSTS, Program

PULSE_HZ, PULSE_S, PULSE = 60.0, 0.25, 8.0
"""The burst that tells which tile is which: frequency, length, and height in m/s^2."""

_PART = 1024  # frames that are run at once, so that a source never has more samples waiting than it has room for


@dataclass(frozen=True)
class InTurn:
    """A program to be faded in only when the one before has been faded out: both at once would cost too much."""

    program: Program


@dataclass(frozen=True)
class Prepared:
    """A correction with its equaliser made ready, so that nothing is computed in the callback."""

    correction: Correct
    row: int
    tuning: np.ndarray


class Loop:
    """Runs `patch` on the force of `source`, in blocks of up to `block` frames, from session frame `frame` on.

    After `run(n)`, `out` holds n frames, float32 [frame, channel], full scale at most 1, and `scoped` the same frames
    of the program's first scope, float32 [frame, tile]. Commands act on the next span edge, wherever in a block that
    is, and are told in `done` with their frame. `spent_s` is the time inside programs. Programs that were replaced lie
    in `retired`, so that someone else can let go of their memory. `corrections` are those of the tiles' profiles.
    """

    def __init__(
        self,
        patch: Patch,
        registry: Registry,
        source: ForceSource,
        *,
        rate: float = RATE_HZ,
        block: int = 1024,
        limits: list[Limits] | None = None,
        corrections: Sequence[Correct] = (),
        channels: list[int] | None = None,
        scopes: tuple[str, ...] = (),
        folder: Path | None = None,
        seed: int | None = None,
        frame: int = 0,
    ) -> None:
        self.registry, self.source, self.rate, self.block = registry, source, float(rate), block
        self.frame = frame
        self._folder, self._seed = folder, seed
        floor = source.floor
        self.channels = output_channels(floor) if channels is None else channels
        self.intake = Intake(source, rate)
        self.program = self.build(patch, scopes)
        limits = list(limits or [Limits()] * len(floor.tiles))
        for correction in corrections:
            row = floor.index(correction.tile)
            limits[row] = replace(limits[row], acceleration_per_unit=correction.acceleration_per_unit)
        self.correction = Correction(floor, corrections, self.rate)
        self.safety = Safety(limits, self.channels, rate, block, max(self.channels, default=0) + 1)
        self.out = self.safety.out
        self.done: deque[Done] = deque(maxlen=4096)
        self._commands: deque[tuple[int, Command | Program | InTurn | Prepared]] = deque()
        self._fade, self._fade_from = "", 0  # from "old" to new, or "out" and then "in"
        self._old = self._next = self.program  # what is faded out beside the program, or waits to be faded in
        self.retired: deque[Program] = deque(maxlen=8)
        self._pulse, self._pulse_end = np.full(len(floor.tiles), -1, np.int64), 0
        self.spent_s = 0.0
        self._signals = tuple(np.zeros((len(HOSTS), len(floor.tiles), block)))
        self.scoped = np.zeros((block, len(floor.tiles)), np.float32)
        self._load_kernels()

    def build(self, patch: Patch, scopes: tuple[str, ...] = ()) -> Program:
        """The program of a patch for this loop. Allocates and loads kernels: never in the callback."""
        return Program(
            patch,
            self.registry,
            self.source.floor.ids,
            rate=self.rate,
            block=self.block,
            scopes=scopes,
            folder=self._folder,
            seed=self._seed,
        )

    def prepare(self, correction: Correct) -> Prepared:
        """A correction for this loop. Allocates: never in the callback. `BadValue` for one that cannot be."""
        row = self.source.floor.index(correction.tile)
        return Prepared(correction, row, tuning_of(correction, self.rate))

    def send(self, command: Command | Program | InTurn | Prepared, frame: int | None = None) -> None:
        """Let a command, or a program that was built, take effect at the first span edge from `frame` (now) on.

        Commands take effect in the order in which they were sent. A correction is prepared here if it is not yet.
        """
        if isinstance(command, Correct):
            command = self.prepare(command)
        self._commands.append((next_span(self.frame if frame is None else frame), command))

    def panic(self) -> None:
        """Close in 1 ms from the next span edge on, before all that was sent."""
        self._commands.appendleft((next_span(self.frame), Panic()))

    def run(self, n: int) -> None:
        """Run the next `n` frames, at most `block`. Between commands it allocates nothing."""
        at = 0
        while at < n:
            now = self.frame + at
            stop = min(n, at + _PART)
            if self._fade and now >= self._fade_from + FADE:
                self._end_fade(now)
            while self._commands:
                due, command = self._commands[0]
                if self._fade and isinstance(command, Program | InTurn):
                    due = max(due, self._fade_from + FADE)  # one fade after the other
                elif isinstance(command, Prepared):
                    due = max(due, self.correction.free(command.row))
                if due <= now and now == next_span(now):
                    self._commands.popleft()
                    self._apply(command, now)
                    continue
                stop = min(stop, max(due, next_span(now)) - self.frame)
                break
            if self._fade:
                stop = min(stop, self._fade_from + FADE - self.frame)
            self._part(self.frame + at, at, stop - at)
            at = stop
        self.frame += n

    def _part(self, frame: int, at: int, n: int) -> None:
        """Run `n` frames into `out` from its row `at` on; whatever a command changed is in force by now."""
        program, old = self.program, self._old
        force, x, y = self._signals
        self.intake.take(frame + n)
        self.intake.fill(force, x, y, frame, n)
        self._bring(program, n)
        began = time.perf_counter()
        program.run(frame, n)
        self.spent_s += time.perf_counter() - began
        if self._fade == "old":
            self._bring(old, n)
            old.run(frame, n)
            _cross(old.output, program.output, program.tables.still, self._fade_from, frame, n)
        elif self._fade:
            _scale(program.output, program.tables.still, self._fade == "in", self._fade_from, frame, n)
        if frame < self._pulse_end:
            _pulse(program.output, program.tables.still, self._pulse, frame, n, self.rate)
        self.correction.apply(program.output, program.tables.still, frame, n)
        self.safety.apply(program.output, program.tables.still, frame, at, n)
        if program.scope_names:
            _look_in(program.tables.scope, self.scoped, at, n)

    def _bring(self, program: Program, n: int) -> None:
        for name, signal in zip(HOSTS, self._signals, strict=True):
            if name in program.hosts:
                _copy(signal, program.hosts[name], n)

    def _load_kernels(self) -> None:
        """Load what is not called before the first command of its kind, so that no command is late for it."""
        driver.on_ramp(0.0, 0.0, 0)
        nothing, still = np.zeros((0, 1)), np.ones(0, np.uint8)
        _cross(nothing, nothing, still, 0, 0, 0)
        _scale(nothing, still, True, 0, 0, 0)
        _pulse(nothing, still, self._pulse, 0, 0, self.rate)
        _look_in(np.zeros((1, 1, 1)), self.scoped, 0, 0)
        for rows in (1, 2):  # a program's memory of a signal is one whole array only where there is one row
            _copy(np.zeros((rows, 1)), np.zeros((rows, 2))[:, :1], 0)

    def _end_fade(self, frame: int) -> None:
        """The fade is over: let go of the program that was faded out, and fade in one that waits for that."""
        if self._fade == "out":
            self._exchange(self._next, frame)
            self._fade, self._fade_from = "in", frame
        else:
            self._fade = ""
        if self._old is not self.program:
            self.retired.append(self._old)
            self._old = self._next = self.program

    def _exchange(self, program: Program, frame: int) -> None:
        program.take_over(self.program, frame)
        self._old, self.program = self.program, program

    def _apply(self, command: Command | Program | InTurn | Prepared, frame: int) -> None:
        match command:
            case Prepared(correction, row, tuning):
                self.correction.change(row, tuning, frame)
                self.safety.rescale(row, correction.acceleration_per_unit, frame)
                command = correction
            case Program():
                self._exchange(command, frame)
                self._fade, self._fade_from = "old", frame
                return
            case InTurn(program):
                self._next, self._fade, self._fade_from = program, "out", frame
                return
            case Set(node, name, value):
                for program in {id(p): p for p in (self.program, self._next)}.values():
                    with suppress(KeyError, BadValue):  # it may be meant for a patch that is still being built
                        program.set(node, name, value, frame)
            case Strike(node, tile, strength):
                self.program.strike(node, tile, float(frame), strength)
            case Press(tile, x_m, y_m, force_n) if isinstance(self.source, SimulatedFloor):
                self.source.press(self.source.floor.index(tile), x_m, y_m, force_n)
            case Walk(on) if isinstance(self.source, SimulatedFloor):
                self.source.walk(on)
            case Tare():
                self.intake.tare()
            case Level(db):
                self.safety.level(10.0 ** (min(db, 0.0) / 20.0) if db > -120.0 else 0.0, frame)
            case Play(on):
                self.safety.open(on, frame)
            case Panic():
                self.safety.panic(frame)
            case Pulse(tile):
                self._pulse[self.source.floor.index(tile)] = frame
                self._pulse_end = frame + round(PULSE_S * self.rate) + 1
        self.done.append(Done(frame, command))


def output_channels(floor: Floor) -> list[int]:
    """The channel of each tile: its `output`, or its place in the floor."""
    return [tile.output if tile.output is not None else i for i, tile in enumerate(floor.tiles)]


@kernel
def _copy(source, target, n):
    for row in range(source.shape[0]):
        for i in range(n):
            target[row, i] = source[row, i]


@kernel
def _look_in(scope, rows, at, n):
    """The first scope's frames, [scope, row, frame], into `rows` [frame, row] from `at` on."""
    for i in range(n):
        for row in range(rows.shape[1]):
            rows[at + i, row] = scope[0, row, i]


@kernel
def _scale(output, still, rises, start, frame, n):
    """Fade the output in or out."""
    for row in range(output.shape[0]):
        still[row] = 0
        for i in range(n):
            share = min(max((frame + i - start) / FADE, 0.0), 1.0)
            output[row, i] *= share if rises else 1.0 - share


@kernel
def _cross(old, new, still, start, frame, n):
    """From the old program's output to the new one's, with gains that sum to 1, into the new one's."""
    for row in range(new.shape[0]):
        still[row] = 0
        for i in range(n):
            share = min(max((frame + i - start) / FADE, 0.0), 1.0)
            new[row, i] = old[row, i] + (new[row, i] - old[row, i]) * share


@kernel
def _pulse(output, still, since, frame, n, rate):
    for row in range(output.shape[0]):
        if since[row] < 0:
            continue
        still[row] = 0
        for i in range(n):
            now = (frame + i - since[row]) / rate
            if 0.0 <= now < PULSE_S:
                window = np.sin(np.pi * now / PULSE_S) ** 2
                output[row, i] += PULSE * window * np.sin(2.0 * np.pi * PULSE_HZ * now)
        if frame + n - since[row] > PULSE_S * rate:
            since[row] = -1
