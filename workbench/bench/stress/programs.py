"""Whole programs in separate process sessions, to be killed, and their output as seen in shared memory."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from underfoot.bench.stress.valid_files import FLOOR, tone
from underfoot.engine.rings import HEADER
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.nodes import REGISTRY

BLOCKS = Path("/dev/shm")
_HEADER_BYTES = 64
_RATE = 48_000
_STILL_S = 1.0
"""A ring that was not written to for so long is not written to any more."""


@dataclass(frozen=True)
class OutputAfterKill:
    """The total number of frames written, and the duration of sound after a kill."""

    written: int
    played_on_s: float


class Program:
    """A program in a separate process and process session."""

    def __init__(self, command: list[str], folder: Path, tiles: int) -> None:
        self._errors = (folder / "errors.txt").open("w+b")
        homes = dict.fromkeys(("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME"), str(folder))
        here = {**os.environ, **homes, "QT_QPA_PLATFORM": "offscreen"}
        here.setdefault("UNDERFOOT_CACHE", str(_cache()))
        self._process = subprocess.Popen(
            command, env=here, stdout=subprocess.DEVNULL, stderr=self._errors, start_new_session=True
        )
        self._tiles = tiles
        self._rings: list[np.memmap] = []

    @staticmethod
    def of_session(record: Path) -> "Program":
        """Return a program that plays a tone and records it."""
        code = f"from underfoot.bench.stress.programs import play; play({str(record)!r})"
        return Program([sys.executable, "-c", code], record.parent, len(FLOOR.tiles))

    @staticmethod
    def of_window(folder: Path) -> "Program":
        """Return a window that plays a tone."""
        tone().save(folder / "tone.json")
        FLOOR.save(folder / "floor.json")
        options = ["--patch", str(folder / "tone.json"), "--floor", str(folder / "floor.json")]
        return Program([sys.executable, "-m", "underfoot", *options], folder, len(FLOOR.tiles))

    def plays(self, within_s: float, record: Path | None = None) -> bool:
        """Wait until the program has played something, and the recorder, if any, has written it; return whether both
        happened.
        """
        end = time.perf_counter() + within_s
        while time.perf_counter() < end and self._process.poll() is None:
            if self._sounded() > 0 and (record is None or _has_begun(record)):
                return True
            time.sleep(0.02)
        return False

    def kill(self, group: bool) -> OutputAfterKill:
        """Kill the first process, or all at once; wait until the output ends."""
        self._find_rings()
        at = max((_written(ring) for ring in self._rings), default=0)
        if group:
            os.killpg(self._process.pid, signal.SIGKILL)
        else:
            self._process.kill()
        self._process.wait()
        before, still_since = -1, time.perf_counter()
        while time.perf_counter() - still_since < _STILL_S:
            now = max((_written(ring) for ring in self._rings), default=0)
            if now != before:
                before, still_since = now, time.perf_counter()
            time.sleep(0.01)
        return OutputAfterKill(before, max(self._sounded() - at, 0) / _RATE)

    def left(self, within_s: float) -> list[int]:
        """Return the ids of its processes that are still alive after `within_s` seconds."""
        return _waited(self._alive, within_s)

    def blocks(self) -> list[str]:
        """Return the names of its shared memory blocks that remain after a wait."""
        return _waited(lambda: [path.name for path in BLOCKS.glob(f"underfoot_{self._process.pid}_*")], 5.0)

    def said(self) -> str:
        """Return the last line of its standard error."""
        self._errors.seek(0)
        return (self._errors.read().decode(errors="replace").strip().splitlines() or [""])[-1]

    def end(self) -> None:
        """Kill its remaining processes."""
        for pid in self._alive():
            os.kill(pid, signal.SIGKILL)
        self._process.wait()
        self._rings.clear()
        self._errors.close()

    def _alive(self) -> list[int]:
        """Return the ids of the processes of its session; the session number is unique."""
        found = []
        for path in Path("/proc").glob("[0-9]*/stat"):
            try:
                state, _, _, session = path.read_text().rpartition(")")[2].split()[:4]
            except (OSError, ValueError):
                continue
            if int(session) == self._process.pid and state != "Z":
                found.append(int(path.parent.name))
        return found

    def _find_rings(self) -> None:
        """Map the vibration rings, read only; mapped rings stay readable after their names are removed."""
        if self._rings:
            return
        size = _HEADER_BYTES + 4 * _RATE * self._tiles * 4
        for path in BLOCKS.glob(f"underfoot_{self._process.pid}_*"):
            if path.stat().st_size == size:
                self._rings.append(np.memmap(path, np.uint8, "r"))

    def _sounded(self) -> int:
        """Return the frame after the last non-silent one in any of its rings."""
        self._find_rings()
        found = 0
        for ring in self._rings:
            written = _written(ring)
            rows = ring[_HEADER_BYTES:].view(np.float32).reshape(-1, self._tiles)
            loud = np.flatnonzero(np.abs(rows).max(axis=1) > 1e-6)
            if len(loud):
                found = max(found, int((written - (written - 1 - loud) % len(rows)).max()))
        return found


class CpuIdle:
    """Detects that processes have used no processor time for a second of polls, so that loading is finished."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[int, float]] = {}
        """The processor time that each had taken, and since when it is that."""

    def of(self, pid: int) -> bool:
        """Poll the processor time of one process."""
        try:
            found = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return False
        spent, now = int(found[11]) + int(found[12]), time.perf_counter()
        if found[0] != "S" or self._seen.get(pid, (-1, now))[0] != spent:
            self._seen[pid] = (spent, now)
        return now - self._seen[pid][1] > _STILL_S


Found = TypeVar("Found")


def _has_begun(record: Path) -> bool:
    """Return whether the log beside a recording contains blocks."""
    log = record.with_name(f"{record.name}-wal")
    return log.exists() and log.stat().st_size > 100_000


def _written(ring: np.memmap) -> int:
    return int(ring[: HEADER.itemsize].view(HEADER)["written"][0])


def _waited(found: Callable[[], list[Found]], within_s: float) -> list[Found]:
    """Poll `found` until it returns an empty list, or for `within_s` seconds; return the last list."""
    end = time.perf_counter() + within_s
    while (now := found()) and time.perf_counter() < end:
        time.sleep(0.05)
    return now


def _cache() -> Path:
    from underfoot.files import cache_folder

    return cache_folder().parent


def play(record: str) -> None:
    """Play until killed; the main function of `Program.of_session`."""
    session = Session(Target(FLOOR, block=128), tone(), REGISTRY)
    session.record(record)
    session.start()
    while True:
        session.poll()
        time.sleep(0.016)
