"""A simulated participant of a study on the simulated floor, who steps and answers when asked to."""

from collections import deque
from contextlib import contextmanager

import pytest
from live import LONG_BLOCK
from made_studies import first_answers

from underfoot.engine.commands import PressTile
from underfoot.engine.reports import Costs, Started
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import BadValue
from underfoot.experiments.store import SessionFile
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.studies import floor_watch
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner

STEP_S = 0.35
"""Seconds for which a simulated foot stays on the tile, and off it."""
PATIENCE_S = 60.0
"""Seconds for which a busy machine may stall an engine."""


class Person:
    """Does what a runner waits for; `answers(page)` returns the answers."""

    def __init__(self, runner, until, answers=first_answers):
        self.runner, self._until, self._answers = runner, until, answers
        self.tile = runner.session.target.floor.tiles[0].id
        self.phases = []
        self.reports = deque(maxlen=12)

    def poll(self):
        reports = self.runner.session.poll()
        self.reports += [report for report in reports if not isinstance(report, Costs)]
        self.runner.poll(reports)
        if not self.phases or self.phases[-1] != self.runner.phase:
            self.phases.append(self.runner.phase)

    def until(self, holds, what=""):
        def look():
            self.poll()
            return holds()

        return self._until(look, what, seen=self._state)

    def _state(self):
        """Where the study and its session stand, for a wait that was in vain."""
        runner, session = self.runner, self.runner.session
        study = f"{runner.phase}, {runner.page.key}, {runner.messages}, patch since {runner.presenter.since_frame}"
        return f"{study}; {session.health}, {session.pids}; reports: {list(self.reports)}"

    def press(self, force_n, x_m=0.0, y_m=0.0):
        self.runner.session.send(PressTile(self.tile, x_m, y_m, force_n))

    def wait(self, seconds):
        """Wait for this much of the session's time."""
        end = self.runner.watch.now_s + seconds
        self.until(lambda: self.runner.watch.now_s >= end, "time goes by")

    def step(self, seconds=STEP_S):
        self.press(600.0)
        self.wait(seconds)
        self.press(0.0)

    def until_phase(self, *phases):
        return self.until(lambda: self.runner.phase in phases and self.runner.phase, f"phase {phases}")

    def answer_page(self):
        """Do what the present page wants, and go to the next."""
        runner = self.runner
        self.until_phase(Phase.PAGE, Phase.READY, Phase.ANSWERING, Phase.END, Phase.PAUSE)
        before = len(runner.study.entries)
        if runner.phase is Phase.PAUSE:
            self.until(lambda: len(runner.study.entries) > before, "the pause ends")
            return
        while runner.phase not in (Phase.PAGE, Phase.ANSWERING, Phase.END):
            self.until_phase(Phase.READY, Phase.ANSWERING)
            if runner.phase is Phase.READY:
                self.present()
        if runner.phase is not Phase.END:
            runner.answer(self._answers(runner.page))

    def present(self):
        """Begin the waiting presentation, in the way that it requires."""
        runner, interval = self.runner, self.runner.interval
        if runner.page.start == "key":
            runner.start()
        elif runner.page.start == "step":
            self.step()
        else:
            self.step()
            self.wait(0.6)
            self.step()
        gone = (Phase.ANSWERING, Phase.END)
        self.until(lambda: runner.phase in gone or runner.interval != interval, "the presentation ends")

    def finish_study(self):
        """Go through the study to its end."""
        while self.runner.phase is not Phase.END:
            self.answer_page()


@contextmanager
def open_session(until, target=None):
    """Yield a session on one simulated tile without a walker, or on another target, once it plays and can be edited."""
    target = target or Target(default_floor(1, 1), walker=False, block=LONG_BLOCK)
    session = Session(target, Patch(title="study"), REGISTRY)
    try:
        session.start()
        session.edit(session.patch, anew=True)  # starts the compiler
        until(lambda: any(isinstance(report, Started) for report in session.poll()), "it plays")
        yield session
    finally:
        session.close()


@contextmanager
def taking_part(session, protocol, path, until, equipment=None, silent_s=PATIENCE_S, folder=None):
    """Yield a participant with a runner of a new or existing session file.

    A study stops where no force comes for a second; here for `silent_s`, since a busy machine may stall the engine.
    """
    file = SessionFile.open(path) if path.exists() else SessionFile.create(path, protocol, "P1", folder)
    session.send(PressTile("t1", 0.0, 0.0, 0.0))
    try:
        runner = Runner(session, file, protocol, folder, equipment)
    except BadValue:
        file.close()
        raise
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(floor_watch, "SILENT_S", silent_s)
        try:
            yield Person(runner, until)
        finally:
            runner.close()
