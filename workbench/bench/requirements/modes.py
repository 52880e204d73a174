"""Requirements on modal banks: time per mode and frame, error after ten seconds, and states that end at 0."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from underfoot.bench import accuracy, rows
from underfoot.bench.requirements.requirement import Requirement, Timing
from underfoot.bench.timing import Run

RATE = 48_000
_BEST_NS = {10: (0.31, 0.118), 64: (0.111, 0.088), 200: (0.094, 0.073)}
"""Best times seen in ns per mode and frame, by number of modes: driven in every frame, and ringing freely."""


def requirements(quick: bool) -> Iterable[Requirement]:
    """Yield errors after 10 s, and what remains in a bank that has decayed."""
    yield from _errors()
    for driven in (True, False):
        what = f"numbers left in a bank after silence, {'driven' if driven else 'struck'}"
        yield Requirement("modes", what, left(driven), high=0)


def timings() -> Iterator[Timing]:
    """Yield the cost of a mode per frame: in a bank driven by noise, and in one struck once at the start."""
    for count, best in _BEST_NS.items():
        for driven, best_ns in zip((True, False), best, strict=True):
            what = f"{'driven in every frame' if driven else 'ringing freely'}, {count} modes"
            second = Run(_second_of(count, driven))
            yield Timing("modes", what, second, "ns a mode and frame", 1e9 / (RATE * count), best_ns)


def _second_of(count: int, driven: bool) -> Callable[[], None]:
    modes = accuracy.modes(count)
    if driven:
        row = rows.driven(modes, RATE, 0.0, np.random.default_rng(1).standard_normal(rows.BLOCK))
    else:
        row = rows.struck(modes, RATE, 0.0, [(0.0, 1.0)])
    state, run = row.state.values, rows.ringing(row, 0, RATE // rows.BLOCK)

    def second() -> None:
        state[:] = 0.0
        run()

    return second


def _errors() -> Iterator[Requirement]:
    for task in accuracy.modal_banks(False):
        ours = task.methods[0]
        for count in ours.values:
            apart = task.error(ours.run(count), count)
            yield Requirement("modes", f"error, {task.task}, {count:.0f} modes", apart, high=1e-9)


def left(driven: bool) -> int:
    """Count the numbers that are not 0 in a bank of 64 modes 20 s after its last excitation."""
    frequencies, decays, amplitudes = accuracy.modes(64)
    modes = frequencies, np.maximum(decays, 5.0), amplitudes
    if driven:
        row = rows.driven(modes, RATE, 1e-5, np.eye(1, rows.BLOCK)[0])
    else:
        row = rows.struck(modes, RATE, 1e-5, [(0.0, 1.0)])
    rows.ringing(row, 0, 1)()
    if driven:
        row.excitation[:] = 0.0
    rows.ringing(row, 1, 20 * RATE // rows.BLOCK - 1)()
    return int(np.count_nonzero(row.state.values))
