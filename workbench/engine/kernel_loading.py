"""The kernels that a session needs, in parts: loaded, and compiled where they are not in the cache yet.

Compiling all of them takes half a minute of one core. Two processes that begin at the two ends of the list share it: a
kernel that one of them is compiling, the other waits for (`kernel_cache`).
"""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

import numpy as np
from numba.core import event

from underfoot.clock import RATE_HZ, SPAN
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.block_runner import load_kernels
from underfoot.engine.commands import Play, ProgramSwap, TileEqualiser
from underfoot.engine.equaliser_bank import EqualiserBank
from underfoot.engine.intake import Intake
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.program_fade import ProgramFader
from underfoot.engine.reports import Compiling
from underfoot.engine.safety import Limits, Safety
from underfoot.engine.target import Target, source_of
from underfoot.engine.tile_pulse import TilePulse
from underfoot.floor import contacts
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

_MOMENT = 24 * 256
"""Frames that a loop plays so that each of its kernels is called: steps of the simulator's walker among them."""


class KernelParts:
    """The kernels of a patch, and of what brings the target's force, as a list of parts.

    `load` goes through all of them; with `from_end`, the last ones first.
    """

    def __init__(self, patch: Patch, target: Target, options: LoopOptions, from_end: bool = False) -> None:
        self.patch, self.target, self.options = patch, target, options
        types = sorted({node.type for node in patch.nodes})
        self._parts: list[Callable[[], object]] = [_program, *(REGISTRY[name].compile for name in types)]
        self._parts += [load_kernels, _output, self._source, self._intake, contacts.load_kernels]
        if from_end:
            self._parts.reverse()

    def load(self, tell: Callable[[Compiling], None]) -> None:
        """Load all, and say how many parts are ready as soon as one of them has to be compiled."""
        with _telling(tell, len(self._parts) + 1) as ready:
            for part in self._parts:
                part()
                ready()
            self._play()
            ready()

    def _source(self) -> None:
        """What brings the force: the simulator's walker, which every loop that nobody hears has, and the target's."""
        SimulatedFloor(default_floor(1, 2)).pull(_MOMENT)
        if self.target.kind in TRANSPORTS or self.target.simulation:
            source_of(self.target).pull(round(self.target.rate))

    def _intake(self) -> None:
        """From force samples to signals."""
        target = self.target
        intake = Intake(SimulatedFloor(default_floor(1, 2)), target.rate, self.options.block)
        for end in (_MOMENT, 3 * _MOMENT):  # while the tiles are tared, and after
            intake.take(end)
        intake.fill(0, self.options.block)

    def _play(self) -> None:
        """Everything once, on a loop that nobody hears: the program, a swap of it, and the way out."""
        loop = Loop(self.patch, REGISTRY, SimulatedFloor(self.target.floor, self.target.rate), self.options)
        loop.send(Play(True))
        loop.send(ProgramSwap(loop.build(self.patch, self.options.scopes)))
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
    """Some kernel has to be compiled."""


def _program() -> None:
    """The compiled loop that runs all nodes, and what fades from one program to the next."""
    ProgramFader(Program(Patch(), REGISTRY, ("tile",)))


def _output() -> None:
    """From what a tile is to do to full scale."""
    rate_hz, acceleration, zero_rows = float(RATE_HZ), np.zeros((1, SPAN)), np.zeros(1, np.uint8)
    TilePulse(1, rate_hz).apply(acceleration, zero_rows, 0, SPAN)
    EqualiserBank(1, {}).apply(acceleration, zero_rows, 0, SPAN)
    safety = Safety([Limits()], [0], rate_hz, SPAN, 2, sound_channel=1)
    safety.apply(acceleration, zero_rows, 0, 0, SPAN)
    TileEqualiser("").coefficients(rate_hz)


@contextmanager
def _telling(tell: Callable[[Compiling], None], total: int) -> Iterator[Callable[[], None]]:
    """While kernels are compiled, tell how many parts are ready; a call of what this gives counts one."""
    state = Compiling(0, total)
    compiles = False
    collects = gc.isenabled()

    class FirstCompile(event.Listener):
        def on_start(self, event: event.Event) -> None:
            nonlocal compiles
            if not compiles:
                compiles = True
                gc.disable()  # a fifth of the time that compiling takes
                tell(state)

        def on_end(self, event: event.Event) -> None:
            pass

    def ready() -> None:
        nonlocal state
        state = replace(state, ready=state.ready + 1)
        if compiles:
            tell(state)

    try:
        with event.install_listener("numba:compile", FirstCompile()):
            yield ready
    finally:
        if collects:
            gc.enable()
