"""Loading of the kernels and plates that a session needs, in parts; those missing from the cache are made.

Compiling all kernels takes half a minute of one core, a simulated plate half a second. Two processes that begin at
opposite ends of the list share the work: each waits for a kernel that the other is compiling (`kernel_cache`).
"""

import gc
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial

import numpy as np
from msgspec.structs import replace
from numba.core import event

from underfoot.clock import RATE_HZ, SPAN
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.block_runner import load_kernels
from underfoot.engine.commands import Play, Swap, TileEqualiser
from underfoot.engine.equaliser_bank import EqualiserBank
from underfoot.engine.intake import Intake
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.program_fade import ProgramFader
from underfoot.engine.reports import Compiling
from underfoot.engine.safety import Limits, Safety
from underfoot.engine.target import Target, source_of
from underfoot.engine.tile_pulse import TilePulse
from underfoot.floor import contacts
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.simulated_plates import SimulatedPlates, load_plate
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

_MOMENT = 24 * 256
"""Frames that a loop plays so that each of its kernels is called; long enough for steps of the simulator's walker."""


class KernelParts:
    """The kernels of a patch and of the target's force source, as a list of parts.

    `load` goes through all of them; with `from_end`, in reverse order.
    """

    def __init__(self, patch: Patch, target: Target, options: LoopOptions, *, from_end: bool = False) -> None:
        self.patch, self.target, self.options = patch, target, options
        types = sorted({node.type for node in patch.nodes})
        # A part returns True if it made something that is not reported to listeners of the compiler.
        self._parts: list[Callable[[], object]] = [_program, *(REGISTRY[name].compile for name in types)]
        self._parts += [load_kernels, _output, _walker, partial(_hardware, target), partial(_plates, options, target)]
        self._parts += [partial(_intake, target.rate, options.block), contacts.load_kernels]
        self._parts += [
            partial(load_plate, tile, options.simulation, float(options.rate_hz), heard)
            for heard in options.plates
            for tile in target.floor.tiles[1:]
        ]
        if from_end:
            self._parts.reverse()

    def load(self, progress: Callable[[Compiling], None]) -> None:
        """Load all parts; report how many are ready as soon as one has to be made."""
        listener, collects = _Progress(progress, len(self._parts) + 1), gc.isenabled()
        try:
            with event.install_listener("numba:compile", listener):
                for part in self._parts:
                    listener.ready(was_made=part() is True)
                self._play()
                listener.ready(was_made=False)
        finally:
            if collects:
                gc.enable()

    def _play(self) -> None:
        """Load the rest by running a loop without output: the program, a swap of it, and the output stages."""
        loop = Loop(self.patch, REGISTRY, SimulatedFloor(self.target.floor, self.target.rate), self.options)
        loop.send(Play(True))
        loop.send(Swap(self.patch.dumps(), self.options.scopes))
        loop.play(_MOMENT)


def load_common_kernels() -> None:
    """Load the kernels that do not depend on the patch, up to one that is not in the cache."""

    def give_up(_: Compiling) -> None:
        raise _NotInCache

    with suppress(_NotInCache):
        KernelParts(Patch(), Target(default_floor(1, 1)), LoopOptions(block=128, plates=("accelerometer",))).load(
            give_up
        )


class _NotInCache(Exception):
    """A kernel has to be compiled."""


def _program() -> None:
    """Load the compiled loop that runs all nodes, and the fades between programs."""
    ProgramFader(Program(Patch(), REGISTRY, ("tile",)))


def _output() -> None:
    """Load the output stages, from commanded acceleration to full scale."""
    rate_hz, acceleration, zero_rows = float(RATE_HZ), np.zeros((1, SPAN)), np.zeros(1, np.uint8)
    TilePulse(1, rate_hz).apply(acceleration, zero_rows, 0, SPAN)
    EqualiserBank(1, {}).apply(acceleration, zero_rows, 0, SPAN)
    safety = Safety([Limits()], [0], rate_hz, SPAN, 2, sound_channel=1)
    safety.apply(acceleration, zero_rows, 0, 0, SPAN)
    TileEqualiser("").coefficients(rate_hz)


def _walker() -> None:
    """Load the simulator's walker, which loops run for loading use."""
    SimulatedFloor(default_floor(1, 2)).pull(_MOMENT)


@lru_cache(maxsize=1)
def _hardware(target: Target) -> None:
    """Load the target's own source of force, once: it does not depend on the patch, and one of hardware refers to
    itself, so that each program that is compiled would leave megabytes to the collector, which counts objects.
    """
    if target.kind in TRANSPORTS or target.simulation:
        source_of(target).pull(round(target.rate))


def _plates(options: LoopOptions, target: Target) -> bool:
    """Load the first of the simulated plates, and what runs them; return whether it was computed."""
    tile, was_made = target.floor.tiles[0], False
    for heard in options.plates:
        was_made |= load_plate(tile, options.simulation, float(options.rate_hz), heard)
        SimulatedPlates(Floor((tile,)), options.simulation, [0], float(options.rate_hz), SPAN, heard)
    return was_made


def _intake(rate: int, block: int) -> None:
    """Load the conversion of force samples to signals."""
    intake = Intake(SimulatedFloor(default_floor(1, 2)), rate, block)
    for end in (_MOMENT, 3 * _MOMENT):  # while the tiles are tared, and after
        intake.take(end)
    intake.fill(0, block)


class _Progress(event.Listener):
    """Reports how many parts are ready once something is made: a kernel is compiled, or a part made what it loads."""

    def __init__(self, report: Callable[[Compiling], None], total: int) -> None:
        self._report, self._state = report, Compiling(0, total)
        self._makes = False

    def on_start(self, event: event.Event) -> None:
        """A kernel is being compiled."""
        if not self._makes:
            self._makes = True
            gc.disable()  # saves a fifth of the compile time
            self._report(self._state)

    def on_end(self, event: event.Event) -> None:
        """It was compiled."""

    def ready(self, *, was_made: bool) -> None:
        """Count a part."""
        self._state = replace(self._state, ready=self._state.ready + 1)
        self._makes = self._makes or was_made
        if self._makes:
            self._report(self._state)
