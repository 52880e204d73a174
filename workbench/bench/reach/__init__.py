"""The reach of every model: what it is asked to keep, what was measured, and whether it does.

Each file here measures one family. Times are asked to stay near the best that was seen, scaled by how slow the
processor is at that moment (`timing.Timed`).
"""

from collections.abc import Callable, Iterable, Iterator

from underfoot.bench.reach import friction, impacts, materials, modes, signals, starts
from underfoot.bench.reach.row import SPEED, TO_COMPARE, Reach, Timing

__all__ = ["FAMILIES", "SPEED", "TIMINGS", "TO_COMPARE", "Reach", "Timing", "run", "timings"]

FAMILIES: dict[str, Callable[[bool], Iterable[Reach]]] = {
    "signals": signals.reaches,
    "impacts": impacts.reaches,
    "modes": modes.reaches,
    "materials": materials.reaches,
    "friction": friction.reaches,
}
"""What measures each family, quick or in full."""

TIMINGS: tuple[Callable[[], Iterable[Timing]], ...] = (
    impacts.timings,
    modes.timings,
    materials.timings,
    friction.timings,
    starts.timings,
)
"""What has to be timed of them, by turns (`timing.timed_in_turn`)."""


def timings() -> Iterator[Timing]:
    """All that has to be timed."""
    for of_family in TIMINGS:
        yield from of_family()


def run(quick: bool = False, tell: Callable[[str], None] = lambda line: None) -> list[Reach]:
    """Measure every reach that is no time."""
    found = []
    for name, family in FAMILIES.items():
        tell(f"reach: {name}")
        found += list(family(quick))
    return found
