"""How long things take, and how fast this processor is meanwhile."""

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, modal_kernel, widest

FLOOR_NS = 0.030
"""Two fused multiply-adds on the processor whose times the reaches were set from: the least a mode can cost a frame."""

_ROUNDS, _LANES = 16, 64
PAIRS = _LANES * 2 * _ROUNDS
"""Pairs of multiply-adds in a round of the floor."""
_LEAST_REPEATS, MAX_REPEATS = 100, 100_000


class Timed(NamedTuple):
    """The least time of a run in seconds, and how much longer two fused multiply-adds took than `FLOOR_NS` at least.

    The least, because neighbours on the machine only ever add to a time, and more to what needs memory.

    What was set on another processor is held against `slowness` times as much, so that a slower clock or a busy
    neighbour fails nothing, and a faster clock hides nothing.
    """

    seconds: float
    slowness: float


def timed(run: Callable[[], object], budget_s: float = 0.2, most: int = 20) -> Timed:
    """Time up to `most` runs, or what fits into `budget_s`, and the processor's floor between them.

    Two runs ahead of them are not counted.

    >>> 0.1 < timed(lambda: None, most=3).slowness < 100.0
    True
    """
    factors, terms, values = np.full(_LANES, 0.5), np.full(_LANES, 0.1), np.zeros((4, _LANES))
    _fused(factors, terms, values, 1)
    run()
    began = time.perf_counter()
    run()
    # As long as a run: a shorter look would catch moments of a quicker clock that no run can.
    repeats = round((time.perf_counter() - began) / (FLOOR_NS * 1e-9 * PAIRS))
    repeats = min(max(repeats, _LEAST_REPEATS), MAX_REPEATS)
    spent: list[float] = []
    floor: list[float] = []
    while not spent or (len(spent) < most and sum(spent) < budget_s):
        began = time.perf_counter()
        _fused(factors, terms, values, repeats)
        between = time.perf_counter()
        run()
        spent.append(time.perf_counter() - between)
        floor.append(between - began)
    return Timed(min(spent), min(floor) / (repeats * PAIRS) * 1e9 / FLOOR_NS)


def least_s(run: Callable[[], object], budget_s: float = 0.2, most: int = 20) -> float:
    """The least time of up to `most` runs, or of what fits into `budget_s`; two runs ahead of them are not counted.

    >>> least_s(lambda: None, most=3) < 1e-3
    True
    """
    return timed(run, budget_s, most).seconds


@modal_kernel
def _fused(factors: Floats, terms: Floats, values: NDArray[np.float64], repeats: int) -> None:
    # Four chains beside each other in each lane, so that none waits for its last result.
    widest()
    first, second, third, fourth = values[0], values[1], values[2], values[3]
    for _ in range(repeats):
        for m in range(factors.size):
            p, q, r, s = first[m], second[m], third[m], fourth[m]
            a, b = factors[m], terms[m]
            for _ in range(_ROUNDS):
                p = a * p + b
                q = a * q + b
                r = a * r + b
                s = a * s + b
            first[m], second[m], third[m], fourth[m] = p, q, r, s
