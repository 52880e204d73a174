"""The reach of starts: how long a person waits for a command, from its first letter to its last."""

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial

from underfoot.bench.reach.row import Timing
from underfoot.bench.timing import Run
from underfoot.errors import UnderfootError
from underfoot.patch import library

_BEST_S = {"--help": 0.19, "render --seconds 1": 0.62}
"""The best time seen of the first; of the second, what asks 0.8 s of it."""


def timings() -> Iterator[Timing]:
    """Whole processes, imports and all, by the wall clock; kernels are cached."""
    patch = str(library.patches()["gravel"])
    for words, arguments in (("--help", ["--help"]), ("render --seconds 1", ["render", patch, "--seconds", "1"])):
        run = Run(partial(started, [sys.executable, "-m", "underfoot", *arguments]), time.perf_counter)
        yield Timing("starts", f"underfoot {words}, a new process", run, "s", 1.0, _BEST_S[words])


def started(command: Sequence[str]) -> str:
    """What a process prints, from its start to its end. `UnderfootError` where it ends with an error.

    >>> started([sys.executable, "-c", "print(2)"])
    '2\\n'
    """
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UnderfootError(f"{' '.join(command)} fails: {done.stderr.strip().splitlines()[-1]}")
    return done.stdout
