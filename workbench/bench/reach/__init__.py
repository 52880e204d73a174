"""The reach of every model: what it is asked to keep, what was measured, and whether it does.

Each file here measures one family. Times that were set on another processor are scaled by how slow this one is at that
moment (`timing.Timed`); ratios are of one run.
"""

from collections.abc import Callable, Iterable, Sequence

from underfoot.bench.reach import floors, friction, impacts, materials, modes, signals
from underfoot.bench.reach.row import TO_COMPARE, Reach
from underfoot.bench.scale import Cost

__all__ = ["FAMILIES", "TO_COMPARE", "Reach", "run"]

FAMILIES: dict[str, Callable[[bool], Iterable[Reach]]] = {
    "signals": signals.reaches,
    "impacts": impacts.reaches,
    "modes": modes.reaches,
    "materials": materials.reaches,
    "friction": friction.reaches,
}
"""What measures each family, quick or in full."""


def run(costs: Sequence[Cost], quick: bool = False, tell: Callable[[str], None] = lambda line: None) -> list[Reach]:
    """Measure every reach; those of large floors are read off what `scale` found."""
    found = []
    for name, family in FAMILIES.items():
        tell(f"reach: {name}")
        found += list(family(quick))
    tell("reach: floors")
    return [*found, *floors.reaches(costs, quick)]
