"""Run times, with the present speed of the processor."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import machine

_ROUNDS = 5
_THIRDS = 3


class Timed(NamedTuple):
    """Run time in seconds, the processor's slowness during it (`machine.slowness`), and the spread.

    Both are lower quartiles: other processes lengthen most times, and moments of a faster clock shorten the least.
    (Over a minute on two shared cores, minima of three seconds each, relative to the reference, varied by 10 to 12 %,
    lower quartiles by 3 to 5 %.) A time measured earlier is scaled by `slowness` before a comparison: a slower clock
    or a busy neighbour causes no failure, and a faster clock hides nothing. `spread` is the relative difference
    between the first, second and last third of the runs.
    """

    seconds: float
    slowness: float
    spread: float

    @property
    def at_best(self) -> float:
        """The time in seconds on the processor at its best."""
        return self.seconds / self.slowness


class Run(NamedTuple):
    """A call to be timed, and the clock for it.

    The thread's clock stops while others have the processor. A call that waits for another process needs the wall
    clock.
    """

    call: Callable[[], object]
    clock: Callable[[], float] = time.thread_time


def timed(call: Callable[[], object], budget_s: float = 0.2) -> Timed:
    """Time runs of a call, as many as fit into `budget_s`, but at least five, after one that is not counted.

    >>> 0.1 < timed(lambda: None, 0.0).slowness < 100.0
    True
    """
    return timed_in_turn([Run(call)], budget_s)[0]


def timed_in_turn(
    runs: Sequence[Run], budget_s: float, progress: Callable[[str], None] = lambda line: None
) -> list[Timed]:
    """Time each of `runs` for about `budget_s`, by turns in several rounds, so that a slow second affects all alike.

    A first run of each is not counted: it may compile.
    """
    for run in runs:
        run.call()
    looked: list[list[tuple[float, float]]] = [[] for _ in runs]
    for number in range(_ROUNDS):
        progress(f"times: round {number + 1} of {_ROUNDS}")
        for run, found in zip(runs, looked, strict=True):
            found += _turn(run, budget_s / _ROUNDS)
    return [_timed(np.array(found)) for found in looked]


def _turn(run: Run, budget_s: float) -> list[tuple[float, float]]:
    """Return seconds and slowness of successive runs."""
    found: list[tuple[float, float]] = []
    left = budget_s
    while not found or left > 0.0:
        slow = machine.slowness()
        began = run.clock()
        run.call()
        spent = run.clock() - began
        found.append((spent, slow))
        left -= spent
    return found


def _timed(looked: NDArray[np.float64]) -> Timed:
    seconds, slowness = np.quantile(looked, 0.25, axis=0).tolist()
    thirds = [np.quantile(third, 0.25, axis=0) for third in np.array_split(looked, _THIRDS)]
    apart = [float(third[0] / third[1]) for third in thirds]
    return Timed(seconds, slowness, max(apart) / min(apart) - 1.0)
