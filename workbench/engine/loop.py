"""Force in, vibration out: what the live engine and the offline renderer both run, block after block."""

import time
from collections import deque
from pathlib import Path

import numpy as np

from workbench.clock import FADE, RATE_HZ, next_span
from workbench.devices.device import ForceSource
from workbench.devices.simulated import SimulatedFloor
from workbench.engine.intake import Intake
from workbench.engine.messages import Command, Done, Level, Play, Press, Pulse, Set, Strike, Tare, Walk
from workbench.engine.safety import Limits, Safety
from workbench.floor.layout import Floor
from workbench.kernels import kernel
from workbench.patch.node import Registry
from workbench.patch.patch import Patch
from workbench.patch.program import HOSTS, Program

PULSE_HZ, PULSE_S, PULSE = 60.0, 0.25, 8.0
"""The burst that tells which tile is which: frequency, length, and height in m/s^2."""


class Loop:
    """Runs `patch` on the force of `source`, in blocks of up to `block` frames, from session frame `frame` on.

    After `run(n)`, `out` holds n frames, float32 [frame, channel], full scale at most 1. Commands act on the next span
    edge, wherever in a block that is, and are told in `done` with their frame. `spent_s` is the time inside programs.
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
        channels: list[int] | None = None,
        scopes: tuple[str, ...] = (),
        folder: Path | None = None,
        seed: int | None = None,
        frame: int = 0,
    ) -> None:
        self.registry, self.source, self.rate, self.block = registry, source, rate, block
        self.frame = frame
        self._folder, self._seed = folder, seed
        floor = source.floor
        self.channels = output_channels(floor) if channels is None else channels
        self.intake = Intake(source, rate)
        self.program = self.build(patch, scopes)
        self.safety = Safety(
            limits or [Limits()] * len(floor.tiles), self.channels, rate, block, max(self.channels, default=0) + 1
        )
        self.out = self.safety.out
        self.done: deque[Done] = deque(maxlen=4096)
        self._commands: deque[tuple[int, Command | Program]] = deque()
        self._old: Program | None = None
        self._fade_from = 0
        self._pulse = np.full(len(floor.tiles), -1, np.int64)
        self.spent_s = 0.0
        self._spare = np.zeros((len(HOSTS), len(floor.tiles), block))

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

    def send(self, command: Command | Program, frame: int | None = None) -> None:
        """Let a command, or a program that was built, take effect at the first span edge from `frame` (now) on.

        Commands take effect in the order in which they were sent.
        """
        self._commands.append((next_span(self.frame if frame is None else frame), command))

    def run(self, n: int) -> None:
        """Run the next `n` frames, at most `block`. Between commands it allocates nothing."""
        end = self.frame + n
        self.intake.take(end)
        at = 0
        while at < n:
            stop = n
            while self._commands:
                due, command = self._commands[0]
                if self._old is not None and isinstance(command, Program):
                    due = max(due, self._fade_from + FADE)  # one fade after the other
                if due <= self.frame + at:
                    edge = next_span(self.frame + at)
                    if edge == self.frame + at:
                        self._commands.popleft()
                        self._apply(command, edge)
                        continue
                    due = edge
                stop = min(stop, due - self.frame)
                break
            if self._old is not None:
                left = self._fade_from + FADE - (self.frame + at)
                if left <= 0:
                    self._old = None
                else:
                    stop = min(stop, at + left)
            self._part(self.frame + at, at, stop - at)
            at = stop
        self.frame = end

    def _part(self, frame: int, at: int, n: int) -> None:
        program, spare = self.program, self._spare
        hosts = program.hosts
        force = hosts.get("force_n", spare[0])
        x, y = hosts.get("x_m", spare[1]), hosts.get("y_m", spare[2])
        self.intake.fill(force, x, y, frame, n)
        began = time.perf_counter()
        program.run(frame, n)
        self.spent_s += time.perf_counter() - began
        if self._old is not None:
            old = self._old
            for name, signal in zip(HOSTS, (force, x, y), strict=True):
                if name in old.hosts:
                    _copy(signal, old.hosts[name], n)
            old.run(frame, n)
            _fade(old.output, program.output, program.tables.still, self._fade_from, frame, n)
        if self._pulse.max() >= 0:
            _pulse(program.output, program.tables.still, self._pulse, frame, n, self.rate)
        self.safety.apply(program.output, program.tables.still, frame, at, n)

    def _apply(self, command: Command | Program, frame: int) -> None:
        if isinstance(command, Program):
            command.take_over(self.program, frame)
            self._old, self._fade_from, self.program = self.program, frame, command
            return
        match command:
            case Set(node, name, value):
                self.program.set(node, name, value, frame)
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
            case Pulse(tile):
                self._pulse[self.source.floor.index(tile)] = frame
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
def _fade(old, new, still, start, frame, n):
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
