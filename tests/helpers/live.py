"""A running session as tests drive it: by polling, and by what it reports and plays."""

from contextlib import contextmanager

import numpy as np

from underfoot.engine.reports import CommandApplied, Costs, Started
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY


class Live:
    """A session with all that it reported and played so far."""

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
        """Poll until `holds()`, and return what it gave."""

        def look():
            self.poll()
            return holds()

        try:
            return self._until(look, what, seconds)
        except AssertionError as error:
            said = [report for report in self.reports if not isinstance(report, Costs)]
            raise AssertionError(f"{error}; reports: {said[-12:]}") from None

    def of(self, kind):
        return [report for report in self.reports if isinstance(report, kind)]

    def started(self, times=1):
        self.until(lambda: len(self.of(Started)) >= times, "the engine starts")
        return self.of(Started)[-1]

    def complete(self):
        """Wait until every process of the session has been started, for one that several tests share."""
        self.started()
        self.until(lambda: {"standby", "compiler"} <= set(self.session.pids), "all processes are started")

    def play(self, frames):
        """Let it play for this many frames from now on."""
        now = self.session.health.frame
        self.until(lambda: self.end >= now + frames, f"{frames} frames are played")

    def done(self, kind, times=1):
        """The frame at which the newest command of a kind took effect, when that was reported."""

        def found():
            return [done.frame for done in self.of(CommandApplied) if isinstance(done.command, kind)]

        self.until(lambda: len(found()) >= times, f"{kind.__name__} takes effect")
        return found()[-1]

    @property
    def gaps(self):
        """Pairs of frames between which nothing was played."""
        ends = [at + len(frames) for at, frames in self.parts]
        return [(end, at) for end, (at, _) in zip(ends, self.parts[1:], strict=False) if at > end]

    @property
    def end(self):
        """The frame behind the last that was played."""
        return self.parts[-1][0] + len(self.parts[-1][1]) if self.parts else 0

    def played(self, first, count):
        """Frames that were played, [frame, tile]; NaN where there were none."""
        out = np.full((count, self.parts[0][1].shape[1]), np.nan, np.float32)
        for at, frames in self.parts:
            begin, end = max(at, first), min(at + len(frames), first + count)
            if begin < end:
                out[begin - first : end - first] = frames[begin - at : end - at]
        return out


@contextmanager
def live(patch, until, record=None, floor=None, folder=None, start=True, **target):
    """A session that plays `patch`; everything that it started is ended behind it."""
    session = Session(Target(floor or default_floor(), **target), patch, REGISTRY, folder)
    try:
        if record is not None:
            session.record(record)
        if start:
            session.start()
        yield Live(session, until)
    finally:
        session.close()
