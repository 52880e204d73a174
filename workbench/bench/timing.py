"""How long things take, beside how fast this processor is meanwhile."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import machine

_ROUNDS = 5
_THIRDS = 3


class Timed(NamedTuple):
    """What a run takes, in seconds, how slow the processor was meanwhile (`machine.slowness`), and the spread.

    Both are lower quartiles: neighbours on the machine add to most times, and a moment of a quicker clock takes from
    the least. (Over a minute on two shared cores, minima of three seconds each, over the floor's, strayed by 10 to
    12 %, lower quartiles by 3 to 5 %.) What was measured at another time is held against `slowness` times as much: a
    slower clock or a busy neighbour fails nothing, and a faster clock hides nothing. `spread` is how far the first, the
    second and the last third of the runs lie apart, as a share.
    """

    seconds: float
    slowness: float
    spread: float

    @property
    def at_best(self) -> float:
        """The seconds that it would have taken on the processor at its best."""
        return self.seconds / self.slowness


class Run(NamedTuple):
    """What is timed: a call, and the clock that tells its time.

    That of the thread stands still while others have the processor. Where a call waits for another process, it is to be
    the one on the wall.
    """

    call: Callable[[], object]
    clock: Callable[[], float] = time.thread_time


def timed(call: Callable[[], object], budget_s: float = 0.2) -> Timed:
    """Time runs of one thing, as many as fit into `budget_s`, but five at least, after one that is not counted.

    >>> 0.1 < timed(lambda: None, 0.0).slowness < 100.0
    True
    """
    return timed_in_turn([Run(call)], budget_s)[0]


def timed_in_turn(runs: Sequence[Run], budget_s: float, tell: Callable[[str], None] = lambda line: None) -> list[Timed]:
    """Time each of `runs` for about `budget_s`, by turns in several rounds, so that a slow second strikes all alike.

    One run of each, ahead of them, is not counted: it may compile.
    """
    for run in runs:
        run.call()
    looked: list[list[tuple[float, float]]] = [[] for _ in runs]
    for number in range(_ROUNDS):
        tell(f"times: round {number + 1} of {_ROUNDS}")
        for run, found in zip(runs, looked, strict=True):
            found += _turn(run, budget_s / _ROUNDS)
    return [_timed(np.array(found)) for found in looked]


def _turn(run: Run, budget_s: float) -> list[tuple[float, float]]:
    """Seconds and slowness of one run after the other."""
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
