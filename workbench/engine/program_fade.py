"""From one program to the next without a click: both at once with gains that sum to 1, or one after the other."""

import time
from collections import deque
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import FADE
from underfoot.errors import BadValue
from underfoot.kernels import kernel
from underfoot.patch.program import Program


class ProgramFader:
    """The program that plays, and for the length of a fade the one before or after it.

    `current` is the program whose output is heard, or the newer one of two. Programs that were replaced lie in
    `retired`, so that someone else can let go of their memory. `spent_s` is the time inside current programs.
    """

    def __init__(self, program: Program) -> None:
        self.current = program
        self.retired: deque[Program] = deque(maxlen=8)
        self.spent_s = 0.0
        self._fade, self._from_frame = "", 0  # "cross", or "out" and then "in"
        self._settle_frames = 0  # of the one that waits
        self._old = self._next = program  # what is faded out beside the current one, or waits to be faded in
        _load_kernels()

    @property
    def free_from(self) -> int:
        """The first frame at which another program may be faded to: one fade after the other."""
        return self._from_frame + FADE if self._fade else 0

    def crossfade(self, program: Program, frame: int, settle_frames: int = 0) -> None:
        """Fade over to a program from `frame` on; both run meanwhile.

        One that has nodes which did not run yet runs for `settle_frames` before.
        """
        is_settled = self._exchange(program, frame)
        self._fade, self._from_frame = "cross", frame if is_settled else frame + settle_frames

    def fade_through_silence(self, program: Program, frame: int, settle_frames: int = 0) -> None:
        """Fade the current program out from `frame` on, and then a program in, where both at once cost too much."""
        self._next, self._fade, self._from_frame = program, "out", frame
        self._settle_frames = settle_frames

    def set(self, node: str, name: str, value: float, frame: int) -> None:
        """Let a number of a node go to a value, in the current program and in one that waits.

        One that neither has is passed over: it may be meant for a patch that is still being built.
        """
        for program in {id(p): p for p in (self.current, self._next)}.values():
            with suppress(KeyError, BadValue):
                program.set(node, name, value, frame)

    def update(self, frame: int) -> None:
        """End a fade that is over at `frame`: let go of the old program, and fade in the one that waits."""
        if not self._fade or frame < self._from_frame + FADE:
            return
        if self._fade == "out":
            is_settled = self._exchange(self._next, frame)
            self._fade, self._from_frame = "in", frame if is_settled else frame + self._settle_frames
        else:
            self._fade = ""
        if self._old is not self.current:
            self.retired.append(self._old)
            self._old = self._next = self.current

    def stretch(self, stop: int) -> int:
        """The frame up to which all goes on as it is, at most `stop`."""
        return min(stop, self._from_frame + FADE) if self._fade else stop

    def run(self, signals: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, n: int) -> Program:
        """Run `n` frames on signals as `Program.bring` takes them; returns the program whose output is heard."""
        program, old = self.current, self._old
        program.bring(signals, zero_rows, n)
        began = time.perf_counter()
        program.run(frame, n)
        self.spent_s += time.perf_counter() - began
        if self._fade == "cross":
            old.bring(signals, zero_rows, n)
            old.run(frame, n)
            _crossfade(old.output, program.output, program.tables.silent, self._from_frame, frame, n)
            if old.has_sound or program.has_sound:
                _crossfade(old.sound, program.sound, program.tables.no_sound, self._from_frame, frame, n)
        elif self._fade:
            _ramp(program.output, program.tables.silent, self._fade == "in", self._from_frame, frame, n)
            if program.has_sound:
                _ramp(program.sound, program.tables.no_sound, self._fade == "in", self._from_frame, frame, n)
        return program

    def _exchange(self, program: Program, frame: int) -> bool:
        """Whether all nodes go on from where they were."""
        all_stayed = program.take_over(self.current, frame)
        self._old, self.current = self.current, program
        return all_stayed


def _load_kernels() -> None:
    """Load what is not called before the first fade, so that none is late for it."""
    nothing, zero_rows = np.zeros((0, 1)), np.ones(0, np.uint8)
    _crossfade(nothing, nothing, zero_rows, 0, 0, 0)
    _ramp(nothing, zero_rows, True, 0, 0, 0)


@kernel
def _ramp(
    output: NDArray[np.float64], zero_rows: NDArray[np.uint8], rises: bool, from_frame: int, frame: int, n: int
) -> None:
    """Fade the output in or out."""
    for row in range(output.shape[0]):
        zero_rows[row] = 0
        for i in range(n):
            share = min(max((frame + i - from_frame) / FADE, 0.0), 1.0)
            output[row, i] *= share if rises else 1.0 - share


@kernel
def _crossfade(
    old: NDArray[np.float64],
    new: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    from_frame: int,
    frame: int,
    n: int,
) -> None:
    """From the old program's output to the new one's, with gains that sum to 1, into the new one's."""
    for row in range(new.shape[0]):
        zero_rows[row] = 0
        for i in range(n):
            share = min(max((frame + i - from_frame) / FADE, 0.0), 1.0)
            new[row, i] = old[row, i] + (new[row, i] - old[row, i]) * share
