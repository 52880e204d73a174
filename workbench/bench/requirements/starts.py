"""Requirements on start-up: the wall-clock time of a whole command."""

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from functools import partial

from underfoot.bench.requirements.requirement import Timing
from underfoot.bench.timing import Run
from underfoot.errors import UnderfootError
from underfoot.patch import preset_files

_BEST_S = {"--help": 0.19, "render --seconds 1": 0.62}
"""Best time seen of the first; for the second, the value that requires at most 0.8 s."""


def timings() -> Iterator[Timing]:
    """Yield timings of whole processes, including imports, by the wall clock; kernels are cached."""
    patch = str(preset_files.patches()["gravel"])
    for text, arguments in (("--help", ["--help"]), ("render --seconds 1", ["render", patch, "--seconds", "1"])):
        run = Run(partial(started, [sys.executable, "-m", "underfoot", *arguments]), time.perf_counter)
        yield Timing("starts", f"underfoot {text}, a new process", run, "s", 1.0, _BEST_S[text])


def started(command: Sequence[str]) -> str:
    """Run a process to its end and return what it prints; raise `UnderfootError` if it fails.

    >>> started([sys.executable, "-c", "print(2)"])
    '2\\n'
    """
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise UnderfootError(f"{' '.join(command)} fails: {done.stderr.strip().splitlines()[-1]}")
    return done.stdout
