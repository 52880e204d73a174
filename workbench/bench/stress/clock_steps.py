"""A system clock that jumps: a recorded walk is played and recorded while the time of day goes back and forth.

A small library, compiled here, stands between the program and the C library; the time of this machine stays as it is.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.records.recording import Recording

_LONGEST_S = 600.0
_JUMPS_HZ = 5
_SHIM = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

int clock_gettime(clockid_t which, struct timespec *at) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int status = real(which, at);
    if (!status && which == CLOCK_REALTIME) {
        struct timespec now;
        real(CLOCK_MONOTONIC, &now);
        long turn = now.tv_sec * JUMPS_HZ + now.tv_nsec / (1000000000 / JUMPS_HZ);
        at->tv_sec += turn % 2 ? -3600 : 86400;
    }
    return status;
}
int gettimeofday(struct timeval *restrict at, void *restrict zone) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    at->tv_sec = now.tv_sec;
    at->tv_usec = now.tv_nsec / 1000;
    return 0;
}
time_t time(time_t *at) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (at) *at = now.tv_sec;
    return now.tv_sec;
}
"""
"""A clock that is a day fast and an hour slow in turns, for programs that load this library first."""


@dataclass(frozen=True)
class _Played:
    """What a program left: the table of steps, the recorded drive from the first sound on, and missing stretches."""

    steps: bytes
    drive: NDArray[np.float32]
    gaps: int


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield one result; nothing where there is no C compiler, or libraries cannot be loaded first."""
    compiler = shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        progress("stress: clock_steps needs Linux and a C compiler")
        return
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        (folder / "jumps.c").write_text(_SHIM)
        library = folder / "jumps.so"
        options = ["-shared", "-fPIC", f"-DJUMPS_HZ={_JUMPS_HZ}", "-o", str(library), str(folder / "jumps.c"), "-ldl"]
        subprocess.run([compiler, *options], check=True, capture_output=True)
        still = _played(folder / "still", {})
        progress("stress: and once more while the clock jumps")
        jumping = _played(folder / "jumping", {"LD_PRELOAD": str(library)})
    yield _judged(still, jumping)


def _played(folder: Path, changes: dict[str, str]) -> _Played | str:
    """Play the preset walk in real time and record it; return what is left, or the error."""
    folder.mkdir()
    record, steps = folder / "walk.underfoot", folder / "steps.csv"
    command = [sys.executable, "-m", "underfoot", "monitor", "corridor", "--pace", "--patch", "gravel"]
    command += ["--record", str(record), "--steps", str(steps)]
    try:
        done = subprocess.run(command, env={**os.environ, **changes}, capture_output=True, timeout=_LONGEST_S)
    except subprocess.TimeoutExpired:
        return f"not done after {_LONGEST_S:.0f} s"
    if done.returncode:
        return (done.stderr.decode(errors="replace").strip().splitlines() or [f"exit status {done.returncode}"])[-1]
    with Recording(record) as recording:
        drive = recording.vibration()[1]
        gaps = len(recording.gaps())
    begin = int(np.argmax(np.abs(drive).max(axis=1) > 0.0))
    return _Played(steps.read_bytes(), drive[begin:], gaps)


def _judged(still: _Played | str, jumping: _Played | str) -> Outcome:
    what = "a clock that jumps by a day"
    for found in (still, jumping):
        if isinstance(found, str):
            return Outcome(what, 0, found, False)
    assert isinstance(still, _Played)
    assert isinstance(jumping, _Played)
    frames = min(len(still.drive), len(jumping.drive))
    alike = bool(np.array_equal(still.drive[:frames], jumping.drive[:frames]))
    seconds = frames / 48_000.0
    words = (
        f"steps {'the same' if still.steps == jumping.steps else 'OTHERS'}, {seconds:.1f} s of drive "
        f"{'the same to the bit' if alike else 'OTHER'}, {jumping.gaps} gaps"
    )
    good = alike and still.steps == jumping.steps and not jumping.gaps and bool(np.any(jumping.drive))
    return Outcome(what, round(seconds * _JUMPS_HZ), words, good)
