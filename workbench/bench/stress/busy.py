"""Three busy processes beside a session that plays on a null sink, on as few cores as there are."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from underfoot.bench.stress.null_sinks import is_possible, playing_on_null_sinks
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.clock import RATE_HZ
from underfoot.engine.commands import Level, Play
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording

USUAL_S, PROCESSES = 60.0, 3
_SETTLE_S, _TICK_S, _WAIT_S, _PATIENCE = 3.0, 0.02, 120.0, 3.0


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield the late blocks of a minute, or `seconds`, without busy processes, and of one with three."""
    if not is_possible():
        progress("stress: busy needs PulseAudio")
        return
    seconds = effort.length_s(USUAL_S)
    for count in (0, PROCESSES):
        progress(f"stress: {seconds:.0f} s with {count} busy processes")
        yield _outcome(count, seconds)


def _outcome(count: int, seconds: float) -> Outcome:
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "session.underfoot"
        with playing_on_null_sinks(Path(made), {"busy": 4}):
            late, played_s = _played(path, count, seconds)
        with Recording(path) as recording:
            gaps = recording.gaps()
    cores = os.cpu_count()
    found = f"{late} late blocks in {played_s:.0f} s on {cores} cores, {len(gaps)} gaps in the recording"
    return Outcome(f"{count} busy processes beside it", 1, found, played_s >= seconds and not gaps)


def _played(path: Path, count: int, seconds: float) -> tuple[int, float]:
    """Return the number of late blocks while `count` processes are busy, and how much was played meanwhile."""
    session = Session(
        Target(default_floor(), sound="", latency_s=0.04),
        Patch.load(preset_files.patches()["gravel"], REGISTRY),
        REGISTRY,
    )
    try:
        session.record(path)
        session.start()
        for command in (Level(0.0), Play(True)):
            session.send(command)
        _until(session, round(_SETTLE_S * RATE_HZ), _WAIT_S)
        with _busy(count):
            late, frame = session.health.xruns, session.health.frame
            _until(session, frame + round(seconds * RATE_HZ), _PATIENCE * seconds)
            found = session.health.xruns - late, (session.health.frame - frame) / RATE_HZ
        session.stop_recording()
    finally:
        session.close()
    return found


def _until(session: Session, frame: int, within_s: float) -> None:
    """Wait until a frame was played, at most for so long."""
    end = time.perf_counter() + within_s
    while session.health.frame < frame and time.perf_counter() < end:
        session.poll()
        time.sleep(_TICK_S)


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """Keep so many processes computing meanwhile."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()
