"""A whole floor on one machine in full use: 36 tiles over UDP, output on two cards, tracking, playback and recording.

A separate process has the window, off-screen, on Monitor. Another process simulates four people and sends the data of
36 tiles. The sound cards are null sinks of 18 channels. Without PulseAudio, a timer drives the engine.
"""

import itertools
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from underfoot.bench.stress.null_sinks import is_possible, null_sinks
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports import TRANSPORTS
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.tile_parameters import TileParameters, simulation
from underfoot.patch import preset_files
from underfoot.records.recording import Recording

PEOPLE, PATCH, CARDS = "people=4", "material-gravel-coarse", {"left": 18, "right": 18}
USUAL_S = 600.0
FAIR_TICK_MS, MOST_LOST, MORE_MB = 50.0, 1e-3, 100.0
"""Limits: the 99th percentile of the interval between the window's ticks; the share of lost force samples; and the
growth of memory in the second half, during which the Monitor fills its ten-minute history.
"""
_START_S, _SETTLED = 300.0, 10
_PORT = 9871


@dataclass
class Watched:
    """The window's reports, one line per second, and memory and processor time of all processes."""

    lines: list[dict[str, Any]] = field(default_factory=list)
    memory_mb: list[float] = field(default_factory=list)
    cpu_s: list[dict[str, float]] = field(default_factory=list)
    busy_s: list[float] = field(default_factory=list)
    at_s: list[float] = field(default_factory=list)

    def add(self, line: dict[str, Any], pids: dict[str, int]) -> None:
        self.lines.append(line)
        self.at_s.append(time.perf_counter())
        self.memory_mb.append(sum(map(_own_mb, pids.values())))
        self.cpu_s.append({name: _cpu_s(pid) for name, pid in pids.items()})
        self.busy_s.append(_busy_s())


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield results of ten minutes, or `seconds`."""
    seconds = effort.length_s(USUAL_S)
    with tempfile.TemporaryDirectory() as made, ExitStack() as stack:
        folder, sinks = Path(made), dict[str, str]()
        if is_possible():
            _, sinks = stack.enter_context(null_sinks(folder, CARDS))
        _write(folder)
        sender = stack.enter_context(_program(folder, {}, "send", str(folder), _PORT))
        stack.callback(sender.terminate)
        sound = "; ".join(f"{name}={count}" for name, count in CARDS.items()) if sinks else None
        tiles = str(folder / "tiles.json")
        window = stack.enter_context(
            _program(folder, sinks, "run", str(folder), "udp", f"127.0.0.1:{_PORT}", sound, tiles)
        )
        stack.callback(window.terminate)
        watched = _watch(window, sender.pid, seconds, progress)
        window.terminate()
        window.wait(60.0)
        yield from judged(watched, bool(sinks))


def send(folder: str, port: int) -> None:
    """Simulate four people and send their tiles' data until the process is ended; the main function of the sender."""
    floor = Floor.load(Path(folder) / "floor.json")
    source = SimulatedFloor(floor, 48_000, people=simulation(PEOPLE)[1])
    emulator = Emulator(TRANSPORTS["udp"].sender.of(f"127.0.0.1:{port}"), source)
    emulator.start()
    while not emulator.is_finished:
        time.sleep(0.5)


def _write(folder: Path) -> None:
    default_floor(6, 6).save(folder / "floor.json")
    TileParameters().save(folder / "tiles.json")
    (folder / "patch.json").write_bytes(preset_files.patches()[PATCH].read_bytes())


def _program(folder: Path, more: dict[str, str], name: str, *given: object) -> "subprocess.Popen[str]":
    module = "underfoot.bench.stress.whole_floor" if name == "send" else "underfoot.widgets.under_load"
    homes = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"), str(folder))
    environment = {**os.environ, **homes, "QT_QPA_PLATFORM": "offscreen", **more}
    code = f"from {module} import {name}; {name}(*{given!r})"
    with (folder / f"{name}.txt").open("wb") as errors:
        return subprocess.Popen(
            [sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, stderr=errors, text=True
        )


def _watch(window: "subprocess.Popen[str]", sender: int, seconds: float, progress: Progress) -> Watched:
    """Read the window's reports until the engine has played for `seconds`."""
    found = Watched()
    assert window.stdout is not None
    hangs = threading.Timer(_START_S + 10.0 * seconds, window.kill)
    hangs.daemon = True
    hangs.start()
    for text in window.stdout:
        line = json.loads(text)
        found.add(line, {"window": window.pid, "tiles": sender, **line["pids"]})
        played_s = line["frame"] / 48_000.0
        if len(found.lines) % 30 == 1:
            progress(f"stress: {played_s:.0f} s played, load {line['load']:.2f}, {found.memory_mb[-1]:.0f} MB")
        if played_s > seconds:
            break
    hangs.cancel()
    return found


def judged(watched: Watched, has_cards: bool) -> Iterator[Outcome]:
    """Yield what the window's reports say, and whether that is within the limits."""
    lines = watched.lines
    if len(lines) <= _SETTLED + 1:
        yield Outcome("the whole floor", len(lines), "the window did not play", passed=False)
        return
    played = lines[_SETTLED:]
    seconds = round((played[-1]["frame"] - played[0]["frame"]) / 48_000.0)
    load = np.array([line["load"] for line in played])
    found = f"load {load.mean():.2f} in the mean, {load.max():.2f} at most of half a second"
    xruns = played[-1]["xruns"] - played[0]["xruns"]
    where = "two cards of 18 channels" if has_cards else "no cards: PulseAudio is missing"
    found += f"; {xruns} blocks late{_lateness(watched)}; {where}"
    yield Outcome("the engine: 36 tiles, coarse gravel, plates", seconds, found, not xruns)
    held, stream = (1e3 * np.median([line[name] for line in played]) for name in ("latency_s", "stream_latency_s"))
    offset = 1e3 * max(abs(line["cards_offset_s"]) for line in played)
    found = f"{held:.1f} ms and {stream:.1f} ms of the stream; the second card at most {offset:.2f} ms off"
    yield Outcome("latency, of force to sound", seconds, found, passed=True)
    lost, sent = played[-1]["lost"] - played[0]["lost"], 36 * 1000 * seconds
    yield Outcome("force samples over UDP", sent, f"{lost} lost", lost <= MOST_LOST * sent)
    ticks = np.concatenate([line["ticks_ms"] for line in played])
    half, most = np.percentile(ticks, (50, 99))
    found = f"apart {half:.1f} ms in the median, {most:.1f} for 99 of 100, {ticks.max():.0f} at most"
    yield Outcome("the window's ticks", len(ticks), found, bool(most <= FAIR_TICK_MS))
    yield _remembered(watched)
    yield _recorded(Path(lines[-1]["recording"]), lines[-1]["frame"])


def _lateness(watched: Watched) -> str:
    """Return, as text, the five seconds of output with the latest blocks, and the busiest process in each."""
    counts = [line["xruns"] for line in watched.lines]
    late = [(after - before, at) for at, (before, after) in enumerate(itertools.pairwise(counts), 1)]
    told = []
    for count, at in sorted(((count, at) for count, at in late if count and at > _SETTLED), reverse=True)[:5]:
        before, now = watched.cpu_s[at - 1], watched.cpu_s[at]
        used_s = {name: cpu_s - before.get(name, 0.0) for name, cpu_s in now.items()}
        most = max(used_s, key=lambda name: used_s[name])
        share = 100.0 * used_s[most] / max(watched.at_s[at] - watched.at_s[at - 1], 1e-3)
        told.append(f"{count} at {watched.lines[at]['frame'] / 48_000.0:.0f} s ({most} {share:.0f} %)")
    return f": {', '.join(told)}" if told else ""


def _remembered(watched: Watched) -> Outcome:
    memory_mb = watched.memory_mb[_SETTLED:]
    grown, later = memory_mb[-1] - memory_mb[0], memory_mb[-1] - memory_mb[len(memory_mb) // 2]
    begin, end = watched.cpu_s[_SETTLED], watched.cpu_s[-1]
    used_s = {name: cpu_s - begin.get(name, cpu_s) for name, cpu_s in end.items()}
    played_s = (watched.lines[-1]["frame"] - watched.lines[_SETTLED]["frame"]) / 48_000.0
    passed_s = watched.at_s[-1] - watched.at_s[_SETTLED]
    # Per second of output, because an overloaded machine plays less.
    shares = ", ".join(f"{name} {100.0 * one / max(played_s, 1.0):.0f} %" for name, one in used_s.items())
    found = f"{memory_mb[-1]:.0f} MB, {grown:+.0f} MB, of which {later:+.0f} in the second half; "
    found += f"a core's time for what was played: {shares}"
    others_s = watched.busy_s[-1] - watched.busy_s[_SETTLED] - sum(used_s.values())
    found += f"; other programs had {max(others_s, 0.0) / max(passed_s, 1.0):.1f} of {os.cpu_count()} cores"
    return Outcome("memory and cores of all processes", len(used_s), found, later <= MORE_MB)


def _recorded(path: Path, frames: int) -> Outcome:
    with Recording(path) as recording:
        (first, end), gaps = recording.span, recording.gaps()
    size_mb = path.stat().st_size / 1e6
    found = f"{(end - first) / 48_000.0:.1f} s of {frames / 48_000.0:.1f}, {len(gaps)} holes, {size_mb:.0f} MB"
    return Outcome("the recording", end - first, found, not gaps)


def _own_mb(pid: int) -> float:
    """Return a process's memory in MB, with shared memory divided among its users."""
    try:
        text = Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024.0 for line in text.splitlines() if line.startswith("Pss:")), 0.0)


def _cpu_s(pid: int) -> float:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _busy_s() -> float:
    """Return the busy time of all cores since boot, in seconds; 0 if the system does not report it."""
    try:
        first = Path("/proc/stat").read_text().split("\n", 1)[0].split()
    except OSError:
        return 0.0
    user, nice, system = map(int, first[1:4])
    return (user + nice + system) / os.sysconf("SC_CLK_TCK")
