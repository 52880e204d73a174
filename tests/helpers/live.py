"""A running session for tests, driven by polling, with its reports and output."""

from contextlib import contextmanager

import numpy as np
import pytest

from underfoot.engine import session
from underfoot.engine.reports import CommandApplied, Costs, SensorFaults, Started
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY

LONG_BLOCK = 1024
"""Frames per block of an engine that plays beside many tests: that takes a third of the time that 128 frames take."""


class Live:
    """A session with all its reports and output so far."""

    def __init__(self, session, until):
        self.session, self._until = session, until
        self.reports = []
        self.parts = []

    def poll(self):
        self.reports += self.session.poll()
        first, frames = self.session.vibration.read()
        if len(frames):
            self.parts.append((first, frames.copy()))

    def until(self, holds, what="", seconds=None):
        """Poll until `holds()` is true, and return its result."""

        def look():
            self.poll()
            return holds()

        try:
            return self._until(look, what, seconds)
        except AssertionError as error:
            said = [report for report in self.reports if not isinstance(report, Costs | SensorFaults)]
            raise AssertionError(f"{error}; reports: {said[-12:]}") from None

    def of(self, kind):
        return [report for report in self.reports if isinstance(report, kind)]

    def started(self, times=1):
        self.until(lambda: len(self.of(Started)) >= times, "the engine starts")
        return self.of(Started)[-1]

    def complete(self):
        """Start an engine that stands by and the compiler, as a session does after a while, and wait for them."""
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(session, "STANDBY_AFTER_S", 0.0)
            self.started()
            self.until(lambda: {"standby", "compiler"} <= set(self.session.pids), "all processes are started")

    def play(self, frames):
        """Wait until this many more frames are played."""
        now = self.session.health.frame
        self.until(lambda: self.end >= now + frames, f"{frames} frames are played")

    def done(self, kind, times=1):
        """Return the frame at which the newest command of a kind took effect, once reported."""

        def found():
            return [done.frame for done in self.of(CommandApplied) if isinstance(done.command, kind)]

        self.until(lambda: len(found()) >= times, f"{kind.__name__} takes effect")
        return found()[-1]

    @property
    def gaps(self):
        """Return pairs of frames between which nothing was played."""
        ends = [at + len(frames) for at, frames in self.parts]
        return [(end, at) for end, (at, _) in zip(ends, self.parts[1:], strict=False) if at > end]

    @property
    def end(self):
        """The frame after the last one played."""
        return self.parts[-1][0] + len(self.parts[-1][1]) if self.parts else 0

    def played(self, first, count):
        """Return played frames, [frame, tile]; NaN where there were none."""
        out = np.full((count, self.parts[0][1].shape[1]), np.nan, np.float32)
        for at, frames in self.parts:
            begin, end = max(at, first), min(at + len(frames), first + count)
            if begin < end:
                out[begin - first : end - first] = frames[begin - at : end - at]
        return out


@contextmanager
def live(patch, until, record=None, floor=None, folder=None, start=True, **target):
    """Yield a session that plays `patch`; ends everything that it started."""
    made = session.Session(Target(floor or default_floor(), **target), patch, REGISTRY, folder)
    try:
        if record is not None:
            made.record(record)
        if start:
            made.start()
        yield Live(made, until)
    finally:
        made.close()
