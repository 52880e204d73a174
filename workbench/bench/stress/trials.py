"""A study of many trials on a simulated tile: times from step to vibration, and from answer to disk."""

import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.engine.commands import PressTile
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.experiments.protocol import MethodUse, Protocol, Stage
from underfoot.experiments.stimuli import Stimulus
from underfoot.experiments.store import SessionFile
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.studies.phase import Phase
from underfoot.studies.runner import Runner

LATEST_ONSET_S, LATEST_ON_DISK_S = 0.001, 0.5
_STEP_S, _FOOT_N = 0.12, 600.0
_POLL_S, _WAITED_S, _TOLD_S = 0.004, 120.0, 60.0
_MOST_BLOCKS = 1000
_CONSTANT = Stimulus(patch="stimulus-wc", scaled_by="gain.gain", measured_m_s2=20.4, level_m_s2=2.0)


@dataclass
class _Times:
    """Times of each trial in seconds: from a step's first force to the first vibration frame, and of storing the answer
    on disk.
    """

    onset_s: list[float] = field(default_factory=list)
    on_disk_s: list[float] = field(default_factory=list)


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield a line for onsets, and one for answers."""
    wanted = min(effort.count(30), _MOST_BLOCKS)
    times = _Times()
    with tempfile.TemporaryDirectory() as folder:
        kept = _study(Path(folder) / "p1.session", wanted, times, progress)
    onset_s, on_disk_s = np.array(times.onset_s), np.array(times.on_disk_s)
    latest_s = float(np.nanmax(onset_s, initial=0.0))
    missing = int(np.isnan(onset_s).sum())
    found = f"{_spread(onset_s)}; without: {missing}"
    yield Outcome("step to first vibration frame", len(onset_s), found, not missing and latest_s <= LATEST_ONSET_S)
    good = kept == wanted and float(on_disk_s.max(initial=0.0)) <= LATEST_ON_DISK_S
    yield Outcome("answer to disk", len(on_disk_s), f"{_spread(on_disk_s)}; kept: {kept} of {wanted}", good)


def _spread(values_s: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> str:
    """Return median, 95th and 99th percentile and maximum as text."""
    there = values_s[np.isfinite(values_s)]
    if not len(there):
        return "never"
    middle, most, nearly_all = 1e3 * np.quantile(there, (0.5, 0.95, 0.99))
    return f"median {middle:.3g} ms, 95 % {most:.3g}, 99 % {nearly_all:.3g}, largest {1e3 * there.max():.3g} ms"


def _study(path: Path, trials: int, times: _Times, progress: Progress) -> int:
    """Answer all trials; return the number of trials in the file."""
    stage = Stage(id="main", kind="trials", start="step", method=MethodUse("rating", {"blocks": trials}))
    protocol = Protocol(stimuli={"WC": _CONSTANT}, stages=(stage,)).check(path.parent)
    session = Session(Target(default_floor(1, 1), walker=False), Patch(title="study"), REGISTRY)
    try:
        file = SessionFile.create(path, protocol, "P1")
        session.start()
        runner = Runner(session, file, protocol)
        told = time.perf_counter()
        try:
            while runner.phase is not Phase.END:
                _one_trial(runner, times)
                if time.perf_counter() > told + _TOLD_S:
                    told = time.perf_counter()
                    progress(f"stress: {len(times.onset_s)} of {trials} trials")
            return len(file.entries())
        finally:
            runner.close()
    finally:
        session.close()


def _one_trial(runner: Runner, times: _Times) -> None:
    """Step on the tile when the runner waits for it, leave, and answer."""
    _until(runner, lambda: runner.phase is Phase.READY)
    tile = runner.session.target.floor.tiles[0].id
    runner.session.send(PressTile(tile, 0.0, 0.0, _FOOT_N))
    off_s = runner.watch.now_s + _STEP_S
    _until(runner, lambda: runner.watch.now_s >= off_s)
    runner.session.send(PressTile(tile, 0.0, 0.0, 0.0))
    _until(runner, lambda: runner.phase is Phase.ANSWERING)
    ask = runner.page.questions[0]
    began = time.perf_counter()
    runner.answer({ask.name: ask.default})
    times.on_disk_s.append(time.perf_counter() - began)
    times.onset_s.append(float(runner.study.entries[-1].facts.get("onset_after_step_s", np.nan)))


def _until(runner: Runner, holds: Callable[[], bool]) -> None:
    end = time.perf_counter() + _WAITED_S
    while not holds():
        runner.poll(runner.session.poll())
        if time.perf_counter() > end:
            raise UnderfootError(f"the study stands in {runner.phase} at {runner.page.key}: {runner.hint}")
        time.sleep(_POLL_S)
