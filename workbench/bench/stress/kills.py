"""Processes killed at random moments during playback and recording: effects on output, files and remaining processes.

Frames are read from the ring that the sound card's callback fills, so times are those of the output. Processes are
found by their session number, so that none is missed.
"""

import os
import signal
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from underfoot.bench.stress.outcome import Effort, Outcome, Progress, spread
from underfoot.bench.stress.programs import CpuIdle, Program
from underfoot.bench.stress.valid_files import FLOOR, tone
from underfoot.engine.reports import Notice, Started
from underfoot.engine.session import MOST_DEATHS, WITHIN_S, Session
from underfoot.engine.shared_blocks import remove_orphans
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.nodes import REGISTRY
from underfoot.records.recording import Recording

BACK_S, SILENT_S, LOST_S = 1.0, 0.5, 0.1
"""Allowed time until recovery, duration of sound after a kill, and loss of a recording, in seconds."""
_RATE = 48_000
_START_S = 300.0
_LOUDER = 1.05
"""Allowed ratio to the previous level; the start of a tone overshoots by 3 % in the DC block."""
_APART_S = WITHIN_S / MOST_DEATHS + 0.5


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield results for engine, compiler and recorder; then for the program, its process group, and the window."""
    if not Path("/dev/shm").is_dir():
        yield Outcome("processes killed", 0, "not tried: this system has no /dev/shm to look into", passed=True)
        return
    rng = np.random.default_rng(effort.seed)
    with tempfile.TemporaryDirectory() as folder:
        for victim in ("engine", "compiler", "recorder"):
            yield _kill_processes(victim, effort.count(5), rng, Path(folder, f"{victim}.underfoot"), progress)
        for how, what in (("session", "program"), ("group", "program and all its processes"), ("window", "window")):
            yield _kill_programs(how, what, effort.count(5), rng, Path(folder), progress)


# --- a process of a session that is in this one ---


@dataclass
class _OutputMonitor:
    """Polls a session, and tracks the audible stretches of its output."""

    session: Session
    gaps_s: list[float] = field(default_factory=list)
    loudest: float = 0.0
    frames: int = 0
    end: int = 0  # the frame after the last one read
    started: int = 0
    notices: list[str] = field(default_factory=list)
    _sounded: int = -1  # the frame after the last one that was not silent

    def poll_until(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Poll for so long, or until something holds; whether it did."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            for report in self.session.poll():
                self.started += isinstance(report, Started)
                if isinstance(report, Notice):
                    self.notices.append(report.text)
            first, rows = self.session.vibration.read()
            self.frames, self.end = self.frames + len(rows), first + len(rows)
            moved = np.flatnonzero(np.abs(rows).max(axis=1, initial=0.0) > 1e-6)
            if len(moved):
                if self._sounded >= 0:
                    self.gaps_s.append((first + int(moved[0]) - self._sounded) / _RATE)
                self._sounded = first + int(moved[-1]) + 1
                self.loudest = max(self.loudest, float(np.abs(rows).max()))
            if until():
                return True
            time.sleep(0.004)
        return False

    def loudest_of_a_second(self) -> float:
        """Return the largest magnitude of the next second of output; 0 without output."""
        self.loudest, self.frames = 0.0, 0
        self.poll_until(_START_S, lambda: self.frames >= _RATE)
        return self.loudest


def _kill_processes(victim: str, times: int, rng: np.random.Generator, record: Path, progress: Progress) -> Outcome:
    """Kill one process of a session repeatedly, each time once a standby engine is ready."""
    session = Session(Target(FLOOR, block=128), tone(), REGISTRY)
    output, idle = _OutputMonitor(session), CpuIdle()
    away_s, wrong = [], []
    try:
        session.record(record)
        session.start()
        ready = {"engine", "standby", "compiler", "recorder"}
        if not output.poll_until(_START_S, lambda: bool(output.started) and ready <= set(session.pids)):
            return Outcome(victim, 0, "the session did not start", passed=False)
        before = output.loudest_of_a_second()
        for number in range(times):
            output.poll_until(_APART_S + float(rng.uniform(0.0, 2.0)))
            if not output.poll_until(_START_S, lambda: idle.of(session.pids.get("standby", 0))):
                return Outcome(victim, number, "no other engine was ready to take over", passed=False)
            before_kill = session.pids[victim], output.started, session.memory.vibration.kept
            output.gaps_s.clear()
            output.loudest = 0.0
            os.kill(before_kill[0], signal.SIGKILL)
            back = output.poll_until(_START_S, partial(_is_back, victim, output, before_kill))
            if not back:
                return Outcome(victim, number, f"it did not come back within {_START_S:.0f} s", passed=False)
            output.poll_until(_START_S, lambda: output.loudest > 0.0)
            output.frames = 0
            output.poll_until(_START_S, lambda: output.frames >= _RATE // 2)
            loudest = output.loudest
            after = output.loudest_of_a_second()
            away_s.append(max(output.gaps_s, default=np.inf))
            if session.patch != tone() or abs(after - before) > 0.02 * before or loudest > _LOUDER * before:
                wrong.append(f"another sound came back: {after:.4f}, at first {loudest:.4f}, after {before:.4f}")
            progress(f"stress: {victim} killed, {number + 1} of {times}, away for {away_s[-1]:.2f} s")
        session.stop_recording()
        written = output.end
    finally:
        session.close()
    with Recording(record) as recording:
        first, played = recording.vibration()
        holes_s = [gap.count / _RATE for gap in recording.gaps()]
    lost_s = max((written - first - len(played)) / _RATE, 0.0)
    found = f"sound away: {spread(away_s)}; recording opens, {lost_s:.3f} s short"
    if victim != "engine":
        lost_s = max(lost_s, *holes_s, 0.0)
        found += f", {len(holes_s)} holes"
    passed = not wrong and max(away_s) <= BACK_S and lost_s <= LOST_S
    return Outcome(f"{victim} killed while it plays", times, "; ".join([found, *sorted(set(wrong))]), passed)


def _is_back(victim: str, output: _OutputMonitor, before: tuple[int, int, int]) -> bool:
    """Return whether a new process has replaced the killed one and works."""
    pid, started, kept = before
    if output.session.pids.get(victim, pid) == pid:
        return False
    if victim == "engine":
        return output.started > started
    return victim != "recorder" or output.session.memory.vibration.kept > kept


# --- the whole program ---


def _kill_programs(
    how: str, what: str, times: int, rng: np.random.Generator, folder: Path, progress: Progress
) -> Outcome:
    """Kill a separate program at random moments after its first process has started."""
    played_on_s, lost_s, orphans, blocks, unread = [], [], 0, 0, []
    for number in range(times):
        record = folder / f"{how}-{number}.underfoot"
        program = Program.of_window(folder) if how == "window" else Program.of_session(record)
        try:
            plays = rng.random() < 0.7
            if plays and not program.plays(_START_S, None if how == "window" else record):
                return Outcome(f"{what} killed", number, f"it did not play: {program.said()}", passed=False)
            time.sleep(float(rng.uniform(0.0, 2.0)))
            tail = program.kill(group=how == "group")
            if plays:
                played_on_s.append(tail.played_on_s)
            left = program.left(40.0)
            orphans += len(left)
            if how == "group":
                remove_orphans()  # as the next start does
            blocks += len(program.blocks())
            if record.exists():
                try:
                    with Recording(record) as recording:
                        first, played = recording.vibration()
                    if plays:
                        lost_s.append(max(tail.written - first - len(played), 0) / _RATE)
                except UnderfootError as error:
                    unread.append(str(error))
        finally:
            program.end()
        progress(f"stress: {what} killed, {number + 1} of {times}")
    found = f"sound went on: {spread(played_on_s)}; {orphans} processes and {blocks} blocks of memory left"
    if how != "window":
        found += f"; recording loses {spread(lost_s, 3)}"
    passed = not orphans and not blocks and not unread
    passed = passed and max(played_on_s, default=0.0) <= SILENT_S and max(lost_s, default=0.0) <= LOST_S
    return Outcome(f"{what} killed", times, "; ".join([found, *unread]), passed)
