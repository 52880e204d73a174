"""Fades between programs without clicks: a crossfade with gains that sum to 1, or a fade out and a fade in."""

import time
from collections import deque
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import FADE
from underfoot.errors import BadValue
from underfoot.kernels import block_kernel
from underfoot.patch.program import Program


class ProgramFader:
    """The running program and, during a fade, the one before or after it.

    `current` is the program whose output is played, or the newer one of two. Replaced programs are in `retired`, whose
    memory another thread releases. `spent_s` is the time spent in current programs.
    """

    def __init__(self, program: Program) -> None:
        self.current = program
        self.retired: deque[Program] = deque(maxlen=8)
        self.spent_s = 0.0
        self._fade, self._from_frame = "", 0  # "cross", or "out" and then "in"
        self._settle_frames = 0  # of the waiting program
        self._old = self._next = program  # faded out beside the current one, or waiting to be faded in
        _load_kernels()

    @property
    def free_from(self) -> int:
        """First frame at which the next fade can begin: one fade at a time."""
        return self._from_frame + FADE if self._fade else 0

    def crossfade(self, program: Program, frame: int, settle_frames: int = 0) -> None:
        """Crossfade to a program from `frame` on; both run during the fade.

        A program with nodes that have not run yet runs for `settle_frames` first.
        """
        is_settled = self._exchange(program, frame)
        self._fade, self._from_frame = "cross", frame if is_settled else frame + settle_frames

    def fade_through_silence(self, program: Program, frame: int, settle_frames: int) -> None:
        """Fade the current program out from `frame` on, then a program in: for cases in which both cost too much."""
        self._next, self._fade, self._from_frame = program, "out", frame
        self._settle_frames = settle_frames

    def set(self, node: str, name: str, value: float, frame: int) -> None:
        """Ramp a number of a node to a value, in the current program and in one that waits.

        Unknown nodes and numbers are ignored: they may belong to a patch that is still being built.
        """
        for program in {id(p): p for p in (self.current, self._next)}.values():
            with suppress(KeyError, BadValue):
                program.set(node, name, value, frame)

    def update(self, frame: int) -> None:
        """End a fade that is over at `frame`: release the old program, or fade in the waiting one."""
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

    @property
    def read_centroid(self) -> bool:
        """Whether a running program reads centroids. Allocates nothing."""
        return self.current.reads_centroid or self._old.reads_centroid

    def stretch(self, stop: int) -> int:
        """Return the frame up to which nothing changes, at most `stop`."""
        return min(stop, self._from_frame + FADE) if self._fade else stop

    def run(self, frame: int, n: int) -> Program:
        """Run `n` frames; return the program whose output is played."""
        program, old = self.current, self._old
        began = time.perf_counter()
        program.run(frame, n)
        self.spent_s += time.perf_counter() - began
        if self._fade == "cross":
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
        """Make a program current; return whether all its nodes continue with their states."""
        all_stayed = program.take_over(self.current, frame)
        self._old, self.current = self.current, program
        return all_stayed


def _load_kernels() -> None:
    """Load the kernels of fades, so that they do not delay the first one."""
    nothing, zero_rows = np.zeros((0, 1)), np.ones(0, np.uint8)
    _crossfade(nothing, nothing, zero_rows, 0, 0, 0)
    _ramp(nothing, zero_rows, True, 0, 0, 0)


@block_kernel
def _ramp(
    output: NDArray[np.float64], zero_rows: NDArray[np.uint8], rises: bool, from_frame: int, frame: int, n: int
) -> None:
    """Fade the output in or out."""
    for row in range(output.shape[0]):
        zero_rows[row] = 0
        for i in range(n):
            share = min(max((frame + i - from_frame) / FADE, 0.0), 1.0)
            output[row, i] *= share if rises else 1.0 - share


@block_kernel
def _crossfade(
    old: NDArray[np.float64],
    new: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    from_frame: int,
    frame: int,
    n: int,
) -> None:
    """Crossfade the outputs with gains that sum to 1, into the new program's."""
    for row in range(new.shape[0]):
        zero_rows[row] = 0
        for i in range(n):
            share = min(max((frame + i - from_frame) / FADE, 0.0), 1.0)
            new[row, i] = old[row, i] + (new[row, i] - old[row, i]) * share
